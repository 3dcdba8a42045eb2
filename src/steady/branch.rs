//! Branches of steady states in one parameter: folds, pitchforks and Hopf points are found on the way, and branches that begin at
//! a pitchfork are followed, too.

use nalgebra::Complex;

use super::arclength::{Direction, Family, Metric, Place, correct, direction, slope};
use super::pseudo::{Stall, Work};
use super::spectrum::{Ask, Mode, Spectrum, Stability, spectrum};
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
    pub place: Place,
    pub parameter: f64,
    pub stability: Stability,
    pub unstable_dimension: usize,
    /// Leading eigenvalues, largest real part first.
    pub eigenvalues: Vec<Complex<f64>>,
    pub special: Option<Special>,
    /// Corrections that it took.
    pub corrections: usize,
}

/// A curve of steady states.
#[derive(Debug, Clone)]
pub struct Branch {
    /// Branch and point where it begins; none for those from the start.
    pub parent: Option<[usize; 2]>,
    pub points: Vec<Point>,
    /// Why it ends.
    pub end: String,
}

/// All that was followed.
#[derive(Debug, Clone)]
pub struct Followed {
    pub branches: Vec<Branch>,
    /// Stopped from outside: the branches are those so far.
    pub interrupted: bool,
}

/// How branches are followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BranchSettings {
    /// First step, as a share of the parameter's range.
    pub step: f64,
    /// Longest step.
    pub max_step: f64,
    /// Most points of a branch.
    pub max_points: usize,
    /// Most branches.
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

/// A critical eigenvalue is located to this real part.
const CRITICAL: f64 = 1e-5;

/// Most trials to locate it.
const TRIALS: usize = 8;

/// A place with all that the next step needs.
#[derive(Debug, Clone)]
struct Station {
    place: Place,
    ahead: Direction,
    spectrum: Spectrum,
    corrections: usize,
}

/// A place where another branch begins.
#[derive(Debug)]
struct Fork {
    station: Station,
    mode: Vec<f64>,
    /// Branch and point.
    parent: [usize; 2],
}

/// What a caller hears of every point: the number of its branch (from 0), the point, and its model.
pub type Seen<'s> = dyn FnMut(usize, &Point, &dyn Sheet) -> Result<(), Stall> + 's;

struct Walk<'w, 's> {
    family: &'w Family<'w>,
    metric: Metric,
    settings: &'w BranchSettings,
    work: Work<'w>,
    branches: Vec<Branch>,
    forks: Vec<Fork>,
    seen: &'w mut Seen<'s>,
}

/// Follows the branches through the `starts` both ways, and the branches that begin on them. A start that lies on a branch already
/// followed adds nothing.
///
/// # Errors
/// [`Stall::Interrupted`], or a start that cannot be continued; what ends a single branch is said there.
pub fn follow(
    family: &Family,
    starts: &[Place],
    settings: &BranchSettings,
    mut work: Work,
    seen: &mut Seen,
) -> Result<Followed, Stall> {
    let start = &starts[0];
    let first = slope(family, start, &mut work)?;
    let (along, model) = direction(family, start, &first, &mut work)?;
    // the change of what is carried over the whole range counts as much as the range; states that hardly change need no finer steps
    let size = |y: &[f64]| root(crate::solve::dot(y, &model.mass_times(y)));
    let least = LEAST_CHANGE * size(&model.carried(&start.state)).max(model.area().sqrt());
    let metric = Metric { scale: size(&along.y).max(least), residual: settings.residual };
    drop(model);
    let mut walk = Walk { family, metric, settings, work, branches: Vec::new(), forks: Vec::new(), seen };
    let interrupted = match walk.all(starts) {
        Ok(()) => false,
        Err(Stall::Interrupted) => true,
        Err(other) => return Err(other),
    };
    Ok(Followed { branches: walk.branches, interrupted })
}

impl Walk<'_, '_> {
    /// Both ways from every start, then from every fork.
    fn all(&mut self, starts: &[Place]) -> Result<(), Stall> {
        for start in starts {
            self.both_ways(start)?;
        }
        while !self.forks.is_empty() && self.branches.len() < self.settings.max_branches {
            let fork = self.forks.remove(0);
            self.switch(&fork)?;
        }
        Ok(())
    }

