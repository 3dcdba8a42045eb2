//! The file of a sweep: one scene with many values.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use super::axes::{self, Axis, AxisValues, SEED, Seeds};
use super::figures::PlotSpec;
use super::key_forms::{Plots, WarmStart};
use super::slurm::SlurmTable;
use super::source::{self, StudyFileKind, Values, check_name, check_values, override_of, refuse};
use super::{StudyError, results};
use crate::run::AnyScene;
use crate::scene::{SceneError, SceneSource};
use crate::schema::{self, Range};

/// One scene with other values, run by run.
///
/// ```toml
/// scene = "square.toml"
/// set = { "time.end" = 0.5 }                    # in all runs
/// vary = { "model.alignment" = [-1, 0, 1] }          # a run for each; of several lists, for each combination
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub(super) struct SweepFile {
    /// What it is.
    title: Option<String>,
    /// The scene, from the study's folder.
    #[schemars(extend("x-values" = "path"))]
    scene: String,
    /// How long it takes on 2 cores; printed at the start.
    duration: Option<String>,
    /// Values that the scene has in all runs.
    #[serde(default)]
    #[schemars(schema_with = "schema::any_values")]
    set: BTreeMap<String, toml::Value>,
    /// Keys of the scene and the values of each; every combination.
    #[serde(default)]
    #[schemars(extend("x-values" = "table of [values](#values)"))]
    vary: BTreeMap<String, AxisValues>,
    /// Keys that vary together: first values, second values, …
    #[serde(default)]
    #[schemars(extend("x-values" = "list of tables of [values](#values) of one length"))]
    together: Vec<BTreeMap<String, AxisValues>>,
    /// `initial.polarity.random.seed`: from 1 to a number, or these.
    #[schemars(extend("x-values" = "whole number or list"))]
    seeds: Option<Seeds>,
    /// More runs with values of their own, `[[case]]`.
    #[serde(default)]
    #[schemars(extend("x-values" = "tables with `name`, `set`"))]
    case: Vec<CaseTable>,
    /// Columns of measures in the table, named as in `summary.json`.
    #[schemars(extend("x-default" = "all"))]
    measures: Option<Vec<String>>,
    /// Along the first axis, or along this key, each run [starts from its neighbour](#warm-starts).
    #[serde(default)]
    #[schemars(extend("default" = false, "x-values" = "`true`, a key"))]
    warm_start: WarmStart,
    /// [Plots](#plots) of the table.
    #[schemars(extend("x-values" = "a table or a list of tables"))]
    plot: Option<Plots>,
    /// Cases on ever finer meshes, from which measures are extrapolated.
    richardson: Option<RichardsonTable>,
    /// What [Slurm](#slurm) is told.
    slurm: Option<SlurmTable>,
}

/// `[richardson]`: named cases that refine the mesh again and again by the same ratio.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
struct RichardsonTable {
    /// Names of three or more cases, coarse to fine.
    #[schemars(extend("minItems" = 3))]
    cases: Vec<String>,
    /// Size of the cells in a case over that in the next.
    #[schemars(transform = RichardsonTable::RATIO.said())]
    ratio: f64,
}

impl RichardsonTable {
    const RATIO: Range = Range::more_than(1.0);
}

/// `[[case]]`: a run of its own.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
struct CaseTable {
    /// Name of the run and of its folder.
    name: String,
    /// Values of the scene.
    #[serde(default)]
    #[schemars(schema_with = "schema::any_values")]
    set: BTreeMap<String, toml::Value>,
}

/// One run of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Folder of its results: its number, and its name if it has one.
    pub folder: String,
    /// As the study calls it.
    pub name: Option<String>,
    /// Keys of the scene and their values.
    pub set: Values,
    /// Number of the run from whose last state this one starts; where none is given, from the scene's own.
    pub after: Option<usize>,
}

