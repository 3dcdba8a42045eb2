//! Flows and errors that the tests share.

use std::f64::consts::PI;
use std::sync::Arc;

use monolayer::body::{Body, Hold};
use monolayer::cut::Class;
use monolayer::element::{basis, quadrature};
use monolayer::expression::Expression;
use monolayer::form::{Integrator, Linear};
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::locate::Locator;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::Conditions;
use monolayer::model::immersed::FlowWithBodies;
use monolayer::model::immersed::flow::{Flow, Method, Settings};
use monolayer::model::momentum::{MomentumError, SlipTreatment};
use monolayer::shape::{Disc, Pose, Shape};
use monolayer::space::Field;
use nalgebra::Matrix2;

pub const MIDDLE: Point = Point::new(0.5, 0.5);

/// The unit square with `2n²` cells.
pub fn square(n: usize) -> Arc<Mesh> {
    distorted(n, 0.0)
}

/// The same with inner vertices moved at random by up to a share of a cell.
pub fn distorted(n: usize, distortion: f64) -> Arc<Mesh> {
    let scene = MeshScene::of("square").with("n", n).with("distortion", distortion).with("seed", 5);
    Arc::new(scene.build().expect("a square"))
}

pub fn at(x: f64, y: f64, angle: f64) -> Pose {
    Pose { position: Point::new(x, y), angle }
}

pub fn disc(radius: f64, position: Point) -> Body {
    Body::new("disc", Shape::from(Disc { radius }), Pose { position, angle: 0.0 })
}

pub fn fixed(body: Body) -> Body {
    Body { hold: Hold::Fixed, ..body }
}

pub fn pushed(body: Body, force: [f64; 2], torque: f64) -> Body {
    Body { force: force.map(Expression::constant), torque: Expression::constant(torque), ..body }
}

pub fn formula(text: &str) -> Expression {
    Expression::parse(text, &[]).expect("a formula")
}

/// One velocity on all boundaries.
pub fn walls(mesh: &Mesh, velocity: [&str; 2]) -> Vec<Conditions> {
    vec![Conditions::flow(velocity.map(formula)); mesh.tags.len()]
}

pub fn try_flow(
    mesh: &Arc<Mesh>,
    conditions: &[Conditions],
    bodies: Vec<Body>,
    (degree, friction): (usize, f64),
) -> Result<Flow, MomentumError> {
    let settings = Settings { method: Method::Nitsche, order: 2 };
    let slip = SlipTreatment::Rotated;
    Flow::new(mesh, (degree, degree - 1), conditions, (friction, slip), bodies, (settings, 0.0))
}

/// A flow of degree 2, solved.
pub fn solved(mesh: &Arc<Mesh>, velocity: [&str; 2], bodies: Vec<Body>) -> (Flow, FlowWithBodies) {
    solved_with(mesh, velocity, bodies, 2)
}

pub fn solved_with(mesh: &Arc<Mesh>, velocity: [&str; 2], bodies: Vec<Body>, degree: usize) -> (Flow, FlowWithBodies) {
    let flow = try_flow(mesh, &walls(mesh, velocity), bodies, (degree, 0.0)).expect("a flow");
    let carried = flow.solve(&Linear::zero()).expect("a solution");
    (flow, carried)
}

/// A disc of radius 0.1 in the middle of the unit square that falls with the force (0, −500) per area.
pub fn falling(mesh: &Arc<Mesh>, position: Point, degree: usize) -> (Flow, FlowWithBodies) {
    let body = pushed(disc(0.1, position), [0.0, -500.0 * PI * 0.01], 0.0);
    solved_with(mesh, ["0", "0"], vec![body], degree)
}

/// The fluid of a flow.
pub fn fluid(flow: &Flow) -> Integrator {
    flow.loops.outside(flow.momentum.cover().expect("there are bodies"))
}

pub fn velocity(flow: &Flow, carried: &FlowWithBodies) -> Field {
    Field::new(&flow.momentum.velocity, carried.v.clone())
}

