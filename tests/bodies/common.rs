//! Scenes that the tests share.

use std::sync::Arc;

use monolayer::body::Body;
use monolayer::expression::Expression;
use monolayer::form::Linear;
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::Conditions;
use monolayer::model::immersed::FlowWithBodies;
use monolayer::model::immersed::flow::{Flow, Method, Penalty, Settings};
use monolayer::model::momentum::{MomentumError, SlipTreatment};
use monolayer::shape::{Disc, Pose, Shape};

pub const MIDDLE: Point = Point::new(0.5, 0.5);

/// The unit square with `2n²` cells.
pub fn square(n: usize) -> Arc<Mesh> {
    Arc::new(MeshScene::of("square").with("n", n).build().expect("a square"))
}

pub fn disc(radius: f64, position: Point) -> Body {
    Body::new("disc", Shape::from(Disc { radius }), Pose { position, angle: 0.0 })
}

pub fn pushed(body: Body, force: [f64; 2], torque: f64) -> Body {
    Body { force: force.map(Expression::constant), torque: Expression::constant(torque), ..body }
}

pub fn formula(text: &str) -> Expression {
    Expression::parse(text, &[]).expect("a formula")
}

/// `left`, `right`, `bottom`, `top` with the same velocity.
pub fn walls(velocity: [&str; 2]) -> Vec<Conditions> {
    vec![Conditions::flow(velocity.map(formula)); 4]
}

/// What bodies are where nobody says it.
pub fn usual() -> Method {
    Settings::default().method
}

pub fn penalty(epsilon: f64) -> Method {
    Method::Penalty(Penalty::harmonic(epsilon))
}

/// With all of the penalty in cut cells.
pub fn full(epsilon: f64) -> Method {
    Method::Penalty(Penalty::full(epsilon))
}

pub fn flow_of(
    mesh: &Arc<Mesh>,
    conditions: &[Conditions],
    bodies: Vec<Body>,
    method: Method,
) -> Result<Flow, MomentumError> {
    let settings = Settings { method, ..Settings::default() };
    Flow::new(mesh, (2, 1), conditions, (0.0, SlipTreatment::Rotated), bodies, (settings, 0.0))
}

pub fn solved(mesh: &Arc<Mesh>, velocity: [&str; 2], bodies: Vec<Body>, method: Method) -> (Flow, FlowWithBodies) {
    let flow = flow_of(mesh, &walls(velocity), bodies, method).expect("a flow");
    let carried = flow.solve(&Linear::zero()).expect("a solution");
    (flow, carried)
}
