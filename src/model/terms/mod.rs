//! The terms of the equations, each said once: its weak form with its derivatives, its strong form, when it is on, and
//! how a pass of the fixed point takes it.
//!
//! A model is a list of terms. From the lists follow residuals, the blocks of Newton's method, the linear equations of
//! the fixed point, the sources of manufactured solutions, the lines of the energy law, the factors that a scene may
//! give, and what `check` and `summary.json` say. A term that is off is neither assembled nor stored.
//!
//! A new term is a constant in the file of its equation and its name in the list there.
//!
//! A term is a value, which can be tried before it is listed; its derivative is that of differences:
//!
//! ```
//! use std::sync::Arc;
//!
//! use monolayer::form::{Bilinear, Faces, Integrator, mass, words::Vector};
//! use monolayer::mesh::{Point, generate::MeshScene};
//! use monolayer::model::Parameters;
//! use monolayer::model::terms::{At, Functional, Given, Sum, Term, Weak};
//! use monolayer::solve::sparse::Matrix;
//! use monolayer::space::{Continuity, Space, project};
//!
//! /// `(|p|²p|q)`, and `(|p|²δp + 2(p·δp)p|q)`
//! const TERMS: &[Term<Vector>] = &[Term { name: "drag", weak: Weak::Functional(DRAG), ..Term::PLAIN }];
//! const DRAG: Functional<Vector> = Functional {
//!     value: |&At { p, .. }| mass::load(&p.space, 9, |x| p.vector(&x.site).norm_squared() * p.vector(&x.site)),
//!     by_polarity: |&At { p, .. }| Bilinear::cells(12, move |x| {
//!         let p = p.vector(&x.site);
//!         let slope = move |d: Point| p.norm_squared() * d + 2.0 * p.dot(&d) * p;
//!         move |d: Vector, q: Vector| slope(d.value).dot(&q.value)
//!     }),
//!     ..Functional::NOTHING
//! };
//! let mesh = Arc::new(MeshScene::of("square").with("n", 2).build()?);
//! let space = Arc::new(Space::new(&mesh, Continuity::Discontinuous, 3, 2));
//! let (loops, given) = (Integrator::new(&mesh), Given::new(&mesh, &[], Faces::NONE, None, 0.0));
//! let p = |s: f64| project::interpolate_vector(&space, |x| Point::new(x.y + s, x.x - s * x.y));
//! let value = |s| loops.vector(&Sum::of(&[TERMS]).value(&At::new(&Parameters::PLAIN, &p(s), &given)), &space);
//! let (here, size) = (p(0.0), space.dof_count());
//! let form = Sum::of(&[TERMS]).by_polarity(&At::new(&Parameters::PLAIN, &here, &given));
//! let along: Vec<f64> = p(1.0).values.iter().zip(&here.values).map(|(a, b)| a - b).collect();
//! let slope = Matrix::from_triplets(size, size, &loops.triplets(&form, &space, &space)).times(&along);
//! let differences = value(1e-3).into_iter().zip(value(-1e-3)).map(|(a, b)| (a - b) / 2e-3);
//! assert!(differences.zip(slope).all(|(a, b)| (a - b).abs() < 1e-6));
//! # Ok::<(), monolayer::mesh::MeshError>(())
//! ```

mod at;
pub mod factor;
mod flow;
pub mod mass;
pub mod momentum;
pub mod polarity;
pub mod power;
pub mod stokes;
mod sum;

use serde::Serialize;

pub use at::{At, Given};
pub use factor::{Factor, Factors};
pub use flow::FlowTerms;
pub use mass::MASS;
pub use momentum::MOMENTUM;
pub use polarity::{MOLECULAR, POLARITY};
pub use power::{Line, Loops, Power};
pub use stokes::STOKES;
pub use sum::Sum;

use super::manufactured::{Matrix, Series};
use super::numbers::Numbers;
use super::parameters::{ModelKind, Parameters};
use crate::form::words::{Jet, Scalar, Vector};
use crate::form::{Bilinear, Density, Linear};
use crate::mesh::Point;
use crate::space::Space;

