//! Rigid bodies from the files of a run: `bodies.json`, `bodies.csv`, and `contacts.csv` where there is one.

use std::path::Path;

use super::ResultsError;
use crate::contact::{Contact, Partner};
use crate::measure::bodies::Load;
use crate::mesh::Point;
use crate::output::bodies::{Moment, SOLIDS_FILE, Solids};
use crate::shape::{Pose, Twist};

/// The bodies at a time that the table has.
#[derive(Debug, Clone, PartialEq)]
pub struct BodiesAtTime {
    /// What never changes, of the bodies that are there then.
    pub solids: Solids,
    /// Time of what was read.
    pub time: f64,
    /// Where the bodies are.
    pub poses: Vec<Pose>,
    /// How they move.
    pub twists: Vec<Twist>,
    /// What contact does to them.
    pub loads: Vec<Load>,
    /// Without their normals, which the table does not have.
    pub contacts: Vec<Contact>,
}

/// A body on its way.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Of the body.
    pub name: String,
    /// Time, position, angle, velocity, spin.
    pub rows: Vec<(f64, Pose, Twist)>,
}

/// Row of a table: its time, its texts and its numbers.
type Row = (f64, Vec<String>, Vec<f64>);

impl BodiesAtTime {
    /// The bodies at the last time of the table, or at a given one, without those that had left by then; `None` where a
    /// run has left none. A time whose rows were cut off does not count.
    ///
    /// # Errors
    /// [`ResultsError::Broken`]: files that do not fit each other, or are no such tables.
    pub fn read(folder: &Path, at: Option<f64>) -> Result<Option<Self>, ResultsError> {
        let Some(solids) = solids(folder)? else { return Ok(None) };
        let (mut rows, mut before): (Vec<Row>, Vec<Row>) = (Vec::new(), Vec::new());
        each_row(&folder.join("bodies.csv"), 1, &[9, 12], |row| {
            if rows.first().is_some_and(|first| first.0 != row.0) {
                let whole = std::mem::take(&mut rows);
                // a time that another one follows is whole
                if at.is_none_or(|t| whole[0].0 == t) {
                    before = whole;
                }
            }
            rows.push(row);
        })?;
        let is_last = |rows: &[Row]| rows.first().is_some_and(|(time, ..)| at.is_none_or(|t| *time == t));
        let left = rows.first().and_then(|(time, ..)| left_by(folder, *time));
        let complete = match left {
            Some(left) => rows.len() + left == solids.bodies.len(),
            None => rows.len() == solids.bodies.len() || rows.len() == before.len(),
        };
        let whole = if is_last(&rows) && complete { rows } else { before };
        let Some(&(time, ..)) = whole.first() else { return Ok(None) };
        let present = solids.named(whole.iter().map(|(_, names, _)| &*names[0]));
        if present.bodies.len() != whole.len() {
            return Err(broken(&folder.join("bodies.csv"), "its bodies are not those of bodies.json".to_owned()));
        }
        let of = |k: usize| whole.iter().map(move |(_, _, n)| (Point::new(n[3 * k], n[3 * k + 1]), n[3 * k + 2]));
        let contacts = contacts(folder, &present, time)?;
        Ok(Some(Self {
            time,
            poses: of(0).map(|(position, angle)| Pose { position, angle }).collect(),
            twists: of(1).map(|(velocity, spin)| Twist { velocity, spin }).collect(),
            loads: of(2).map(|(force, torque)| Load { force, torque }).collect(),
            contacts,
            solids: present,
        }))
    }

    /// As what is drawn.
    pub fn moment(&self) -> Moment<'_> {
        Moment {
            solids: &self.solids,
            time: self.time,
            poses: &self.poses,
            twists: &self.twists,
            flow: &[],
            loads: &self.loads,
            contacts: &self.contacts,
        }
    }
}

