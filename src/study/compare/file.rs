//! The file of a comparison with measured velocities.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::format::{Direction, Format};
use super::reader::{self, Column, FrameFile, Separator};
use super::table_reading::TableReading;
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
pub(super) struct CompareFile {
    title: Option<String>,
    data: Option<String>,
    #[serde(default)]
    pub(super) format: Format,
    #[serde(default)]
    pub(super) columns: Columns,
    pub(super) separator: Option<Separator>,
    pub(super) header: Option<usize>,
    pub(super) keep: Option<BTreeMap<String, Vec<f64>>>,
    #[serde(default = "one")]
    pub(super) pixel: f64,
    #[serde(default = "one")]
    pub(super) frame: f64,
    pub(super) y: Option<Direction>,
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

/// Columns that the study names; others follow from the format.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Columns {
    pub x: Option<Column>,
    pub y: Option<Column>,
    pub t: Option<Column>,
    pub vx: Option<Column>,
    pub vy: Option<Column>,
    /// Of tracked cells; the velocity is found from it where no column has it.
    pub track: Option<Column>,
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
    /// One line for reports.
    pub title: Option<String>,
    /// Table of positions and velocities, or a pattern of the tables' names.
    pub data: PathBuf,
    /// The tables, in the order of their frames.
    pub(super) files: Vec<FrameFile>,
    pub(super) reading: TableReading,
    /// Units of length in one disc radius.
    pub length: f64,
    /// Units of velocity of the data in one of the run.
    pub speed: f64,
    /// Of the disc, in units of length, in the table's directions.
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
    let path = source.folder().join(data);
    let refuse_data = |rule: &str, hint: &str| refuse(&source, "data", format!("\"{data}\""), rule, hint);
    let is_pattern = reader::is_pattern(&path);
    let starts = format!("paths start in the folder of the file that names them; looked for {}", path.display());
    if path.is_dir() {
        let hint = format!("name its files by a pattern, such as data = \"{data}/*.txt\"");
        return Err(refuse_data("this is a folder", &hint));
    }
    if !is_pattern && !path.is_file() {
        return Err(refuse_data("there is no such file", &starts));
    }
    let reading = TableReading::new(&source, &file, is_pattern)?;
    let files = reader::list(&path)
        .map_err(|reason| refuse_data(&format!("is no pattern: {reason}"), "such as \"piv/*.txt\""))?;
    if files.is_empty() {
        return Err(refuse_data("no file has such a name", &starts));
    }
    let run = file.run.as_ref().map(|run| check_run(&source, run)).transpose()?;
    Ok(CompareStudy {
        title: file.title,
        data: path,
        files,
        reading,
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

/// Units and lengths beyond these are misprints: their products leave the range of numbers.
const SIZES: [f64; 2] = [1e-30, 1e30];

fn check_numbers(source: &SceneSource, file: &CompareFile) -> Result<(), StudyError> {
    let positive = [
        ("length", Some(file.length), "number of the data's units in one disc radius"),
        ("speed", Some(file.speed), "number of the data's units in one unit of velocity"),
        ("pixel", Some(file.pixel), "length of a pixel; leave it out if the table has lengths"),
        ("frame", Some(file.frame), "time between two frames; leave it out if the table has times"),
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
        if let Some(value) = value.filter(|value| !(SIZES[0]..=SIZES[1]).contains(value)) {
            return Err(refuse(source, key, format!("{value:?}"), "must lie between 1e-30 and 1e30", hint));
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
        if value > SIZES[1] || value > 0.0 && value < SIZES[0] {
            return Err(refuse(source, key, format!("{value:?}"), "must be 0, or lie between 1e-30 and 1e30", hint));
        }
    }
    if !file.centre.iter().all(|x| x.is_finite() && x.abs() <= SIZES[1]) {
        let hint = "place of the disc's centre in the table's units";
        let rule = "must be two finite numbers, of size 1e30 at most";
        return Err(refuse(source, "centre", format!("{:?}", file.centre), rule, hint));
    }
    Ok(())
}

fn check_box(source: &SceneSource, bins: &Bins) -> Result<(), StudyError> {
    let (low, high) = (bins.low, bins.high);
    let shown = format!("[[{:?}, {:?}], [{:?}, {:?}]]", low.x, low.y, high.x, high.y);
    for (c, side) in ["left of the right one", "below the upper one"].into_iter().enumerate() {
        let sound = |x: f64| x.is_finite() && x.abs() <= SIZES[1];
        if !(sound(low[c]) && sound(high[c]) && high[c] - low[c] >= SIZES[0]) {
            let rule = format!("the first corner must lie {side}, both finite and of size 1e30 at most");
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

fn check_run(source: &SceneSource, run: &str) -> Result<PathBuf, StudyError> {
    let folder = source.folder().join(run);
    if folder.join("checkpoint.bin").is_file() {
        return Ok(folder);
    }
    let rule = if folder.is_dir() { "holds no checkpoint.bin" } else { "there is no such folder" };
    let hint = format!("name the folder that `monolayer run --out` filled; looked for {}", folder.display());
    Err(refuse(source, "run", format!("\"{run}\""), rule, &hint))
}
