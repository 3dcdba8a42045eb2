//! Extreme values: the message names what was given and is farthest from the usual, never a default alone.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::output::progress::Verbosity;
use monolayer::run::report::report_within;
use monolayer::run::{Ending, Options, run};
use monolayer::scene::{Scene, SceneSource};

const SQUARE: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
peclet = 1.0
coherence = 0.5
elasticity = 0.2
[mesh]
shape = "square"
n = 4
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
polarity = ["1 + 0.1*sin(pi*x)", "0.2*y"]
[time]
scheme = "bdf2"
step = 0.1
end = 0.5
"#;

/// The scene with one value changed; for the compressible kind the keys that it needs are added.
fn scene(kind: &str, (key, value): (&str, &str)) -> Result<Scene, String> {
    let mut source = SceneSource::parse(SQUARE, Path::new("square.toml")).unwrap();
    if kind == "compressible" {
        let sets = [("model.kind", kind), ("model.density", "{ penalty = 1.0 }"), ("initial.density", "1")];
        sets.into_iter().for_each(|(key, value)| source.set(key, value).unwrap());
    }
    source.set(key, value).and_then(|()| Scene::check(source)).map_err(|error| error.to_string())
}

/// What `check` says, and then `run`; nothing where it goes well.
fn said(kind: &str, change: (&str, &str)) -> [Option<String>; 2] {
    let scene = match scene(kind, change) {
        Ok(scene) => scene,
        Err(error) => return [Some(error.clone()), Some(error)],
    };
    let checked = report_within(&scene, None).err().map(|error| error.to_string());
    let folder = tempfile::tempdir().unwrap();
    static NEVER: AtomicBool = AtomicBool::new(false);
    let out = folder.path().join("out");
    let options = Options { out, resume: false, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    let ran = match run(&scene, &options).map(|summary| summary.ending) {
        Ok(Ending::Failed { reason }) => Some(reason),
        Ok(_) => None,
        Err(error) => Some(error.to_string()),
    };
    [checked, ran]
}

/// Keys of which every extreme is tried.
const KEYS: [&str; 14] = [
    "model.friction",
    "model.beta",
    "model.traction",
    "model.active_stress",
    "model.peclet",
    "model.coherence",
    "model.elasticity",
    "model.alignment",
    "model.active_stress_iso",
    "model.density.penalty",
    "model.density.exponent",
    "model.density.critical",
    "time.step",
    "time.end",
];

/// Whatever an extreme value leads to is said of its own key, with one hint.
#[test]
fn every_extreme_of_a_number_is_said_of_its_key() {
    for kind in ["incompressible", "compressible"] {
        let own = |key: &&str| kind == "compressible" || !key.contains("density") && !key.ends_with("_iso");
        for key in KEYS.into_iter().filter(own) {
            for value in ["1e30", "1e-30", "-1e30", "-1e-30", "1e100", "1e-100", "1e300", "1e-300"] {
                let named = format!("`{key}` = ");
                for message in said(kind, (key, value)).into_iter().flatten() {
                    println!("{kind}, {key} = {value}: {message}\n");
                    assert!(
                        message.contains(&named) || message.contains("here are both"),
                        "{key} = {value}: {message}"
                    );
                    assert_eq!(message.matches("; hint: ").count(), 1, "{message}");
                    assert!(!message.contains("00000000000000000000"), "{message}");
                }
            }
        }
    }
}

/// What goes wrong must be said at once, and in these words.
#[test]
fn the_culprit_is_named() {
    let follows = "`model.traction`, which is not given, follows from it";
    let far = "far outside of the usual";
    let cases: [((&str, &str), usize, &[&str]); 8] = [
        (("model.friction", "1e300"), 0, &["`model.friction` = 1e300", "between 1e-40 and 1e40"]),
        (("model.friction", "1e30"), 0, &["`model.friction` = 1e30", far, follows, "near 1"]),
        (("model.coherence", "1e30"), 1, &["`model.coherence` = 1e30", far, "a tenth of the domain"]),
        (("model.elasticity", "1e30"), 1, &["`model.elasticity` = 1e30", far, "near 1"]),
        (("initial.polarity", "[\"1e200\", \"0\"]"), 0, &["`initial.polarity` (", "reaches 1e200", "near 1"]),
        (("initial.polarity", "[\"exp(500*x)\", \"0\"]"), 0, &["`initial.polarity` (", "reaches 1e217", "near 1"]),
        (("mesh.length", "[0, 1e9]"), 0, &["`mesh.length` = [0, 1e9]", far, "lengths are near 1"]),
        (("time.end", "1e-30"), 0, &["`time.end` = 1e-30", "shorter than a step"]),
    ];
    for (change, at, parts) in cases {
        let message = said("incompressible", change)[at].clone().unwrap_or_else(|| panic!("{change:?} is no error"));
        println!("{message}\n");
        parts.iter().for_each(|part| assert!(message.contains(part), "`{part}` is not in: {message}"));
    }
}

/// Formulas of any place.
#[test]
fn formulas_of_boundaries_and_sources_are_named() {
    for (change, key) in [
        (("boundary.left.velocity", "{ traction = [\"1e200\", \"0\"] }"), "boundary.left.velocity"),
        (("boundary.left.polarity", "{ dirichlet = [\"1e200\", \"0\"] }"), "boundary.left.polarity"),
        (("source.force", "[\"1e250*x\", \"0\"]"), "source.force"),
        (("source.polarity", "[\"1e200\", \"0\"]"), "source.polarity"),
    ] {
        let messages: Vec<String> = said("incompressible", change).into_iter().flatten().collect();
        assert!(!messages.is_empty(), "{change:?} is no error");
        for message in messages {
            println!("{message}\n");
            assert!(message.contains(&format!("`{key}")), "{message}");
        }
    }
}
