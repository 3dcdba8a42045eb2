//! Tissues with bodies that the tests share.

use std::sync::Arc;

use monolayer::body::guide::Guide;
use monolayer::body::{Body, Hold};
use monolayer::expression::Expression;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::immersed::flow::Method;
use monolayer::model::incompressible::{Description, Incompressible};
use monolayer::model::momentum::MomentumError;
use monolayer::model::terms::factor;
use monolayer::model::{Conditions, Parameters};
use monolayer::scheme::ControlSettings;
use monolayer::shape::{Capsule, Disc, Pose, Shape};
use monolayer::space::{Field, project};
use monolayer::time::{CouplingKind, CouplingSettings, MarchSettings};

/// Every force of a tissue.
pub const ACTIVE: Parameters = Parameters {
    friction: 3.0,
    traction: 3.0,
    active_stress: 0.4,
    peclet: 1.3,
    coherence: 0.2,
    elasticity: 0.6,
    alignment: 0.8,
    ..Parameters::PLAIN
};

/// With the stresses of other models, too.
pub fn with_factors() -> Parameters {
    let factors = factor::of_kind(ACTIVE.kind()).fold(ACTIVE.factors, |all, factor| all.with(factor.key, 0.7));
    Parameters { factors, ..ACTIVE }
}

pub fn formula(text: &str) -> Expression {
    Expression::of_body(text, &[]).expect("the test's formula parses")
}

pub fn round(radius: f64, at: [f64; 2], hold: Hold) -> Body {
    let start = Pose { position: Point::from(at), angle: 0.0 };
    Body { hold, ..Body::new("disc", Shape::from(Disc { radius }), start) }
}

pub fn capsule(at: [f64; 2], angle: f64, hold: Hold) -> Body {
    let start = Pose { position: Point::from(at), angle };
    Body { hold, ..Body::new("capsule", Shape::from(Capsule { half_length: 0.07, radius: 0.06 }), start) }
}

pub fn try_around(
    mesh: &Arc<Mesh>,
    parameters: Parameters,
    condition: &dyn Fn(&str) -> Conditions,
    bodies: Vec<Body>,
) -> Result<Incompressible, MomentumError> {
    let description = Description::new(mesh, parameters, condition);
    let guide = Arc::new(Guide::new(bodies).unwrap());
    let poses = guide.starts(0.0).unwrap();
    Incompressible::around(mesh, &description, &guide, &poses, Method::Nitsche)
}

pub fn around(
    mesh: &Arc<Mesh>,
    parameters: Parameters,
    condition: &dyn Fn(&str) -> Conditions,
    bodies: Vec<Body>,
) -> Incompressible {
    try_around(mesh, parameters, condition, bodies).unwrap()
}

pub fn slip(_: &str) -> Conditions {
    Conditions::slip()
}

pub fn no_slip(_: &str) -> Conditions {
    Conditions::flow([formula("0"), formula("0")])
}

pub fn settings(step: f64, order: usize, kind: CouplingKind) -> MarchSettings {
    let bounds = CouplingSettings { tolerance: 1e-9, accept: 1e-8, max_iterations: 200, ..Default::default() };
    let (control, coupling) = (ControlSettings::new(step).down_to(1e-9), CouplingSettings { kind, ..bounds });
    MarchSettings { control, coupling, ..MarchSettings::new(order, step) }
}

pub const ANDERSON: CouplingKind = CouplingKind::Anderson { depth: 5 };

pub fn swirl(model: &Incompressible) -> Field {
    project::interpolate_vector(&model.polarity.space, |x| {
        Point::new((2.0 * x.y).cos() + 0.2 * x.x, 0.8 * (2.0 * x.x).sin())
    })
}

/// Short numbers.
pub fn shown(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:.2e}")).collect::<Vec<_>>().join(", ")
}
