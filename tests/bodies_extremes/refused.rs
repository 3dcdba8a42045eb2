//! Scenes that cannot be, each with its message.

use crate::common::{REST, disc, has, number, particles, refused, segment, stokes, tissue};

fn one(more: &str) -> String {
    disc("one", 0.1, 0.5, 0.5, more)
}

#[test]
fn coincident_centres() {
    let pair = disc("one", 0.1, 0.5, 0.5, "") + &disc("two", 0.05, 0.5, 0.5, "");
    for scene in [particles("", &pair, 0.1, 1.0), stokes(4, REST, &pair, 0.1, 1.0), tissue(&pair, 0.1, 1.0)] {
        has(&refused(&scene), &["`body.1.position`", "`one`", "`two`", "centre"]);
    }
}

#[test]
fn overlaps_with_bodies_and_walls() {
    let pair = disc("one", 0.1, 0.5, 0.5, "") + &disc("two", 0.1, 0.6, 0.5, "");
    has(&refused(&particles("", &pair, 0.1, 1.0)), &["`body.1.position`", "`two`", "overlaps `one` by 1.000e-1"]);
    has(&refused(&stokes(4, REST, &pair, 0.1, 1.0)), &["overlaps `one` by 1.000e-1"]);
    let low = one("") + &segment([0.0, 0.45], [1.0, 0.45]);
    has(&refused(&particles("", &low, 0.1, 1.0)), &["`body.0.position`", "`wall.0`", "5.000e-2"]);
    let tagged = disc("low", 0.1, 0.5, 0.05, "") + "[[wall]]\ntag = \"bottom\"\n";
    has(&refused(&stokes(4, REST, &tagged, 0.1, 1.0)), &["`body.0`", "`low`", "`wall.0`", "5.000e-2"]);
}

#[test]
fn bodies_that_are_larger_than_the_domain_or_outside_of_it() {
    let large = disc("large", 3.0, 0.5, 0.5, "");
    has(&refused(&stokes(4, REST, &large, 0.1, 1.0)), &["`body.0", "large"]);
    let large = disc("large", 8.0, 0.0, 0.0, "");
    has(&refused(&tissue(&large, 0.1, 1.0)), &["`body.0", "large"]);
    let outside = disc("lost", 0.1, 5.0, 0.5, "");
    has(&refused(&stokes(4, REST, &outside, 0.1, 1.0)), &["`body.0", "lost", "outside"]);
}

#[test]
fn steps_of_no_size() {
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let body = one("");
        has(&refused(&particles("", &body, step, 1.0)), &["`time.step`"]);
        has(&refused(&stokes(4, REST, &body, step, 1.0)), &["`time.step`"]);
        has(&refused(&tissue(&body, step, 1.0)), &["`time.step`"]);
    }
}

#[test]
fn numbers_out_of_their_range() {
    for (more, key) in [
        ("density = -1.0", "`body.0.density`"),
        ("density = 0.0", "`body.0.density`"),
        ("density = nan", "`body.0.density`"),
        ("density = inf", "`body.0.density`"),
        ("angle = inf", "`body.0.angle`"),
        ("velocity = [nan, 0]", "`body.0.velocity`"),
        ("force = [\"1/0\", \"0\"]", "`body.0.force"),
        ("torque = \"ln(-x)\"", "`body.0.torque`"),
        ("motion = { pinned = [3, 3] }", "`body.0.motion.pinned`"),
        ("motion = { path = { position = [\"x\", \"0\"], angle = \"0\" } }", "`body.0"),
    ] {
        has(&refused(&particles("", &one(more), 0.1, 1.0)), &[key]);
    }
    for shape in
        ["disc = { radius = 0.0 }", "ellipse = { semi_axes = [1.0, -1.0] }", "capsule = { length = -1, radius = 1 }"]
    {
        let body = format!("[[body]]\nshape = {{ {shape} }}\nposition = [0, 0]\n");
        has(&refused(&particles("", &body, 0.1, 1.0)), &["`body.0.shape", "greater than 0"]);
    }
    for rest in
        ["gamma_min = 1.0\nlaw = \"gluey\"", "margin = -1.0", "tolerance = 0.0", "tolerance = 0.5", "tolerance = 1e-20"]
    {
        let key = rest.split(' ').next().unwrap();
        let scene = particles("", &(one("") + &segment([0.0, 0.0], [1.0, 0.0]) + "[contact]\n" + rest), 0.1, 1.0);
        has(&refused(&scene), &[&format!("`contact.{key}`")]);
    }
    for epsilon in [0.0, -1e-8, 1.0, f64::NAN] {
        let rest = format!("{}[rigid]\nepsilon = {}\n", one(""), number(epsilon));
        has(&refused(&stokes(4, REST, &rest, 0.1, 1.0)), &["`rigid.epsilon`"]);
    }
}

