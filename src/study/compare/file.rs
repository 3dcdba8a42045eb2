//! The file of a comparison with measured velocities.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;

use super::format::{Direction, Format};
use super::reader::{self, Column, FrameFile, Separator};
use super::table_reading::TableReading;
use crate::measure::measured::Bins;
use crate::mesh::Point;
use crate::scene::{SceneError, SceneSource};
use crate::schema::{self, Range};
use crate::study::StudyError;
use crate::study::source::refuse;

/// Measured velocities, how they are averaged, and the run that they are compared with.
///
/// ```toml
/// data = "tracks.csv"
/// box = [[-10, -5], [10, 5]]
/// run = "../out/strip"
/// ```
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub(in crate::study) struct CompareFile {
    /// Table with one row for each cell and time, in any order; or a pattern of the names of several, see below.
    #[schemars(extend("x-values" = "path", "x-default" = "–"))]
    data: Option<String>,
    /// Form of the table.
    #[serde(default)]
    #[schemars(extend("default" = "table"))]
    pub(super) format: Format,
    /// Columns to take, by name or number (from 1): `x`, `y`, `t`, `vx`, `vy`, `track`; others are not read.
    #[serde(default)]
    #[schemars(extend("x-values" = "table of names or numbers", "x-default" = "those of the format"))]
    pub(super) columns: Columns,
    /// Rows that count, by the values of a column, such as `keep = { flags = [0] }`; `{}` for all.
    #[schemars(extend("x-values" = "table of lists", "x-default" = "that of the format"))]
    pub(super) keep: Option<BTreeMap<String, Vec<f64>>>,
    /// What stands between two columns; `"space"` is one or more spaces or tabs.
    #[serde(default)]
    #[schemars(schema_with = "separators", extend("x-default" = "found out"))]
    pub(super) separator: Option<Separator>,
    /// Lines above the numbers.
    #[schemars(extend("x-default" = "found out"))]
    pub(super) header: Option<usize>,
    /// Length of a pixel: positions and velocities are multiplied by it.
    #[serde(default = "one")]
    #[schemars(transform = CompareFile::SIZES.said())]
    pub(super) pixel: f64,
    /// Time between two frames: times are multiplied, velocities divided by it.
    #[serde(default = "one")]
    #[schemars(transform = CompareFile::SIZES.said())]
    pub(super) frame: f64,
    /// Which way the second coordinate grows, down as in images.
    #[schemars(extend("x-default" = "that of the format"))]
    pub(super) y: Option<Direction>,
    /// Units of length (of the table, or of `pixel`) in one disc radius.
    #[serde(default = "one")]
    #[schemars(transform = CompareFile::SIZES.said())]
    length: f64,
    /// Units of velocity (of the table, or of `pixel` per `frame`) in one of the run.
    #[serde(default = "one")]
    #[schemars(transform = CompareFile::SIZES.said())]
    speed: f64,
    /// Of the disc, in units of length, in the directions of the table; `center` is understood as well.
    #[serde(default, alias = "center")]
    #[schemars(transform = CompareFile::PLACES.said())]
    centre: [f64; 2],
    /// What is binned, the second axis upwards: lower left and upper right corner, in disc radii.
    #[schemars(transform = CompareFile::PLACES.said())]
    #[schemars(extend("x-values" = "`[[left, lower], [right, upper]]`", "x-default" = "–"))]
    r#box: Option<[[f64; 2]; 2]>,
    /// Number of bins along and across.
    #[serde(default = "default_bins")]
    #[schemars(transform = CompareFile::BINS.said())]
    bins: [usize; 2],
    /// Deviation of the Gaussian, in bins and in frames; 0 for none.
    #[serde(default = "one")]
    #[schemars(transform = CompareFile::SIZES_OR_NONE.said())]
    filter: f64,
    /// `l` of the flux-keeping correction; without it there is none.
    #[schemars(transform = CompareFile::SIZES.said())]
    window: Option<f64>,
    /// Times are grouped into frames of this length, from the first time on; without it each distinct time is a frame.
    #[schemars(transform = CompareFile::SIZES.said())]
    frames: Option<f64>,
    /// Radius of the obstacle in disc radii; 0 for none.
    #[serde(default = "one")]
    #[schemars(transform = CompareFile::SIZES_OR_NONE.said())]
    obstacle: f64,
    /// Folder of the run to compare with.
    #[schemars(extend("x-values" = "path"))]
    run: Option<String>,
    /// Stands above the pictures.
    title: Option<String>,
}

impl CompareFile {
    /// Units and lengths beyond these are misprints: their products leave the range of numbers.
    const SIZES: Range = Range::within(SIZES[0], SIZES[1]);
    const SIZES_OR_NONE: Range = Range::within(0.0, SIZES[1]);
    const PLACES: Range = Range::within(-SIZES[1], SIZES[1]);
    const BINS: Range = Range::at_least(2.0);
}

/// Columns that the study names; others follow from the format.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>)]
pub(super) struct Columns {
    /// First coordinate.
    pub x: Option<Column>,
    /// Second coordinate.
    pub y: Option<Column>,
    /// Time.
    pub t: Option<Column>,
    /// First component of the velocity.
    pub vx: Option<Column>,
    /// Second component.
    pub vy: Option<Column>,
    /// Of tracked cells; the velocity is found from it where no column has it.
    pub track: Option<Column>,
}

/// Each mark has a name, too.
fn separators(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
    let names = ["tab", "\t", ";", "semicolon", ",", "comma", "space", " "];
    schemars::json_schema!({ "enum": names, "x-values": "`\",\"`, `\";\"`, `\"tab\"`, `\"space\"`" })
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
        if let Some(value) = value.filter(|value| !Range::POSITIVE.has(*value)) {
            return Err(refuse(source, key, format!("{value:?}"), "must be greater than 0 and finite", hint));
        }
        if let Some(value) = value.filter(|value| !CompareFile::SIZES.has(*value)) {
            return Err(refuse(source, key, format!("{value:?}"), "must lie between 1e-30 and 1e30", hint));
        }
    }
    let not_negative = [
        ("filter", file.filter, "deviation of the Gaussian in bins and frames; 0 for no filter"),
        ("obstacle", file.obstacle, "radius of the obstacle in disc radii; 0 for none"),
    ];
    for (key, value, hint) in not_negative {
        if !Range::NOT_NEGATIVE.has(value) {
            return Err(refuse(source, key, format!("{value:?}"), "must be 0 or greater, and finite", hint));
        }
        if value > SIZES[1] || value > 0.0 && value < SIZES[0] {
            return Err(refuse(source, key, format!("{value:?}"), "must be 0, or lie between 1e-30 and 1e30", hint));
        }
    }
    if !file.centre.iter().all(|x| CompareFile::PLACES.has(*x)) {
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
        let sound = |x: f64| CompareFile::PLACES.has(x);
        if !(sound(low[c]) && sound(high[c]) && high[c] - low[c] >= SIZES[0]) {
            let rule = format!("the first corner must lie {side}, both finite and of size 1e30 at most");
            return Err(refuse(source, "box", shown, &rule, "such as box = [[-10, -5], [10, 5]], in disc radii"));
        }
    }
    let [nx, ny] = bins.count;
    let many = nx.checked_mul(ny).is_none_or(|n| n > MOST_BINS);
    if !bins.count.into_iter().all(|n| CompareFile::BINS.has_count(n)) || many {
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
