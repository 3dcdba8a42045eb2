//! Names: old ones go on, those of papers and other programs are answered, and no hint offers the opposite.

use std::path::Path;
use std::process::{Command, Output};

use monolayer::measure::fields;
use monolayer::measure::list::{self, Asked};
use monolayer::names::{RENAMED, did_you_mean, nearest};
use monolayer::run::AnyScene;
use monolayer::scene::{Quantity, Scene, SceneSource, SlipTreatment, What, renamed};

use super::{DISC, SHEET, STRIP};

/// What is said of an override of the strip.
fn said(path: &str, value: &str) -> String {
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    let result = source.set(path, value).map(|()| source.clone()).and_then(Scene::check);
    result.expect_err(&format!("{path} = {value} is wrong")).to_string()
}

#[track_caller]
fn says(path: &str, value: &str, parts: &[&str]) {
    let message = said(path, value);
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

#[test]
fn old_keys_go_on_with_a_note() {
    let old = STRIP.replace("alignment = 1.0", "slip = 0.25").replace("[space]", "[space]\nslip = \"penalty\"");
    let old = old.replace("\"free_energy\"", "\"free-energy\"");
    let scene = Scene::parse(&old, Path::new("old.toml")).unwrap();
    assert_eq!(scene.parameters.alignment, 0.25);
    assert_eq!(scene.space.slip, SlipTreatment::Penalty { epsilon: 1e-8 });
    let told = scene.remarks();
    for (old, new) in RENAMED {
        let note = format!("`{old}` is called `{new}` now; the old name still works");
        assert!(told.contains(&note), "{told:?}");
    }
    assert!(told.iter().any(|note| note.starts_with("`free-energy` is called `free_energy` now")), "{told:?}");
    let text = scene.resolved_toml();
    assert!(text.contains("alignment = 0.25") && text.contains("walls = \"penalty\"") && !text.contains("free-energy"));
    let again = Scene::parse(&text, Path::new("new.toml")).unwrap();
    assert!(again.source().notes().is_empty() && again.parameters == scene.parameters);
}

#[test]
fn old_overrides_go_on_with_a_note() {
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    source.set("model.slip", "-0.5").unwrap();
    source.set("space.slip", "penalty").unwrap();
    source.set("output.1.measures", "[\"energy-budget\"]").unwrap();
    source.set("output.0.fields.0", "stream-function").unwrap();
    source.set("boundary.inlet.velocity.dirichlet.0", "1 + slip").unwrap();
    let scene = Scene::check(source).unwrap();
    assert_eq!(scene.parameters.alignment, -0.5);
    assert_eq!(scene.source().notes().len(), 4, "{:?}", scene.source().notes());
    assert_eq!(scene.outputs[1].what, What::Measures(vec![Asked::from(&list::ENERGY_BUDGET)]));
    says("model.slip", "7", &["`model.alignment` = 7", "must lie in [-1, 1]"]);
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    source.set("model.slip", "").unwrap();
    assert!(!source.text().contains("alignment"), "the key itself is removed");
}

#[test]
fn an_old_key_beside_the_new_one_is_refused() {
    let both = STRIP.replace("alignment = 1.0", "alignment = 1.0\nslip = 0.5");
    let message = Scene::parse(&both, Path::new("both.toml")).unwrap_err().to_string();
    assert!(message.contains("`model.slip`") && message.contains("did you mean `alignment`?"), "{message}");
}

#[test]
fn words_of_studies_are_renamed_in_their_places() {
    let study = "title = \"model.slip\"\nscene = \"a.toml\"\n\
                 set = { \"space.slip\" = \"penalty\", \"output.1.measures\" = [\"free-energy\"] }\n\
                 measures = [\"overshoot-velocity\"]\nplot = { x = \"model.slip\", y = \"free-energy\" }\n[vary]\n\
                 \"model.slip\" = [0, 1]\n";
    let now = "title = \"model.slip\"\nscene = \"a.toml\"\n\
               set = { \"space.walls\" = \"penalty\", \"output.1.measures\" = [\"free_energy\"] }\n\
               measures = [\"overshoot_velocity\"]\nplot = { x = \"model.alignment\", y = \"free_energy\" }\n[vary]\n\
               \"model.alignment\" = [0, 1]\n";
    assert_eq!(renamed::modern(study).0, now);
    let branch = "scene = \"a.toml\"\nparameter = \"model.slip\"\nmeasure = \"asymmetry-velocity\"\n";
    let now = "scene = \"a.toml\"\nparameter = \"model.alignment\"\nmeasure = \"asymmetry_velocity\"\n";
    assert_eq!(renamed::modern(branch).0, now);
    // nothing of today is an old name
    for text in [STRIP, DISC, SHEET] {
        assert_eq!(renamed::modern(text), (text.to_owned(), Vec::new()));
    }
}

#[test]
fn measures_fields_and_quantities_have_one_spelling() {
    let fields = fields::ALL.iter().map(|field| field.name);
    let names = fields.chain(list::ALL.iter().map(|m| m.name)).chain(Quantity::all().map(Quantity::name));
    for name in names {
        assert!(!name.contains('-'), "{name}");
        let old = name.replace('_', "-");
        assert_eq!(renamed::name_now(&old).0, name);
    }
}

/// Conditions of the velocity under the names of other programs.
#[test]
fn no_hint_offers_the_opposite_condition() {
    for name in ["noslip", "no-slip", "no_slip", "NoSlip", "non-slip", "noslipp", "wall", "stick", "rigid-wall", "zero"]
    {
        let message = said("boundary.walls.velocity", name);
        assert!(message.contains("{ dirichlet = [0, 0] }") && !message.contains("did you mean `slip`"), "{message}");
    }
    for (name, part) in [
        ("free-slip", "did you mean `slip`?"),
        ("symmetry", "did you mean `slip`?"),
        ("outflow", "it is \"traction\""),
        ("do-nothing", "it is \"traction\""),
        ("stress-free", "it is \"traction\""),
        ("periodic", "no periodic boundaries"),
        ("navier-slip", "{ friction = b }"),
        ("frictoin", "did you mean `friction`?"),
        ("inflow", "{ dirichlet = [\"v_1\", \"v_2\"] }"),
        ("slipp", "did you mean `slip`?"),
    ] {
        says("boundary.walls.velocity", name, &[part]);
    }
    for (name, part) in
        [("no-flux", "did you mean `neumann`?"), ("anchoring", "p_1"), ("slip", "a condition of the velocity")]
    {
        says("boundary.walls.polarity", name, &[part]);
    }
    let opposites = [
        ("unstable", "stable"),
        ("step_max", "step_min"),
        ("density_max", "density_min"),
        ("elastic", "inelastic"),
        ("asymmetric", "symmetric"),
        ("anisotropic", "isotropic"),
        ("min_steps", "max_steps"),
    ];
    for (name, other) in opposites {
        assert_eq!(nearest(name, &[other]), None, "{name}");
        assert_eq!(nearest(other, &[name]), None, "{other}");
    }
    assert_eq!(nearest("lignment", &["alignment"]), Some("alignment"));
    assert_eq!(nearest("B", &["n", "k"]), None, "one letter is no likeness");
}

#[test]
fn symbols_and_words_of_papers_are_known() {
    for (key, known) in [
        ("S_a", "active_stress"),
        ("T_a", "traction"),
        ("C_F", "friction"),
        ("Pe", "peclet"),
        ("kappa", "coherence"),
        ("κ", "coherence"),
        ("B", "elasticity"),
        ("a", "alignment"),
        ("lambda", "alignment"),
        ("zeta", "active_stress"),
        ("ζ", "active_stress"),
    ] {
        says(&format!("model.{key}"), "1", &[&format!("did you mean `{known}`?")]);
    }
    says("model.viscosity", "1", &["the viscosity, which is 1"]);
    says("model.eta", "1", &["the viscosity, which is 1"]);
    says("model.rho0", "1", &["the reference sheet, which is 1"]);
    says("model.Re", "1", &["no inertia"]);
    says("model.xi", "1", &["`friction`", "`alignment`"]);
    says("time.dt", "1", &["did you mean `step`?"]);
    says("time.tmax", "1", &["did you mean `end`?"]);
    says("time.step_max", "1", &["the first step and the largest one"]);
    says("time.t0", "1", &["runs start at t = 0"]);
    says("time.scheme", "euler", &["did you mean `bdf1`?"]);
    says("time.scheme", "rk4", &["BDF of order 1 to 6"]);
    says("mesh.dx", "1", &["did you mean `h`?"]);
    says("coupling.tol", "1", &["did you mean `tolerance`?"]);
    says("mesh.shape", "channel", &["did you mean `strip`?"]);
    says("output.1.measures.0", "energy", &["did you mean `free_energy`?"]);
    says("boundary.inlet.velocity.dirichlet.0", "1 - kappa", &["did you mean `coherence`?"]);
    says("boundary.inlet.velocity.dirichlet.0", "arctan(y)", &["did you mean `atan`?"]);
    says("boundary.inlet.velocity.dirichlet.0", "r^2", &["hypot(x, y)"]);
    assert_eq!(did_you_mean("model.kappa", &["model.peclet", "model.coherence"]), " (did you mean `model.coherence`?)");
    assert_eq!(did_you_mean("coherence", &["model.peclet", "model.coherence"]), " (did you mean `model.coherence`?)");
    // the letter itself, where TOML has no such key
    let text = STRIP.replace("coherence = 0.1", "κ = 0.1");
    let message = Scene::parse(&text, Path::new("strip.toml")).unwrap_err().to_string();
    assert!(message.contains("`κ` is none (did you mean `coherence`?)"), "{message}");
}

#[test]
fn keys_in_the_wrong_table_are_shown_their_own() {
    says("model.step", "1", &["`step` belongs into [time]"]);
    says("mesh.peclet", "1", &["`peclet` belongs into [model]"]);
    says("peclet", "1", &["`peclet` belongs into [model]"]);
    says("time.title", "x", &["`title` stands above the tables"]);
    says("model.penalty", "1", &["`penalty` belongs into [space]"]);
}

#[test]
fn unknown_tags_are_told_whatever_their_tables_lack() {
    says(
        "boundary.inlte.velocity",
        "slip",
        &["[boundary.inlte] names no part", "did you mean `inlet`?", "walls, disc"],
    );
    let text =
        STRIP.replace("[boundary.outlet]\nvelocity = \"traction\"\n", "[boundary.outlte]\nvelocity = \"traction\"\n");
    let message = Scene::parse(&text, Path::new("strip.toml"))
        .and_then(|scene| scene.check_tags(&["inlet", "outlet", "walls", "disc"].map(str::to_owned)).map(|()| scene));
    let message = message.unwrap_err().to_string();
    assert!(message.contains("[boundary.outlte] names no part"), "{message}");
}

#[test]
fn bodies_are_known_by_their_names() {
    let text = include_str!("../../studies/bodies/gluey-discs.toml");
    let mut source = SceneSource::parse(text, Path::new("discs.toml")).unwrap();
    let message = source.set("body.wating.density", "2").unwrap_err().to_string();
    for part in ["no [[body]] has the name `wating`", "did you mean `waiting`?", "their names are flying, waiting"] {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    source.set("body.waiting.density", "2").unwrap();
    source.set("body.0.density", "2").unwrap();
}

/// Wrong kinds of values, and what is said of each.
#[test]
fn values_of_the_wrong_kind_are_told() {
    for (path, value, parts) in [
        ("mesh.length", "[0, 1, 2]", ["`mesh.length` = (a list of 3)", "the list is too long"]),
        ("boundary.inlet.velocity", "{ dirichlet = [1, 0, 0] }", ["a list of 3", "too long"]),
        ("mesh.length", "5", ["`mesh.length` = 5", "write a list of two"]),
        ("model.peclet", "[1, 2]", ["`model.peclet` = [1, 2]", "expected a number"]),
        ("model.kind", "3", ["`model.kind` = 3", "write a text, in quotes"]),
        ("time.stop", "1e-6", ["`time.stop`", "write a table: braces around"]),
        ("time.scheme", "2", ["`time.scheme` = 2", "write one of the names, in quotes"]),
        ("output.1.measures", "overshoot", ["`output.1.measures`", "write a list"]),
        ("model.peclet", "-inf", ["`model.peclet` = -inf", "must be greater than 0"]),
        ("time.step", "nan", ["`time.step` = NaN", "must be finite"]),
    ] {
        says(path, value, &parts);
    }
}

#[test]
fn paths_of_thousands_of_keys_are_refused_at_once() {
    let begin = std::time::Instant::now();
    let message = said(&vec!["a"; 5000].join("."), "1");
    assert!(message.contains("a path of more than 32 keys") && message.len() < 1000, "{message}");
    assert!(begin.elapsed().as_secs_f64() < 1.0);
}

#[test]
fn steps_are_blamed_for_themselves() {
    let message = said("time.step", "1e-320");
    assert!(message.contains("`time.step` = 1e-320") && !message.contains("step_min"), "{message}");
    says("time.step", "1e-15", &["`time.step` = 1e-15", "t + step would be t"]);
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

const SQUARE: &str = include_str!("../../studies/mms/square.toml");

/// The scene of a square without exact fields, with formulas of one's own.
fn square(velocity: &str, source: &str, start: &str) -> String {
    let sides =
        |tag: &str, velocity: &str| format!("[boundary.{tag}]\nvelocity = {velocity}\npolarity = \"neumann\"\n");
    let walls: String = ["right", "bottom", "top"].map(|tag| sides(tag, "\"traction\"")).concat();
    format!(
        "[model]\nkind = \"incompressible\"\nfriction = 1.0\npeclet = 1.0\ncoherence = 0.5\n[mesh]\n\
         shape = \"square\"\nn = 2\n{}{walls}[source]\nforce = [\"{source}\", \"0\"]\n[initial]\n\
         polarity = [\"{start}\", \"0\"]\n[time]\nscheme = \"bdf1\"\nstep = 0.1\nend = 0.5\n",
        sides("left", velocity)
    )
}

/// A formula that stops being finite during the run is named by its key and its file, with the place and the time.
#[test]
fn formulas_that_fail_on_the_way_are_named() {
    assert!(SQUARE.contains("kind = \"incompressible\""));
    let temporary = tempfile::tempdir().unwrap();
    let plain = "{ dirichlet = [0, 0] }";
    let cases = [
        (
            square("{ dirichlet = [\"1/(0.25 - t)*0 + sqrt(0.25 - t)\", 0] }", "0", "1"),
            "boundary.left.velocity.dirichlet",
        ),
        (square("{ traction = [\"sqrt(0.25 - t)\", 0] }", "0", "1"), "boundary.left.velocity.traction"),
        (square(plain, "sqrt(0.25 - t)", "1"), "source.force"),
        (square(plain, "0", "1/x"), "initial.polarity"),
    ];
    for (at, (text, key)) in cases.iter().enumerate() {
        std::fs::write(temporary.path().join("a.toml"), text).unwrap();
        let output = run(temporary.path(), &["run", "a.toml", "--out", &at.to_string()]);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{key}: {error}");
        for part in ["a.toml", &format!("`{key}`: "), "at x = ", "t = ", "hint: a formula must be finite"] {
            assert!(error.contains(part), "{key}: `{part}` is not in: {error}");
        }
        assert_eq!(error.matches("a.toml").count(), 1, "{error}");
    }
}

/// A run that was made with the old names goes on, bit for bit, from its own checkpoint.
#[test]
fn runs_with_old_names_are_resumed() {
    let temporary = tempfile::tempdir().unwrap();
    let old = square("{ dirichlet = [1, 0] }", "0", "cos(x)")
        .replace("peclet = 1.0", "peclet = 1.0\nelasticity = 0.5\nslip = 0.5");
    std::fs::write(temporary.path().join("old.toml"), &old).unwrap();
    let output = run(temporary.path(), &["run", "old.toml", "--out", "a", "--set", "time.max_steps=2"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("`model.slip` is called `model.alignment` now"), "{said}");
    // the folder of an older program
    let scene = temporary.path().join("a/scene.toml");
    let text = std::fs::read_to_string(&scene).unwrap().replace("alignment =", "slip =");
    std::fs::write(&scene, text).unwrap();
    let output = run(temporary.path(), &["run", "old.toml", "--out", "a", "--resume"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    run(temporary.path(), &["run", "old.toml", "--out", "b"]);
    let read = |name: &str| std::fs::read(temporary.path().join(name).join("checkpoint.bin")).unwrap();
    let same = |name: &str| std::fs::read_to_string(temporary.path().join(name).join("history.csv")).unwrap();
    assert_eq!(same("a").lines().count(), same("b").lines().count());
    assert!(!read("a").is_empty() && AnyScene::read(&scene).is_ok());
}
