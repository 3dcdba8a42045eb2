//! The files of moving bodies, each on its schedule.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::saved::SavedMotion;
use super::{Mover, Plan, Row, Totals, draw, take};
use crate::measure::Measure;
use crate::measure::bodies::loads;
use crate::measure::list::Taken;
use crate::output::OutputError;
use crate::output::bodies::{BodyFiles, BodyOutputs, Look, Moment, Solids, picture, view};
use crate::output::history::History;
use crate::output::plot::map::Window;
use crate::output::pvd::Series;
use crate::run::RunError;
use crate::run::folder::Resumed;
use crate::run::maps::failed;
use crate::scene::{Field, MapRequest, Quantity, What, measured};
use crate::scheme::Schedule;

/// Columns of the history before the measures.
const STEP_COLUMNS: [&str; 4] = ["time", "dt", "iterations", "rejected"];

/// A run that is killed loses no more than this, whatever its scene asks for.
const PAUSE: Duration = Duration::from_secs(60);

pub(super) struct Files {
    out: PathBuf,
    history: History,
    bodies: Option<BodyFiles>,
    /// Of all pictures that name none, so that a film does not zoom.
    window: Option<Window>,
    series: Option<Series>,
    fields: Vec<(Vec<Field>, Schedule)>,
    measures: Vec<(Vec<&'static Measure>, Schedule)>,
    maps: Vec<(Vec<MapRequest>, Schedule)>,
    tables: Vec<Schedule>,
    checkpoints: Vec<Schedule>,
    /// Step and names of the last pictures, so that the last state is not drawn twice.
    drawn: (Option<usize>, Vec<String>),
    /// Step of the last fields.
    written: Option<usize>,
    last_checkpoint: Instant,
}

impl Files {
    pub fn new(plan: &Plan, out: &Path, resumed: Option<Resumed>) -> Result<Self, RunError> {
        let columns = measured(plan.outputs).into_iter().flat_map(Measure::column_names);
        let columns: Vec<String> = STEP_COLUMNS.into_iter().chain(columns).map(str::to_owned).collect();
        let path = out.join("history.csv");
        let history = match resumed {
            Some(resumed) if path.exists() => History::resume(&path, columns, resumed.step)?,
            Some(_) | None => History::create(&path, columns)?,
        };
        let mut files = Self {
            out: out.into(),
            history,
            bodies: None,
            window: None,
            series: None,
            fields: Vec::new(),
            measures: Vec::new(),
            maps: Vec::new(),
            tables: Vec::new(),
            checkpoints: Vec::new(),
            drawn: (None, Vec::new()),
            written: None,
            last_checkpoint: Instant::now(),
        };
        let mut want = BodyOutputs::default();
        for output in plan.outputs {
            match &output.what {
                What::Fields(fields) => files.fields.push((fields.clone(), output.schedule)),
                What::Measures(measures) => files.measures.push((measures.clone(), output.schedule)),
                What::Maps(maps) => {
                    want.pictures = true;
                    files.maps.push((maps.clone(), output.schedule));
                }
                What::Bodies { contacts } => {
                    want.bodies = true;
                    want.contacts |= contacts;
                    files.tables.push(output.schedule);
                }
                What::Checkpoint => files.checkpoints.push(output.schedule),
                What::Cuts(_) => {}
            }
        }
        let resume = resumed.map(|resumed| resumed.last_time());
        if !plan.bodies.is_empty() || want.pictures {
            let solids = Solids::new(plan.bodies, &plan.walls);
            files.window = first_view(plan, &solids)?;
            files.bodies = Some(BodyFiles::new(out, solids, want, resume)?);
        }
        if !files.fields.is_empty() {
            let folder = out.join("fields");
            std::fs::create_dir_all(&folder).map_err(|e| OutputError::io(&folder, &e))?;
            let index = out.join("fields.pvd");
            files.series = Some(match resume {
                Some(t) => Series::resume(&index, t)?,
                None => Series::create(&index)?,
            });
        }
        if let Some(resumed) = resumed {
            let requests = files.maps.iter().flat_map(|(requests, _)| requests);
            resumed.drop_later(out, &requests.map(|request| request.name.as_str()).collect::<Vec<_>>())?;
        }
        Ok(files)
    }

    /// Writes what is due after the step that began at `before`; `None` is the start.
    pub fn write_due(
        &mut self,
        mover: &mut dyn Mover,
        t: f64,
        step: usize,
        before: Option<f64>,
    ) -> Result<(), RunError> {
        let due = |s: &Schedule| match before {
            Some(before) => s.is_due(before, t, step),
            None => matches!(s, Schedule::Time(_) | Schedule::Steps(_)),
        };
        let fields: Vec<Field> =
            self.fields.iter().filter(|(_, s)| due(s)).flat_map(|(f, _)| f.iter().copied()).collect();
        let maps: Vec<MapRequest> =
            self.maps.iter().filter(|(_, s)| due(s)).flat_map(|(m, _)| m.iter().cloned()).collect();
        let tables = self.tables.iter().any(due);
        self.write(mover, t, step, &fields, &maps, tables)
    }

