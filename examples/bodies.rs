//! Rigid bodies by penalty in a Stokes flow:
//! `cargo run --release --example bodies -- shear|offset|settling|epsilon|factors`.
//!
//! `shear`: spin of a disc in a shear flow, exactly 1/2. `offset`: spin of a disc beside the middle of a flow that is
//! no shear. `settling`: errors and orders in the cell size of a disc that falls in a box, on meshes whose edges follow
//! it and on meshes that it cuts. `epsilon`: orders in the penalty. `factors`: what a moved body costs with factors
//! made anew as a whole and in part.

use std::sync::Arc;
use std::time::Instant;

use monolayer::body::Body;
use monolayer::expression::Expression;
use monolayer::form::{Linear, mass};
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::locate::Locator;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::Conditions;
use monolayer::model::immersed::FlowWithBodies;
use monolayer::model::immersed::flow::{Flow, Method, Penalty, Settings};
use monolayer::model::momentum::SlipTreatment;
use monolayer::shape::{Disc, Polygon, Pose, Shape, Twist};
use monolayer::solve::sparse::Factored;
use monolayer::space::Field;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    match std::env::args().nth(1).as_deref() {
        Some("shear") => shear(),
        Some("offset") => offset(),
        Some("settling") => settling(),
        Some("epsilon") => epsilon(),
        Some("factors") => factors(),
        Some(_) | None => Err("name one of shear, offset, settling, epsilon, factors".into()),
    }
}

/// The unit square with `2n²` cells.
fn cartesian(n: usize) -> Result<Arc<Mesh>, Failure> {
    distorted(n, 0.0, 0)
}

/// The same with vertices moved at random by up to `distortion` cells.
fn distorted(n: usize, distortion: f64, seed: u64) -> Result<Arc<Mesh>, Failure> {
    let square = MeshScene::of("square").with("n", n).with("distortion", distortion).with("seed", seed);
    Ok(Arc::new(square.build()?))
}

/// The unit square whose edges follow a circle about its middle.
fn fitted(n: usize, radius: f64) -> Result<Arc<Mesh>, Failure> {
    Ok(Arc::new(MeshScene::of("square-with-circle").with("n", n).with("radius", radius).build()?))
}

/// The polygon that `4n` edges of the fitted mesh make of the circle.
fn polygon(n: usize, radius: f64) -> Shape {
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * ((k as f64 / n as f64 - 1.5) / 4.0);
        radius * Point::new(angle.cos(), angle.sin())
    };
    Shape::from(Polygon { vertices: (0..4 * n).map(corner).collect() })
}

fn body(shape: Shape, position: Point, force: [f64; 2]) -> Body {
    let force = force.map(Expression::constant);
    Body { force, ..Body::new("disc", shape, Pose { position, angle: 0.0 }) }
}

/// One velocity on all sides.
fn walls(velocity: [&str; 2]) -> Result<Vec<Conditions>, Failure> {
    let [x, y] = velocity.map(str::parse);
    Ok(vec![Conditions::flow([x?, y?]); 4])
}

fn flow(mesh: &Arc<Mesh>, velocity: [&str; 2], body: Body, epsilon: f64) -> Result<Flow, Failure> {
    let settings = Settings { method: Method::Penalty(Penalty::harmonic(epsilon)), order: 1 };
    let friction = (0.0, SlipTreatment::Rotated);
    Ok(Flow::new(mesh, (2, 1), &walls(velocity)?, friction, vec![body], (settings, 0.0))?)
}

const MIDDLE: Point = Point::new(0.5, 0.5);

