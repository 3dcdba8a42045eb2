//! Bodies of which nothing is left in the mesh: the flow goes on around the others.

use super::penalty::BodyError;
use crate::body::Body;
use crate::body::leaving::{Departure, Exits, Remaining};
use crate::model::momentum::MomentumError;
use crate::shape::Pose;

/// What `make` makes around the bodies that are left of `count` when the body `first` has gone, and with it all that
/// lie outside of the mesh as well.
pub(in crate::model) fn without_those_outside<T>(
    count: usize,
    first: usize,
    make: impl Fn(&Remaining) -> Result<T, MomentumError>,
) -> Result<(T, Remaining), MomentumError> {
    let mut gone = vec![first];
    loop {
        let remaining = Remaining::all_but(count, &gone);
        match make(&remaining) {
            Ok(made) => return Ok((made, remaining)),
            Err(MomentumError::Body(BodyError::Outside { number, .. })) => gone.push(remaining.old(number)),
            Err(other) => return Err(other),
        }
    }
}

/// What is told of the bodies that are not among those that are left, at the time at which they have gone.
///
/// # Errors
/// An error of a body that is beside a part of the boundary through which bodies do not leave.
pub fn departures(
    exits: &Exits,
    (bodies, poses): (&[Body], &[Pose]),
    remaining: &Remaining,
    time: f64,
) -> Result<Vec<Departure>, BodyError> {
    let gone = (0..bodies.len()).filter(|body| remaining.number(*body).is_none());
    gone.map(|number| {
        let (body, at) = (bodies[number].name.clone(), poses[number].position);
        match exits.beside(at) {
            Some((through, true)) => {
                let (position, through) = ([at.x, at.y], through.to_owned());
                Ok(Departure { body, time, position, through })
            }
            Some((tag, false)) => Err(BodyError::NoExit { body, tag: tag.to_owned() }),
            None => Err(BodyError::Outside { body, number }),
        }
    })
    .collect()
}

/// The body of which an error says that it lies outside of the mesh.
pub fn outside(error: &MomentumError) -> Option<usize> {
    match error {
        MomentumError::Body(BodyError::Outside { number, .. }) => Some(*number),
        _ => None,
    }
}
