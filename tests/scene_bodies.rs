//! Scenes of rigid bodies: what they are read as, and wrong ones, each with its message.

use std::path::Path;

use monolayer::body::Hold;
use monolayer::contact::{Law, Wall};
use monolayer::mesh::Point;
use monolayer::model::immersed::flow::{Method, Penalty};
use monolayer::run::AnyScene;
use monolayer::run::domain::mesh_of;
use monolayer::scene::{ParticlesScene, Scene, SceneSource, StokesScene};
use monolayer::shape::{Core, Disc, Figure, Shape};

const PARTICLES: &str = r#"title = "two discs and a box"
[model]
kind = "particles"
gravity = ["0", "-1"]
drag = 0.5

[[body]]
name = "left"
shape = { disc = { radius = 0.1 } }
position = [0.3, 0.5]
velocity = [1.0, 0.0]
force = ["0", "-500*area*cos(theta)"]

[[body]]
shape = { capsule = { length = 0.2, radius = 0.05 } }
position = [0.8, 0.5]
angle = 1.0
motion = { pinned = [0.8, 0.5] }

[[bodies]]
count = 20
radius = [0.01, 0.02]
box = [[0.0, 0.7], [1.0, 1.0]]
seed = 3

[[wall]]
segment = [[0.0, 0.0], [1.0, 0.0]]

[contact]
law = "gluey"

[time]
step = 0.01
end = 1.0

[[output]]
bodies = true
every = { time = 0.1 }
"#;

const STOKES: &str = r#"[model]
kind = "stokes"

[mesh]
shape = "square"
n = 4

[boundary.left]
velocity = { dirichlet = ["0", "x"] }
[boundary.right]
velocity = { dirichlet = ["0", "x"] }
[boundary.bottom]
velocity = { dirichlet = ["0", "x"] }
[boundary.top]
velocity = { dirichlet = ["0", "x"] }

[rigid]
epsilon = 1e-6

[[body]]
shape = { disc = { radius = 0.1 } }
position = [0.5, 0.5]

[[wall]]
tag = "bottom"

[time]
step = 0.1
end = 0.1
"#;

fn particles(text: &str) -> ParticlesScene {
    ParticlesScene::parse(text, Path::new("particles.toml")).unwrap_or_else(|error| panic!("{error}"))
}

fn stokes(text: &str) -> StokesScene {
    StokesScene::parse(text, Path::new("stokes.toml")).unwrap_or_else(|error| panic!("{error}"))
}

