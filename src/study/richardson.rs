//! `richardson.csv`: the measures of a sequence of ever finer meshes, extrapolated.

use std::path::Path;

use super::StudyError;
use super::results::Row;
use super::sweep_file::SweepStudy;
use super::table::write_rows;
use crate::output::number;

/// What three values on ever finer meshes say of their limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extrapolation {
    /// `p = log((f₁−f₂)/(f₂−f₃))/log r`; none where the differences do not shrink with one sign.
    pub order: Option<f64>,
    /// `f₃ + (f₃−f₂)/(r^p − 1)`; without an order the finest value.
    pub limit: f64,
    /// Estimate of `|f₃ − f|`; without an order the largest difference between the values.
    pub error: f64,
}

/// Richardson's extrapolation from the values on three meshes, coarse to fine, each `ratio` times finer than the one
/// before.
pub fn extrapolate([f1, f2, f3]: [f64; 3], ratio: f64) -> Extrapolation {
    let (d1, d2) = (f1 - f2, f2 - f3);
    let quotient = d1 / d2;
    if quotient.is_finite() && quotient > 1.0 {
        let shift = -d2 / (quotient - 1.0);
        let order = quotient.ln() / ratio.ln();
        return Extrapolation { order: Some(order), limit: f3 + shift, error: shift.abs() };
    }
    let spread = d1.abs().max(d2.abs()).max((f1 - f3).abs());
    Extrapolation { order: None, limit: f3, error: spread }
}

/// Writes the table, if the study asks for it and its cases have run.
///
/// # Errors
/// A file that cannot be written.
pub fn write(study: &SweepStudy, rows: &[Row], path: &Path) -> Result<(), StudyError> {
    let Some((names, ratio)) = &study.richardson else { return Ok(()) };
    let row_of = |name: &String| rows.iter().find(|row| row.case.name.as_ref() == Some(name) && row.found.is_good());
    let Some(found) = names.iter().map(row_of).collect::<Option<Vec<&Row>>>() else { return Ok(()) };
    let mut header = vec!["measure".to_owned()];
    header.extend(names.iter().cloned());
    header.extend(["order", "limit", "error"].map(str::to_owned));
    let mut table = vec![header];
    let numbers: Vec<std::collections::BTreeMap<String, f64>> = found.iter().map(|row| row.numbers()).collect();
    for measure in numbers[0].keys() {
        let Some(values) = numbers.iter().map(|all| all.get(measure).copied()).collect::<Option<Vec<f64>>>() else {
            continue;
        };
        let last = [values[values.len() - 3], values[values.len() - 2], values[values.len() - 1]];
        let found = extrapolate(last, *ratio);
        let mut cells = vec![measure.clone()];
        cells.extend(values.iter().map(|v| number(*v)));
        cells.push(found.order.map(number).unwrap_or_default());
        cells.extend([number(found.limit), number(found.error)]);
        table.push(cells);
    }
    Ok(write_rows(path, &table)?)
}

#[cfg(test)]
mod tests {
    use super::extrapolate;

    #[test]
    fn a_power_of_the_cell_size_is_extrapolated_exactly() {
        let value = |h: f64| 3.0 - 0.7 * h.powf(1.7);
        let found = extrapolate([value(0.4), value(0.2), value(0.1)], 2.0);
        assert!((found.order.expect("an order") - 1.7).abs() < 1e-10);
        assert!((found.limit - 3.0).abs() < 1e-12);
        assert!((found.error - (3.0 - value(0.1))).abs() < 1e-12);
    }

    #[test]
    fn values_that_go_up_and_down_have_no_order() {
        let found = extrapolate([1.0, 1.2, 1.1], 2.0);
        assert_eq!((found.order, found.limit), (None, 1.1));
        assert!((found.error - 0.2).abs() < 1e-12);
    }
}
