//! The numbers of a model, as its terms read them: of a sheet of tissue, or of a Stokes flow.

use super::parameters::{ModelKind, Parameters};
use super::terms::{MOMENTUM, STOKES, Term, TermStatus};
use crate::form::words::Vector;

/// A Stokes fluid of viscosity 1.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Fluid {
    /// `C_F ≥ 0`, with the substrate.
    pub friction: f64,
}

impl Fluid {
    /// The terms of its equations, on and off.
    pub fn terms(&self) -> Vec<TermStatus> {
        STOKES.iter().filter_map(|term| term.status(self)).collect()
    }
}

/// The numbers of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Numbers<'a> {
    /// Of a Stokes flow.
    Fluid(&'a Fluid),
    /// Of a sheet of tissue.
    Sheet(&'a Parameters),
}

impl<'a> Numbers<'a> {
    /// `C_F`, which every model has.
    pub fn friction(self) -> f64 {
        match self {
            Numbers::Fluid(fluid) => fluid.friction,
            Numbers::Sheet(parameters) => parameters.friction,
        }
    }

    /// Those of a sheet; `None` of a Stokes flow.
    pub fn sheet(self) -> Option<&'a Parameters> {
        match self {
            Numbers::Fluid(_) => None,
            Numbers::Sheet(parameters) => Some(parameters),
        }
    }

    /// The model's balance of momentum.
    pub fn momentum(self) -> &'static [Term<Vector>] {
        match self {
            Numbers::Fluid(_) => STOKES,
            Numbers::Sheet(_) => MOMENTUM,
        }
    }

    /// The kind of sheet whose formulas hold: those of a Stokes flow are the ones of constant density.
    pub fn kind(self) -> ModelKind {
        self.sheet().map_or(ModelKind::Incompressible, Parameters::kind)
    }
}

impl<'a> From<&'a Fluid> for Numbers<'a> {
    fn from(fluid: &'a Fluid) -> Self {
        Numbers::Fluid(fluid)
    }
}

impl<'a> From<&'a Parameters> for Numbers<'a> {
    fn from(parameters: &'a Parameters) -> Self {
        Numbers::Sheet(parameters)
    }
}