#[test]
fn particles_without_bodies_and_bodies_where_there_are_none() {
    has(&refused(&particles("", "", 0.1, 1.0)), &["body", "hint"]);
    let list = "body = []\n".to_owned() + &particles("", "", 0.1, 1.0);
    has(&refused(&list), &["body"]);
    let none = particles("", "[[bodies]]\ncount = 0\nradius = 0.1\nbox = [[0, 0], [1, 1]]\n", 0.1, 1.0);
    has(&refused(&none), &["`bodies.0.count`"]);
    let compressible = include_str!("../data/compressible.toml").to_owned() + &one("");
    has(&refused(&compressible), &["`body`", "incompressible"]);
}

#[test]
fn sizes_and_weights_that_are_no_numbers_to_compute_with() {
    for radius in [1e-300, 1e-100, 1e100, 1e300] {
        let message = refused(&particles("", &disc("a", radius, 0.0, 0.0, ""), 0.1, 1.0));
        has(&message, &["`body.0.shape.disc.radius`", "between 1e-9 and 1e9"]);
    }
    has(
        &refused(&particles("", &disc("a", 0.1, 0.0, 0.0, "density = 1e308"), 0.1, 1.0).replace("0.1 }", "1e3 }")),
        &["`body.0.density`"],
    );
    let rod = |shape: &str| format!("[[body]]\nname = \"a\"\nshape = {{ {shape} }}\nposition = [0.5, 0.5]\n");
    let thin = refused(&particles("", &rod("capsule = { length = 0.4, radius = 1e-8 }"), 0.1, 1.0));
    has(&thin, &["the capsule is a sliver", "body.0.shape.capsule.radius"]);
    assert!(!thin.contains("polygon"), "{thin}");
    has(
        &refused(&particles("", &rod("ellipse = { semi_axes = [0.1, 1e-8] }"), 0.1, 1.0)),
        &["the ellipse is a sliver"],
    );
    has(
        &refused(&stokes(8, REST, &disc("a", 1e-9, 0.5, 0.5, ""), 0.1, 1.0)),
        &["`body.0`", "of the cell where it lies"],
    );
    let message = refused(&particles("", &disc("a", 0.1, 0.0, 0.0, ""), 1e-320, 1.0));
    has(&message, &["`time.step`", "is lost beside"]);
    assert!(!message.contains("`time.step_min`"), "{message}");
}

#[test]
fn margins_that_throw_bodies_apart() {
    let wall = segment([0.0, 0.0], [1.0, 0.0]);
    let scene = |margin: f64| {
        particles("", &(disc("a", 0.1, 0.5, 0.5, "") + &wall + &format!("[contact]\nmargin = {margin:?}\n")), 0.1, 1.0)
    };
    has(&refused(&scene(10.0)), &["`contact.margin` = 10", "4.000e-1", "`a`", "`wall.0`"]);
    let flow = |margin: f64| {
        let rest =
            format!("{}[[wall]]\ntag = \"bottom\"\n[contact]\nmargin = {margin:?}\n", disc("a", 0.1, 0.5, 0.5, ""));
        stokes(8, REST, &rest, 0.1, 0.1)
    };
    has(&refused(&flow(10.0)), &["`contact.margin` = 10", "`wall.0`"]);
}
