//! The file of a sweep: one scene with many values.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::StudyError;
use super::source::{self, Kind, Values, check_name, check_values, override_of, refuse, value_text};
use crate::scene::{Scene, SceneError, SceneSource};

/// One scene with other values, run by run.
///
/// ```toml
/// scene = "square.toml"
/// set = { "time.end" = 0.5 }                    # in all runs
/// vary = { "model.slip" = [-1, 0, 1] }          # a run for each; of several lists, for each combination
/// ```
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SweepFile {
    title: Option<String>,
    scene: String,
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
    #[serde(default)]
    vary: BTreeMap<String, Vec<toml::Value>>,
    #[serde(default)]
    case: Vec<CaseTable>,
    richardson: Option<RichardsonTable>,
}

/// `[richardson]`: named cases that refine the mesh again and again by the same ratio.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RichardsonTable {
    /// Coarse to fine.
    cases: Vec<String>,
    /// Size of the cells in a case over that in the next.
    ratio: f64,
}

/// `[[case]]`: a run of its own.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseTable {
    name: String,
    #[serde(default)]
    set: BTreeMap<String, toml::Value>,
}

/// One run of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Folder of its results: its number, and its name if it has one.
    pub folder: String,
    pub name: Option<String>,
    /// Keys of the scene and their values.
    pub set: Values,
}

/// A sweep, read and checked as far as possible without running.
#[derive(Debug, Clone)]
pub struct SweepStudy {
    pub title: Option<String>,
    /// The scene, with the overrides that hold for all runs.
    pub scene: SceneSource,
    /// At least one; the combinations of `vary` before the named ones.
    pub cases: Vec<Case>,
    /// Cases, coarse to fine, whose measures are extrapolated, and the ratio of their cell sizes.
    pub richardson: Option<(Vec<String>, f64)>,
    source: SceneSource,
}

/// More runs than anybody waits for: lists multiply.
const MOST: usize = 10_000;

impl SweepStudy {
    /// Reads a sweep and the scene it names; `sets` change keys of the study or else of the scene.
    ///
    /// # Errors
    /// Whatever is wrong with either, with file, key, value, rule and hint. A value that the scene refuses in some of the runs
    /// is found only by [`SweepStudy::scene_of`]; one that it refuses in all of them is an error.
    pub fn read(path: &Path, sets: &[(String, String)]) -> Result<Self, StudyError> {
        let source = source::read::<SweepFile>(path, Kind::Sweep, sets)?;
        let file: SweepFile = source.tables().map_err(|found| found.1)?;
        let mut scene = source::read_scene(&source, &file.scene)?;
        let varied = |key: &str| file.vary.contains_key(key);
        let everywhere = check_values(&source, "set", &file.set, &varied, "from run to run")?;
        for (key, value) in &everywhere {
            scene
                .set(key, value)
                .map_err(|error| within(&source, &format!("set.{key}"), "every run".to_owned(), error))?;
        }
        let fixed = |key: &str| {
            let by_case = file.case.iter().find(|case| case.set.contains_key(key));
            let rule = match (varied(key), by_case) {
                (true, _) => "`vary` of the study sets it from run to run".to_owned(),
                (false, Some(case)) => format!("case `{}` of the study sets it", case.name),
                (false, None) => return None,
            };
            Some((
                rule,
                "set `vary` or `case` as a whole, as in --set 'vary={ \"model.beta\" = [0.1, 0.9] }'".to_owned(),
            ))
        };
        source::apply(&mut scene, Kind::Sweep, sets, &fixed)?;
        let cases = check_cases(&source, &file)?;
        let richardson = file.richardson.as_ref().map(|table| check_richardson(&source, table, &cases)).transpose()?;
        let study = Self { title: file.title, scene, cases, richardson, source };
        study.check_scenes()?;
        Ok(study)
    }

    /// Refuses keys that no scene has, and a sweep that has no good scene at all.
    fn check_scenes(&self) -> Result<(), StudyError> {
        let mut first = None;
        let mut good = false;
        for (at, case) in self.cases.iter().enumerate() {
            match self.try_scene(case) {
                Ok(_) => good = true,
                Err(error @ SceneError::UnknownKey { .. }) => return Err(self.blame(at, error)),
                Err(error) => first = first.or(Some((at, error))),
            }
        }
        match first {
            Some((at, error)) if !good => Err(self.blame(at, error)),
            Some(_) | None => Ok(()),
        }
    }

    fn try_scene(&self, case: &Case) -> Result<Scene, SceneError> {
        let mut source = self.scene.clone();
        for (key, value) in &case.set {
            source.set(key, value)?;
        }
        Scene::check(source)
    }

    /// The checked scene of run `at`.
    ///
    /// # Errors
    /// A value that the scene refuses.
    pub fn scene_of(&self, at: usize) -> Result<Scene, StudyError> {
        self.try_scene(&self.cases[at]).map_err(|error| self.blame(at, error))
    }

    /// Names the place in the study that set what the scene refuses.
    fn blame(&self, at: usize, error: SceneError) -> StudyError {
        let case = &self.cases[at];
        let Some(path) = override_of(&error).filter(|path| case.set.iter().any(|(key, _)| key == path)) else {
            return error.into();
        };
        let key = match &case.name {
            None => format!("vary.{path}"),
            Some(_) => format!("case.{}.set.{path}", at + self.named() - self.cases.len()),
        };
        within(&self.source, &key, format!("run {}", case.folder), error)
    }

