//! The file of a study of orders.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::StudyError;
use super::source::{self, StudyFileKind, below, check_name, check_values, override_of, refuse};
use crate::expression::{ExpressionError, Formula};
use crate::mesh::Point;
use crate::model::fields;
use crate::names;
use crate::run::AnyScene;
use crate::scene::{Scene, SceneError, SceneSource};
use crate::schema::{self, Range};

/// A sequence of runs of one scene, each level finer than the one before, for the observed orders of convergence.
///
/// ```toml
/// scene = "square.toml"
/// levels = [8, 16, 32]
/// vary = { "mesh.n" = "n", "time.step" = "1/(3*n)" }    # formulas of the level n
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub(super) struct OrderFile {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    /// Of the plot.
    title: Option<String>,
    /// The scene, from the study's folder.
    #[schemars(extend("x-values" = "path"))]
    scene: String,
    /// The values of `n`, coarse to fine.
    #[schemars(transform = Range::POSITIVE.said())]
    #[schemars(extend("minItems" = 2, "x-values" = "two or more rising numbers > 0"))]
    levels: Vec<f64>,
    /// Keys of the scene and their values.
    #[schemars(extend("x-values" = "table of formulas of `n`"))]
    vary: BTreeMap<String, Formula>,
    /// Least orders of `velocity`, `pressure`, `polarity`, `laplacian`, below which the program fails; `{}` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-values" = "table of numbers", "x-default" = "by degree"))]
    expect: Option<BTreeMap<String, f64>>,
    /// The same levels with other values of the scene, `[[variant]]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(extend("x-values" = "tables with `name`, `set`, `expect`", "x-default" = "one, no name"))]
    variant: Vec<VariantTable>,
}

/// `[[variant]]`: the same levels with other values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
struct VariantTable {
    /// Name of its folder.
    name: String,
    /// Values of the scene.
    #[serde(default)]
    #[schemars(schema_with = "schema::any_values")]
    set: BTreeMap<String, toml::Value>,
    /// In place of the study's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    expect: Option<BTreeMap<String, f64>>,
}

/// The same levels with other values of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Folder of its results.
    pub name: String,
    /// Keys of the scene and their values.
    pub set: source::Values,
    /// Least orders, by field; `None` for those that the degrees promise.
    pub expect: Option<Vec<(String, f64)>>,
}

/// A study of orders, read and checked as far as possible without running.
#[derive(Debug, Clone)]
pub struct OrderStudy {
    /// One line for reports.
    pub title: Option<String>,
    /// The scene, with the overrides that hold for all runs.
    pub scene: SceneSource,
    /// Values of the key that is refined, the coarsest first.
    pub levels: Vec<f64>,
    /// Keys of the scene, and the formulas of the level `n` that give their values.
    pub vary: Vec<(String, Formula)>,
    /// At least one; the only one has no name.
    pub variants: Vec<Variant>,
    source: SceneSource,
}

impl OrderStudy {
    /// Reads a study and the scene it names; `sets` change keys of the study or else of the scene.
    ///
    /// # Errors
    /// Whatever is wrong with either, with file, key, value, rule and hint.
    pub fn read(path: &Path, sets: &[(String, String)]) -> Result<Self, StudyError> {
        let sets = &source::sets_now(sets);
        let source = source::read::<OrderFile>(path, StudyFileKind::Order, sets)?;
        let file: OrderFile = source.tables().map_err(|found| found.1)?;
        check_levels(&source, &file.levels)?;
        let fixed = |key: &str| {
            let hint = "set `vary` as a whole, as in --set 'vary={ \"mesh.n\" = \"n\" }'".to_owned();
            file.vary.contains_key(key).then(|| ("`vary` of the study sets it at every level".to_owned(), hint))
        };
        let mut scene = source::read_scene(&source, &file.scene)?;
        source::apply(&mut scene, StudyFileKind::Order, sets, &fixed)?;
        let variants = check_variants(&source, &file)?;
        let (title, vary) = (file.title, file.vary.into_iter().collect());
        let study = Self { title, scene, levels: file.levels, vary, variants, source };
        for variant in &study.variants {
            study.check_sizes(variant)?;
        }
        Ok(study)
    }

    /// Sets up the scene of every level: each must differ from the one before in the size that orders refer to.
    fn check_sizes(&self, variant: &Variant) -> Result<(), StudyError> {
        let scenes: Vec<AnyScene> = self.levels.iter().map(|&n| self.scene_at(variant, n)).collect::<Result<_, _>>()?;
        let meshes: Vec<bool> = scenes.windows(2).map(|pair| pair[0].mesh() != pair[1].mesh()).collect();
        let step = |scene: &AnyScene| scene.compared().map(|compared| compared.step);
        let steps = scenes.windows(2).map(|pair| step(&pair[0]) != step(&pair[1]));
        let all_meshes = meshes.iter().all(|&differ| differ);
        let steps_alone = !meshes.contains(&true) && steps.into_iter().all(|differ| differ);
        if all_meshes || steps_alone {
            return Ok(());
        }
        let keys: Vec<&str> = self.vary.iter().map(|(key, _)| key.as_str()).collect();
        let rule = "must change [mesh] at every level, or [mesh] at none and `time.step` at every level";
        let hint = "such as { \"mesh.n\" = \"n\", \"time.step\" = \"1/(3*n)\" }";
        Err(refuse(&self.source, "vary", format!("{{ {} }}", keys.join(", ")), rule, hint))
    }

