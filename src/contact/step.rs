//! One step of contact: rows from touches, projection, and the rounds that make gaps exact at the end of the step.

use super::bonds::{Bond, Bonds, Key};
use super::gap::{Touch, along};
use super::pairs::{self, Pair, Pairs};
use super::projection::{Problem, Projection, Row};
use super::solver::{Effort, Freedom, Metric, Mover, Projected, Solver, partner_name, range, rounding};
use super::walls::{equivalent_radius, resistance};
use super::{Contact, ContactError, Law, Partner};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, perpendicular, turned};

/// Rounds of one step, and searches for pairs.
const ROUNDS: usize = 150;
const SEARCHES: usize = 40;

/// Masses that differ by more cannot be told from held bodies.
const CONTRAST: f64 = 1e12;

/// A touch with its row.
pub(super) struct Near {
    pub(super) pair: Pair,
    pub(super) touch: Touch,
    row: Row,
    /// R of the lubrication.
    resistance: f64,
    /// The multiplier to start from.
    warm: f64,
    /// Whether the row follows the true gap at the end of the step rather than its tangent.
    followed: bool,
}

pub(super) struct Step<'a> {
    pub(super) solver: &'a Solver,
    pub(super) movers: &'a [Mover<'a>],
    pub(super) dt: f64,
    /// Force per multiplier.
    unit: f64,
    /// First unknown of each body.
    unknowns: Vec<usize>,
    metric: Vec<f64>,
    target: Vec<f64>,
    reach: Vec<f64>,
    pub(super) near: Vec<Near>,
    solution: Projection,
    effort: Effort,
}

