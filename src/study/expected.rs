//! The orders that degrees and schemes promise, and whether those that were observed fall short of them.

use super::file::Variant;
use super::order::{Level, Outcome};
use crate::expression::Expression;
use crate::measure::errors::Norm;
use crate::mesh::Mesh;
use crate::model::fields::{self, FieldId, Role};
use crate::run::kinds::Compared;

/// Observed orders may lie below the promised ones by this: levels are coarse, and fits take the coarsest with them.
const SLACK: f64 = 0.5;
/// Errors below so many tolerances of the coupling, relative to the exact fields, are those of solvers and rounding.
const SOLVED: f64 = 10.0;
/// What second derivatives do to rounding in cells of size 1: inverse inequality of the highest degree.
const STEEP: f64 = 100.0;

/// What may be wrong, below the last line.
const HINT: &str = "; hint: exact fields with kinks and boundary data of another solution have no order, steps alone \
                    show none below the error of the mesh, and coarse levels may not show it: refine, or give \
                    `expect` with the orders that you do expect (`expect = {}` for none)";

/// What a level promises of its errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Promise {
    /// Orders in the cells' size.
    space: Vec<(FieldId, Norm, f64)>,
    /// Order in the step, infinite where nothing is carried in time.
    time: f64,
    /// Largest size of the exact fields, times the relative error that is none of discretisation.
    solved: f64,
}

impl Promise {
    /// Of a scene on its mesh: the orders of its degrees, and one less for gradients. On circles no field has more
    /// than 2 on straight cells, and m+2 on cells of degree m.
    pub fn of(compared: &Compared, mesh: &Mesh) -> Self {
        let bent = mesh.curved.iter().flatten().map(|nodes| nodes.degree).min();
        let most = if mesh.curves.is_empty() { usize::MAX } else { bent.map_or(2, |m| m + 2) };
        let orders = compared.orders.iter().map(|(field, order)| (*field, *order.min(&most)));
        let of = |(field, order): (FieldId, usize)| {
            let slope = Norm::of(field).filter(|norm| *norm == Norm::Slope).map(move |norm| (field, norm, order - 1));
            std::iter::once((field, Norm::Square, order)).chain(slope)
        };
        let space = orders.flat_map(of).map(|(field, norm, order)| (field, norm, order as f64)).collect();
        let time = compared.order_in_time.map_or(f64::INFINITY, |order| order as f64);
        Self { space, time, solved: SOLVED * compared.tolerance * largest(compared, mesh) }
    }
}

/// Largest value of the exact fields at the cells' centroids, at the start and at the end.
fn largest(compared: &Compared, mesh: &Mesh) -> f64 {
    let exact = compared.exact;
    let size = |pair: &[Expression; 2], x, t| pair[0].eval(x, t).hypot(pair[1].eval(x, t));
    let at = |x, t| {
        let vectors = exact.vectors().map(|pair| size(pair, x, t)).fold(0.0, f64::max);
        vectors.max(exact.volume().formula().eval(x, t).abs())
    };
    let places = (0..mesh.cells.len()).map(|cell| mesh.centroid(cell));
    places.flat_map(|x| [at(x, 0.0), at(x, compared.end)]).fold(0.0, f64::max)
}

/// One line for each field whose observed order falls short: of what the variant expects, or without that of what its
/// degrees promise.
pub fn short_orders(variant: &Variant, outcome: &Outcome) -> Vec<String> {
    let levels = outcome.complete();
    let Some(finest) = levels.last() else { return Vec::new() };
    let mut lines = Vec::new();
    match &variant.expect {
        Some(expect) => {
            let known = |name: &String| fields::named(name);
            for (field, least) in expect.iter().filter_map(|(name, least)| known(name).zip(Some(*least))) {
                for norm in Norm::ALL.into_iter().filter(|_| !is_solved(finest, field)) {
                    let (name, norm_name) = (field.name, norm.name());
                    match outcome.fit(field, norm) {
                        Some(fit) if fit >= least => {}
                        Some(fit) => {
                            lines.push(format!("{name} in {norm_name}: order {fit:.2}, expected at least {least}"));
                        }
                        None => lines.push(format!(
                            "{name} in {norm_name}: no order, fewer than two levels are complete, expected at least \
                             {least}"
                        )),
                    }
                }
            }
        }
        None => {
            for &promised in &finest.promise.space {
                lines.extend(broken_promise(outcome, &levels, promised));
            }
            if let Some(last) = lines.last_mut() {
                last.push_str(HINT);
            }
        }
    }
    lines
}

/// What is wrong with the order of a field in a norm: the better of the fit and the order between the last two levels
/// counts.
fn broken_promise(outcome: &Outcome, levels: &[&Level], (field, norm, space): (FieldId, Norm, f64)) -> Option<String> {
    let [.., coarse, fine] = levels else { return None };
    if is_solved(fine, field) {
        return None;
    }
    let time = fine.promise.time;
    let (expected, why) = if outcome.by_mesh() {
        let ratio = (levels[0].dt / fine.dt).ln() / (levels[0].h / fine.h).ln();
        // steps that stay as they are add an error that does not fall; that is found, too
        let by_step = if ratio > 0.01 { ratio * time } else { f64::INFINITY };
        let why = if by_step < space { "the scheme in time and its steps" } else { "the degrees" };
        (space.min(by_step), why)
    } else {
        (time, "the scheme in time")
    };
    let last = outcome.order_between(coarse, fine, field, norm);
    let observed = outcome.fit(field, norm).map_or(last, |fit| fit.max(last));
    if observed >= expected - SLACK {
        return None;
    }
    let (name, norm) = (field.name, norm.name());
    Some(format!("{name} in {norm}: order {observed:.2}, expected {expected:.1} by {why}"))
}

/// Whether the error of a field is no more than what solvers leave.
fn is_solved(level: &Level, field: FieldId) -> bool {
    let steep = match field.role {
        Role::Flow | Role::Carried => 1.0,
        Role::Auxiliary => STEEP * level.h.powi(-2).max(1.0),
    };
    level.errors.error(field, Norm::Largest) <= steep * level.promise.solved
}
