//! Branches of steady states: the diagram of a measure over a parameter, stable and unstable parts, and special points.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::StudyError;
use super::branch_file::{BranchStudy, ParameterScale};
use super::table::{refuse_occupied, write_rows, write_study};
use crate::output::lock::{self, Room};
use crate::output::plot::{Line, Markers, Plot, Scale, Series, Symbol, if_drawn};
use crate::output::progress::{Progress, Verbosity};
use crate::output::{OutputError, number as number_of};
use crate::results::names;
use crate::run::measures::Gauges;
use crate::run::stake::Stake;
use crate::run::{RunError, Setup, setup};
use crate::solve::{dot, root};
use crate::steady::arclength::{Family, Place};
use crate::steady::branch::{Branch, Followed, Point, Special, follow};
use crate::steady::pseudo::Work;
use crate::steady::{Event, Found, Stability, Stall, SteadySettings, Want, find};
use crate::time::memory::Memory;
use crate::time::{Phases, Sheet, StepFailure};

/// What a study of branches found.
#[derive(Debug)]
pub struct Diagram {
    /// Both directions of each branch.
    pub branches: Vec<Branch>,
    /// Measures of every point, by direction; a point that was inserted between others has its measures here as well.
    pub measures: Vec<Vec<BTreeMap<&'static str, f64>>>,
    /// Branches that begin and were not followed, for there are `max_branches`.
    pub left: usize,
    /// Wall seconds that it took.
    pub seconds: f64,
    /// Whether somebody stopped it.
    pub interrupted: bool,
    /// Why the state to which the instability of the first one leads begins no branch.
    pub refused: Option<String>,
    /// What ended it before all was followed.
    pub broken: Option<String>,
}

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
    let start = base.model.carried(&base.start(&scene)?.state);
    write_study(&study.text(), out)?;
    let progress = Progress::new(verbosity, 0.0);
    for remark in base.remarks(&scene) {
        progress.say(&format!("note: {remark}"));
    }
    let gauges = Gauges::new(&scene, &base)?;
    let settings = scene.steady.expect("the study asks for steady states");
    let (residual, eigenvalues) = (settings.residual, settings.eigenvalues.max(1));
    let mut seen = |event: Event| -> Result<(), Stall> {
        if let Event::Note(text) = event {
            progress.say(&format!("note: {text}"));
        }
        Ok(())
    };
    let xi = position(study, study.start);
    let mut phases = Phases::default();
    // the first steady state, and where its instability leads
    let mut starts = Vec::new();
    for want in [Want::Any, Want::Stable] {
        let search = match want {
            Want::Any => SteadySettings { want, eigenvalues: 0, ..settings },
            // where this leads nowhere, the forks of the first branch may lead there
            Want::Stable => SteadySettings { want, eigenvalues, march: 0.0, ..settings },
        };
        let from = starts.last().map_or_else(|| start.clone(), |place: &Place| base.model.carried(&place.state));
        let found = find(&*base.model, from, &search, scene.march(), interrupt, &mut phases, &mut seen)
            .map_err(|stall| no_start(study, &stall.to_string()))?;
        let state = match (found.found, want) {
            (Found::Steady(steady), _) => steady.state,
            (Found::Interrupted, _) => return Err(no_start(study, "stopped from outside")),
            (Found::Oscillating { .. }, Want::Any) => return Err(no_start(study, "the flow oscillates there")),
            (Found::Nothing, Want::Any) => return Err(no_start(study, "no steady state was found there")),
            (Found::Oscillating { .. } | Found::Nothing, Want::Stable) => continue,
        };
        let place = Place { xi, state };
        if starts.iter().all(|other: &Place| differ(&*base.model, other, &place)) {
            starts.push(place);
        }
    }
    let model = |value: f64| {
        let scene = study.scene_at(value).map_err(|error| outside(&error))?;
        let description = setup::describe(&scene, &base.mesh);
        let changed = base.model.changed(&description.parameters, &description.conditions, &description.sources);
        changed.map_err(|error| Stall::Failed(error.into()))
    };
    let family = Family { model: &model, range: study.range, logarithmic: study.scale == ParameterScale::Log };
    let mut measures: Vec<Vec<BTreeMap<&'static str, f64>>> = Vec::new();
    let mut broken: Option<RunError> = None;
    let told = |branch: usize, point: &Point, value: f64| {
        progress.say(&format!(
            "branch {}  {} = {:.5}  {} = {:.5}  {}{}  {:.0} s",
            branch + 1,
            study.parameter,
            point.parameter,
            study.measure,
            value,
            words(point),
            point.special.map_or_else(String::new, |special| format!("  {}", special.name())),
            begin.elapsed().as_secs_f64()
        ));
    };
    let mut take = |[branch, curve]: [usize; 2], point: &Point, model: &dyn Sheet| {
        if measures.len() <= branch {
            measures.resize_with(branch + 1, Vec::new);
        }
        match gauges.at_rest(model, &point.place.state) {
            Ok(values) => {
                told(curve, point, values.get(study.measure.as_str()).copied().unwrap_or(f64::NAN));
                measures[branch].push(values);
                Ok(())
            }
            Err(error) => {
                broken = Some(error);
                Err(Stall::Interrupted)
            }
        }
    };
    let mut memory = Memory::default();
    let work = Work { memory: &mut memory, phases: &mut phases, interrupt };
    let settings = crate::steady::branch::BranchSettings { residual, eigenvalues, ..study.settings };
    let _stake = Stake::new();
    let outcome = follow(&family, &starts, &settings, work, &mut take);
    if let Some(error) = broken {
        return Err(error.into());
    }
    let followed = outcome.map_err(|stall| no_direction(study, &stall))?;
    progress.finish();
    let seconds = begin.elapsed().as_secs_f64();
    let Followed { branches, left, interrupted, refused, broken } = followed;
    let [refused, broken] = [refused, broken].map(|stall| stall.map(|stall| no_direction(study, &stall).to_string()));
    let diagram = Diagram { branches, measures, left, seconds, interrupted, refused, broken };
    diagram.write(study, out)?;
    Ok(diagram)
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
    let [a, b] = [a, b].map(|place| model.carried(&place.state));
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
                  meet or turn back, or one of many beside each other, as where nothing fixes the direction of the polarity";
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

