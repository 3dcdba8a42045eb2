//! The files of a run, each on its schedule.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use rayon::prelude::*;

use super::defects::{self, DefectTables};
use super::folder::Resumed;
use super::maps::{self, Draft};
use super::measures::{Readings, columns};
use super::strain;
use super::tissue::{self, AtRest};
use super::{RunError, Setup};
use crate::element::basis;
use crate::element::tables::Tables;
use crate::measure::cut::{Bases, Columns};
use crate::measure::{Census, Circle, Defects, Line, MeasureError, Section, StreamFunction};
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::output::bodies::{BodyFiles, BodyOutputs};
use crate::output::checkpoint::{Kept, Saved};
use crate::output::history::History;
use crate::output::pvd::Series;
use crate::output::vtk::{self, Grid, write_vtu};
use crate::output::{OutputError, push_number, write_whole};
use crate::scene::output::AXIS_POINTS;
use crate::scene::{Axis, AxisLine, Cut, Field, MapRequest, Scene, What};
use crate::scheme::Schedule;
use crate::space;
use crate::time::{March, StepReport};

/// Columns of the history before the measures.
const STEP_COLUMNS: [&str; 7] = ["time", "dt", "order", "iterations", "increment", "rate", "rejected"];

/// Points of a cut that are written in a moment. Longer ones of its last state a run writes at its end, not when it is
/// stopped.
const QUICK: usize = 200_000;

/// A run that is killed loses no more than this, whatever its scene asks for.
const PAUSE: std::time::Duration = std::time::Duration::from_secs(60);

/// Writes what a scene asks for.
#[derive(Debug)]
pub struct Writer {
    out: PathBuf,
    scene_text: String,
    mesh_fingerprint: u64,
    grid: Option<Grid>,
    series: Option<Series>,
    history: History,
    defects: Option<DefectTables>,
    stream: Option<StreamFunction>,
    fields: Vec<(Vec<Field>, Schedule)>,
    cuts: Vec<(Vec<Section>, Schedule)>,
    maps: Vec<(Vec<MapRequest>, Schedule)>,
    checkpoints: Vec<Schedule>,
    schedules: Vec<Schedule>,
    /// `T_a/C_F`, the speed of the tissue's frame.
    frame_speed: f64,
    /// Step and fields of the last file, so that the last state is not written twice.
    last_fields: Option<(usize, Vec<Field>)>,
    /// Step and names of the last pictures, for the same reason.
    last_maps: (usize, Vec<String>),
    caption: maps::Caption,
    /// Bodies that are all fixed, and their files.
    rest: Option<(AtRest, BodyFiles)>,
    tables: Vec<Schedule>,
    /// Goes into every checkpoint.
    pub kept: Kept,
    last_checkpoint: std::time::Instant,
    /// Cuts that a run that was stopped has not written of its last state.
    pub left_out: Vec<String>,
}

