//! Ranges of numbers: what a schema says of a key is what the check says.

use std::collections::BTreeSet;

use monolayer::mesh::generate::{GENERATORS, MeshScene};
use monolayer::run::AnyScene;
use monolayer::scene::{self, SceneSource};
use monolayer::schema;
use serde_json::Value;

use super::{json, root};

pub const TISSUE: &str = r#"
title = "every table of an incompressible sheet"
[model]
kind = "incompressible"
friction = 3.0
peclet = 2.0
coherence = 0.5
elasticity = 0.4
[mesh]
shape = "strip-with-disc"
length = [-4.0, 6.0]
width = 6.0
h = 1.6
h_disc = 0.5
[space]
penalty = 1e-8
[space.degree]
velocity = 4
[boundary.inlet]
velocity = { dirichlet = ["1", "0"] }
polarity = { dirichlet = ["1", "0"] }
[boundary.outlet]
velocity = "traction"
polarity = { dirichlet = ["1", "0"] }
[boundary.walls]
velocity = "slip"
polarity = "neumann"
[boundary.disc]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = { random = { seed = 1, amplitude = 0.1, h_coarse = 0.25 } }
[time]
scheme = "bdf2"
step = 0.05
end = 0.1
max_steps = 10
[time.stop]
residual = 1e-9
[steady]
want = "any"
[coupling]
kind = "anderson"
[strain]
weissenberg = 1.0
[[output]]
measures = ["free_energy"]
every = { steps = 1 }
[[output]]
fields = ["velocity"]
every = { time = 0.05 }
[[output]]
cuts = [{ name = "line", from = [1.5, 0.0], to = [5.0, 0.0] }, { name = "circle", centre = [0.0, 0.0], radius = 1.5 }]
"#;

/// With `beta` in the place of `friction`.
const SHEET: &str = r#"
[model]
kind = "compressible"
beta = 0.5
peclet = 2.0
coherence = 0.5
[model.density]
penalty = 1.0
[mesh]
shape = "square"
n = 4
[space.degree]
velocity = 2
[boundary.left]
velocity = "slip"
polarity = "neumann"
[boundary.right]
velocity = "slip"
polarity = "neumann"
[boundary.bottom]
velocity = "slip"
polarity = "neumann"
[boundary.top]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = ["1", "0"]
density = 1.0
[time]
scheme = "bdf2"
step = 0.05
end = 0.1
"#;

pub const STOKES: &str = r#"
[model]
kind = "stokes"
friction = 1.0
[mesh]
shape = "square"
n = 8
[space]
penalty = 1e-8
[boundary.left]
velocity = { dirichlet = ["0", "0"] }
[boundary.right]
velocity = { dirichlet = ["0", "0"] }
[boundary.bottom]
velocity = { dirichlet = ["0", "0"] }
[boundary.top]
velocity = { dirichlet = ["0", "0"] }
[rigid]
epsilon = 1e-8
[[wall]]
disc = { centre = [9.0, 9.0], radius = 0.1 }
[[wall]]
hollow = { centre = [0.5, 0.5], radius = 5e10 }
[[body]]
name = "disc"
shape = { disc = { radius = 0.15 } }
position = [0.4, 0.4]
force = ["0", "-500*area"]
friction = 0.0
[[body]]
name = "rod"
shape = { capsule = { length = 0.1, radius = 0.05 } }
position = [0.8, 0.8]
[[body]]
name = "egg"
shape = { ellipse = { semi_axes = [0.1, 0.05] } }
position = [0.2, 0.8]
[[body]]
name = "hexagon"
shape = { regular-polygon = { sides = 6, radius = 0.05, rounding = 0.01 } }
position = [0.5, 0.8]
[[bodies]]
name = "all"
radius = [0.01, 0.02]
count = 2
friction = 0.0
disc = { centre = [0.8, 0.2], radius = 0.1 }
[[bodies]]
name = "ring"
radius = 0.01
count = 2
ring = { centre = [-1.0, 0.5], radius = 0.3 }
[contact]
law = "gluey"
[time]
step = 0.02
end = 0.04
max_steps = 10
tolerance = 1e-3
"#;

