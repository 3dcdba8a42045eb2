//! Forces on the boundary: what all tags add up to, and what tractions make of them.

use std::sync::Arc;

use crate::common::*;
use crate::model::{PARAMETERS, formula};
use monolayer::body::{Body, Hold};
use monolayer::form::Faces;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::compressible::Compressible;
use monolayer::model::fields::{DENSITY, POLARITY, VELOCITY};
use monolayer::model::immersed::flow::{Flow, Method, Penalty, Settings};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::momentum::{SlipTreatment, outer_force};
use monolayer::model::parameters::DensityLaw;
use monolayer::model::{Conditions, Description, Fluid, Parameters, Reactions, Sources, VelocityCondition};
use monolayer::shape::{Disc, Pose};
use monolayer::space::{Field, project};

fn pair(a: &str, b: &str) -> [monolayer::expression::Expression; 2] {
    [formula(a), formula(b)]
}

/// On every tag in turn another kind of condition.
fn condition(at: usize) -> Conditions {
    let traction = VelocityCondition::Traction(pair("0.3 + y", "x^2 - 0.1"));
    let moving = VelocityCondition::Dirichlet(pair("y*(1-y)", "0.2*x"));
    let friction = VelocityCondition::Friction(formula("1.5 + x"));
    let kinds = [traction, friction, moving, VelocityCondition::Slip];
    Conditions::new(kinds[at % kinds.len()].clone())
}

/// Force and torque about a point on all tags.
fn on_all(found: &Reactions, mesh: &Mesh, around: Point) -> (Point, f64) {
    let tags = 0..mesh.tags.len();
    (tags.clone().map(|tag| found.force(tag)).sum(), tags.map(|tag| found.torque(tag, around)).sum())
}

/// `−∫ g` and `−∫ (x−x₀) × g` over the first tag, whose traction is given.
fn given(mesh: &Arc<Mesh>, around: Point) -> (Point, f64) {
    let g = |x: Point| Point::new(0.3 + x.y, x.x * x.x - 0.1);
    let sum = |f: &(dyn Fn(Point) -> f64 + Sync)| loops(mesh).sum_faces(Faces::tag(0), 8, |s| f(s.minus.x));
    let force = Point::new(sum(&|x| -g(x).x), sum(&|x| -g(x).y));
    (force, sum(&|x| -(x - around).perp(&g(x))))
}

#[test]
fn of_a_stokes_flow_they_balance_what_acts_inside() {
    let sources = Sources { force: Some(pair("1 + x*y", "0.5 - y^2")), ..Sources::default() };
    let around = Point::new(0.3, -0.7);
    for mesh in [square(4), mesh("shape = \"strip-with-disc\"\nlength = [-2.0, 2.0]\nwidth = 4.0\nh = 0.7\ncurved = 2")]
    {
        let conditions: Vec<Conditions> = (0..mesh.tags.len()).map(condition).collect();
        for slip in [SlipTreatment::Rotated, SlipTreatment::Penalty { epsilon: 1e-6 }] {
            let fluid = Fluid { friction: 0.8 };
            let settings = (Settings::default(), 0.0);
            let flow = Flow::new(&mesh, (2, 1), &conditions, (fluid.friction, slip), Vec::new(), settings).unwrap();
            let velocity = &flow.momentum.velocity;
            let carried = flow.solve(&outer_force(velocity, &fluid, &conditions, &sources, 0.0)).unwrap();
            let found = Reactions::of_flow(&flow, &carried, &fluid, &sources).unwrap();
            let v = Field::new(velocity, carried.v.clone());
            let load = |x: Point, v: Point| Point::new(1.0 + x.x * x.y, 0.5 - x.y * x.y) - fluid.friction * v;
            let sum = |f: &(dyn Fn(Point, Point) -> f64 + Sync)| {
                flow.loops.sum(8, |x| f(x.site.x, load(x.site.x, v.vector(&x.site))))
            };
            let (force, torque) = on_all(&found, &mesh, around);
            close(force.x, sum(&|_, f| f.x), 10.0, 1e-12);
            close(force.y, sum(&|_, f| f.y), 10.0, 1e-12);
            close(torque, sum(&|x, f| (x - around).perp(&f)), 10.0, 1e-12);
        }
    }
}

