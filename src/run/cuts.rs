//! Sections through the fields of a run: where they lie, and their tables.

use std::io::{self, Write};
use std::path::Path;

use rayon::prelude::*;

use super::RunError;
use super::stepper::Ground;
use crate::measure::cut::{Bases, Columns};
use crate::measure::fields::{At, IN_CUTS};
use crate::measure::{Circle, Line, MeasureError, OutputField, Section};
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::output::{push_number, write_whole};
use crate::scene::output::AXIS_POINTS;
use crate::scene::{Axis, AxisLine, Cut, Output};
use crate::space;

/// Points of a cut that are written in a moment. Longer ones of its last state a run writes at its end, not when it is
/// stopped.
pub(super) const QUICK: usize = 200_000;

/// The fields of a state, as the tables of its sections have them.
pub(super) struct Table {
    fields: Vec<(&'static OutputField, space::Field)>,
}

impl Table {
    /// Of these fields; where none are named, of the usual ones that there are.
    ///
    /// # Errors
    /// A field that cannot be solved for.
    pub fn new(at: &At, named: Option<&[&'static OutputField]>) -> Result<Self, RunError> {
        let wanted = named.unwrap_or(IN_CUTS).iter();
        let found = wanted.map(|&field| Ok((field.find)(at)?.map(|found| (field, found))));
        Ok(Self { fields: found.filter_map(Result::transpose).collect::<Result<_, RunError>>()? })
    }

    /// Writes the table of a section; whether it came to its end.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(
        &self,
        path: &Path,
        section: &Section,
        ground: &Ground,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<bool, RunError> {
        let each = self.fields.iter().flat_map(|(of, found)| (0..of.columns.len()).map(move |c| (found, c)));
        let columns = Columns::new(each.collect());
        let names: Vec<&str> = self.fields.iter().flat_map(|(of, _)| of.columns.iter().copied()).collect();
        let (abscissa, names) = (section.abscissa(), names.join(","));
        let written = write_whole(path, |out| {
            writeln!(out, "{abscissa},x1,x2,{names}")?;
            write_rows(out, section, &columns, (&*ground.mesh, &*ground.locator), is_stopped)
        });
        match written {
            Err(_) if is_stopped() => Ok(false),
            other => Ok(other.map(|()| true)?),
        }
    }
}

/// Refuses sections without a point in the domain.
///
/// # Errors
/// [`MeasureError::CutOutside`]
pub fn check(outputs: &[Output], ground: &Ground) -> Result<(), RunError> {
    for cut in outputs.iter().flat_map(|output| output.what.cuts()) {
        let section = section(cut, ground);
        let inside = |k| section.sample(k, &ground.mesh, &ground.locator).is_some();
        if !(0..section.points()).into_par_iter().any(inside) {
            return Err(MeasureError::CutOutside { name: cut.name().to_owned() }.into());
        }
    }
    Ok(())
}

/// The course of a cut.
pub(super) fn section(cut: &Cut, ground: &Ground) -> Section {
    let name = cut.name().to_owned();
    match cut {
        Cut::Line { from, to, points, .. } => Section::Line(Line { name, from: *from, to: *to, points: *points }),
        Cut::Circle { centre, radius, points, .. } => {
            Section::Circle(Circle { name, centre: *centre, radius: *radius, points: *points })
        }
        Cut::Axis(axis) => Section::Line(whole_axis(*axis, ground)),
    }
}

/// An axis through the whole domain.
fn whole_axis(axis: Axis, ground: &Ground) -> Line {
    let vertices = &ground.mesh.vertices;
    let low = vertices.iter().fold(vertices[0], |m, x| m.inf(x));
    let high = vertices.iter().fold(vertices[0], |m, x| m.sup(x));
    let (centre, radius) = (Point::from(ground.shape.centre()), ground.shape.radius());
    let (from, to) = match axis.line() {
        AxisLine::Horizontal(y) => {
            let y = centre.y + radius * y;
            (Point::new(low.x, y), Point::new(high.x, y))
        }
        AxisLine::Vertical(x) => {
            let x = centre.x + radius * x;
            (Point::new(x, low.y), Point::new(x, high.y))
        }
    };
    Line { name: axis.name().into(), from, to, points: AXIS_POINTS }
}

/// Points of a section whose rows are made at once. What a table takes does not grow with its rows.
pub const CHUNK: usize = 1024;
/// Chunks of each thread between two times of writing.
pub const CHUNKS: usize = 4;

/// The rows of a section, made by all threads and written in their order; an error where it is stopped on the way.
fn write_rows(
    out: &mut dyn Write,
    section: &Section,
    columns: &Columns,
    (mesh, locator): (&Mesh, &Locator),
    is_stopped: &dyn Fn() -> bool,
) -> io::Result<()> {
    let count = section.points();
    let rows = |first: usize| {
        let (mut text, mut bases) = (String::new(), Bases::default());
        let samples = (first..count.min(first + CHUNK)).filter_map(|k| section.sample(k, mesh, locator));
        for sample in samples {
            push_number(&mut text, sample.s);
            let mut add = |value| {
                text.push(',');
                push_number(&mut text, value);
            };
            [sample.x.x, sample.x.y].into_iter().for_each(&mut add);
            columns.read(&sample.at, &mut bases, &mut add);
            text.push('\n');
        }
        text
    };
    let batch = CHUNK * CHUNKS * rayon::current_num_threads();
    for start in (0..count).step_by(batch) {
        if is_stopped() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        let firsts: Vec<usize> = (start..count.min(start + batch)).step_by(CHUNK).collect();
        let texts: Vec<String> = firsts.into_par_iter().map(rows).collect();
        texts.iter().try_for_each(|text| out.write_all(text.as_bytes()))?;
    }
    Ok(())
}
