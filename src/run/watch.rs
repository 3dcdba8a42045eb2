//! What a run looks at after every step: bodies that are lost, and given motions that lead bodies into each other.

use crate::body::Hold;
use crate::contact::{Contact, Partner};
use crate::measure::list::Bodies;

/// Rounding of a position, or of an angle, that is no longer small against a body, relative to its size.
const COARSE: f64 = 1e-3;

/// The first body that is so far away, or turned so often, that its place is rounding.
pub(super) fn lost(now: &Bodies, t: f64) -> Option<String> {
    for (body, (pose, twist)) in now.bodies.iter().zip(now.poses.iter().zip(now.twists)) {
        let size = body.shape.circumradius();
        let [away, turned] = [pose.position.norm() / size, pose.angle.abs()];
        let most = COARSE / f64::EPSILON;
        let finite = twist.velocity.iter().chain([&twist.spin]).all(|v| v.is_finite());
        // what is not a number is lost as well
        if away <= most && turned <= most && finite {
            continue;
        }
        return Some(format!(
            "the body `{}` is lost at t = {t}: it is at ({:.3e}, {:.3e}), turned by {:.3e}, with velocity ({:.3e}, \
             {:.3e}), and numbers of this size do not tell its place to a thousandth of its size {size:.3e}; hint: \
             look at what drives it away, or give it a size that fits",
            body.name, pose.position.x, pose.position.y, pose.angle, twist.velocity.x, twist.velocity.y
        ));
    }
    None
}

/// Overlaps that nothing parts, because the motion of both is given.
#[derive(Debug, Default)]
pub(super) struct Overlaps {
    /// Depth, names and time of the deepest one.
    deepest: Option<(f64, String, f64)>,
    told: f64,
}

impl Overlaps {
    /// Looks at a state; a note when the first overlap is found.
    pub fn look(&mut self, now: &Bodies, t: f64) -> Option<String> {
        let given = |body: usize| match now.bodies[body].hold {
            Hold::Free | Hold::Pinned(_) => false,
            Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => true,
        };
        let nothing_parts = |contact: &&Contact| {
            contact.gap < 0.0
                && given(contact.body)
                && match contact.partner {
                    Partner::Body(other) => given(other),
                    Partner::Wall(_) => true,
                }
        };
        let deepest = now.contacts.iter().filter(nothing_parts).min_by(|a, b| a.gap.total_cmp(&b.gap))?;
        let first = self.deepest.is_none();
        if first || self.deepest.as_ref().is_some_and(|(depth, ..)| -deepest.gap > *depth) {
            let partner = match deepest.partner {
                Partner::Body(other) => format!("`{}`", now.bodies[other].name),
                Partner::Wall(wall) => format!("wall {}", wall + 1),
            };
            self.deepest = Some((-deepest.gap, format!("`{}` and {partner}", now.bodies[deepest.body].name), t));
        }
        first.then(|| {
            self.told = -deepest.gap;
            self.text()
        })
    }

    /// What the deepest overlap was, where it is not the first.
    pub fn last(&self) -> Option<String> {
        self.deepest.as_ref().filter(|(depth, ..)| *depth > self.told).map(|_| self.text())
    }

    fn text(&self) -> String {
        let Some((depth, names, t)) = &self.deepest else { return String::new() };
        format!("{names} overlap by {depth:.3e} at t = {t}: the motion of both is given, and nothing parts them")
    }
}
