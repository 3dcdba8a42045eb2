//! Formulas of a scene, evaluated where the forms evaluate them, to find the one that is to blame.

use super::boundary::Conditions;
use super::numbers::Numbers;
use super::polarity::{FORMULA_DEGREE, data_of};
use super::sources::Sources;
use crate::expression::{Expression, ExpressionError};
use crate::form::Integrator;
use crate::mesh::Point;

/// Evaluates every source and boundary formula at time `t`; `degree` is the largest of the test functions.
///
/// # Errors
/// The first one that is not finite, or a density of inflow below zero, with its place and time.
pub fn check_formulas<'a>(
    loops: &Integrator,
    degree: usize,
    conditions: &[Conditions],
    sources: &Sources,
    numbers: impl Into<Numbers<'a>>,
    t: f64,
) -> Result<(), ExpressionError> {
    let mut first = Ok(());
    let mut visit = |formulas: &[Expression], x: Point| {
        if first.is_ok() {
            first = formulas.iter().try_for_each(|f| f.try_eval(x, t).map(|_| ()));
        }
    };
    let singles = sources.density_formulas().map(std::slice::from_ref);
    for source in sources.formulas().map(|pair| &pair[..]).chain(singles) {
        for cell in 0..loops.mesh.cells.len() {
            loops.each_cell_point(cell, FORMULA_DEGREE + degree, &mut |x| visit(source, x.site.x));
        }
    }
    for (index, face) in loops.mesh.faces.iter().enumerate() {
        let Some(tag) = face.tag else { continue };
        let data = data_of(&conditions[tag]).into_iter().map(|pair| &pair[..]);
        for formulas in [conditions[tag].velocity.formulas()].into_iter().chain(data) {
            loops.each_face_point(index, FORMULA_DEGREE, &mut |s| visit(formulas, s.minus.x));
        }
    }
    first?;
    check_inflow(loops, conditions, t)?;
    if sources.exact.is_some() { check_sources(loops, degree, sources, numbers.into(), t) } else { Ok(()) }
}

/// Evaluates the densities of inflow.
///
/// # Errors
/// One that is not finite or below zero.
pub fn check_inflow(loops: &Integrator, conditions: &[Conditions], t: f64) -> Result<(), ExpressionError> {
    let mut first = Ok(());
    for (index, face) in loops.mesh.faces.iter().enumerate() {
        let Some(formula) = face.tag.and_then(|tag| conditions[tag].density.as_ref()) else { continue };
        loops.each_face_point(index, FORMULA_DEGREE, &mut |s| {
            let x = s.minus.x;
            if first.is_ok() {
                first = formula.try_density(x, t).map(|_| ());
            }
        });
    }
    first
}

/// Evaluates the sources that follow from the exact fields.
fn check_sources(
    loops: &Integrator,
    degree: usize,
    sources: &Sources,
    numbers: Numbers,
    t: f64,
) -> Result<(), ExpressionError> {
    let given = sources.exact.as_ref().map_or_else(String::new, |exact| exact.velocity()[0].given().to_owned());
    let sources = sources.at_time(t);
    let mut first = Ok(());
    for cell in 0..loops.mesh.cells.len() {
        loops.each_cell_point(cell, FORMULA_DEGREE + degree, &mut |x| {
            let at = x.site.x;
            let f = sources.force(numbers, at, t);
            let g = if sources.has_polarity() { sources.polarity(numbers, at, t) } else { Point::zeros() };
            let density = if sources.has_density() { sources.density(numbers, at, t) } else { 0.0 };
            let values = [("f_v", f.x), ("f_v", f.y), ("f_p", g.x), ("f_p", g.y), ("f_ρ", density)];
            if let (Ok(()), Some((name, value))) = (&first, values.into_iter().find(|v| !v.1.is_finite())) {
                let (given, text) = (given.clone(), format!("{name} of [exact]"));
                first = Err(ExpressionError::NotFinite { given, text, value, x: at.x, y: at.y, t });
            }
        });
    }
    first
}
