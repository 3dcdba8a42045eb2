//! Errors of the flow around a fixed disc in a tissue with all its stresses and a given polarity, against a mesh with a
//! hole.

use std::sync::Arc;

use monolayer::body::Hold;
use monolayer::cut::Class;
use monolayer::element::quadrature;
use monolayer::expression::Expression;
use monolayer::mesh::locate::Locator;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::{Conditions, Degrees, Description, Reactions};
use monolayer::shape::Wrench;
use monolayer::space::{Field, project};

use crate::common::*;
use crate::setting::*;

const CENTRE: Point = Point::new(0.513, 0.478);
const RADIUS: f64 = 0.17;
/// From the unit square to the strip with the hole.
const SHIFT: Point = Point::new(0.0, -0.5);

/// `c + A y (1 − |y|²/(3R²))`, `y = x − x_c`: `∂p/∂n = 0` on the disc, and smooth inside of it.
fn polarity(centre: Point) -> [Expression; 2] {
    let (a, b, r2) = (centre.x, centre.y, 3.0 * RADIUS * RADIUS);
    let factor = format!("(1 - ((x-({a}))^2 + (y-({b}))^2)/{r2})");
    [format!("0.6 + 0.22*(x-({a}))*{factor}"), format!("0.3 + (0.18*(y-({b})) + 0.14*(x-({a})))*{factor}")]
        .map(|text| formula(&text))
}

fn walls(centre: Point) -> impl Fn(&str) -> Conditions {
    move |tag: &str| match tag {
        "disc" => no_slip(tag),
        _ => no_slip(tag).with_polarity(polarity(centre)),
    }
}

/// The flow of the polarity, and what it does to the disc.
fn flow(model: &Incompressible, centre: Point) -> (Field, Wrench) {
    let formulas = polarity(centre);
    let p = project::interpolate_vector(&model.polarity.space, |x| {
        Point::new(formulas[0].eval(x, 0.0), formulas[1].eval(x, 0.0))
    });
    let inputs = model.inputs(0.0).unwrap();
    let force = model.force(&p, &Field::zero(&model.momentum.velocity), &inputs);
    if model.bodies.is_some() {
        let carried = model.carry(&force, &inputs).unwrap();
        return (Field::new(&model.momentum.velocity, carried.v), carried.wrenches[0]);
    }
    let (v, pi) = model.flow_of(&force, &inputs).unwrap();
    let found = Reactions::of_incompressible(model, &State::incompressible(v.clone(), pi, p), 0.0).unwrap();
    let tag = model.loops.mesh.tags.iter().position(|tag| tag == "disc").unwrap();
    (v, Wrench { force: found.force(tag), torque: found.torque(tag, centre) })
}

/// On a mesh with a hole, of one degree more.
fn fitted() -> (Field, Wrench) {
    let centre = CENTRE + SHIFT;
    let mesh = mesh(&format!(
        "shape = \"strip-with-disc\"\nlength = [0.0, 1.0]\nwidth = 1.0\nradius = {RADIUS}\ncentre = [{}, {}]\n\
         h = 0.05\nh_disc = 0.03\ncurved = 3",
        centre.x, centre.y
    ));
    let mut description = Description::new(&mesh, with_factors(), walls(centre));
    description.degrees = Degrees { velocity: 3, pressure: 2, polarity: 4, ..description.degrees };
    flow(&Incompressible::new(&mesh, &description).unwrap(), centre)
}

/// `‖v − w‖` over the tissue; in cut cells at the middles of small triangles, for w means nothing in the hole.
fn distance(model: &Incompressible, v: &Field, (w, locator): (&Field, &Locator)) -> f64 {
    const PARTS: usize = 12;
    let (mesh, cover): (&Arc<Mesh>, _) = (&model.loops.mesh, &model.bodies.as_ref().unwrap().covered.cover);
    let mut sum = 0.0;
    let mut add = |cell: usize, xi: Point, weight: f64| {
        let (x, jacobian) = mesh.map(cell).at(xi);
        let (there, at) = locator.locate_near(&w.space.mesh, x + SHIFT, 1e-3).expect("the strip has the point");
        sum += weight * jacobian.determinant() * (v.vector_at(cell, xi) - w.vector_at(there, at)).norm_squared();
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
                        if (mesh.map(cell).at(xi).0 - CENTRE).norm() > RADIUS {
                            add(cell, xi, 0.5 * step * step);
                        }
                    }
                }
            }
        }
    }
    sum.sqrt()
}

#[test]
fn velocity_and_drag_of_a_fixed_disc_have_the_order_of_the_degree() {
    let (exact, wrench) = fitted();
    let locator = Locator::new(&exact.space.mesh);
    println!("fitted: {wrench:.6?}");
    let errors = [8, 16, 32].map(|n| {
        let mesh = mesh(&format!("shape = \"square\"\nn = {n}"));
        let model = around(&mesh, with_factors(), &walls(CENTRE), vec![round(RADIUS, CENTRE.into(), Hold::Fixed)]);
        let (v, found) = flow(&model, CENTRE);
        let drag = (found.force - wrench.force).norm() / wrench.force.norm();
        let torque = (found.torque - wrench.torque).abs() / wrench.torque.abs();
        let l2 = distance(&model, &v, (&exact, &locator));
        println!("n = {n}: L² {l2:.3e}, force {drag:.2e}, torque {torque:.2e}");
        [l2, drag, torque]
    });
    let order = |k: usize| (errors[0][k] / errors[2][k]).log2() / 2.0;
    println!("orders {:.2?}", [0, 1, 2].map(order));
    assert!(order(0) > 2.7 && order(1) > 2.7 && order(2) > 2.7);
    assert!(errors[2][1] < 1e-3 && errors[2][2] < 1e-3);
}
