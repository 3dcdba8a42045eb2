//! Forces on flow and bodies against the divergence theorem, and their derivative against differences.

use monolayer::body::Hold;
use monolayer::mesh::Point;
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::{Force, Incompressible, State};
use monolayer::model::tangent::Tangent;
use monolayer::model::{ElasticForce, Parameters};
use monolayer::shape::{Pose, Wrench};
use monolayer::space::{Field, project};
use nalgebra::Matrix2;

use crate::common::*;
use crate::setting::*;

fn polarity(x: Point) -> Point {
    Point::new(0.8 + 0.3 * x.x - 0.2 * x.y * x.y, 0.1 - 0.5 * x.x * x.y + 0.4 * x.y)
}

/// Any field in the place of `L_h/B`.
fn molecular(x: Point) -> Point {
    Point::new(0.2 - x.y + 0.7 * x.x * x.x, 0.3 * x.x + x.y * x.y)
}

/// The derivative of polynomials of degree 4 and below, to rounding.
fn slope<T>(f: impl Fn(Point) -> T, x: Point, along: usize) -> T
where
    T: std::ops::Mul<f64, Output = T> + std::ops::Sub<Output = T> + std::ops::Add<Output = T>,
{
    const H: f64 = 0.1;
    let at = |s: f64| {
        let mut y = x;
        y[along] += s * H;
        f(y)
    };
    ((at(1.0) - at(-1.0)) * 8.0 + (at(-2.0) - at(2.0))) * (1.0 / (12.0 * H))
}

/// All of the stress that does not depend on the flow, `σ_ij` what multiplies `∂_j w_i`, as docs/model.md has it.
fn stress(m: &Parameters, x: Point) -> Matrix2<f64> {
    let (p, l) = (polarity(x), molecular(x));
    let gradient = Matrix2::from_columns(&[slope(polarity, x, 0), slope(polarity, x, 1)]);
    let (lp, pl) = (l * p.transpose(), p * l.transpose());
    let alpha = m.factors.of("polar_stress");
    (lp - pl) * (0.5 * m.elasticity) + (lp + pl) * (0.5 * m.alignment * m.elasticity)
        - p * p.transpose() * m.active_stress
        - gradient.transpose() * gradient * (m.coherence.powi(2) * m.elasticity)
        + (gradient + gradient.transpose()) * (0.5 * alpha)
}

/// `∂_j σ_ij`
fn divergence(m: &Parameters, x: Point) -> Point {
    let [a, b] = [0, 1].map(|j| slope(|x| stress(m, x), x, j));
    Point::new(a[(0, 0)] + b[(0, 1)], a[(1, 0)] + b[(1, 1)])
}

fn force(model: &Incompressible) -> Force {
    let p = project::interpolate_vector(&model.polarity.space, polarity);
    let l = project::interpolate_vector(&model.polarity.space, molecular);
    model.inner_force(&p, Some(&l), &Field::zero(&model.momentum.velocity), 0.0)
}

#[test]
fn tractions_are_what_the_divergence_theorem_leaves() {
    let parameters = Parameters { traction: 0.0, ..with_factors() };
    assert!(parameters.factors.of("polar_stress") != 0.0);
    let bodies = vec![round(0.14, [0.33, 0.42], Hold::Free), capsule([0.68, 0.61], 0.7, Hold::Fixed)];
    let model = around(&square(5), parameters, &slip, bodies);
    let found = force(&model);
    // functions that vanish on the boundary of the square
    let w = project::interpolate_vector(&model.momentum.velocity, |x| {
        let bubble = if x.x.min(x.y) < 1e-12 || x.x.max(x.y) > 1.0 - 1e-12 { 0.0 } else { 1.0 };
        bubble * Point::new(1.0 + x.x - 2.0 * x.y, x.y * x.x - 0.7)
    });
    let wanted = model.tissue().sum(6, |x| divergence(&parameters, x.site.x).dot(&w.vector(&x.site)));
    let size = model.tissue().sum(6, |x| divergence(&parameters, x.site.x).norm() * w.vector(&x.site).norm());
    close(dot(&found.flow, &w.values), wanted, size, 1e-10);
    // the stress goes on into a body, n out of the tissue is into it
    for (body, pose) in model.poses().iter().enumerate() {
        let inside = model.loops.inside(&model.bodies.as_ref().unwrap().covered.cover, Some(body));
        let [x, y] = [0, 1].map(|c| inside.sum(6, |x| divergence(&parameters, x.site.x)[c]));
        let torque = inside.sum(8, |x| {
            let sigma = stress(&parameters, x.site.x);
            (x.site.x - pose.position).perp(&divergence(&parameters, x.site.x)) + sigma[(1, 0)] - sigma[(0, 1)]
        });
        let wrench = found.bodies[body];
        println!("{wrench:?} and {x} {y} {torque}");
        assert!(x.abs() > 1e-3 && torque.abs() > 1e-4, "something pulls");
        close(wrench.force.x, x, 1.0, 1e-11);
        close(wrench.force.y, y, 1.0, 1e-11);
        close(wrench.torque, torque, 1.0, 1e-11);
    }
}

