//! Positions and velocities over time, from the tables of a comparison.

use std::collections::HashMap;

use super::CompareStudy;
use super::derive::{Spot, velocities};
use super::reader::{self, NameNumbers, Rows};
use super::table_reading::{TableReading, VelocitySource, X, Y};
use crate::measure::measured::Sample;
use crate::mesh::Point;
use crate::study::StudyError;

/// What was measured, in disc radii and units of velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracks {
    /// In the order of the table.
    pub samples: Vec<Sample>,
    /// Number of frames.
    pub frames: usize,
    /// What was left out of the tables, and why.
    pub notes: Vec<String>,
}

/// Shift of times in frames that rounding does not move to the frame before.
const SLACK: f64 = 1e-9;

/// A velocity at a place and time in units of length and time, in the directions of the table.
#[derive(Debug, Clone, Copy)]
struct Row {
    x: Point,
    t: f64,
    v: Point,
}

impl Tracks {
    /// Reads the tables of a study: `x = (x − centre)/length`, `v/speed`, times in frames, the second axis upwards.
    ///
    /// # Errors
    /// A file that is no table, columns that it has not, entries that are no numbers, with the line; no row with all
    /// that is needed; fewer than two frames; no row in the box.
    pub fn read(study: &CompareStudy) -> Result<Self, StudyError> {
        let mut found = Found::default();
        let mut names = NameNumbers::default();
        for (file, number) in study.files.iter().zip(0..) {
            let rows = reader::read(&file.path, study.reading.cut, &study.reading.wanted, &mut names)?;
            found.take(&study.reading, &rows, file.frame, number);
        }
        let (rows, notes) = found.rows(study)?;
        let samples = place(study, &rows)?;
        let frames = samples.iter().map(|sample| sample.frame + 1).max().unwrap_or(0);
        let mut tracks = Self { samples, frames, notes };
        tracks.check_box(study)?;
        Ok(tracks)
    }

    /// Says so where most rows lie outside of `domain`, which has these corners in disc radii.
    ///
    /// # Errors
    /// All of them do.
    pub(super) fn misplaced(
        &self,
        study: &CompareStudy,
        (domain, place): (&str, String),
        outside: usize,
        [from, to]: [Point; 2],
    ) -> Result<Option<String>, StudyError> {
        let all = self.samples.len();
        if 2 * outside <= all {
            return Ok(None);
        }
        let positions = || self.samples.iter().map(|sample| sample.x);
        let low = positions().fold(Point::repeat(f64::INFINITY), |m, x| m.inf(&x));
        let high = positions().fold(Point::repeat(f64::NEG_INFINITY), |m, x| m.sup(&x));
        let share = if outside == all { "no row lies in" } else { "most rows lie outside of" };
        let between = |low: Point, high: Point| {
            let [a, b, c, d] = [low.x, low.y, high.x, high.y].map(shown);
            format!("between ({a}, {b}) and ({c}, {d})")
        };
        let what = format!(
            "{share} {domain} ({outside} of {all} are outside): with `length` = {} and `centre` = ({}, {}) the \
             positions are {} disc radii, and {domain} is {}",
            study.length,
            study.centre.x,
            study.centre.y,
            between(low, high),
            between(from, to)
        );
        let hint = "check the units and directions: `pixel`, `length`, `centre`, `y` and `box`";
        if outside == all {
            return Err(StudyError::Data { place, what, hint: hint.to_owned() });
        }
        Ok(Some(format!("{what}; hint: {hint}")))
    }

    /// As [`misplaced`](Self::misplaced) for the box of the bins.
    fn check_box(&mut self, study: &CompareStudy) -> Result<(), StudyError> {
        let outside = self.samples.iter().filter(|sample| study.bins.find(sample.x).is_none()).count();
        let note = self.misplaced(
            study,
            ("`box`", study.data.display().to_string()),
            outside,
            [study.bins.low, study.bins.high],
        )?;
        self.notes.extend(note);
        Ok(())
    }
}

/// A coordinate with four decimals, or with an exponent where those say nothing.
fn shown(value: f64) -> String {
    if value == 0.0 || (1e-3..1e6).contains(&value.abs()) { format!("{value:.4}") } else { format!("{value:.3e}") }
}

fn wrong(study: &CompareStudy, what: String, hint: String) -> StudyError {
    StudyError::Data { place: study.data.display().to_string(), what, hint }
}

/// Rows of all files, and counts of those that say nothing.
#[derive(Debug, Default)]
struct Found {
    rows: Vec<Row>,
    /// Track of each row, where velocities follow from tracks: its record and its number there.
    tracks: Vec<(usize, u64)>,
    all: usize,
    missing: usize,
    trackless: usize,
    /// By the name of the column.
    rejected: Vec<(String, usize)>,
}

