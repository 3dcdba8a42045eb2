//! Distance of a state from exact fields, in space; sums and maxima over time make the norms of [9.12].

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::form::power::energy_density;
use crate::form::{CellPoint, Integrator};
use crate::mesh::Point;
use crate::model::compressible::Compressible;
use crate::model::incompressible::Incompressible;
use crate::model::{ElasticForce, Exact, State};
use crate::time::{Sheet, SheetKind};

/// A field whose error is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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

impl ErrorField {
    /// Every field, in the order of the columns.
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
    /// Both, in the order of the columns.
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

/// Squared L² norms and maxima of the four errors at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Whose they are.
    pub fields: [ErrorField; 4],
    /// `‖u − u_h‖²` in L², in the order of `fields`.
    pub squares: [f64; 4],
    /// `max |u − u_h|`, in the order of `fields`.
    pub largest: [f64; 4],
}

impl Errors {
    fn none(fields: [ErrorField; 4]) -> Self {
        Self { fields, squares: [0.0; 4], largest: [0.0; 4] }
    }
}

/// Errors of `state` against `exact` at time `t`, by quadrature of degree `2q + 2`, q the polarity's degree.
pub fn errors(model: &dyn Sheet, exact: &Exact, state: &State, t: f64) -> Errors {
    match model.kind() {
        SheetKind::Incompressible(sheet) => incompressible(sheet, &exact.at_time(t), state, t),
        SheetKind::Compressible(sheet) => compressible(sheet, &exact.at_time(t), state, t),
    }
}

fn incompressible(model: &Incompressible, exact: &Exact, state: &State, t: f64) -> Errors {
    let laplacian = model.polarity.laplacian(model.tissue(), &state.p, t);
    let (m, closed) = (&model.parameters, &model.momentum.closed);
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
        (vectors, state.pressure().scalar(&x.site) - shift - values.volume)
    };
    // a constant that the pressure leaves open is no error
    let over = |part: usize, f: &(dyn Fn(&CellPoint) -> f64 + Sync)| {
        model.tissue().sum(degree, |x| if closed.of_cell(x.site.cell) == Some(part) { f(x) } else { 0.0 })
    };
    let means: Vec<f64> = (0..closed.count()).map(|part| over(part, &|x| at(x).1) / over(part, &|_| 1.0)).collect();
    gather(model.tissue(), degree, ErrorField::INCOMPRESSIBLE, |x| {
        let (vectors, pressure) = at(x);
        let mean = closed.of_cell(x.site.cell).map_or(0.0, |part| means[part]);
        [vectors[0].norm(), (pressure - mean).abs(), vectors[1].norm(), vectors[2].norm()]
    })
}

fn compressible(model: &Compressible, exact: &Exact, state: &State, t: f64) -> Errors {
    let rho = state.volume();
    let diffused = model.diffused(rho, &state.p, t);
    let degree = 2 * state.p.space.degree + 2;
    gather(&model.loops, degree, ErrorField::COMPRESSIBLE, |x| {
        let values = exact.at(x.site.x, t);
        [
            (state.v.vector(&x.site) - values.velocity).norm(),
            (rho.scalar(&x.site) - values.volume).abs(),
            (state.p.vector(&x.site) - values.polarity).norm(),
            (diffused.vector(&x.site) - values.polarity_laplacian).norm(),
        ]
    })
}

/// Squares and maxima of pointwise errors.
fn gather(
    loops: &Integrator,
    degree: usize,
    fields: [ErrorField; 4],
    at: impl Fn(&CellPoint) -> [f64; 4] + Sync,
) -> Errors {
    let parts: Vec<Errors> = (0..loops.mesh.cells.len())
        .into_par_iter()
        .map(|cell| {
            let mut part = Errors::none(fields);
            loops.each_cell_point(cell, degree, &mut |x| {
                for (k, size) in at(x).into_iter().enumerate() {
                    part.squares[k] += x.weight * size * size;
                    part.largest[k] = larger(part.largest[k], size);
                }
            });
            part
        })
        .collect();
    parts.into_iter().fold(Errors::none(fields), |mut total, part| {
        for k in 0..4 {
            total.squares[k] += part.squares[k];
            total.largest[k] = larger(total.largest[k], part.largest[k]);
        }
        total
    })
}

/// Sums and maxima over the steps of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    total: Option<Errors>,
}

impl History {
    /// Adds the errors at the end of a step of length `dt`.
    pub fn add(&mut self, errors: &Errors, dt: f64) {
        let total = self.total.get_or_insert(Errors::none(errors.fields));
        for k in 0..4 {
            total.squares[k] += dt * errors.squares[k];
            total.largest[k] = larger(total.largest[k], errors.largest[k]);
        }
    }

    /// The fields whose errors were added.
    pub fn fields(&self) -> &[ErrorField] {
        self.total.as_ref().map_or(&[], |total| &total.fields)
    }

    /// The error of a field in a norm, NaN for a field that the model has not   [9.12]
    pub fn error(&self, field: ErrorField, norm: Norm) -> f64 {
        let Some(total) = &self.total else { return f64::NAN };
        let Some(k) = total.fields.iter().position(|f| *f == field) else { return f64::NAN };
        match norm {
            Norm::Square => total.squares[k].sqrt(),
            Norm::Largest => total.largest[k],
        }
    }
}

/// The larger of two numbers, NaN if one is.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