/// The ways of these bodies, or of the first `most` that move if none are named; and how many that move are left out.
///
/// # Errors
/// [`ResultsError::Broken`]; [`ResultsError::Option`] for a name that no body has.
pub fn tracks(folder: &Path, names: &[String], most: usize) -> Result<(Vec<Track>, usize), ResultsError> {
    let Some(solids) = solids(folder)? else { return Ok((Vec::new(), 0)) };
    if let Some(unknown) = names.iter().find(|name| solids.bodies.iter().all(|member| member.name != **name)) {
        return Err(ResultsError::Option {
            option: "--body",
            value: unknown.clone(),
            rule: "no body has this name".to_owned(),
            hint: "the names are in bodies.csv".to_owned(),
        });
    }
    let moving = solids.bodies.iter().filter(|member| !member.fixed).map(|member| member.name.clone());
    let all: Vec<String> = if names.is_empty() { moving.collect() } else { names.to_vec() };
    let mut tracks: Vec<Track> =
        all.iter().take(most).map(|name| Track { name: name.clone(), rows: Vec::new() }).collect();
    each_row(&folder.join("bodies.csv"), 1, &[9, 12], |(time, names, n)| {
        if let Some(track) = tracks.iter_mut().find(|track| track.name == names[0]) {
            let pose = Pose { position: Point::new(n[0], n[1]), angle: n[2] };
            let twist = Twist { velocity: Point::new(n[3], n[4]), spin: n[5] };
            track.rows.push((time, pose, twist));
        }
    })?;
    Ok((tracks, all.len().saturating_sub(most)))
}

/// How many bodies had left by a time, where the run has told of those that did.
fn left_by(folder: &Path, time: f64) -> Option<usize> {
    let summary: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("summary.json")).ok()?).ok()?;
    let left = summary["left"].as_array()?;
    Some(left.iter().filter(|gone| gone["time"].as_f64().is_some_and(|gone| gone <= time)).count())
}

fn broken(file: &Path, what: String) -> ResultsError {
    let hint = "it must be as the program writes it; run again, or take the file away";
    ResultsError::Broken { file: file.display().to_string(), what, hint }
}

fn solids(folder: &Path) -> Result<Option<Solids>, ResultsError> {
    let path = folder.join(SOLIDS_FILE);
    if !path.exists() || !folder.join("bodies.csv").exists() {
        return Ok(None);
    }
    Solids::read(&path).map(Some).map_err(|error| broken(&path, error.to_string()))
}

/// Visits the rows of a table with a time, texts and numbers; one that was cut off ends it.
fn each_row(path: &Path, texts: usize, numbers: &[usize], mut visit: impl FnMut(Row)) -> Result<(), ResultsError> {
    let mut reader = csv::Reader::from_path(path).map_err(|e| broken(path, e.to_string()))?;
    let columns = reader.headers().map_err(|e| broken(path, e.to_string()))?.len();
    if !numbers.iter().any(|numbers| columns == 1 + texts + numbers) {
        return Err(broken(path, format!("it has {columns} columns, must have {}", 1 + texts + numbers[0])));
    }
    for (k, row) in reader.records().map_while(Result::ok).enumerate() {
        let all = row.iter().skip(1 + texts).map(|text| text.parse().ok()).collect::<Option<Vec<f64>>>();
        let Some((time, numbers)) = row[0].parse().ok().zip(all) else {
            return Err(broken(path, format!("row {} has an entry that is not a number", k + 1)));
        };
        visit((time, row.iter().skip(1).take(texts).map(str::to_owned).collect(), numbers));
    }
    Ok(())
}

fn contacts(folder: &Path, solids: &Solids, time: f64) -> Result<Vec<Contact>, ResultsError> {
    let path = folder.join("contacts.csv");
    let mut found = Vec::new();
    if !path.exists() {
        return Ok(found);
    }
    let mut unknown = None;
    let place = |name: &str| solids.bodies.iter().position(|member| member.name == name);
    let wall = |name: &str| {
        let number: usize = name.strip_prefix("wall-")?.parse().ok()?;
        (1..=solids.walls.len()).contains(&number).then(|| Partner::Wall(number - 1))
    };
    each_row(&path, 2, &[6], |(t, names, n)| {
        if t != time {
            return;
        }
        match (place(&names[0]), place(&names[1]).map(Partner::Body).or_else(|| wall(&names[1]))) {
            (Some(body), Some(partner)) => found.push(Contact {
                body,
                partner,
                gap: n[0],
                force: n[1],
                friction: n[5],
                gamma: n[2],
                point: Point::new(n[3], n[4]),
                normal: Point::zeros(),
            }),
            _ => unknown = Some(format!("`{}` and `{}` are not both in bodies.json", names[0], names[1])),
        }
    })?;
    unknown.map_or(Ok(found), |what| Err(broken(&path, what)))
}
