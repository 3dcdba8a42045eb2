//! Contact that acts on the flow: bodies that touch move as one flow moves them, with the forces of contact.

use std::sync::Arc;

use monolayer::body::{Body, Hold};
use monolayer::contact::in_flow::{Acting, FlowContact, FlowCoupling, Moment, Stepped};
use monolayer::contact::{Contact, Law, Settings as ContactSettings, Wall};
use monolayer::expression::Expression;
use monolayer::form::Linear;
use monolayer::mesh::{Point, generate::MeshScene};
use monolayer::model::Conditions;
use monolayer::model::immersed::FlowWithBodies;
use monolayer::model::immersed::flow::{Flow, Method, Penalty, Settings};
use monolayer::model::mobility::{Columns, Mobility};
use monolayer::model::momentum::SlipTreatment;
use monolayer::shape::{Capsule, Disc, Pose, Shape, Twist};

const FLOOR: Wall = Wall::Segment([Point::new(0.0, 0.0), Point::new(1.0, 0.0)]);
fn methods() -> [Method; 2] {
    [Method::Nitsche, Method::Penalty(Penalty::harmonic(1e-8))]
}

fn body(name: &str, shape: impl Into<Shape>, [x, y, angle]: [f64; 3], force: [f64; 2]) -> Body {
    let pose = Pose { position: Point::new(x, y), angle };
    Body { force: force.map(Expression::constant), ..Body::new(name, shape.into(), pose) }
}

/// A flow with contact.
struct World {
    flow: Flow,
    contact: FlowContact,
    columns: Columns,
    unpushed: Vec<Twist>,
}

impl World {
    /// In the unit square with 2n² cells, whose walls are at rest.
    fn new(n: usize, (method, order): (Method, usize), bodies: Vec<Body>, contact: ContactSettings) -> Self {
        let mesh = Arc::new(MeshScene::of("square").with("n", n).build().unwrap());
        let conditions = vec![Conditions::flow([0.0, 0.0].map(Expression::constant)); mesh.tags.len()];
        let settings = (Settings { method, order }, 0.0);
        let fluid = (0.0, SlipTreatment::default());
        let flow = Flow::new(&mesh, (2, 1), &conditions, fluid, bodies.clone(), settings).unwrap();
        let contact = FlowContact::new((&bodies, 0.0), &[FLOOR], contact, FlowCoupling::Loads).unwrap();
        let unpushed = flow.solve(&Linear::zero()).unwrap().twists;
        Self { flow, contact, columns: Columns::default(), unpushed }
    }

    fn ask<T>(&self, question: impl FnOnce(&FlowContact, &Moment) -> T) -> T {
        let Flow { guide, motion, t, momentum, .. } = &self.flow;
        let rules = guide.rules_of_change(&motion.poses);
        let mobility = Mobility { momentum, rules, columns: &self.columns };
        question(&self.contact, &Moment { guide, motion, t: *t, unpushed: &self.unpushed, flow: &mobility })
    }

    /// The flow with what contact does to it now.
    fn now(&self, dt: f64) -> (FlowWithBodies, Vec<Contact>) {
        let Acting { wrenches, contacts } = self.ask(|contact, moment| contact.act(moment, dt)).unwrap();
        (self.flow.solve_pushed(&Linear::zero(), &wrenches).unwrap(), contacts)
    }

    fn step(&mut self, dt: f64) -> Stepped {
        let made = self.ask(|contact, moment| contact.step(moment, dt)).unwrap();
        self.flow.advance(dt, &made.now, &made.by).unwrap();
        self.columns.clear();
        self.contact.restore(made.bonds.clone());
        self.unpushed = self.flow.solve(&Linear::zero()).unwrap().twists;
        made
    }
}

fn size(twist: &Twist) -> f64 {
    twist.velocity.norm().max(twist.spin.abs())
}

fn distance(a: &Twist, b: &Twist) -> f64 {
    size(&Twist { velocity: a.velocity - b.velocity, spin: a.spin - b.spin })
}

const WEIGHT: f64 = 5.0 * std::f64::consts::PI;

#[test]
fn what_lies_on_the_floor_is_at_rest() {
    for (method, order) in [(methods()[0], 1), (methods()[0], 2), (methods()[1], 2)] {
        let falling = body("disc", Disc { radius: 0.1 }, [0.47, 0.17, 0.0], [0.0, -WEIGHT]);
        let margin = ContactSettings { margin: 0.02, ..ContactSettings::default() };
        let mut world = World::new(16, (method, order), vec![falling], margin);
        let first = world.now(0.05).0.twists[0].velocity.y.abs();
        assert!(first > 0.1);
        for _ in 0..8 {
            world.step(0.05);
        }
        let (flow, contacts) = world.now(0.05);
        let fastest = flow.v.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let [force, gap] = [contacts[0].force, contacts[0].gap];
        println!("{method:?}, order {order}: max|v| {fastest:.1e} of {first}, force {force}, gap {gap}");
        assert!(fastest < 1e-9 * first && (force / WEIGHT - 1.0).abs() < 1e-9 && (gap - 0.02).abs() < 1e-12);
    }
}

