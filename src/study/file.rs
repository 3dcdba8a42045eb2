//! The file of a study of orders.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::StudyError;
use crate::mesh::Point;
use crate::model::expression::Formula;
use crate::scene::{Scene, SceneError, SceneSource};

/// A sequence of runs of one scene, each level finer than the one before, for the observed orders of convergence.
///
/// ```toml
/// scene = "square.toml"
/// levels = [8, 16, 32]
/// vary = { "mesh.n" = "n", "time.step" = "1/(3*n)" }    # formulas of the level n
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OrderFile {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    title: Option<String>,
    scene: String,
    levels: Vec<f64>,
    vary: BTreeMap<String, Formula>,
    /// Least order that the fit of a field must have: the program fails below it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    expect: BTreeMap<String, f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    variant: Vec<VariantTable>,
}

/// `[[variant]]`: the same levels with other values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct VariantTable {
    name: String,
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
}

/// The same levels with other values of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Folder of its results.
    pub name: String,
    /// Keys of the scene and their values.
    pub set: Vec<(String, String)>,
}

/// A study of orders, read and checked as far as possible without running.
#[derive(Debug, Clone)]
pub struct OrderStudy {
    pub title: Option<String>,
    /// The scene, with the overrides that hold for all runs.
    pub scene: SceneSource,
    pub levels: Vec<f64>,
    /// Keys of the scene, and the formulas of the level `n` that give their values.
    pub vary: Vec<(String, Formula)>,
    /// At least one; the only one has no name.
    pub variants: Vec<Variant>,
    /// Least orders, by field.
    pub expect: Vec<(String, f64)>,
    source: SceneSource,
}

/// Keys of the study itself; all others are the scene's.
const OWN: [&str; 6] = ["title", "scene", "levels", "vary", "variant", "expect"];

impl OrderStudy {
    /// Reads a study and the scene it names; `sets` change keys of the study or else of the scene.
    ///
    /// # Errors
    /// Whatever is wrong with either, with file, key, value, rule and hint.
    pub fn read(path: &Path, sets: &[(String, String)]) -> Result<Self, StudyError> {
        let mut source = SceneSource::read(path)?;
        let own = |key: &str| OWN.contains(&key.split('.').next().unwrap_or(""));
        for (key, value) in sets.iter().filter(|(key, _)| own(key)) {
            source.set_in::<OrderFile>(key, value)?;
        }
        let file: OrderFile = source.tables().map_err(|found| found.1)?;
        let error = |key: &str, value: String, rule: &str, hint: &str| {
            let place = source.place(key);
            let (key, rule, hint) = (key.to_owned(), rule.to_owned(), hint.to_owned());
            StudyError::from(SceneError::Value { place, key, value, rule, hint })
        };
        let levels = file.levels.clone();
        let rising = levels.windows(2).all(|pair| pair[0] < pair[1]);
        if levels.len() < 2 || !rising || levels.iter().any(|n| !(n.is_finite() && *n > 0.0)) {
            let rule = "must be at least two positive numbers, each larger than the one before";
            return Err(error("levels", format!("{levels:?}"), rule, "such as [8, 16, 32]"));
        }
        let scene_file: PathBuf = source.folder().join(&file.scene);
        if !scene_file.is_file() {
            let hint = format!("paths start in the study's folder; looked for {}", scene_file.display());
            return Err(error("scene", format!("\"{}\"", file.scene), "there is no such file", &hint));
        }
        let mut scene = SceneSource::read(&scene_file)?;
        for (key, value) in sets.iter().filter(|(key, _)| !own(key)) {
            scene.set(key, value)?;
        }
        let mut variants: Vec<Variant> = Vec::new();
        for (at, table) in file.variant.iter().enumerate() {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            let used = variants.iter().any(|v| v.name == table.name);
            if table.name.is_empty() || !table.name.chars().all(plain) || used {
                let rule = "must be a name of its own of letters, digits, - and _: it becomes a folder";
                return Err(error(
                    &format!("variant.{at}.name"),
                    format!("\"{}\"", table.name),
                    rule,
                    "such as \"newton\"",
                ));
            }
            let set = table.set.iter().map(|(key, value)| (key.clone(), value.to_string())).collect();
            variants.push(Variant { name: table.name.clone(), set });
        }
        if variants.is_empty() {
            variants.push(Variant { name: String::new(), set: Vec::new() });
        }
        let known = crate::measure::errors::ErrorField::ALL.map(|f| f.name());
        if let Some((key, value)) = file.expect.iter().find(|(key, _)| !known.contains(&key.as_str())) {
            let rule = "there is no such field";
            return Err(error(
                &format!("expect.{key}"),
                value.to_string(),
                rule,
                &format!("the fields are {}", known.join(", ")),
            ));
        }
        let (title, vary) = (file.title, file.vary.into_iter().collect());
        let study = Self { title, scene, levels, vary, variants, expect: file.expect.into_iter().collect(), source };
        for variant in &study.variants {
            for &n in &study.levels {
                study.scene_at(variant, n)?;
            }
        }
        Ok(study)
    }

    /// The checked scene of a variant at level `n`.
    ///
    /// # Errors
    /// A formula that cannot be read or has no finite value; a value that the scene refuses; no exact fields.
    pub fn scene_at(&self, variant: &Variant, n: f64) -> Result<Scene, StudyError> {
        let mut source = self.scene.clone();
        for (key, value) in &variant.set {
            source.set(key, value)?;
        }
        for (key, formula) in &self.vary {
            let value = formula.parse(&[("n", n)]).and_then(|f| f.try_eval(Point::zeros(), 0.0));
            let value = value.map_err(|error| {
                let message = error.to_string();
                let (rule, hint) = message.split_once("; hint: ").unwrap_or((&message, "a formula of the level n"));
                SceneError::Value {
                    place: self.source.place(&format!("vary.{key}")),
                    key: format!("vary.\"{key}\""),
                    value: formula.to_string(),
                    rule: rule.to_owned(),
                    hint: hint.to_owned(),
                }
            })?;
            source.set(key, &value.to_string())?;
        }
        let scene = Scene::check(source)?;
        if scene.sources.exact.is_none() {
            return Err(StudyError::NoExact { place: scene.source().origin().to_owned() });
        }
        Ok(scene)
    }

    /// The study as it was read, with its overrides.
    pub fn text(&self) -> String {
        self.source.text()
    }
}