#[test]
fn a_rigid_motion_of_all_does_no_work_but_for_couples() {
    let parameters = Parameters { traction: 0.0, ..with_factors() };
    let bodies = vec![round(0.14, [0.33, 0.42], Hold::Free), capsule([0.68, 0.61], 0.7, Hold::Free)];
    let model = around(&square(5), parameters, &slip, bodies);
    let (p, l) = (random(&model.polarity.space, 3), random(&model.polarity.space, 4));
    let found = model.inner_force(&p, Some(&l), &Field::zero(&model.momentum.velocity), 0.0);
    let size = found.flow.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
    for k in 0..3 {
        let motion = |x: Point| match k {
            0 => Point::x(),
            1 => Point::y(),
            _ => Point::new(-x.y, x.x),
        };
        let w = project::interpolate_vector(&model.momentum.velocity, motion);
        let of = |(wrench, pose): (&Wrench, &Pose)| {
            wrench.force.dot(&motion(pose.position)) + if k == 2 { wrench.torque } else { 0.0 }
        };
        let of_bodies: f64 = found.bodies.iter().zip(model.poses()).map(of).sum();
        let couple = model.tissue().sum(8, |x| parameters.elasticity * l.vector(&x.site).perp(&p.vector(&x.site)));
        let wanted = if k == 2 { couple } else { 0.0 };
        assert!(couple.abs() > 1e-3 && of_bodies.abs() > 1e-3);
        close(dot(&found.flow, &w.values) + of_bodies, wanted, size, 1e-11);
    }
}

fn state(model: &Incompressible) -> State {
    let p = random(&model.polarity.space, 11);
    State::incompressible(random(&model.momentum.velocity, 12), random(&model.momentum.pressure, 13), p)
}

/// All of a force in one list.
fn listed(force: &Force) -> Vec<f64> {
    let wrenches = force.bodies.iter().flat_map(|w| [w.force.x, w.force.y, w.torque]);
    force.flow.iter().copied().chain(wrenches).collect()
}

#[test]
fn the_derivative_of_a_force_is_that_of_both_its_parts() {
    for (elastic_force, hold) in [(ElasticForce::Stress, Hold::Free), (ElasticForce::Energy, Hold::Fixed)] {
        let parameters = Parameters { elastic_force, ..with_factors() };
        let bodies = vec![round(0.17, [0.33, 0.42], hold.clone()), capsule([0.68, 0.61], 0.7, hold)];
        let model = around(&square(3), parameters, &slip, bodies);
        let (now, t) = (state(&model), 0.0);
        let tangent = Tangent::new(&model, &now, &now[VELOCITY], 1.0, t);
        let inputs = model.inputs(t).unwrap();
        let along = random(&model.polarity.space, 5);
        // what fixed bodies feel moves nothing
        let both = |mut force: Force| {
            force.bodies.truncate(if elastic_force == ElasticForce::Stress { 2 } else { 0 });
            listed(&force)
        };
        let at = |s: f64| {
            let values = now[POLARITY].values.iter().zip(&along.values).map(|(p, d)| p + s * d).collect();
            both(model.force(&Field::new(&model.polarity.space, values), &now[VELOCITY], &inputs))
        };
        let (found, h) = (both(tangent.force_of(&along.values)), 1e-2);
        let size = found.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let [a, b, c, d] = [2.0, 1.0, -1.0, -2.0].map(|k| at(k * h));
        for (k, found) in found.iter().enumerate() {
            let difference = (8.0 * (b[k] - c[k]) - (a[k] - d[k])) / (12.0 * h);
            close(*found, difference, size, 1e-9);
        }
    }
}

#[test]
fn the_change_of_the_flow_is_that_of_the_flow() {
    let model = around(&square(4), with_factors(), &slip, vec![round(0.17, [0.43, 0.52], Hold::Free)]);
    let p = random(&model.polarity.space, 2);
    let along = random(&model.polarity.space, 5);
    let flow = |s: f64| {
        let values = p.values.iter().zip(&along.values).map(|(p, d)| p + s * d).collect();
        model.flow(&Field::new(&model.polarity.space, values), 0.0).unwrap()
    };
    let (v, pi) = flow(0.0);
    let now = State::incompressible(v.clone(), pi, p.clone());
    let (dv, dpi) = Tangent::new(&model, &now, &v, 0.0, 0.0).flow_of(&along.values).unwrap();
    let h = 1e-2;
    let [a, b, c, d] = [2.0, 1.0, -1.0, -2.0].map(|k| flow(k * h));
    let size = |values: &[f64]| values.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
    for (of, found) in [(0, &dv), (1, &dpi)] {
        let values = |flow: &(Field, Field)| if of == 0 { flow.0.values.clone() } else { flow.1.values.clone() };
        let [a, b, c, d] = [&a, &b, &c, &d].map(values);
        for (k, value) in found.iter().enumerate() {
            close(*value, (8.0 * (b[k] - c[k]) - (a[k] - d[k])) / (12.0 * h), size(found), 1e-8);
        }
    }
}

#[test]
fn what_has_no_traction_is_refused_of_bodies_that_move() {
    let parameters = Parameters { elastic_force: ElasticForce::Energy, ..ACTIVE };
    let mesh = square(3);
    let error = try_around(&mesh, parameters, &slip, vec![round(0.17, [0.43, 0.52], Hold::Free)]).unwrap_err();
    assert!(error.to_string().contains("has no traction on the body `disc`"), "{error}");
}
