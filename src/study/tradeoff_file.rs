//! The file of a study of the trade of accuracy against time.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use super::StudyError;
use super::source::{self, StudyFileKind, Values, below, check_name, check_values, refuse, value_text, within};
use crate::measure::Measure;
use crate::measure::errors::Norm;
use crate::measure::list::ALL;
use crate::model::fields::{self, FieldId};
use crate::names;
use crate::scene::{Scene, SceneError, SceneSource};
use crate::schema::{self, Range};

/// One scene with many settings of its accuracy, each timed and compared with a reference.
///
/// ```toml
/// scene = "square.toml"
/// reference = "exact"                                # or { set = { "mesh.h" = 0.5 }, coarser = { "mesh.h" = 0.7 } }
/// measures = ["velocity", "polarity"]
/// [[setting]]
/// name = "k1"
/// set = { "space.k" = 1 }
/// vary = { "mesh.n" = [4, 8, 16] }                   # a setting for each; of several lists, for each combination
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub(super) struct TradeoffFile {
    /// Title of the plots.
    title: Option<String>,
    /// The scene, from the study's folder.
    #[schemars(extend("x-values" = "path"))]
    scene: String,
    /// Values that the scene has in all runs.
    #[serde(default)]
    #[schemars(schema_with = "schema::any_values")]
    set: BTreeMap<String, toml::Value>,
    /// What errors are measured against.
    #[schemars(extend("x-values" = "`\"exact\"`, or a table"))]
    reference: ReferenceValue,
    /// What is compared.
    #[schemars(transform = schema::not_empty, extend("x-values" = "list"))]
    measures: Vec<String>,
    /// Runs with other values, `[[setting]]`.
    #[serde(default)]
    #[schemars(transform = schema::not_empty)]
    #[schemars(extend("x-values" = "tables with `name`, `set`, `vary`", "x-default" = "–"))]
    setting: Vec<SettingTable>,
}

/// `reference`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
enum ReferenceValue {
    /// The exact fields of the scene.
    Name(#[schemars(extend("const" = "exact"))] String),
    Table(#[schemars(with = "ReferenceTable")] toml::Table),
}

/// `reference = { … }`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub(super) struct ReferenceTable {
    /// Values of the finest run.
    #[schemars(schema_with = "schema::any_values")]
    set: BTreeMap<String, toml::Value>,
    /// Values of the next coarser one.
    #[schemars(schema_with = "schema::any_values")]
    coarser: BTreeMap<String, toml::Value>,
    /// Order of the difference between the two.
    #[serde(default = "default_order")]
    #[schemars(transform = Range::POSITIVE.said())]
    order: f64,
    /// Whether all other runs begin at the state of the finest.
    #[serde(default)]
    start: bool,
}

fn default_order() -> f64 {
    2.0
}

/// `[[setting]]`
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
struct SettingTable {
    /// In tables and pictures.
    name: String,
    /// Values of the scene.
    #[serde(default)]
    #[schemars(schema_with = "schema::any_values")]
    set: BTreeMap<String, toml::Value>,
    /// Keys with lists of values: a setting for each combination.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, Vec<serde_json::Value>>")]
    vary: BTreeMap<String, Vec<toml::Value>>,
}

/// A way to run the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// As the study calls it.
    pub name: String,
    /// Keys of the scene and their values.
    pub set: Values,
}

/// What errors are measured against.
#[derive(Debug, Clone, PartialEq)]
pub enum Reference {
    /// The scene's exact fields.
    Exact,
    /// A finest run, and one next to it that tells how good it is.
    Finest {
        /// The setting that stands for the truth.
        finest: Setting,
        /// One beside which its own error is judged.
        coarser: Setting,
        /// The order by which errors are thought to fall.
        order: f64,
        /// Whether the search at the finest begins at the state of the coarser one.
        start: bool,
    },
}

/// A study, read and checked as far as possible without running.
#[derive(Debug, Clone)]
pub struct TradeoffStudy {
    /// One line for reports.
    pub title: Option<String>,
    /// The scene, with the overrides that hold for all runs.
    pub scene: SceneSource,
    /// Whose errors are told.
    pub measures: Vec<String>,
    /// What errors are measured against.
    pub reference: Reference,
    /// What is compared.
    pub settings: Vec<Setting>,
    source: SceneSource,
}

/// More settings than a picture can show.
const MOST: usize = 200;

