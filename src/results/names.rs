//! What keys of scenes and columns of tables are called where people read them: in axes, legends and titles.

use crate::measure::errors::{ErrorField, Norm};
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

/// A number that runs find or cost.
struct Measure {
    column: &'static str,
    /// With its symbol.
    words: &'static str,
    unit: &'static str,
    /// Among others of its kind, as in a legend.
    short: &'static str,
}

const fn of(column: &'static str, words: &'static str, unit: &'static str, short: &'static str) -> Measure {
    Measure { column, words, unit, short }
}

/// Unit of what is a ratio to the scales of the model.
const NONE: &str = "dimensionless";

const MEASURES: [Measure; 69] = [
    of("residual", "residual of the stationary equations", NONE, "total"),
    of("residual_velocity", "residual of the velocity", NONE, "velocity"),
    of("residual_pressure", "residual of the pressure", NONE, "pressure"),
    of("residual_density", "residual of the density", NONE, "density"),
    of("residual_polarity", "residual of the polarity", NONE, "polarity"),
    of("free_energy", "free energy F", NONE, "F"),
    of("free_energy_rate", "free energy rate dF/dt", NONE, "dF/dt"),
    of("overshoot_velocity", "overshoot of v₁ behind the disc", "percent", "velocity"),
    of("overshoot_velocity_x1", "x₁ of the largest v₁ behind the disc", "", "velocity"),
    of("overshoot_polarity", "overshoot of p₁ behind the disc", "percent", "polarity"),
    of("overshoot_polarity_x1", "x₁ of the largest p₁ behind the disc", "", "polarity"),
    of("asymmetry_velocity", "asymmetry of v between the two sides", NONE, "velocity"),
    of("asymmetry_polarity", "asymmetry of p between the two sides", NONE, "polarity"),
    of("budget_rate", "energy law: dF/dt", NONE, "dF/dt"),
    of("budget_friction", "energy law: friction", NONE, "friction"),
    of("budget_viscosity", "energy law: viscosity", NONE, "viscosity"),
    of("budget_relaxation", "energy law: relaxation", NONE, "relaxation"),
    of("budget_traction", "energy law: traction", NONE, "traction"),
    of("budget_active_stress", "energy law: active stress", NONE, "active stress"),
    of("budget_defect", "energy law: what its terms leave", NONE, "defect"),
    of("mass", "mass ∫ρ", NONE, "∫ρ"),
    of("mass_defect", "mass ∫ρ beyond what came in", NONE, "beyond what came in"),
    of("density_min", "smallest density min ρ", NONE, "min ρ"),
    of("limited_cells", "cells whose density was limited", "", "cells"),
    of("strain_max", "largest elastic strain", NONE, "largest"),
    of("strain_max_x1", "x₁ of the largest elastic strain", "", "x₁ of the largest"),
    of("strain_max_x2", "x₂ of the largest elastic strain", "", "x₂ of the largest"),
    of("strain_least_stretch", "least eigenvalue of I + ε", NONE, "least eigenvalue of I + ε"),
    of("strain_growth", "growth of the strain at rest, 2 We λ(∇v)", NONE, "growth 2 We λ(∇v)"),
    of("strain_growth_x1", "x₁ of the largest growth of the strain", "", "x₁ of the growth"),
    of("strain_growth_x2", "x₂ of the largest growth of the strain", "", "x₂ of the growth"),
    of("circulation_velocity", "mean velocity along the track", NONE, "velocity"),
    of("circulation_polarity", "mean polarity along the track", NONE, "polarity"),
    of("defects_plus", "defects of charge +1", "", "charge +1"),
    of("defects_minus", "defects of charge −1", "", "charge −1"),
    of("kinetic_energy", "kinetic energy of the bodies", NONE, "kinetic energy"),
    of("gap", "smallest gap min D", NONE, "min D"),
    of("overlap", "deepest overlap of bodies", NONE, "overlap"),
    of("contacts", "contacts with λ ≠ 0", "", "contacts"),
    of("wall_force_x1", "force on all walls along x₁", NONE, "along x₁"),
    of("wall_force_x2", "force on all walls along x₂", NONE, "along x₂"),
    of("body_x1", "x₁ of the first body", "", "x₁"),
    of("body_x2", "x₂ of the first body", "", "x₂"),
    of("body_angle", "angle θ of the first body", "", "θ"),
    of("body_velocity_1", "velocity V₁ of the first body", NONE, "V₁"),
    of("body_velocity_2", "velocity V₂ of the first body", NONE, "V₂"),
    of("body_spin", "spin ω of the first body", NONE, "ω"),
    of("holding_x1", "force along x₁ that holds the first body", NONE, "f₁"),
    of("holding_x2", "force along x₂ that holds the first body", NONE, "f₂"),
    of("holding_torque", "torque that holds the first body", NONE, "torque"),
    of("growth", "growth rate of the leading mode", NONE, "growth rate"),
    of("frequency", "angular frequency of the leading mode", NONE, "angular frequency"),
    of("period", "period of the oscillation", NONE, "period"),
    of("amplitude_polarity", "amplitude of the polarity", NONE, "polarity"),
    of("amplitude_velocity", "amplitude of the velocity", NONE, "velocity"),
    of("distance", "distance from the state at the start", NONE, "distance"),
    of("time", "time t", NONE, "t"),
    of("dt", "step Δt", NONE, "Δt"),
    of("step", "step", "", "step"),
    of("cells", "cells", "", "cells"),
    of("unknowns", "unknowns", "", "unknowns"),
    of("steps", "steps", "", "steps"),
    of("rejected", "rejected steps", "", "rejected"),
    of("iterations", "iterations of the coupling", "", "iterations"),
    of("accepted_late", "steps accepted late", "", "accepted late"),
    of("seconds", "wall time", "seconds", "wall time"),
    of("peak_memory_mib", "peak memory", "MiB", "memory"),
    of("threads", "threads", "", "threads"),
    of("unstable_dimension", "number of growing modes", "", "growing modes"),
];