impl Writer {
    /// Prepares folders, tables and grids; only those that the scene needs.
    ///
    /// # Errors
    /// Folders or files that cannot be written, results that cannot be continued.
    pub fn new(scene: &Scene, setup: &Setup, out: &Path, resumed: Option<Resumed>) -> Result<Self, RunError> {
        let last_time = resumed.map(|resumed| resumed.last_time());
        let mut writer = Self {
            out: out.into(),
            scene_text: scene.resolved_toml(),
            mesh_fingerprint: setup.mesh.fingerprint(),
            grid: None,
            series: None,
            history: open_history(scene, out, resumed.map(|resumed| resumed.step))?,
            defects: None,
            stream: None,
            fields: Vec::new(),
            cuts: Vec::new(),
            maps: Vec::new(),
            checkpoints: Vec::new(),
            schedules: scene.outputs.iter().map(|o| o.schedule).collect(),
            frame_speed: scene.parameters.traction / scene.parameters.friction,
            last_fields: None,
            last_maps: (0, Vec::new()),
            caption: maps::Caption::of(scene),
            rest: None,
            tables: Vec::new(),
            kept: Kept::default(),
            last_checkpoint: std::time::Instant::now(),
            left_out: Vec::new(),
        };
        for (at, output) in scene.outputs.iter().enumerate() {
            match &output.what {
                What::Measures(_) => {}
                What::Bodies { .. } => writer.tables.push(output.schedule),
                What::Checkpoint => writer.checkpoints.push(output.schedule),
                What::Maps(requests) => {
                    let place = (&*setup.mesh, &setup.locator);
                    maps::check_windows(requests, &format!("output.{at}.maps"), scene.source(), place)?;
                    writer.maps.push((requests.clone(), output.schedule));
                }
                What::Fields(fields) => writer.fields.push((fields.clone(), output.schedule)),
                What::Cuts(cuts) => {
                    let sections = cuts.iter().map(|cut| section(cut, scene, setup)).collect();
                    writer.cuts.push((sections, output.schedule));
                }
            }
        }
        if let Some(rest) = tissue::at_rest(scene, setup) {
            let (bodies, pictures) = (!writer.tables.is_empty(), !writer.maps.is_empty());
            let asked = BodyOutputs { bodies, contacts: false, pictures };
            let files = BodyFiles::new(out, rest.solids.clone(), asked, last_time)?;
            writer.rest = Some((rest, files));
        }
        let streamlines = writer.maps.iter().flat_map(|(requests, _)| requests).any(|request| request.streamlines);
        if streamlines || writer.fields.iter().any(|(fields, _)| fields.contains(&Field::StreamFunction)) {
            writer.stream = Some(StreamFunction::new(setup.model.loops(), setup.model.velocity())?);
        }
        if defects::named(scene) {
            let boundaries = Defects::new(&setup.mesh).boundaries;
            let after = resumed.map(|resumed| resumed.step);
            writer.defects = Some(DefectTables::open(scene, out, &boundaries, after)?);
        }
        if !writer.fields.is_empty() {
            writer.open_series(setup, last_time)?;
        }
        if !writer.cuts.is_empty() {
            make_folder(&out.join("cuts"))?;
        }
        if !writer.maps.is_empty() {
            make_folder(&out.join("plots"))?;
        }
        if let Some(resumed) = resumed {
            let requests = writer.maps.iter().flat_map(|(requests, _)| requests);
            resumed.drop_later(out, &requests.map(|request| request.name.as_str()).collect::<Vec<_>>())?;
        }
        Ok(writer)
    }

    /// Whether the pictures and sections that a scene asks for can be made.
    ///
    /// # Errors
    /// A window or a section without a point in the domain.
    pub fn check(scene: &Scene, setup: &Setup) -> Result<(), RunError> {
        maps::check_all_windows(&scene.outputs, scene.source(), &setup.mesh)?;
        Self::check_cuts(scene, setup)
    }

    /// Whether every section has a point in the domain.
    ///
    /// # Errors
    /// [`MeasureError::CutOutside`]
    pub fn check_cuts(scene: &Scene, setup: &Setup) -> Result<(), RunError> {
        for output in &scene.outputs {
            match &output.what {
                What::Cuts(cuts) => cuts.iter().try_for_each(|cut| check_cut(cut, scene, setup))?,
                What::Measures(_) | What::Fields(_) | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => {}
            }
        }
        Ok(())
    }

    fn open_series(&mut self, setup: &Setup, resume_at: Option<f64>) -> Result<(), RunError> {
        let model = &setup.model;
        let strain = setup.strain.as_ref().map_or(1, |strain| strain.space.degree);
        let degree = [model.velocity().degree, model.volume().degree, model.polarity().space.degree, strain];
        let bent = setup.mesh.curved.iter().flatten().map(|nodes| nodes.degree);
        let degree = degree.into_iter().chain(bent).max().unwrap_or(1);
        make_folder(&self.out.join("fields"))?;
        self.grid = Some(Grid::new(&setup.mesh, degree));
        let index = self.out.join("fields.pvd");
        self.series = Some(match resume_at {
            Some(t) => Series::resume(&index, t)?,
            None => Series::create(&index)?,
        });
        Ok(())
    }

    /// Times after `t` on which the next step must land.
    pub fn next_landing(&self, t: f64) -> impl Iterator<Item = f64> {
        self.schedules.iter().filter_map(move |s| s.next_time(t))
    }