/// `v = (0, x)` on the sides: the disc turns with spin 1/2.
fn shear() -> Result<(), Failure> {
    println!("|ω − 1/2| of a disc in the middle of the unit square, v = (0, x) on the sides, ε = 1e-8");
    println!("{:>24} {}", "mesh", [0.05, 0.1, 0.2, 0.3].map(|r| format!("{:>10}", format!("r = {r}"))).join(" "));
    let mut meshes = Vec::new();
    for n in [13, 25, 50] {
        meshes.push((format!("n = {n}"), cartesian(n)?));
    }
    for (distortion, seed) in [(0.1, 1), (0.2, 1), (0.2, 2), (0.3, 1), (0.3, 2)] {
        meshes.push((format!("n = 50, {distortion}, seed {seed}"), distorted(50, distortion, seed)?));
    }
    for (name, mesh) in meshes {
        let mut row = Vec::new();
        for radius in [0.05, 0.1, 0.2, 0.3] {
            let disc = body(Shape::from(Disc { radius }), MIDDLE, [0.0, 0.0]);
            let carried = flow(&mesh, ["0", "x"], disc, 1e-8)?.solve(&Linear::zero())?;
            row.push(format!("{:>10.2e}", (carried.twists[0].spin - 0.5).abs()));
        }
        println!("{name:>24} {}", row.join(" "));
    }
    println!("spin by penalty, n = 25, r = 0.1");
    let mesh = cartesian(25)?;
    for epsilon in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14] {
        let disc = body(Shape::from(Disc { radius: 0.1 }), MIDDLE, [0.0, 0.0]);
        let carried = flow(&mesh, ["0", "x"], disc, epsilon)?.solve(&Linear::zero())?;
        println!("{epsilon:>8.0e} {:.15}", carried.twists[0].spin);
    }
    Ok(())
}

/// `v = (0, x²)` on the sides.
fn offset() -> Result<(), Failure> {
    const FINE: usize = 112;
    println!(
        "spin of a disc of radius 0.17 at (0.43, 0.52), v = (0, x²) on the sides, ε = 1e-8; differences to the first \
         one"
    );
    let spin = |n: usize| -> Result<f64, Failure> {
        let disc = body(Shape::from(Disc { radius: 0.17 }), Point::new(0.43, 0.52), [0.0, 0.0]);
        Ok(flow(&cartesian(n)?, ["0", "x^2"], disc, 1e-8)?.solve(&Linear::zero())?.twists[0].spin)
    };
    let fine = spin(FINE)?;
    println!("{FINE:>6} {fine:.8}");
    for n in [7, 10, 14, 20, 28, 40, 56] {
        let spin = spin(n)?;
        println!("{n:>6} {spin:.8} {:>10.2e}", (spin - fine).abs());
    }
    Ok(())
}

const RADIUS: f64 = 0.1;
/// Cells on a quarter of the circle in the reference.
const REFERENCE: usize = 48;

/// A disc that falls with the force (0, −500) per area.
fn falling(mesh: &Arc<Mesh>, shape: Shape, epsilon: f64) -> Result<(Flow, FlowWithBodies), Failure> {
    let force = [0.0, -500.0 * std::f64::consts::PI * RADIUS * RADIUS];
    let flow = flow(mesh, ["0", "0"], body(shape, MIDDLE, force), epsilon)?;
    let carried = flow.solve(&Linear::zero())?;
    Ok((flow, carried))
}

/// `‖v − w‖` and `‖∇(v − w)‖` on the mesh of v, w a field on another mesh.
fn distance(flow: &Flow, v: &[f64], other: (&Field, &Locator)) -> [f64; 2] {
    let v = Field::new(&flow.momentum.velocity, v.to_vec());
    let (w, locator) = other;
    let at = |x: Point| locator.locate_near(&w.space.mesh, x, 1e-6).expect("both meshes cover the square");
    let value = flow.loops.sum(6, |x| {
        let (cell, xi) = at(x.site.x);
        (v.vector(&x.site) - w.vector_at(cell, xi)).norm_squared()
    });
    let slope = flow.loops.sum(6, |x| {
        let (cell, xi) = at(x.site.x);
        let step = 1e-6;
        let gradient = |k: usize| {
            let shift = if k == 0 { Point::new(step, 0.0) } else { Point::new(0.0, step) };
            (w.vector_at(cell, xi + shift) - w.vector_at(cell, xi - shift)) / (2.0 * step)
        };
        let reference = nalgebra::Matrix2::from_columns(&[gradient(0), gradient(1)]);
        let (_, jacobian) = w.space.mesh.map(cell).at(xi);
        let gradient = reference * jacobian.try_inverse().expect("cells are not flat");
        (v.vector_gradient(&x.site) - gradient).norm_squared()
    });
    [value.sqrt(), slope.sqrt()]
}