impl Special {
    /// As in the table.
    pub fn name(self) -> &'static str {
        match self {
            Special::Fold => "fold",
            Special::Pitchfork => "pitchfork",
            Special::BranchPoint => "branch-point",
            Special::Hopf => "hopf",
        }
    }
}

impl Diagram {
    fn write(&self, study: &BranchStudy, out: &Path) -> Result<(), StudyError> {
        write_rows(&out.join("branches.csv"), &self.rows())?;
        let plot = self.plot(study);
        if_drawn(plot.write(&out.join("branches"))).map_err(|error| OutputError::Malformed {
            path: out.join("branches.svg").display().to_string(),
            what: error.to_string(),
            hint: "the table beside it is complete",
        })?;
        Ok(())
    }

    /// The directions of each branch.
    fn curves(&self) -> Vec<Vec<usize>> {
        let count = self.branches.iter().map(|branch| branch.curve + 1).max().unwrap_or(0);
        let of = |curve: usize| (0..self.branches.len()).filter(|b| self.branches[*b].curve == curve).collect();
        (0..count).map(of).collect()
    }

    /// Direction and number of every point of a branch, from one of its ends to the other.
    fn along(&self, directions: &[usize]) -> Vec<[usize; 2]> {
        let points = |b: usize| {
            let count = self.branches[b].points.len().min(self.measures.get(b).map_or(0, Vec::len));
            (0..count).map(move |k| [b, k])
        };
        match *directions {
            [back, ahead] => {
                // both begin at the start; of a branch that crosses another each begins beside the crossing
                let twice = usize::from(self.branches[ahead].parent.is_none());
                points(back).rev().chain(points(ahead).skip(twice)).collect()
            }
            _ => directions.iter().flat_map(|b| points(*b)).collect(),
        }
    }

    /// One row per point.
    fn rows(&self) -> Vec<Vec<String>> {
        let known = self.measures.iter().flatten().flat_map(BTreeMap::keys);
        let columns: std::collections::BTreeSet<&str> = known.copied().collect();
        let head = ["branch", "from", "point", "parameter", "stability", "unstable_dimension", "special"];
        let tail = ["growth", "frequency", "corrections"];
        let mut rows = vec![head.into_iter().chain(columns.iter().copied()).chain(tail).map(String::from).collect()];
        for (curve, directions) in self.curves().iter().enumerate() {
            for (number, [b, k]) in self.along(directions).into_iter().enumerate() {
                let (branch, point) = (&self.branches[b], &self.branches[b].points[k]);
                let values = &self.measures[b][k];
                let from = branch.parent.map_or_else(String::new, |[b, _]| (self.branches[b].curve + 1).to_string());
                let leading = point.eigenvalues.first();
                let mut row = vec![(curve + 1).to_string(), from, (number + 1).to_string(), number_of(point.parameter)];
                row.extend([point.stability.name().to_owned(), point.unstable_dimension.to_string()]);
                row.push(point.special.map_or_else(String::new, |special| special.name().to_owned()));
                row.extend(columns.iter().map(|c| values.get(c).map_or_else(String::new, |v| number_of(*v))));
                row.push(leading.map_or_else(String::new, |l| number_of(l.re)));
                row.push(leading.map_or_else(String::new, |l| number_of(l.im)));
                row.push(point.corrections.to_string());
                rows.push(row);
            }
        }
        rows
    }

