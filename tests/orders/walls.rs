//! Walls keep what they hold back where their conditions meet: the cavity with a moving lid, its corners, and parts
//! of one side.

use std::sync::Arc;

use monolayer::expression::Expression;
use monolayer::form::{Faces, Integrator};
use monolayer::measure::cut;
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::locate::Locator;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::frames::{Frames, WallPoints};
use monolayer::model::momentum::{Momentum, SlipTreatment};
use monolayer::model::terms::FlowTerms;
use monolayer::model::{Conditions, Fluid, VelocityCondition};
use monolayer::space::{Continuity, Field, Space};

/// Minimum of the stream function on x = 1/2 in the cavity with a lid of speed 1: beside the known −0.100076, `ψ(y) =
/// ∫₀^y v₁`.
const LEAST: f64 = -0.100076;

fn square(n: usize) -> Mesh {
    let scene: MeshScene = toml::from_str(&format!("shape = \"square\"\nn = {n}")).unwrap();
    scene.build().unwrap()
}

fn moving(v: [&str; 2]) -> VelocityCondition {
    VelocityCondition::Dirichlet(v.map(|text| Expression::parse(text, &[]).unwrap()))
}

fn at_rest() -> VelocityCondition {
    moving(["0", "0"])
}

/// Conditions by tag; the sides that are not named have `rest`.
fn conditions(mesh: &Mesh, rest: &VelocityCondition, named: &[(&str, VelocityCondition)]) -> Vec<Conditions> {
    let of = |tag: &String| named.iter().find(|(name, _)| name == tag).map_or(rest, |(_, c)| c).clone();
    mesh.tags.iter().map(|tag| Conditions::new(of(tag))).collect()
}

struct Flow {
    loops: Integrator,
    v: Field,
    /// Through every tag, outwards.
    fluxes: Vec<f64>,
}

fn flow(mesh: Mesh, conditions: &[Conditions], slip: SlipTreatment) -> Flow {
    let mesh = Arc::new(mesh);
    let loops = Integrator::new(&mesh);
    let velocity = Arc::new(Space::new(&mesh, Continuity::Continuous, 2, 2));
    let pressure = Arc::new(Space::new(&mesh, Continuity::Continuous, 1, 1));
    let terms = FlowTerms::of(&Fluid { friction: 0.0 });
    let momentum = Momentum::new(&loops, &velocity, &pressure, conditions, &terms, slip).unwrap();
    let prescribed = momentum.frames.prescribed(conditions, 0.0).unwrap();
    let (v, _) = momentum.solve(&vec![0.0; velocity.dof_count()], &prescribed).unwrap();
    let v = Field::new(&velocity, v);
    let through = |tag| loops.sum_faces(Faces::tag(tag), 4, |s| v.vector(&s.minus).dot(&s.n));
    let fluxes = (0..mesh.tags.len()).map(through).collect();
    Flow { loops, v, fluxes }
}

/// `min_y ∫₀^y v₁(1/2, ·)`, the integral of quadratics on the faces of x = 1/2.
fn least_stream(flow: &Flow, n: usize) -> f64 {
    let mesh = &flow.loops.mesh;
    let locator = Locator::new(mesh);
    let at = |y: f64| cut::value(&flow.v, &cut::both_sides(mesh, &locator, Point::new(0.5, y), Point::y()), 0);
    let step = 1.0 / (64 * n) as f64;
    let mut psi = 0.0;
    let mut all = vec![0.0];
    for k in 0..64 * n {
        let y = k as f64 * step;
        psi += step / 6.0 * (at(y) + 4.0 * at(y + 0.5 * step) + at(y + step));
        all.push(psi);
    }
    all.into_iter().fold(0.0, f64::min)
}

#[test]
fn a_moving_lid_lets_nothing_through_and_drives_the_cavity() {
    let stream = |n: usize| {
        let mesh = square(n);
        let conditions = conditions(&mesh, &at_rest(), &[("top", moving(["1", "0"]))]);
        let flow = flow(mesh, &conditions, SlipTreatment::Rotated);
        assert!(flow.fluxes.iter().all(|flux| flux.abs() < 1e-14), "{:?}", flow.fluxes);
        least_stream(&flow, n)
    };
    let errors = [8, 16, 32].map(|n| stream(n) - LEAST);
    println!("psi_min + 0.100076 on n = 8, 16, 32: {errors:?}");
    assert!(errors[0].abs() < 1e-3 && errors[1].abs() < 1e-4 && errors[2].abs() < 1e-5, "{errors:?}");
    let order = (errors[0] / errors[2]).abs().log2() / 2.0;
    assert!(order > 1.9, "{order}: {errors:?}");
}

#[test]
fn walls_that_slip_beside_the_lid_let_nothing_through() {
    for slip in [SlipTreatment::Rotated, SlipTreatment::Penalty { epsilon: 1e-8 }] {
        let mesh = square(8);
        let conditions = conditions(&mesh, &VelocityCondition::Slip, &[("top", moving(["1", "0"]))]);
        let flow = flow(mesh, &conditions, slip);
        let allowed = if slip == SlipTreatment::Rotated { 1e-14 } else { 1e-6 };
        assert!(flow.fluxes.iter().all(|flux| flux.abs() < allowed), "{slip:?}: {:?}", flow.fluxes);
        assert_eq!(corner(&flow.loops.mesh, &conditions, Point::new(1.0, 1.0), 0.0), Point::zeros());
    }
}