    /// Writes what is due after the step that began at `before`; `None` is the start, where the fields are written
    /// once.
    ///
    /// # Errors
    /// A file that cannot be written, a field that is not finite.
    pub fn write_due(&mut self, march: &mut March, setup: &Setup, before: Option<f64>) -> Result<(), RunError> {
        let (t, step) = (march.t, march.counts.steps);
        let due = |s: &Schedule| match before {
            Some(before) => s.is_due(before, t, step),
            None => matches!(s, Schedule::Time(_) | Schedule::Steps(_)),
        };
        let fields: Vec<Field> =
            self.fields.iter().filter(|(_, s)| due(s)).flat_map(|(f, _)| f.iter().copied()).collect();
        if !fields.is_empty() {
            self.write_fields(march, setup, &fields)?;
        }
        let maps: Vec<MapRequest> =
            self.maps.iter().filter(|(_, s)| due(s)).flat_map(|(m, _)| m.iter().cloned()).collect();
        self.draw_maps(march, setup, &maps)?;
        if self.tables.iter().any(due) {
            self.write_bodies(march)?;
        }
        if before.is_some() {
            for (sections, schedule) in &self.cuts {
                if due(schedule) {
                    // that of a step is written to its end, as the step is done
                    self.write_cuts(march, setup, sections, Some(step))?;
                }
            }
            if self.checkpoints.iter().any(due) || self.last_checkpoint.elapsed() > PAUSE {
                self.write_checkpoint(march)?;
            }
        }
        Ok(())
    }

    /// Writes the last state in every form that the scene asks for, and always a checkpoint; after a failure the fields
    /// as well, whatever the scene asks for.
    ///
    /// # Errors
    /// As [`Writer::write_due`].
    pub fn write_last(&mut self, march: &mut March, setup: &Setup, failed: bool) -> Result<(), RunError> {
        self.write_checkpoint(march)?;
        if failed && self.fields.is_empty() {
            self.fields.push((vec![Field::Velocity, Field::Pressure, Field::Polarity], Schedule::End));
            self.open_series(setup, Some(march.t))?;
        }
        let fields: Vec<Field> = self.fields.iter().flat_map(|(f, _)| f.iter().copied()).collect();
        let written = |field: &Field| {
            self.last_fields.as_ref().is_some_and(|(step, all)| *step == march.counts.steps && all.contains(field))
        };
        if !fields.iter().all(written) {
            self.write_fields(march, setup, &fields)?;
        }
        let mut left_out = Vec::new();
        for (sections, _) in &self.cuts {
            left_out.extend(self.write_cuts(march, setup, sections, None)?);
        }
        self.left_out = left_out;
        let maps: Vec<MapRequest> = self.maps.iter().flat_map(|(m, _)| m.iter().cloned()).collect();
        self.draw_maps(march, setup, &maps)?;
        if !self.tables.is_empty() {
            self.write_bodies(march)?;
        }
        Ok(())
    }

