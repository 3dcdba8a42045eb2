//! One step of contact: rows from touches, projection of the velocities, and poses without overlap.
//!
//! Rows follow the gaps to the end of the step, `D(x + Δt W) ≥ η`, where the kinetic energy does not rise by that; gaps
//! of shapes that turn are not convex, and to leave an overlap by a velocity would give energy. There velocities obey
//! `G·W ≥ −max(D−η, 0)/Δt`, for which rest is admissible, and the poses are [repaired](super::repair).

use super::bonds::Bond;
use super::gap::Touch;
use super::mobility::{Failed, InFlow};
use super::mover::{Freedom, Mover, range};
use super::outcome::holds;
use super::pairs::{self, Pair, Pairs};
use super::projection::{Problem, Projection, Row};
use super::rough::Slide;
use super::solver::{Effort, Metric, Projected, Shown, Solver, partner_name, rounding};
use super::walls::{equivalent_radius, resistance};
use super::{ContactError, Partner};
use crate::mesh::Point;
use crate::shape::{Pose, Twist};
use crate::solve::anderson::Anderson;

/// Rounds of one step, and searches for pairs.
const ROUNDS: usize = 150;
const SEARCHES: usize = 40;

/// A touch with its row.
pub(super) struct Near {
    pub(super) pair: Pair,
    pub(super) touch: Touch,
    pub(super) row: Row,
    /// R of the lubrication.
    pub(super) resistance: f64,
    /// The multiplier to start from.
    pub(super) warm: f64,
    /// Whether the row follows the true gap at the end of the step rather than its tangent.
    pub(super) followed: bool,
    /// What slides there; `None` without friction.
    pub(super) slide: Option<Box<Slide>>,
    /// Whether others have struck the pair together.
    pub(super) struck: bool,
    /// Where it touches after the last projection, of rows that are no tangents.
    pub(super) after: Option<Touch>,
}

pub(super) struct Step<'a> {
    pub(super) solver: &'a Solver,
    pub(super) movers: &'a [Mover<'a>],
    pub(super) dt: f64,
    pub(super) metric_of: Metric<'a>,
    /// The flow around the bodies, where contact acts on it.
    pub(super) flow: Option<InFlow<'a>>,
    /// Force per multiplier.
    pub(super) unit: f64,
    /// First unknown of each body.
    pub(super) unknowns: Vec<usize>,
    pub(super) metric: Vec<f64>,
    pub(super) target: Vec<f64>,
    reach: Vec<f64>,
    pub(super) near: Vec<Near>,
    pub(super) solution: Projection,
    pub(super) effort: Effort,
    /// Bodies whose rows do not follow the gaps.
    pub(super) tangent: Vec<bool>,
    /// e of every body.
    pub(super) restitution: Vec<f64>,
    /// The fixed point of friction, and how many touches it is of.
    pub(super) dilations: (usize, Anderson),
    /// Why gaps could not be followed.
    pub(super) failure: Option<ContactError>,
}

