//! Distance of a state from exact fields, in space; sums and maxima over time make the norms of [9.12].

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::form::power::energy_density;
use crate::form::{CellPoint, Integrator};
use crate::mesh::Point;
use crate::model::compressible::Compressible;
use crate::model::fields::{DENSITY, DIFFUSION, LAPLACIAN, POLARITY, PRESSURE, VELOCITY};
use crate::model::immersed::FlowWithBodies;
use crate::model::immersed::flow::Flow;
use crate::model::incompressible::Incompressible;
use crate::model::momentum::Momentum;
use crate::model::{ElasticForce, Exact, FieldId, State};
use crate::space::Field;
use crate::time::{Sheet, SheetKind};

/// The fields of a Stokes flow whose errors are measured; that of the velocity comes first in every model.
pub const STOKES: [FieldId; 2] = [VELOCITY, PRESSURE];

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
    /// `(Σ_n Δt_n ‖∇e^n‖²)^½` with the norm of L², of the velocity.
    #[serde(rename = "L2(H1)")]
    Slope,
}

impl Norm {
    /// Those of every field, in the order of the columns.
    pub const ALL: [Norm; 2] = [Norm::Square, Norm::Largest];

    /// Those of a field, in the order of the columns.
    pub fn of(field: FieldId) -> impl Iterator<Item = Norm> {
        Self::ALL.into_iter().chain((field == VELOCITY).then_some(Norm::Slope))
    }

    /// The norm of this name.
    pub fn named(name: &str) -> Option<Norm> {
        [Norm::Square, Norm::Largest, Norm::Slope].into_iter().find(|norm| norm.name() == name)
    }

    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Norm::Square => "L2(L2)",
            Norm::Largest => "Linf(Linf)",
            Norm::Slope => "L2(H1)",
        }
    }

    /// As in plots.
    pub fn symbol(self) -> &'static str {
        match self {
            Norm::Square => "L²(L²)",
            Norm::Largest => "L^∞(L^∞)",
            Norm::Slope => "L²(H¹)",
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
    /// `‖∇(u − u_h)‖²` in L² of the velocity; 0 of other fields.
    pub slope: f64,
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
    let laplacian = model.laplacian(state, t);
    let m = &model.parameters;
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
    let mean = open_constants(model.tissue(), degree, &model.momentum, |x| at(x).1);
    gather(model.tissue(), degree, INCOMPRESSIBLE, |x| {
        let (vectors, pressure) = at(x);
        let sizes = [vectors[0].norm(), (pressure - mean(x)).abs(), vectors[1].norm(), vectors[2].norm()];
        (sizes, slope(&state[VELOCITY], exact, x, t))
    })
}

/// Errors of velocity and pressure of a Stokes flow at time `t`, by quadrature of degree `2q + 4`, q the velocity's
/// degree.
pub fn of_flow(flow: &Flow, carried: &FlowWithBodies, exact: &Exact, t: f64) -> Errors {
    let (momentum, exact) = (&flow.momentum, &exact.at_time(t));
    let v = Field::new(&momentum.velocity, carried.v.clone());
    let pi = Field::new(&momentum.pressure, carried.pi.clone());
    let degree = 2 * v.space.degree + 4;
    let pressure = |x: &CellPoint| pi.scalar(&x.site) - exact.volume().formula().eval(x.site.x, t);
    let mean = open_constants(&flow.loops, degree, momentum, pressure);
    gather(&flow.loops, degree, STOKES, |x| {
        let off = v.vector(&x.site) - exact.flow(x.site.x, t).value;
        ([off.norm(), (pressure(x) - mean(x)).abs()], slope(&v, exact, x, t))
    })
}

/// The mean of the pressure's error in every part that leaves it open: no error.
fn open_constants<'m, F: Fn(&CellPoint) -> f64 + Sync>(
    loops: &Integrator,
    degree: usize,
    momentum: &'m Momentum,
    error: F,
) -> impl Fn(&CellPoint) -> f64 + use<'m, F> {
    let closed = &momentum.closed;
    let over = |part: usize, f: &(dyn Fn(&CellPoint) -> f64 + Sync)| {
        loops.sum(degree, |x| if closed.of_cell(x.site.cell) == Some(part) { f(x) } else { 0.0 })
    };
    let means: Vec<f64> = (0..closed.count()).map(|part| over(part, &error) / over(part, &|_| 1.0)).collect();
    move |x| closed.of_cell(x.site.cell).map_or(0.0, |part| means[part])
}

/// `|∇(v − v_h)|²`
fn slope(v: &Field, exact: &Exact, x: &CellPoint, t: f64) -> f64 {
    (v.vector_gradient(&x.site) - exact.flow(x.site.x, t).grad).norm_squared()
}

fn compressible(model: &Compressible, exact: &Exact, state: &State, t: f64) -> Errors {
    let rho = &state[DENSITY];
    let diffused = model.diffused(rho, &state[POLARITY], t);
    let degree = 2 * state[POLARITY].space.degree + 2;
    gather(&model.loops, degree, COMPRESSIBLE, |x| {
        let values = exact.at(x.site.x, t);
        let sizes = [
            (state[VELOCITY].vector(&x.site) - values.velocity).norm(),
            (rho.scalar(&x.site) - values.volume).abs(),
            (state[POLARITY].vector(&x.site) - values.polarity).norm(),
            (diffused.vector(&x.site) - values.polarity_laplacian).norm(),
        ];
        (sizes, slope(&state[VELOCITY], exact, x, t))
    })
}

/// Squares and maxima of pointwise errors, and the square of the first field's gradient.
fn gather<const N: usize>(
    loops: &Integrator,
    degree: usize,
    fields: [FieldId; N],
    at: impl Fn(&CellPoint) -> ([f64; N], f64) + Sync,
) -> Errors {
    let none = fields.map(|field| FieldError { field, square: 0.0, largest: 0.0, slope: 0.0 });
    let parts: Vec<[FieldError; N]> = (0..loops.mesh.cells.len())
        .into_par_iter()
        .map(|cell| {
            let mut part = none;
            loops.each_cell_point(cell, degree, &mut |x| {
                let (sizes, slope) = at(x);
                part[0].slope += x.weight * slope;
                for (error, size) in part.iter_mut().zip(sizes) {
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
        total.slope += weight * part.slope;
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
            self.total =
                errors.iter().map(|error| FieldError { square: 0.0, largest: 0.0, slope: 0.0, ..*error }).collect();
        }
        add(&mut self.total, errors, dt);
    }

    /// The fields whose errors were added.
    pub fn fields(&self) -> impl Iterator<Item = FieldId> {
        self.total.iter().map(|error| error.field)
    }

    /// The error of a field in one of its norms, NaN for a field that the model has not   [9.12]
    pub fn error(&self, field: FieldId, norm: Norm) -> f64 {
        match (self.total.iter().find(|error| error.field == field), norm) {
            (None, _) => f64::NAN,
            (Some(error), Norm::Square) => error.square.sqrt(),
            (Some(error), Norm::Largest) => error.largest,
            (Some(error), Norm::Slope) => error.slope.sqrt(),
        }
    }
}

/// The larger of two numbers, NaN if one is.
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