    /// The measure over the parameter: stable parts solid, unstable ones dashed, special points marked.
    fn plot(&self, study: &BranchStudy) -> Plot {
        let scale = match study.scale {
            ParameterScale::Linear => Scale::Linear,
            ParameterScale::Log => Scale::Log,
        };
        let (x, y) = (names::axis(&study.parameter, scale), names::axis(&study.measure, Scale::Linear));
        let mut series = Vec::new();
        for (branch, measures) in self.branches.iter().zip(&self.measures) {
            let colour = usize::from(branch.parent.is_some());
            let at = |k: usize| {
                let value = measures.get(k).and_then(|m| m.get(study.measure.as_str()));
                (branch.points[k].parameter, value.copied().unwrap_or(f64::NAN))
            };
            let stable = |k: usize| branch.points[k].stability == Stability::Stable;
            let count = branch.points.len().min(measures.len());
            // a branch point belongs to both of its sides
            let origin = branch.parent.and_then(|[b, k]| {
                let value = self.measures.get(b)?.get(k)?.get(study.measure.as_str())?;
                Some((self.branches[b].points[k].parameter, *value))
            });
            let mut part: Vec<(f64, f64)> = origin.into_iter().collect();
            for k in 0..count {
                part.push(at(k));
                let special = branch.points[k].special.is_some();
                let ends = k + 1 == count || special || stable(k) != stable(k + 1);
                if ends {
                    let solid = if special && k + 1 < count && k > 0 { stable(k - 1) } else { stable(k) };
                    let (name, line) = if solid { ("stable", Line::Solid) } else { ("unstable", Line::Dashed) };
                    let points = std::mem::take(&mut part);
                    series.push(Series {
                        name: name.into(),
                        points,
                        line,
                        markers: Markers::None,
                        colour: Some(colour),
                    });
                    part.push(at(k));
                }
            }
        }
        series.extend(self.special_points(study));
        let title = study
            .title
            .clone()
            .unwrap_or_else(|| format!("branches of steady states in {}", names::words(&study.parameter)));
        let cells = format!("range {} to {}", number_of(study.range[0]), number_of(study.range[1]));
        Plot { title, subtitle: cells, x, y, series, slopes: Vec::new() }
    }

    fn special_points(&self, study: &BranchStudy) -> Vec<Series> {
        let kinds = [
            (Special::Pitchfork, Symbol::Circle),
            (Special::Fold, Symbol::Square),
            (Special::Hopf, Symbol::Triangle),
            (Special::BranchPoint, Symbol::Diamond),
        ];
        let of_kind = |(kind, symbol): (Special, Symbol)| {
            let all = self.branches.iter().zip(&self.measures).flat_map(|(b, m)| b.points.iter().zip(m));
            let points: Vec<(f64, f64)> = all
                .filter(|(point, _)| point.special == Some(kind))
                .filter_map(|(point, m)| Some((point.parameter, *m.get(study.measure.as_str())?)))
                .collect();
            let (name, line) = (kind.name().replace('-', " "), Line::None);
            let markers = Markers::Open(symbol);
            (!points.is_empty()).then_some(Series { name, points, line, markers, colour: Some(2) })
        };
        kinds.into_iter().filter_map(of_kind).collect()
    }
}

impl std::fmt::Display for Diagram {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let plural = |count: usize, one: &str, many: &str| format!("{count} {}", if count == 1 { one } else { many });
        let curves = self.curves();
        let along: Vec<Vec<[usize; 2]>> = curves.iter().map(|directions| self.along(directions)).collect();
        let points: usize = along.iter().map(Vec::len).sum();
        let branches = plural(curves.len(), "branch", "branches");
        write!(out, "{branches}, {}, {:.1} s", plural(points, "point", "points"), self.seconds)?;
        for (k, (directions, along)) in curves.iter().zip(&along).enumerate() {
            write!(out, "\nbranch {}:", k + 1)?;
            for (at, b) in directions.iter().enumerate() {
                let branch = &self.branches[*b];
                let [first, last] =
                    [branch.points.first(), branch.points.last()].map(|p| p.map_or(f64::NAN, |p| p.parameter));
                let and = if at > 0 { ";" } else { "" };
                write!(out, "{and} from {first:.5} to {last:.5}, ended: {}", branch.end)?;
            }
            for [b, at] in along {
                let point = &self.branches[*b].points[*at];
                if let Some(special) = point.special {
                    write!(out, "\n  {} at {:.5}", special.name(), point.parameter)?;
                }
            }
        }
        if self.left > 0 {
            let others = plural(self.left, "branch that begins was", "branches that begin were");
            write!(out, "\nnote: {others} not followed: a larger `max_branches` allows it")?;
        }
        if let Some(why) = &self.refused {
            write!(out, "\nnote: of the other steady state that was found at the start, {why}")?;
        }
        Ok(())
    }
}