/// One term of one equation; `V` are the jets of the equation's test functions.
///
/// The weak form is written as `formula` has it, the strong form as the residual has it, both but for the factor.
pub struct Term<V: Jet> {
    /// Short name, e.g. `friction`.
    pub name: &'static str,
    /// Its weak form as the model page writes it.
    pub formula: Formula,
    /// The equation of the model page that has it.
    pub tag: &'static str,
    /// Where the formula stands: on the right it enters the residual with the opposite sign.
    pub side: Side,
    /// The key of `[model]` that is its factor, where it has one of its own.
    pub factor: Option<Factor>,
    /// Whether a term without a factor of its own is on; `None` where the model does not have it, or another one in its
    /// place.
    pub on: fn(Numbers) -> Option<Switch>,
    /// Its weak form.
    pub weak: Weak<V>,
    /// How a pass of the fixed point takes it.
    pub pass: Pass,
    /// Its strong form.
    pub strong: Strong,
    /// Its line of the energy law, where it has one.
    pub power: Option<Power>,
}

/// The side of an equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// With the rates of change.
    Left,
    /// With the forces.
    Right,
}

/// The formula of a term in the sheets that have it; in a Stokes flow it is that of the incompressible sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Formula {
    /// Incompressible, then compressible.
    Both(&'static str, &'static str),
    /// Of a term that the incompressible sheet alone has.
    Incompressible(&'static str),
    /// Of a term that the compressible sheet alone has.
    Compressible(&'static str),
}

/// Whether a term is on, and why.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Switch {
    /// It cannot be switched off.
    Always,
    /// By the value of a key; 0 switches it off.
    By(&'static str, f64),
}

/// A linear form at a state.
pub type Form<V> = for<'a> fn(&At<'a>) -> Linear<'a, V>;
/// The derivative of a form along a field, whose jets are `U`.
pub type Derivative<U, V> = for<'a> fn(&At<'a>) -> Bilinear<'a, U, V>;
/// A matrix of the flow, which depends on the density at most.
pub type FlowMatrix = for<'a> fn(&Space, Density<'a>) -> Bilinear<'a, Vector, Vector>;

/// The weak form of a term.
pub enum Weak<V: Jet> {
    /// A part of the equations' frame that the models assemble themselves: a rate of change, the multiplier, the
    /// auxiliary field.
    Frame,
    /// In the weak form of the term of that name, because one integrand for both is cheaper.
    With(&'static str),
    /// Linear in the flow. Nothing else of the parameters is in it, so that two sheets of equal weights have the same
    /// matrix.
    Flow {
        /// What multiplies both.
        weight: fn(Numbers) -> f64,
        /// The bilinear form of velocity and test function.
        matrix: FlowMatrix,
        /// How its product with the flow depends on the density.
        by_density: Derivative<Scalar, V>,
    },
    /// A functional of the fields.
    Functional(Functional<V>),
}

/// A functional of the fields with its derivatives.
pub struct Functional<V: Jet> {
    /// The form at a state.
    pub value: Form<V>,
    /// Its derivative along v.
    pub by_velocity: Derivative<Vector, V>,
    /// Its derivative along ρ.
    pub by_density: Derivative<Scalar, V>,
    /// Its derivative along p, but for the part that acts on both components alike.
    pub by_polarity: Derivative<Vector, V>,
    /// The part of the derivative along the polarity that acts on both components alike.
    pub by_components: Derivative<Scalar, Scalar>,
    /// Along `L_h/B`.
    pub by_field: Derivative<Vector, V>,
    /// Whether `by_polarity` or `by_field` has integrals over the faces between cells: the blocks that they take are
    /// stored where such a term is on, and only there.
    pub wide: bool,
    /// Linear in the polarity, with a matrix that acts on both components alike and that only the density changes:
    /// assembled once where that is 1.
    pub is_constant: bool,
}

/// How a pass of the fixed point takes a term of the polarity's equation; the terms of other equations are evaluated
/// with the fields that are known by then.
pub enum Pass {
    /// At the last iterate.
    Lagged,
    /// Linear in the polarity, at the new iterate; `data` is what does not depend on it.
    Implicit {
        /// What does not depend on the polarity.
        data: Option<Form<Vector>>,
    },
    /// The operator, which acts on both components alike, is that of the last iterate, and so is the rest.
    Frozen {
        /// Acts on the new iterate.
        operator: Derivative<Scalar, Scalar>,
        /// What is taken at the last iterate.
        rest: Form<Vector>,
    },
}

/// What a term adds to the residual of smooth fields at a point.
pub enum Strong {
    /// The sources have it themselves.
    Frame,
    /// Of the density's equation.
    Scalar(fn(&Series) -> f64),
    /// Of the equation of the momentum or of the polarity.
    Vector(fn(&Series) -> Point),
    /// `−div(σᵀ)`, given σ up to degree 1.
    Stress(fn(&Series) -> Matrix),
}

fn no_form<'a, V: Jet>(_: &At<'a>) -> Linear<'a, V> {
    Linear::zero()
}

