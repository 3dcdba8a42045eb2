//! Branches of steady states in one parameter: folds, pitchforks and Hopf points are found on the way, and branches
//! that begin at a pitchfork are followed, too.

use nalgebra::Complex;

use super::arclength::{Direction, Family, Metric, Place, correct, direction, slope};
use super::fork::{Fork, critical};
use super::pseudo::{Stall, Work};
use super::spectrum::{Spectrum, SpectrumSettings, Stability, spectrum};
use crate::solve::root;
use crate::time::Sheet;

/// What happens at a point of a branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Special {
    /// The branch turns back.
    Fold,
    /// Two states, images of each other, branch off on one side of the parameter: a symmetry is broken.
    Pitchfork,
    /// Another branch crosses; what it is was not found out.
    BranchPoint,
    /// A pair of complex eigenvalues crosses the imaginary axis: an oscillation begins.
    Hopf,
}

/// A steady state of a branch.
#[derive(Debug, Clone)]
pub struct Point {
    /// Parameter and state.
    pub place: Place,
    /// The parameter as the scene has it.
    pub parameter: f64,
    /// What small disturbances do.
    pub stability: Stability,
    /// Number of modes that grow.
    pub unstable_dimension: usize,
    /// Leading eigenvalues, largest real part first.
    pub eigenvalues: Vec<Complex<f64>>,
    /// What happens here.
    pub special: Option<Special>,
    /// Corrections that it took.
    pub corrections: usize,
}

/// One direction of a branch, which is a curve of steady states.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Number of the branch, from 0: both directions from a start have the same, and both from a point where another
    /// one crosses.
    pub curve: usize,
    /// Place among all directions, and point, where it begins; none for those from the start.
    pub parent: Option<[usize; 2]>,
    /// In the order in which they were found.
    pub points: Vec<Point>,
    /// Why it ends.
    pub end: End,
}

/// Why a branch is not followed any further.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// It has as many points as it may have.
    Points(usize),
    /// No step is short enough.
    Step,
    /// It comes to a point where branches cross.
    Joins,
    /// The end of the parameter's range.
    Range,
    /// Stopped from outside.
    Interrupted,
}

impl std::fmt::Display for End {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            End::Points(n) => {
                write!(out, "{n} points were taken, as many as it may have: a larger `max_points` leads further")
            }
            End::Step => out.write_str("no step is short enough"),
            End::Joins => out.write_str("it joins another branch"),
            End::Range => out.write_str("the end of the parameter's range"),
            End::Interrupted => out.write_str("stopped from outside"),
        }
    }
}

/// All that was followed.
#[derive(Debug, Clone)]
pub struct Followed {
    /// In the order in which they were begun.
    pub branches: Vec<Branch>,
    /// Branches that were seen to begin, and not followed because there are enough.
    pub left: usize,
    /// Stopped from outside: the branches are those so far.
    pub interrupted: bool,
    /// Why another start begins no branch.
    pub refused: Option<Stall>,
    /// What ended all of it: the branches are those so far.
    pub broken: Option<Stall>,
}

/// How branches are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BranchSettings {
    /// First step, as a share of the parameter's range.
    pub step: f64,
    /// Longest step.
    pub max_step: f64,
    /// Most points of a branch in each direction.
    pub max_points: usize,
    /// Most branches, each with both its directions.
    pub max_branches: usize,
    /// Bound on the residual of the stationary equations.
    pub residual: f64,
    /// Eigenvalues to find at every point.
    pub eigenvalues: usize,
}

/// Share of the polarity that counts as much as the whole range, where the first branch changes less.
const LEAST_CHANGE: f64 = 0.1;

/// Shortest step, as a share of the first one.
const SHORTEST: f64 = 1e-3;

/// The cosine between the directions of successive points is at least this.
const STRAIGHT: f64 = 0.8;

/// A place with all that the next step needs.
#[derive(Debug, Clone)]
pub(super) struct Station {
    pub place: Place,
    pub ahead: Direction,
    pub spectrum: Spectrum,
    pub corrections: usize,
}

/// What a caller hears of every point: the place of its direction among all and the number of its branch (from 0), the
/// point, and its model.
pub type BodiesAtTime<'s> = dyn FnMut([usize; 2], &Point, &dyn Sheet) -> Result<(), Stall> + 's;

pub(super) struct Walk<'w, 's> {
    pub family: &'w Family<'w>,
    pub metric: Metric,
    pub settings: &'w BranchSettings,
    pub work: Work<'w>,
    pub branches: Vec<Branch>,
    /// Number of branches, whose directions these are.
    pub curves: usize,
    pub forks: Vec<Fork>,
    /// Branches that begin and are not followed.
    pub left: usize,
    /// Why a later start begins no branch.
    refused: Option<Stall>,
    seen: &'w mut BodiesAtTime<'s>,
}