/// The largest `|v − u|` on the boundaries of the bodies.
pub fn slip(flow: &Flow, carried: &FlowWithBodies) -> f64 {
    let v = velocity(flow, carried);
    let surface = flow.momentum.cover().expect("there are bodies").surface();
    let mut largest = 0.0_f64;
    for (body, (twist, pose)) in carried.twists.iter().zip(&flow.motion.poses).enumerate() {
        flow.loops.sum_outline(&surface, body, 6, |x| {
            largest = largest.max((v.vector(&x.site) - twist.at(x.site.x, pose.position)).norm());
            0.0
        });
    }
    largest
}

/// `‖v − w‖` and `‖∇(v − w)‖` over the fluid of a flow, w a field on another mesh. In cells that a body cuts the
/// middles of small triangles are looked at, for w means nothing inside of the body.
pub fn distance(flow: &Flow, carried: &FlowWithBodies, (w, locator): (&Field, &Locator)) -> [f64; 2] {
    const PARTS: usize = 12;
    let (v, cover) = (velocity(flow, carried), flow.momentum.cover().expect("there are bodies"));
    let (mesh, other) = (&flow.loops.mesh, &w.space.mesh);
    let jet = |field: &Field, cell: usize, xi: Point| -> (Point, Matrix2<f64>) {
        let (_, slopes) = basis::evaluate(field.space.degree, xi);
        let mut reference = Matrix2::<f64>::zeros();
        for c in 0..2 {
            for (slope, u) in slopes.iter().zip(field.coefficients(cell, c)) {
                (0..2).for_each(|k| reference[(c, k)] += slope[k] * u);
            }
        }
        let (_, jacobian) = field.space.mesh.map(cell).at(xi);
        (field.vector_at(cell, xi), reference * jacobian.try_inverse().expect("cells are not flat"))
    };
    let mut sums = [0.0; 2];
    let mut add = |cell: usize, xi: Point, weight: f64| {
        let (x, jacobian) = mesh.map(cell).at(xi);
        let (there, xi_there) = locator.locate_near(other, x, 1e-6).expect("both meshes cover the square");
        let (mine, theirs) = (jet(&v, cell, xi), jet(w, there, xi_there));
        let weight = weight * jacobian.determinant();
        sums[0] += weight * (mine.0 - theirs.0).norm_squared();
        sums[1] += weight * (mine.1 - theirs.1).norm_squared();
    };
    let rule = quadrature::triangle(6);
    for cell in 0..mesh.cells.len() {
        match cover.cell(cell) {
            Class::Inside(_) => {}
            Class::Outside => rule.points.iter().zip(&rule.weights).for_each(|(xi, weight)| add(cell, *xi, *weight)),
            Class::Cut(_) => {
                let step = 1.0 / PARTS as f64;
                for (i, j) in (0..PARTS).flat_map(|i| (0..PARTS - i).map(move |j| (i, j))) {
                    let thirds = if i + j + 1 < PARTS { &[1.0, 2.0][..] } else { &[1.0][..] };
                    for third in thirds {
                        let xi = Point::new(i as f64 + third / 3.0, j as f64 + third / 3.0) * step;
                        let x = mesh.map(cell).at(xi).0;
                        if !cover.bodies().any(|body| body.contains(x)) {
                            add(cell, xi, 0.5 * step * step);
                        }
                    }
                }
            }
        }
    }
    sums.map(f64::sqrt)
}

/// Least-squares order of errors in the number of cells on a side.
pub fn order(rows: &[(usize, f64)]) -> f64 {
    let mean = |f: &dyn Fn(&(usize, f64)) -> f64| rows.iter().map(f).sum::<f64>() / rows.len() as f64;
    let x = mean(&|row| (row.0 as f64).ln());
    let y = mean(&|row| row.1.ln());
    let (cross, square) =
        (mean(&|r| ((r.0 as f64).ln() - x) * (r.1.ln() - y)), mean(&|r| ((r.0 as f64).ln() - x).powi(2)));
    -cross / square
}
