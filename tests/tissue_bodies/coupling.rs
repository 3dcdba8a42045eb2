//! Bodies and tissue together: forces, energy, motion, restart.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::common::*;
use monolayer::body::guide::Guide;
use monolayer::body::{Body, Hold};
use monolayer::contact::in_flow::{FlowContact, FlowCoupling};
use monolayer::contact::{Settings as ContactSettings, Wall};
use monolayer::expression::Expression;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::fields::{PRESSURE, VELOCITY};
use monolayer::model::immersed::flow::{Method, Penalty};
use monolayer::model::incompressible::{Description, Incompressible, State};
use monolayer::model::{Conditions, ElasticForce, Parameters};
use monolayer::scheme::ControlSettings;
use monolayer::shape::{Disc, Pose, Shape};
use monolayer::space::{Field, project};
use monolayer::time::moving::MovingMarch;
use monolayer::time::{CouplingKind, CouplingSettings, March, MarchSettings};

const ACTIVE: Parameters = Parameters {
    friction: 3.0,
    traction: 3.0,
    active_stress: 0.4,
    peclet: 1.3,
    coherence: 0.2,
    elasticity: 0.6,
    alignment: 0.8,
    ..Parameters::PLAIN
};

fn formula(text: &str) -> Expression {
    Expression::of_body(text, &[]).expect("the test's formula parses")
}

fn disc(radius: f64, at: [f64; 2], hold: Hold) -> Body {
    let start = Pose { position: Point::from(at), angle: 0.0 };
    Body { hold, ..Body::new("disc", Shape::from(Disc { radius }), start) }
}

fn around(
    mesh: &Arc<Mesh>,
    parameters: Parameters,
    condition: &dyn Fn(&str) -> Conditions,
    body: Body,
) -> Incompressible {
    let description = Description::new(mesh, parameters, condition);
    let guide = Arc::new(Guide::new(vec![body]).unwrap());
    let poses = guide.starts(0.0).unwrap();
    let method = Method::Penalty(Penalty::harmonic(EPSILON));
    Incompressible::around(mesh, &description, &guide, &poses, method).unwrap()
}

fn closed(_: &str) -> Conditions {
    Conditions::slip()
}

fn settings(step: f64, order: usize, kind: CouplingKind) -> MarchSettings {
    let bounds = CouplingSettings { tolerance: 1e-9, accept: 1e-8, max_iterations: 200, ..Default::default() };
    let (control, coupling) = (ControlSettings::new(step).down_to(1e-9), CouplingSettings { kind, ..bounds });
    MarchSettings { control, coupling, ..MarchSettings::new(order, step) }
}

const EPSILON: f64 = 1e-8;

const ANDERSON: CouplingKind = CouplingKind::Anderson { depth: 5 };

fn swirl(model: &Incompressible) -> Field {
    project::interpolate_vector(&model.polarity.space, |x| {
        Point::new((2.0 * x.y).cos() + 0.2 * x.x, 0.8 * (2.0 * x.x).sin())
    })
}

#[test]
fn the_tissue_carries_a_disc_without_friction_at_its_own_speed() {
    let mesh = square(6);
    let one = || [formula("1"), formula("0")];
    let open = |tag: &str| match tag {
        "left" => Conditions::flow(one()).with_polarity(one()),
        "right" => Conditions::open(),
        _ => Conditions::slip(),
    };
    // an active stress would squeeze the cells that the disc cuts, which are not quite rigid
    let parameters = Parameters { active_stress: 0.0, ..ACTIVE };
    let model = around(&mesh, parameters, &open, disc(0.17, [0.3, 0.52], Hold::Free));
    let p = project::interpolate_vector(&model.polarity.space, |_| Point::new(1.0, 0.0));
    let mut march = MovingMarch::start(model, settings(0.05, 2, ANDERSON), p.values, (2, None)).unwrap();
    for step in 1..=5 {
        march.advance(10.0, &AtomicBool::new(false)).unwrap();
        let (twist, pose) = (march.twists()[0], march.poses()[0]);
        assert!((twist.velocity - Point::new(1.0, 0.0)).norm() < 1e-7 && twist.spin.abs() < 1e-6, "{twist:?}");
        assert!((pose.position.x - 0.3 - 0.05 * f64::from(step)).abs() < 1e-7, "{pose:?}");
    }
}

