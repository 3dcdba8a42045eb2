//! Where branches fork: eigenvalues that cross the imaginary axis, and the branches that begin there.

use super::arclength::{Direction, correct};
use super::branch::{Point, Special, Station, Walk};
use super::pseudo::Stall;
use super::spectrum::{Mode, Spectrum, Stability};
use crate::solve::root;

/// A critical eigenvalue is located to this real part.
const CRITICAL: f64 = 1e-5;

/// Most trials to locate it.
const TRIALS: usize = 8;

/// A place where another branch begins.
#[derive(Debug)]
pub(super) struct Fork {
    pub station: Station,
    pub mode: Vec<f64>,
    /// Branch and point.
    pub parent: [usize; 2],
}

impl Walk<'_, '_> {
    /// Looks for an eigenvalue that crossed the imaginary axis between two stations, and for where.
    pub(super) fn between(&mut self, a: &Station, b: &Station, step: f64) -> Result<(), Stall> {
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
    pub(super) fn switch(&mut self, fork: &Fork) -> Result<(), Stall> {
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
        if sides.is_empty() {
            return Ok(());
        }
        self.curves += 1;
        for (place, corrections, s) in sides {
            let away = Direction { y: across.y.iter().map(|v| v * s.signum()).collect(), xi: 0.0 };
            let station = self.examine(place, Some(&away), corrections)?;
            self.branch(Some(fork.parent), station, self.settings.step)?;
        }
        Ok(())
    }

    /// Whether the last branch has come to a branch point other than its own.
    pub(super) fn joins(&self, station: &Station, step: f64) -> bool {
        let last = self.branches.last().expect("a branch is at work");
        if last.parent.is_none() {
            return false;
        }
        let model = match (self.family.model)(self.family.parameter(station.place.xi)) {
            Ok(model) => model,
            Err(_) => return false,
        };
        let near = |point: &Point| {
            let d = self.metric.between(&station.place, &point.place);
            root(self.metric.product(&*model, &d, &d)) < step
        };
        let forks = self.branches[..self.branches.len() - 1].iter().enumerate().flat_map(|(k, branch)| {
            let forking = |p: &Point| matches!(p.special, Some(Special::BranchPoint | Special::Pitchfork));
            branch.points.iter().enumerate().filter(move |(_, p)| forking(p)).map(move |(i, p)| ([k, i], p))
        });
        forks.into_iter().any(|(at, point)| Some(at) != last.parent && near(point))
    }
}

/// The mode of number `rank`, from 1, in the order of growth rates, of a pair each half counted: between two states of
/// which `rank` is the larger unstable dimension, its growth rate changes sign.
pub(super) fn critical(spectrum: &Spectrum, rank: usize) -> Option<&Mode> {
    let mut count = 0;
    spectrum.modes.iter().find(|mode| {
        count += if mode.value.im == 0.0 { 1 } else { 2 };
        count >= rank
    })
}