impl<'a> Step<'a> {
    pub(super) fn new(solver: &'a Solver, movers: &'a [Mover<'a>], dt: f64, metric: Metric<'a>) -> Self {
        let flow = match metric {
            Metric::Mass | Metric::Resistance => None,
            Metric::Mobility(metric) => Some(InFlow::new(movers, metric)),
        };
        let (mut unknowns, mut metric_values, mut target) = (Vec::new(), Vec::new(), Vec::new());
        for mover in movers {
            unknowns.push(target.len());
            let Twist { velocity, spin } = mover.predicted;
            match mover.freedom {
                Freedom::Free { mass, inertia } => {
                    metric_values.extend([mass, mass]);
                    target.extend([velocity.x, velocity.y]);
                    // without friction contact does not turn what is round
                    if solver.settings.friction > 0.0 || flow.is_some() || !mover.shape.is_round() {
                        metric_values.push(inertia);
                        target.push(spin);
                    }
                }
                Freedom::Pinned { inertia, .. } => {
                    metric_values.push(inertia);
                    target.push(spin);
                }
                Freedom::Given { .. } => {}
            }
        }
        let reach = movers.iter().map(|m| match m.freedom {
            Freedom::Free { .. } | Freedom::Pinned { .. } => {
                2.0 * m.travel(&m.predicted, dt) + 1e-2 * m.shape.circumradius()
            }
            Freedom::Given { .. } => m.travel(&Twist::ZERO, dt),
        });
        let reach = reach.collect();
        let unit = match metric {
            Metric::Mass => 1.0,
            Metric::Resistance | Metric::Mobility(_) => dt,
        };
        let (near, solution, effort) = (Vec::new(), Projection::default(), Effort::default());
        let (metric, metric_of) = (metric_values, metric);
        let (tangent, restitution, failure) = (vec![false; movers.len()], Vec::new(), None);
        let mut step = Self {
            solver,
            movers,
            dt,
            metric_of,
            flow,
            unit,
            unknowns,
            metric,
            target,
            reach,
            near,
            solution,
            effort,
            tangent,
            restitution,
            dilations: (0, Anderson::new(0)),
            failure,
        };
        step.restitution = step.restitutions();
        // a jammed crowd that rubs can always rest on tangents, while its gaps may be closed by rounding
        step.tangent = step.restitution.iter().map(|e| *e > 0.0 || solver.settings.friction > 0.0).collect();
        step
    }

    /// Searches, projects, and searches farther when a body became faster than was thought.
    pub(super) fn solve(&mut self, shown: Shown) -> Result<Projected, ContactError> {
        for _ in 0..SEARCHES {
            let pairs = self.search()?;
            self.refuse_leaps(&pairs)?;
            self.rounds(&pairs.pushed)?;
            let twists = self.twists();
            if !self.are_within_reach(&twists) {
                continue;
            }
            self.near.iter().try_for_each(|near| self.refuse_leap(near.pair, &near.touch, &twists))?;
            let repaired = match self.repair(&pairs.pushed, &twists) {
                Ok(repaired) => repaired,
                Err(error) => return Err(self.failure.take().unwrap_or(error)),
            };
            if repaired.pushes.is_empty() || self.are_within_reach(&self.twists_to(&repaired.poses)) {
                return Ok(self.projected(twists, repaired, &pairs.given, shown));
            }
        }
        let fastest = (0..self.movers.len()).fold(0, |a, b| if self.reach[b] > self.reach[a] { b } else { a });
        Err(self.caught(fastest, "everything".into(), f64::INFINITY))
    }

    /// Whether no body goes farther than pairs were looked for; if one does, its reach grows.
    fn are_within_reach(&mut self, twists: &[Twist]) -> bool {
        let mut enough = true;
        for (k, mover) in self.movers.iter().enumerate() {
            let travel = mover.travel(&twists[k], self.dt);
            if travel > self.reach[k] {
                (self.reach[k], enough) = (2.0 * travel, false);
            }
        }
        enough
    }

    /// Pairs within reach, and the rows of their touches.
    fn search(&mut self) -> Result<Pairs, ContactError> {
        let margin = self.solver.settings.margin;
        let ranges: Vec<_> = self.movers.iter().zip(&self.reach).map(|(m, reach)| range(m, reach + margin)).collect();
        let pairs = pairs::find(&ranges, self.solver.walls.all());
        let (mut found, mut shared) = (Vec::new(), Vec::new());
        let before = std::mem::take(&mut self.near);
        let mut bonds = self.solver.bonds.in_order();
        self.near.reserve(pairs.pushed.len());
        for &pair in &pairs.pushed {
            let reach = margin + self.pair_reach(pair);
            found.clear();
            self.solver.touches(self.movers, pair, |k| self.movers[k].pose, reach, &mut found);
            // a gap that is not a number must not pass for a wide one
            found.retain(|touch| touch.gap <= reach || touch.gap.is_nan());
            bonds.share(pair, &found, &mut shared);
            for (touch, bond) in found.iter().zip(&shared) {
                self.solver.refuse_overlap(self.movers, pair, touch)?;
                let mut near = self.near(pair, *touch, *bond);
                // the search before may have been nearly far enough
                let first = before.partition_point(|n| n.pair < pair);
                let mut of_pair = before[first..].iter().take_while(|n| n.pair == pair);
                near.warm = of_pair.find(|n| n.touch.slot == touch.slot).map_or(near.warm, |n| n.warm);
                self.near.push(near);
            }
        }
        self.effort.pairs = pairs.pushed.len();
        Ok(pairs)
    }

    pub(super) fn pair_reach(&self, Pair { body, partner }: Pair) -> f64 {
        self.reach[body]
            + match partner {
                Partner::Body(other) => self.reach[other],
                Partner::Wall(_) => 0.0,
            }
    }

    fn near(&self, pair: Pair, touch: Touch, bond: Bond) -> Near {
        let radius = equivalent_radius(self.movers[pair.body].shape);
        let resistance = match pair.partner {
            Partner::Body(other) => {
                let other = equivalent_radius(self.movers[other].shape);
                ((radius + other) / (radius * other)).powi(2)
            }
            Partner::Wall(index) => resistance(radius, &self.solver.walls.all()[index]),
        };
        let pose = |k: usize| self.movers[k].pose;
        let entries = self.entries(pair, &touch, &pose).into_iter().map(|(k, b)| (k, self.dt * b)).collect();
        let mut row = Row { entries, offset: self.offset(pair, &touch, false), ..Row::default() };
        row.bound = bond.gamma / (resistance * self.dt * self.unit);
        row.slack = self.slack(pair);
        let warm = row.bound + bond.multiplier;
        let slide = self.slide(pair, &touch);
        Near { pair, touch, row, resistance, warm, followed: false, slide, struck: false, after: None }
    }

    /// `D − η`, at least 0 where the row is a tangent, or what bodies that bounce have in its place; and what bodies of
    /// given motion add.
    pub(super) fn offset(&self, pair: Pair, touch: &Touch, struck: bool) -> f64 {
        let gap = touch.gap - self.solver.settings.margin;
        let gap = if self.is_tangent(pair) { gap.max(0.0) } else { gap };
        let pose = |k: usize| self.movers[k].pose;
        let given = self.given_of(Self::gradients(pair, touch, &pose));
        self.rebound(pair, touch, struck).unwrap_or(gap) + self.dt * given
    }

    /// Projects until the gaps at the end of the step are what the rows say, but for those that are tangents, and until
    /// friction has settled. The pair that keeps it from that.
    pub(super) fn follow_gaps(&mut self, pairs: &[Pair]) -> Result<(), (Pair, ContactError)> {
        for round in 0..ROUNDS {
            self.project(round == 0)?;
            let (missed, unsettled) = (self.follow(pairs), self.renew_dilations(round));
            match (missed, unsettled) {
                (None, None) => return Ok(()),
                (Some((pair, miss)), _) if round + 1 == ROUNDS => {
                    return Err((pair, self.caught(pair.body, partner_name(self.movers, pair.partner), miss)));
                }
                (None, Some((pair, miss))) if round + 1 == ROUNDS => return Err((pair, self.unsettled(pair, miss))),
                (_, _) => {}
            }
        }
        Ok(())
    }

    /// Projects the predicted velocities.
    fn project(&mut self, may_be_known: bool) -> Result<(), (Pair, ContactError)> {
        let friction = self.solver.settings.friction;
        let rows = self.near.iter_mut().flat_map(|near| near.lend_rows(friction)).collect();
        let (metric, target) = (self.metric.clone(), self.target.clone());
        let problem = Problem { metric, target, rows, tolerance: self.solver.settings.tolerance };
        let warm: Vec<f64> = self.near.iter().flat_map(|near| near.warm_rows(friction)).collect();
        let each = if friction > 0.0 { 2 } else { 1 };
        let method = self.solver.settings.method;
        let solved = match (self.kept(&problem, &warm).filter(|_| may_be_known), &mut self.flow) {
            (Some(kept), _) => Ok(kept),
            (None, None) => problem.solve(method, &warm).map_err(Failed::Rows),
            (None, Some(flow)) => flow.project(&problem, method, &warm),
        };
        if friction == 0.0 {
            self.near.iter_mut().zip(problem.rows).for_each(|(near, row)| near.row = row);
        }
        let solution = solved.map_err(|failed| {
            let unsolved = match failed {
                Failed::Rows(unsolved) => unsolved,
                Failed::Flow(reason) => return (self.near[0].pair, ContactError::Flow { reason }),
            };
            let near = &self.near[unsolved.row / each];
            let miss = unsolved.excess * near.row.slack;
            let first = self.movers[near.pair.body].name.to_owned();
            let second = partner_name(self.movers, near.pair.partner);
            let iterations = unsolved.iterations;
            let error = match friction {
                0.0 => ContactError::Caught { first, second, miss, iterations, hint: self.hint() },
                _ => self.unsettled(near.pair, miss),
            };
            (near.pair, error)
        })?;
        self.effort.iterations += solution.iterations;
        self.effort.factorisations += solution.factorisations;
        self.effort.rounds += 1;
        self.effort.rows = self.near.len();
        for (near, of_rows) in self.near.iter_mut().zip(solution.multipliers.chunks(each)) {
            let [normal, sliding] = near.multipliers(friction, of_rows);
            near.warm = normal;
            near.slide.iter_mut().for_each(|slide| slide.multiplier = sliding);
        }
        let multipliers = self.near.iter().map(|near| near.warm).collect();
        self.solution = Projection { multipliers, ..solution };
        Ok(())
    }

    /// What a search that was not far enough found, when it keeps the rows of the farther pairs too.
    fn kept(&self, problem: &Problem, warm: &[f64]) -> Option<Projection> {
        let velocity = &self.solution.velocity;
        if velocity.len() != problem.target.len() || problem.worst(velocity, warm).1 > 1.0 {
            return None;
        }
        Some(Projection { velocity: velocity.clone(), multipliers: warm.to_vec(), ..Projection::default() })
    }

    /// Compares the rows with the gaps at the end of the step, and moves those that a gap misses: the direction of
    /// their force stays. The worst miss, when there is one.
    fn follow(&mut self, pairs: &[Pair]) -> Option<(Pair, f64)> {
        let twists = self.twists();
        let poses: Vec<Pose> =
            self.movers.iter().zip(&twists).map(|(mover, twist)| mover.after(twist, self.dt)).collect();
        let margin = self.solver.settings.margin;
        let mut worst: Option<(Pair, f64)> = None;
        let mut new = Vec::new();
        let (mut found, mut start) = (Vec::new(), 0);
        for &pair in pairs {
            let count = self.near[start..].iter().take_while(|n| n.pair == pair).count();
            if self.is_tangent(pair) {
                start += count;
                continue;
            }
            found.clear();
            let reach = margin + self.pair_reach(pair);
            self.solver.touches(self.movers, pair, |k| poses[k], reach, &mut found);
            self.near[start..start + count].iter_mut().for_each(|near| near.after = None);
            let slack = self.slack(pair);
            let mut note = |miss: f64| {
                if miss > 4.0 * slack && worst.is_none_or(|(_, most)| miss > most) {
                    worst = Some((pair, miss));
                }
            };
            for touch in &found {
                let true_value = touch.gap - margin;
                note(-true_value);
                let known = self.near[start..start + count].iter_mut().find(|near| near.touch.slot == touch.slot);
                let Some(near) = known else {
                    if true_value < -4.0 * slack {
                        new.push((pair, *touch, true_value));
                    }
                    continue;
                };
                let held = holds(self.solver.settings.law, near, near.warm);
                if held {
                    note(true_value.abs());
                }
                let miss = if held { true_value.abs() } else { -true_value };
                near.followed |= miss > 4.0 * slack;
                near.after = Some(*touch);
                if near.followed {
                    near.row.offset += true_value - near.row.value(&self.solution.velocity);
                }
            }
            start += count;
        }
        for (pair, touch, true_value) in new {
            let mut near = self.near(pair, touch, Bond::default());
            near.row.offset = true_value - near.row.times(&self.solution.velocity);
            let at = self.near.partition_point(|n| n.pair <= pair);
            self.near.insert(at, near);
        }
        worst
    }

    /// What a gap may miss.
    pub(super) fn slack(&self, pair: Pair) -> f64 {
        self.solver.settings.tolerance * self.solver.size(self.movers, pair) + rounding(self.movers, pair)
    }

    /// The twists that the projection found.
    fn twists(&self) -> Vec<Twist> {
        let free = self.twists_of(&self.solution.velocity, |_, mover| mover.predicted.spin);
        self.movers.iter().zip(free).map(|(mover, twist)| mover.whole(&twist, self.dt)).collect()
    }

    /// Values of the unknowns, body by body, and the spins of bodies that contact cannot turn.
    pub(super) fn twists_of(&self, u: &[f64], unturned: impl Fn(usize, &Mover) -> f64) -> Vec<Twist> {
        let twist = |(k, mover): (usize, &Mover)| {
            let first = self.unknowns[k];
            match mover.freedom {
                Freedom::Free { .. } => Twist {
                    velocity: Point::new(u[first], u[first + 1]),
                    spin: if self.turns(k) { u[first + 2] } else { unturned(k, mover) },
                },
                Freedom::Pinned { .. } => Twist { spin: u[first], ..Twist::ZERO },
                Freedom::Given { .. } => Twist::ZERO,
            }
        };
        self.movers.iter().enumerate().map(twist).collect()
    }

    /// The twists that lead straight to poses.
    pub(super) fn twists_to(&self, poses: &[Pose]) -> Vec<Twist> {
        let to = |(mover, pose): (&Mover, &Pose)| Twist {
            velocity: (pose.position - mover.pose.position) / self.dt,
            spin: (pose.angle - mover.pose.angle) / self.dt,
        };
        self.movers.iter().zip(poses).map(to).collect()
    }
}