    /// The checked scene of a variant at level `n`.
    ///
    /// # Errors
    /// A formula that cannot be read or has no finite value; a value that the scene refuses; no exact fields.
    pub fn scene_at(&self, variant: &Variant, n: f64) -> Result<AnyScene, StudyError> {
        let blame = |error: SceneError| self.blame(variant, n, error);
        let mut source = self.scene.clone();
        for (key, value) in &variant.set {
            source.set(key, value).map_err(blame)?;
        }
        for (key, formula) in &self.vary {
            let value = formula.parse(&[("n", n)]).and_then(|f| f.try_eval(Point::zeros(), 0.0));
            let value = value.map_err(|error| {
                let message = error.to_string();
                let (rule, hint) = message.split_once("; hint: ").unwrap_or((&message, "a formula of the level n"));
                let at = if matches!(error, ExpressionError::NotFinite { .. }) {
                    format!(", at n = {n}")
                } else {
                    String::new()
                };
                let (rule, value) = (format!("{rule}{at}"), format!("\"{formula}\""));
                refuse(&self.source, &below("vary", key), value, &rule, hint)
            })?;
            source.set(key, &value.to_string()).map_err(blame)?;
        }
        if !(source.kind().keys.top)().contains(&"exact") {
            // which refuses it as what it is
            Scene::check(source.clone()).map_err(blame)?;
        }
        let scene = AnyScene::check(source).map_err(blame)?;
        match scene.compared() {
            Some(_) => Ok(scene),
            None => Err(StudyError::NoExact { place: scene.source().origin().to_owned() }),
        }
    }

    /// Names the place in the study that set what the scene refuses.
    fn blame(&self, variant: &Variant, n: f64, error: SceneError) -> StudyError {
        let Some(path) = override_of(&error).map(str::to_owned) else { return error.into() };
        let (place, part) = if self.vary.iter().any(|(key, _)| *key == path) {
            (self.source.place(&below("vary", &path)), format!("level n = {n}"))
        } else if variant.set.iter().any(|(key, _)| *key == path) {
            let at = self.variants.iter().position(|v| v.name == variant.name).unwrap_or(0);
            (self.source.place(&below(&format!("variant.{at}.set"), &path)), format!("variant `{}`", variant.name))
        } else {
            return error.into();
        };
        StudyError::Within { place, part, error: Box::new(error.into()) }
    }

    /// Names the level that an error of its run belongs to.
    pub(super) fn in_level(&self, variant: &Variant, n: f64, error: StudyError) -> StudyError {
        let name = if variant.name.is_empty() { String::new() } else { format!("variant `{}`, ", variant.name) };
        let (place, part) = (self.source.place("levels"), format!("{name}level n = {n}"));
        StudyError::Within { place, part, error: Box::new(error) }
    }

    /// The study as it was read, with its overrides; the path of its scene is absolute.
    pub fn text(&self) -> String {
        source::text::<OrderFile>(&self.source, &self.scene)
    }
}

fn check_levels(source: &SceneSource, levels: &[f64]) -> Result<(), StudyError> {
    let rising = levels.windows(2).all(|pair| pair[0] < pair[1]);
    if levels.len() < 2 || !rising || levels.iter().any(|n| !(n.is_finite() && *n > 0.0)) {
        let rule = "must be at least two positive numbers, each larger than the one before";
        return Err(refuse(source, "levels", format!("{levels:?}"), rule, "such as [8, 16, 32]"));
    }
    Ok(())
}

fn check_variants(source: &SceneSource, file: &OrderFile) -> Result<Vec<Variant>, StudyError> {
    check_expectations(source, "expect", file.expect.as_ref())?;
    let expect = |own: Option<&BTreeMap<String, f64>>| -> Option<Vec<(String, f64)>> {
        let given = own.or(file.expect.as_ref())?;
        Some(given.iter().map(|(field, order)| (field.clone(), *order)).collect())
    };
    let mut variants: Vec<Variant> = Vec::new();
    for (at, table) in file.variant.iter().enumerate() {
        check_name(source, &format!("variant.{at}.name"), &table.name, variants.iter().map(|v| v.name.as_str()))?;
        let varied = |key: &str| file.vary.contains_key(key);
        let set = check_values(source, &format!("variant.{at}.set"), &table.set, &varied, "at every level")?;
        let own = table.expect.as_ref();
        check_expectations(source, &format!("variant.{at}.expect"), own)?;
        variants.push(Variant { name: table.name.clone(), set, expect: expect(own) });
    }
    if variants.is_empty() {
        variants.push(Variant { name: String::new(), set: Vec::new(), expect: expect(None) });
    }
    Ok(variants)
}

fn check_expectations(
    source: &SceneSource,
    table: &str,
    expect: Option<&BTreeMap<String, f64>>,
) -> Result<(), StudyError> {
    let known = fields::ALL.map(|field| field.name);
    for (field, order) in expect.into_iter().flatten() {
        let key = format!("{table}.{field}");
        if !known.contains(&field.as_str()) {
            let rule = format!("there is no such field{}", names::did_you_mean(field, &known));
            let hint = format!("the fields are {}", known.join(", "));
            return Err(refuse(source, &key, order.to_string(), &rule, &hint));
        }
        if !order.is_finite() {
            return Err(refuse(source, &key, order.to_string(), "must be finite", "the least order, such as 2.8"));
        }
    }
    Ok(())
}
