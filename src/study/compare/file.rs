//! The file of a comparison with measured velocities.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::measure::measured::Bins;
use crate::mesh::Point;
use crate::scene::{SceneError, SceneSource};
use crate::study::StudyError;
use crate::study::source::refuse;

/// Measured velocities, how they are averaged, and the run that they are compared with.
///
/// ```toml
/// data = "tracks.csv"
/// box = [[-10, -5], [10, 5]]
/// run = "../out/strip"
/// ```
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct CompareFile {
    title: Option<String>,
    data: Option<String>,
    #[serde(default)]
    columns: Columns,
    #[serde(default = "one")]
    length: f64,
    #[serde(default = "one")]
    speed: f64,
    #[serde(default, alias = "center")]
    centre: [f64; 2],
    r#box: Option<[[f64; 2]; 2]>,
    #[serde(default = "default_bins")]
    bins: [usize; 2],
    #[serde(default = "one")]
    filter: f64,
    window: Option<f64>,
    frames: Option<f64>,
    #[serde(default = "one")]
    obstacle: f64,
    run: Option<String>,
}

/// Names of the columns.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Columns {
    pub x: String,
    pub y: String,
    pub t: String,
    pub vx: String,
    pub vy: String,
}

impl Default for Columns {
    fn default() -> Self {
        let [x, y, t, vx, vy] = ["x", "y", "t", "vx", "vy"].map(String::from);
        Self { x, y, t, vx, vy }
    }
}

impl Columns {
    /// Key and name of each.
    pub fn named(&self) -> [(&'static str, &str); 5] {
        [("x", &self.x), ("y", &self.y), ("t", &self.t), ("vx", &self.vx), ("vy", &self.vy)]
    }
}

fn one() -> f64 {
    1.0
}

fn default_bins() -> [usize; 2] {
    [80, 32]
}

/// A comparison, checked as far as possible without its data.
#[derive(Debug, Clone)]
pub struct CompareStudy {
    pub title: Option<String>,
    /// Table of positions and velocities.
    pub data: PathBuf,
    pub columns: Columns,
    /// Units of the table in one disc radius.
    pub length: f64,
    /// Units of the table in one unit of velocity.
    pub speed: f64,
    /// Of the disc, in units of the table.
    pub centre: Point,
    /// In disc radii about the disc's centre.
    pub bins: Bins,
    /// Deviation of the Gaussian in bins and in frames; 0 for none.
    pub filter: f64,
    /// `l` of the flux-keeping correction.
    pub window: Option<f64>,
    /// Length of a frame; without it every time is a frame of its own.
    pub frames: Option<f64>,
    /// Radius of the obstacle in disc radii; 0 for none.
    pub obstacle: f64,
    /// Folder of the run to compare with.
    pub run: Option<PathBuf>,
    pub(super) source: SceneSource,
}

/// More bins than anybody draws.
const MOST_BINS: usize = 4_000_000;

impl CompareStudy {
    /// Reads a comparison; `sets` change its keys.
    ///
    /// # Errors
    /// Whatever is wrong with it, with file, key, value, rule and hint.
    pub fn read(path: &Path, sets: &[(String, String)]) -> Result<Self, StudyError> {
        let mut source = SceneSource::read(path).map_err(|error| match error {
            SceneError::Unreadable { file, reason, .. } => {
                let hint = "give the path of a comparison, a TOML text such as studies/measured/strip.toml";
                SceneError::Unreadable { file, reason, hint }
            }
            other => other,
        })?;
        refuse_other_kinds(&source)?;
        for (key, value) in sets {
            source.set_in::<CompareFile>(key, value)?;
        }
        let file: CompareFile = source.tables().map_err(|found| found.1)?;
        check(source, file)
    }

    /// The study as it was read, with its overrides; paths are absolute.
    pub fn text(&self) -> String {
        let mut source = self.source.clone();
        for (key, path) in [("data", Some(&self.data)), ("run", self.run.as_ref())] {
            if let Some(path) = path.and_then(|path| std::path::absolute(path).ok()) {
                let value = toml::Value::from(path.to_string_lossy().into_owned()).to_string();
                source.set_in::<CompareFile>(key, &value).expect("the study was checked with these keys");
            }
        }
        source.text()
    }
}

fn refuse_other_kinds(source: &SceneSource) -> Result<(), StudyError> {
    let file = source.origin().to_owned();
    let found = match () {
        () if source.has("data") => return Ok(()),
        () if source.has("levels") => ("a study of orders", "order"),
        () if source.has("parameter") => ("a study of branches", "branch"),
        () if source.has("scene") => ("a sweep", "study"),
        () if source.has("model") => ("a scene", "run"),
        () => return Ok(()),
    };
    Err(StudyError::OtherKind { file, is: found.0, command: found.1 })
}

fn check(source: SceneSource, file: CompareFile) -> Result<CompareStudy, StudyError> {
    let missing = |key: &str, hint: &str| -> StudyError {
        SceneError::Missing { place: source.place(key), key: key.to_owned(), hint: hint.to_owned() }.into()
    };
    let data = file.data.as_ref().ok_or_else(|| {
        missing("data", "name a table of positions and velocities over time, as in data = \"tracks.csv\"")
    })?;
    let [low, high] = file.r#box.ok_or_else(|| {
        missing("box", "give lower left and upper right corner in disc radii, as in box = [[-10, -5], [10, 5]]")
    })?;
    check_numbers(&source, &file)?;
    let bins = Bins { low: low.into(), high: high.into(), count: file.bins };
    check_box(&source, &bins)?;
    check_window(&source, file.window, &bins)?;
    check_columns(&source, &file.columns)?;
    let path = source.folder().join(data);
    if !path.is_file() {
        let hint = format!("paths start in the folder of the file that names them; looked for {}", path.display());
        return Err(refuse(&source, "data", format!("\"{data}\""), "there is no such file", &hint));
    }
    let run = file.run.as_ref().map(|run| check_run(&source, run)).transpose()?;
    Ok(CompareStudy {
        title: file.title,
        data: path,
        columns: file.columns,
        length: file.length,
        speed: file.speed,
        centre: file.centre.into(),
        bins,
        filter: file.filter,
        window: file.window,
        frames: file.frames,
        obstacle: file.obstacle,
        run,
        source,
    })
}