pub const PARTICLES: &str = r#"
[model]
kind = "particles"
dynamics = "inertial"
gravity = ["0", "-1"]
[[wall]]
segment = [[0.0, 0.0], [1.0, 0.0]]
[[body]]
name = "disc"
shape = { disc = { radius = 0.1 } }
position = [0.5, 0.1005]
[contact]
law = "gluey"
[time]
step = 0.02
end = 0.1
max_steps = 10
tolerance = 1e-3
[[output]]
bodies = true
every = { steps = 1 }
"#;

pub const ADVECTION: &str = r#"
[model]
kind = "advection"
velocity = ["1", "0"]
[mesh]
shape = "square"
n = 4
[space]
k = 1
[boundary.left]
density = 1.0
[boundary.right]
density = 0.0
[boundary.bottom]
density = 0.0
[boundary.top]
density = 0.0
[initial]
density = "x"
[time]
step = 0.05
end = 0.1
order = 2
max_steps = 10
"#;

const SCENES: [(&str, &str); 5] = [
    ("incompressible", TISSUE),
    ("compressible", SHEET),
    ("stokes", STOKES),
    ("particles", PARTICLES),
    ("advection", ADVECTION),
];

/// A number of a schema that has bounds, and its place; `#` stands for the elements of a list.
struct Bounded {
    path: Vec<String>,
    schema: Value,
}

fn bounded(schema: &Value, path: &[String], found: &mut Vec<Bounded>) {
    let has = |key: &&str| schema.get(key).is_some_and(Value::is_number);
    if ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"].iter().any(has) {
        found.push(Bounded { path: path.to_vec(), schema: schema.clone() });
    }
    let below = |name: &str| [path, &[name.to_owned()]].concat();
    for (key, one) in schema.get("properties").and_then(Value::as_object).into_iter().flatten() {
        if key != "center" {
            bounded(one, &below(key), found);
        }
    }
    if let Some(items) = schema.get("items") {
        bounded(items, &below("#"), found);
    }
    for key in ["oneOf", "anyOf"] {
        for one in schema.get(key).and_then(Value::as_array).into_iter().flatten() {
            bounded(one, path, found);
        }
    }
}

/// The places in a scene that a path means, and whether something is given there: those whose table or list is there.
fn places(scene: &Value, path: &[String]) -> Vec<(String, bool)> {
    let Some((key, rest)) = path.split_first() else { return vec![(String::new(), true)] };
    let below = |name: &str, one: &Value| {
        let joined = |tail: String| if tail.is_empty() { name.to_owned() } else { format!("{name}.{tail}") };
        places(one, rest).into_iter().map(|(tail, given)| (joined(tail), given)).collect::<Vec<_>>()
    };
    if key == "#" {
        let list = scene.as_array().map_or(&[][..], Vec::as_slice);
        return list.iter().enumerate().flat_map(|(at, one)| below(&at.to_string(), one)).collect();
    }
    match scene.get(key) {
        Some(one) => below(key, one),
        None if rest.is_empty() && scene.is_object() => vec![(key.clone(), false)],
        None => Vec::new(),
    }
}

/// Numbers just within the bounds of a schema, and just beyond them.
fn around(schema: &Value) -> (Vec<f64>, Vec<f64>) {
    let bound = |key: &str| schema.get(key).and_then(Value::as_f64);
    let whole = schema["type"] == "integer";
    let step = |at: f64| match (whole, at == 0.0) {
        (true, _) => 1.0,
        (false, true) => 1e-6,
        (false, false) => 1e-6 * at.abs(),
    };
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for (closed, open, sign) in [("minimum", "exclusiveMinimum", -1.0), ("maximum", "exclusiveMaximum", 1.0)] {
        if let Some(at) = bound(closed) {
            inside.push(at);
            outside.push(at + sign * step(at));
        }
        if let Some(at) = bound(open) {
            inside.push(at - sign * step(at));
            outside.push(at);
        }
    }
    (inside, outside)
}

fn shown(schema: &Value, x: f64) -> String {
    if schema["type"] == "integer" { format!("{x}") } else { format!("{x:?}") }
}

