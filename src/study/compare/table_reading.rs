//! How a comparison's table is read: its form, columns, units and directions.

use std::collections::BTreeMap;

use super::file::{Columns, CompareFile};
use super::format::{Direction, Form, Motion};
use super::reader::{Column, Cut, Wanted};
use crate::mesh::Point;
use crate::scene::SceneSource;
use crate::study::StudyError;
use crate::study::source::{below, refuse};

/// What tells the velocity of a row, by the places of its columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum VelocitySource {
    Velocity { vx: usize, vy: usize },
    Track(usize),
}

/// A column by which rows are kept.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Keep {
    pub name: String,
    pub at: usize,
    /// Values of rows that count.
    pub accepted: Vec<f64>,
}

/// How the table is read.
#[derive(Debug, Clone, PartialEq)]
pub struct TableReading {
    pub(super) wanted: Vec<Wanted>,
    /// Place of the time among the wanted columns; without it each file is a frame.
    pub(super) t: Option<usize>,
    pub(super) told: VelocitySource,
    pub(super) keep: Vec<Keep>,
    pub(super) cut: Cut,
    /// Length of a pixel: the table's unit of length becomes it.
    pixel: f64,
    /// Time between two frames.
    frame: f64,
    y_is: Direction,
}

/// Places of x and y among the wanted columns.
pub(super) const X: usize = 0;
pub(super) const Y: usize = 1;

impl TableReading {
    /// Completes what a study says by what its format means.
    ///
    /// # Errors
    /// Columns that are taken twice, and a table without a time.
    pub(super) fn new(source: &SceneSource, file: &CompareFile, is_pattern: bool) -> Result<Self, StudyError> {
        let form = file.format.form();
        let mut list = List { form, wanted: Vec::new() };
        list.push("x", file.columns.x.as_ref(), form.x);
        list.push("y", file.columns.y.as_ref(), form.y);
        let told = list.motion(&file.columns);
        let keep = list.keep(file.keep.as_ref());
        // of a form with times of its own the files are joined, as they are where the study names the column
        let by_file = is_pattern && file.columns.t.is_none() && !matches!(form.motion, Motion::Track(_));
        let t = match (form.t, &file.columns.t) {
            (_, _) if by_file => None,
            (Some(name), given) => Some(list.push("t", given.as_ref(), name)),
            (None, Some(given)) => Some(list.push("t", Some(given), "t")),
            (None, None) => return Err(no_time(source)),
        };
        check_columns(source, &list.wanted)?;
        Ok(Self {
            wanted: list.wanted,
            t,
            told,
            keep,
            cut: Cut { separator: file.separator, header: file.header },
            pixel: file.pixel,
            frame: file.frame,
            y_is: file.y.unwrap_or(form.y_is),
        })
    }

    /// A place or a difference of places in units of length.
    pub(super) fn length(&self, x: f64, y: f64) -> Point {
        Point::new(x, y) * self.pixel
    }

    pub(super) fn time(&self, t: f64) -> f64 {
        t * self.frame
    }

    /// A velocity in units of length and time, of one in the table's.
    pub(super) fn velocity(&self, x: f64, y: f64) -> Point {
        Point::new(x, y) * (self.pixel / self.frame)
    }

    /// A vector with its second component upwards.
    pub(super) fn upright(&self, v: Point) -> Point {
        match self.y_is {
            Direction::Up => v,
            Direction::Down => Point::new(v.x, -v.y),
        }
    }
}

/// The columns that are to be read.
struct List {
    form: &'static Form,
    wanted: Vec<Wanted>,
}

impl List {
    /// Adds a column and returns its place.
    fn push(&mut self, key: &str, given: Option<&Column>, usual: &str) -> usize {
        let place = self.wanted.len();
        let without_names = (self.form.in_order && given.is_none()).then_some(place + 1);
        let column = given.cloned().unwrap_or_else(|| Column::Name(usual.to_owned()));
        let key = format!("columns.{key}");
        self.wanted.push(Wanted { key, column, without_names, optional: false, names: false });
        place
    }

    fn motion(&mut self, columns: &Columns) -> VelocitySource {
        let velocity = columns.vx.is_some() || columns.vy.is_some();
        match (self.form.motion, &columns.track) {
            (Motion::Velocity(x, y), track) if velocity || track.is_none() => self.velocity(columns, x, y),
            (Motion::Track(_), None) if velocity => self.velocity(columns, "vx", "vy"),
            (Motion::Track(usual), track) => self.track(track.as_ref(), usual),
            (Motion::Velocity(..), track) => self.track(track.as_ref(), "track"),
        }
    }

    fn velocity(&mut self, columns: &Columns, x: &str, y: &str) -> VelocitySource {
        let vx = self.push("vx", columns.vx.as_ref(), x);
        let vy = self.push("vy", columns.vy.as_ref(), y);
        VelocitySource::Velocity { vx, vy }
    }

    fn track(&mut self, given: Option<&Column>, usual: &str) -> VelocitySource {
        let at = self.push("track", given, usual);
        self.wanted[at].names = true;
        VelocitySource::Track(at)
    }

    fn keep(&mut self, given: Option<&BTreeMap<String, Vec<f64>>>) -> Vec<Keep> {
        let own = || self.form.keep.iter().map(|(name, values)| ((*name).to_owned(), values.to_vec())).collect();
        let all: Vec<(String, Vec<f64>)> = given.map_or_else(own, |all| all.clone().into_iter().collect());
        let add = |(name, accepted): (String, Vec<f64>)| {
            let at = self.push("keep", None, &name);
            self.wanted[at].key = below("keep", &name);
            // a form may lack the columns that it usually has, a study names those that there are
            self.wanted[at].optional = given.is_none();
            Keep { name, at, accepted }
        };
        all.into_iter().map(add).collect()
    }
}

fn no_time(source: &SceneSource) -> StudyError {
    let data = source.value("data").and_then(|item| item.as_str()).unwrap_or_default().to_owned();
    let rule = "this form has no time: it has a file for each frame";
    let hint = "name all of them by a pattern, such as data = \"piv/*.txt\", or give `columns.t`";
    refuse(source, "data", format!("\"{data}\""), rule, hint)
}

fn check_columns(source: &SceneSource, wanted: &[Wanted]) -> Result<(), StudyError> {
    for (k, Wanted { key, column, .. }) in wanted.iter().enumerate() {
        let twice = wanted[..k].iter().find(|other| other.column == *column);
        let empty = matches!(column, Column::Name(name) if name.trim().is_empty());
        let rule = match (empty, twice) {
            (true, _) => "must be the name of a column, or its number from 1".to_owned(),
            (false, Some(other)) => format!("`{}` is the same column", other.key),
            (false, None) => continue,
        };
        let hint = "such as columns = { x = \"x\", y = \"y\", t = \"t\", vx = \"vx\", vy = \"vy\" }";
        let value = match column {
            Column::Name(name) => format!("\"{name}\""),
            Column::Number(number) => number.to_string(),
        };
        return Err(refuse(source, key, value, &rule, hint));
    }
    Ok(())
}
