//! Where nothing moves nothing must; what bodies feel is what holds them and what walls feel.

use monolayer::body::{Body, Hold};
use monolayer::mesh::Point;
use monolayer::model::fields::VELOCITY;
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::{Conditions, Parameters, Reactions};
use monolayer::shape::Twist;
use monolayer::space::{Field, project};

use crate::common::*;
use crate::setting::*;

/// A free disc, a fixed capsule and a pinned disc, some of them cut by the same cells.
fn bodies() -> Vec<Body> {
    vec![
        disc(0.14, [0.33, 0.42], Hold::Free),
        capsule([0.68, 0.61], 0.7, Hold::Fixed),
        disc(0.09, [0.7, 0.2], Hold::Pinned(Point::new(0.05, 0.0))),
    ]
}

#[test]
fn a_uniform_stress_moves_nothing() {
    let parameters = Parameters { traction: 0.0, friction: 0.0, ..with_factors() };
    for condition in [no_slip as fn(&str) -> Conditions, slip] {
        let parameters = Parameters { friction: if condition("").velocity == no_slip("").velocity { 0.0 } else { 1.0 }, ..parameters };
        let model = around(&square(6), parameters, &condition, bodies());
        // of length 1: no molecular field
        let p = project::interpolate_vector(&model.polarity.space, |_| Point::new(0.6, -0.8));
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
        let state = State::incompressible(Field::new(&model.momentum.velocity, carried.v.clone()), Field::new(&model.momentum.pressure, carried.pi), p);
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
        assert!((a.velocity - b.velocity).norm() < 1e-11 * speed && (a.spin - b.spin).abs() < 1e-10 * speed);
    }
    assert!(found[0].velocity.norm() > 1e-3 && found[1] == Twist::ZERO && found[2].spin.abs() > 1e-3);
}

#[test]
fn a_flow_that_was_solved_for_leaves_nothing_and_another_does() {
    let model = around(&square(6), with_factors(), &slip, bodies());
    let solved = state(&model, random(&model.polarity.space, 3));
    let residuals = model.residuals(&solved, 0.0).unwrap();
    let left: Vec<f64> = residuals.each().map(|(_, r)| r).collect();
    println!("{left:.1e?}");
    assert!(left[0] < 1e-10 && left[1] < 1e-9);
    let mut other = solved.clone();
    other = other.with(VELOCITY, Field::new(&model.momentum.velocity, solved[VELOCITY].values.iter().map(|v| 1.01 * v).collect()));
    let left: Vec<f64> = model.residuals(&other, 0.0).unwrap().each().map(|(_, r)| r).collect();
    assert!(left[0] > 1e-3, "{left:?}");
}

#[test]
fn walls_and_bodies_hold_each_other() {
    let mesh = square(6);
    let push = Body { force: ["0.3".to_owned(), "-0.2".to_owned()].map(|f| formula(&f)), friction: 2.0, ..disc(0.14, [0.16, 0.42], Hold::Free) };
    let bodies = vec![push, capsule([0.68, 0.61], 0.7, Hold::Fixed)];
    let walls = |tag: &str| match tag {
        "left" => Conditions::flow([formula("0"), formula("0.3")]),
        _ => Conditions::slip(),
    };
    let parameters = with_factors();
    let model = around(&mesh, parameters, &walls, bodies);
    let state = state(&model, random(&model.polarity.space, 3));
    let (found, v) = (Reactions::of_incompressible(&model, &state, 0.0).unwrap(), &state[VELOCITY]);
    let (holding, twists) = (model.holding(&state, 0.0).unwrap(), model.twists(&state, 0.0).unwrap());
    let (p, l) = (&state[monolayer::model::fields::POLARITY], model.molecular(&state[monolayer::model::fields::POLARITY], 0.0).unwrap());
    let inner = |x: &monolayer::form::CellPoint| parameters.traction * p.vector(&x.site) - parameters.friction * v.vector(&x.site);
    let sum = |f: &(dyn Fn(&monolayer::form::CellPoint) -> f64 + Sync)| model.tissue().sum(9, f);
    let area = model.bodies.as_ref().unwrap().bodies()[0].shape.area();
    let (load, centre) = (Point::new(0.3, -0.2), [0, 1].map(|k| model.poses()[k].position));
    let of_first = load - 2.0 * area * twists[0].velocity;
    let moment = 2.0 * model.bodies.as_ref().unwrap().bodies()[0].shape.second_moment() * twists[0].spin;
    let force: Point = (0..mesh.tags.len()).map(|tag| found.force(tag)).sum();
    let wanted = Point::new(sum(&|x| inner(x).x), sum(&|x| inner(x).y)) + of_first + holding[1].force;
    assert!((force - wanted).norm() < 1e-10 * wanted.norm(), "{force} and {wanted}");
    let torque: f64 = (0..mesh.tags.len()).map(|tag| found.torque(tag, Point::zeros())).sum();
    let couple = |x: &monolayer::form::CellPoint| parameters.elasticity * l.vector(&x.site).perp(&p.vector(&x.site));
    let wanted = sum(&|x| x.site.x.perp(&inner(x)) + couple(x)) + centre[0].perp(&of_first) - moment
        + centre[1].perp(&holding[1].force) + holding[1].torque;
    assert!((torque - wanted).abs() < 1e-10 * wanted.abs(), "{torque} and {wanted}");
    assert!(holding[1].force.norm() > 1e-2 && twists[0].velocity.norm() > 1e-3);
}