/// A rod and a disc that are pressed on each other and on the floor, and a third body that only the flow moves.
fn crowd() -> Vec<Body> {
    vec![
        body("down", Disc { radius: 0.1 }, [0.3, 0.12 + 1e-9, 0.0], [1.0, -9.0]),
        body("rod", Capsule { half_length: 0.15, radius: 0.05 }, [0.3, 0.2909, 0.1], [0.0, -3.0]),
        body("other", Disc { radius: 0.08 }, [0.65, 0.3, 0.0], [0.0, 0.0]),
        Body {
            hold: Hold::Pinned(Point::new(-0.1, 0.0)),
            ..body("arm", Capsule { half_length: 0.1, radius: 0.05 }, [0.7, 0.7, 0.0], [0.0, -1.0])
        },
        Body { hold: Hold::Fixed, ..body("post", Disc { radius: 0.06 }, [0.78, 0.58, 0.0], [0.0, 0.0]) },
    ]
}

#[test]
fn the_way_of_bodies_is_that_of_the_flow_with_the_forces_of_contact() {
    // the penalty has no two bodies in a cell one of which is held
    for (method, count) in methods().into_iter().zip([5, 3]) {
        let bodies = crowd().into_iter().take(count).collect();
        let mut world =
            World::new(12, (method, 1), bodies, ContactSettings { margin: 0.02, ..ContactSettings::default() });
        for step in 0..6 {
            let (flow, contacts) = world.now(0.02);
            let acting = contacts.iter().filter(|contact| contact.force > 0.0).count();
            let made = world.step(0.02);
            for ((by, now), (body, twist)) in made.by.iter().zip(&made.now).zip(flow.twists.iter().enumerate()) {
                let name = &world.flow.guide.bodies[body].name;
                // the chord of the way of a body on a pin is not its tangent
                let scale = if name == "arm" { 2e-2 } else { 1e-9 };
                assert!(distance(now, twist) < 1e-9, "{method:?}, step {step}, {name}: {now:?}, {twist:?}");
                assert!(distance(by, twist) < scale, "{method:?}, step {step}, {name}: {by:?}, {twist:?}");
            }
            assert!(acting >= 2, "{method:?}, step {step}: {contacts:?}");
            assert!(size(&flow.twists[2]) > 1e-4, "the flow moves what nothing touches: {:?}", flow.twists[2]);
        }
    }
}

#[test]
fn motions_of_second_order_end_where_those_of_first_order_rest() {
    // the disc rolls the rod off; whoever is not touched moves with the second order all the time
    let ends = [1, 2].map(|order| {
        let mut world = World::new(
            10,
            (Method::Nitsche, order),
            crowd(),
            ContactSettings { margin: 0.02, ..ContactSettings::default() },
        );
        for _ in 0..10 {
            let made = world.step(0.02);
            assert!(made.contacts.iter().all(|contact| contact.gap > 0.02 - 1e-12), "{:?}", made.contacts);
        }
        world.flow.motion.poses
    });
    for (a, b) in ends[0].iter().zip(&ends[1]) {
        assert!((a.position - b.position).norm() < 2e-3, "{a:?} {b:?}");
    }
}

/// Pressed on the floor and pulled off: a bond holds until it has been pulled as much as it was pressed.
#[test]
fn glue_in_a_flow_holds_as_long_as_it_was_pressed() {
    let force = Expression::of_body("if(t < 0.2, -4, 4)", &[]).unwrap();
    let mut pressed = body("disc", Disc { radius: 0.1 }, [0.5, 0.13, 0.0], [0.0, 0.0]);
    pressed.force = [Expression::constant(0.0), force];
    let law = Law::Gluey { gamma_min: f64::NEG_INFINITY };
    let settings = ContactSettings { law, margin: 0.03, ..ContactSettings::default() };
    let mut world = World::new(10, (Method::Nitsche, 1), vec![pressed], settings);
    let (mut gamma, mut left) = (0.0_f64, None);
    for step in 1..=60 {
        let (flow, contacts) = world.now(0.01);
        let held = flow.twists[0].velocity.y;
        let made = world.step(0.01);
        let gap = world.flow.motion.poses[0].position.y - 0.13;
        let of_contact = made.contacts.first().or(contacts.first()).map_or(0.0, |contact| contact.gamma);
        assert!(gap > -1e-12 && of_contact <= 0.0 && (gap.abs() < 1e-11 || of_contact == 0.0), "step {step}");
        gamma = gamma.min(of_contact);
        if gap > 1e-6 && left.is_none() {
            left = Some(step);
        } else if left.is_none() {
            assert!(held.abs() < 1e-9, "step {step}: {held}");
        }
    }
    // γ = −R ∫ λ with R = 1/r² falls for 0.2 and rises for as long
    println!("γ fell to {gamma}, and the disc left in step {left:?}");
    assert!((gamma + 100.0 * 0.2 * 4.0).abs() < 0.03 * 80.0 && left.is_some_and(|step| (40..=42).contains(&step)));
}
