//! What keys of scenes and columns of tables are called where people read them: in axes, legends and titles.

use crate::measure::errors::Norm;
use crate::measure::list::{self, Column, DIMENSIONLESS};
use crate::model::fields;
use crate::model::terms::factor;
use crate::output::plot::{Axis, Scale};

/// Keys with a symbol and what they mean: the parameters of the model in the order in which they are told, then sizes.
pub(super) const SYMBOLS: [(&str, &str, &str); 25] = [
    ("model.peclet", "Pe", "relaxation time of the polarity over that of the flow"),
    ("model.beta", "β", "friction as a share, C_F/(1 + C_F)"),
    ("model.friction", "C_F", "friction with the substrate"),
    ("model.traction", "T_a", "traction force along the polarity"),
    ("model.active_stress", "S_a", "active stress along the polarity"),
    ("model.active_stress_iso", "S_a'", "isotropic active stress"),
    ("model.coherence", "κ", "length over which the polarity is coherent"),
    ("model.elasticity", "B", "polar elasticity over viscosity"),
    ("model.alignment", "a", "alignment of the polarity with the flow"),
    ("model.density.penalty", "c_0", "density penalty"),
    ("model.density.exponent", "γ", "exponent of the density penalty"),
    ("model.density.critical", "ρ_{min}", "density below which the polarity vanishes"),
    ("mesh.h", "h", "edge length"),
    ("mesh.h_disc", "h_{disc}", "edge length on the disc"),
    ("mesh.n", "n", "cells per side"),
    ("mesh.width", "width", "extent across the strip"),
    ("time.step", "Δt", "first and largest step"),
    ("time.end", "end", "end time"),
    ("time.scheme", "scheme", "time scheme"),
    ("space.k", "k", "degree of the pressure"),
    ("initial.polarity.random.seed", "seed", "seed of the random start"),
    ("rigid.epsilon", "ε", "viscosity of the medium over that of bodies"),
    ("contact.gamma_min", "γ_{min}", "threshold of roughness of gluey contact"),
    ("contact.margin", "η", "gap that contact keeps"),
    ("coupling.tolerance", "tolerance", "tolerance of the coupling"),
];

/// Columns of tables that no measure has.
const OTHERS: [Column; 20] = [
    Column::new("residual", "residual of the stationary equations", DIMENSIONLESS, "total"),
    Column::new("growth", "growth rate of the leading mode", DIMENSIONLESS, "growth rate"),
    Column::new("frequency", "angular frequency of the leading mode", DIMENSIONLESS, "angular frequency"),
    Column::new("period", "period of the oscillation", DIMENSIONLESS, "period"),
    Column::new("amplitude_polarity", "amplitude of the polarity", DIMENSIONLESS, "polarity"),
    Column::new("amplitude_velocity", "amplitude of the velocity", DIMENSIONLESS, "velocity"),
    Column::new("distance", "distance from the state at the start", DIMENSIONLESS, "distance"),
    Column::new("time", "time t", DIMENSIONLESS, "t"),
    Column::new("dt", "step Δt", DIMENSIONLESS, "Δt"),
    Column::new("step", "step", "", "step"),
    Column::new("cells", "cells", "", "cells"),
    Column::new("unknowns", "unknowns", "", "unknowns"),
    Column::new("steps", "steps", "", "steps"),
    Column::new("rejected", "rejected steps", "", "rejected"),
    Column::new("iterations", "iterations of the coupling", "", "iterations"),
    Column::new("accepted_late", "steps accepted late", "", "accepted late"),
    Column::new("seconds", "wall time", "seconds", "wall time"),
    Column::new("peak_memory_mib", "peak memory", "MiB", "memory"),
    Column::new("threads", "threads", "", "threads"),
    Column::new("unstable_dimension", "number of growing modes", "", "growing modes"),
];

fn known(name: &str) -> Option<&'static Column> {
    list::column(name).or_else(|| OTHERS.iter().find(|column| column.name == name))
}

/// `NAME` of the column `NAME_error` of an estimate.
pub fn estimated(column: &str) -> Option<&str> {
    column.strip_suffix(ESTIMATE)
}

/// The column of the estimated error of a measure.
pub fn estimate_of(measure: &str) -> String {
    format!("{measure}{ESTIMATE}")
}