impl TradeoffStudy {
    /// Reads a study and the scene that it names; `sets` change keys of the study or else of the scene.
    ///
    /// # Errors
    /// Whatever is wrong with either, with file, key, value, rule and hint; every setting's scene is checked.
    pub fn read(path: &Path, sets: &[(String, String)]) -> Result<Self, StudyError> {
        let sets = &source::sets_now(sets);
        let source = source::read::<TradeoffFile>(path, StudyFileKind::Tradeoff, sets)?;
        let file: TradeoffFile = source.tables().map_err(|found| found.1)?;
        let mut scene = source::read_scene(&source, &file.scene)?;
        for (key, value) in check_values(&source, "set", &file.set, &|_| false, "")? {
            scene.set(&key, &value).map_err(|error| within(&source, &below("set", &key), error))?;
        }
        source::apply(&mut scene, StudyFileKind::Tradeoff, sets, &|_| None)?;
        let reference = check_reference(&source, &file.reference)?;
        let settings = settings(&source, &file.setting)?;
        let study = Self { title: file.title, scene, measures: file.measures, reference, settings, source };
        study.check()?;
        Ok(study)
    }

    fn check(&self) -> Result<(), StudyError> {
        if self.measures.is_empty() {
            let hint = "name what is compared, such as \"overshoot_velocity\"";
            return Err(refuse(&self.source, "measures", "[]".into(), "the list is empty", hint));
        }
        let exact = matches!(self.reference, Reference::Exact);
        for name in &self.measures {
            let known: Vec<String> =
                if exact { error_names() } else { columns().iter().map(|c| c.0.to_owned()).collect() };
            if !known.contains(name) {
                let list: Vec<&str> = known.iter().map(String::as_str).collect();
                let rule = format!(
                    "there is no such {}{}",
                    if exact { "error" } else { "measure" },
                    names::did_you_mean(name, &list)
                );
                let hint = format!("the choices are {}", list.join(", "));
                return Err(refuse(&self.source, "measures", format!("\"{name}\""), &rule, &hint));
            }
        }
        let base = self.scene_of(&Setting { name: "scene".into(), set: Vec::new() }, None)?;
        if exact && base.sources.exact.is_none() {
            return Err(StudyError::NoExact { place: self.source.place("reference").to_string() });
        }
        let pair: Vec<&Setting> = match &self.reference {
            Reference::Exact => Vec::new(),
            Reference::Finest { finest, coarser, .. } => vec![finest, coarser],
        };
        pair.into_iter().chain(&self.settings).try_for_each(|setting| self.scene_of(setting, None).map(drop))
    }

    /// The checked scene of a setting, with the measures that are compared and no other output; begun at the state in
    /// the file `start` if there is one.
    ///
    /// # Errors
    /// A value that the scene refuses.
    pub fn scene_of(&self, setting: &Setting, start: Option<&Path>) -> Result<Scene, StudyError> {
        let blame = |error: SceneError| StudyError::Within {
            place: self.source.place("setting"),
            part: format!("setting `{}`", setting.name),
            error: Box::new(error.into()),
        };
        let mut source = self.scene.clone();
        for (key, value) in &setting.set {
            source.set(key, value).map_err(blame)?;
        }
        source.set("output", &self.outputs()).map_err(blame)?;
        if let Some(start) = start {
            let file = toml::Value::from(BTreeMap::from([("file", start.to_string_lossy().into_owned())])).to_string();
            source.set("initial.polarity", &file).map_err(blame)?;
        }
        Scene::check(source).map_err(blame)
    }

    /// The value of `output`.
    fn outputs(&self) -> String {
        let named = |column: &String| columns().into_iter().find(|c| c.0 == column).and_then(|c| c.1);
        let mut names: Vec<String> =
            self.measures.iter().filter_map(named).map(|measure| format!("\"{}\"", measure.name)).collect();
        names.sort();
        names.dedup();
        if names.is_empty() { "[]".to_owned() } else { format!("[{{ measures = [{}] }}]", names.join(", ")) }
    }

    /// The study as it was read, with its overrides; the path of its scene is absolute.
    pub fn text(&self) -> String {
        let text = source::text::<TradeoffFile>(&self.source, &self.scene);
        // what `--set` changed in the scene belongs to the results as well
        let scene = Scene::check(self.scene.clone()).map(|scene| scene.resolved_toml()).unwrap_or_default();
        scene.lines().fold(text + "\n# the scene:\n", |text, line| text + "# " + line + "\n")
    }
}

