//! The output fields, each said once: its name, symbol and columns, what it is made of, and how it is found in a state.
//!
//! A new one is a constant in a file of its own and its name in [`ALL`]. From the list follow the keys of scenes and
//! what they are refused with, arrays of VTU files, columns of cuts, quantities of maps and films and of curves along
//! sections, what a run takes of memory and disk, a table in `docs/scene.md` that a test compares, and the tests of
//! `tests/output_fields.rs`.

mod density;
mod divergence;
mod elastic_strain;
mod molecular_field;
mod polarity;
mod polarity_laplacian;
mod pressure;
mod shown;
mod stream_function;
mod tissue_velocity;
mod velocity;
mod vorticity;

use std::borrow::Cow;
use std::fmt;
use std::sync::LazyLock;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub use self::density::DENSITY;
pub use self::elastic_strain::ELASTIC_STRAIN;
pub use self::molecular_field::MOLECULAR_FIELD;
pub use self::polarity::POLARITY;
pub use self::polarity_laplacian::POLARITY_LAPLACIAN;
pub use self::pressure::PRESSURE;
pub use self::shown::{At, Fields, FlowFields, TissueFields, Tools};
pub use self::stream_function::STREAM_FUNCTION;
pub use self::tissue_velocity::TISSUE_VELOCITY;
pub use self::velocity::VELOCITY;
use super::MeasureError;
use crate::mesh::Point;
use crate::model::{FieldId, ModelKind, Parameters, fields};
use crate::schema::listed::{self, Listed};
use crate::schema::{self, FLOWS, TISSUE, WITH_DENSITY, WITH_PRESSURE};
use crate::space::Field;

/// Every output field, in the order of arrays in files: what is asked for most comes first, the only tensor last.
pub const ALL: &[&OutputField] = &[
    &VELOCITY,
    &PRESSURE,
    &DENSITY,
    &POLARITY,
    &MOLECULAR_FIELD,
    &STREAM_FUNCTION,
    &TISSUE_VELOCITY,
    &POLARITY_LAPLACIAN,
    &vorticity::VORTICITY,
    &divergence::DIVERGENCE,
    &ELASTIC_STRAIN,
];

/// The columns of cuts where a scene names none, in their order; those that a state does not have are left out.
pub const IN_CUTS: &[&OutputField] = &[&VELOCITY, &PRESSURE, &POLARITY, &DENSITY, &POLARITY_LAPLACIAN, &ELASTIC_STRAIN];

/// What can be written of a state, point by point. Two of one name are the same.
pub struct OutputField {
    /// As in the scene file; the name of its array in VTU files.
    pub name: &'static str,
    /// As in formulas.
    pub symbol: Symbol,
    /// What it is, in a line for `docs/scene.md`.
    pub help: &'static str,
    /// In brackets behind the name along an axis.
    pub unit: &'static str,
    /// How many numbers it is at a point.
    pub value: Value,
    /// Its columns in the tables of cuts, one for each component.
    pub columns: &'static [&'static str],
    /// Its scalars, as maps and curves along sections show them.
    pub parts: &'static [Part],
    /// The fields of the model that it is made of: scenes of kinds that have them can have it.
    pub needs: &'static [FieldId],
    /// What the parameters of a tissue must be for it.
    pub rules: &'static [Rule],
    /// What has to be made once for the domain.
    pub tool: Option<Tool>,
    /// Finds it in a state: a field in any space whose degree is not above the highest of the model's; `None` where
    /// there is none.
    pub find: for<'a> fn(&At<'a>) -> Result<Option<Field>, MeasureError>,
}

/// How many numbers a field is at a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Value {
    /// One.
    Scalar,
    /// Two.
    Vector,
    /// A symmetric tensor, in the order 11, 12, 22.
    Tensor,
}

/// A symbol, which may be another one where a density weighs the terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Symbol {
    plain: &'static str,
    weighed: &'static str,
}

/// A scalar of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// As in the `maps` of scenes.
    pub name: &'static str,
    /// In words, as in titles.
    pub title: &'static str,
    /// As in formulas.
    pub symbol: Symbol,
    /// What it is of the field.
    pub of: PartOf,
    /// Whether values below zero have colours of their own.
    pub signed: bool,
    /// Whether curves along sections show it without being asked.
    pub in_curves: bool,
}

/// What a scalar is of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartOf {
    /// The component of this number.
    Component(usize),
    /// The length of a vector.
    Length,
}

/// What the parameters of a tissue must be.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// Whether they are.
    pub holds: fn(&Parameters) -> bool,
    /// What is broken where they are not.
    pub rule: &'static str,
    /// What to do then.
    pub hint: &'static str,
}

/// What is made once for a domain, and takes memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tool {
    /// The factorised equation of the stream function.
    StreamFunction,
    /// The equation of the elastic strain; the scene must have the table `[strain]`.
    Strain,
}

/// A scalar with the field that it belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scalar {
    /// The field.
    pub field: &'static OutputField,
    /// What of it.
    pub part: &'static Part,
}

impl Value {
    /// Numbers at a point.
    pub const fn components(self) -> usize {
        match self {
            Value::Scalar => 1,
            Value::Vector => 2,
            Value::Tensor => 3,
        }
    }

    /// Numbers at a node of a VTU file: VTK knows vectors and tensors of space alone.
    pub fn written(self) -> usize {
        match self {
            Value::Scalar => 1,
            Value::Vector => 3,
            Value::Tensor => 6,
        }
    }
}

