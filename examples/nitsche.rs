//! Errors and costs of both methods for rigid bodies in a Stokes flow, on meshes that the bodies cut:
//! `cargo run --release --example nitsche -- table|channel|settling|plates|moves`.
//!
//! `table`: what a fixed and a falling disc are found with, against what they cost, on meshes of three kinds, for all
//! methods, as the table of `docs/bodies.md`.
//! `channel`: force, torque and slip of a fixed disc in Poiseuille flow. `settling`: velocities around a disc that
//! falls in a box, on Cartesian and on distorted meshes. `plates`: drag of a thin plate. `moves`: what a moved body
//! costs.

use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

use monolayer::body::{Body, Hold};
use monolayer::cut::Class;
use monolayer::element::{basis, quadrature};
use monolayer::expression::Expression;
use monolayer::form::Linear;
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::locate::Locator;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::Conditions;
use monolayer::model::immersed::FlowWithBodies;
use monolayer::model::immersed::flow::{Flow, Method, Penalty, Settings, Strength};
use monolayer::model::momentum::SlipTreatment;
use monolayer::shape::{Disc, Polygon, Pose, Shape, Twist, Wrench};
use monolayer::space::Field;
use nalgebra::Matrix2;

type Failure = Box<dyn std::error::Error>;

const METHODS: [(&str, Method); 3] = [
    ("Nitsche", Method::Nitsche),
    ("penalty", Method::Penalty(Penalty { epsilon: 1e-8, strength: Strength::Harmonic })),
    ("full", Method::Penalty(Penalty { epsilon: 1e-8, strength: Strength::Full })),
];
const MIDDLE: Point = Point::new(0.5, 0.5);

fn main() -> Result<(), Failure> {
    match std::env::args().nth(1).as_deref() {
        Some("table") => table(),
        Some("channel") => channel(),
        Some("settling") => settling(),
        Some("plates") => plates(),
        Some("moves") => moves(),
        Some(_) | None => Err("name one of table, channel, settling, plates, moves".into()),
    }
}

/// The unit square with `2n²` cells, inner vertices moved at random by up to a share of a cell.
fn square(n: usize, distortion: f64) -> Result<Arc<Mesh>, Failure> {
    Ok(Arc::new(MeshScene::of("square").with("n", n).with("distortion", distortion).with("seed", 5).build()?))
}

fn body(shape: impl Into<Shape>, position: Point, angle: f64) -> Body {
    Body::new("body", shape.into(), Pose { position, angle })
}

/// A flow with one velocity on all sides, and the milliseconds that it takes.
fn solved(
    mesh: &Arc<Mesh>,
    velocity: [&str; 2],
    body: Body,
    (method, degree): (Method, usize),
) -> Result<(Flow, FlowWithBodies, f64), Failure> {
    let [x, y] = velocity.map(str::parse);
    let conditions = vec![Conditions::flow([x?, y?]); 4];
    let (friction, settings) = ((0.0, SlipTreatment::Rotated), Settings { method, order: 1 });
    let begin = Instant::now();
    let flow = Flow::new(mesh, (degree, degree - 1), &conditions, friction, vec![body], (settings, 0.0))?;
    let carried = flow.solve(&Linear::zero())?;
    Ok((flow, carried, 1e3 * begin.elapsed().as_secs_f64()))
}

/// The largest `|v − u|` on the boundary of the body.
fn slip(flow: &Flow, carried: &FlowWithBodies) -> f64 {
    let v = Field::new(&flow.momentum.velocity, carried.v.clone());
    let surface = flow.momentum.cover().expect("there is a body").surface();
    let (twist, centre) = (carried.twists[0], flow.motion.poses[0].position);
    let mut largest = 0.0_f64;
    flow.loops.sum_outline(&surface, 0, 6, |x| {
        largest = largest.max((v.vector(&x.site) - twist.at(x.site.x, centre)).norm());
        0.0
    });
    largest
}