#[test]
fn the_force_that_holds_a_disc_holds_it_as_an_outer_force_too() {
    let mesh = square(5);
    let at = [0.47, 0.52];
    let fixed = around(&mesh, ACTIVE, &closed, disc(0.2, at, Hold::Fixed));
    let p = swirl(&fixed);
    let inputs = fixed.inputs(0.0).unwrap();
    let force = fixed.force(&p, &Field::zero(&fixed.momentum.velocity), &inputs);
    let held = fixed.carry(&force, &inputs).unwrap();
    let load = held.holding[0];
    assert!(load.force.norm() > 1e-2 && load.torque.abs() > 1e-4, "something is to be held: {load:?}");
    let mut body = disc(0.2, at, Hold::Free);
    body.force = [load.force.x, load.force.y].map(|f| formula(&format!("{f:e}")));
    body.torque = formula(&format!("{:e}", load.torque));
    let free = around(&mesh, ACTIVE, &closed, body);
    let carried = free.carry(&force, &free.inputs(0.0).unwrap()).unwrap();
    let speed = held.v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let twist = carried.twists[0];
    assert!(twist.velocity.norm() < 1e-8 * speed && twist.spin.abs() < 1e-7 * speed, "{twist:?}, {speed}");
}

#[test]
fn the_energy_law_holds_around_a_fixed_disc() {
    let mesh = square(4);
    let parameters = Parameters { elastic_force: ElasticForce::Energy, ..ACTIVE };
    let model = around(&mesh, parameters, &closed, disc(0.21, [0.47, 0.52], Hold::Fixed));
    let (m, p) = (&model.parameters, random(&model.polarity.space, 4));
    let inputs = model.inputs(0.0).unwrap();
    let (mut v, mut pi) = (model.zero().into_field(VELOCITY), model.zero().into_field(PRESSURE));
    for _ in 0..60 {
        (v, pi) = model.flow_of(&model.force(&p, &v, &inputs), &inputs).unwrap();
    }
    let l = model.molecular(&p, &v, 0.0).unwrap();
    let state = State::incompressible(v, pi, p.clone());
    let rate: Vec<f64> = model.polarity_residual(&state, 0.0).iter().map(|r| -r / m.peclet).collect();
    let gain = m.elasticity * dot(&l.values, &rate);
    let (v, tissue) = (&state[VELOCITY], model.tissue());
    let friction = tissue.sum(4, |x| m.friction * v.vector(&x.site).norm_squared());
    let viscous = model.loops.sum(2, |x| {
        let g = v.vector_gradient(&x.site);
        2.0 * ((g + g.transpose()) * 0.5).norm_squared()
    });
    // the body is rigid up to ε times the stress on it, and softer in cells that it cuts
    let inside = model.loops.inside(&model.bodies.as_ref().unwrap().covered.cover, None);
    let parts = &model.momentum.bodies().unwrap().immersion.parts[0];
    let bent = inside.sum(2, |x| {
        let g = v.vector_gradient(&x.site);
        2.0 * parts[&x.site.cell].strength(EPSILON) * ((g + g.transpose()) * 0.5).norm_squared()
    });
    let relaxation = m.elasticity * dot(&model.polarity.inertia_times(&l.values), &l.values) / m.peclet;
    let activity = tissue.sum(8, |x| {
        let (p, g) = (p.vector(&x.site), v.vector_gradient(&x.site));
        m.traction * p.dot(&v.vector(&x.site)) + m.active_stress * p.dot(&((g + g.transpose()) * 0.5 * p))
    });
    let defect = gain + friction + viscous + bent + relaxation - activity;
    let largest = [gain, friction, viscous, relaxation, activity].iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    println!("{gain:.4e} {friction:.4e} {viscous:.4e} {relaxation:.4e} {bent:.4e} {activity:.4e}: {defect:.1e}");
    assert!(defect.abs() < 1e-8 * largest, "the law leaves {defect:e} of {largest:e}");
}

#[test]
fn a_passive_sheet_with_a_fixed_disc_never_gains_energy() {
    let mesh = square(4);
    let parameters = Parameters { elastic_force: ElasticForce::Energy, traction: 0.0, active_stress: 0.0, ..ACTIVE };
    let model = around(&mesh, parameters, &closed, disc(0.21, [0.47, 0.52], Hold::Fixed));
    let start = random(&model.polarity.space, 2);
    for kind in [CouplingKind::Newton, ANDERSON] {
        let mut march = March::start(&model, settings(1e-3, 1, kind), start.values.clone()).unwrap();
        let mut last = march.energy().0;
        let first = last;
        for _ in 0..6 {
            march.advance(1e9).unwrap();
            let now = march.energy().0;
            assert!(now < last, "{kind:?}: {last} to {now}");
            last = now;
        }
        assert!(last < 0.9 * first, "{kind:?}: {first} to {last}");
    }
}

