//! Measures of rigid bodies and their contacts.

use super::{Bodies, Column, DIMENSIONLESS, Measure, Of, OfBodies, OfBody, OneBody, Taken, Which};
use crate::body::Body;
use crate::measure::{MeasureError, bodies};
use crate::shape::Wrench;

const ENERGY: [Column; 1] =
    [Column::new("kinetic_energy", "kinetic energy of the bodies", DIMENSIONLESS, "kinetic energy")];
const SMALLEST_GAP: [Column; 1] = [Column::new("gap", "smallest gap min D", DIMENSIONLESS, "min D")];
const DEEPEST: [Column; 1] = [Column::new("overlap", "deepest overlap of bodies", DIMENSIONLESS, "overlap")];
const TOUCHING: [Column; 1] = [Column::new("contacts", "contacts with λ ≠ 0", "", "contacts")];
const ON_WALLS: [Column; 2] = [
    Column::new("wall_force_x1", "force on all walls along x₁", DIMENSIONLESS, "along x₁"),
    Column::new("wall_force_x2", "force on all walls along x₂", DIMENSIONLESS, "along x₂"),
];
const PLACE: [Column; 6] = [
    Column::new("body_x1", "x₁ of the body", "", "x₁"),
    Column::new("body_x2", "x₂ of the body", "", "x₂"),
    Column::new("body_angle", "angle θ of the body", "", "θ"),
    Column::new("body_velocity_1", "velocity V₁ of the body", DIMENSIONLESS, "V₁"),
    Column::new("body_velocity_2", "velocity V₂ of the body", DIMENSIONLESS, "V₂"),
    Column::new("body_spin", "spin ω of the body", DIMENSIONLESS, "ω"),
];
const HELD: [Column; 3] = [
    Column::new("holding_x1", "force along x₁ that holds the body", DIMENSIONLESS, "f₁"),
    Column::new("holding_x2", "force along x₂ that holds the body", DIMENSIONLESS, "f₂"),
    Column::new("holding_torque", "torque that holds the body", DIMENSIONLESS, "torque"),
];

const FLOWN: [Column; 3] = [
    Column::new("wrench_x1", "force of the flow along x₁ on the body", DIMENSIONLESS, "f₁"),
    Column::new("wrench_x2", "force of the flow along x₂ on the body", DIMENSIONLESS, "f₂"),
    Column::new("wrench_torque", "torque of the flow on the body", DIMENSIONLESS, "torque"),
];

const TAKEN: [Column; 1] = [Column::new("power_to", "energy law: what the body takes", DIMENSIONLESS, "body")];

/// A measure of bodies.
const fn of(
    name: &'static str,
    help: &'static str,
    columns: &'static [Column],
    which: Which,
    take: OfBodies,
) -> Measure {
    Measure { name, help, columns, of: Of::Bodies(which, take), needs: &[], with_residuals: false }
}

/// A measure of a body.
const fn of_one(
    name: &'static str,
    help: &'static str,
    columns: &'static [Column],
    which: Which,
    take: OfBody,
) -> Measure {
    Measure { name, help, columns, of: Of::Body(which, take), needs: &[], with_residuals: false }
}

/// `½ Σ m|V|² + ½ Σ I ω²` of the bodies.
pub const KINETIC_ENERGY: Measure =
    of("kinetic_energy", "`½ Σ m V² + ½ Σ I ω²` of the bodies", &ENERGY, Which::Moving, kinetic_energy);
/// `min D` over all pairs of bodies, and of bodies and walls.
pub const GAP: Measure = of("gap", "`min D` of the pairs that are near", &SMALLEST_GAP, Which::Moving, gap);
/// `max(0, −D)` over all pairs.
pub const OVERLAP: Measure =
    of("overlap", "largest `−D`, of pairs whose motion is given too", &DEEPEST, Which::Moving, overlap);
/// Pairs with λ ≠ 0.
pub const CONTACTS: Measure = of("contacts", "pairs with a force, `λ ≠ 0`", &TOUCHING, Which::Moving, contacts);
/// Force on all walls.
pub const WALL_FORCE: Measure =
    of("wall_force", "force of all bodies on all walls", &ON_WALLS, Which::Moving, wall_force);
/// Place and motion of a body.
pub const BODY: Measure =
    of_one("body", "place and motion of the first body, or of one that is named", &PLACE, Which::Any, body);
/// Force and torque that hold a body to what is prescribed of its motion in a flow.
pub const HOLDING: Measure = of_one(
    "holding",
    "force and torque that hold the first body, or one that is named, to what is prescribed of its motion",
    &HELD,
    Which::InAFlow,
    holding,
);
/// Force and torque of a flow on a body; of a Stokes flow `bodies.csv` has those on all.
pub const WRENCH: Measure = of_one(
    "wrench",
    "force and torque of the flow on the first body, or on one that is named",
    &FLOWN,
    Which::InAFlow,
    wrench,
);
/// What a body takes of the energy of a tissue, see
/// [`Incompressible::powers_to_bodies`](crate::model::incompressible::Incompressible::powers_to_bodies).
pub const POWER_TO: Measure = of_one(
    "power_to",
    "its part of `budget_bodies`: what the first body, or one that is named, takes of the energy",
    &TAKEN,
    Which::InATissue,
    power_to,
);

fn kinetic_energy(at: &Bodies, taken: &mut Taken) -> Result<(), MeasureError> {
    let masses: Vec<f64> = at.bodies.iter().map(Body::mass).collect();
    let inertias: Vec<f64> = at.bodies.iter().map(Body::inertia).collect();
    taken.put(&ENERGY, [bodies::kinetic_energy(&masses, &inertias, at.twists)]);
    Ok(())
}

/// Empty where no pair is near.
fn gap(at: &Bodies, taken: &mut Taken) -> Result<(), MeasureError> {
    bodies::smallest_gap(at.contacts).iter().for_each(|gap| taken.put(&SMALLEST_GAP, [*gap]));
    Ok(())
}

fn overlap(at: &Bodies, taken: &mut Taken) -> Result<(), MeasureError> {
    taken.put(&DEEPEST, [bodies::overlap(at.contacts)]);
    Ok(())
}

fn contacts(at: &Bodies, taken: &mut Taken) -> Result<(), MeasureError> {
    taken.put(&TOUCHING, [bodies::touching(at.contacts) as f64]);
    Ok(())
}

fn wall_force(at: &Bodies, taken: &mut Taken) -> Result<(), MeasureError> {
    let force = bodies::wall_force(at.contacts);
    taken.put(&ON_WALLS, [force.x, force.y]);
    Ok(())
}

fn body(at: &OneBody) -> Result<Vec<f64>, MeasureError> {
    let (Some(pose), Some(twist)) = (at.all.poses.get(at.index), at.all.twists.get(at.index)) else {
        return Ok(Vec::new());
    };
    let (x, v) = (pose.position, twist.velocity);
    Ok(vec![x.x, x.y, pose.angle, v.x, v.y, twist.spin])
}

fn holding(at: &OneBody) -> Result<Vec<f64>, MeasureError> {
    Ok(at.acting()?.map_or_else(Vec::new, |acts| numbers(acts.holding)))
}

fn wrench(at: &OneBody) -> Result<Vec<f64>, MeasureError> {
    Ok(at.acting()?.map_or_else(Vec::new, |acts| numbers(acts.flow)))
}

fn power_to(at: &OneBody) -> Result<Vec<f64>, MeasureError> {
    Ok(at.power()?.into_iter().collect())
}

fn numbers(Wrench { force, torque }: Wrench) -> Vec<f64> {
    vec![force.x, force.y, torque]
}