fn channel() -> Result<(), Failure> {
    println!("a fixed disc of radius 0.1 in the flow (4y(1−y), 0)");
    for (position, [drag, lift, torque]) in
        [(MIDDLE, [16.5989, 0.0, 0.0]), (Point::new(0.43, 0.61), [16.32190, -0.86896, 0.115380])]
    {
        println!("at ({}, {}): drag {drag}, lift {lift}, torque {torque}", position.x, position.y);
        println!("{:>10} {:>4} {:>10} {:>10} {:>10} {:>10} {:>8}", "", "n", "drag", "lift", "torque", "slip", "ms");
        for (name, method) in METHODS {
            for n in [16, 32, 64, 128] {
                let disc = Body { hold: Hold::Fixed, ..body(Disc { radius: 0.1 }, position, 0.0) };
                let (flow, carried, ms) = solved(&square(n, 0.0)?, ["4*y*(1-y)", "0"], disc, (method, 2))?;
                let wrench = carried.wrenches[0];
                let errors = [wrench.force.x - drag, wrench.force.y - lift, wrench.torque - torque];
                let [d, l, t] = errors.map(|e| format!("{e:>10.1e}"));
                println!("{name:>10} {n:>4} {d} {l} {t} {:>10.1e} {ms:>8.0}", slip(&flow, &carried));
            }
        }
    }
    Ok(())
}

/// Value and gradient of a field.
fn jet(field: &Field, cell: usize, xi: Point) -> (Point, Matrix2<f64>) {
    let (_, slopes) = basis::evaluate(field.space.degree, xi);
    let mut reference = Matrix2::<f64>::zeros();
    for c in 0..2 {
        for (slope, u) in slopes.iter().zip(field.coefficients(cell, c)) {
            (0..2).for_each(|k| reference[(c, k)] += slope[k] * u);
        }
    }
    let (_, jacobian) = field.space.mesh.map(cell).at(xi);
    (field.vector_at(cell, xi), reference * jacobian.try_inverse().expect("cells are not flat"))
}

/// `‖v − w‖` and `‖∇(v − w)‖` over the fluid; in cells that the body cuts by the middles of small triangles.
fn distance(flow: &Flow, carried: &FlowWithBodies, (w, locator): (&Field, &Locator)) -> [f64; 2] {
    const PARTS: usize = 12;
    let v = Field::new(&flow.momentum.velocity, carried.v.clone());
    let cover = flow.momentum.cover().expect("there is a body");
    let mesh = &flow.loops.mesh;
    let mut sums = [0.0; 2];
    let mut add = |cell: usize, xi: Point, weight: f64| {
        let (x, jacobian) = mesh.map(cell).at(xi);
        if cover.body(0).contains(x) {
            return;
        }
        let (other, there) = locator.locate_near(&w.space.mesh, x, 1e-6).expect("both meshes cover the square");
        let (mine, theirs) = (jet(&v, cell, xi), jet(w, other, there));
        let weight = weight * jacobian.determinant();
        sums[0] += weight * (mine.0 - theirs.0).norm_squared();
        sums[1] += weight * (mine.1 - theirs.1).norm_squared();
    };
    let rule = quadrature::triangle(6);
    let step = 1.0 / PARTS as f64;
    for cell in 0..mesh.cells.len() {
        match cover.cell(cell) {
            Class::Inside(_) => {}
            Class::Outside => rule.points.iter().zip(&rule.weights).for_each(|(xi, weight)| add(cell, *xi, *weight)),
            Class::Cut(_) => {
                for (i, j) in (0..PARTS).flat_map(|i| (0..PARTS - i).map(move |j| (i, j))) {
                    for third in [1.0, 2.0].into_iter().take(if i + j + 1 < PARTS { 2 } else { 1 }) {
                        let xi = Point::new(i as f64 + third / 3.0, j as f64 + third / 3.0) * step;
                        add(cell, xi, 0.5 * step * step);
                    }
                }
            }
        }
    }
    sums.map(f64::sqrt)
}

/// Least-squares order of errors in the number of cells on a side.
fn order(rows: &[(f64, f64)]) -> f64 {
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| rows.iter().map(f).sum::<f64>() / rows.len() as f64;
    let (x, y) = (mean(&|row| row.0.ln()), mean(&|row| row.1.ln()));
    -mean(&|row| (row.0.ln() - x) * (row.1.ln() - y)) / mean(&|row| (row.0.ln() - x).powi(2))
}