    /// Writes `checkpoint.bin`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_checkpoint(&mut self, march: &March) -> Result<(), RunError> {
        let saved = Saved::new(self.scene_text.clone(), self.mesh_fingerprint, march.checkpoint(), self.kept.clone());
        saved.write(&self.out.join("checkpoint.bin"))?;
        self.last_checkpoint = std::time::Instant::now();
        Ok(())
    }

    /// Appends the row of an accepted step.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn append_history(&mut self, report: &StepReport, readings: &Readings) -> Result<(), RunError> {
        let value = |column: &str| match column {
            "time" => Some(report.t),
            "dt" => Some(report.dt),
            "order" => Some(report.order as f64),
            "iterations" => Some(report.iterations as f64),
            "increment" => Some(report.increment),
            "rate" => Some(report.rate).filter(|r| r.is_finite()),
            "rejected" => Some(report.rejected as f64),
            other => readings.value(other),
        };
        self.history.append(report.step, value)?;
        if let (Some(tables), Some(census)) = (&mut self.defects, &readings.taken.census) {
            tables.append(report.step, report.t, census)?;
        }
        Ok(())
    }

    /// Writes the defects of the last state, where those on the way are not asked for.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn write_last_defects(&mut self, march: &March, census: Option<Census>) -> Result<(), RunError> {
        if let (Some(tables), Some(census)) = (&mut self.defects, &census) {
            tables.append_last(march.counts.steps, march.t, census)?;
        }
        Ok(())
    }

    fn write_fields(&mut self, march: &mut March, setup: &Setup, fields: &[Field]) -> Result<(), RunError> {
        let grid = self.grid.as_ref().expect("opened with the series");
        let named = Field::in_order(fields);
        let mut at_nodes: Vec<(usize, Vec<f64>)> = Vec::new();
        for &field in &named {
            at_nodes.push(match field {
                Field::ElasticStrain => {
                    let strain = strain::at(setup, &march.state)?.expect("prepared when a scene asks for it");
                    let parts = strain.components.each_ref().map(|part| nodal(part, grid.degree).1);
                    (3, (0..parts[0].len()).flat_map(|k| parts.each_ref().map(|part| part[k])).collect())
                }
                other => nodal(&self.field(other, march, setup)?, grid.degree),
            });
        }
        let list: Vec<vtk::Field> = named
            .iter()
            .zip(&at_nodes)
            .map(|(field, (components, values))| vtk::Field { name: field.name(), components: *components, values })
            .collect();
        let name = format!("fields/step-{:06}.vtu", march.counts.steps);
        let (t, path) = (march.t, self.out.join(&name));
        march.phases.measure("output", || write_vtu(&path, grid, t, &list))?;
        self.series.as_mut().expect("opened with the grid").append(t, &name)?;
        if let (Some(series), Some((rest, files))) = (&mut self.series, &mut self.rest) {
            series.append_parts(t, &files.parts(march.counts.steps, &rest.moment(t))?)?;
        }
        self.last_fields = Some((march.counts.steps, named));
        Ok(())
    }

    fn field(&self, field: Field, march: &March, setup: &Setup) -> Result<space::Field, RunError> {
        let (state, model) = (&march.state, &setup.model);
        Ok(match field {
            Field::Velocity => state.v.clone(),
            Field::Pressure => model.pressure(state)?,
            Field::Density => state.volume().clone(),
            Field::Polarity => state.p.clone(),
            Field::MolecularField => model.molecular_field(state, march.t),
            Field::StreamFunction => {
                let stream = self.stream.as_ref().expect("prepared when a scene asks for it");
                stream.of(model.loops(), &state.v)?
            }
            Field::PolarityLaplacian => model.polarity_laplacian(state, march.t),
            Field::ElasticStrain => unreachable!("a tensor is no field of a space"),
            Field::TissueVelocity => {
                let mut v = state.v.clone();
                v.values.iter_mut().step_by(2).for_each(|v1| *v1 -= self.frame_speed);
                v
            }
        })
    }

    /// Those of a step, or of the last state. Of that, long ones of a run that is stopped are left out, and named.
    fn write_cuts(
        &self,
        march: &March,
        setup: &Setup,
        sections: &[Section],
        step: Option<usize>,
    ) -> Result<Vec<String>, RunError> {
        let state = &march.state;
        let pressure = march.model.pressure(state)?;
        let laplacian = march.model.polarity_laplacian(state, march.t);
        let strain = strain::at(setup, state)?;
        let density = if state.density().is_some() { ",density" } else { "" };
        let strained = if strain.is_some() { ",strain_11,strain_12,strain_22" } else { "" };
        let mut columns = vec![(&state.v, 0), (&state.v, 1), (&pressure, 0), (&state.p, 0), (&state.p, 1)];
        columns.extend(state.density().map(|rho| (rho, 0)));
        columns.extend([(&laplacian, 0), (&laplacian, 1)]);
        columns.extend(strain.iter().flat_map(|strain| &strain.components).map(|part| (part, 0)));
        let columns = Columns::new(columns);
        let mut left_out = Vec::new();
        for section in sections {
            let (name, abscissa) = (section.name(), section.abscissa());
            let file = match step {
                Some(step) => format!("{name}-step-{step:06}.csv"),
                None => format!("{name}.csv"),
            };
            let path = self.out.join("cuts").join(file);
            let leaves = step.is_none() && section.points() > QUICK;
            let is_stopped = || leaves && march.interrupt.load(Ordering::Relaxed);
            let written = write_whole(&path, |out| {
                writeln!(out, "{abscissa},x1,x2,v1,v2,pressure,p1,p2{density},laplacian1,laplacian2{strained}")?;
                write_rows(out, section, &columns, (&*setup.mesh, &setup.locator), &is_stopped)
            });
            match written {
                Err(_) if is_stopped() => left_out.push(name.to_owned()),
                other => other?,
            }
        }
        Ok(left_out)
    }

    fn write_bodies(&mut self, march: &March) -> Result<(), RunError> {
        if let Some((rest, files)) = &mut self.rest {
            files.write(march.counts.steps, &rest.moment(march.t))?;
        }
        Ok(())
    }

    /// Draws what was not drawn at this step yet.
    fn draw_maps(&mut self, march: &mut March, setup: &Setup, requests: &[MapRequest]) -> Result<(), RunError> {
        let step = march.counts.steps;
        if self.last_maps.0 != step {
            self.last_maps = (step, Vec::new());
        }
        let folder = self.out.join("plots");
        for request in requests.iter().filter(|request| !self.last_maps.1.contains(&request.name)) {
            let moment = self.rest.as_ref().map(|(rest, _)| rest.moment(march.t));
            let (stream, bodies) = (self.stream.as_ref(), moment.as_ref());
            let draft = Draft { stream, bodies, ..Draft::new(setup, &march.state, march.t) };
            let path = folder.join(format!("{}-{step:06}", request.name));
            march.phases.measure("output", || {
                let picture = draft.draw(request, &self.caption)?;
                picture.write(&path).map_err(|error| maps::failed(&request.name, error))
            })?;
            if let Some((_, files)) = &mut self.rest {
                files.note_picture(&request.name, step, march.t)?;
            }
        }
        self.last_maps.1.extend(requests.iter().map(|request| request.name.clone()));
        Ok(())
    }

    /// Unknowns of the stream function, where there is one.
    pub fn stream_unknowns(&self) -> Option<usize> {
        self.stream.as_ref().map(|s| s.space.dof_count())
    }
}