/// Numbers of a summary that can be compared, and the measures that they belong to; those on boundary tags are not
/// asked for by a column alone.
fn columns() -> Vec<(&'static str, Option<&'static Measure>)> {
    let measured = |measure: &&'static Measure| {
        let measure = *measure;
        measure.column_names().map(move |name| (name, Some(measure)))
    };
    ALL.iter()
        .filter(|measure| !measure.is_on_a_tag())
        .flat_map(measured)
        .chain(["growth", "frequency"].map(|name| (name, None)))
        .collect()
}

/// `velocity` for the norm L2(L2), `velocity Linf(Linf)` for another, and so on.
fn error_names() -> Vec<String> {
    let others = |field: FieldId| Norm::of(field).filter(|norm| *norm != Norm::Square);
    let of = |field: FieldId| {
        let named = others(field).map(move |norm| format!("{} {}", field.name, norm.name()));
        std::iter::once(field.name.to_owned()).chain(named)
    };
    fields::ALL.into_iter().flat_map(of).collect()
}

fn check_reference(source: &SceneSource, value: &ReferenceValue) -> Result<Reference, StudyError> {
    let hint =
        "write \"exact\", or { set = { … }, coarser = { … } } with the values of the finest run and of the one before";
    let table = match value {
        ReferenceValue::Name(name) if name == "exact" => return Ok(Reference::Exact),
        ReferenceValue::Name(name) => {
            return Err(refuse(source, "reference", format!("\"{name}\""), "there is no such reference", hint));
        }
        ReferenceValue::Table(table) => table,
    };
    let table: ReferenceTable = table.clone().try_into().map_err(|error: toml::de::Error| {
        let rule = error.message().replace('\n', ", ");
        refuse(source, "reference", "(a table)".into(), &rule, hint)
    })?;
    let order = table.order;
    if !Range::POSITIVE.has(order) {
        return Err(refuse(
            source,
            "reference.order",
            format!("{order:?}"),
            "must be finite and greater than 0",
            "2 is cautious",
        ));
    }
    let values = |at: &str, set| check_values(source, &format!("reference.{at}"), set, &|_| false, "");
    let finest = Setting { name: "reference".into(), set: values("set", &table.set)? };
    let coarser = Setting { name: "reference-coarser".into(), set: values("coarser", &table.coarser)? };
    if finest.set == coarser.set {
        let rule = "must differ from those of the finest run";
        return Err(refuse(source, "reference.coarser", "(the same)".into(), rule, "such as { \"mesh.h\" = 1.0 }"));
    }
    Ok(Reference::Finest { finest, coarser, order, start: table.start })
}

/// Every setting once, the combinations of its lists with the last list fastest.
fn settings(source: &SceneSource, tables: &[SettingTable]) -> Result<Vec<Setting>, StudyError> {
    let mut settings: Vec<Setting> = Vec::new();
    for (at, table) in tables.iter().enumerate() {
        let used = tables[..at].iter().map(|other| other.name.as_str()).chain(["reference", "reference-coarser"]);
        check_name(source, &format!("setting.{at}.name"), &table.name, used)?;
        let set =
            check_values(source, &format!("setting.{at}.set"), &table.set, &|key| table.vary.contains_key(key), "")?;
        let mut all = vec![Setting { name: table.name.clone(), set }];
        for (key, values) in &table.vary {
            if values.is_empty() {
                let place = below(&format!("setting.{at}.vary"), key);
                return Err(refuse(source, &place, "[]".into(), "the list is empty", "list its values, as in [8, 16]"));
            }
            let with = |setting: &Setting, value: &toml::Value| {
                let set = setting.set.iter().cloned().chain([(key.clone(), value_text(value))]).collect();
                Setting { name: format!("{} {}", setting.name, short(key, value)), set }
            };
            all = all.iter().flat_map(|setting| values.iter().map(move |value| with(setting, value))).collect();
        }
        settings.extend(all);
    }
    // a preset fills in what is taken away after it
    settings.iter_mut().for_each(|setting| setting.set.sort_by_key(|(key, _)| key != "accuracy"));
    let count = settings.len();
    if count == 0 || count > MOST {
        let rule = format!("there are {count} settings, and must be 1 to {MOST}");
        let hint = "give [[setting]] with a `name`, and `set` or `vary`";
        return Err(refuse(source, "setting", "(a list)".into(), &rule, hint));
    }
    Ok(settings)
}

/// `h=0.5` of `mesh.h`
fn short(key: &str, value: &toml::Value) -> String {
    let name = key.rsplit('.').next().unwrap_or(key);
    let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    format!("{name}={value}")
}
