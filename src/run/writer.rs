//! The files of a run, each on its schedule.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::cuts::{QUICK, Table, section};
use super::defects::{self, DefectTables};
use super::folder::Resumed;
use super::maps::{self, Draft};
use super::measures::{Readings, columns};
use super::moment::{first_view, with_moment};
use super::stepper::{Ground, Plan, Stepper, Stride};
use super::view::View;
use super::{RunError, Totals};
use crate::element::basis;
use crate::element::tables::Tables;
use crate::measure::fields::{Fields, POLARITY, PRESSURE, Tool, VELOCITY};
use crate::measure::{Census, Defects, OutputField, Section};
use crate::output::OutputError;
use crate::output::bodies::{BodyFiles, BodyOutputs, Look, Moment, Solids, picture};
use crate::output::checkpoint::{Kept, Saved};
use crate::output::history::History;
use crate::output::plot::map::{Picture, Window};
use crate::output::pvd::Series;
use crate::output::vtk::{self, Grid, write_vtu};
use crate::scene::{MapRequest, Quantity, What};
use crate::scheme::Schedule;
use crate::space;

/// A run that is killed loses no more than this, whatever its scene asks for.
const PAUSE: std::time::Duration = std::time::Duration::from_secs(60);

/// A section and the fields in the columns of its table.
#[derive(Clone)]
struct Cut {
    section: Section,
    columns: Option<Vec<&'static OutputField>>,
}