fn make_folder(path: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(path).map_err(|e| OutputError::io(path, &e))
}

fn open_history(scene: &Scene, out: &Path, resume_after: Option<usize>) -> Result<History, OutputError> {
    let columns: Vec<String> = STEP_COLUMNS.into_iter().chain(columns(scene)).map(str::to_owned).collect();
    let path = out.join("history.csv");
    match resume_after {
        Some(step) if path.exists() => History::resume(&path, columns, step),
        Some(_) | None => History::create(&path, columns),
    }
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

/// Refuses a cut that lies outside of the domain.
fn check_cut(cut: &Cut, scene: &Scene, setup: &Setup) -> Result<(), RunError> {
    let section = section(cut, scene, setup);
    let inside = |k| section.sample(k, &setup.mesh, &setup.locator).is_some();
    if (0..section.points()).into_par_iter().any(inside) {
        return Ok(());
    }
    Err(MeasureError::CutOutside { name: cut.name().to_owned() }.into())
}

/// The course of a cut.
fn section(cut: &Cut, scene: &Scene, setup: &Setup) -> Section {
    let name = cut.name().to_owned();
    match cut {
        Cut::Line { from, to, points, .. } => Section::Line(Line { name, from: *from, to: *to, points: *points }),
        Cut::Circle { centre, radius, points, .. } => {
            Section::Circle(Circle { name, centre: *centre, radius: *radius, points: *points })
        }
        Cut::Axis(axis) => Section::Line(whole_axis(*axis, scene, setup)),
    }
}

/// An axis through the whole domain.
fn whole_axis(axis: Axis, scene: &Scene, setup: &Setup) -> Line {
    let vertices = &setup.mesh.vertices;
    let low = vertices.iter().fold(vertices[0], |m, x| m.inf(x));
    let high = vertices.iter().fold(vertices[0], |m, x| m.sup(x));
    let centre = Point::from(scene.mesh.centre());
    let radius = scene.mesh.radius();
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

/// Values at the nodes of every cell of a grid: exact when the grid's degree is not below the field's.
pub(super) fn nodal(field: &space::Field, degree: usize) -> (usize, Vec<f64>) {
    let space = &field.space;
    let tables = Tables::new(basis::nodes(degree));
    let table = tables.degree(space.degree);
    let mut values = Vec::with_capacity(space.mesh.cells.len() * tables.points.len() * space.components);
    for cell in 0..space.mesh.cells.len() {
        for q in 0..tables.points.len() {
            for c in 0..space.components {
                let row = table.values(q).iter();
                values.push(row.zip(field.coefficients(cell, c)).map(|(phi, u)| phi * u).sum());
            }
        }
    }
    (space.components, values)
}