    /// Writes the last state in every form that the scene asks for.
    pub fn write_last(&mut self, mover: &mut dyn Mover, t: f64, step: usize) -> Result<(), RunError> {
        let mut fields: Vec<Field> = self.fields.iter().flat_map(|(f, _)| f.iter().copied()).collect();
        if self.written == Some(step) && self.fields.len() == 1 {
            fields.clear();
        }
        let maps: Vec<MapRequest> = self.maps.iter().flat_map(|(m, _)| m.iter().cloned()).collect();
        let tables = !self.tables.is_empty();
        self.write(mover, t, step, &fields, &maps, tables)
    }

    fn write(
        &mut self,
        mover: &mut dyn Mover,
        t: f64,
        step: usize,
        fields: &[Field],
        maps: &[MapRequest],
        tables: bool,
    ) -> Result<(), RunError> {
        if let (Some(series), false) = (&mut self.series, fields.is_empty()) {
            let named = Field::in_order(fields);
            let name = format!("fields/step-{step:06}.vtu");
            mover.write_fields(&self.out.join(&name), t, &named)?;
            series.append(t, &name)?;
            self.written = Some(step);
        }
        let Some(files) = &mut self.bodies else { return Ok(()) };
        if !tables && maps.is_empty() && (fields.is_empty() || self.series.is_none()) {
            return Ok(());
        }
        let solids = files.solids().clone();
        let (poses, twists, contacts) = (mover.poses(), mover.twists(), mover.contacts());
        let loads = loads(poses, contacts);
        let moment = Moment { solids: &solids, time: t, poses, twists, loads: &loads, contacts };
        let with_parts = !fields.is_empty() && !solids.bodies.is_empty();
        if let (Some(series), true) = (&mut self.series, with_parts) {
            series.append_parts(t, &files.parts(step, &moment)?)?;
        }
        if tables {
            files.write(step, &moment)?;
        }
        if self.drawn.0 != Some(step) {
            self.drawn = (Some(step), Vec::new());
        }
        for map in maps {
            if self.drawn.1.contains(&map.name) {
                continue;
            }
            let path = files.picture_path(&map.name, step);
            if map.of != Quantity::Bodies {
                let picture = draw(&*mover, &moment, map)?;
                picture.write(&path).map_err(|error| failed(&map.name, error))?;
                files.note_picture(&map.name, step, t)?;
                self.drawn.1.push(map.name.clone());
                continue;
            }
            let own = map.window.map(|[low, high]| Window::new(low, high)).transpose();
            let window = own.map_err(|error| failed(&map.name, error))?.or(self.window);
            let drawn = picture(&moment, &Look { window, ..Look::default() });
            drawn.and_then(|picture| picture.write(&path)).map_err(|error| failed(&map.name, error))?;
            files.note_picture(&map.name, step, t)?;
            self.drawn.1.push(map.name.clone());
        }
        Ok(())
    }

    pub(super) fn append_history(&mut self, plan: &Plan, mover: &dyn Mover, row: &Row) -> Result<(), RunError> {
        let due = |s: &Schedule| s.is_due(row.before, row.t, row.step);
        let mut measures = self.measures.iter().filter(|(_, s)| due(s)).flat_map(|(m, _)| m);
        let mut taken = Taken::default();
        measures.try_for_each(|measure| take(measure, plan, mover, &mut taken))?;
        let value = |column: &str| match column {
            "time" => Some(row.t),
            "dt" => Some(row.stride.dt),
            "rejected" => Some(row.stride.rejected as f64),
            "iterations" => Some(row.stride.iterations as f64),
            other => taken.values.get(other).copied(),
        };
        Ok(self.history.append(row.step, value)?)
    }

    pub fn write_checkpoint_if_due(
        &mut self,
        plan: &Plan,
        mover: &dyn Mover,
        (before, t): (f64, f64),
        totals: Totals,
    ) -> Result<(), RunError> {
        let due = self.checkpoints.iter().any(|s| s.is_due(before, t, totals.counts.steps));
        if due || self.last_checkpoint.elapsed() > PAUSE {
            self.write_checkpoint(plan, mover, t, totals)?;
        }
        Ok(())
    }

    pub fn write_checkpoint(&mut self, plan: &Plan, mover: &dyn Mover, t: f64, totals: Totals) -> Result<(), RunError> {
        let Totals { counts, overlap } = totals;
        let saved = SavedMotion::new(plan.text.clone(), plan.fingerprint, t, counts, overlap, mover.state());
        saved.write(&self.out.join("checkpoint.bin"))?;
        self.last_checkpoint = Instant::now();
        Ok(())
    }
}

/// The window of the bodies where the scene puts them; that of the first picture of a resumed run is the same.
fn first_view(plan: &Plan, solids: &Solids) -> Result<Option<Window>, RunError> {
    let poses: Vec<_> = plan.bodies.iter().map(|body| body.start).collect();
    let twists: Vec<_> = plan.bodies.iter().map(|body| body.start_twist).collect();
    let loads = loads(&poses, &[]);
    let moment = Moment { solids, time: 0.0, poses: &poses, twists: &twists, loads: &loads, contacts: &[] };
    view(&moment).map(Some).map_err(|error| failed("bodies", error))
}