/// Writes what a scene asks for.
pub struct Writer<'p> {
    plan: &'p Plan<'p>,
    ground: Option<&'p Ground>,
    out: PathBuf,
    grid: Option<Grid>,
    series: Option<Series>,
    history: History,
    defects: Option<DefectTables>,
    fields: Vec<(Vec<&'static OutputField>, Schedule)>,
    cuts: Vec<(Vec<Cut>, Schedule)>,
    maps: Vec<(Vec<MapRequest>, Schedule)>,
    tables: Vec<Schedule>,
    checkpoints: Vec<Schedule>,
    cast: Arc<Solids>,
    bodies: BodyFiles,
    /// Of all pictures of bodies alone that name none, so that a film does not zoom.
    window: Option<Window>,
    /// Step and fields of the last file, so that the last state is not written twice.
    last_fields: Option<(usize, Vec<&'static OutputField>)>,
    /// Step and names of the last pictures, for the same reason.
    last_maps: (usize, Vec<String>),
    /// Goes into every checkpoint.
    pub kept: Kept,
    last_checkpoint: std::time::Instant,
    /// Cuts that a run that was stopped has not written of its last state.
    pub left_out: Vec<String>,
}

impl<'p> Writer<'p> {
    /// Prepares folders, tables and grids; only those that the scene needs.
    ///
    /// # Errors
    /// Folders or files that cannot be written, results that cannot be continued.
    pub fn new(
        plan: &'p Plan,
        ground: Option<&'p Ground>,
        stepper: &mut dyn Stepper,
        out: &Path,
        resumed: Option<Resumed>,
    ) -> Result<Self, RunError> {
        let last_time = resumed.map(|resumed| resumed.last_time());
        let is_map = |what: &What| matches!(what, What::Maps(_));
        let flow = ground.is_some() && plan.tissue.is_none();
        let asked = BodyOutputs { flow, ..BodyOutputs::default() };
        let asked = plan.outputs.iter().fold(asked, |asked, output| match output.what {
            What::Bodies { contacts } => BodyOutputs { bodies: true, contacts: asked.contacts || contacts, ..asked },
            ref what => BodyOutputs { pictures: asked.pictures || is_map(what), ..asked },
        });
        let cast = Solids::new(plan.bodies, &plan.walls);
        let window = if plan.bodies.is_empty() { None } else { Some(first_view(plan, &cast)?) };
        let mut writer = Self {
            plan,
            ground,
            out: out.into(),
            grid: None,
            series: None,
            history: open_history(plan, stepper, out, resumed.map(|resumed| resumed.step))?,
            defects: None,
            fields: Vec::new(),
            cuts: Vec::new(),
            maps: Vec::new(),
            tables: Vec::new(),
            checkpoints: Vec::new(),
            bodies: BodyFiles::new(out, cast.clone(), asked, last_time)?,
            cast: Arc::new(cast),
            window,
            last_fields: None,
            last_maps: (0, Vec::new()),
            kept: Kept::default(),
            last_checkpoint: std::time::Instant::now(),
            left_out: Vec::new(),
        };
        writer.sort_outputs();
        stepper.look(&mut |view| writer.prepare(view, resumed))?;
        if let Some(resumed) = resumed {
            let requests = writer.maps.iter().flat_map(|(requests, _)| requests);
            resumed.drop_later(out, &requests.map(|request| request.name.as_str()).collect::<Vec<_>>())?;
        }
        Ok(writer)
    }

    /// What is written on which schedule.
    fn sort_outputs(&mut self) {
        for output in self.plan.outputs {
            match (&output.what, self.ground) {
                (What::Measures(_), _) => {}
                (What::Bodies { .. }, _) => self.tables.push(output.schedule),
                (What::Checkpoint, _) => self.checkpoints.push(output.schedule),
                (What::Maps(requests), _) => self.maps.push((requests.clone(), output.schedule)),
                (What::Fields(fields), _) => self.fields.push((fields.clone(), output.schedule)),
                (What::Cuts { cuts, columns }, Some(ground)) => {
                    let cut = |cut| Cut { section: section(cut, ground), columns: columns.clone() };
                    self.cuts.push((cuts.iter().map(cut).collect(), output.schedule));
                }
                (What::Cuts { .. }, None) => {}
            }
        }
    }

    /// Opens what depends on the fields that there are.
    fn prepare(&mut self, view: &View, resumed: Option<Resumed>) -> Result<(), RunError> {
        let (Some(fields), Some(ground)) = (view.fields, self.ground) else { return Ok(()) };
        if self.plan.outputs.iter().any(|output| output.what.takes(Tool::StreamFunction)) {
            ground.tools.stream(fields)?;
        }
        if defects::named(self.plan) {
            let boundaries = Defects::new(&ground.mesh).boundaries;
            let after = resumed.map(|resumed| resumed.step);
            self.defects = Some(DefectTables::open(self.plan, &self.out, &boundaries, after)?);
        }
        if !self.fields.is_empty() {
            self.open_series(fields, ground, resumed.map(|resumed| resumed.last_time()))?;
        }
        if !self.cuts.is_empty() {
            make_folder(&self.out.join("cuts"))?;
        }
        Ok(())
    }

    fn open_series(&mut self, fields: &dyn Fields, ground: &Ground, resume: Option<f64>) -> Result<(), RunError> {
        let strain = ground.tools.strain.as_ref().map(|strain| strain.space.degree);
        let bent = ground.mesh.curved.iter().flatten().map(|nodes| nodes.degree);
        let degree = bent.chain(strain).chain([fields.degree()]).max().unwrap_or(1);
        make_folder(&self.out.join("fields"))?;
        self.grid = Some(Grid::new(&ground.mesh, degree));
        let index = self.out.join("fields.pvd");
        self.series = Some(match resume {
            Some(t) => Series::resume(&index, t)?,
            None => Series::create(&index)?,
        });
        Ok(())
    }

    /// Times after `t` on which the next step must land.
    pub fn next_landing(&self, t: f64) -> impl Iterator<Item = f64> {
        self.plan.outputs.iter().filter_map(move |output| output.schedule.next_time(t))
    }

    /// Writes what is due after the step that began at `before`; `None` is the start, where the fields are written
    /// once.
    ///
    /// # Errors
    /// A file that cannot be written, a field that is not finite.
    pub fn write_due(
        &mut self,
        stepper: &mut dyn Stepper,
        (t, step): (f64, usize),
        before: Option<f64>,
    ) -> Result<(), RunError> {
        let due = |s: &Schedule| match before {
            Some(before) => s.is_due(before, t, step),
            None => matches!(s, Schedule::Time(_) | Schedule::Steps(_)),
        };
        let fields: Vec<&OutputField> =
            self.fields.iter().filter(|(_, s)| due(s)).flat_map(|(f, _)| f.iter().copied()).collect();
        let maps: Vec<MapRequest> =
            self.maps.iter().filter(|(_, s)| due(s)).flat_map(|(m, _)| m.iter().cloned()).collect();
        let tables = self.tables.iter().any(due);
        let due_cuts = self.cuts.iter().filter(|(_, s)| before.is_some() && due(s));
        let cuts: Vec<Cut> = due_cuts.flat_map(|(cuts, _)| cuts.iter().cloned()).collect();
        if fields.is_empty() && maps.is_empty() && cuts.is_empty() && !tables {
            return Ok(());
        }
        stepper.look(&mut |view| {
            self.write_fields(view, step, &fields)?;
            self.draw_maps(view, step, &maps)?;
            if tables {
                let cast = self.cast.clone();
                with_moment(&cast, view, |moment| self.bodies.write(step, moment))?;
            }
            // that of a step is written to its end, as the step is done
            self.write_cuts(view, &cuts, Some(step), &|| false).map(|_| ())
        })
    }

    /// Writes the last state in every form that the scene asks for; after a failure the fields as well, whatever the
    /// scene asks for. Long cuts of a run that is stopped are left out, and named in `left_out`.
    ///
    /// # Errors
    /// As [`Writer::write_due`].
    pub fn write_last(
        &mut self,
        stepper: &mut dyn Stepper,
        (t, step): (f64, usize),
        failed: bool,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<(), RunError> {
        stepper.look(&mut |view| {
            if let (true, true, Some(fields), Some(ground)) = (failed, self.fields.is_empty(), view.fields, self.ground)
            {
                let mut all = Vec::new();
                for field in [&VELOCITY, &PRESSURE, &POLARITY] {
                    all.extend((field.find)(&ground.at(fields))?.map(|_| field));
                }
                self.fields.push((all, Schedule::End));
                self.open_series(fields, ground, Some(t))?;
            }
            let fields: Vec<&OutputField> = self.fields.iter().flat_map(|(f, _)| f.iter().copied()).collect();
            let written = |field: &&OutputField| {
                self.last_fields.as_ref().is_some_and(|(last, all)| *last == step && all.contains(field))
            };
            if !fields.iter().all(written) {
                self.write_fields(view, step, &fields)?;
            }
            let cuts: Vec<Cut> = self.cuts.iter().flat_map(|(cuts, _)| cuts.iter().cloned()).collect();
            self.left_out = self.write_cuts(view, &cuts, None, is_stopped)?;
            let maps: Vec<MapRequest> = self.maps.iter().flat_map(|(m, _)| m.iter().cloned()).collect();
            self.draw_maps(view, step, &maps)?;
            if !self.tables.is_empty() {
                let cast = self.cast.clone();
                with_moment(&cast, view, |moment| self.bodies.write(step, moment))?;
            }
            Ok(())
        })
    }

    /// Writes `checkpoint.bin` if a schedule or the time since the last one asks for it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_checkpoint_if_due(
        &mut self,
        stepper: &dyn Stepper,
        (before, t): (f64, f64),
        totals: Totals,
    ) -> Result<(), RunError> {
        let due = self.checkpoints.iter().any(|s| s.is_due(before, t, totals.counts.steps));
        if due || self.last_checkpoint.elapsed() > PAUSE {
            self.write_checkpoint(stepper, t, totals)?;
        }
        Ok(())
    }

    /// Writes `checkpoint.bin`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_checkpoint(&mut self, stepper: &dyn Stepper, t: f64, totals: Totals) -> Result<(), RunError> {
        let mesh = self.ground.map_or(0, |ground| ground.mesh.fingerprint());
        let Totals { counts, overlap } = totals;
        let (scene, state, kept) = (self.plan.text.clone(), stepper.state(), self.kept.clone());
        Saved::new(scene, mesh, (t, counts, overlap), state, kept).write(&self.out.join("checkpoint.bin"))?;
        self.last_checkpoint = std::time::Instant::now();
        Ok(())
    }

    /// Appends the row of an accepted step.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn append_history(&mut self, step: usize, stride: &Stride, readings: &Readings) -> Result<(), RunError> {
        self.history.append(step, |column| stride.value(column).or_else(|| readings.value(column)))?;
        if let (Some(tables), Some(census)) = (&mut self.defects, &readings.taken.census) {
            tables.append(step, stride.t, census)?;
        }
        Ok(())
    }

    /// Writes the defects of the last state, where those on the way are not asked for.
    ///
    /// # Errors
    /// A table that cannot be written.
    pub fn write_last_defects(&mut self, (t, step): (f64, usize), census: Option<Census>) -> Result<(), RunError> {
        if let (Some(tables), Some(census)) = (&mut self.defects, &census) {
            tables.append_last(step, t, census)?;
        }
        Ok(())
    }

    fn write_fields(&mut self, view: &View, step: usize, fields: &[&'static OutputField]) -> Result<(), RunError> {
        let (Some(all), Some(ground), Some(grid)) = (view.fields, self.ground, &self.grid) else { return Ok(()) };
        if fields.is_empty() {
            return Ok(());
        }
        let named = OutputField::in_order(fields);
        let mut at_nodes: Vec<(usize, Vec<f64>)> = Vec::new();
        for field in &named {
            let found = (field.find)(&ground.at(all))?.expect("refused with the scene where there is none");
            at_nodes.push(nodal(&found, grid.degree));
        }
        let list: Vec<vtk::Field> = named
            .iter()
            .zip(&at_nodes)
            .map(|(field, (components, values))| vtk::Field { name: field.name, components: *components, values })
            .collect();
        let name = format!("fields/step-{step:06}.vtu");
        write_vtu(&self.out.join(&name), grid, view.t, &list)?;
        let series = self.series.as_mut().expect("opened with the grid");
        series.append(view.t, &name)?;
        if !self.cast.bodies.is_empty() {
            let parts = with_moment(&self.cast, view, |moment| self.bodies.parts(step, moment))?;
            series.append_parts(view.t, &parts)?;
        }
        self.last_fields = Some((step, named));
        Ok(())
    }

    /// Those of a step, or of the last state. Of that, long ones of a run that is stopped are left out, and named.
    fn write_cuts(
        &self,
        view: &View,
        cuts: &[Cut],
        step: Option<usize>,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<String>, RunError> {
        let (Some(fields), Some(ground)) = (view.fields, self.ground) else { return Ok(Vec::new()) };
        let mut left_out = Vec::new();
        let mut tables: Vec<(&Option<Vec<_>>, Table)> = Vec::new();
        for Cut { section, columns } in cuts {
            if tables.iter().all(|(of, _)| *of != columns) {
                tables.push((columns, Table::new(&ground.at(fields), columns.as_deref())?));
            }
            let (_, table) = tables.iter().find(|(of, _)| *of == columns).expect("made before");
            let name = section.name();
            let file = match step {
                Some(step) => format!("{name}-step-{step:06}.csv"),
                None => format!("{name}.csv"),
            };
            let may_wait = section.points() > QUICK;
            let is_whole =
                table.write(&self.out.join("cuts").join(file), section, ground, &|| may_wait && is_stopped())?;
            if !is_whole {
                left_out.push(name.to_owned());
            }
        }
        Ok(left_out)
    }

    /// Draws what was not drawn at this step yet.
    fn draw_maps(&mut self, view: &View, step: usize, requests: &[MapRequest]) -> Result<(), RunError> {
        if self.last_maps.0 != step {
            self.last_maps = (step, Vec::new());
        }
        for request in requests {
            if self.last_maps.1.contains(&request.name) {
                continue;
            }
            let path = self.bodies.picture_path(&request.name, step);
            let drawn = with_moment(&self.cast, view, |moment| match (request.of, view.fields, self.ground) {
                (Quantity::Bodies, ..) => self.draw_bodies(moment, request),
                (_, Some(fields), Some(ground)) => {
                    Draft::new(fields, ground, view.t).with_bodies(moment).draw(request, &self.plan.caption)
                }
                (_, _, _) => unreachable!("maps of fields are refused where there are none"),
            })?;
            drawn.write(&path).map_err(|error| maps::failed(&request.name, error))?;
            self.bodies.note_picture(&request.name, step, view.t)?;
            self.last_maps.1.push(request.name.clone());
        }
        Ok(())
    }

    fn draw_bodies(&self, moment: &Moment, request: &MapRequest) -> Result<Picture, RunError> {
        let failed = |error| maps::failed(&request.name, error);
        let own = request.window.map(|[low, high]| Window::new(low, high)).transpose();
        let window = own.map_err(failed)?.or(self.window);
        picture(moment, &Look { window, ..Look::default() }).map_err(failed)
    }
}

fn make_folder(path: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(path).map_err(|e| OutputError::io(path, &e))
}

fn open_history(plan: &Plan, stepper: &dyn Stepper, out: &Path, resume: Option<usize>) -> Result<History, OutputError> {
    let columns: Vec<String> =
        stepper.step_columns().iter().copied().chain(columns(plan.outputs, plan.tissue)).map(str::to_owned).collect();
    let path = out.join("history.csv");
    match resume {
        Some(step) if path.exists() => History::resume(&path, columns, step),
        Some(_) | None => History::create(&path, columns),
    }
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
