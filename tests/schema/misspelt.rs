//! What the program refuses of misspelt keys and wrong values, the schemas refuse.

use monolayer::study::SweepStudy;
use monolayer::{scene, study};

use super::ranges::{ADVECTION, PARTICLES, STOKES, TISSUE};
use super::{check, root, validator, wrong};

/// A scene, what stands in it, and a mistake in its place.
const MISTAKES: [(&str, &str, &str); 30] = [
    (TISSUE, "peclet =", "pecle ="),
    (TISSUE, "kind = \"incompressible\"", "kind = \"incompresible\""),
    (TISSUE, "coherence = 0.5", "coherence = \"0.5\""),
    (TISSUE, "elasticity = 0.4", "elasticity = -0.4"),
    (TISSUE, "friction = 3.0", "friction = 3.0\nbeta = 0.75"),
    (TISSUE, "shape = \"strip-with-disc\"", "shape = \"strip-with-disk\""),
    (TISSUE, "h_disc = 0.5", "h_disk = 0.5"),
    (TISSUE, "width = 6.0", "widht = 6.0"),
    (TISSUE, "h_disc = 0.5", "h_disc = 0.5\nn = 8"),
    (TISSUE, "velocity = \"slip\"", "velocity = \"slipp\""),
    (TISSUE, "dirichlet = [\"1\", \"0\"]", "dirichlet = [\"1\", \"0\", \"0\"]"),
    (TISSUE, "polarity = \"neumann\"", "polarity = \"neuman\""),
    (TISSUE, "scheme = \"bdf2\"", "scheme = \"bdf7\""),
    (TISSUE, "end = 0.1", "ende = 0.1"),
    (TISSUE, "max_steps = 10", "max_steps = 10.5"),
    (TISSUE, "measures = [\"free_energy\"]", "measures = [\"free_enrgy\"]"),
    (TISSUE, "fields = [\"velocity\"]", "fields = [\"density\"]"),
    (TISSUE, "every = { steps = 1 }", "every = { steps = 1, time = 0.1 }"),
    (TISSUE, "random = { seed = 1", "random = { sed = 1"),
    (STOKES, "penalty = 1e-8", "penalty = 1e-8\ndegree = { velocity = 2 }"),
    (STOKES, "capsule = { length = 0.1, radius = 0.05 }", "capsule = { lenght = 0.1, radius = 0.05 }"),
    (STOKES, "hollow = { centre", "holow = { centre"),
    (PARTICLES, "dynamics = \"inertial\"", "dynamics = \"inertia\""),
    (STOKES, "rounding = 0.01", "rouding = 0.01"),
    (STOKES, "velocity = { dirichlet = [\"0\", \"0\"] }", "velocity = { friction = [\"0\", \"0\"] }"),
    (STOKES, "velocity = { dirichlet = [\"0\", \"0\"] }", "velocity = \"friction\""),
    (PARTICLES, "bodies = true", "fields = [\"velocity\"]"),
    (PARTICLES, "[contact]", "[rigid]\nepsilon = 1e-8\n[contact]"),
    (ADVECTION, "velocity = [\"1\", \"0\"]", "velocity = \"1\""),
    (ADVECTION, "order = 2", "ordre = 2"),
];

#[test]
fn scenes() {
    let all = validator(&scene::schema::of_scenes());
    for (scene, right, mistaken) in MISTAKES {
        assert!(scene.contains(right), "{right}");
        check(scene, root()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(wrong(&all, scene), Vec::<String>::new());
        let text = scene.replacen(right, mistaken, 1);
        assert!(check(&text, root()).is_err(), "check takes {mistaken}");
        assert!(!wrong(&all, &text).is_empty(), "the schema takes {mistaken}");
    }
}

/// The message of the schema is about the key, and about nothing else.
#[test]
fn the_place_of_a_mistake() {
    let all = validator(&scene::schema::of_scenes());
    let found = wrong(&all, &TISSUE.replacen("peclet =", "pecle =", 1));
    assert!(found.iter().all(|error| error.starts_with("/model")), "{found:#?}");
    assert!(found.iter().any(|error| error.contains("pecle'")), "{found:#?}");
    let found = wrong(&all, &STOKES.replacen("hollow = { centre", "holow = { centre", 1));
    assert!(found.iter().all(|error| error.starts_with("/wall/")), "{found:#?}");
}

const SWEEP: &str = r#"
title = "overshoot by Pe"
scene = "scene.toml"
set = { "time.end" = 0.2 }
vary = { "model.peclet" = { logspace = [0.25, 4.0, 5] }, "model.elasticity" = [0.0, 0.4] }
warm_start = "model.peclet"
measures = ["free_energy"]
plot = { x = "model.peclet", y = "free_energy", series = "model.elasticity", log = "x" }
[[case]]
name = "soft"
set = { "model.elasticity" = 0.1 }
"#;

#[test]
fn studies() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), TISSUE.replace("[steady]", "[steady]\nmarch = 0.0")).unwrap();
    let read = |text: &str| {
        let file = folder.path().join("study.toml");
        std::fs::write(&file, text).unwrap();
        SweepStudy::read(&file, &[]).map(drop).map_err(|error| error.to_string())
    };
    let schema = validator(&study::schema::of_kind("study").unwrap());
    read(SWEEP).unwrap();
    assert_eq!(wrong(&schema, SWEEP), Vec::<String>::new());
    for (right, mistaken) in [
        ("vary =", "varry ="),
        ("logspace", "lgspace"),
        ("log = \"x\"", "log = \"z\""),
        ("scene = \"scene.toml\"\n", ""),
        ("name = \"soft\"", "nam = \"soft\""),
        ("warm_start = \"model.peclet\"", "warm_start = 3"),
    ] {
        let text = SWEEP.replacen(right, mistaken, 1);
        assert!(read(&text).is_err(), "the study takes {mistaken}");
        assert!(!wrong(&schema, &text).is_empty(), "the schema takes {mistaken}");
    }
}