/// A sweep, read and checked as far as possible without running.
#[derive(Debug, Clone)]
pub struct SweepStudy {
    /// One line for reports.
    pub title: Option<String>,
    /// The scene, with the overrides that hold for all runs.
    pub scene: SceneSource,
    /// At least one; the combinations of `vary` before the named ones.
    pub cases: Vec<Case>,
    /// Cases, coarse to fine, whose measures are extrapolated, and the ratio of their cell sizes.
    pub richardson: Option<(Vec<String>, f64)>,
    /// Columns of measures in the table, where they are not all of them.
    pub measures: Option<Vec<String>>,
    /// How long the study takes, in its author's words.
    pub duration: Option<String>,
    /// Keys along which runs start from their neighbours.
    pub warm: Vec<String>,
    /// Pictures of columns of the table.
    pub plots: Vec<PlotSpec>,
    /// What a cluster is told.
    pub slurm: SlurmTable,
    source: SceneSource,
    /// Overrides of the scene that came from outside of the file.
    scene_sets: Values,
}

impl SweepStudy {
    /// Reads a sweep and the scene it names; `sets` change keys of the study or else of the scene.
    ///
    /// # Errors
    /// Whatever is wrong with either, with file, key, value, rule and hint. A value that the scene refuses in some of
    /// the runs is found only by [`SweepStudy::scene_of`]; one that it refuses in all of them is an error.
    pub fn read(path: &Path, sets: &[(String, String)]) -> Result<Self, StudyError> {
        let sets = &source::sets_now(sets);
        let source = source::read::<SweepFile>(path, StudyFileKind::Sweep, sets)?;
        let file: SweepFile = source.tables().map_err(|found| found.1)?;
        let mut scene = source::read_scene(&source, &file.scene)?;
        let axes = axes::axes(&source, &file.vary, &file.together, file.seeds.as_ref())?;
        let varied = |key: &str| axes.iter().any(|axis| axis.keys.iter().any(|other| other == key));
        let everywhere = check_values(&source, "set", &file.set, &varied, "from run to run")?;
        for (key, value) in &everywhere {
            scene
                .set(key, value)
                .map_err(|error| within(&source, &source::below("set", key), "every run".to_owned(), error))?;
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
        source::apply(&mut scene, StudyFileKind::Sweep, sets, &fixed)?;
        let scene_sets = sets.iter().filter(|(key, _)| !StudyFileKind::Sweep.owns(key)).cloned().collect();
        let warm = check_warm(&source, &file.warm_start, &axes)?;
        let cases = check_cases(&source, &file, &axes, warm)?;
        let richardson = file.richardson.as_ref().map(|table| check_richardson(&source, table, &cases)).transpose()?;
        let study = Self {
            title: file.title,
            scene,
            cases,
            richardson,
            measures: file.measures,
            duration: file.duration,
            warm: warm.map(|at| axes[at].keys.clone()).unwrap_or_default(),
            plots: file.plot.map(|plots| plots.0).unwrap_or_default(),
            slurm: file.slurm.unwrap_or_default(),
            source,
            scene_sets,
        };
        study.slurm.check(&study.source)?;
        let scene = study.check_scenes()?;
        if scene.tissue().is_none() && !study.warm.is_empty() {
            let rule = format!(
                "only scenes of tissue start from the states of others, and this is {}",
                scene.source().kind().shown
            );
            return Err(refuse(&study.source, "warm_start", "(given)".to_owned(), &rule, "remove it"));
        }
        study.check_names(&scene)?;
        Ok(study)
    }

    /// Reads the study that a folder of results belongs to; where its scene is gone, a run's own stands for it.
    ///
    /// # Errors
    /// A folder without a study; whatever is wrong with the study or its scene, with file, key, value, rule and hint.
    pub fn read_left(folder: &Path) -> Result<Self, StudyError> {
        let file = folder.join("study.toml");
        if !file.exists() {
            return Err(StudyError::NothingToResume { folder: folder.display().to_string() });
        }
        Self::read(&file, &[]).or_else(|error| {
            let runs = std::fs::read_dir(folder).into_iter().flatten().flatten();
            let mut scenes: Vec<_> =
                runs.map(|run| run.path().join("scene.toml")).filter(|path| path.exists()).collect();
            scenes.sort();
            let Some(scene) = scenes.first().and_then(|path| std::path::absolute(path).ok()) else { return Err(error) };
            let value = toml::Value::from(scene.to_string_lossy().into_owned()).to_string();
            Self::read(&file, &[("scene".to_owned(), value)]).map_err(|_| error)
        })
    }

    /// Refuses keys that no scene has, and a sweep that has no good scene at all.
    fn check_scenes(&self) -> Result<AnyScene, StudyError> {
        let mut first = None;
        let mut good = None;
        for (at, case) in self.cases.iter().enumerate() {
            match self.try_scene(case, &[]) {
                Ok(scene) => good = good.or(Some(scene)),
                Err(error @ SceneError::UnknownKey { .. }) => return Err(self.blame(at, error)),
                Err(error) => first = first.or(Some((at, error))),
            }
        }
        match (good, first) {
            (Some(scene), _) => Ok(scene),
            (None, Some((at, error))) => Err(self.blame(at, error)),
            (None, None) => unreachable!("there is at least one case"),
        }
    }

    /// Refuses measures and plots of what no run can have.
    fn check_names(&self, scene: &AnyScene) -> Result<(), StudyError> {
        let known = results::measures_of(scene);
        let fits = |name: &String| known.iter().any(|k| name == k || name.starts_with(&format!("{k}_")));
        if let Some((at, name)) = self.measures.iter().flatten().enumerate().find(|(_, name)| !fits(name)) {
            let rule = format!("no run measures it{}", crate::names::did_you_mean(name, &known));
            let hint = format!("what the scene measures is {}; [[output]] `measures` adds more", known.join(", "));
            return Err(refuse(&self.source, &format!("measures.{at}"), format!("\"{name}\""), &rule, &hint));
        }
        for plot in &self.plots {
            plot.check(&self.source, &self.keys(), &known)?;
        }
        Ok(())
    }

    fn try_scene(&self, case: &Case, more: &[(String, String)]) -> Result<AnyScene, SceneError> {
        let mut source = self.scene.clone();
        for (key, value) in case.set.iter().chain(more) {
            source.set(key, value)?;
        }
        AnyScene::check(source)
    }

    /// The checked scene of run `at`.
    ///
    /// # Errors
    /// A value that the scene refuses.
    pub fn scene_of(&self, at: usize) -> Result<AnyScene, StudyError> {
        self.scene_with(at, &[])
    }

    /// As [`SweepStudy::scene_of`], with `more` values set last.
    ///
    /// # Errors
    /// A value that the scene refuses.
    pub fn scene_with(&self, at: usize, more: &[(String, String)]) -> Result<AnyScene, StudyError> {
        self.try_scene(&self.cases[at], more).map_err(|error| self.blame(at, error))
    }

    /// Names the place in the study that set what the scene refuses.
    fn blame(&self, at: usize, error: SceneError) -> StudyError {
        let case = &self.cases[at];
        let Some(path) = override_of(&error).filter(|path| case.set.iter().any(|(key, _)| key == path)) else {
            return error.into();
        };
        let key = match &case.name {
            None if path == SEED => "seeds".to_owned(),
            None => {
                let in_vary = self.source.value("vary").and_then(|vary| vary.as_table_like()?.get(path)).is_some();
                if in_vary { source::below("vary", path) } else { "together".to_owned() }
            }
            Some(_) => source::below(&format!("case.{}.set", at + self.named() - self.cases.len()), path),
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

    /// The study as it was read, with its overrides, those of the scene in `set`; the path of its scene is absolute.
    pub fn text(&self) -> String {
        let mut source = self.source.clone();
        for (key, value) in self.scene_sets.iter().filter(|set| can_be_set(set)) {
            source::put(&mut source, "set", key, value);
        }
        source::text::<SweepFile>(&source, &self.scene)
    }

    /// The first override that [`SweepStudy::text`] cannot hold.
    pub fn lost_override(&self) -> Option<&str> {
        self.scene_sets.iter().find(|set| !can_be_set(set)).map(|(key, _)| key.as_str())
    }
}

/// Whether `set` of a study can have it: not a whole table under a key without dots.
fn can_be_set((key, value): &(String, String)) -> bool {
    key.contains('.') || !value.trim_start().starts_with('{')
}

/// The axis along which runs start warm.
fn check_warm(source: &SceneSource, warm: &WarmStart, axes: &[Axis]) -> Result<Option<usize>, StudyError> {
    let (at, shown) = match warm {
        WarmStart::Off => return Ok(None),
        WarmStart::First => (Some(0).filter(|_| !axes.is_empty()), "true".to_owned()),
        WarmStart::Along(key) => (axes.iter().position(|axis| axis.keys.contains(key)), format!("\"{key}\"")),
    };
    let keys: Vec<&str> = axes.iter().flat_map(|axis| &axis.keys).map(String::as_str).collect();
    let Some(at) = at else {
        let hint = format!("what varies is {}", if keys.is_empty() { "nothing".to_owned() } else { keys.join(", ") });
        return Err(refuse(source, "warm_start", shown, "names no key that varies", &hint));
    };
    if !axes[at].numeric || axes[at].keys.iter().any(|key| key == SEED || key.starts_with("initial")) {
        let rule = format!("the values of {} are no numbers that a state could follow", axes[at].keys.join(", "));
        return Err(refuse(source, "warm_start", shown, &rule, "name a key with numbers, such as \"model.peclet\""));
    }
    Ok(Some(at))
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
        let rule = format!("there is no case `{name}`{}", crate::names::did_you_mean(name, &known));
        return Err(refuse(source, key, value, &rule, &format!("the named cases are {}", known.join(", "))));
    }
    if table.cases.len() < 3 {
        return Err(refuse(source, key, value, "must be at least three", "coarse to fine"));
    }
    if !RichardsonTable::RATIO.has(table.ratio) {
        let (value, rule) = (format!("{:?}", table.ratio), "must be above 1: sizes of a case over those of the next");
        return Err(refuse(source, "richardson.ratio", value, rule, "2.0 halves the cells"));
    }
    Ok((table.cases.clone(), table.ratio))
}

fn within(source: &SceneSource, key: &str, part: String, error: SceneError) -> StudyError {
    StudyError::Within { place: source.place(key), part, error: Box::new(error.into()) }
}

/// The combinations of `vary`, the last list fastest, then the named cases.
fn check_cases(
    source: &SceneSource,
    file: &SweepFile,
    axes: &[Axis],
    warm: Option<usize>,
) -> Result<Vec<Case>, StudyError> {
    if axes.is_empty() && file.case.is_empty() {
        let hint = "such as vary = { \"model.beta\" = [0.05, 0.5, 0.995] }, or [[case]] with `name` and `set`";
        return Err(refuse(source, "vary", "{}".to_owned(), "there is nothing to run", hint));
    }
    let mut sets: Vec<(Option<String>, Values, Option<usize>)> =
        axes::combinations(axes, warm).into_iter().map(|(set, after)| (None, set, after)).collect();
    for (at, table) in file.case.iter().enumerate() {
        let used = file.case[..at].iter().map(|other| other.name.as_str());
        check_name(source, &format!("case.{at}.name"), &table.name, used)?;
        let set = check_values(source, &format!("case.{at}.set"), &table.set, &|_| false, "")?;
        sets.push((Some(table.name.clone()), set, None));
    }
    let digits = sets.len().to_string().len().max(2);
    let numbered = sets.into_iter().enumerate().map(|(at, (name, set, after))| {
        let number = format!("{:0digits$}", at + 1);
        Case { folder: name.as_ref().map_or(number.clone(), |name| format!("{number}-{name}")), name, set, after }
    });
    Ok(numbered.collect())
}
