//! Reading a table of positions and velocities over time.

use std::path::Path;

use crate::measure::measured::Sample;
use crate::mesh::Point;
use crate::model::names;
use crate::study::StudyError;

use super::CompareStudy;

/// What was measured, in disc radii and units of velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracks {
    /// In the order of the table.
    pub samples: Vec<Sample>,
    /// Number of frames.
    pub frames: usize,
}

/// Shift of times in frames that rounding does not move to the frame before.
const SLACK: f64 = 1e-9;

impl Tracks {
    /// Reads the table of a study: `x = (x − centre)/length`, `v/speed`, times in frames.
    ///
    /// # Errors
    /// A file that is no table, columns that it has not, numbers that are none, with the line; fewer than two frames; no row in
    /// the box.
    pub fn read(study: &CompareStudy) -> Result<Self, StudyError> {
        let rows = read_rows(study)?;
        let samples = place(study, &rows)?;
        let frames = samples.iter().map(|sample| sample.frame + 1).max().unwrap_or(0);
        let tracks = Self { samples, frames };
        tracks.check_box(study)?;
        Ok(tracks)
    }

    fn check_box(&self, study: &CompareStudy) -> Result<(), StudyError> {
        if self.samples.iter().any(|sample| study.bins.find(sample.x).is_some()) {
            return Ok(());
        }
        let positions = || self.samples.iter().map(|sample| sample.x);
        let low = positions().fold(Point::repeat(f64::INFINITY), |m, x| m.inf(&x));
        let high = positions().fold(Point::repeat(f64::NEG_INFINITY), |m, x| m.sup(&x));
        let what = format!(
            "no row lies in `box`: with `length` = {} and `centre` = ({}, {}) the positions are between ({:.4}, {:.4}) and ({:.4}, \
             {:.4}) disc radii",
            study.length, study.centre.x, study.centre.y, low.x, low.y, high.x, high.y
        );
        Err(wrong(&study.data, None, what, "check `length`, `centre` and `box`".to_owned()))
    }
}

fn wrong(file: &Path, line: Option<u64>, what: String, hint: String) -> StudyError {
    let line = line.map_or_else(String::new, |line| format!(", line {line}"));
    StudyError::Data { place: format!("{}{line}", file.display()), what, hint }
}

/// `x, y, t, vx, vy` of every row.
fn read_rows(study: &CompareStudy) -> Result<Vec<[f64; 5]>, StudyError> {
    let file = study.data.as_path();
    let broken = |error: &csv::Error| {
        let (line, what) = match error.kind() {
            csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
                let what = format!("has {len} values, and the first line names {expected_len} columns");
                (pos.as_ref().map(csv::Position::line), what)
            }
            _ => (error.position().map(csv::Position::line), format!("cannot be read ({error})")),
        };
        wrong(
            file,
            line,
            what,
            "a table in UTF-8: names of columns in the first line, commas between values".to_owned(),
        )
    };
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(file).map_err(|error| broken(&error))?;
    let header = table.headers().map_err(|error| broken(&error))?.clone();
    let places = find_columns(study, &header)?;
    let mut rows = Vec::new();
    let mut record = csv::StringRecord::new();
    while table.read_record(&mut record).map_err(|error| broken(&error))? {
        let line = record.position().map(csv::Position::line);
        let mut row = [0.0; 5];
        for (value, (at, name)) in row.iter_mut().zip(&places) {
            let text = record.get(*at).unwrap_or("");
            *value = text.parse::<f64>().ok().filter(|number| number.is_finite()).ok_or_else(|| {
                let what =
                    format!("`{name}` = {}: must be a finite number", if text.is_empty() { "(empty)" } else { text });
                wrong(file, line, what, "leave out rows without position, time or velocity".to_owned())
            })?;
        }
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(wrong(file, None, "has no rows".to_owned(), "one row for each cell and time".to_owned()));
    }
    Ok(rows)
}

/// Place and name of each column.
fn find_columns(study: &CompareStudy, header: &csv::StringRecord) -> Result<Vec<(usize, String)>, StudyError> {
    let known: Vec<&str> = header.iter().collect();
    let find = |(key, name): (&str, &str)| {
        let places: Vec<usize> = (0..known.len()).filter(|k| known[*k] == name).collect();
        match places[..] {
            [at] => Ok((at, name.to_owned())),
            [] => {
                let taken = |other: &&str| study.columns.named().iter().any(|(_, name)| name == other);
                let free: Vec<&str> = known.iter().copied().filter(|other| !taken(other)).collect();
                let what = format!("there is no column `{name}`{}", names::did_you_mean(name, &free));
                let hint = format!("the columns are {}; `columns.{key}` names the one to take", known.join(", "));
                Err(wrong(&study.data, Some(1), what, hint))
            }
            [..] => {
                let what = format!("{} columns have the name `{name}`", places.len());
                Err(wrong(&study.data, Some(1), what, "give each column a name of its own".to_owned()))
            }
        }
    };
    study.columns.named().into_iter().map(find).collect()
}

/// Samples in disc radii; frames without rows are not counted.
fn place(study: &CompareStudy, rows: &[[f64; 5]]) -> Result<Vec<Sample>, StudyError> {
    let first = rows.iter().map(|row| row[2]).fold(f64::INFINITY, f64::min);
    let frame = |t: f64| study.frames.map_or(t, |length| ((t - first) / length + SLACK).floor());
    let mut times: Vec<f64> = rows.iter().map(|row| frame(row[2])).collect();
    times.sort_by(f64::total_cmp);
    // 0 and −0 are one time
    times.dedup_by(|a, b| a == b);
    if times.len() < 2 {
        let what = format!("has {} frame, and the scatter of the means needs at least 2", times.len());
        let hint = match study.frames {
            Some(length) => format!("`frames` = {length} is longer than the record"),
            None => "every row has the same time".to_owned(),
        };
        return Err(wrong(&study.data, None, what, hint));
    }
    let sample = |row: &[f64; 5]| {
        let [x, y, t, vx, vy] = *row;
        let t = frame(t);
        let frame = times.partition_point(|other| *other < t);
        let x = (Point::new(x, y) - study.centre) / study.length;
        Sample { frame, x, v: Point::new(vx, vy) / study.speed }
    };
    Ok(rows.iter().map(sample).collect())
}