impl<'a> Step<'a> {
    pub(super) fn new(solver: &'a Solver, movers: &'a [Mover<'a>], dt: f64, metric: Metric) -> Self {
        let (mut unknowns, mut metric_of, mut target) = (Vec::new(), Vec::new(), Vec::new());
        for mover in movers {
            unknowns.push(target.len());
            let Twist { velocity, spin } = mover.predicted;
            match mover.freedom {
                Freedom::Free { mass, inertia } => {
                    metric_of.extend([mass, mass]);
                    target.extend([velocity.x, velocity.y]);
                    // contact does not turn what is round
                    if !mover.shape.is_round() {
                        metric_of.push(inertia);
                        target.push(spin);
                    }
                }
                Freedom::Pinned { inertia, .. } => {
                    metric_of.push(inertia);
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
            Metric::Resistance => dt,
        };
        let (near, solution, effort) = (Vec::new(), Projection::default(), Effort::default());
        Self { solver, movers, dt, unit, unknowns, metric: metric_of, target, reach, near, solution, effort }
    }

    /// Searches, projects, and searches farther when a body became faster than was thought.
    pub(super) fn solve(&mut self) -> Result<Projected, ContactError> {
        for _ in 0..SEARCHES {
            let pairs = self.search()?;
            self.refuse_leaps(&pairs)?;
            self.rounds(&pairs.pushed)?;
            let mut enough = true;
            let twists = self.twists();
            for (k, mover) in self.movers.iter().enumerate() {
                let travel = mover.travel(&twists[k], self.dt);
                if travel > self.reach[k] {
                    (self.reach[k], enough) = (2.0 * travel, false);
                }
            }
            if enough {
                self.near.iter().try_for_each(|near| self.refuse_leap(near.pair, &near.touch, &twists))?;
                return Ok(self.projected(&twists, &pairs.given));
            }
        }
        let fastest = (0..self.movers.len()).fold(0, |a, b| if self.reach[b] > self.reach[a] { b } else { a });
        Err(self.caught(fastest, "everything".into(), f64::INFINITY))
    }

    fn caught(&self, body: usize, second: String, miss: f64) -> ContactError {
        let first = self.movers[body].name.to_owned();
        ContactError::Caught { first, second, miss, iterations: self.effort.iterations, hint: self.hint() }
    }

    /// What to do about bodies that cannot move.
    fn hint(&self) -> String {
        let near = self.near.iter().flat_map(|near| {
            let other = match near.pair.partner {
                Partner::Body(other) => Some(other),
                Partner::Wall(_) => None,
            };
            std::iter::once(near.pair.body).chain(other)
        });
        let weights = near.filter_map(|k| match self.movers[k].freedom {
            Freedom::Free { mass, .. } => Some((mass, k)),
            Freedom::Pinned { .. } | Freedom::Given { .. } => None,
        });
        let mut by_weight: Vec<(f64, usize)> = weights.collect();
        by_weight.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let (Some(light), Some(heavy)) = (by_weight.first(), by_weight.last())
            && heavy.0 > CONTRAST * light.0
        {
            let [light_name, heavy_name] = [light.1, heavy.1].map(|k| self.movers[k].name);
            return format!(
                "\"{heavy_name}\" is {:.0e} times as heavy as \"{light_name}\", and contact between them drowns in \
                 rounding: take densities that differ less, or hold the heavy body",
                heavy.0 / light.0
            );
        }
        let margin = self.solver.settings.margin;
        if self.near.iter().any(|near| near.touch.gap < 0.5 * margin) {
            return format!(
                "there may be no room for gaps of `contact.margin` = {margin}: take a smaller one, or a smaller step"
            );
        }
        "a body may be caught between moving obstacles or walls; or take a smaller step".into()
    }

    /// Pairs within reach, and the rows of their touches.
    fn search(&mut self) -> Result<Pairs, ContactError> {
        let margin = self.solver.settings.margin;
        let ranges: Vec<_> = self.movers.iter().zip(&self.reach).map(|(m, reach)| range(m, reach + margin)).collect();
        let pairs = pairs::find(&ranges, self.solver.walls.all());
        let mut found = Vec::new();
        let before = std::mem::take(&mut self.near);
        for &pair in &pairs.pushed {
            let reach = margin + self.pair_reach(pair);
            found.clear();
            self.solver.touches(self.movers, pair, |k| self.movers[k].pose, reach, &mut found);
            // a gap that is not a number must not pass for a wide one
            found.retain(|touch| touch.gap <= reach || touch.gap.is_nan());
            let slots: Vec<u32> = found.iter().map(|touch| touch.slot).collect();
            let bonds = self.solver.bonds.shared(pair, &slots);
            for (touch, bond) in found.iter().zip(bonds) {
                self.solver.refuse_overlap(self.movers, pair, touch)?;
                let mut near = self.near(pair, *touch, bond);
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
        let settings = &self.solver.settings;
        let radius = equivalent_radius(self.movers[pair.body].shape);
        let resistance = match pair.partner {
            Partner::Body(other) => {
                let other = equivalent_radius(self.movers[other].shape);
                ((radius + other) / (radius * other)).powi(2)
            }
            Partner::Wall(index) => resistance(radius, &self.solver.walls.all()[index]),
        };
        let mut row = Row { offset: touch.gap - settings.margin, ..Row::default() };
        self.fill(&mut row, pair, &touch);
        row.bound = bond.gamma / (resistance * self.dt * self.unit);
        row.slack = settings.tolerance * self.solver.size(self.movers, pair) + rounding(self.movers, pair);
        let warm = row.bound + bond.multiplier;
        Near { pair, touch, row, resistance, warm, followed: false }
    }

    /// `Δt G·W` of a touch: entries for what is free, and the offset of what is given.
    fn fill(&self, row: &mut Row, Pair { body, partner }: Pair, touch: &Touch) {
        self.fill_body(row, body, touch.gradient_first(self.movers[body].pose.position));
        if let Partner::Body(other) = partner {
            self.fill_body(row, other, touch.gradient_second(self.movers[other].pose.position));
        }
    }

    fn fill_body(&self, row: &mut Row, body: usize, gradient: [f64; 3]) {
        let (mover, first) = (&self.movers[body], self.unknowns[body]);
        let [x, y, spin] = gradient;
        let mut push = |k: usize, b: f64| {
            if b != 0.0 {
                row.entries.push((k, self.dt * b));
            }
        };
        match mover.freedom {
            Freedom::Free { .. } => {
                push(first, x);
                push(first + 1, y);
                if !mover.shape.is_round() {
                    push(first + 2, spin);
                }
            }
            Freedom::Pinned { pivot, .. } => {
                let arm = perpendicular(-turned(pivot, mover.pose.angle));
                let spin = if mover.shape.is_round() { 0.0 } else { spin };
                push(first, x * arm.x + y * arm.y + spin);
            }
            Freedom::Given { .. } => row.offset += self.dt * along(gradient, &mover.whole(&Twist::ZERO, self.dt)),
        }
    }

    /// Projects until the gaps at the end of the step are what the rows say.
    fn rounds(&mut self, pairs: &[Pair]) -> Result<(), ContactError> {
        let method = self.solver.settings.method;
        for round in 0..ROUNDS {
            let rows = self.near.iter().map(|near| near.row.clone()).collect();
            let (metric, target) = (self.metric.clone(), self.target.clone());
            let problem = Problem { metric, target, rows, tolerance: self.solver.settings.tolerance };
            let warm: Vec<f64> = self.near.iter().map(|near| near.warm).collect();
            let solved = match self.kept(&problem, &warm) {
                Some(kept) if round == 0 => Ok(kept),
                Some(_) | None => problem.solve(method, &warm),
            };
            let solution = solved.map_err(|unsolved| {
                let near = &self.near[unsolved.row];
                let miss = unsolved.excess * near.row.slack;
                let first = self.movers[near.pair.body].name.to_owned();
                let second = partner_name(self.movers, near.pair.partner);
                ContactError::Caught { first, second, miss, iterations: unsolved.iterations, hint: self.hint() }
            })?;
            self.effort.iterations += solution.iterations;
            self.effort.factorisations += solution.factorisations;
            self.effort.rounds += 1;
            self.effort.rows = self.near.len();
            for (near, mu) in self.near.iter_mut().zip(&solution.multipliers) {
                near.warm = *mu;
            }
            self.solution = solution;
            match self.follow(pairs) {
                None => return Ok(()),
                Some((pair, miss)) if round + 1 == ROUNDS => {
                    return Err(self.caught(pair.body, partner_name(self.movers, pair.partner), miss));
                }
                Some(_) => {}
            }
        }
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
        let poses = self.poses(&twists);
        let margin = self.solver.settings.margin;
        let glued = match self.solver.settings.law {
            Law::Inelastic => false,
            Law::Gluey { gamma_min } => gamma_min < 0.0,
        };
        let mut worst: Option<(Pair, f64)> = None;
        let mut new = Vec::new();
        let (mut found, mut start) = (Vec::new(), 0);
        for &pair in pairs {
            let count = self.near[start..].iter().take_while(|n| n.pair == pair).count();
            found.clear();
            let reach = margin + self.pair_reach(pair);
            self.solver.touches(self.movers, pair, |k| poses[k], reach, &mut found);
            let slack =
                self.solver.settings.tolerance * self.solver.size(self.movers, pair) + rounding(self.movers, pair);
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
                let held = glued && near.warm > near.row.bound;
                if held {
                    note(true_value.abs());
                }
                let miss = if held { true_value.abs() } else { -true_value };
                near.followed |= miss > 4.0 * slack;
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

    fn twists(&self) -> Vec<Twist> {
        let u = &self.solution.velocity;
        let twist = |(k, mover): (usize, &Mover)| {
            let first = self.unknowns[k];
            let free = match mover.freedom {
                Freedom::Free { .. } => Twist {
                    velocity: Point::new(u[first], u[first + 1]),
                    spin: if mover.shape.is_round() { mover.predicted.spin } else { u[first + 2] },
                },
                Freedom::Pinned { .. } => Twist { spin: u[first], ..Twist::ZERO },
                Freedom::Given { .. } => Twist::ZERO,
            };
            mover.whole(&free, self.dt)
        };
        self.movers.iter().enumerate().map(twist).collect()
    }

    fn poses(&self, twists: &[Twist]) -> Vec<Pose> {
        self.movers.iter().zip(twists).map(|(mover, twist)| mover.after(twist, self.dt)).collect()
    }

    /// γ after the step, `−Δt R (λ − λ_min)`, not below the threshold.
    fn gamma(&self, near: &Near, multiplier: f64) -> f64 {
        match self.solver.settings.law {
            Law::Inelastic => 0.0,
            Law::Gluey { gamma_min } => {
                let pressed = self.dt * near.resistance * self.unit * (multiplier - near.row.bound);
                if pressed > 0.0 { (-pressed).max(gamma_min) } else { 0.0 }
            }
        }
    }

    fn projected(&self, twists: &[Twist], given: &[Pair]) -> Projected {
        let poses = self.poses(twists);
        let mut out = Projected {
            poses,
            twists: twists.to_vec(),
            gap: f64::INFINITY,
            effort: self.effort,
            ..Projected::default()
        };
        out.forces = vec![[0.0; 3]; twists.len()];
        let mut found: Vec<Touch> = Vec::new();
        let mut of = None;
        for (near, mu) in self.near.iter().zip(&self.solution.multipliers) {
            if of != Some(near.pair) {
                found.clear();
                let reach = self.pair_reach(near.pair) + self.solver.settings.margin;
                self.solver.touches(self.movers, near.pair, |k| out.poses[k], reach, &mut found);
                of = Some(near.pair);
            }
            let after = found.iter().find(|touch| touch.slot == near.touch.slot);
            let gap = after.map_or(near.row.value(&self.solution.velocity) + self.solver.settings.margin, |t| t.gap);
            let shown = after.unwrap_or(&near.touch);
            let force = mu * self.unit;
            let Pair { body, partner } = near.pair;
            let gamma = self.gamma(near, *mu);
            let (point, normal) = (shown.point(), shown.normal);
            out.gap = out.gap.min(gap);
            out.contacts.push(Contact { body, partner, gap, force, gamma, point, normal });
            let mut add = |index: usize, gradient: [f64; 3]| {
                let torque = if self.movers[index].shape.is_round() { 0.0 } else { gradient[2] };
                for (total, g) in out.forces[index].iter_mut().zip([gradient[0], gradient[1], torque]) {
                    *total += force * g;
                }
            };
            add(body, near.touch.gradient_first(self.movers[body].pose.position));
            match partner {
                Partner::Body(other) => add(other, near.touch.gradient_second(self.movers[other].pose.position)),
                Partner::Wall(_) => out.wall_force += force * near.touch.normal,
            }
        }
        self.add_overlaps(given, &mut out);
        out
    }

    /// What the next step must know.
    pub(super) fn bonds(&self) -> Bonds {
        let bond = |(near, mu): (&Near, &f64)| {
            let key = Key { body: near.pair.body, partner: near.pair.partner, slot: near.touch.slot };
            (key, Bond { gamma: self.gamma(near, *mu), multiplier: (mu - near.row.bound).max(0.0) })
        };
        Bonds::new(self.near.iter().zip(&self.solution.multipliers).map(bond).collect())
    }
}
