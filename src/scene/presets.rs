//! `accuracy`: values for the keys that a scene leaves out, and what they were measured to give.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml_edit::{Item, Table, TableLike};

use super::error::SceneError;
use super::source::SceneSource;
use super::tables::SceneFile;
use crate::mesh::generate::{MeshScene, Scale};

/// How much accuracy is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Accuracy {
    /// For a first look.
    Draft,
    /// For most purposes.
    Standard,
    /// For numbers that are published.
    Fine,
}

/// What a preset sets where the scene does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preset {
    /// Its name.
    pub accuracy: Accuracy,
    /// `space.k`, unless one of `k` and `degree` is given.
    pub k: usize,
    /// `mesh.n` of a square.
    pub n: usize,
    /// `mesh.h` of a disc over its radius, of a ring over its width.
    pub h: f64,
    /// `mesh.h` of a strip or a racetrack over its width.
    pub h_far: f64,
    /// `mesh.h_disc` over the disc's radius.
    pub h_disc: f64,
    /// `mesh.grading`
    pub grading: f64,
    /// `mesh.curved`
    pub curved: usize,
    /// `time.step` over the least of `time.end` and the polarity's relaxation time, `Pe`.
    pub step: f64,
    /// `time.scheme`
    pub scheme: &'static str,
    /// `coupling.tolerance`
    pub tolerance: f64,
    /// `steady.residual`, of a scene with `[steady]`.
    pub residual: f64,
}

/// What a preset was measured to give.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// What was computed.
    pub case: &'static str,
    /// What the errors are of.
    pub measure: &'static str,
    /// Of draft, standard, fine.
    pub errors: [&'static str; 3],
    /// Wall seconds of draft, standard, fine.
    pub seconds: [f64; 3],
}

impl Accuracy {
    /// From the coarsest to the finest.
    pub const ALL: [Accuracy; 3] = [Accuracy::Draft, Accuracy::Standard, Accuracy::Fine];

    /// As in the scene file.
    pub fn name(self) -> &'static str {
        match self {
            Accuracy::Draft => "draft",
            Accuracy::Standard => "standard",
            Accuracy::Fine => "fine",
        }
    }

    /// What it sets.
    pub fn preset(self) -> Preset {
        PRESETS[self as usize]
    }
}

/// In the order of [`Accuracy::ALL`].
pub const PRESETS: [Preset; 3] = [
    Preset {
        accuracy: Accuracy::Draft,
        k: 1,
        n: 8,
        h: 0.14,
        h_far: 0.2,
        h_disc: 0.1,
        grading: 0.2,
        curved: 3,
        step: 0.1,
        scheme: "bdf2",
        tolerance: 1e-6,
        residual: 1e-6,
    },
    Preset {
        accuracy: Accuracy::Standard,
        k: 1,
        n: 16,
        h: 0.1,
        h_far: 0.1,
        h_disc: 0.09,
        grading: 0.2,
        curved: 3,
        step: 0.05,
        scheme: "bdf2",
        tolerance: 1e-7,
        residual: 1e-7,
    },
    Preset {
        accuracy: Accuracy::Fine,
        k: 2,
        n: 12,
        h: 0.14,
        h_far: 0.14,
        h_disc: 0.13,
        grading: 0.2,
        curved: 3,
        step: 0.025,
        scheme: "bdf3",
        tolerance: 1e-9,
        residual: 1e-9,
    },
];