/// The message about a scene with `from` replaced by `to` has `parts`, and the line of the change where `lined`.
fn wrong_in(base: &str, from: &str, to: &str, lined: bool, parts: &[&str]) {
    let at = base.find(from).unwrap_or_else(|| panic!("the scene has no `{from}`"));
    let line = base[..at].matches('\n').count() + 1;
    let text = base.replacen(from, to, 1);
    let message = match AnyScene::parse(&text, Path::new("scene.toml")) {
        Ok(scene) if scene.mesh().is_some() => {
            let scene = StokesScene::check(scene.source().clone()).expect("a Stokes flow");
            match mesh_of(&scene.mesh, scene.source()) {
                Ok(mesh) => scene.check_mesh(&mesh).expect_err("the scene is wrong").to_string(),
                Err(error) => error.to_string(),
            }
        }
        Ok(_) => panic!("the scene is wrong, and was taken: {to}"),
        Err(error) => error.to_string(),
    };
    println!("{message}\n");
    let place = if lined { format!("scene.toml, line {line}: ") } else { "scene.toml".to_owned() };
    for part in parts.iter().copied().chain([place.as_str(), "hint: "]) {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn wrong(from: &str, to: &str, parts: &[&str]) {
    wrong_in(PARTICLES, from, to, true, parts);
}

#[test]
fn particles_are_read_with_every_default() {
    let scene = particles(PARTICLES);
    let [left, capsule, small @ ..] = &scene.bodies.bodies[..] else { panic!("two bodies and more") };
    assert_eq!((left.name.as_str(), &left.shape), ("left", &Shape::from(Disc { radius: 0.1 })));
    assert_eq!(left.start_twist.velocity, Point::new(1.0, 0.0));
    let area = std::f64::consts::PI * 0.01;
    let force = left.force[1].eval_at(Point::zeros(), 1.0, 0.0);
    assert!((force + 500.0 * area * 1f64.cos()).abs() < 1e-12, "theta and area: {force}");
    assert_eq!(capsule.name, "body-2");
    assert_eq!(capsule.hold, Hold::Pinned(Point::zeros()));
    assert_eq!(small.len(), 20);
    assert_eq!((small[0].name.as_str(), small[19].name.as_str()), ("disc-1", "disc-20"));
    assert_eq!(scene.bodies.walls, [Wall::Segment([Point::zeros(), Point::new(1.0, 0.0)])]);
    let contact = scene.bodies.contact.expect("they can touch");
    assert_eq!((contact.law, contact.margin), (Law::Gluey { gamma_min: f64::NEG_INFINITY }, 0.0));
}

#[test]
fn placed_discs_keep_apart_and_within_and_follow_their_seed() {
    let full = PARTICLES.replace("count = 20", "count = 250").replace("[0.01, 0.02]", "[0.005, 0.02]");
    let scene = particles(&full);
    let discs: Vec<(Point, f64)> =
        scene.bodies.bodies.iter().map(|body| (body.start.position, body.shape.circumradius())).skip(2).collect();
    assert_eq!(discs.len(), 250);
    for (k, (x, r)) in discs.iter().enumerate() {
        assert!((0.005..=0.02).contains(r), "{r}");
        assert!(x.x >= *r && x.x <= 1.0 - r && x.y >= 0.7 + r && x.y <= 1.0 - r, "{x:?}");
        assert!(discs[..k].iter().all(|(y, s)| (x - y).norm() >= r + s), "disc {k} overlaps another");
    }
    let again = particles(&full);
    assert_eq!(scene.bodies, again.bodies);
    let other = particles(&full.replace("seed = 3", "seed = 4"));
    assert!(scene.bodies.bodies[2].start != other.bodies.bodies[2].start, "another seed, another place");
}

#[test]
fn a_ring_turns_and_a_list_stands() {
    let ring = "ring = { centre = [0.5, 2.0], radius = 0.5, angle = \"t\" }";
    let text = PARTICLES.replace("box = [[0.0, 0.7], [1.0, 1.0]]", ring);
    let scene = particles(&text);
    let first = &scene.bodies.bodies[2];
    assert!((first.start.position - Point::new(1.0, 2.0)).norm() < 1e-15);
    let Hold::Path { position, angle } = &first.hold else { panic!("{:?}", first.hold) };
    let quarter = std::f64::consts::FRAC_PI_2;
    let at = Point::new(position[0].eval(Point::zeros(), quarter), position[1].eval(Point::zeros(), quarter));
    assert!((at - Point::new(0.5, 2.5)).norm() < 1e-15, "{at:?}");
    assert_eq!(angle.eval(Point::zeros(), 2.0), 2.0);
    let text = PARTICLES
        .replace("count = 20\n", "motion = \"fixed\"\n")
        .replace("box = [[0.0, 0.7], [1.0, 1.0]]", "at = [[0.1, 0.9], [0.9, 0.9]]");
    let listed = particles(&text);
    assert_eq!(listed.bodies.bodies.len(), 4);
    assert_eq!(listed.bodies.bodies[3].start.position, Point::new(0.9, 0.9));
    assert_eq!(listed.bodies.bodies[3].hold, Hold::Fixed);
}

#[test]
fn a_polygon_lies_where_its_vertices_say() {
    let text = PARTICLES.replace(
        "shape = { disc = { radius = 0.1 } }\nposition = [0.3, 0.5]",
        "shape = { polygon = { vertices = [[0.2, 0.4], [0.2, 0.6], [0.4, 0.6], [0.4, 0.4]] } }",
    );
    let scene = particles(&text);
    let body = &scene.bodies.bodies[0];
    assert!((body.start.position - Point::new(0.3, 0.5)).norm() < 1e-15);
    assert!((body.shape.area() - 0.04).abs() < 1e-15, "counterclockwise now");
    let Figure::Around { core: Core::Polygon(vertices), radius: 0.0 } = body.shape.figure() else {
        panic!("{:?}", body.shape)
    };
    assert!(vertices.len() == 4 && vertices.iter().all(|v| (v.norm() - 0.1 * 2f64.sqrt()).abs() < 1e-15));
}

#[test]
fn a_resolved_scene_parses_back_to_itself() {
    let scene = particles(PARTICLES);
    let text = scene.resolved_toml();
    let again = particles(&text);
    assert_eq!(again.resolved_toml(), text);
    assert_eq!(again.bodies, scene.bodies);
    for line in ["gamma_min = -inf", "name = \"body-2\"", "dynamics = \"inertial\"", "margin = 0.0", "seed = 3"] {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
    let scene = stokes(STOKES);
    let text = scene.resolved_toml();
    let again = stokes(&text);
    assert_eq!(again.resolved_toml(), text);
    assert_eq!((again.bodies, again.boundary), (scene.bodies, scene.boundary));
    for line in ["epsilon = 1e-6", "order = 2", "friction = 0.0", "tag = \"bottom\""] {
        assert!(text.contains(line), "`{line}` is not in\n{text}");
    }
}

/// Bodies of a Stokes flow are boundaries of it, unless a key of the penalty is given.
#[test]
fn methods_where_nobody_says_them() {
    let method = |rigid: &str| {
        let text = STOKES.replacen("[rigid]\nepsilon = 1e-6\n", rigid, 1);
        let (scene, again) = (stokes(&text), stokes(&stokes(&text).resolved_toml()));
        assert_eq!(scene.bodies, again.bodies, "{rigid}");
        scene.bodies.expect("there is one").rigid.method
    };
    assert_eq!(method(""), Method::Nitsche);
    assert_eq!(method("[rigid]\norder = 1\n"), Method::Nitsche);
    assert_eq!(method("[rigid]\nepsilon = 1e-6\n"), Method::Penalty(Penalty::harmonic(1e-6)));
    assert_eq!(method("[rigid]\nstrength = \"full\"\n"), Method::Penalty(Penalty::full(1e-8)));
    assert_eq!(method("[rigid]\nmethod = \"penalty\"\n"), Method::Penalty(Penalty::harmonic(1e-8)));
    let both = "method = \"nitsche\"\nepsilon = 1e-6";
    wrong_in(STOKES, "epsilon = 1e-6", both, false, &["`rigid.epsilon` = 1e-6", "only the penalty has it"]);
    let both = "method = \"nitsche\"\nstrength = \"full\"";
    wrong_in(STOKES, "epsilon = 1e-6", both, false, &["`rigid.strength` = \"full\"", "only the penalty has it"]);
    wrong_in(STOKES, "epsilon = 1e-6", "strength = \"half\"", true, &["half", "harmonic", "full"]);
}

#[test]
fn bodies_are_set_by_number_and_by_name() {
    let mut source = SceneSource::parse(PARTICLES, Path::new("scene.toml")).unwrap();
    source.set("body.left.density", "3").unwrap();
    source.set("body.1.angle", "0.5").unwrap();
    source.set("body.body-2.density", "2").unwrap();
    source.set("bodies.disc.count", "5").unwrap();
    let scene = ParticlesScene::check(source.clone()).unwrap();
    let [left, capsule, ..] = &scene.bodies.bodies[..] else { panic!("two bodies and more") };
    assert_eq!((left.density, capsule.start.angle, capsule.density), (3.0, 0.5, 2.0));
    assert_eq!(scene.bodies.bodies.len(), 7);
    let mut bad = source.clone();
    bad.set("body.left.density", "-1").unwrap();
    let message = ParticlesScene::check(bad).expect_err("negative").to_string();
    assert!(message.contains("with `body.left.density` set"), "{message}");
    let message = source.clone().set("body.right.density", "1").expect_err("no such body").to_string();
    assert!(message.contains("no [[body]] has the name `right`"), "{message}");
    let message = source.set("body.left.densty", "1").expect_err("misspelt").to_string();
    assert!(message.contains("did you mean `density`?"), "{message}");
}

#[test]
fn the_bodies_of_a_tissue() {
    let quick = include_str!("../studies/quick/quick.toml");
    let plain = Scene::parse(quick, Path::new("quick.toml")).unwrap();
    assert!(plain.bodies.is_none());
    for word in ["[rigid]", "[contact]", "body", "wall]]"] {
        assert!(!plain.resolved_toml().contains(word), "a scene without bodies says nothing of `{word}`");
    }
    let text =
        format!("{quick}\n[[body]]\nshape = {{ disc = {{ radius = 0.1 }} }}\nposition = [0.5, 0.5]\nfriction = 2\n");
    let scene = Scene::parse(&text, Path::new("quick.toml")).unwrap();
    let bodies = scene.bodies.as_ref().expect("one");
    assert_eq!((bodies.bodies[0].friction, bodies.rigid.order), (2.0, 2));
    assert_eq!(bodies.rigid.method, Method::Nitsche);
    assert!(bodies.contact.is_none(), "one body meets nothing");
    let again = Scene::parse(&scene.resolved_toml(), Path::new("quick.toml")).unwrap();
    assert_eq!(again.bodies, scene.bodies);
    let compressible = include_str!("data/compressible.toml");
    let text = format!("{compressible}\n[[body]]\nshape = {{ disc = {{ radius = 0.1 }} }}\nposition = [0.5, 0.5]\n");
    let message = Scene::parse(&text, Path::new("c.toml")).expect_err("compressible").to_string();
    assert!(message.contains("`body`") && message.contains("carries no rigid bodies"), "{message}");
}

#[test]
fn walls_of_a_boundary_have_the_mesh_on_their_left() {
    let scene = stokes(STOKES);
    let mesh = mesh_of(&scene.mesh, scene.source()).unwrap();
    scene.check_mesh(&mesh).unwrap();
    let walls = scene.bodies.as_ref().expect("one").walls_on(&mesh);
    assert_eq!(walls, [Wall::Segment([Point::zeros(), Point::new(1.0, 0.0)])], "one straight wall of four faces");
}

#[test]
fn misspelt_keys_have_their_line() {
    wrong(
        "velocity = [1.0",
        "velocty = [1.0",
        &["`body.0.velocty`", "did you mean `velocity`?", "name, shape, position"],
    );
    wrong("drag = 0.5", "darg = 0.5", &["`model.darg`", "did you mean `drag`?", "kind, dynamics, gravity, drag"]);
    wrong(
        "{ disc = {",
        "{ disk = {",
        &["`body.0.shape.disk`", "did you mean `disc`?", "disc, ellipse, capsule, polygon"],
    );
    wrong("radius = 0.1", "diameter = 0.1", &["`body.0.shape.disc.diameter`", "radius"]);
    wrong("motion = { pinned", "motion = { pined", &["did you mean `pinned`?", "free, fixed, pinned, held, path"]);
    wrong("law = \"gluey\"", "law = \"glue\"", &["did you mean `gluey`?", "inelastic, gluey"]);
    wrong("seed = 3", "sed = 3", &["`bodies.0.sed`", "did you mean `seed`?"]);
}

#[test]
fn keys_of_another_kind() {
    wrong(
        "[time]",
        "[mesh]\nshape = \"square\"\nn = 4\n[time]",
        &["`mesh`", "particles", "a Stokes flow", "the keys that"],
    );
    wrong("drag = 0.5", "peclet = 2.0", &["`model.peclet`", "belongs to tissue"]);
    wrong("step = 0.01", "scheme = \"bdf2\"\nstep = 0.01", &["`time.scheme`", "belongs to tissue"]);
    wrong("[time]", "[rigid]\n[time]", &["`rigid`", "particles"]);
    let rule = ["`wall.0.tag`", "particles have no mesh"];
    wrong("segment = [[0.0, 0.0], [1.0, 0.0]]", "tag = \"bottom\"", &rule);
    wrong("force = [", "friction = 1.0\nforce = [", &["`body.0.friction`", "model.drag"]);
    wrong_in(STOKES, "position = [0.5", "spin = 1.0\nposition = [0.5", true, &["`body.0.spin`", "the flow gives"]);
    let initial = "[initial]\npolarity = [\"1\", \"0\"]\n[time]";
    wrong_in(STOKES, "[time]", initial, true, &["`initial`", "belongs to tissue"]);
    let scene = Scene::parse(PARTICLES, Path::new("p.toml")).expect_err("no tissue").to_string();
    assert!(scene.contains("line 3") && scene.contains("this needs tissue"), "{scene}");
}

#[test]
fn shapes_that_are_none() {
    wrong("radius = 0.1", "radius = 0.0", &["`body.0.shape.disc.radius` = 0.0", "greater than 0"]);
    wrong("length = 0.2", "length = -1", &["`body.1.shape.capsule.length`"]);
    let polygon = |vertices: &str| format!("{{ polygon = {{ vertices = {vertices} }} }}");
    let disc = "{ disc = { radius = 0.1 } }";
    wrong(disc, &polygon("[[0, 0], [1, 0]]"), &["2 vertices", "at least 3"]);
    wrong(disc, &polygon("[[0, 0], [1, 0], [2, 0]]"), &["not convex at vertex 0"]);
    wrong(disc, &polygon("[[0, 0], [2, 0], [1, 0.5], [2, 2]]"), &["not convex", "(1, 0.5)"]);
    wrong(disc, &polygon("[[0, 1], [0.6, -0.8], [-0.95, 0.3], [0.95, 0.3], [-0.6, -0.8]]"), &["winds round"]);
    wrong(disc, "{ hexagon = { radius = 0.1 } }", &["`body.0.shape.hexagon`", "did you mean `regular-polygon`?"]);
    let regular = |keys: &str| format!("{{ regular-polygon = {{ {keys} }} }}");
    let at = |key: &str| format!("`body.0.shape.regular-polygon.{key}`");
    wrong(disc, &regular("sides = 2, radius = 0.1"), &[&at("sides"), "between 3 and 100"]);
    wrong(disc, &regular("sides = 6, radius = 0"), &[&at("radius"), "greater than 0"]);
    wrong(disc, &regular("sides = 6, radius = 0.1, rounding = -0.1"), &[&at("rounding"), "0 keeps sharp corners"]);
    wrong(disc, &regular("sides = 6, radius = 0.1, roundin = 0.1"), &["roundin", "did you mean `rounding`?"]);
}

#[test]
fn a_hexagon_with_round_corners() {
    let hexagon = "{ regular-polygon = { sides = 6, radius = 0.1, rounding = 0.02 } }";
    let scene = particles(&PARTICLES.replace("{ disc = { radius = 0.1 } }", hexagon));
    let shape = &scene.bodies.bodies[0].shape;
    let exact = 1.5 * 3f64.sqrt() * 0.01 + 0.6 * 0.02 + std::f64::consts::PI * 0.02 * 0.02;
    assert!((shape.area() - exact).abs() < 1e-15);
    assert!((shape.circumradius() - 0.12).abs() < 1e-15);
    assert!((shape.inradius() - (0.05 * 3f64.sqrt() + 0.02)).abs() < 1e-15);
    assert_eq!(particles(&scene.resolved_toml()).bodies, scene.bodies);
}

#[test]
fn bodies_in_each_others_place() {
    let depth = ["`body-2`) ", "overlaps `left` by 1.000e-2", "move one of the two"];
    let close = PARTICLES.replace("{ capsule = { length = 0.2, radius = 0.05 } }", "{ disc = { radius = 0.1 } }");
    let near = "position = [0.49, 0.5]\nangle = 1.0\nmotion = { pinned = [0.49, 0.5] }";
    let far = "position = [0.8, 0.5]\nangle = 1.0\nmotion = { pinned = [0.8, 0.5] }";
    wrong_in(&close, far, near, true, &[&depth[0][..depth[0].len() - 1], depth[1], depth[2]]);
    let same = "position = [0.3, 0.5]\nangle = 1.0\nmotion = { pinned = [0.3, 0.5] }";
    wrong_in(&close, far, same, true, &["has its centre where `left` has"]);
    wrong("position = [0.3, 0.5]", "position = [0.3, 0.05]", &["overlaps the wall `wall.0`", "by 5.000e-2"]);
    let hollow = "hollow = { centre = [0.5, 0.5], radius = 0.05 }";
    wrong_in(STOKES, "tag = \"bottom\"", hollow, false, &["a hollow of radius 0.05", "by 5.000e-2"]);
    let twice = ["`body.1.name` = \"body-2\"", "two bodies have this name"];
    wrong_in(PARTICLES, "name = \"left\"", "name = \"body-2\"", false, &twice);
}

#[test]
fn values_out_of_range() {
    wrong("name = \"left\"", "name = \"7\"", &["`body.0.name`", "no number"]);
    wrong("velocity = [1.0, 0.0]", "density = 0", &["`body.0.density` = 0.0", "greater than 0"]);
    wrong("drag = 0.5", "drag = -1", &["`model.drag` = -1.0", "not negative"]);
    let rest = PARTICLES.replace("velocity = [1.0, 0.0]\n", "");
    wrong_in(&rest, "drag = 0.5", "dynamics = \"overdamped\"", false, &["`model.drag` = 0.0", "must be some"]);
    wrong_in(
        PARTICLES,
        "drag = 0.5",
        "dynamics = \"overdamped\"\ndrag = 1",
        false,
        &["`body.0.velocity`", "without inertia"],
    );
    wrong("gravity = [\"0\", \"-1\"]", "gravity = [\"x\", \"-1\"]", &["`model.gravity`", "formulas of t alone"]);
    wrong(
        "500*area",
        "500*aera",
        &["`body.0.force`", "`aera`, which is not defined", "did you mean `area`?", "radius"],
    );
    wrong("500*area", "area/(x - 0.3)", &["is -inf", "at the start"]);
    wrong(
        "pinned = [0.8, 0.5]",
        "pinned = [0.8, 0.9]",
        &["`body.1.motion.pinned` = [0.8, 0.9]", "no farther than 0.15"],
    );
    let path = "motion = { path = { position = [\"t + theta\", \"0\"] } }";
    wrong_in(
        &PARTICLES.replace("position = [0.8, 0.5]\nangle = 1.0\n", ""),
        "motion = { pinned = [0.8, 0.5] }",
        path,
        true,
        &["must be formulas of t alone"],
    );
    let above = ["contact.gamma_min", "must not be above 0"];
    wrong_in(PARTICLES, "law = \"gluey\"", "law = \"gluey\"\ngamma_min = 1", false, &above);
    wrong("law = \"gluey\"", "gamma_min = -1", &["contact.gamma_min", "do not stick"]);
    wrong("law = \"gluey\"", "margin = -1", &["contact.margin"]);
    wrong("law = \"gluey\"", "tolerance = 0", &["contact.tolerance", "between 1e-14 and 1e-3"]);
    wrong("segment = [[0.0, 0.0], [1.0, 0.0]]", "segment = [[0.0, 0.0], [0.0, 0.0]]", &["`wall.0.segment`", "differ"]);
    wrong_in(
        PARTICLES,
        "segment = [[0.0, 0.0], [1.0, 0.0]]",
        "# none",
        false,
        &["`wall.0`", "exactly one of `segment`"],
    );
    wrong_in(PARTICLES, "end = 1.0", "end = 0.001", false, &[]);
}

#[test]
fn groups_that_find_no_room() {
    wrong(
        "count = 20",
        "count = 2000",
        &["`bodies.0.count` = 2000", "there is no room: with", "% of the `box` filled"],
    );
    wrong("radius = [0.01, 0.02]", "radius = [0.02, 0.01]", &["the smaller one first"]);
    wrong("radius = [0.01, 0.02]", "radius = 0.2", &["at most 0.15", "does not fit"]);
    wrong_in(PARTICLES, "count = 20", "# none", false, &["`bodies.0.count` is missing"]);
    wrong_in(PARTICLES, "seed = 3", "at = [[0, 0]]", false, &["exactly one of `box`, `disc`, `ring` and `at`"]);
}

#[test]
fn bodies_that_do_not_fit_a_flow() {
    wrong_in(STOKES, "epsilon = 1e-6", "epsilon = 1.0", true, &["`rigid.epsilon` = 1.0", "both excluded"]);
    wrong_in(STOKES, "epsilon = 1e-6", "epsilon = 0", true, &["`rigid.epsilon`"]);
    wrong_in(STOKES, "epsilon = 1e-6", "order = 3", true, &["`rigid.order` = 3", "must be 1 or 2"]);
    wrong_in(STOKES, "radius = 0.1", "radius = 0.6", false, &["`body.0`", "larger than the domain, 1.0000 by 1.0000"]);
    wrong_in(STOKES, "position = [0.5, 0.5]", "position = [3, 0.5]", false, &["lies wholly outside of the mesh"]);
    wrong_in(
        STOKES,
        "tag = \"bottom\"",
        "tag = \"botom\"",
        true,
        &["`wall.0.tag`", "did you mean `bottom`?", "left, right"],
    );
    wrong_in(
        STOKES,
        "position = [0.5, 0.5]",
        "position = [0.5, 0.05]",
        false,
        &["overlaps the wall `wall.0`", "boundary"],
    );
    let none = "[[body]]\nshape = { disc = { radius = 0.1 } }\nposition = [0.5, 0.5]\n";
    wrong_in(STOKES, none, "", false, &["`wall` = (given)", "no body that it could act on"]);
    wrong_in(STOKES, "[[wall]]\ntag = \"bottom\"", "[contact]", false, &["`contact`", "a single body"]);
    let measure = "[[output]]\nmeasures = [\"overshoot\"]\n[time]";
    wrong_in(STOKES, "[time]", measure, false, &["a Stokes flow", "no such measure", "kinetic_energy, gap"]);
    let fields = "[[output]]\nfields = [\"polarity\"]\n[time]";
    wrong_in(STOKES, "[time]", fields, false, &["no such field", "velocity, pressure"]);
}
