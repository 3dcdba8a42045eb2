//! A rigid rotation costs nothing where slip walls around it leave it free, or the scene says what it costs.

use std::path::Path;

use monolayer::model::fields::VELOCITY;
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};

/// Tissue in a round domain, turned by a force that a friction of 1e-6 balances at `v = (−y, x)`.
const SCENE: &str = r#"
[model]
kind = "incompressible"
friction = 1e-6
traction = 0.0
peclet = 1.0
coherence = 1.0
[mesh]
shape = "disc"
h = 0.5
[boundary.wall]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = ["0", "0"]
[source]
force = ["-friction*y", "friction*x"]
[time]
scheme = "bdf1"
step = 1.0
end = 1.0
"#;

const RING: &str = "shape = \"annulus\"\ninner_radius = 0.4\nradius = 1.2\nh = 0.4";

fn setup(text: &str, sets: &[(&str, &str)]) -> (Scene, Setup) {
    let mut source = SceneSource::parse(text, Path::new("tests/orders")).unwrap();
    sets.iter().for_each(|(key, value)| source.set(key, value).unwrap());
    let scene = Scene::check(source).unwrap();
    let setup = Setup::new(&scene).unwrap();
    (scene, setup)
}

/// How fast the tissue turns, and how far its velocity is from that rotation.
fn turning(setup: &Setup) -> (f64, f64) {
    let loops = setup.model.loops();
    let state = setup.model.state_of(&vec![0.0; setup.model.carried_len()], 0.0).unwrap();
    let sum = |f: &(dyn Fn(monolayer::mesh::Point, monolayer::mesh::Point) -> f64 + Sync)| {
        loops.sum(12, |x| f(x.site.x, state[VELOCITY].vector(&x.site)))
    };
    let size = sum(&|x, _| x.norm_squared());
    let rate = sum(&|x, v| x.perp(&v)) / size;
    let off = sum(&|x, v| (v - rate * monolayer::mesh::Point::new(-x.y, x.x)).norm_squared());
    (rate, (off / size).sqrt())
}

fn ring() -> String {
    SCENE
        .replace("shape = \"disc\"\nh = 0.5", RING)
        .replace("[boundary.wall]", "[boundary.outer]\nvelocity = \"slip\"\npolarity = \"neumann\"\n[boundary.inner]")
}

/// Degrees of velocities less one, and of cells up to that of the velocity.
const DEGREES: [(&str, &str); 4] = [("1", "1"), ("1", "2"), ("2", "1"), ("2", "3")];

#[test]
fn slip_walls_let_a_disc_and_a_ring_turn() {
    for text in [SCENE, ring().as_str()] {
        for k in ["1", "2", "3"] {
            let (scene, setup) = setup(text, &[("space.k", k)]);
            let (rate, off) = turning(&setup);
            assert!((rate - 1.0).abs() < 1e-6 && off < 1e-6, "k = {k}: {rate} {off:e}");
            assert!(!setup.remarks(&scene).iter().any(|note| note.contains("rotate")), "nothing to say");
        }
        for (k, curved) in DEGREES {
            let (rate, off) = turning(&setup(text, &[("space.k", k), ("mesh.curved", curved)]).1);
            assert!((rate - 1.0).abs() < 1e-6 && off < 1e-6, "k = {k}, curved = {curved}: {rate} {off:e}");
        }
    }
}

/// Rounding of `1/ε` beside the friction is all that is left.
#[test]
fn slip_walls_by_penalty_let_a_disc_and_a_ring_turn() {
    for (text, (k, curved)) in [SCENE.to_owned(), ring()].iter().flat_map(|text| DEGREES.map(|degrees| (text, degrees)))
    {
        for (friction, penalty) in [("1e-6", "1e-2"), ("1e-6", "1e-4"), ("1e-2", "1e-8"), ("1.0", "1e-10")] {
            let walls = [("space.walls", "\"penalty\""), ("space.penalty", penalty), ("model.friction", friction)];
            let (scene, setup) = setup(text, &[&[("space.k", k), ("mesh.curved", curved)], &walls[..]].concat());
            let (rate, off) = turning(&setup);
            println!("k = {k}, curved = {curved}, {friction}, {penalty}: {rate} {off:e}");
            assert!((rate - 1.0).abs() < 1e-5 && off < 1e-5, "k = {k}, curved = {curved}, {walls:?}: {rate} {off:e}");
            assert!(!setup.remarks(&scene).iter().any(|note| note.contains("rotate")), "nothing to say");
        }
    }
}

#[test]
fn cells_of_a_higher_degree_say_what_the_rotation_costs() {
    let (scene, setup) = setup(SCENE, &[("mesh.curved", "3")]);
    let (rate, _) = turning(&setup);
    let notes = setup.remarks(&scene);
    let note = notes.iter().find(|note| note.contains("rotate as a whole")).expect("a note");
    // 0.016 of what it should be, as the note says
    assert!((rate - 0.016).abs() < 0.002, "{rate}");
    assert!(note.contains("with 0.01") && note.contains("`mesh.curved` = 2"), "{note}");
}

#[test]
fn cells_of_a_higher_degree_say_what_the_rotation_costs_by_penalty() {
    for penalty in ["1e-2", "1e-4", "1e-6", "1e-8"] {
        let walls = [("mesh.curved", "3"), ("space.walls", "\"penalty\""), ("space.penalty", penalty)];
        let (scene, setup) = setup(SCENE, &walls);
        let (rate, _) = turning(&setup);
        let notes = setup.remarks(&scene);
        let note = notes.iter().find(|note| note.contains("rotate as a whole")).expect("a note");
        let told = note.split_once("turns with ").unwrap().1.split_once(' ').unwrap().0;
        let told: f64 = told.parse().unwrap();
        println!("{penalty}: {rate}, told {told}");
        // two digits are told
        assert!(rate < 1.05 * told && told < 3.0 * rate, "{penalty}: {rate}, {note}");
        assert!(note.contains("at most") && note.contains("`mesh.curved` = 2"), "{note}");
    }
}
