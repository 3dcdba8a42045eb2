//! The bodies of a run at a moment, as files and pictures know them.

use super::stepper::Plan;
use super::view::View;
use super::{RunError, maps};
use crate::measure::bodies::loads;
use crate::output::bodies::{Moment, Solids, view};
use crate::output::plot::map::Window;

/// The bodies of a view, as files and pictures know them.
///
/// # Errors
/// Those of `then`.
pub fn with_moment<T, E>(cast: &Solids, view: &View, then: impl FnOnce(&Moment) -> Result<T, E>) -> Result<T, E> {
    let none = (&[][..], &[][..], &[][..], &[][..], &[][..]);
    let (bodies, poses, twists, flow, contacts) =
        view.bodies.map_or(none, |b| (b.bodies, b.poses, b.twists, b.flow, b.contacts));
    let loads = loads(poses, contacts);
    let of = |solids: &Solids| then(&Moment { solids, time: view.t, poses, twists, flow, loads: &loads, contacts });
    match bodies.len() == cast.bodies.len() {
        true => of(cast),
        // the others have left
        false => of(&cast.named(bodies.iter().map(|body| &*body.name))),
    }
}

/// The window of the bodies where the scene puts them; that of the first picture of a resumed run is the same.
///
/// # Errors
/// Bodies that no picture shows.
pub fn first_view(plan: &Plan, cast: &Solids) -> Result<Window, RunError> {
    let poses: Vec<_> = plan.bodies.iter().map(|body| body.start).collect();
    let twists: Vec<_> = plan.bodies.iter().map(|body| body.start_twist).collect();
    let loads = loads(&poses, &[]);
    let (poses, twists, loads) = (&poses[..], &twists[..], &loads[..]);
    let moment = Moment { solids: cast, time: 0.0, poses, twists, flow: &[], loads, contacts: &[] };
    view(&moment).map_err(|error| maps::failed("bodies", error))
}