/// That falls with the force (0, −500) per area of a disc of radius 0.1.
fn falling(shape: Disc) -> Body {
    Body { force: [0.0, -500.0 * PI * 0.01].map(Expression::constant), ..body(shape, MIDDLE, 0.0) }
}

/// A disc of radius 0.1.
const DISC: Disc = Disc { radius: 0.1 };

fn settling() -> Result<(), Failure> {
    let falling = || falling(DISC);
    let (fine, exact, _) = solved(&square(64, 0.05)?, ["0", "0"], falling(), (Method::Nitsche, 3))?;
    let reference = Field::new(&fine.momentum.velocity, exact.v.clone());
    let locator = Locator::new(&fine.loops.mesh);
    let speed = exact.twists[0].velocity.y;
    println!("a disc of radius 0.1 that falls in the middle of a box, force (0, −500) per area: V₂ = {speed:.7}");
    println!(
        "{:>10} {:>10} {:>4} {:>10} {:>10} {:>10} {:>10} {:>8}",
        "", "distorted", "n", "L²", "H¹", "V₂", "V₁/V₂", "ms"
    );
    for (name, method) in METHODS {
        for distortion in [0.0, 0.2] {
            let mut rows: [Vec<(f64, f64)>; 3] = Default::default();
            for n in [16, 32, 64] {
                let (flow, carried, ms) = solved(&square(n, distortion)?, ["0", "0"], falling(), (method, 2))?;
                let [l2, h1] = distance(&flow, &carried, (&reference, &locator));
                let v = carried.twists[0].velocity;
                let error = v.y / speed - 1.0;
                println!(
                    "{name:>10} {distortion:>10} {n:>4} {l2:>10.2e} {h1:>10.2e} {error:>10.1e} {:>10.1e} {ms:>8.0}",
                    v.x / v.y
                );
                rows.iter_mut().zip([l2, h1, error.abs()]).for_each(|(row, e)| row.push((n as f64, e)));
            }
            let [l2, h1, v] = rows.map(|row| order(&row));
            println!("{:>26} {l2:>10.2} {h1:>10.2} {v:>10.2}", "orders");
        }
    }
    Ok(())
}

/// The unit square whose edges follow the disc with `4n` of them; it cuts slivers off the cells beside them.
fn fitted(n: usize) -> Result<Arc<Mesh>, Failure> {
    let scene = MeshScene::of("square-with-circle").with("n", n).with("radius", DISC.radius);
    Ok(Arc::new(scene.build()?))
}

/// On all sides: a drag, a lift and a torque.
const FLOW: [&str; 2] = ["8*y^2*(1-y)", "-x*(1-x)"];