/// Follows the branches through the `starts` both ways, and the branches that begin on them. A start that lies on a
/// branch already followed adds nothing.
///
/// # Errors
/// [`Stall::Interrupted`], or a start that cannot be continued; what ends a single branch is said there.
pub fn follow(
    family: &Family,
    starts: &[Place],
    settings: &BranchSettings,
    mut work: Work,
    seen: &mut BodiesAtTime,
) -> Result<Followed, Stall> {
    let start = &starts[0];
    let first = slope(family, start, &mut work)?;
    let (along, model) = direction(family, start, &first, true, &mut work)?;
    // the change of what is carried over the whole range counts as much as the range; states that hardly change need no
    // finer steps
    let size = |y: &[f64]| root(crate::solve::dot(y, &model.mass_times(y)));
    let least = LEAST_CHANGE * size(&start.state.carried()).max(model.area().sqrt());
    let metric = Metric { scale: size(&along.y).max(least), residual: settings.residual };
    drop(model);
    let (branches, forks) = (Vec::new(), Vec::new());
    let mut walk = Walk { family, metric, settings, work, branches, curves: 0, forks, left: 0, refused: None, seen };
    let (interrupted, broken) = match walk.all(starts) {
        Ok(()) => (false, None),
        Err(Stall::Interrupted) => (true, None),
        // what was followed must not be lost
        Err(other) if walk.branches.iter().any(|branch| !branch.points.is_empty()) => (false, Some(other)),
        Err(other) => return Err(other),
    };
    let left = walk.left + walk.forks.len();
    Ok(Followed { left, branches: walk.branches, interrupted, refused: walk.refused, broken })
}

impl Walk<'_, '_> {
    /// Both ways from every start, then from every fork.
    fn all(&mut self, starts: &[Place]) -> Result<(), Stall> {
        for (at, start) in starts.iter().enumerate() {
            match self.both_ways(start) {
                Err(stall) if at > 0 && !matches!(stall, Stall::Interrupted) => {
                    self.curves = self.branches.last().map_or(0, |branch| branch.curve + 1);
                    self.refused = Some(stall);
                }
                other => other?,
            }
        }
        while !self.forks.is_empty() && self.may_begin() {
            let fork = self.forks.remove(0);
            self.switch(&fork)?;
        }
        Ok(())
    }

    /// Whether another branch may be followed.
    fn may_begin(&self) -> bool {
        self.curves < self.settings.max_branches
    }

    fn both_ways(&mut self, start: &Place) -> Result<(), Stall> {
        if self.is_known(start)? {
            return Ok(());
        }
        if !self.may_begin() {
            self.left += 1;
            return Ok(());
        }
        self.curves += 1;
        for side in [-1.0, 1.0] {
            let mut station = self.examine(start.clone(), None, 0)?;
            station.ahead.y.iter_mut().for_each(|v| *v *= side);
            station.ahead.xi *= side;
            let leaves = if side < 0.0 { start.xi > 1e-9 } else { start.xi < 1.0 - 1e-9 };
            if leaves {
                self.branch(None, station, self.settings.step)?;
            }
        }
        Ok(())
    }

    /// Whether a branch already followed passes through a place : between two of its points the parameter is the
    /// place's, and they are no farther from it than from each other.
    fn is_known(&self, place: &Place) -> Result<bool, Stall> {
        let model = (self.family.model)(self.family.parameter(place.xi))?;
        let size = |a: &Place, b: &Place| {
            let d = Direction { xi: 0.0, ..self.metric.between(a, b) };
            root(self.metric.product(&*model, &d, &d))
        };
        let pairs = self.branches.iter().flat_map(|branch| branch.points.windows(2));
        let mut around = pairs.filter(|pair| {
            let (a, b) = (pair[0].place.xi, pair[1].place.xi);
            a.min(b) - 1e-12 <= place.xi && place.xi <= a.max(b) + 1e-12
        });
        Ok(around.any(|pair| {
            let [a, b] = [&pair[0].place, &pair[1].place];
            let (here, gap) = (size(a, place).min(size(b, place)), size(a, b));
            here <= gap
        }))
    }

    /// Direction and eigenvalues at a place; the direction continues `behind`, or goes to growing ξ.
    pub(super) fn examine(
        &mut self,
        place: Place,
        behind: Option<&Direction>,
        corrections: usize,
    ) -> Result<Station, Stall> {
        let slope = slope(self.family, &place, &mut self.work)?;
        let (along, model) = direction(self.family, &place, &slope, behind.is_none(), &mut self.work)?;
        let mut ahead = self.metric.unit(&*model, along);
        if behind.is_some_and(|behind| self.metric.product(&*model, &ahead, behind) < 0.0) {
            ahead.y.iter_mut().for_each(|v| *v = -*v);
            ahead.xi = -ahead.xi;
        }
        // half of the price of a point; where a branch begins they are searched for
        let ask =
            SpectrumSettings { wanted: self.settings.eigenvalues, growing_suffices: false, fast: behind.is_none() };
        let spectrum = spectrum(&*model, &place.state, ask, &mut self.work)?;
        Ok(Station { place, ahead, spectrum, corrections })
    }