/// Ends of ranges that other keys of these scenes do not go with.
const OTHERS: &[&str] = &[
    "advection: time.end = 1e-6",
    "compressible: time.end = 1e-6",
    "incompressible: coupling.diverged = 1e-6",
    "incompressible: output.2.cuts.0.points = 3.0",
    "incompressible: output.2.cuts.1.points = 2",
    "incompressible: output.2.cuts.1.points = 3.0",
    "incompressible: time.end = 1e-6",
    "particles: body.0.shape.disc.radius = 1000000000.0",
    "particles: contact.friction = 1000.0",
    "particles: contact.restitution = 1.0",
    "particles: time.end = 1e-6",
    "stokes: bodies.0.disc.radius = 1e-6",
    "stokes: bodies.0.radius = 1000000000.0",
    "stokes: bodies.0.radius.0 = 1000000000.0",
    "stokes: bodies.0.radius.1 = 1000000000.0",
    "stokes: bodies.0.radius.1 = 1e-9",
    "stokes: bodies.1.radius = 1000000000.0",
    "stokes: bodies.1.ring.radius = 1e-6",
    "stokes: body.0.shape.disc.radius = 1000000000.0",
    "stokes: body.1.shape.capsule.length = 1000000000.0",
    "stokes: body.1.shape.capsule.radius = 1000000000.0",
    "stokes: body.1.shape.capsule.radius = 1e-9",
    "stokes: body.2.shape.ellipse.semi_axes.0 = 1000000000.0",
    "stokes: body.2.shape.ellipse.semi_axes.0 = 1e-9",
    "stokes: body.2.shape.ellipse.semi_axes.1 = 1000000000.0",
    "stokes: body.2.shape.ellipse.semi_axes.1 = 1e-9",
    "stokes: body.3.shape.regular-polygon.radius = 1000000000.0",
    "stokes: body.3.shape.regular-polygon.rounding = 1000000000.0",
    "stokes: time.end = 1e-6",
    "stokes: wall.1.hollow.radius = 1e-6",
];

/// Checks a scene with other values.
fn with(text: &str, sets: &[(&str, &str)]) -> Result<(), String> {
    let mut source = SceneSource::parse(text, &root().join("scene.toml")).map_err(|error| error.to_string())?;
    for (key, value) in sets {
        source.set(key, value).map_err(|error| error.to_string())?;
    }
    AnyScene::check(source).map(drop).map_err(|error| error.to_string())
}

/// What a message says of a key, without the key and the value.
fn rule(error: &str) -> &str {
    let said = error.split_once(" = ").and_then(|(_, rest)| rest.split_once(": ")).map_or(error, |(_, rule)| rule);
    said.split("; hint").next().unwrap()
}

/// A million bodies take their time.
fn takes_long(key: &str, value: &str) -> bool {
    key.ends_with(".count") && value.len() > 3
}

/// Tries a key just within its bounds and just beyond them; what is wrong, and what other rules exclude.
fn tried(kind: &str, text: &str, key: &str, schema: &Value) -> (Vec<String>, Vec<String>) {
    let (mut failed, mut others, mut rules) = (Vec::new(), Vec::new(), Vec::new());
    let (inside, outside) = around(schema);
    let list = key.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches('.');
    for value in outside.iter().map(|x| shown(schema, *x)) {
        match with(text, &[(key, &value)]) {
            Ok(_) => failed.push(format!("{kind}: `{key}` = {value} is taken")),
            Err(error) if ![key, list].iter().any(|key| error.contains(&format!("`{key}`"))) => {
                failed.push(format!("{kind}: `{key}` = {value} is not blamed: {error}"));
            }
            Err(error) => rules.push(rule(&error).to_owned()),
        }
    }
    for value in inside.iter().map(|x| shown(schema, *x)).filter(|value| !takes_long(key, value)) {
        let end = format!("{kind}: {key} = {value}");
        match with(text, &[(key, &value)]) {
            Ok(_) => {}
            Err(error) if !OTHERS.contains(&end.as_str()) && rules.iter().any(|rule| *rule == self::rule(&error)) => {
                failed.push(format!("{kind}: `{key}` = {value} is refused: {error}"));
            }
            Err(_) => others.push(end),
        }
    }
    (failed, others)
}