fn table() -> Result<(), Failure> {
    let held = || Body { hold: Hold::Fixed, ..body(DISC, MIDDLE, 0.0) };
    let reference = |n: usize| -> Result<_, Failure> {
        let mesh = square(n, 0.05)?;
        let (_, fixed, _) = solved(&mesh, FLOW, held(), (Method::Nitsche, 3))?;
        let (flow, fallen, _) = solved(&mesh, ["0", "0"], falling(DISC), (Method::Nitsche, 3))?;
        let [Wrench { force, torque }] = fixed.wrenches[..] else { return Err("one body".into()) };
        Ok(([force.x, force.y, torque, fallen.twists[0].velocity.y], flow, fallen))
    };
    let (coarse, (exact, flow, fallen)) = (reference(24)?.0, reference(40)?);
    let locator = Locator::new(&flow.loops.mesh);
    let field = Field::new(&flow.momentum.velocity, fallen.v);
    let change = exact.iter().zip(coarse).map(|(fine, coarse)| (coarse / fine - 1.0).abs()).fold(0.0, f64::max);
    println!("reference, P3, n = 40: drag, lift, torque, speed {exact:.7?}; n = 24 differs by {change:.0e}\n");
    println!("| mesh | cells | method | drag | lift | torque | slip | speed | L² | H¹ | s |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    type Make = fn(usize) -> Result<Arc<Mesh>, Failure>;
    let cases: [(&str, [usize; 2], Make); 3] = [
        ("fitted", [6, 12], fitted),
        ("Cartesian", [16, 32], |n| square(n, 0.0)),
        ("distorted", [16, 32], |n| square(n, 0.2)),
    ];
    for (kind, sizes, make) in cases {
        for (name, method) in METHODS {
            for n in sizes {
                let mesh = make(n)?;
                let (flow, fixed, ms) = solved(&mesh, FLOW, held(), (method, 2))?;
                let Wrench { force, torque } = fixed.wrenches[0];
                let slip = slip(&flow, &fixed);
                let (flow, fallen, _) = solved(&mesh, ["0", "0"], falling(DISC), (method, 2))?;
                let [l2, h1] = distance(&flow, &fallen, (&field, &locator));
                let found = [force.x, force.y, torque, fallen.twists[0].velocity.y];
                let of = |k: usize| format!("{:.1e}", (found[k] / exact[k] - 1.0).abs());
                println!(
                    "| {kind} | {} | {name} | {} | {} | {} | {slip:.1e} | {} | {l2:.1e} | {h1:.1e} | {:.2} |",
                    mesh.cells.len(),
                    of(0),
                    of(1),
                    of(2),
                    of(3),
                    1e-3 * ms
                );
            }
        }
    }
    Ok(())
}

fn plates() -> Result<(), Failure> {
    println!("drag of a fixed plate, 0.42 × 0.02, in the flow (4y(1−y), 0)");
    println!("{:>10} {:>10} {:>10} {:>10} {:>10} {:>10}", "", "", "n = 16", "32", "64", "128");
    let corner = |x: f64, y: f64| Point::new(0.21 * x, 0.01 * y);
    let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    for (name, method) in METHODS {
        for (how, angle) in [("along", 0.0), ("across", 0.5 * PI)] {
            let mut row = Vec::new();
            for n in [16, 32, 64, 128] {
                let shape = Polygon { vertices: vertices.clone() };
                let plate = Body { hold: Hold::Fixed, ..body(shape, MIDDLE, angle) };
                let (_, carried, _) = solved(&square(n, 0.0)?, ["4*y*(1-y)", "0"], plate, (method, 2))?;
                row.push(format!("{:>10.3}", carried.wrenches[0].force.x));
            }
            println!("{name:>10} {how:>10} {}", row.join(" "));
        }
    }
    Ok(())
}

fn moves() -> Result<(), Failure> {
    const MOVES: usize = 5;
    println!("milliseconds of a move, of a solution, and of a flow that is made anew");
    println!(
        "{:>10} {:>6} {:>6} {:>10} {:>8} {:>8} {:>8}",
        "", "cells", "radius", "move/cell", "move", "solve", "anew"
    );
    for n in [39, 77] {
        let mesh = square(n, 0.0)?;
        for (name, method) in METHODS {
            for radius in [0.05, 0.2] {
                for distance in [0.1, 1.0] {
                    let disc = body(Disc { radius }, MIDDLE, 0.0);
                    let (mut flow, _, anew) = solved(&mesh, ["0", "0"], disc, (method, 2))?;
                    let twist = [Twist { velocity: Point::new(0.6, -0.8), spin: 0.0 }];
                    let (mut moved, mut found) = (0.0, 0.0);
                    for _ in 0..MOVES {
                        let begin = Instant::now();
                        flow.advance(distance / n as f64, &twist, &twist)?;
                        moved += begin.elapsed().as_secs_f64();
                        let begin = Instant::now();
                        flow.solve(&Linear::zero())?;
                        found += begin.elapsed().as_secs_f64();
                    }
                    let [moved, found] = [moved, found].map(|t| 1e3 * t / MOVES as f64);
                    let cells = mesh.cells.len();
                    println!("{name:>10} {cells:>6} {radius:>6} {distance:>10} {moved:>8.1} {found:>8.1} {anew:>8.1}");
                }
            }
        }
    }
    Ok(())
}
