//! The fields of a model by their names, their values at one time, and numbers that each of them has.
//!
//! A model is a list of fields and lists of [terms](super::terms). From the list of fields follow what is carried from
//! step to step, checkpoints, residuals, errors, and the names in tables and pictures.

use std::fmt;
use std::ops::Index;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::space::Field;

/// What a field is.
#[derive(Debug)]
pub struct FieldSpec {
    /// As in tables, e.g. `velocity`.
    pub name: &'static str,
    /// As in formulas, e.g. `v`.
    pub symbol: &'static str,
    /// How it is found.
    pub role: Role,
    /// The column of the residual of its equation; of auxiliary fields there is none.
    pub residual: &'static str,
}

/// How a field is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It follows from the others without delay: a velocity or a multiplier.
    Flow,
    /// It has a rate of change.
    Carried,
    /// It follows from one of the others cell by cell, `(Y|q) = form(q)`, and is no unknown of its own.
    Auxiliary,
}

/// A field, by what it is.
pub type FieldId = &'static FieldSpec;

/// `v`
pub const VELOCITY: FieldId =
    &FieldSpec { name: "velocity", symbol: "v", role: Role::Flow, residual: "residual_velocity" };
/// `Π`, which keeps a flow free of divergence.
pub const PRESSURE: FieldId =
    &FieldSpec { name: "pressure", symbol: "Π", role: Role::Flow, residual: "residual_pressure" };
/// `ρ`, which a flow carries and compresses.
pub const DENSITY: FieldId =
    &FieldSpec { name: "density", symbol: "ρ", role: Role::Carried, residual: "residual_density" };
/// `p`
pub const POLARITY: FieldId =
    &FieldSpec { name: "polarity", symbol: "p", role: Role::Carried, residual: "residual_polarity" };
/// `Δ_h p`
pub const LAPLACIAN: FieldId = &FieldSpec { name: "laplacian", symbol: "Δ_h p", role: Role::Auxiliary, residual: "" };
/// `div_h(ρ∇p)`
pub const DIFFUSION: FieldId =
    &FieldSpec { name: "diffusion", symbol: "div_h(ρ∇p)", role: Role::Auxiliary, residual: "" };

/// Every field of every model, in the order of columns.
pub const ALL: [FieldId; 6] = [VELOCITY, PRESSURE, DENSITY, POLARITY, LAPLACIAN, DIFFUSION];

/// The field whose equation has the residual in this column.
pub fn of_residual(column: &str) -> Option<FieldId> {
    ALL.into_iter().find(|field| !column.is_empty() && field.residual == column)
}

/// The field of this name.
pub fn named(name: &str) -> Option<FieldId> {
    ALL.into_iter().find(|field| field.name == name)
}

impl PartialEq for FieldSpec {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for FieldSpec {}

impl Serialize for FieldSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

impl<'de> Deserialize<'de> for FieldId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        named(&name).ok_or_else(|| D::Error::custom(format!("there is no field `{name}`")))
    }
}

/// The fields of a model at one time: `state[VELOCITY]` is its velocity.
#[derive(Debug, Clone)]
pub struct State {
    fields: Vec<(FieldId, Field)>,
}

impl State {
    /// Of these fields.
    pub fn of(fields: impl IntoIterator<Item = (FieldId, Field)>) -> Self {
        Self { fields: fields.into_iter().collect() }
    }

    /// All fields, in the order of the model's list.
    pub fn fields(&self) -> impl Iterator<Item = (FieldId, &Field)> {
        self.fields.iter().map(|(id, field)| (*id, field))
    }

    /// The values of one; `None` where the model does not have it.
    pub fn get(&self, id: FieldId) -> Option<&Field> {
        self.fields().find(|(known, _)| *known == id).map(|(_, field)| field)
    }

    /// With other values of one of its fields.
    ///
    /// # Panics
    /// Where the model does not have it.
    #[must_use]
    pub fn with(mut self, id: FieldId, values: Field) -> Self {
        let place = self.fields.iter_mut().find(|(known, _)| *known == id);
        place.unwrap_or_else(|| panic!("the model has no {}", id.name)).1 = values;
        self
    }

    /// Adds to the values of one of its fields.
    ///
    /// # Panics
    /// Where the model does not have it.
    pub fn add(&mut self, id: FieldId, change: &[f64]) {
        let place = self.fields.iter_mut().find(|(known, _)| *known == id);
        let (_, field) = place.unwrap_or_else(|| panic!("the model has no {}", id.name));
        crate::solve::axpy(1.0, change, &mut field.values);
    }

    /// The values of one alone.
    ///
    /// # Panics
    /// Where the model does not have it.
    pub fn into_field(mut self, id: FieldId) -> Field {
        let place = self.fields.iter().position(|(known, _)| *known == id);
        self.fields.swap_remove(place.unwrap_or_else(|| panic!("the model has no {}", id.name))).1
    }

    /// The coefficients of the carried fields, one field after the other.
    pub fn carried(&self) -> Vec<f64> {
        let carried = self.fields().filter(|(id, _)| id.role == Role::Carried);
        carried.flat_map(|(_, field)| field.values.iter().copied()).collect()
    }
}

impl Index<FieldId> for State {
    type Output = Field;

    /// # Panics
    /// Where the model does not have the field.
    fn index(&self, id: FieldId) -> &Field {
        self.get(id).unwrap_or_else(|| panic!("the model has no {}", id.name))
    }
}

/// Residuals of the stationary equations, field by field, each `(rᵀMr/|Ω|)^½`   [9.8], [9.9], [9.10]; that of the
/// momentum balance by the force of `model::scales`. That of the pressure is of `div v = 0`, that of the density of its
/// transport.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals(Vec<(FieldId, f64)>);

impl Residuals {
    /// Of these fields.
    pub fn of(residuals: impl IntoIterator<Item = (FieldId, f64)>) -> Self {
        Self(residuals.into_iter().collect())
    }

    /// Root of the sum of squares.
    pub fn total(&self) -> f64 {
        self.0.iter().fold(0.0, |sum: f64, (_, residual)| sum.hypot(*residual))
    }

    /// Each, with its field.
    pub fn each(&self) -> impl Iterator<Item = (FieldId, f64)> {
        self.0.iter().copied()
    }
}

impl Serialize for Residuals {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(id, residual)| (id.name, residual)))
    }
}

impl fmt::Display for FieldSpec {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name)
    }
}