    /// Number of named cases, which come last.
    fn named(&self) -> usize {
        self.cases.iter().filter(|case| case.name.is_some()).count()
    }

    /// Keys that differ from run to run, in the order of the file.
    pub fn keys(&self) -> Vec<&str> {
        let mut keys: Vec<&str> = Vec::new();
        for (key, _) in self.cases.iter().flat_map(|case| &case.set) {
            if !keys.contains(&key.as_str()) {
                keys.push(key);
            }
        }
        keys
    }

    /// The study as it was read, with its overrides; the path of its scene is absolute.
    pub fn text(&self) -> String {
        source::text::<SweepFile>(&self.source, &self.scene)
    }
}

/// At least three cases that exist, and a ratio above 1.
fn check_richardson(
    source: &SceneSource,
    table: &RichardsonTable,
    cases: &[Case],
) -> Result<(Vec<String>, f64), StudyError> {
    let missing = table.cases.iter().find(|name| !cases.iter().any(|case| case.name.as_ref() == Some(name)));
    let known: Vec<&str> = cases.iter().filter_map(|case| case.name.as_deref()).collect();
    let (key, value) = ("richardson.cases", format!("{:?}", table.cases));
    if let Some(name) = missing {
        let rule = format!("there is no case `{name}`{}", crate::model::names::did_you_mean(name, &known));
        return Err(refuse(source, key, value, &rule, &format!("the named cases are {}", known.join(", "))));
    }
    if table.cases.len() < 3 {
        return Err(refuse(source, key, value, "must be at least three", "coarse to fine"));
    }
    if !(table.ratio.is_finite() && table.ratio > 1.0) {
        let (value, rule) = (format!("{:?}", table.ratio), "must be above 1: sizes of a case over those of the next");
        return Err(refuse(source, "richardson.ratio", value, rule, "2.0 halves the cells"));
    }
    Ok((table.cases.clone(), table.ratio))
}

fn within(source: &SceneSource, key: &str, part: String, error: SceneError) -> StudyError {
    StudyError::Within { place: source.place(key), part, error: Box::new(error.into()) }
}

/// The combinations of `vary`, the last list fastest, then the named cases.
fn check_cases(source: &SceneSource, file: &SweepFile) -> Result<Vec<Case>, StudyError> {
    if file.vary.is_empty() && file.case.is_empty() {
        let hint = "such as vary = { \"model.beta\" = [0.05, 0.5, 0.995] }, or [[case]] with `name` and `set`";
        return Err(refuse(source, "vary", "{}".to_owned(), "there is nothing to run", hint));
    }
    let mut sets: Vec<(Option<String>, Values)> =
        combinations(source, file)?.into_iter().map(|set| (None, set)).collect();
    for (at, table) in file.case.iter().enumerate() {
        let used = file.case[..at].iter().map(|other| other.name.as_str());
        check_name(source, &format!("case.{at}.name"), &table.name, used)?;
        let set = check_values(source, &format!("case.{at}.set"), &table.set, &|_| false, "")?;
        sets.push((Some(table.name.clone()), set));
    }
    let digits = sets.len().to_string().len().max(2);
    let numbered = sets.into_iter().enumerate().map(|(at, (name, set))| {
        let number = format!("{:0digits$}", at + 1);
        Case { folder: name.as_ref().map_or(number.clone(), |name| format!("{number}-{name}")), name, set }
    });
    Ok(numbered.collect())
}

/// No run at all without `vary`.
fn combinations(source: &SceneSource, file: &SweepFile) -> Result<Vec<Values>, StudyError> {
    if file.vary.is_empty() {
        return Ok(Vec::new());
    }
    let mut sets: Vec<Values> = vec![Vec::new()];
    for key in keys_in_order(source, file) {
        let (values, at) = (&file.vary[key], format!("vary.{key}"));
        if values.is_empty() {
            let hint = "list its values, as in \"model.beta\" = [0.05, 0.5]";
            return Err(refuse(source, &at, "[]".to_owned(), "the list is empty: there is nothing to run", hint));
        }
        let count = sets.len() * values.len();
        if count > MOST {
            let rule = format!("with it there are {count} combinations, and at most {MOST} may be");
            return Err(refuse(source, &at, format!("{} values", values.len()), &rule, "shorten a list"));
        }
        let with = |set: &Values, value: &toml::Value| {
            set.iter().cloned().chain([(key.to_owned(), value_text(value))]).collect()
        };
        sets = sets.iter().flat_map(|set| values.iter().map(move |value| with(set, value))).collect();
    }
    Ok(sets)
}

/// Keys of `vary` in the order of the file.
fn keys_in_order<'a>(source: &'a SceneSource, file: &'a SweepFile) -> Vec<&'a str> {
    let table = source.value("vary").and_then(toml_edit::Item::as_table_like);
    let keys: Vec<&str> = table.map(|table| table.iter().map(|(key, _)| key).collect()).unwrap_or_default();
    debug_assert_eq!(keys.len(), file.vary.len(), "the table was read from this text");
    keys
}