/// The L² projection of a field on the velocity space of a flow: about the best that the mesh can do.
fn projection(flow: &Flow, (w, locator): (&Field, &Locator)) -> Result<Vec<f64>, Failure> {
    let space = &flow.momentum.velocity;
    let value = |x: &monolayer::form::CellPoint| {
        let (cell, xi) = locator.locate_near(&w.space.mesh, x.site.x, 1e-6).expect("both meshes cover the square");
        w.vector_at(cell, xi)
    };
    let load = flow.loops.vector(&mass::load(space, 8, value), space);
    Ok(Factored::new("velocity mass", flow.momentum.velocity_mass.clone())?.solve(&load)?)
}

/// Least-squares orders of errors in 1/n.
fn orders(rows: &[(f64, [f64; 5])]) -> String {
    type Row = (f64, [f64; 5]);
    let mean = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).sum::<f64>() / rows.len() as f64;
    let x = mean(&|row| row.0.ln());
    let order = |k: usize| {
        let y = mean(&|row| row.1[k].ln());
        -mean(&|row| (row.0.ln() - x) * (row.1[k].ln() - y)) / mean(&|row| (row.0.ln() - x).powi(2))
    };
    (0..5).map(|k| format!("{:>6.2}", order(k))).collect::<Vec<_>>().join(" ")
}

fn settling() -> Result<(), Failure> {
    let start = Instant::now();
    let mesh = fitted(REFERENCE, RADIUS)?;
    let (flow, carried) = falling(&mesh, polygon(REFERENCE, RADIUS), 1e-8)?;
    let reference = Field::new(&flow.momentum.velocity, carried.v.clone());
    let locator = Locator::new(&mesh);
    let speed = carried.twists[0].velocity.y;
    println!("reference: {} cells, V = {speed:.6}, {:.1?}", mesh.cells.len(), start.elapsed());
    type Case = Box<dyn Fn(usize) -> Result<(Arc<Mesh>, Shape), Failure>>;
    let disc = || Shape::from(Disc { radius: RADIUS });
    let cases: [(&str, Vec<usize>, f64, Case); 4] = [
        ("fitted, ε = 1e-8", vec![3, 6, 12, 24], 1e-8, Box::new(|n| Ok((fitted(n, RADIUS)?, polygon(n, RADIUS))))),
        (
            "fitted, the disc itself, ε = 1e-8",
            vec![3, 6, 12, 24],
            1e-8,
            Box::new(move |n| Ok((fitted(n, RADIUS)?, disc()))),
        ),
        ("Cartesian, ε = 1e-8", vec![10, 20, 40, 80], 1e-8, Box::new(move |n| Ok((cartesian(n)?, disc())))),
        ("Cartesian, ε = 1e-2", vec![10, 20, 40, 80], 1e-2, Box::new(move |n| Ok((cartesian(n)?, disc())))),
    ];
    for (name, sizes, epsilon, case) in cases {
        println!("{name}");
        println!(
            "{:>6} {:>7} {:>10} {:>10} {:>10} {:>10} {:>10} {:>10}  orders",
            "n", "cells", "V", "V error", "L²", "H¹", "best L²", "best H¹"
        );
        let mut rows: Vec<(f64, [f64; 5])> = Vec::new();
        for n in sizes {
            let (mesh, shape) = case(n)?;
            let (flow, carried) = falling(&mesh, shape, epsilon)?;
            let [l2, h1] = distance(&flow, &carried.v, (&reference, &locator));
            let best = projection(&flow, (&reference, &locator))?;
            let [best_l2, best_h1] = distance(&flow, &best, (&reference, &locator));
            let fall = carried.twists[0].velocity.y;
            let errors = [(fall - speed).abs(), l2, h1, best_l2, best_h1];
            let orders = rows.last().map_or(String::new(), |row| orders(&[*row, (n as f64, errors)]));
            let numbers = errors.map(|e| format!("{e:>10.3e}")).join(" ");
            println!("{n:>6} {:>7} {fall:>10.6} {numbers} {orders}", mesh.cells.len());
            rows.push((n as f64, errors));
        }
        println!("{:>80} {}", "least squares", orders(&rows));
    }
    println!("{:.1?}", start.elapsed());
    Ok(())
}

