//! Pairs that would pass through each other within a step, and pairs that overlap because nothing parts them.

use super::gap::Touch;
use super::mover::Freedom;
use super::pairs::{Pair, Pairs};
use super::solver::{Projected, partner_name, rounding};
use super::step::Step;
use super::{Contact, ContactError, Partner, Wall};
use crate::shape::Twist;

/// Gaps below this share of what a step may leap count as contact, whose direction is known however fast the bodies are
/// pressed.
const CLOSE: f64 = 1e-2;

impl Step<'_> {
    /// Refuses steps in which bodies would leap, were there no contact; the direction of a contact that is still far
    /// away would be wrong.
    pub(super) fn refuse_leaps(&self, pairs: &Pairs) -> Result<(), ContactError> {
        let predicted: Vec<Twist> = self.movers.iter().map(|m| m.whole(&m.predicted, self.dt)).collect();
        for near in &self.near {
            if near.touch.gap > CLOSE * self.thinner(near.pair) {
                self.refuse_leap(near.pair, &near.touch, &predicted)?;
            }
        }
        let mut found = Vec::new();
        for &pair in &pairs.given {
            found.clear();
            let reach = self.pair_reach(pair);
            self.solver.touches(self.movers, pair, |k| self.movers[k].pose, reach, &mut found);
            // what overlaps already has been told
            for touch in found.iter().filter(|touch| touch.gap > 0.0) {
                self.refuse_leap(pair, touch, &predicted)?;
            }
        }
        Ok(())
    }

    /// Refuses a step that moves two bodies that can meet in it past each other by more than the thinner one is thick,
    /// or turns them by more than half of that: gaps are looked at where a step ends. Gaps of discs and walls are
    /// convex, so that their rows keep them apart however far a step goes, as long as one of them may be pushed.
    pub(super) fn refuse_leap(&self, pair: Pair, touch: &Touch, twists: &[Twist]) -> Result<(), ContactError> {
        let Pair { body, partner } = pair;
        let (mut shift, mut turn) = self.movers[body].strides(&twists[body], self.dt);
        if let Partner::Body(other) = partner {
            let (by, turned) = self.movers[other].strides(&twists[other], self.dt);
            (shift, turn) = (shift - by, turn + turned);
        }
        let travel = shift.norm() + turn;
        let limit = 2.0 * self.thinner(pair);
        let apart = self.is_pushed(pair) && self.is_convex(pair);
        if apart || touch.gap > travel || (travel <= limit && turn <= 0.5 * limit) {
            return Ok(());
        }
        let (travel, limit) = if travel > limit { (travel, limit) } else { (turn, 0.5 * limit) };
        let (first, second) = (self.movers[body].name.to_owned(), partner_name(self.movers, partner));
        Err(ContactError::TooFar { first, second, travel, limit, dt: self.dt })
    }

    /// Whether contact can move one of the two.
    fn is_pushed(&self, Pair { body, partner }: Pair) -> bool {
        let given = |k: usize| matches!(self.movers[k].freedom, Freedom::Given { .. });
        match partner {
            Partner::Body(other) => !(given(body) && given(other)),
            Partner::Wall(_) => !given(body),
        }
    }

    /// Whether the gap is a convex function of what a step changes.
    fn is_convex(&self, Pair { body, partner }: Pair) -> bool {
        let shifted = |k: usize| {
            let pinned = matches!(self.movers[k].freedom, Freedom::Pinned { .. });
            self.movers[k].shape.is_round() && !pinned
        };
        match partner {
            Partner::Body(other) => shifted(body) && shifted(other),
            Partner::Wall(_) => shifted(body),
        }
    }

    /// Half of the thickness of the thinner of two; walls that are lines or hollows cannot be passed.
    fn thinner(&self, Pair { body, partner }: Pair) -> f64 {
        let own = self.movers[body].shape.inradius();
        match partner {
            Partner::Body(other) => own.min(self.movers[other].shape.inradius()),
            Partner::Wall(index) => match &self.solver.walls.all()[index] {
                Wall::Segment(_) | Wall::Hollow { .. } => own,
                Wall::Disc { radius, .. } => own.min(*radius),
            },
        }
    }

    /// Adds the pairs that overlap after the step because the motion of both is given.
    pub(super) fn add_overlaps(&self, given: &[Pair], out: &mut Projected) {
        let mut found: Vec<Touch> = Vec::new();
        let before = out.contacts.len();
        for &pair in given {
            found.clear();
            self.solver.touches(self.movers, pair, |k| out.poses[k], 0.0, &mut found);
            let slack = rounding(self.movers, pair);
            for touch in found.iter().filter(|touch| touch.gap < -slack) {
                let (point, normal) = (touch.point(), touch.normal);
                out.gap = out.gap.min(touch.gap);
                let contact = Contact {
                    body: pair.body,
                    partner: pair.partner,
                    gap: touch.gap,
                    force: 0.0,
                    friction: 0.0,
                    gamma: 0.0,
                    point,
                    normal,
                };
                out.contacts.push(contact);
            }
        }
        if out.contacts.len() > before {
            out.contacts.sort_by_key(|contact| (contact.body, contact.partner));
        }
    }
}
