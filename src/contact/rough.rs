//! Coulomb's friction and Newton's restitution.
//!
//! ```text
//! |λ_t| ≤ μ λ_n,   λ_t = −μ λ_n sign(u_t) where bodies slide         u_t = t·(V_j − V_i) at the contact, t = n^⊥
//! u_n ≥ −e u_n⁻  where a pair closes in the step                     u_n = G·W, u_n⁻ at the beginning of the step
//! ```
//! With `s = μ|u_t|` friction is complementarity in a cone (De Saxcé and Feng 1998), and in a plane the cone has two
//! edges: `β± ≥ 0` and `D/Δt + u_n + s ± μ u_t ≥ 0`, with `λ_n = β₊ + β₋` and `λ_t = μ (β₊ − β₋)`. For a given s these
//! are two rows of the projection, and s is found as a fixed point of it (Acary, Cadoux, Lemaréchal and Malick 2011).
//! Rest is admissible for any `s ≥ 0`, so that friction gives no energy on the way either. Restitution is Moreau's
//! (1999): a pair that closes within the step bounces in it. Newton's law may give energy to bodies that turn and rub
//! (Kane 1984); then e is lowered for them in this step.

use super::gap::{Touch, along};
use super::mover::Freedom;
use super::pairs::Pair;
use super::projection::Row;
use super::step::{Near, Step};
use super::{ContactError, Partner};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, perpendicular};
use crate::solve::anderson::Anderson;

/// From the round [`STRICT`] on friction has settled where sliding changes by less than this share of the motion
/// without contact.
const SETTLED: f64 = 1e-5;
const STRICT: usize = 20;
/// Restitution below this counts as none.
const LEAST: f64 = 1e-2;
/// Rounds of the fixed point alone, differences that Anderson's method looks back on, rounds after which it begins
/// anew, because other contacts slide by then, and the round from which steps are half of the fixed point's.
const PLAIN: usize = 4;
const DEPTH: usize = 10;
const RESTART: usize = 30;
const DAMPED: usize = 60;

/// What slides at a touch.
#[derive(Debug, Clone)]
pub(super) struct Slide {
    /// `Δt u_t`
    pub row: Row,
    /// `Δt s`
    pub dilation: f64,
    /// λ_t
    pub multiplier: f64,
}

impl Near {
    /// The rows of the projection: its own, which it lends, or with friction the two edges of the cone.
    pub(super) fn lend_rows(&mut self, friction: f64) -> impl Iterator<Item = Row> + use<> {
        let edges = self.slide.as_ref().map(|slide| [1.0, -1.0].map(|sign| self.edge(slide, sign * friction)));
        let plain = self.slide.is_none().then(|| std::mem::take(&mut self.row));
        plain.into_iter().chain(edges.into_iter().flatten())
    }

    /// `row + Δt s + factor Δt u_t`
    fn edge(&self, slide: &Slide, factor: f64) -> Row {
        let mut row = self.row.clone();
        row.offset += slide.dilation + factor * slide.row.offset;
        for &(k, b) in &slide.row.entries {
            match row.entries.iter_mut().find(|(known, _)| *known == k) {
                Some((_, entry)) => *entry += factor * b,
                None => row.entries.push((k, factor * b)),
            }
        }
        row
    }

    /// The multipliers of [`Near::rows`] to start from.
    pub(super) fn warm_rows(&self, friction: f64) -> impl Iterator<Item = f64> {
        let edges = self.slide.as_ref().map(|slide| {
            let (half, sliding) = (0.5 * self.warm, 0.5 * slide.multiplier / friction);
            [half + sliding, half - sliding]
        });
        let plain = self.slide.is_none().then_some(self.warm);
        plain.into_iter().chain(edges.into_iter().flatten())
    }

    /// The multipliers `λ_n` and `λ_t` of those of [`Near::rows`].
    pub(super) fn multipliers(&self, friction: f64, of_rows: &[f64]) -> [f64; 2] {
        match of_rows {
            [plus, minus] => [plus + minus, friction * (plus - minus)],
            one => [one[0], 0.0],
        }
    }
}