#[test]
fn the_check_refuses_what_the_schema_refuses_and_nothing_more() {
    let (mut all, mut given, mut keys) = (BTreeSet::new(), BTreeSet::new(), Vec::new());
    for (kind, text) in SCENES {
        with(text, &[]).unwrap_or_else(|error| panic!("{kind}: {error}"));
        let base = json(text).unwrap();
        let mut found = Vec::new();
        bounded(&scene::schema::of_kind(kind).unwrap(), &[], &mut found);
        for Bounded { path, schema } in found.into_iter().filter(|one| one.path[0] != "mesh") {
            let name = path.join(".");
            all.insert(name.clone());
            for (key, is_given) in places(&base, &path) {
                given.extend(is_given.then(|| name.clone()));
                keys.push((kind, text, name.clone(), key, is_given, schema.clone()));
            }
        }
    }
    // where a scene has a key, others are not tried without it: it may stand in the place of another
    keys.retain(|(.., name, _, is_given, _)| *is_given || !given.contains(name));
    let (mut failed, mut others) = (Vec::new(), BTreeSet::new());
    for (kind, text, _, key, _, schema) in &keys {
        let (wrong, excluded) = tried(kind, text, key, schema);
        failed.extend(wrong);
        others.extend(excluded);
    }
    let seen: BTreeSet<String> = keys.into_iter().map(|(_, _, name, ..)| name).collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
    assert_eq!(others, OTHERS.iter().map(|end| (*end).to_owned()).collect(), "ends that other rules exclude");
    let rest: Vec<_> = all.difference(&seen).collect();
    assert!(rest.is_empty(), "no scene of this test has {rest:?}");
    assert!(seen.len() > 60, "{}", seen.len());
}

/// A small domain of every shape.
fn small(shape: &str) -> MeshScene {
    let mesh = MeshScene::of(shape);
    match shape {
        "square" => mesh.with("n", 2_u64),
        "square-with-circle" => mesh.with("n", 2_u64).with("radius", 0.2),
        "strip" => mesh.with("length", [0.0, 4.0]).with("width", 2.0).with("h", 1.0),
        "strip-with-disc" => mesh.with("length", [-4.0, 4.0]).with("width", 6.0).with("h", 1.0).with("h_disc", 0.5),
        "disc" | "l-shape" => mesh.with("h", 0.5),
        "annulus" => mesh.with("inner_radius", 0.3).with("h", 0.3),
        "racetrack" => {
            mesh.with("arm", 6.0).with("turn_radius", 4.0).with("width", 4.0).with("h", 1.0).with("h_disc", 0.5)
        }
        other => panic!("a small domain is missing for the shape `{other}`"),
    }
}

/// A racetrack without discs has nothing to say of them.
fn without_discs(mesh: MeshScene) -> MeshScene {
    match mesh.get::<usize>("discs") {
        Some(0) => {
            let keys = ["arm", "turn_radius", "width", "h"];
            let empty = MeshScene::of("racetrack").with("discs", 0_u64);
            keys.iter().fold(empty, |all, key| all.with(key, mesh.get::<f64>(key).unwrap()))
        }
        Some(_) | None => mesh,
    }
}

/// The smallest and the largest length go with no other one, and the largest stretch with no small domain, so a mesh is
/// not tried with them.
#[test]
fn keys_of_meshes() {
    let schema = schema::of::<MeshScene>();
    let mut count = 0;
    for shape in &GENERATORS {
        let base = small(shape.name);
        assert!(base.expected().is_some(), "{}", shape.name);
        for key in shape.keys {
            let one = &schema["properties"][key.name];
            let pair = one.get("items").is_some();
            let (inside, outside) = around(if pair { &one["items"] } else { one });
            let set = |x: f64| match (pair, one["type"] == "integer") {
                (true, _) => Some(base.clone().with(key.name, [x, 1.0])),
                (false, true) if x < 0.0 => None,
                (false, true) => Some(base.clone().with(key.name, x as u64)),
                (false, false) => Some(base.clone().with(key.name, x)),
            };
            for mesh in outside.into_iter().filter_map(set) {
                let error = mesh.build().expect_err(key.name).to_string();
                assert!(error.contains(&format!("mesh.{}`", key.name)), "{}: {error}", shape.name);
                count += 1;
            }
            let length = one.get("x-unit").is_some() || pair;
            for mesh in inside.into_iter().filter(|_| !length && !["n", "stretch"].contains(&key.name)).filter_map(set)
            {
                let mesh = if key.name == "discs" { without_discs(mesh) } else { mesh };
                assert!(mesh.expected().is_some(), "{} with {mesh:?}", shape.name);
            }
        }
    }
    assert!(count > 40, "{count}");
}