const ESTIMATE: &str = "_error";

/// How a key is written in formulas; the key itself where it has no symbol.
pub fn symbol(key: &str) -> &str {
    let of_term = || {
        let name = key.strip_prefix("model.")?;
        factor::all().find(|(factor, _)| factor.key == name).map(|(factor, _)| factor.symbol)
    };
    SYMBOLS.iter().find(|(name, ..)| *name == key).map(|(_, symbol, _)| *symbol).or_else(of_term).unwrap_or(key)
}

/// A key of the scene, or a column of a table, in words: `β`, `overshoot of v₁ behind the disc`.
pub fn words(name: &str) -> String {
    match (known(name), estimated(name)) {
        (Some(column), _) => match list::on(name) {
            Some((_, on)) => format!("{} {on}", column.words),
            None => column.words.to_owned(),
        },
        (None, Some(measure)) => format!("estimated error, {}", words(measure)),
        (None, None) if name.contains('.') => symbol(name).to_owned(),
        (None, None) => match fields::of_residual(name) {
            Some(field) => format!("residual of the {field}"),
            None => error_of(name).unwrap_or_else(|| name.replace('_', " ")),
        },
    }
}

/// `error of v in L²(L²)` of the column `error_velocity_L2(L2)`.
fn error_of(column: &str) -> Option<String> {
    let (field, norm) = column.strip_prefix("error_")?.split_once('_')?;
    error(field, norm)
}

/// `error of v in L²(L²)` of the names that field and norm have in tables.
pub fn error(field: &str, norm: &str) -> Option<String> {
    let field = fields::named(field)?;
    let norm = Norm::named(norm)?;
    Some(format!("error of {} in {}", field.symbol, norm.symbol()))
}

/// As in the legend of a picture of one kind of measures.
pub fn short(name: &str) -> String {
    match known(name) {
        Some(column) => match list::on(name) {
            Some((_, on)) => format!("{}, {on}", column.short),
            None => column.short.to_owned(),
        },
        None => fields::of_residual(name).map_or_else(|| words(name), ToString::to_string),
    }
}

/// In words with the unit, as along an axis.
pub fn with_unit(name: &str) -> String {
    let unit = match known(estimated(name).unwrap_or(name)) {
        Some(column) => column.unit,
        None if name.contains('.') && !name.starts_with("error_") => "",
        None => DIMENSIONLESS,
    };
    if unit.is_empty() { words(name) } else { format!("{} ({unit})", words(name)) }
}

/// An axis for a key or a column.
pub fn axis(name: &str, scale: Scale) -> Axis {
    Axis { label: with_unit(name), scale }
}

/// In words, as a title: `Free energy F`, but `v₁` and `dF/dt`.
pub fn title(name: &str) -> String {
    let words = words(name);
    let mut letters = words.chars();
    let is_word = letters.clone().take(2).filter(|c| c.is_lowercase()).count() == 2;
    match letters.next().filter(|_| is_word) {
        Some(first) => first.to_uppercase().chain(letters).collect(),
        None => words,
    }
}

/// A title of one over the other.
pub fn over(y: &str, x: &str) -> String {
    format!("{} over {}", title(y), words(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_known_once_and_without_marks() {
        let columns: Vec<&Column> = list::ALL.iter().flat_map(|measure| measure.columns).chain(&OTHERS).collect();
        for (at, column) in columns.iter().enumerate() {
            assert!(columns[..at].iter().all(|other| other.name != column.name), "{}", column.name);
            assert!(![column.words, column.short].iter().any(|text| text.contains('_')), "{}", column.name);
        }
    }

    #[test]
    fn keys_and_columns_in_words() {
        let cases = [
            ("model.beta", "β"),
            ("overshoot_velocity", "overshoot of v₁ behind the disc (percent)"),
            ("overshoot_velocity_error", "estimated error, overshoot of v₁ behind the disc (percent)"),
            ("error_velocity_L2(L2)", "error of v in L²(L²) (dimensionless)"),
            ("strain.weissenberg", "strain.weissenberg"),
            ("something_new", "something new (dimensionless)"),
        ];
        for (name, text) in cases {
            assert_eq!(with_unit(name), text);
        }
        assert_eq!(over("free_energy", "model.peclet"), "Free energy F over Pe");
    }
}