const RADIUS: f64 = 0.12;

/// A disc dragged through several cells.
fn dragged(steps: usize, resume_after: Option<usize>) -> (MovingMarch, f64) {
    let mesh = square(8);
    let hold = Hold::Held { velocity: [formula("0.6"), formula("0.2")], spin: formula("2") };
    let build = || around(&mesh, ACTIVE, &closed, disc(RADIUS, [0.35, 0.42], hold.clone()));
    let settings = settings(0.05, 2, ANDERSON);
    let model = build();
    let p = swirl(&model).values;
    let mut march = MovingMarch::start(model, settings, p, (2, None)).unwrap();
    let mut largest = 0.0_f64;
    for step in 1..=steps {
        march.advance(10.0, &AtomicBool::new(false)).unwrap();
        if resume_after == Some(step) {
            march = MovingMarch::resume(build(), settings, march.checkpoint(), None).unwrap();
        }
        let state = march.checkpoint().march.past[0].1.clone();
        let p = Field::new(&march.model().polarity.space, state);
        let model = march.model();
        for cell in 0..model.loops.mesh.cells.len() {
            model.tissue().each_cell_point(cell, 6, &mut |x| {
                let outside = (x.site.x - model.poses()[0].position).norm() > RADIUS;
                largest = if outside { largest.max(p.vector(&x.site).norm()) } else { largest };
            });
        }
    }
    (march, largest)
}

#[test]
fn the_polarity_stays_bounded_when_a_disc_sweeps_through_cells() {
    let (march, largest) = dragged(8, None);
    println!("largest |p| {largest:.3}");
    assert!(largest < 2.0, "{largest}");
    let moved = march.poses()[0].position - Point::new(0.35, 0.42);
    assert!((moved - Point::new(0.24, 0.08)).norm() < 1e-9, "{moved:?}");
}

#[test]
fn a_restart_and_other_threads_change_no_bit() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let whole = pool(1).install(|| dragged(4, None).0.checkpoint());
    let resumed = pool(3).install(|| dragged(4, Some(2)).0.checkpoint());
    assert_eq!(whole, resumed);
}

/// A disc that a tissue pushes along a floor and a force presses on it: contact acts on the flow.
#[test]
fn a_disc_on_the_floor_of_a_tissue_neither_sinks_nor_lifts() {
    let mesh = square(8);
    let floor = [Wall::Segment([Point::new(0.0, 0.0), Point::new(1.0, 0.0)])];
    for order in [1, 2] {
        let mut pressed = disc(RADIUS, [0.4, 0.2], Hold::Free);
        pressed.force = [formula("0"), formula("-40")];
        let model = around(&mesh, ACTIVE, &closed, pressed.clone());
        let p = swirl(&model).values;
        let kept = ContactSettings { margin: 0.04, overlap: 1e-3, ..ContactSettings::default() };
        let contact = FlowContact::new((&[pressed], ACTIVE.friction), &floor, kept, FlowCoupling::Loads).unwrap();
        let mut march = MovingMarch::start(model, settings(0.02, 2, ANDERSON), p, (order, Some(contact))).unwrap();
        let start = march.twists()[0].velocity.y;
        for _ in 0..40 {
            march.advance(10.0, &AtomicBool::new(false)).unwrap();
        }
        let (twist, pose, contact) = (march.twists()[0], march.poses()[0], march.contacts()[0]);
        println!("order {order}: {start} to {twist:?}, {pose:?}, {contact:?}");
        assert!(start < -0.1 && twist.velocity.y.abs() < 1e-9 * start.abs(), "{twist:?}");
        assert!((pose.position.y - RADIUS - 0.04).abs() < 1e-12 && contact.force > 1.0, "{pose:?} {contact:?}");
        // the state is that of its own equations, with the force of contact among the loads
        let residuals = march.with(|march| march.model.residuals(&march.state, march.t)).unwrap();
        let of = |id| residuals.each().find(|(known, _)| *known == id).unwrap().1;
        assert!(of(VELOCITY) < 1e-8 && of(PRESSURE) < 1e-8, "the coupling stops at 1e-9: {residuals:?}");
    }
}
