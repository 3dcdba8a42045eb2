//! Fields to start from: polarities and densities.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::boundary::{Conditions, PolarityCondition, VelocityCondition};
use super::frames::{Frames, WallPoints};
use super::limiter::Limiter;
use super::momentum::MomentumError;
use crate::expression::{Expression, ExpressionError};
use crate::form::{Integrator, gradient, mass};
use crate::mesh::{Curve, Point};
use crate::solve::sparse::{Factored, Matrix};
use crate::space::project::{self, Break, Level};
use crate::space::{Continuity, Field, Space};

/// The L² projection of two formulas at time `t`.
///
/// # Errors
/// A formula that is not finite at a node or a point of the quadrature.
pub fn formulas(space: &Arc<Space>, formulas: &[Expression; 2], t: f64) -> Result<Field, ExpressionError> {
    let [f, g] = formulas.each_ref().map(|formula| formula.at_time(t));
    let value = |x: Point| Ok([f.try_eval(x, t)?, g.try_eval(x, t)?]);
    space.node_positions().into_iter().try_for_each(|x| value(x).map(drop))?;
    let breaks: Vec<Break> = [&f, &g].into_iter().flat_map(|formula| formula.breaks(t)).collect();
    project::project(space, &breaks, value)
}

/// The density of a formula at time `t`: its L² projection, limited, so that it is nowhere negative and keeps the
/// means.
///
/// # Errors
/// A formula that is not finite or below zero at a node or a point of the quadrature.
pub fn density(limiter: &Limiter, formula: &Expression, t: f64) -> Result<Field, ExpressionError> {
    let formula = formula.at_time(t);
    let value = |x: Point| formula.try_density(x, t).map(|value| [value]);
    let space = limiter.space();
    space.node_positions().into_iter().try_for_each(|x| value(x).map(drop))?;
    let field = project::project(space, &formula.breaks(t), value)?;
    Ok(limiter.limit_start(&field))
}

/// The unit vector e₁, smoothed over the length `L` and laid around the obstacles: continuous `p₀` with
///
/// `L² (∇p₀|∇q) + (p₀|q) = (e₁|q)`, `p₀·n = q·n = 0` on slip boundaries, `p₀ = p_D` on Dirichlet boundaries   [10.4],
/// [10.5]
///
/// # Errors
/// A formula that is not finite, a factorisation that fails.
pub fn aligned(
    loops: &Integrator,
    space: &Arc<Space>,
    conditions: &[Conditions],
    length: f64,
) -> Result<Field, MomentumError> {
    let continuous = Arc::new(Space::new(&space.mesh, Continuity::Continuous, space.degree, 2));
    let held: Vec<Conditions> = conditions.iter().map(hold).collect();
    let frames = Frames::new(&continuous, &held, WallPoints::Nodes);
    let form = length.powi(2) * gradient::vector_gradients(&continuous) + mass::vector_mass(&continuous);
    let n = continuous.dof_count();
    let matrix = Matrix::from_triplets(n, n, &loops.triplets(&form, &continuous, &continuous));
    let prescribed = frames.prescribed(&held, 0.0)?;
    let mut right = loops.vector(&mass::load(&continuous, 0, |_| Point::x()), &continuous);
    matrix.times_add(-1.0, &prescribed, &mut right);
    let reduced = Matrix::from_triplets(frames.free, frames.free, &frames.reduce(&matrix));
    let free = Factored::new("aligned start", reduced)?.solve(&frames.restrict(&right))?;
    Ok(discontinuous(space, &Field::new(&continuous, frames.expand(&free, &prescribed))))
}

/// Conditions of the aligned start, in the words of the velocity's.
fn hold(conditions: &Conditions) -> Conditions {
    let velocity = match &conditions.polarity {
        PolarityCondition::Dirichlet(value) => VelocityCondition::Dirichlet(value.clone()),
        PolarityCondition::Neumann if conditions.velocity.is_impermeable() => VelocityCondition::Slip,
        PolarityCondition::Neumann => VelocityCondition::Traction([0.0, 0.0].map(Expression::constant)),
    };
    Conditions { velocity, polarity: conditions.polarity.clone(), density: None }
}