    fn point(&self, station: &Station, special: Option<Special>) -> Point {
        let spectrum = &station.spectrum;
        Point {
            place: station.place.clone(),
            parameter: self.family.parameter(station.place.xi),
            stability: spectrum.stability(),
            unstable_dimension: spectrum.unstable_dimension(),
            eigenvalues: spectrum.modes.iter().map(|mode| mode.value).collect(),
            special,
            corrections: station.corrections,
        }
    }

    /// Books a point of the last branch.
    pub(super) fn push(&mut self, station: &Station, special: Option<Special>) -> Result<[usize; 2], Stall> {
        let point = self.point(station, special);
        let model = (self.family.model)(point.parameter)?;
        let index = self.branches.len() - 1;
        (self.seen)([index, self.branches[index].curve], &point, &*model)?;
        let points = &mut self.branches[index].points;
        points.push(point);
        Ok([index, points.len() - 1])
    }

    /// Follows the newest branch in one direction from a station to its end.
    pub(super) fn branch(&mut self, parent: Option<[usize; 2]>, first: Station, step: f64) -> Result<(), Stall> {
        let curve = self.curves - 1;
        self.branches.push(Branch { curve, parent, points: Vec::new(), end: End::Interrupted });
        let (mut here, mut step) = (first, step);
        self.push(&here, None)?;
        let end = loop {
            if self.branches.last().is_some_and(|b| b.points.len() >= self.settings.max_points) {
                break End::Points(self.settings.max_points);
            }
            if step < SHORTEST * self.settings.step {
                break End::Step;
            }
            let next = match self.advance(&here, step) {
                Ok(next) => next,
                Err(Stall::Interrupted) => return Err(Stall::Interrupted),
                Err(Stall::Step { .. } | Stall::Steps { .. }) => {
                    step *= 0.5;
                    continue;
                }
                Err(Stall::Failed(failure)) if failure.may_be_cured_by_a_smaller_step() => {
                    step *= 0.5;
                    continue;
                }
                Err(other) => return Err(other),
            };
            let jump = next.spectrum.unstable_dimension().abs_diff(here.spectrum.unstable_dimension());
            if jump > 2 && step > SHORTEST * self.settings.step {
                step *= 0.5;
                continue;
            }
            // two real eigenvalues, which a shorter step may tell apart
            let rank = next.spectrum.unstable_dimension().max(here.spectrum.unstable_dimension());
            let is_pair = critical(&next.spectrum, rank).is_none_or(|mode| mode.value.im != 0.0);
            if jump == 2 && !is_pair && step > 0.1 * self.settings.step {
                step *= 0.5;
                continue;
            }
            self.between(&here, &next, step)?;
            self.push(&next, None)?;
            if self.joins(&next, step) {
                break End::Joins;
            }
            if next.place.xi <= 1e-9 || next.place.xi >= 1.0 - 1e-9 {
                break End::Range;
            }
            step = match next.corrections {
                0..=4 => 1.5 * step,
                5..=6 => step,
                _ => 0.7 * step,
            }
            .min(self.settings.max_step);
            here = next;
        };
        self.branches.last_mut().expect("pushed above").end = end;
        Ok(())
    }

    /// The next station, on the bound of the range where the step would leave it.
    fn advance(&mut self, here: &Station, step: f64) -> Result<Station, Stall> {
        let within = |xi: f64| (0.0..=1.0).contains(&xi);
        let guess = here.place.xi + step * here.ahead.xi;
        // there may be no tissue beyond the range: nothing is looked for there
        let free = if within(guess) {
            Some(correct(self.family, &self.metric, &here.place, &here.ahead, step, &mut self.work)?)
        } else {
            None
        };
        let (place, corrections) = match free {
            Some((place, corrections)) if within(place.xi) => (place, corrections),
            other => {
                let bound = other.map_or(guess, |(place, _)| place.xi).clamp(0.0, 1.0);
                let upright = Direction { y: vec![0.0; here.ahead.y.len()], xi: 1.0 };
                let left = bound - here.place.xi;
                let (mut place, more) =
                    correct(self.family, &self.metric, &here.place, &upright, left, &mut self.work)?;
                place.xi = bound;
                (place, more)
            }
        };
        let next = self.examine(place, Some(&here.ahead), corrections)?;
        let model = (self.family.model)(self.family.parameter(next.place.xi))?;
        let straight = self.metric.product(&*model, &here.ahead, &next.ahead);
        if straight < STRAIGHT && step > 0.1 * self.settings.step {
            let cause = "the branch turns too sharply".to_owned();
            return Err(Stall::Step { dt: step, residual: 0.0, cause });
        }
        Ok(next)
    }
}