    fn both_ways(&mut self, start: &Place) -> Result<(), Stall> {
        if self.is_known(start)? {
            return Ok(());
        }
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

    /// Whether a branch already followed passes through a place : between two of its points the parameter is the place's, and they are
    /// no farther from it than from each other.
    fn is_known(&self, place: &Place) -> Result<bool, Stall> {
        let model = (self.family.model)(self.family.parameter(place.xi))?;
        let size = |a: &Place, b: &Place| {
            let d = Direction { xi: 0.0, ..self.metric.between(&*model, a, b) };
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
    fn examine(&mut self, place: Place, behind: Option<&Direction>, corrections: usize) -> Result<Station, Stall> {
        let slope = slope(self.family, &place, &mut self.work)?;
        let (along, model) = direction(self.family, &place, &slope, &mut self.work)?;
        let mut ahead = self.metric.unit(&*model, along);
        if behind.is_some_and(|behind| self.metric.product(&*model, &ahead, behind) < 0.0) {
            ahead.y.iter_mut().for_each(|v| *v = -*v);
            ahead.xi = -ahead.xi;
        }
        // half of the price of a point; where a branch begins they are searched for
        let ask = Ask { wanted: self.settings.eigenvalues, growing_suffices: false, fast: behind.is_none() };
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
    fn push(&mut self, station: &Station, special: Option<Special>) -> Result<[usize; 2], Stall> {
        let point = self.point(station, special);
        let model = (self.family.model)(point.parameter)?;
        let index = self.branches.len() - 1;
        (self.seen)(index, &point, &*model)?;
        let points = &mut self.branches[index].points;
        points.push(point);
        Ok([index, points.len() - 1])
    }

    /// Follows one branch from a station to its end.
    fn branch(&mut self, parent: Option<[usize; 2]>, first: Station, step: f64) -> Result<(), Stall> {
        self.branches.push(Branch { parent, points: Vec::new(), end: String::new() });
        let (mut here, mut step) = (first, step);
        self.push(&here, None)?;
        let end = loop {
            if self.branches.last().is_some_and(|b| b.points.len() >= self.settings.max_points) {
                break format!("{} points were taken", self.settings.max_points);
            }
            if step < SHORTEST * self.settings.step {
                break "no step is short enough".to_owned();
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
                break "it joins another branch".to_owned();
            }
            if next.place.xi <= 1e-9 || next.place.xi >= 1.0 - 1e-9 {
                break "the end of the parameter's range".to_owned();
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

    /// Looks for an eigenvalue that crossed the imaginary axis between two stations, and for where.
    fn between(&mut self, a: &Station, b: &Station, step: f64) -> Result<(), Stall> {
        let turns = a.ahead.xi * b.ahead.xi < 0.0;
        let (da, db) = (a.spectrum.unstable_dimension(), b.spectrum.unstable_dimension());
        let known = |s: &Station| s.spectrum.stability() != Stability::NotKnown;
        if da == db || !known(a) || !known(b) {
            return Ok(());
        }
        let rank = da.max(db);
        let (Some(first), Some(last)) = (critical(&a.spectrum, rank), critical(&b.spectrum, rank)) else {
            return Ok(());
        };
        let found = self.locate(a, step, [first.value.re, last.value.re], rank)?;
        let (station, mode) = match found {
            Some(found) => found,
            // not located: the nearer of the two stands for it
            None if first.value.re.abs() < last.value.re.abs() => (a.clone(), first.clone()),
            None => (b.clone(), last.clone()),
        };
        let special = match (mode.value.im != 0.0, turns) {
            (true, _) => Special::Hopf,
            (false, true) => Special::Fold,
            (false, false) => Special::BranchPoint,
        };
        let at = self.push(&station, Some(special))?;
        if special == Special::BranchPoint {
            self.forks.push(Fork { station, mode: mode.vector[0].clone(), parent: at });
        }
        Ok(())
    }

    /// Where the real part of the critical eigenvalue vanishes, by the Illinois variant of regula falsi.
    fn locate(
        &mut self,
        a: &Station,
        step: f64,
        ends: [f64; 2],
        rank: usize,
    ) -> Result<Option<(Station, Mode)>, Stall> {
        if ends[0] * ends[1] > 0.0 {
            return Ok(None);
        }
        let (mut low, mut high) = ((0.0, ends[0]), (step, ends[1]));
        let mut best: Option<(Station, Mode)> = None;
        for _ in 0..TRIALS {
            let s = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let found = correct(self.family, &self.metric, &a.place, &a.ahead, s, &mut self.work);
            let station = match found {
                Ok((place, corrections)) => self.examine(place, Some(&a.ahead), corrections)?,
                Err(Stall::Interrupted) => return Err(Stall::Interrupted),
                Err(_) => break,
            };
            let Some(mode) = critical(&station.spectrum, rank).cloned() else { break };
            let g = mode.value.re;
            if best.as_ref().is_none_or(|(_, b)| g.abs() < b.value.re.abs()) {
                best = Some((station, mode));
            }
            if g.abs() < CRITICAL {
                break;
            }
            if g * high.1 < 0.0 {
                low = high;
            } else {
                low.1 *= 0.5;
            }
            high = (s, g);
        }
        Ok(best)
    }

    /// Steps from a branch point along its mode, both ways, and follows what is found.
    fn switch(&mut self, fork: &Fork) -> Result<(), Stall> {
        let model = (self.family.model)(self.family.parameter(fork.station.place.xi))?;
        let across = self.metric.unit(&*model, Direction { y: fork.mode.clone(), xi: 0.0 });
        drop(model);
        let mut sides = Vec::new();
        for side in [1.0, -1.0] {
            let mut s = side * self.settings.step;
            for _ in 0..4 {
                let base = &fork.station;
                let found = correct(self.family, &self.metric, &base.place, &across, s, &mut self.work);
                match found {
                    Ok((place, corrections)) => {
                        sides.push((place, corrections, s));
                        break;
                    }
                    Err(Stall::Interrupted) => return Err(Stall::Interrupted),
                    Err(_) => s *= 0.5,
                }
            }
        }
        let xi = fork.station.place.xi;
        let shifts: Vec<f64> = sides.iter().map(|(place, ..)| place.xi - xi).collect();
        let mirrored = match shifts[..] {
            [a, b] => sides[0].2 == -sides[1].2 && (a - b).abs() < 0.05 * (a.abs() + b.abs()),
            _ => false,
        };
        if mirrored {
            let [branch, point] = fork.parent;
            self.branches[branch].points[point].special = Some(Special::Pitchfork);
            sides.truncate(1);
        }
        for (place, corrections, s) in sides {
            let away = Direction { y: across.y.iter().map(|v| v * s.signum()).collect(), xi: 0.0 };
            let station = self.examine(place, Some(&away), corrections)?;
            if self.branches.len() < self.settings.max_branches {
                self.branch(Some(fork.parent), station, self.settings.step)?;
            }
        }
        Ok(())
    }

    /// Whether the last branch has come to a branch point other than its own.
    fn joins(&self, station: &Station, step: f64) -> bool {
        let last = self.branches.last().expect("a branch is at work");
        if last.parent.is_none() {
            return false;
        }
        let model = match (self.family.model)(self.family.parameter(station.place.xi)) {
            Ok(model) => model,
            Err(_) => return false,
        };
        let near = |point: &Point| {
            let d = self.metric.between(&*model, &station.place, &point.place);
            root(self.metric.product(&*model, &d, &d)) < step
        };
        let forks = self.branches[..self.branches.len() - 1].iter().enumerate().flat_map(|(k, branch)| {
            let forking = |p: &Point| matches!(p.special, Some(Special::BranchPoint | Special::Pitchfork));
            branch.points.iter().enumerate().filter(move |(_, p)| forking(p)).map(move |(i, p)| ([k, i], p))
        });
        forks.into_iter().any(|(at, point)| Some(at) != last.parent && near(point))
    }
}

/// The mode of number `rank`, from 1, in the order of growth rates, of a pair each half counted: between two states of which `rank` is
/// the larger unstable dimension, its growth rate changes sign.
fn critical(spectrum: &Spectrum, rank: usize) -> Option<&Mode> {
    let mut count = 0;
    spectrum.modes.iter().find(|mode| {
        count += if mode.value.im == 0.0 { 1 } else { 2 };
        count >= rank
    })
}
