//! Branches of steady states: the diagram of a measure over a parameter, stable and unstable parts, and special points.

mod diagram;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::StudyError;
use super::branch_file::{BranchStudy, ParameterScale};
use super::table::{refuse_occupied, write_study};
use crate::model::State;
use crate::output::lock::{self, Room};
use crate::output::progress::{Progress, Verbosity};
use crate::run::measures::Gauges;
use crate::run::unsaved::UnsavedWork;
use crate::run::{RunError, Setup, setup};
use crate::scene::Scene;
use crate::solve::{dot, root};
use crate::steady::arclength::{Family, Place};
use crate::steady::branch::{BranchSettings, Followed, Point, follow};
use crate::steady::pseudo::Work;
use crate::steady::{Event, Found, SearchSettings, Stability, Stall, SteadySettings, Want, find};
use crate::time::kept_factors::KeptFactors;
use crate::time::{Phases, Sheet, StepFailure};

pub use diagram::Diagram;

/// Names of what a study of branches leaves.
const NAMES: [&str; 4] = ["study.toml", "branches.csv", "branches.svg", "branches.png"];

/// Finds a steady state at the study's start and follows its branches; table and diagram are written to `out`.
///
/// # Errors
/// A scene that cannot be set up, no steady state at the start, results that cannot be written.
pub fn run(
    study: &BranchStudy,
    out: &Path,
    verbosity: Verbosity,
    interrupt: &AtomicBool,
) -> Result<Diagram, StudyError> {
    lock::alone(out, Room::Without(&NAMES), || find_and_follow(study, out, verbosity, interrupt))
}

fn find_and_follow(
    study: &BranchStudy,
    out: &Path,
    verbosity: Verbosity,
    interrupt: &AtomicBool,
) -> Result<Diagram, StudyError> {
    refuse_occupied(out)?;
    let begin = Instant::now();
    let scene = study.scene_at(study.start)?;
    let base = Setup::new(&scene)?;
    let start = base.start(&scene)?.state.carried();
    write_study(&study.text(), out)?;
    let progress = Progress::new(verbosity, 0.0);
    for remark in base.remarks(&scene) {
        progress.say(&format!("note: {remark}"));
    }
    let gauges = Gauges::new(&base.plan(&scene), Some(&base.ground))?;
    let mut record = Record { study, gauges: &gauges, progress: &progress, begin, measures: Vec::new(), broken: None };
    let survey = Survey { study, scene: &scene, base: &base, progress: &progress, interrupt };
    let mut phases = Phases::default();
    let starts = survey.starts(start, &mut phases)?;
    let followed = survey.follow(&starts, &mut phases, &mut record)?;
    progress.finish();
    let seconds = begin.elapsed().as_secs_f64();
    let Followed { branches, left, interrupted, refused, broken } = followed;
    let [refused, broken] = [refused, broken].map(|stall| stall.map(|stall| no_direction(study, &stall).to_string()));
    let diagram = Diagram { branches, measures: record.measures, left, seconds, interrupted, refused, broken };
    diagram.write(study, out)?;
    Ok(diagram)
}

/// The search for the first steady states of a study, and for their branches.
struct Survey<'s> {
    study: &'s BranchStudy,
    /// The scene at the study's start, and what was set up for it.
    scene: &'s Scene,
    base: &'s Setup,
    progress: &'s Progress,
    interrupt: &'s AtomicBool,
}

impl Survey<'_> {
    /// How steady states are searched for, with at least one eigenvalue.
    fn settings(&self) -> SteadySettings {
        let settings = self.scene.steady.expect("the study asks for steady states");
        SteadySettings { eigenvalues: settings.eigenvalues.max(1), ..settings }
    }

    /// The first steady state that is found from the carried vector `start`, and where its instability leads.
    fn starts(&self, start: Vec<f64>, phases: &mut Phases) -> Result<Vec<Place>, StudyError> {
        let (model, xi) = (&*self.base.model, position(self.study, self.study.start));
        let mut starts: Vec<Place> = Vec::new();
        for want in [Want::Any, Want::Stable] {
            let from = starts.last().map_or_else(|| start.clone(), |place| place.state.carried());
            let Some(state) = self.steady_state(want, from, phases)? else { continue };
            let place = Place { xi, state };
            if starts.iter().all(|other| differ(model, other, &place)) {
                starts.push(place);
            }
        }
        Ok(starts)
    }

    /// The steady state that is wanted, from a carried vector; `None` where there is no stable one.
    fn steady_state(&self, want: Want, from: Vec<f64>, phases: &mut Phases) -> Result<Option<State>, StudyError> {
        let steady = match want {
            Want::Any => SteadySettings { want, eigenvalues: 0, ..self.settings() },
            // where this leads nowhere, the forks of the first branch may lead there
            Want::Stable => SteadySettings { want, march: 0.0, ..self.settings() },
        };
        let mut seen = |event: Event| -> Result<(), Stall> {
            if let Event::Note(text) = event {
                self.progress.say(&format!("note: {text}"));
            }
            Ok(())
        };
        let settings = SearchSettings { steady, marching: self.scene.march() };
        let search = find(&*self.base.model, from, &settings, self.interrupt, phases, &mut seen)
            .map_err(|stall| no_start(self.study, &stall.to_string()))?;
        let nothing = |reason| Err(no_start(self.study, reason));
        match (search.found, want) {
            (Found::Steady(steady), _) => Ok(Some(steady.state)),
            (Found::Interrupted, _) => nothing("stopped from outside"),
            (Found::Oscillating { .. }, Want::Any) => nothing("the flow oscillates there"),
            (Found::Nothing, Want::Any) => nothing("no steady state was found there"),
            (Found::Oscillating { .. } | Found::Nothing, Want::Stable) => Ok(None),
        }
    }

    /// The model at a value of the parameter.
    fn model_at(&self, value: f64) -> Result<Box<dyn Sheet>, Stall> {
        let scene = self.study.scene_at(value).map_err(|error| outside(&error))?;
        let description = setup::describe(&scene, &self.base.ground.mesh);
        let changed = self.base.model.changed(&description.parameters, &description.conditions, &description.sources);
        changed.map_err(|error| Stall::Failed(error.into()))
    }

    /// Follows the branches from some places.
    fn follow(&self, starts: &[Place], phases: &mut Phases, record: &mut Record) -> Result<Followed, StudyError> {
        let SteadySettings { residual, eigenvalues, .. } = self.settings();
        let settings = BranchSettings { residual, eigenvalues, ..self.study.settings };
        let model = |value: f64| self.model_at(value);
        let logarithmic = self.study.scale == ParameterScale::Log;
        let family = Family { model: &model, range: self.study.range, logarithmic };
        let work = Work { kept: &mut KeptFactors::default(), phases, interrupt: self.interrupt };
        let _unsaved = UnsavedWork::new();
        let outcome = follow(&family, starts, &settings, work, &mut |at, point, model| record.take(at, point, model));
        match record.broken.take() {
            Some(error) => Err(error.into()),
            None => outcome.map_err(|stall| no_direction(self.study, &stall)),
        }
    }
}

