//! Distance of a state from exact fields, in space; sums and maxima over time make the norms of [9.12].

use rayon::prelude::*;
use serde::Serialize;

use crate::form::power::energy_density;
use crate::form::{CellPoint, Integrator};
use crate::mesh::Point;
use crate::model::incompressible::Incompressible;
use crate::model::parameters::ModelKind;
use crate::model::{ElasticForce, Exact, State};
use crate::time::{Kind, Sheet};

/// A field whose error is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ErrorField {
    /// `v`
    Velocity,
    /// `Π` less its mean, where only differences of pressure count.
    Pressure,
    /// `ρ`
    Density,
    /// `p`
    Polarity,
    /// `Δ_h p`
    Laplacian,
    /// `div_h(ρ∇p)`
    Diffusion,
}

/// How many fields there are.
const FIELDS: usize = ErrorField::ALL.len();

impl ErrorField {
    pub const ALL: [ErrorField; 6] = [
        ErrorField::Velocity,
        ErrorField::Pressure,
        ErrorField::Density,
        ErrorField::Polarity,
        ErrorField::Laplacian,
        ErrorField::Diffusion,
    ];

    /// Those of an incompressible sheet.
    pub const INCOMPRESSIBLE: [ErrorField; 4] =
        [ErrorField::Velocity, ErrorField::Pressure, ErrorField::Polarity, ErrorField::Laplacian];

    /// Those of a compressible sheet.
    pub const COMPRESSIBLE: [ErrorField; 4] =
        [ErrorField::Velocity, ErrorField::Density, ErrorField::Polarity, ErrorField::Diffusion];

    /// Those of a model.
    pub fn of(kind: ModelKind) -> [ErrorField; 4] {
        match kind {
            ModelKind::Incompressible => Self::INCOMPRESSIBLE,
            ModelKind::Compressible => Self::COMPRESSIBLE,
        }
    }

    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            ErrorField::Velocity => "velocity",
            ErrorField::Pressure => "pressure",
            ErrorField::Density => "density",
            ErrorField::Polarity => "polarity",
            ErrorField::Laplacian => "laplacian",
            ErrorField::Diffusion => "diffusion",
        }
    }

    /// As in plots.
    pub fn symbol(self) -> &'static str {
        match self {
            ErrorField::Velocity => "v",
            ErrorField::Pressure => "Π",
            ErrorField::Density => "ρ",
            ErrorField::Polarity => "p",
            ErrorField::Laplacian => "Δ_h p",
            ErrorField::Diffusion => "div_h(ρ∇p)",
        }
    }
}

/// A norm in time and space   [9.12]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Norm {
    /// `(Σ_n Δt_n ‖e^n‖²)^½` with the norm of L².
    #[serde(rename = "L2(L2)")]
    Square,
    /// `max_n max_x |e^n(x)|` over the quadrature points.
    #[serde(rename = "Linf(Linf)")]
    Largest,
}

impl Norm {
    pub const ALL: [Norm; 2] = [Norm::Square, Norm::Largest];

    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Norm::Square => "L2(L2)",
            Norm::Largest => "Linf(Linf)",
        }
    }

    /// As in plots.
    pub fn symbol(self) -> &'static str {
        match self {
            Norm::Square => "L²(L²)",
            Norm::Largest => "L^∞(L^∞)",
        }
    }
}

/// Squared L² norms and maxima of the errors at one time, in the order of [`ErrorField::ALL`]; zero for fields that the model has not.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Errors {
    pub squares: [f64; FIELDS],
    pub largest: [f64; FIELDS],
}

/// Errors of `state` against `exact` at time `t`, by quadrature of degree `2q + 2`, q the polarity's degree.
pub fn errors(model: &dyn Sheet, exact: &Exact, state: &State, t: f64) -> Errors {
    match model.kind() {
        Kind::Incompressible(sheet) => incompressible(sheet, &exact.at_time(t), state, t),
    }
}

fn incompressible(model: &Incompressible, exact: &Exact, state: &State, t: f64) -> Errors {
    let laplacian = model.polarity.laplacian(&model.loops, &state.p, t);
    let (m, closed) = (&model.parameters, model.momentum.is_closed());
    let shifted = m.elastic_force == ElasticForce::Energy && m.elasticity != 0.0;
    let degree = 2 * state.p.space.degree + 2;
    let at = |x: &CellPoint| {
        let values = exact.at(x.site.x, t);
        let shift = if shifted { m.elasticity * energy_density(&state.p, &x.site, m.coherence) } else { 0.0 };
        let vectors: [Point; 3] = [
            state.v.vector(&x.site) - values.velocity,
            state.p.vector(&x.site) - values.polarity,
            laplacian.vector(&x.site) - values.polarity_laplacian,
        ];
        (vectors, state.pressure().scalar(&x.site) - shift - values.pressure)
    };
    let mean = if closed { model.loops.sum(degree, |x| at(x).1) / model.area } else { 0.0 };
    gather(&model.loops, degree, |x| {
        let (vectors, pressure) = at(x);
        [
            (ErrorField::Velocity, vectors[0].norm()),
            (ErrorField::Pressure, (pressure - mean).abs()),
            (ErrorField::Polarity, vectors[1].norm()),
            (ErrorField::Laplacian, vectors[2].norm()),
        ]
    })
}

/// Squares and maxima of pointwise errors.
fn gather(loops: &Integrator, degree: usize, at: impl Fn(&CellPoint) -> [(ErrorField, f64); 4] + Sync) -> Errors {
    let parts: Vec<Errors> = (0..loops.mesh.cells.len())
        .into_par_iter()
        .map(|cell| {
            let mut part = Errors::default();
            loops.each_cell_point(cell, degree, &mut |x| {
                for (field, size) in at(x) {
                    let k = field as usize;
                    part.squares[k] += x.weight * size * size;
                    part.largest[k] = larger(part.largest[k], size);
                }
            });
            part
        })
        .collect();
    parts.into_iter().fold(Errors::default(), |mut total, part| {
        for k in 0..FIELDS {
            total.squares[k] += part.squares[k];
            total.largest[k] = larger(total.largest[k], part.largest[k]);
        }
        total
    })
}

/// Sums and maxima over the steps of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct History {
    total: Errors,
}

impl History {
    /// Adds the errors at the end of a step of length `dt`.
    pub fn add(&mut self, errors: &Errors, dt: f64) {
        for k in 0..FIELDS {
            self.total.squares[k] += dt * errors.squares[k];
            self.total.largest[k] = larger(self.total.largest[k], errors.largest[k]);
        }
    }

    /// The error of a field in a norm   [9.12]
    pub fn error(&self, field: ErrorField, norm: Norm) -> f64 {
        let k = field as usize;
        match norm {
            Norm::Square => self.total.squares[k].sqrt(),
            Norm::Largest => self.total.largest[k],
        }
    }
}

/// The larger of two numbers, NaN if one is.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