impl Symbol {
    /// The same in every sheet.
    pub const fn same(symbol: &'static str) -> Self {
        Self { plain: symbol, weighed: symbol }
    }

    /// Another one in a compressible sheet.
    pub const fn weighed(plain: &'static str, weighed: &'static str) -> Self {
        Self { plain, weighed }
    }

    /// In a sheet of this kind.
    pub fn of(self, kind: ModelKind) -> &'static str {
        match kind {
            ModelKind::Incompressible => self.plain,
            ModelKind::Compressible => self.weighed,
        }
    }
}

impl fmt::Display for Symbol {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "`{}`", self.plain)?;
        if self.plain == self.weighed {
            return Ok(());
        }
        write!(out, ", in a compressible sheet `{}`", self.weighed)
    }
}

impl Part {
    /// A component, on either side of zero.
    pub const fn component(name: &'static str, title: &'static str, symbol: Symbol, component: usize) -> Self {
        Self { name, title, symbol, of: PartOf::Component(component), signed: true, in_curves: false }
    }

    /// The length of a vector.
    pub const fn length(name: &'static str, title: &'static str, symbol: Symbol) -> Self {
        Self { name, title, symbol, of: PartOf::Length, signed: false, in_curves: false }
    }

    /// With colours from dark to light.
    #[must_use]
    pub const fn unsigned(self) -> Self {
        Self { signed: false, ..self }
    }

    /// Shown along sections without being asked for.
    #[must_use]
    pub const fn in_curves(self) -> Self {
        Self { in_curves: true, ..self }
    }
}

impl Scalar {
    /// Every scalar, field by field.
    pub fn all() -> impl Iterator<Item = Scalar> {
        ALL.iter().flat_map(|field| field.parts.iter().map(|part| Scalar { field, part }))
    }

    /// The scalar of this name.
    pub fn named(name: &str) -> Option<Scalar> {
        Self::all().find(|scalar| scalar.part.name == name)
    }

    /// Its columns in the tables of cuts: one, or those whose length is taken.
    pub fn columns(self) -> &'static [&'static str] {
        match self.part.of {
            PartOf::Component(c) => &self.field.columns[c..=c],
            PartOf::Length => self.field.columns,
        }
    }

    /// Its value at a reference point of a cell, where the field is found.
    pub fn at(self, field: &Field, cell: usize, xi: Point) -> f64 {
        match self.part.of {
            PartOf::Component(c) => field.component_at(cell, xi, c),
            PartOf::Length => field.vector_at(cell, xi).norm(),
        }
    }
}

impl OutputField {
    /// The field of this name.
    pub fn named(name: &str) -> Option<&'static OutputField> {
        ALL.iter().copied().find(|field| field.name == name)
    }

    /// Each once, in the order of [`ALL`].
    pub fn in_order(fields: &[&'static OutputField]) -> Vec<&'static OutputField> {
        ALL.iter().copied().filter(|field| fields.contains(field)).collect()
    }

    /// The length of a vector as a scalar.
    pub fn length(&'static self) -> Option<Scalar> {
        let part = self.parts.iter().find(|part| part.of == PartOf::Length)?;
        Some(Scalar { field: self, part })
    }

    /// The rule that a tissue of these parameters breaks.
    pub fn broken_by(&self, parameters: &Parameters) -> Option<&'static Rule> {
        self.rules.iter().find(|rule| !(rule.holds)(parameters))
    }

    /// Whether these fields of a model are enough for it.
    pub fn is_made_of(&self, fields: &[FieldId]) -> bool {
        self.needs.iter().all(|need| fields.contains(need))
    }

    /// The kinds of scenes that can have it, as for `x-kinds`.
    pub fn kinds(&self) -> String {
        let has = |kind: &&str| self.needs.iter().all(|need| kinds_with(need).split(' ').any(|one| one == *kind));
        FLOWS.split(' ').filter(has).collect::<Vec<_>>().join(" ")
    }

    /// What has it, in words.
    pub fn subject(&self) -> String {
        let kinds = self.kinds();
        if kinds == FLOWS { "any flow".to_owned() } else { kinds.replace(TISSUE, "tissue").replace(' ', ", ") }
    }
}

/// The kinds of scenes that have a field of the model.
fn kinds_with(field: FieldId) -> &'static str {
    match field {
        id if *id == *fields::VELOCITY => FLOWS,
        id if *id == *fields::PRESSURE => WITH_PRESSURE,
        id if *id == *fields::DENSITY => WITH_DENSITY,
        _ => TISSUE,
    }
}

impl PartialEq for OutputField {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for OutputField {}

impl fmt::Debug for OutputField {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name)
    }
}

impl Serialize for OutputField {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name)
    }
}

impl Listed for &'static OutputField {
    const WHAT: &'static str = "Field";

    fn names() -> &'static [&'static str] {
        static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| ALL.iter().map(|field| field.name).collect());
        &NAMES
    }

    fn named(name: &str) -> Option<Self> {
        OutputField::named(name)
    }
}

impl<'de> Deserialize<'de> for &'static OutputField {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        listed::read(deserializer)
    }
}

impl JsonSchema for OutputField {
    fn schema_name() -> Cow<'static, str> {
        "Field".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let choice = |field: &&OutputField| {
            let mut choice = schema::choice(field.name, field.help);
            choice["x-kinds"] = field.kinds().into();
            choice
        };
        json_schema!({ "oneOf": ALL.iter().map(choice).collect::<Vec<_>>() })
    }
}