fn no_derivative<'a, U: Jet, V: Jet>(_: &At<'a>) -> Bilinear<'a, U, V> {
    Bilinear::zero()
}

impl<V: Jet> Functional<V> {
    /// A functional of nothing, to be filled in.
    pub const NOTHING: Self = Self {
        value: no_form,
        by_velocity: no_derivative,
        by_density: no_derivative,
        by_polarity: no_derivative,
        by_components: no_derivative,
        by_field: no_derivative,
        wide: false,
        is_constant: false,
    };
}

impl<V: Jet> Term<V> {
    /// A term on the left that every sheet has and the models assemble, to be filled in.
    pub const PLAIN: Self = Self {
        name: "",
        formula: Formula::Both("", ""),
        tag: "",
        side: Side::Left,
        factor: None,
        on: |_| Some(Switch::Always),
        weak: Weak::Frame,
        pass: Pass::Lagged,
        strong: Strong::Frame,
        power: None,
    };

    /// Whether it is on in a model; `None` where the model does not have it.
    pub fn switch<'a>(&self, numbers: impl Into<Numbers<'a>>) -> Option<Switch> {
        let numbers = numbers.into();
        self.formula.of(numbers.kind())?;
        match &self.factor {
            Some(factor) => Some(Switch::By(factor.key, numbers.sheet()?.factors.of(factor.key))),
            None => (self.on)(numbers),
        }
    }

    /// Whether a model has it, and it is on.
    pub fn is_on<'a>(&self, numbers: impl Into<Numbers<'a>>) -> bool {
        self.switch(numbers).is_some_and(Switch::is_on)
    }

    /// Its own factor, 1 without one.
    pub fn factor<'a>(&self, numbers: impl Into<Numbers<'a>>) -> f64 {
        let given = || numbers.into().sheet().map(|parameters| parameters.factors);
        self.factor.as_ref().map_or(1.0, |factor| given().map_or(0.0, |factors| factors.of(factor.key)))
    }

    /// What its weak form is multiplied by in the residual.
    pub fn scale<'a>(&self, numbers: impl Into<Numbers<'a>>) -> f64 {
        match self.side {
            Side::Left => self.factor(numbers),
            Side::Right => -self.factor(numbers),
        }
    }

    pub(super) fn status<'a>(&self, numbers: impl Into<Numbers<'a>>) -> Option<TermStatus> {
        let numbers = numbers.into();
        let formula = self.formula.of(numbers.kind())?;
        let switch = self.switch(numbers)?;
        Some(TermStatus { name: self.name, formula, on: switch.is_on(), reason: switch.reason() })
    }
}

impl Formula {
    /// In a sheet of this kind, if that has the term.
    pub fn of(self, kind: ModelKind) -> Option<&'static str> {
        match (self, kind) {
            (Formula::Both(formula, _) | Formula::Incompressible(formula), ModelKind::Incompressible)
            | (Formula::Both(_, formula) | Formula::Compressible(formula), ModelKind::Compressible) => Some(formula),
            (Formula::Compressible(_), ModelKind::Incompressible)
            | (Formula::Incompressible(_), ModelKind::Compressible) => None,
        }
    }
}

impl Switch {
    fn is_on(self) -> bool {
        match self {
            Switch::Always => true,
            Switch::By(_, value) => value != 0.0,
        }
    }

    fn reason(self) -> String {
        match self {
            Switch::Always => "always on".to_owned(),
            Switch::By(key, value) => format!("{key} = {value}"),
        }
    }
}

/// A term as it is told: on or off, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TermStatus {
    /// Short name, such as `friction`.
    pub name: &'static str,
    /// As the weak form has it, e.g. `C_F (v|w)`.
    pub formula: &'static str,
    /// A term that is off is neither assembled nor stored.
    pub on: bool,
    /// E.g. `friction = 3`.
    pub reason: String,
}

impl Parameters {
    /// The terms of the semi-discrete system, on and off: [7.11], or [7.34] of the compressible sheet.
    pub fn terms(&self) -> Vec<TermStatus> {
        let vector = |list: &'static [Term<Vector>]| list.iter().filter_map(|term| term.status(self));
        let mass = MASS.iter().filter_map(|term| term.status(self));
        vector(MOMENTUM).chain(mass).chain(vector(POLARITY)).chain(vector(MOLECULAR)).collect()
    }
}
