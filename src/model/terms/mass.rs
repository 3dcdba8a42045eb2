//! The terms of the balance of mass, test z; a sheet of varying density alone has it   [7.32]

use super::{Formula, Functional, Strong, Term, Weak};
use crate::form::transport;
use crate::form::words::Scalar;

/// In the order of the model page.
pub const MASS: &[Term<Scalar>] = &[RATE, TRANSPORT];

const RATE: Term<Scalar> = Term {
    name: "density rate",
    formula: Formula::Compressible("(∂_t ρ|z)"),
    tag: "[7.34]",
    strong: Strong::Scalar(|s| s.density_rate()),
    ..Term::PLAIN
};

const TRANSPORT: Term<Scalar> = Term {
    name: "density transport",
    formula: Formula::Compressible("a_mass(ρ,z;v)"),
    tag: "[7.32]",
    weak: Weak::Functional(Functional {
        value: |at| {
            let given = at.given;
            transport::transport(at.density().0, at.v(), given.open, move |s| given.inflow(s))
        },
        by_velocity: |at| {
            let given = at.given;
            transport::transport_by_flow(at.density().0, at.v(), given.open, move |s| given.inflow(s))
        },
        by_density: |at| transport::a_mass(at.density().1, at.v(), at.given.open),
        ..Functional::NOTHING
    }),
    strong: Strong::Scalar(|s| {
        let (rho, v) = (s.rho(), s.velocity());
        v.dot(&rho.gradient()) + rho.value() * (s.v[0].gradient().x + s.v[1].gradient().y)
    }),
    ..Term::PLAIN
};