/// A tag that meets no other: what is given there is what is found there.
#[test]
fn on_a_tag_with_a_traction_they_are_what_is_given() {
    let (mesh, around) =
        (mesh("shape = \"annulus\"\nradius = 2.0\ninner_radius = 1.0\nh = 0.6\ncurved = 2"), Point::new(0.3, 0.2));
    let conditions: Vec<Conditions> = [0, 2].map(condition).to_vec();
    let (fluid, sources) = (Fluid::default(), Sources::default());
    let slip = SlipTreatment::default();
    let flow = Flow::new(&mesh, (2, 1), &conditions, (0.0, slip), Vec::new(), (Settings::default(), 0.0)).unwrap();
    let carried = flow.solve(&outer_force(&flow.momentum.velocity, &fluid, &conditions, &sources, 0.0)).unwrap();
    let found = Reactions::of_flow(&flow, &carried, &fluid, &sources).unwrap();
    let (force, torque) = given(&mesh, around);
    close(found.force(0).x, force.x, 10.0, 1e-11);
    close(found.force(0).y, force.y, 10.0, 1e-11);
    close(found.torque(0, around), torque, 10.0, 1e-11);
}

/// The force that holds a body, its load and the friction of its area go through the boundary, too.
#[test]
fn with_bodies_in_the_flow_they_hold_these() {
    let mesh = square(8);
    let conditions = vec![Conditions::new(VelocityCondition::Dirichlet(pair("y", "0"))); mesh.tags.len()];
    let (fluid, slip) = (Fluid::default(), SlipTreatment::default());
    let disc =
        |x: f64| Body::new("disc", Disc { radius: 0.15 }.into(), Pose { position: Point::new(x, 0.4), angle: 0.0 });
    let fixed = Body { hold: Hold::Fixed, ..disc(0.3) };
    let pushed = Body { force: pair("2", "-3"), ..disc(0.7) };
    let settings = (Settings { method: Method::Penalty(Penalty::harmonic(1e-4)), order: 1 }, 0.0);
    let flow = Flow::new(&mesh, (2, 1), &conditions, (0.0, slip), vec![fixed, pushed], settings).unwrap();
    let sources = Sources::default();
    let carried = flow.solve(&outer_force(&flow.momentum.velocity, &fluid, &conditions, &sources, 0.0)).unwrap();
    let found = Reactions::of_flow(&flow, &carried, &fluid, &sources).unwrap();
    let (force, _) = on_all(&found, &mesh, Point::zeros());
    let wanted = carried.holding[0].force + Point::new(2.0, -3.0);
    assert!((force - wanted).norm() < 1e-8 * wanted.norm(), "{force} and {wanted}");
}

/// By Nitsche's method the forces on all tags and on all bodies add up to what acts on the fluid, whatever the tags'
/// conditions; one body is held, one pushed, one pinned, and one covers a part of the boundary.
#[test]
fn with_bodies_by_nitsche_s_method_they_balance_those_on_the_bodies() {
    let sources = Sources { force: Some(pair("1 + x*y", "0.5 - y^2")), ..Sources::default() };
    let (around, fluid) = (Point::new(0.3, -0.7), Fluid { friction: 0.8 });
    let disc = |radius: f64, x: f64, y: f64| {
        Body::new("disc", Disc { radius }.into(), Pose { position: Point::new(x, y), angle: 0.0 })
    };
    let bodies = || {
        vec![
            Body { hold: Hold::Fixed, ..disc(0.12, 0.3, 0.34) },
            Body { force: pair("2", "-3"), friction: 3.0, ..disc(0.15, 0.7, 0.65) },
            Body { hold: Hold::Pinned(Point::new(0.05, 0.0)), ..disc(0.09, 0.25, 0.7) },
            Body { hold: Hold::Fixed, ..disc(0.14, 0.62, 0.02) },
        ]
    };
    for degree in [2, 3] {
        // on each side another condition, and each condition under the last body
        for turn in 0..4 {
            let mesh = square(9);
            let conditions: Vec<Conditions> = (turn..turn + 4).map(condition).collect();
            let tag = mesh.tags.iter().position(|tag| tag == "bottom").unwrap();
            // what moves there moves the body
            let moves = matches!(conditions[tag].velocity, VelocityCondition::Dirichlet(_));
            let bodies: Vec<Body> = bodies().into_iter().take(if moves { 3 } else { 4 }).collect();
            for slip in [SlipTreatment::Rotated, SlipTreatment::Penalty { epsilon: 1e-6 }] {
                let (method, numbers) = (Method::Nitsche, (fluid.friction, slip));
                let settings = (Settings { method, order: 1 }, 0.0);
                let degrees = (degree, degree - 1);
                let flow = Flow::new(&mesh, degrees, &conditions, numbers, bodies.clone(), settings).unwrap();
                let velocity = &flow.momentum.velocity;
                let carried = flow.solve(&outer_force(velocity, &fluid, &conditions, &sources, 0.0)).unwrap();
                let found = Reactions::of_flow(&flow, &carried, &fluid, &sources).unwrap();
                let v = Field::new(velocity, carried.v.clone());
                let load = |x: Point, v: Point| Point::new(1.0 + x.x * x.y, 0.5 - x.y * x.y) - fluid.friction * v;
                let sum = |f: &(dyn Fn(Point, Point) -> f64 + Sync)| {
                    flow.fluid().sum(8, |x| f(x.site.x, load(x.site.x, v.vector(&x.site))))
                };
                let (mut force, mut torque) = on_all(&found, &mesh, around);
                let size = force.norm() + carried.wrenches.iter().map(|wrench| wrench.force.norm()).sum::<f64>();
                for (wrench, pose) in carried.wrenches.iter().zip(&flow.motion.poses) {
                    force += wrench.force;
                    torque += wrench.torque + (pose.position - around).perp(&wrench.force);
                }
                close(force.x, sum(&|_, f| f.x), size, 1e-11);
                close(force.y, sum(&|_, f| f.y), size, 1e-11);
                close(torque, sum(&|x, f| (x - around).perp(&f)), size, 1e-11);
            }
        }
    }
}