/// A continuous field in the discontinuous space of the same degree.
fn discontinuous(space: &Arc<Space>, field: &Field) -> Field {
    let mut out = Field::zero(space);
    for cell in 0..space.mesh.cells.len() {
        for c in 0..2 {
            for i in 0..space.n {
                out.values[space.dof(cell, c, i)] = field.values[field.space.dof(cell, c, i)];
            }
        }
    }
    out
}

/// Most random vectors of a start.
const MOST_VECTORS: usize = 20_000_000;

/// Random start   [10.4.4]: at every vertex of a triangular lattice of edge length `h` that covers the domain, a unit
/// vector of uniform angle times a normal deviate of standard deviation `amplitude`; linear between the vertices, and
/// projected in L². The lattice depends on the domain's extent alone, so that finer meshes start from the same field.
/// `None` for an absurdly fine lattice.
pub fn random(space: &Arc<Space>, seed: u64, amplitude: f64, h: f64) -> Option<Field> {
    let (low, high) = extent(space);
    let row = h * 0.75_f64.sqrt();
    // lattice coordinates: x = low + i h e₁ + j (½h, row); a margin for curved boundaries beyond their vertices
    let lattice = |x: Point| {
        let j = (x.y - low.y) / row + 2.0;
        ((x.x - low.x) / h - 0.5 * j + 2.0, j)
    };
    let rows = (lattice(high).1.ceil() as usize).checked_add(3)?;
    let shift = rows.div_ceil(2);
    let columns = (lattice(Point::new(high.x, low.y)).0.ceil() as usize).checked_add(shift + 3)?;
    if rows.checked_mul(columns)? > MOST_VECTORS {
        return None;
    }
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let values: Vec<Point> = (0..rows * columns)
        .map(|_| {
            let angle = generator.random_range(0.0..std::f64::consts::TAU);
            let size: f64 = generator.sample::<f64, _>(StandardNormal) * amplitude;
            Point::new(angle.cos(), angle.sin()) * size
        })
        .collect();
    let at = |i: usize, j: usize| values[j.min(rows - 1) * columns + i.min(columns - 1)];
    // the sides of the triangles: lines of i, of j, and of i + j
    let lines = |of: fn((f64, f64)) -> f64| Break { of: Box::new(move |x| of(lattice(x))), level: Level::Integers };
    let kinks = [lines(|(i, _)| i), lines(|(_, j)| j), lines(|(i, j)| i + j)];
    Some(project::project_vector(space, &kinks, |x| {
        let (a, b) = lattice(x);
        let a = a + shift as f64;
        let (i, j) = (a.floor() as usize, b.floor() as usize);
        let (s, t) = (a - a.floor(), b - b.floor());
        // the rhombus (i, j) consists of two triangles
        if s + t <= 1.0 {
            at(i, j) * (1.0 - s - t) + at(i + 1, j) * s + at(i, j + 1) * t
        } else {
            at(i + 1, j + 1) * (s + t - 1.0) + at(i + 1, j) * (1.0 - t) + at(i, j + 1) * (1.0 - s)
        }
    }))
}

/// Corners of the box around the domain, whole circles of curved boundaries included, so that it does not depend on the
/// mesh.
fn extent(space: &Space) -> (Point, Point) {
    let mesh = &space.mesh;
    let circles = mesh.faces.iter().filter_map(|f| f.curve).flat_map(|c| match mesh.curves[c] {
        Curve::Circle { centre, radius } => [centre - Point::repeat(radius), centre + Point::repeat(radius)],
    });
    let first = mesh.vertices[0];
    mesh.vertices.iter().copied().chain(circles).fold((first, first), |(low, high), x| (low.inf(&x), high.sup(&x)))
}
