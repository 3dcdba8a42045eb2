//! Where nothing moves nothing must; what bodies feel is what holds them and what walls feel.

use monolayer::body::{Body, Hold};
use monolayer::form::CellPoint;
use monolayer::mesh::Point;
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::{Conditions, Parameters, Reactions};
use monolayer::shape::Twist;
use monolayer::space::{Field, project};

use crate::common::*;
use crate::setting::*;

/// A free disc, a fixed capsule and a pinned disc, some of them cut by the same cells.
fn bodies() -> Vec<Body> {
    vec![
        round(0.14, [0.33, 0.42], Hold::Free),
        capsule([0.68, 0.61], 0.7, Hold::Fixed),
        round(0.09, [0.7, 0.2], Hold::Pinned(Point::new(0.05, 0.0))),
    ]
}

#[test]
fn a_uniform_stress_moves_nothing() {
    type Condition = fn(&str) -> Conditions;
    // walls with slip bear no shear
    let cases = [(no_slip as Condition, 0.0, Point::new(0.6, -0.8)), (slip as Condition, 1.0, Point::new(1.0, 0.0))];
    for (condition, friction, uniform) in cases {
        let parameters = Parameters { traction: 0.0, friction, ..with_factors() };
        let model = around(&square(6), parameters, &condition, bodies());
        // of length 1: no molecular field
        let p = project::interpolate_vector(&model.polarity.space, |_| uniform);
        let inputs = model.inputs(0.0).unwrap();
        let force = model.force(&p, &Field::zero(&model.momentum.velocity), &inputs);
        let carried = model.carry(&force, &inputs).unwrap();
        let largest = carried.v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        println!("v {largest:.1e}, {:?}, {:?}", carried.twists, carried.wrenches);
        assert!(largest < 1e-12);
        for k in 0..3 {
            let (twist, wrench, held) = (carried.twists[k], carried.wrenches[k], carried.holding[k]);
            assert!(twist.velocity.norm() < 1e-12 && twist.spin.abs() < 1e-11, "{twist:?}");
            for wrench in [wrench, held] {
                assert!(wrench.force.norm() < 1e-12 && wrench.torque.abs() < 1e-13, "{wrench:?}");
            }
        }
        let v = Field::new(&model.momentum.velocity, carried.v);
        let state = State::incompressible(v, Field::new(&model.momentum.pressure, carried.pi), p);
        let residuals = model.residuals(&state, 0.0).unwrap();
        assert!(residuals.total() < 1e-11, "{residuals:?}");
    }
}

/// The state whose flow follows from a polarity.
fn state(model: &Incompressible, p: Field) -> State {
    let (v, pi) = model.flow(&p, 0.0).unwrap();
    State::incompressible(v, pi, p)
}

#[test]
fn the_twists_of_a_state_are_those_that_were_solved_for() {
    let model = around(&square(6), with_factors(), &slip, bodies());
    let p = random(&model.polarity.space, 3);
    let inputs = model.inputs(0.0).unwrap();
    let force = model.force(&p, &Field::zero(&model.momentum.velocity), &inputs);
    let carried = model.carry(&force, &inputs).unwrap();
    let found = model.twists(&state(&model, p), 0.0).unwrap();
    let speed = carried.v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    for (a, b) in carried.twists.iter().zip(&found) {
        println!("{a:?} and {b:?}");
        assert!((a.velocity - b.velocity).norm() < 1e-9 * speed && (a.spin - b.spin).abs() < 1e-8 * speed);
    }
    assert!(found[0].velocity.norm() > 1e-3 && found[1] == Twist::ZERO && found[2].spin.abs() > 1e-3);
}

#[test]
fn a_flow_that_was_solved_for_leaves_nothing_and_another_does() {
    let model = around(&square(6), with_factors(), &slip, bodies());
    let solved = state(&model, random(&model.polarity.space, 3));
    let residuals = model.residuals(&solved, 0.0).unwrap();
    let left: Vec<f64> = residuals.each().map(|(_, r)| r).collect();
    println!("{}", shown(&left));
    assert!(left[0] < 1e-8 && left[1] < 1e-8);
    let faster = solved[VELOCITY].values.iter().map(|v| 1.01 * v).collect();
    let other = solved.clone().with(VELOCITY, Field::new(&model.momentum.velocity, faster));
    let left: Vec<f64> = model.residuals(&other, 0.0).unwrap().each().map(|(_, r)| r).collect();
    assert!(left[0] > 1e-3, "{left:?}");
}

#[test]
fn walls_and_bodies_hold_each_other() {
    let mesh = square(6);
    let push = Body { force: ["0.3", "-0.2"].map(formula), friction: 2.0, ..round(0.14, [0.16, 0.42], Hold::Free) };
    let walls = |tag: &str| if tag == "left" { no_slip(tag) } else { slip(tag) };
    let parameters = with_factors();
    let model = around(&mesh, parameters, &walls, vec![push, capsule([0.68, 0.61], 0.7, Hold::Fixed)]);
    let state = state(&model, random(&model.polarity.space, 3));
    let (found, v, p) =
        (Reactions::of_incompressible(&model, &state, 0.0).unwrap(), &state[VELOCITY], &state[POLARITY]);
    let l = model.molecular(p, v, 0.0).unwrap();
    let (holding, twists) = (model.carried(&state, 0.0).unwrap().holding, model.twists(&state, 0.0).unwrap());
    let inner = |x: &CellPoint| parameters.traction * p.vector(&x.site) - parameters.friction * v.vector(&x.site);
    let couple = |x: &CellPoint| parameters.elasticity * l.vector(&x.site).perp(&p.vector(&x.site));
    let sum = |f: &(dyn Fn(&CellPoint) -> f64 + Sync)| model.tissue().sum(9, f);
    let shape = &model.bodies.as_ref().unwrap().bodies()[0].shape;
    let of_first = Point::new(0.3, -0.2) - 2.0 * shape.area() * twists[0].velocity;
    let turned = -2.0 * shape.second_moment() * twists[0].spin;
    let centre = [0, 1].map(|k| model.poses()[k].position);
    let force: Point = (0..mesh.tags.len()).map(|tag| found.force(tag)).sum();
    let wanted = Point::new(sum(&|x| inner(x).x), sum(&|x| inner(x).y)) + of_first + holding[1].force;
    println!("{force} and {wanted}");
    assert!((force - wanted).norm() < 1e-9 * wanted.norm());
    let torque: f64 = (0..mesh.tags.len()).map(|tag| found.torque(tag, Point::zeros())).sum();
    let of_bodies = centre[0].perp(&of_first) + turned + centre[1].perp(&holding[1].force) + holding[1].torque;
    let wanted = sum(&|x| x.site.x.perp(&inner(x)) + couple(x)) + of_bodies;
    println!("{torque} and {wanted}");
    assert!((torque - wanted).abs() < 1e-9 * wanted.abs());
    assert!(holding[1].force.norm() > 1e-2 && twists[0].velocity.norm() > 1e-3);
}
