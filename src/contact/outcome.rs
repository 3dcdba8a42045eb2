//! What a step of contact ends with: poses, velocities, forces, contacts and bonds.

use super::bonds::{Bond, Bonds, Key};
use super::gap::Touch;
use super::pairs::Pair;
use super::repair::{Push, Repaired};
use super::rough::tangential;
use super::solver::{Projected, Shown};
use super::step::{Near, Step};
use super::{Contact, Law, Partner};
use crate::shape::{Pose, Twist};

impl Step<'_> {
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

    /// The step with its contacts. Without inertia the repair is a motion like any other, and has its forces; with
    /// inertia it enters no velocity.
    pub(super) fn projected(
        &mut self,
        mut twists: Vec<Twist>,
        repaired: Repaired,
        given: &[Pair],
        shown: Shown,
    ) -> Projected {
        self.effort.iterations += repaired.iterations;
        self.effort.factorisations += repaired.factorisations;
        self.effort.rounds += repaired.rounds;
        let (mut pushes, moved) = (Vec::new(), !repaired.pushes.is_empty());
        if self.metric_of.has_inertia() {
            self.keep_angular_momentum(&repaired, &mut twists);
        } else {
            if !repaired.pushes.is_empty() {
                twists = self.twists_to(&repaired.poses);
            }
            pushes.clone_from(&repaired.pushes);
        }
        let mut out =
            Projected { poses: repaired.poses, gap: f64::INFINITY, effort: self.effort, ..Projected::default() };
        out.forces = vec![[0.0; 3]; twists.len()];
        out.twists = twists;
        for (near, mu) in self.near.iter().zip(&self.solution.multipliers) {
            self.add_force(mu * self.unit, (near.pair, &near.touch), &|k| self.movers[k].pose, &mut out);
            self.add_friction(near, &mut out);
        }
        let poses = out.poses.clone();
        for push in &mut pushes {
            push.multiplier /= self.dt;
            self.add_force(push.multiplier, (push.pair, &push.touch), &|k| poses[k], &mut out);
        }
        self.add_pushes(&pushes);
        self.add_contacts((&pushes, moved), shown, &mut out);
        self.add_overlaps(given, &mut out);
        out
    }

    /// Adds a force λ to what a touch does to bodies and walls.
    fn add_force(&self, force: f64, (pair, touch): (Pair, &Touch), pose: &dyn Fn(usize) -> Pose, out: &mut Projected) {
        for (body, gradient) in Self::gradients(pair, touch, pose) {
            let torque = if self.movers[body].shape.is_round() { 0.0 } else { gradient[2] };
            for (total, g) in out.forces[body].iter_mut().zip([gradient[0], gradient[1], torque]) {
                *total += force * g;
            }
        }
        match pair.partner {
            Partner::Body(_) => {}
            Partner::Wall(_) => out.wall_force += force * touch.normal,
        }
    }

    /// Adds the friction of a touch.
    fn add_friction(&self, near: &Near, out: &mut Projected) {
        let Some(slide) = &near.slide else { return };
        let force = slide.multiplier * self.unit;
        for (body, slope) in Self::slopes(near.pair, &near.touch, &|k| self.movers[k].pose) {
            out.forces[body].iter_mut().zip(slope).for_each(|(total, g)| *total += force * g);
        }
        match near.pair.partner {
            Partner::Body(_) => {}
            Partner::Wall(_) => out.wall_force += tangential(force, near.touch.normal),
        }
    }

    /// Adds the forces of a repair to those of the touches that the projection knew.
    fn add_pushes(&mut self, pushes: &[Push]) {
        for push in pushes {
            let place = self.near.iter().position(|n| n.pair == push.pair && n.touch.slot == push.touch.slot);
            if let Some(place) = place {
                self.solution.multipliers[place] += push.multiplier / self.unit;
            }
        }
    }

    /// Adds the contacts with their gaps; `moved` where a repair has moved bodies.
    fn add_contacts(&self, (pushes, moved): (&[Push], bool), shown: Shown, out: &mut Projected) {
        let mut found: Vec<Touch> = Vec::new();
        let mut of = None;
        for (near, mu) in self.near.iter().zip(&self.solution.multipliers) {
            let is_known = !moved && !self.is_tangent(near.pair);
            if !is_known && of != Some(near.pair) {
                found.clear();
                let reach = self.pair_reach(near.pair) + self.solver.settings.margin;
                self.solver.touches(self.movers, near.pair, |k| out.poses[k], reach, &mut found);
                of = Some(near.pair);
            }
            let after = match is_known {
                true => near.after.as_ref(),
                false => found.iter().find(|touch| touch.slot == near.touch.slot),
            };
            let gap = after.map_or(near.row.value(&self.solution.velocity) + self.solver.settings.margin, |t| t.gap);
            let (touch, gap, gamma) = match shown {
                Shown::After => (after.unwrap_or(&near.touch), gap, self.gamma(near, *mu)),
                Shown::Before => (&near.touch, near.touch.gap, self.dt * near.resistance * self.unit * near.row.bound),
            };
            let Pair { body, partner } = near.pair;
            let (point, normal) = (touch.point(), touch.normal);
            out.gap = out.gap.min(gap);
            let friction = near.slide.as_ref().map_or(0.0, |slide| slide.multiplier * self.unit);
            out.contacts.push(Contact { body, partner, gap, force: mu * self.unit, friction, gamma, point, normal });
        }
        let new = pushes.iter().filter(|push| self.near_of(push.pair, &push.touch).is_none());
        out.contacts.extend(new.map(|Push { pair, touch, multiplier }| {
            let (gap, point, normal) = (touch.gap.max(0.0), touch.point(), touch.normal);
            let Pair { body, partner } = *pair;
            Contact { body, partner, gap, force: *multiplier, friction: 0.0, gamma: 0.0, point, normal }
        }));
        out.contacts.sort_by_key(|contact| (contact.body, contact.partner));
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

/// Whether a bond holds a touch whose multiplier is `mu`.
pub(super) fn holds(law: Law, near: &Near, mu: f64) -> bool {
    match law {
        Law::Inelastic => false,
        Law::Gluey { gamma_min } => gamma_min < 0.0 && mu > near.row.bound,
    }
}