impl Step<'_> {
    /// Whether contact can turn a body.
    pub(super) fn turns(&self, body: usize) -> bool {
        self.solver.settings.friction > 0.0 || self.flow.is_some() || !self.movers[body].shape.is_round()
    }

    /// The bodies of a touch, with `∂(Δ u_t)/∂(x, y, θ)` of each, both about the point midway.
    pub(super) fn slopes(
        Pair { body, partner }: Pair,
        touch: &Touch,
        pose: &dyn Fn(usize) -> Pose,
    ) -> impl Iterator<Item = (usize, [f64; 3])> {
        let (t, point) = (perpendicular(touch.normal), touch.point());
        let slope = |body: usize, sign: f64| {
            let arm = point - pose(body).position;
            (body, [sign * t.x, sign * t.y, sign * arm.perp(&t)])
        };
        let second = match partner {
            Partner::Body(other) => Some(slope(other, 1.0)),
            Partner::Wall(_) => None,
        };
        std::iter::once(slope(body, -1.0)).chain(second)
    }

    /// What slides at a touch; `None` without friction.
    pub(super) fn slide(&self, pair: Pair, touch: &Touch) -> Option<Box<Slide>> {
        let friction = self.solver.settings.friction;
        if friction == 0.0 {
            return None;
        }
        let pose = |k: usize| self.movers[k].pose;
        let slopes: Vec<_> = Self::slopes(pair, touch, &pose).collect();
        let entries =
            self.entries_of(slopes.iter().copied(), &pose).into_iter().map(|(k, b)| (k, self.dt * b)).collect();
        let row = Row { entries, offset: self.dt * self.given_of(slopes.into_iter()), ..Row::default() };
        // what slid before the step goes on, and what was at rest stays so
        let before = Self::slopes(pair, touch, &pose).map(|(k, slope)| along(slope, &self.before(k)));
        let dilation = friction * self.dt * before.sum::<f64>().abs();
        Some(Box::new(Slide { row, dilation, multiplier: 0.0 }))
    }

    /// Renews `s` of every touch by the last velocities, by Anderson's method where the fixed point alone is slow; the
    /// pair that is missed most, if any is.
    pub(super) fn renew_dilations(&mut self, round: usize) -> Option<(Pair, f64)> {
        let friction = self.solver.settings.friction;
        if friction == 0.0 {
            return None;
        }
        let slides = || self.near.iter().filter_map(|near| Some((near, near.slide.as_ref()?)));
        let now: Vec<f64> = slides().map(|(_, slide)| slide.dilation).collect();
        let image: Vec<f64> =
            slides().map(|(_, slide)| friction * slide.row.value(&self.solution.velocity).abs()).collect();
        let missed = slides().zip(now.iter().zip(&image)).filter_map(|((near, _), (now, image))| {
            let miss = (image - now).abs();
            (near.warm != 0.0 && miss > self.unsettling(near, round)).then_some((near.pair, miss))
        });
        let worst = missed.reduce(|most, next| if next.1 > most.1 { next } else { most });
        if round.is_multiple_of(RESTART) || self.dilations.0 != now.len() {
            self.dilations = (now.len(), Anderson::new(DEPTH));
        }
        let next = match round {
            0..PLAIN => image,
            PLAIN..DAMPED => self.dilations.1.next(&now, &image),
            _ => now.iter().zip(&image).map(|(now, image)| 0.5 * (now + image)).collect(),
        };
        for (slide, next) in self.near.iter_mut().filter_map(|near| near.slide.as_mut()).zip(next) {
            slide.dilation = next.max(0.0);
        }
        worst
    }

    /// What `Δt s` may miss: what a gap may, and after some rounds a small share of what forces alone would move the
    /// pair by.
    fn unsettling(&self, near: &Near, round: usize) -> f64 {
        if round < STRICT {
            return 4.0 * near.row.slack;
        }
        let travel = |k: usize| self.dt * self.movers[k].whole(&self.movers[k].predicted, self.dt).velocity.norm();
        let other = match near.pair.partner {
            Partner::Body(other) => travel(other),
            Partner::Wall(_) => 0.0,
        };
        (4.0 * near.row.slack).max(SETTLED * travel(near.pair.body).max(other))
    }

    /// `Δt e u_n⁻` of a pair that closes within the step, or that was `struck`; of one that opens and may be closed by
    /// others what keeps that from giving energy, `Δt u_n⁻`. `None` where the gap counts.
    pub(super) fn rebound(&self, pair: Pair, touch: &Touch, struck: bool) -> Option<f64> {
        let restitution = self.restitution_of(pair);
        if restitution == 0.0 {
            return None;
        }
        let gap = touch.gap - self.solver.settings.margin;
        let pose = |k: usize| self.movers[k].pose;
        let rate = |twist: &dyn Fn(usize) -> Twist| {
            let rates = Self::gradients(pair, touch, &pose).map(|(k, gradient)| along(gradient, &twist(k)));
            self.dt * rates.sum::<f64>()
        };
        let before = rate(&|k| self.before(k));
        let ahead = rate(&|k| self.movers[k].whole(&self.movers[k].predicted, self.dt));
        if before < 0.0 {
            (struck || gap + ahead < self.slack(pair)).then_some(restitution * before)
        } else {
            (gap < before).then_some(before)
        }
    }

    /// The twist of a body before the step.
    fn before(&self, body: usize) -> Twist {
        self.movers[body].whole(&self.movers[body].last, self.dt)
    }

    /// e of a pair: the lesser of those of its bodies.
    fn restitution_of(&self, Pair { body, partner }: Pair) -> f64 {
        let own = self.restitution[body];
        match partner {
            Partner::Body(other) => own.min(self.restitution[other]),
            Partner::Wall(_) => own,
        }
    }

    /// Lets the pairs bounce that others have struck together. Whether there were any.
    pub(super) fn strike(&mut self) -> bool {
        let mut found = false;
        for place in 0..self.near.len() {
            let near = &self.near[place];
            if near.struck || near.warm == 0.0 {
                continue;
            }
            let (pair, touch) = (near.pair, near.touch);
            let (known, bounce) = (self.rebound(pair, &touch, false), self.rebound(pair, &touch, true));
            if known.is_none() && bounce.is_some() {
                self.near[place].struck = true;
                self.near[place].row.offset = self.offset(pair, &touch, true);
                found = true;
            }
        }
        found
    }

    /// Half of the restitution, for a body in an island that has gained energy.
    pub(super) fn soften(&mut self, body: usize) {
        let half = 0.5 * self.restitution[body];
        self.restitution[body] = if half < LEAST { 0.0 } else { half };
    }

    /// Restitution of every body at the beginning of a step.
    pub(super) fn restitutions(&self) -> Vec<f64> {
        let value = if self.metric_of.has_inertia() { self.solver.settings.restitution } else { 0.0 };
        vec![value; self.movers.len()]
    }

    /// Twice the kinetic energy of a body at the beginning of the step.
    pub(super) fn energy_before(&self, body: usize) -> f64 {
        let mover = &self.movers[body];
        match mover.freedom {
            Freedom::Free { mass, inertia } => {
                let spin = if self.turns(body) { mover.last.spin } else { 0.0 };
                mass * mover.last.velocity.norm_squared() + inertia * spin.powi(2)
            }
            Freedom::Pinned { inertia, .. } => inertia * mover.last.spin.powi(2),
            Freedom::Given { .. } => 0.0,
        }
    }

    /// The error of friction that does not settle.
    pub(super) fn unsettled(&self, pair: Pair, miss: f64) -> ContactError {
        let (first, second) =
            (self.movers[pair.body].name.to_owned(), super::solver::partner_name(self.movers, pair.partner));
        ContactError::Unsettled { first, second, miss, dt: self.dt }
    }
}

/// The tangential force of a contact on the second of two, along `n^⊥`.
pub(super) fn tangential(force: f64, normal: Point) -> Point {
    force * perpendicular(normal)
}