impl Found {
    /// Takes the rows of the file of this number.
    fn take(&mut self, reading: &TableReading, rows: &Rows, frame: f64, file: usize) {
        for row in &rows.values {
            self.all += 1;
            let t = reading.t.map_or(frame, |at| row[at]);
            let v = match reading.told {
                VelocitySource::Velocity { vx, vy } => reading.velocity(row[vx], row[vy]),
                VelocitySource::Track(_) => Point::zeros(),
            };
            let x = reading.length(row[X], row[Y]);
            let refused =
                reading.keep.iter().find(|keep| !row[keep.at].is_nan() && !keep.accepted.contains(&row[keep.at]));
            if let Some(keep) = refused {
                self.reject(&keep.name);
                continue;
            }
            if ![x.x, x.y, t, v.x, v.y].iter().all(|value| value.is_finite()) {
                self.missing += 1;
                continue;
            }
            if let VelocitySource::Track(at) = reading.told {
                if row[at].is_nan() {
                    self.trackless += 1;
                    continue;
                }
                // a track runs through files that are frames, and ends with one that has frames of its own
                let record = if reading.t.is_some() { file } else { 0 };
                self.tracks.push((record, row[at].to_bits()));
            }
            self.rows.push(Row { x, t: reading.time(t), v });
        }
    }

    fn reject(&mut self, name: &str) {
        match self.rejected.iter_mut().find(|(other, _)| other == name) {
            Some((_, count)) => *count += 1,
            None => self.rejected.push((name.to_owned(), 1)),
        }
    }

    /// The rows with their velocities, and what is to be said of the others.
    fn rows(mut self, study: &CompareStudy) -> Result<(Vec<Row>, Vec<String>), StudyError> {
        let all = self.all;
        let mut notes = Vec::new();
        if self.missing > 0 {
            notes.push(format!("{} of {all} rows lack a position, time or velocity, and are left out", self.missing));
        }
        for (name, count) in &self.rejected {
            notes.push(format!(
                "{count} of {all} rows are left out for the value of their column `{name}` (key `keep`)"
            ));
        }
        if self.trackless > 0 {
            notes.push(format!("{} of {all} rows belong to no track, and are left out", self.trackless));
        }
        if all == 0 {
            return Err(wrong(study, "has no rows".to_owned(), "one row for each cell and time".to_owned()));
        }
        if matches!(study.reading.told, VelocitySource::Track(_)) {
            self.follow(&mut notes);
        }
        if self.rows.is_empty() {
            let what = format!("none of its {all} rows can be used: {}", notes.join("; "));
            return Err(wrong(study, what, "check `columns`, `keep` and the table".to_owned()));
        }
        Ok((self.rows, notes))
    }

    /// Velocities from tracks; rows without one are left out.
    fn follow(&mut self, notes: &mut Vec<String>) {
        let mut numbers: HashMap<(usize, u64), usize> = HashMap::new();
        let track = |key: &(usize, u64)| {
            let next = numbers.len();
            *numbers.entry(*key).or_insert(next)
        };
        let tracks: Vec<usize> = self.tracks.iter().map(track).collect();
        let spots: Vec<Spot> =
            self.rows.iter().zip(tracks).map(|(row, track)| Spot { track, t: row.t, x: row.x }).collect();
        let (found, without) = velocities(&spots);
        let all = spots.len();
        if without.at_ends > 0 {
            notes.push(format!(
                "{} of {all} spots have no velocity: their track has no spot in the frame before or after",
                without.at_ends
            ));
        }
        if without.at_forks > 0 {
            let forks = without.at_forks;
            notes.push(format!(
                "{forks} of {all} spots have no velocity: their track has several spots in one frame there"
            ));
        }
        let rows = self.rows.iter().zip(found).map(|(row, v)| Row { v, ..*row });
        self.rows = rows.filter(|row| row.v.x.is_finite() && row.v.y.is_finite()).collect();
    }
}

/// Samples in disc radii; frames without rows are not counted.
fn place(study: &CompareStudy, rows: &[Row]) -> Result<Vec<Sample>, StudyError> {
    let first = rows.iter().map(|row| row.t).fold(f64::INFINITY, f64::min);
    let frame = |t: f64| study.frames.map_or(t, |length| ((t - first) / length + SLACK).floor());
    let mut times: Vec<f64> = rows.iter().map(|row| frame(row.t)).collect();
    times.sort_by(f64::total_cmp);
    // 0 and −0 are one time
    times.dedup_by(|a, b| a == b);
    if times.len() < 2 {
        let what = format!("has {} frame, and the scatter of the means needs at least 2", times.len());
        let hint = match study.frames {
            Some(length) => format!("`frames` = {length} is longer than the record"),
            None => "every row has the same time; the files of several frames are named by a pattern".to_owned(),
        };
        return Err(wrong(study, what, hint));
    }
    let sample = |row: &Row| {
        let t = frame(row.t);
        let frame = times.partition_point(|other| *other < t);
        let x = study.reading.upright(row.x - study.centre) / study.length;
        Sample { frame, x, v: study.reading.upright(row.v) / study.speed }
    };
    Ok(rows.iter().map(sample).collect())
}