/// `∫ (f_v + T_a p − C_F v)` of a tissue.
fn inside(model_loops: &monolayer::form::Integrator, parameters: &Parameters, v: &Field, p: &Field) -> Point {
    let of = |c: usize| {
        model_loops.sum(8, |x| parameters.traction * p.vector(&x.site)[c] - parameters.friction * v.vector(&x.site)[c])
    };
    Point::new(of(0), of(1))
}

#[test]
fn of_a_tissue_they_balance_traction_and_friction() {
    let mesh = mesh("shape = \"strip-with-disc\"\nlength = [-2.0, 2.0]\nwidth = 4.0\nh = 0.8");
    let conditions = |tag: &str| {
        let at = mesh.tags.iter().position(|own| own == tag).unwrap();
        let condition = condition(at);
        if at == 1 { condition.with_polarity(pair("1", "0.2*y")) } else { condition }
    };
    let model = Incompressible::new(&mesh, &Description::new(&mesh, PARAMETERS, conditions)).unwrap();
    let p = project::interpolate_vector(&model.polarity.space, |x| Point::new(x.x.cos(), 0.5 * x.y.sin()));
    let (v, pi) = model.flow(&p, 0.0).unwrap();
    let found = Reactions::of_incompressible(&model, &State::incompressible(v.clone(), pi, p.clone()), 0.0).unwrap();
    let (force, _) = on_all(&found, &mesh, Point::zeros());
    let wanted = inside(&model.loops, &PARAMETERS, &v, &p);
    assert!((force - wanted).norm() < 1e-9 * wanted.norm(), "{force} and {wanted}");

    let law = DensityLaw { penalty: 1.5, exponent: 1.0, critical: 0.3, active_stress_iso: 0.4 };
    let parameters = Parameters { density: Some(law), ..PARAMETERS };
    let open = |tag: &str| match conditions(tag) {
        Conditions { velocity: VelocityCondition::Slip | VelocityCondition::Friction(_), polarity, .. } => {
            Conditions { polarity, ..Conditions::slip() }
        }
        other => other.with_density(formula("1.1")),
    };
    let model = Compressible::new(&mesh, &Description::new(&mesh, parameters, open)).unwrap();
    let p = project::interpolate_vector(&model.polarity.space, |x| Point::new(x.x.cos(), 0.5 * x.y.sin()));
    let rho = project::interpolate_scalar(&model.density.space, |x| 1.2 + 0.1 * x.x);
    let state = model.state_of(&model.stacked(&rho.values, &p.values), 0.0).unwrap();
    let found = Reactions::of_compressible(&model, &state, 0.0);
    assert!(state.get(DENSITY).is_some());
    let (force, _) = on_all(&found, &mesh, Point::zeros());
    let wanted = inside(&model.loops, &parameters, &state[VELOCITY], &state[POLARITY]);
    assert!((force - wanted).norm() < 1e-9 * wanted.norm(), "{force} and {wanted}");
}