/// Measured by the studies in `studies/tradeoff`; `docs/tradeoff.md` has the same table.
pub const MEASURED: &[Measured] = &[
    Measured {
        case: "manufactured square",
        measure: "v in L2(L2)",
        errors: ["2.3e-4", "2.8e-5", "1.4e-6"],
        seconds: [0.3, 1.7, 3.8],
    },
    Measured {
        case: "manufactured square",
        measure: "p in L2(L2)",
        errors: ["8.6e-5", "2.0e-5", "7.4e-7"],
        seconds: [0.3, 1.7, 3.8],
    },
    Measured {
        case: "closed disc",
        measure: "free energy",
        errors: ["1.8e-5", "4.1e-6", "≤7.9e-7"],
        seconds: [0.9, 2.6, 3.9],
    },
    Measured {
        case: "closed disc",
        measure: "viscous power",
        errors: ["7.8e-4", "1.7e-4", "≤3.4e-5"],
        seconds: [0.9, 2.6, 3.9],
    },
    Measured {
        case: "steady strip",
        measure: "overshoot of v",
        errors: ["≤2.1e-2", "≤2.5e-2", "≤1.9e-2"],
        seconds: [3.7, 6.5, 10.0],
    },
    Measured {
        case: "steady strip",
        measure: "overshoot of p",
        errors: ["8.3e-1", "≤1.1e0", "≤7.4e-1"],
        seconds: [3.7, 6.5, 10.0],
    },
    Measured {
        case: "steady strip",
        measure: "asymmetry of v",
        errors: ["2.4e-3", "≤1.3e-3", "≤1.2e-3"],
        seconds: [3.7, 6.5, 10.0],
    },
];

/// What a preset has put into a scene: keys and values.
pub type Filled = Vec<(String, String)>;

/// The scene with the values of its preset in the place of the keys that it leaves out, and what these are.
///
/// # Errors
/// A name that is no preset.
pub(super) fn fill(source: &SceneSource) -> Result<(SceneSource, Filled), Box<SceneError>> {
    let mut full = source.clone();
    let name = source.value("accuracy").and_then(Item::as_str);
    // what is no name of a preset is left to the tables, which refuse it
    let Some(accuracy) = Accuracy::ALL.into_iter().find(|accuracy| name == Some(accuracy.name())) else {
        return Ok((full, Vec::new()));
    };
    let mut filled = Vec::new();
    for (key, value) in values(source, accuracy.preset()) {
        let (table, name) = key.split_once('.').unwrap_or(("", key));
        if table_of(source, table).is_some_and(|table| table.contains_key(name)) {
            continue;
        }
        full.set_in::<SceneFile>(key, &value).map_err(Box::new)?;
        filled.push((key.to_owned(), value));
    }
    Ok((full, filled))
}

fn table_of<'a>(source: &'a SceneSource, name: &str) -> Option<&'a dyn TableLike> {
    source.value(name).and_then(Item::as_table_like)
}

/// Every value of a preset that the scene can take.
fn values(source: &SceneSource, preset: Preset) -> Vec<(&'static str, String)> {
    let empty = Table::new();
    let table = |name: &str| table_of(source, name).unwrap_or(&empty);
    let (space, time, model) = (table("space"), table("time"), table("model"));
    let number = |item: Option<&Item>| item.and_then(|i| i.as_float().or_else(|| i.as_integer().map(|n| n as f64)));
    let mut values = source.mesh().map_or_else(Vec::new, |mesh| mesh_values(&mesh, &preset));
    if !space.contains_key("degree") {
        values.push(("space.k", preset.k.to_string()));
    }
    values.push(("time.scheme", preset.scheme.to_owned()));
    if let (Some(end), Some(peclet)) = (number(time.get("end")), number(model.get("peclet"))) {
        values.push(("time.step", format!("{:?}", preset.step * end.min(peclet))));
    }
    values.push(("coupling.tolerance", format!("{:?}", preset.tolerance)));
    if source.has("steady") {
        values.push(("steady.residual", format!("{:?}", preset.residual)));
    }
    values
}

/// Lengths follow from the shape's own.
fn mesh_values(mesh: &MeshScene, p: &Preset) -> Vec<(&'static str, String)> {
    let rounded = |x: f64| format!("{:?}", (x * 1e6).round() / 1e6);
    let h = match mesh.scale() {
        Scale::None => return Vec::new(),
        Scale::Count => return vec![("mesh.n", p.n.to_string())],
        Scale::Across(width) => p.h_far * width,
        Scale::Inside(size) => p.h * size,
    };
    let most = mesh.get("h").unwrap_or(f64::INFINITY);
    let others = [
        ("mesh.h_disc", rounded((p.h_disc * mesh.radius()).min(most))),
        ("mesh.grading", rounded(p.grading)),
        ("mesh.curved", p.curved.to_string()),
    ];
    let others = others.into_iter().filter(|(key, _)| key.strip_prefix("mesh.").is_some_and(|key| mesh.has(key)));
    std::iter::once(("mesh.h", rounded(h))).chain(others).collect()
}
