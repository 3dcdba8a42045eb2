//! What acts on a tissue or a Stokes flow from outside: given forces, or those that make given fields exact.

use std::sync::Arc;

use super::manufactured::Exact;
use super::numbers::Numbers;
use super::parameters::ModelKind;
use super::terms::TermStatus;
use crate::expression::Expression;
use crate::mesh::Point;

/// Sources `f_v`, `f_ρ` and `f_p`; zero in a physical scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sources {
    /// `f_v`; without it, that of the exact fields if there are any.
    pub force: Option<[Expression; 2]>,
    /// `f_p`; without it, that of the exact fields if there are any.
    pub polarity: Option<[Expression; 2]>,
    /// `f_ρ`; without it, that of the exact fields if they have a density.
    pub density: Option<Expression>,
    /// Fields that solve the equations with the sources that they make.
    pub exact: Option<Arc<Exact>>,
    /// Whether the exact fields give the data of natural boundary conditions, too.
    pub exact_boundary: bool,
}

impl Sources {
    /// Whether there is an `f_v`.
    pub fn has_force(&self) -> bool {
        self.force.is_some() || self.exact.is_some()
    }

    /// Whether there is an `f_p`.
    pub fn has_polarity(&self) -> bool {
        self.polarity.is_some() || self.exact.as_ref().is_some_and(|exact| exact.has_polarity())
    }

    /// Whether there is an `f_ρ`.
    pub fn has_density(&self) -> bool {
        self.density.is_some() || self.exact.as_ref().is_some_and(|exact| exact.volume().density().is_some())
    }

    /// What is told of them beside the terms of a model.
    pub fn terms<'a>(&self, numbers: impl Into<Numbers<'a>>) -> Vec<TermStatus> {
        let exact = self.exact.is_some();
        let source = |name, formula, given: bool| {
            let reason = match (given, exact) {
                (true, _) => "given in [source]",
                (false, true) => "from [exact]",
                (false, false) => "not given",
            };
            TermStatus { name, formula, on: given || exact, reason: reason.to_owned() }
        };
        let mut terms = vec![source("force", "(f_v|w)", self.force.is_some())];
        let Some(parameters) = numbers.into().sheet() else { return terms };
        match parameters.kind() {
            ModelKind::Incompressible => {}
            ModelKind::Compressible => terms.push(source("density source", "(f_ρ|z)", self.density.is_some())),
        }
        terms.push(source("polarity source", "(f_p|q)", self.polarity.is_some()));
        terms
    }

    /// The formulas that a scene gives, by key.
    pub fn data(&self) -> [(&'static str, Vec<&Expression>); 4] {
        fn given(pair: &Option<[Expression; 2]>) -> Vec<&Expression> {
            pair.iter().flatten().collect()
        }
        [
            ("source.force", given(&self.force)),
            ("source.polarity", given(&self.polarity)),
            ("source.density", self.density.iter().collect()),
            ("exact", self.exact.iter().flat_map(|exact| exact.formulas()).collect()),
        ]
    }

    /// The same for use at the time `t` alone: what depends on time only is computed now.
    #[must_use]
    pub fn at_time(&self, t: f64) -> Self {
        Self { exact: self.exact.as_ref().map(|exact| Arc::new(exact.at_time(t))), ..self.clone() }
    }

    /// `f_v(x, t)`
    pub fn force<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> Point {
        match (&self.force, &self.exact) {
            (Some([f, g]), _) => Point::new(f.eval(x, t), g.eval(x, t)),
            (None, Some(exact)) => exact.force(numbers, x, t),
            (None, None) => Point::zeros(),
        }
    }

    /// `f_p(x, t)`
    pub fn polarity<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> Point {
        match (&self.polarity, &self.exact) {
            (Some([f, g]), _) => Point::new(f.eval(x, t), g.eval(x, t)),
            (None, Some(exact)) => exact.polarity_source(numbers, x, t),
            (None, None) => Point::zeros(),
        }
    }

    /// `f_ρ(x, t)`
    pub fn density<'a>(&self, numbers: impl Into<Numbers<'a>>, x: Point, t: f64) -> f64 {
        match (&self.density, &self.exact) {
            (Some(f), _) => f.eval(x, t),
            (None, Some(exact)) => exact.density_source(numbers, x, t),
            (None, None) => 0.0,
        }
    }

    /// The exact fields, where they give the boundary data.
    pub fn boundary(&self) -> Option<&Arc<Exact>> {
        self.exact.as_ref().filter(|_| self.exact_boundary)
    }

    /// All formulas of vectors in pairs, to be checked where they are used.
    pub fn formulas(&self) -> impl Iterator<Item = &[Expression; 2]> {
        let exact = self.exact.iter().flat_map(|e| e.vectors());
        self.force.iter().chain(&self.polarity).chain(exact)
    }

    /// All formulas of densities, to be checked where they are used.
    pub fn density_formulas(&self) -> impl Iterator<Item = &Expression> {
        self.density.iter().chain(self.exact.iter().filter_map(|e| e.volume().density()))
    }
}
