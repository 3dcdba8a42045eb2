//! Rigid bodies by penalty in a Stokes flow: `cargo run --release --example bodies -- shear|settling|epsilon|factors`.
//!
//! `shear`: spin of a disc in a shear flow, exactly 1/2. `settling`: errors and orders in the cell size of a disc that falls in a box, on meshes whose edges
//! follow it and on meshes that it cuts. `epsilon`: orders in the penalty. `factors`: what a moved body costs with factors made anew, made anew in part, and
//! kept as a preconditioner.

use std::sync::Arc;
use std::time::Instant;

use monolayer::body::flow::{Flow, Settings};
use monolayer::body::{Body, Hold, Pose, Shape, Twist};
use monolayer::form::{Linear, mass};
use monolayer::mesh::generate::{MeshScene, Shape as Domain};
use monolayer::mesh::locate::Locator;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::immersed::Carried;
use monolayer::model::momentum::SlipTreatment;
use monolayer::model::{Conditions, Expression, PolarityCondition, VelocityCondition};
use monolayer::solve::sparse::Factored;
use monolayer::space::Field;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    match std::env::args().nth(1).as_deref() {
        Some("shear") => shear(),
        Some("settling") => settling(),
        Some("epsilon") => epsilon(),
        Some("factors") => factors(),
        Some(_) | None => Err("name one of shear, settling, epsilon, factors".into()),
    }
}

/// The unit square with `2n²` cells.
fn cartesian(n: usize) -> Result<Arc<Mesh>, Failure> {
    Ok(Arc::new(MeshScene { shape: Some(Domain::Square), n: Some(n), ..MeshScene::default() }.build()?))
}

/// The unit square whose edges follow a circle about its middle.
fn fitted(n: usize, radius: f64) -> Result<Arc<Mesh>, Failure> {
    let shape = Some(Domain::SquareWithCircle);
    Ok(Arc::new(MeshScene { shape, n: Some(n), radius: Some(radius), ..MeshScene::default() }.build()?))
}

/// The polygon that `4n` edges of the fitted mesh make of the circle.
fn polygon(n: usize, radius: f64) -> Shape {
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * ((k as f64 / n as f64 - 1.5) / 4.0);
        radius * Point::new(angle.cos(), angle.sin())
    };
    Shape::Polygon { vertices: (0..4 * n).map(corner).collect() }
}

fn body(shape: Shape, position: Point, force: [f64; 2]) -> Body {
    Body {
        name: "disc".into(),
        shape,
        hold: Hold::Free,
        density: 1.0,
        force: force.map(Expression::constant),
        torque: Expression::constant(0.0),
        friction: 0.0,
        start: Pose { position, angle: 0.0 },
        start_twist: Twist::ZERO,
    }
}

/// One velocity on all sides.
fn walls(velocity: [&str; 2]) -> Result<Vec<Conditions>, Failure> {
    let [x, y] = velocity.map(|text| Expression::parse(text, &[]));
    let velocity = VelocityCondition::Dirichlet([x?, y?]);
    Ok(vec![Conditions { velocity, polarity: PolarityCondition::Neumann, density: None }; 4])
}

fn flow(mesh: &Arc<Mesh>, velocity: [&str; 2], body: Body, epsilon: f64) -> Result<Flow, Failure> {
    let settings = Settings { epsilon, order: 1 };
    let friction = (0.0, SlipTreatment::Rotated);
    Ok(Flow::new(mesh, (2, 1), &walls(velocity)?, friction, vec![body], settings, 0.0)?)
}

const MIDDLE: Point = Point::new(0.5, 0.5);

/// `v = (0, x)` on the sides: the disc turns with spin 1/2.
fn shear() -> Result<(), Failure> {
    println!("|ω − 1/2| of a disc in the middle of the unit square, v = (0, x) on the sides, ε = 1e-8");
    println!("{:>6} {}", "n", [0.05, 0.1, 0.2, 0.3].map(|r| format!("{:>10}", format!("r = {r}"))).join(" "));
    for n in [13, 25, 50] {
        let mesh = cartesian(n)?;
        let mut row = Vec::new();
        for radius in [0.05, 0.1, 0.2, 0.3] {
            let disc = body(Shape::Disc { radius }, MIDDLE, [0.0, 0.0]);
            let carried = flow(&mesh, ["0", "x"], disc, 1e-8)?.solve(&Linear::zero())?;
            row.push(format!("{:>10.2e}", (carried.twists[0].spin - 0.5).abs()));
        }
        println!("{n:>6} {}", row.join(" "));
    }
    println!("spin by penalty, n = 25, r = 0.1");
    let mesh = cartesian(25)?;
    for epsilon in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14] {
        let disc = body(Shape::Disc { radius: 0.1 }, MIDDLE, [0.0, 0.0]);
        let carried = flow(&mesh, ["0", "x"], disc, epsilon)?.solve(&Linear::zero())?;
        println!("{epsilon:>8.0e} {:.15}", carried.twists[0].spin);
    }
    Ok(())
}