fn known(column: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.column == column)
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
        (Some(measure), _) => measure.words.to_owned(),
        (None, Some(measure)) => format!("estimated error, {}", words(measure)),
        (None, None) if name.contains('.') => symbol(name).to_owned(),
        (None, None) => error_of(name).unwrap_or_else(|| name.replace('_', " ")),
    }
}

/// `error of v in L²(L²)` of the column `error_velocity_L2(L2)`.
fn error_of(column: &str) -> Option<String> {
    let (field, norm) = column.strip_prefix("error_")?.split_once('_')?;
    error(field, norm)
}

/// `error of v in L²(L²)` of the names that field and norm have in tables.
pub fn error(field: &str, norm: &str) -> Option<String> {
    let field = ErrorField::ALL.into_iter().find(|one| one.name() == field)?;
    let norm = Norm::ALL.into_iter().find(|one| one.name() == norm)?;
    Some(format!("error of {} in {}", field.symbol(), norm.symbol()))
}

/// As in the legend of a picture of one kind of measures.
pub fn short(column: &str) -> String {
    match known(column) {
        Some(measure) => measure.short.to_owned(),
        None => words(column),
    }
}

/// In words with the unit, as along an axis.
pub fn with_unit(name: &str) -> String {
    let unit = match known(estimated(name).unwrap_or(name)) {
        Some(measure) => measure.unit,
        None if name.contains('.') && !name.starts_with("error_") => "",
        None => NONE,
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
        for (at, measure) in MEASURES.iter().enumerate() {
            assert!(MEASURES[..at].iter().all(|other| other.column != measure.column), "{}", measure.column);
            assert!(![measure.words, measure.short].iter().any(|text| text.contains('_')), "{}", measure.column);
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