fn check_numbers(source: &SceneSource, file: &CompareFile) -> Result<(), StudyError> {
    let positive = [
        ("length", Some(file.length), "number of the table's units in one disc radius"),
        ("speed", Some(file.speed), "number of the table's units in one unit of velocity"),
        ("window", file.window, "half the length of the window in disc radii; leave it out for no correction"),
        (
            "frames",
            file.frames,
            "length of a frame in the table's units of time; leave it out for a frame for each time",
        ),
    ];
    for (key, value, hint) in positive {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(refuse(source, key, format!("{value:?}"), "must be greater than 0 and finite", hint));
        }
    }
    let not_negative = [
        ("filter", file.filter, "deviation of the Gaussian in bins and frames; 0 for no filter"),
        ("obstacle", file.obstacle, "radius of the obstacle in disc radii; 0 for none"),
    ];
    for (key, value, hint) in not_negative {
        if !(value.is_finite() && value >= 0.0) {
            return Err(refuse(source, key, format!("{value:?}"), "must be 0 or greater, and finite", hint));
        }
    }
    if !file.centre.iter().all(|x| x.is_finite()) {
        let hint = "place of the disc's centre in the table's units";
        return Err(refuse(source, "centre", format!("{:?}", file.centre), "must be two finite numbers", hint));
    }
    Ok(())
}

fn check_box(source: &SceneSource, bins: &Bins) -> Result<(), StudyError> {
    let (low, high) = (bins.low, bins.high);
    let shown = format!("[[{:?}, {:?}], [{:?}, {:?}]]", low.x, low.y, high.x, high.y);
    for (c, side) in ["left of the right one", "below the upper one"].into_iter().enumerate() {
        if !(low[c].is_finite() && high[c].is_finite() && low[c] < high[c]) {
            let rule = format!("the first corner must lie {side}, both finite");
            return Err(refuse(source, "box", shown, &rule, "such as box = [[-10, -5], [10, 5]], in disc radii"));
        }
    }
    let [nx, ny] = bins.count;
    let many = nx.checked_mul(ny).is_none_or(|n| n > MOST_BINS);
    if nx < 2 || ny < 2 || many {
        let rule = format!("must be two numbers, at least 2 each, for at most {MOST_BINS} bins in all");
        return Err(refuse(source, "bins", format!("[{nx}, {ny}]"), &rule, "such as [80, 32]"));
    }
    Ok(())
}

fn check_window(source: &SceneSource, window: Option<f64>, bins: &Bins) -> Result<(), StudyError> {
    let widest = (-bins.low.x).min(bins.high.x);
    match window {
        Some(window) if window > widest => {
            let rule = "the window [−l, l] must lie in the box".to_owned();
            let hint = match widest > 0.0 {
                true => format!("at most {widest:?}, or make `box` longer"),
                false => "the box does not contain x₁ = 0: leave `window` out".to_owned(),
            };
            Err(refuse(source, "window", format!("{window:?}"), &rule, &hint))
        }
        Some(_) | None => Ok(()),
    }
}

fn check_columns(source: &SceneSource, columns: &Columns) -> Result<(), StudyError> {
    let named = columns.named();
    for (k, (key, name)) in named.iter().enumerate() {
        let twice = named[..k].iter().find(|(_, other)| other == name);
        let rule = match (name.trim().is_empty(), twice) {
            (true, _) => "must be the name of a column".to_owned(),
            (false, Some((other, _))) => format!("`columns.{other}` is the same column"),
            (false, None) => continue,
        };
        let hint = "such as columns = { x = \"x\", y = \"y\", t = \"t\", vx = \"vx\", vy = \"vy\" }";
        return Err(refuse(source, &format!("columns.{key}"), format!("\"{name}\""), &rule, hint));
    }
    Ok(())
}

fn check_run(source: &SceneSource, run: &str) -> Result<PathBuf, StudyError> {
    let folder = source.folder().join(run);
    if folder.join("checkpoint.bin").is_file() {
        return Ok(folder);
    }
    let rule = if folder.is_dir() { "holds no checkpoint.bin" } else { "there is no such folder" };
    let hint = format!("name the folder that `monolayer run --out` filled; looked for {}", folder.display());
    Err(refuse(source, "run", format!("\"{run}\""), rule, &hint))
}