/// The measures of all points that were reached; each point is told.
struct Record<'s> {
    study: &'s BranchStudy,
    gauges: &'s Gauges<'s>,
    progress: &'s Progress,
    begin: Instant,
    /// By direction and point.
    measures: Vec<Vec<BTreeMap<&'static str, f64>>>,
    /// What could not be measured.
    broken: Option<RunError>,
}

impl Record<'_> {
    fn take(&mut self, [branch, curve]: [usize; 2], point: &Point, model: &dyn Sheet) -> Result<(), Stall> {
        if self.measures.len() <= branch {
            self.measures.resize_with(branch + 1, Vec::new);
        }
        match self.gauges.at_rest(model, &point.place.state) {
            Ok(values) => {
                self.tell(curve, point, values.get(self.study.measure.as_str()).copied().unwrap_or(f64::NAN));
                self.measures[branch].push(values);
                Ok(())
            }
            Err(error) => {
                self.broken = Some(error);
                Err(Stall::Interrupted)
            }
        }
    }

    fn tell(&self, curve: usize, point: &Point, value: f64) {
        self.progress.say(&format!(
            "branch {}  {} = {:.5}  {} = {:.5}  {}{}  {:.0} s",
            curve + 1,
            self.study.parameter,
            point.parameter,
            self.study.measure,
            value,
            words(point),
            point.special.map_or_else(String::new, |special| format!("  {}", special.name())),
            self.begin.elapsed().as_secs_f64()
        ));
    }
}

/// ξ of a value of the parameter.
fn position(study: &BranchStudy, value: f64) -> f64 {
    let [a, b] = study.range;
    match study.scale {
        ParameterScale::Linear => (value - a) / (b - a),
        ParameterScale::Log => (value / a).ln() / (b / a).ln(),
    }
}

/// Whether two states of one parameter are not the same.
fn differ(model: &dyn Sheet, a: &Place, b: &Place) -> bool {
    let [a, b] = [a, b].map(|place| place.state.carried());
    let d: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let size = root(dot(&d, &model.mass_times(&d)));
    size > 1e-4 * root(dot(&a, &model.mass_times(&a)))
}

fn no_start(study: &BranchStudy, reason: &str) -> StudyError {
    let hint = "choose another `start`, where `monolayer run --steady` finds a state";
    StudyError::NoBranch { parameter: study.parameter.clone(), start: study.start, reason: reason.to_owned(), hint }
}

/// A steady state that has no direction in which a branch goes on: the derivative of its equations is singular.
fn no_direction(study: &BranchStudy, stall: &Stall) -> StudyError {
    let Stall::Failed(StepFailure::Polarity(_)) = stall else { return no_start(study, &stall.to_string()) };
    let reason = "a steady state was found, but its equations have a singular derivative: it is a point where branches \
                  meet or turn back, or one of many beside each other, as where nothing fixes the direction of the \
                  polarity";
    let hint = "choose another `start`; where every start says so, give the polarity at an inlet or a wall";
    StudyError::NoBranch { parameter: study.parameter.clone(), start: study.start, reason: reason.to_owned(), hint }
}

/// A scene that is refused somewhere on the way ends the branch there.
fn outside(error: &StudyError) -> Stall {
    Stall::Step { dt: 0.0, residual: 0.0, cause: error.to_string() }
}

/// Stability in a word or two.
fn words(point: &Point) -> String {
    match point.stability {
        Stability::Stable => "stable".into(),
        Stability::Unstable => format!("unstable ({})", point.unstable_dimension),
        Stability::NotKnown => "stability not known".into(),
    }
}