/// The prescribed velocity at the node nearest to `x`.
fn corner(mesh: &Arc<Mesh>, conditions: &[Conditions], x: Point, t: f64) -> Point {
    let space = Space::new(mesh, Continuity::Continuous, 2, 2);
    let frames = Frames::new(&space, conditions, WallPoints::Lobatto);
    let positions = space.node_positions();
    let away = |node: &usize| (positions[*node] - x).norm();
    let node = (0..positions.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
    assert_eq!(frames.owned(node).len(), 0, "it is prescribed");
    let v = frames.prescribed(conditions, t).unwrap();
    Point::new(v[2 * node], v[2 * node + 1])
}

#[test]
fn every_pair_of_conditions_at_a_corner() {
    let mesh = Arc::new(square(2));
    let slip = || VelocityCondition::Slip;
    let none = || VelocityCondition::NoTangential;
    let free = || VelocityCondition::Traction(["0", "0"].map(|text| Expression::parse(text, &[]).unwrap()));
    // at the corner (0, 1) of `left` and `top`
    let cases = [
        ("inlet and wall", moving(["1", "0"]), at_rest(), [1.0, 0.0]),
        ("inlet and slip", moving(["1", "0"]), slip(), [1.0, 0.0]),
        ("inlet askew and wall", moving(["1", "0.5"]), at_rest(), [1.0, 0.0]),
        ("inlet askew and slip", moving(["1", "0.5"]), slip(), [1.0, 0.0]),
        ("wall and lid", at_rest(), moving(["1", "0"]), [0.0, 0.0]),
        ("slip and lid", slip(), moving(["1", "0"]), [0.0, 0.0]),
        ("two lids", moving(["0", "1"]), moving(["1", "0"]), [0.0, 0.0]),
        ("two inlets", moving(["1", "0.25"]), moving(["0.5", "-2"]), [1.0, -2.0]),
        ("one flow on both", moving(["1", "-0.5"]), moving(["1", "-0.5"]), [1.0, -0.5]),
        ("lid and traction", free(), moving(["1", "0"]), [1.0, 0.0]),
        ("inlet and no-tangential", moving(["1", "0.5"]), none(), [1.0, 0.5]),
        ("wall and no-tangential", none(), at_rest(), [0.0, 0.0]),
    ];
    for (name, left, top, expected) in cases {
        let conditions = conditions(&mesh, &free(), &[("left", left), ("top", top)]);
        let found = corner(&mesh, &conditions, Point::new(0.0, 1.0), 0.0);
        assert!((found - Point::from(expected)).norm() < 1e-15, "{name}: {found}");
    }
}

#[test]
fn parts_of_one_side_and_lids_that_start() {
    // the left half of the top is another tag
    let mut mesh = square(4);
    mesh.tags.push("half".to_owned());
    let top = mesh.tag("top").unwrap();
    let middle = |face: &monolayer::mesh::Face| {
        let [a, b] = mesh.face_vertices(face).map(|v| mesh.vertices[v]);
        0.5 * (a.x + b.x)
    };
    let chosen: Vec<bool> = mesh.faces.iter().map(|face| face.tag == Some(top) && middle(face) < 0.5).collect();
    let half = mesh.tags.len() - 1;
    mesh.faces.iter_mut().zip(chosen).filter(|(_, chosen)| *chosen).for_each(|(face, _)| face.tag = Some(half));
    let mesh = Arc::new(mesh);
    let joint = Point::new(0.5, 1.0);
    let at = |left: VelocityCondition, right: VelocityCondition, t: f64| {
        corner(&mesh, &conditions(&mesh, &at_rest(), &[("half", left), ("top", right)]), joint, t)
    };
    // the wall keeps its normal component, the lid its tangential one
    assert_eq!(at(at_rest(), moving(["1", "0"]), 0.0), Point::new(1.0, 0.0));
    assert_eq!(at(moving(["1", "0"]), VelocityCondition::Slip, 0.0), Point::new(1.0, 0.0));
    assert_eq!(at(at_rest(), moving(["0", "-1"]), 0.0), Point::zeros());
    assert_eq!(at(VelocityCondition::Slip, moving(["0.5", "-1"]), 0.0), Point::new(0.5, 0.0));
    assert_eq!(at(moving(["1", "0"]), moving(["-1", "0"]), 0.0), Point::zeros());
    assert_eq!(at(moving(["0", "-1"]), moving(["0", "-3"]), 0.0), Point::new(0.0, -2.0));
    // a lid that starts later, and a wall that opens
    let starts = || moving(["if(t<1,0,1)", "0"]);
    assert_eq!(at(at_rest(), starts(), 0.5), Point::zeros());
    assert_eq!(at(at_rest(), starts(), 1.5), Point::new(1.0, 0.0));
    let opens = || moving(["0", "if(t<1,0,-1)"]);
    assert_eq!(at(opens(), moving(["0", "-1"]), 0.5), Point::zeros());
    assert_eq!(at(opens(), moving(["0", "-1"]), 1.5), Point::new(0.0, -1.0));
}