const RADIUS: f64 = 0.1;
/// Cells on a quarter of the circle in the reference.
const REFERENCE: usize = 48;

/// A disc that falls with the force (0, −500) per area.
fn falling(mesh: &Arc<Mesh>, shape: Shape, epsilon: f64) -> Result<(Flow, Carried), Failure> {
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

fn settling() -> Result<(), Failure> {
    let start = Instant::now();
    let mesh = fitted(REFERENCE, RADIUS)?;
    let (flow, carried) = falling(&mesh, polygon(REFERENCE, RADIUS), 1e-8)?;
    let size = flow.loops.sum(4, |_| 1.0);
    let reference = Field::new(&flow.momentum.velocity, carried.v.clone());
    let locator = Locator::new(&mesh);
    println!(
        "reference: {} cells, V = {:.6}, area {size:.3}, {:.1?}",
        mesh.cells.len(),
        carried.twists[0].velocity.y,
        start.elapsed()
    );
    type Case = Box<dyn Fn(usize) -> Result<(Arc<Mesh>, Shape), Failure>>;
    let disc = || Shape::Disc { radius: RADIUS };
    let cases: [(&str, Vec<usize>, f64, Case); 3] = [
        ("fitted, ε = 1e-8", vec![3, 6, 12, 24], 1e-8, Box::new(|n| Ok((fitted(n, RADIUS)?, polygon(n, RADIUS))))),
        ("Cartesian, ε = 1e-8", vec![10, 20, 40, 80], 1e-8, Box::new(move |n| Ok((cartesian(n)?, disc())))),
        (
            "Cartesian, ε = 1e-2",
            vec![10, 20, 40, 80],
            1e-2,
            Box::new(move |n| Ok((cartesian(n)?, Shape::Disc { radius: RADIUS }))),
        ),
    ];
    for (name, sizes, epsilon, case) in cases {
        println!("{name}");
        println!(
            "{:>6} {:>7} {:>10} {:>10} {:>10} {:>10} {:>10}  orders",
            "n", "cells", "V", "L²", "H¹", "best L²", "best H¹"
        );
        let mut before: Option<[f64; 4]> = None;
        for n in sizes {
            let (mesh, shape) = case(n)?;
            let (flow, carried) = falling(&mesh, shape, epsilon)?;
            let [l2, h1] = distance(&flow, &carried.v, (&reference, &locator));
            let best = projection(&flow, (&reference, &locator))?;
            let [best_l2, best_h1] = distance(&flow, &best, (&reference, &locator));
            let errors = [l2, h1, best_l2, best_h1];
            let orders = before.map_or(String::new(), |old: [f64; 4]| {
                let order = |k: usize| format!("{:>6.2}", (old[k] / errors[k]).log2());
                (0..4).map(order).collect::<Vec<_>>().join(" ")
            });
            let fall = carried.twists[0].velocity.y;
            println!(
                "{n:>6} {:>7} {fall:>10.6} {:>10.3e} {:>10.3e} {best_l2:>10.3e} {best_h1:>10.3e} {orders}",
                mesh.cells.len(),
                errors[0],
                errors[1]
            );
            before = Some(errors);
        }
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

fn factors() -> Result<(), Failure> {
    for n in [39, 77] {
        let mesh = cartesian(n)?;
        for radius in [0.05, 0.2] {
            for share in [0.1, 1.0] {
                let disc = body(Shape::Disc { radius }, MIDDLE, [0.0, -1.0]);
                let mut flow = flow(&mesh, ["0", "0"], disc, 1e-8)?;
                let step = share / n as f64;
                let twist = [Twist { velocity: Point::new(0.6, -0.8), spin: 0.0 }];
                let (mut moves, mut solves, mut part) = (0.0, 0.0, 0.0);
                for _ in 0..5 {
                    let start = Instant::now();
                    flow.advance(step, &twist, &twist)?;
                    moves += start.elapsed().as_secs_f64() / 5.0;
                    part += flow.momentum.bodies().expect("a body").share / 5.0;
                    let start = Instant::now();
                    flow.solve(&Linear::zero())?;
                    solves += start.elapsed().as_secs_f64() / 5.0;
                }
                println!(
                    "{} cells, radius {radius}, moves of {share} cells: move {:.1} ms ({:.0} % of the operations), solve {:.1} ms",
                    mesh.cells.len(),
                    1e3 * moves,
                    100.0 * part,
                    1e3 * solves
                );
            }
        }
    }
    Ok(())
}
