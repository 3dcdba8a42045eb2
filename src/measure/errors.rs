//! Distance of a state from exact fields, in space; sums and maxima over time make the norms of [9.12].

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::form::power::energy_density;
use crate::form::{CellPoint, Integrator};
use crate::mesh::Point;
use crate::model::compressible::Compressible;
use crate::model::fields::{DENSITY, DIFFUSION, LAPLACIAN, POLARITY, PRESSURE, VELOCITY};
use crate::model::incompressible::Incompressible;
use crate::model::{ElasticForce, Exact, FieldId, State};
use crate::time::{Sheet, SheetKind};

/// The fields of an incompressible sheet whose errors are measured.
pub const INCOMPRESSIBLE: [FieldId; 4] = [VELOCITY, PRESSURE, POLARITY, LAPLACIAN];

/// Those of a compressible sheet.
pub const COMPRESSIBLE: [FieldId; 4] = [VELOCITY, DENSITY, POLARITY, DIFFUSION];

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

/// The error of a field at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FieldError {
    /// Whose it is.
    pub field: FieldId,
    /// `‖u − u_h‖²` in L².
    pub square: f64,
    /// `max |u − u_h|`
    pub largest: f64,
}

/// The errors of a model's fields at one time.
pub type Errors = Vec<FieldError>;

/// Errors of `state` against `exact` at time `t`, by quadrature of degree `2q + 2`, q the polarity's degree.
pub fn errors(model: &dyn Sheet, exact: &Exact, state: &State, t: f64) -> Errors {
    match model.kind() {
        SheetKind::Incompressible(sheet) => incompressible(sheet, &exact.at_time(t), state, t),
        SheetKind::Compressible(sheet) => compressible(sheet, &exact.at_time(t), state, t),
    }
}

fn incompressible(model: &Incompressible, exact: &Exact, state: &State, t: f64) -> Errors {
    let laplacian = model.polarity.laplacian(model.tissue(), &state[POLARITY], t);
    let (m, closed) = (&model.parameters, &model.momentum.closed);
    let shifted = m.elastic_force == ElasticForce::Energy && m.elasticity != 0.0;
    let degree = 2 * state[POLARITY].space.degree + 2;
    let at = |x: &CellPoint| {
        let values = exact.at(x.site.x, t);
        let shift = if shifted { m.elasticity * energy_density(&state[POLARITY], &x.site, m.coherence) } else { 0.0 };
        let vectors: [Point; 3] = [
            state[VELOCITY].vector(&x.site) - values.velocity,
            state[POLARITY].vector(&x.site) - values.polarity,
            laplacian.vector(&x.site) - values.polarity_laplacian,
        ];
        (vectors, state[PRESSURE].scalar(&x.site) - shift - values.volume)
    };
    // a constant that the pressure leaves open is no error
    let over = |part: usize, f: &(dyn Fn(&CellPoint) -> f64 + Sync)| {
        model.tissue().sum(degree, |x| if closed.of_cell(x.site.cell) == Some(part) { f(x) } else { 0.0 })
    };
    let means: Vec<f64> = (0..closed.count()).map(|part| over(part, &|x| at(x).1) / over(part, &|_| 1.0)).collect();
    gather(model.tissue(), degree, INCOMPRESSIBLE, |x| {
        let (vectors, pressure) = at(x);
        let mean = closed.of_cell(x.site.cell).map_or(0.0, |part| means[part]);
        [vectors[0].norm(), (pressure - mean).abs(), vectors[1].norm(), vectors[2].norm()]
    })
}

fn compressible(model: &Compressible, exact: &Exact, state: &State, t: f64) -> Errors {
    let rho = &state[DENSITY];
    let diffused = model.diffused(rho, &state[POLARITY], t);
    let degree = 2 * state[POLARITY].space.degree + 2;
    gather(&model.loops, degree, COMPRESSIBLE, |x| {
        let values = exact.at(x.site.x, t);
        [
            (state[VELOCITY].vector(&x.site) - values.velocity).norm(),
            (rho.scalar(&x.site) - values.volume).abs(),
            (state[POLARITY].vector(&x.site) - values.polarity).norm(),
            (diffused.vector(&x.site) - values.polarity_laplacian).norm(),
        ]
    })
}

/// Squares and maxima of pointwise errors.
fn gather<const N: usize>(
    loops: &Integrator,
    degree: usize,
    fields: [FieldId; N],
    at: impl Fn(&CellPoint) -> [f64; N] + Sync,
) -> Errors {
    let none = fields.map(|field| FieldError { field, square: 0.0, largest: 0.0 });
    let parts: Vec<[FieldError; N]> = (0..loops.mesh.cells.len())
        .into_par_iter()
        .map(|cell| {
            let mut part = none;
            loops.each_cell_point(cell, degree, &mut |x| {
                for (error, size) in part.iter_mut().zip(at(x)) {
                    error.square += x.weight * size * size;
                    error.largest = larger(error.largest, size);
                }
            });
            part
        })
        .collect();
    let mut total = none;
    parts.iter().for_each(|part| add(&mut total, part, 1.0));
    total.into()
}

/// Adds squares with a weight, and takes the larger maxima.
fn add(total: &mut [FieldError], part: &[FieldError], weight: f64) {
    for (total, part) in total.iter_mut().zip(part) {
        total.square += weight * part.square;
        total.largest = larger(total.largest, part.largest);
    }
}

/// Sums and maxima over the steps of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    total: Errors,
}

impl History {
    /// Adds the errors at the end of a step of length `dt`.
    pub fn add(&mut self, errors: &[FieldError], dt: f64) {
        if self.total.is_empty() {
            self.total = errors.iter().map(|error| FieldError { square: 0.0, largest: 0.0, ..*error }).collect();
        }
        add(&mut self.total, errors, dt);
    }

    /// The fields whose errors were added.
    pub fn fields(&self) -> impl Iterator<Item = FieldId> {
        self.total.iter().map(|error| error.field)
    }

    /// The error of a field in a norm, NaN for a field that the model has not   [9.12]
    pub fn error(&self, field: FieldId, norm: Norm) -> f64 {
        match (self.total.iter().find(|error| error.field == field), norm) {
            (None, _) => f64::NAN,
            (Some(error), Norm::Square) => error.square.sqrt(),
            (Some(error), Norm::Largest) => error.largest,
        }
    }
}

/// The larger of two numbers, NaN if one is.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