/// `‖D(v)‖_{L²(B)}` and the distance to the smallest penalty, on one fitted mesh.
fn epsilon() -> Result<(), Failure> {
    let n = 12;
    let mesh = fitted(n, RADIUS)?;
    let (_, limit) = falling(&mesh, polygon(n, RADIUS), 1e-13)?;
    println!("orders in ε on a fitted mesh of {} cells", mesh.cells.len());
    println!(
        "{:>8} {:>10} {:>6} {:>10} {:>6} {:>10} {:>6}",
        "ε", "‖D(v)‖_B", "order", "‖v−v₀‖", "order", "V − V₀", "order"
    );
    let mut before: Option<[f64; 3]> = None;
    for epsilon in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let (flow, carried) = falling(&mesh, polygon(n, RADIUS), epsilon)?;
        let v = Field::new(&flow.momentum.velocity, carried.v.clone());
        let bodies = flow.momentum.bodies().expect("there is a body");
        let inside = flow.loops.inside(&bodies.immersion.cover, None);
        let strain = inside.sum(2, |x| {
            let g = v.vector_gradient(&x.site);
            (0.5 * (g + g.transpose())).norm_squared()
        });
        let difference: Vec<f64> = carried.v.iter().zip(&limit.v).map(|(a, b)| a - b).collect();
        let apart = flow.momentum.velocity_mass.quadratic(&difference).sqrt();
        let fall = (carried.twists[0].velocity.y - limit.twists[0].velocity.y).abs();
        let now = [strain.sqrt(), apart, fall];
        let order = |k: usize| before.map_or(String::new(), |old| format!("{:.2}", (old[k] / now[k]).log10()));
        println!(
            "{epsilon:>8.0e} {:>10.3e} {:>6} {:>10.3e} {:>6} {:>10.3e} {:>6}",
            now[0],
            order(0),
            now[1],
            order(1),
            now[2],
            order(2)
        );
        before = Some(now);
    }
    Ok(())
}

/// Milliseconds of a computation.
fn timed<T>(of: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let value = of();
    (value, 1e3 * start.elapsed().as_secs_f64())
}

fn factors() -> Result<(), Failure> {
    const MOVES: usize = 3;
    println!(
        "milliseconds of a move with factors made anew in part, of factors made anew as a whole, and of a solution"
    );
    println!(
        "{:>6} {:>6} {:>10} {:>8} {:>6} {:>8} {:>8}",
        "cells", "radius", "move/cell", "in part", "share", "anew", "solve"
    );
    for n in [39, 77] {
        let mesh = cartesian(n)?;
        for radius in [0.05, 0.2] {
            let disc = body(Shape::from(Disc { radius }), MIDDLE, [0.0, -1.0]);
            let mut moving = flow(&mesh, ["0", "0"], disc.clone(), 1e-8)?;
            for distance in [0.1, 1.0] {
                let step = distance / n as f64;
                let twist = [Twist { velocity: Point::new(0.6, -0.8), spin: 0.0 }];
                let (mut sums, mut share) = ([0.0; 3], 0.0);
                for _ in 0..MOVES {
                    let (moved, part) = timed(|| moving.advance(step, &twist, &twist));
                    moved?;
                    share += moving.momentum.bodies().expect("a body").share;
                    let there = Body { start: moving.motion.poses[0], ..disc.clone() };
                    let (anew, anew_time) = timed(|| flow(&mesh, ["0", "0"], there, 1e-8));
                    anew?;
                    let (solved, solve) = timed(|| moving.solve(&Linear::zero()));
                    solved?;
                    sums.iter_mut().zip([part, anew_time, solve]).for_each(|(sum, t)| *sum += t);
                }
                let [part, anew, solve] = sums.map(|sum| sum / MOVES as f64);
                println!(
                    "{:>6} {radius:>6} {distance:>10} {part:>8.1} {:>5.0}% {anew:>8.1} {solve:>8.1}",
                    mesh.cells.len(),
                    100.0 * share / MOVES as f64
                );
            }
        }
    }
    Ok(())
}
