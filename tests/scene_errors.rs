//! Wrong scenes, each with its message: file, line, key, value, rule, hint.

use std::path::Path;

use monolayer::scene::{Scene, SceneSource};

const STRIP: &str = include_str!("data/strip.toml");

/// The strip with `from` replaced by `to`, and the line on which `to` then stands.
fn changed(from: &str, to: &str) -> (String, usize) {
    let at = STRIP.find(from).unwrap_or_else(|| panic!("the strip scene has no `{from}`"));
    (STRIP.replacen(from, to, 1), STRIP[..at].matches('\n').count() + 1)
}

fn refused(text: &str) -> String {
    Scene::parse(text, Path::new("strip.toml")).expect_err("the scene is wrong").to_string()
}

fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
    println!("{message}\n");
}

/// Replaces, and expects the line of the change and `parts` in the message.
fn wrong(from: &str, to: &str, parts: &[&str]) {
    let (text, line) = changed(from, to);
    let message = refused(&text);
    says(&message, &[&format!("strip.toml, line {line}: ")]);
    says(&message, parts);
}

#[test]
fn misspelt_keys_and_tables() {
    let parts = ["`model.pecle`", "did you mean `peclet`?", "kind, friction, beta, traction"];
    wrong("peclet = 2.0", "pecle = 2.0", &parts);
    wrong("[initial]", "[intial]", &["`intial`", "did you mean `initial`?", "model, mesh"]);
    wrong("stop = { residual", "stop = { residuals", &["`time.stop.residuals`", "did you mean `residual`?"]);
    wrong("every = { time", "every = { tiem", &["`output.0.every.tiem`", "did you mean `time`?", "time, steps"]);
    wrong("h_disc = 0.13", "hdisc = 0.13", &["`mesh.hdisc`", "did you mean `h_disc`?"]);
}

#[test]
fn a_misspelt_key_of_a_boundary() {
    let (text, line) = changed("velocity = \"traction\"", "velocty = \"traction\"");
    let at = format!("line {line}");
    says(&refused(&text), &[&at, "`boundary.outlet.velocty`", "did you mean `velocity`?", "velocity, polarity"]);
}

#[test]
fn wrong_types() {
    wrong("peclet = 2.0", "peclet = \"fast\"", &["`model.peclet` = \"fast\"", "expected a number", "without quotes"]);
    wrong("k = 1", "k = -1", &["`space.k` = -1", "expected a whole number, not negative"]);
    wrong("[\"1\", \"0\"]", "[\"1\"]", &["`boundary.inlet.velocity", "array of length 2"]);
    wrong("\"aligned-around-disc\"", "3", &["`initial.polarity` = 3", "two formulas"]);
    wrong("{ steps = 10 }", "{ steps = 0.5 }", &["`output.1.every.steps` = 0.5", "whole number"]);
}

#[test]
fn values_out_of_range() {
    wrong("peclet = 2.0", "peclet = 0.0", &["`model.peclet` = 0", "greater than 0", "time derivative"]);
    wrong("beta = 0.75", "beta = 1.0", &["`model.beta` = 1", "[0, 1)", "C_F"]);
    wrong("beta = 0.75", "friction = -3", &["`model.friction` = -3", "not negative"]);
    wrong("coherence = 0.1", "coherence = nan", &["`model.coherence` = NaN", "greater than 0"]);
    wrong("elasticity = 0.4", "elasticity = -0.4", &["`model.elasticity` = -0.4", "must not be negative"]);
    wrong("alignment = 1.0", "alignment = 1.5", &["`model.alignment` = 1.5", "[-1, 1]", "upper-convected"]);
    wrong("active_stress = 0.0", "active_stress = inf", &["`model.active_stress` = inf", "finite"]);
    wrong("k = 1 ", "k = 4 ", &["`space.k` = 4", "1, 2 or 3"]);
    wrong("peclet = 2.0", "peclet = 1e300", &["`model.peclet` = 1", "between 1e-40 and 1e40", "units"]);
    wrong("coherence = 0.1", "coherence = 1e-300", &["`model.coherence` = ", "between 1e-40 and 1e40"]);
    for penalty in ["1e300", "0.5", "1e-300", "0.0", "-1e-8", "nan"] {
        let more = format!("penalty = {penalty}\nk = 1 ");
        let text = changed("k = 1 ", &more).0;
        let parts = ["`space.penalty` = ", "must lie between 1e-16 and 0.01", "leaks through slip walls", "1e-8"];
        says(&refused(&text), &parts);
    }
    wrong("step = 0.1", "step = -0.1", &["`time.step` = -0.1", "greater than 0"]);
    wrong("residual = 1e-8", "residual = 0.0", &["`time.stop.residual` = 0", "greater than 0"]);
    wrong("time = 10.0", "time = 0", &["`output.0.every.time` = 0", "greater than 0"]);
}

#[test]
fn friction_and_beta_exclude_each_other() {
    wrong("beta = 0.75", "beta = 0.75\nfriction = 3.0", &["`model.beta` = 0.75", "here are both", "remove one"]);
    let (text, line) = changed("beta = 0.75", "alignment = 0.5");
    let text = text.replace("alignment = 1.0", "");
    let at = format!("line {}", line - 2);
    says(&refused(&text), &[&at, "`model.friction` = (missing)", "exactly one", "beta = 0.75"]);
}

#[test]
fn keys_that_are_missing() {
    let (text, line) = changed("peclet = 2.0\n", "");
    says(&refused(&text), &[&format!("line {}", line - 3), "`model.peclet` is missing", "add `peclet = …` to [model]"]);
    let (text, _) = changed("[initial]\npolarity = \"aligned-around-disc\"", "");
    says(&refused(&text), &["`initial` is missing", "add the table [initial]"]);
    let (text, line) = changed("[boundary.outlet]\nvelocity = \"traction\"", "[boundary.outlet]");
    says(&refused(&text), &[&format!("line {line}"), "`boundary.outlet.velocity` is missing"]);
    let (text, _) = changed("shape = \"strip-with-disc\"", "");
    says(&refused(&text), &["`mesh.shape` = (missing)", "exactly one of `shape` and `file`"]);
}

#[test]
fn models_and_conditions_that_do_not_exist() {
    wrong(
        "\"incompressible\"",
        "\"incompresible\"",
        &["`model.kind`", "no such model (did you mean `incompressible`?)"],
    );
    wrong("\"incompressible\"", "\"elastic\"", &["`model.kind` = \"elastic\"", "no such model"]);
    let choices = ["`boundary.walls.velocity` = \"slipp\"", "did you mean `slip`?", "\"no-tangential\""];
    let (text, line) = changed("[boundary.walls]\nvelocity = \"slip\"", "[boundary.walls]\nvelocity = \"slipp\"");
    let message = refused(&text);
    says(&message, &[&format!("line {}", line + 1)]);
    says(&message, &choices);
    wrong("\"traction\"", "\"dirichlet\"", &["`boundary.outlet.velocity`", "needs its two components"]);
    wrong("\"traction\"", "{ slip = [1, 0] }", &["`boundary.outlet.velocity`", "takes no values"]);
    wrong("\"neumann\"", "\"neuman\"", &["`boundary.walls.polarity`", "did you mean `neumann`?"]);
    wrong("\"bdf2\"", "\"bdf7\"", &["`time.scheme`", "`bdf7` is not among the choices", "bdf1, bdf2", "bdf6"]);
    wrong("\"strip-with-disc\"", "\"strip-with-disk\"", &["`mesh.shape`", "did you mean `strip-with-disc`?"]);
    wrong("\"aligned-around-disc\"", "\"aligned\"", &["`initial.polarity` = \"aligned\"", "random", "file"]);
    wrong("\"aligned-around-disc\"", "{ rnadom = { seed = 1 } }", &["did you mean `random`?", "random, file"]);
    wrong("\"aligned-around-disc\"", "{ random = { sed = 1 } }", &["`initial.polarity.random.sed`", "`seed`?"]);
    wrong("\"axis-2a\"", "\"axis-2\"", &["`output.2.cuts.1` = \"axis-2\"", "axis-1, axis-2a"]);
    wrong("\"pressure\"", "\"presure\"", &["`output.0.fields.1`", "did you mean `pressure`?", "molecular_field"]);
    wrong("\"overshoot\"", "\"budget\"", &["`output.1.measures.0`", "free_energy, overshoot, asymmetry"]);
}

#[test]
fn bad_formulas() {
    let rule =
        ["`boundary.inlet.velocity.dirichlet` = \"1 - pecle*y\"", "`pecle`", "did you mean `peclet`?", "x, y, t"];
    wrong("[\"1\", \"0\"]", "[\"1 - pecle*y\", \"0\"]", &rule);
    wrong("[\"1\", \"0\"]", "[\"1 -\", \"0\"]", &["\"1 -\"", "character 4", "found the end"]);
    wrong("[\"1\", \"0\"]", "[\"1/0\", \"0\"]", &["\"1/0\"", "is inf at", "must be finite"]);
    wrong("\"aligned-around-disc\"", "[\"cos(x\", \"0\"]", &["`initial.polarity` = \"cos(x\"", "expected `)`"]);
}

#[test]
fn rules_between_keys() {
    let parts = ["`time.step` = 0.1", "time.step_min = 0.2", "lower `step_min`"];
    wrong("step = 0.1\nend = 400.0", "step = 0.1\nend = 400.0\nstep_min = 0.2", &parts);
    wrong("step = 0.1", "step = 1000.0", &["`time.step` = 1000", "time.end = 400", "raise `end`"]);
    wrong("k = 1 ", "degree = { pressure = 2 } ", &["`space.degree.pressure` = 2", "velocity's degree 2"]);
    wrong("k = 1 ", "degree = { velocity = 6 } ", &["`space.degree.velocity` = 6", "between 2 and 5"]);
    let energy = "stop = { energy_rate = 1e-9 }";
    let text = changed("stop = { residual = 1e-8 }", energy).0.replace("elasticity = 0.4", "elasticity = 0");
    says(&refused(&text), &["`time.stop.energy_rate`", "free energy is zero", "use time.stop.residual"]);
    let text = changed("\"pressure\"", "\"molecular_field\"").0.replace("elasticity = 0.4", "elasticity = 0");
    says(&refused(&text), &["`output.0.fields` = \"molecular_field\"", "elasticity = 0"]);
    let text = changed("\"pressure\"", "\"tissue_velocity\"").0.replace("beta = 0.75", "friction = 0");
    says(&refused(&text), &["\"tissue_velocity\"", "friction > 0"]);
    wrong("[[output]]\nfields", "[[output]]\ncheckpoint = true\nfields", &["`output.0`", "exactly one", "[[output]]"]);
    wrong("{ time = 10.0 }", "{ time = 10.0, steps = 3 }", &["`output.0.every`", "exactly one of `time` and `steps`"]);
    wrong("[\"velocity\", \"pressure\", \"polarity\"]", "[]", &["`output.0.fields` = []", "the list is empty"]);
    wrong("residual = 1e-8 }", "energy_rate = -1e-9 }", &["`time.stop.energy_rate` = -1e-9", "greater than 0"]);
}

#[test]
fn undetermined_velocity() {
    let mut text =
        STRIP.replace("beta = 0.75", "friction = 0.0").replace("velocity = \"slip\"", "velocity = \"traction\"");
    text = text.replacen("velocity = { dirichlet = [\"1\", \"0\"] }", "velocity = \"traction\"", 1);
    says(&refused(&text), &["`model.friction` = 0", "undetermined", "friction > 0"]);
}

#[test]
fn cuts_that_are_no_lines() {
    let line = "{ name = \"a/b\", from = [0, 0], to = [1, 0] }";
    wrong("\"axis-2a\"", line, &["`output.2.cuts.1.name` = \"a/b\"", "file name"]);
    let line = "{ name = \"a\", from = [1, 0], to = [1, 0] }";
    wrong("\"axis-2a\"", line, &["`output.2.cuts.1.to`", "differ from `from`"]);
    wrong("\"axis-2a\"", "{ name = \"a\", from = [1, 0] }", &["`output.2.cuts.1.to` is missing"]);
}

#[test]
fn texts_that_are_not_toml() {
    wrong("peclet = 2.0", "peclet = = 2.0", &["not TOML", "hint: "]);
    wrong("velocity = \"traction\"", "velocity = traction", &["not TOML", "needs quotes"]);
    let (text, line) = changed("coherence = 0.1", "peclet = 3.0");
    says(&refused(&text), &[&format!("line {line}"), "duplicate key", "give each key once"]);
}

#[test]
fn files_that_are_missing() {
    let error = Scene::read(Path::new("no-such-folder/scene.toml")).unwrap_err().to_string();
    says(&error, &["no-such-folder/scene.toml: cannot be read", "hint: give the path of a scene"]);
    let parts = ["`mesh.file` = \"gone.msh\"", "there is no such file", "scene's folder"];
    wrong("shape = \"strip-with-disc\"", "file = \"gone.msh\"", &parts);
    wrong("\"aligned-around-disc\"", "{ file = \"gone.vtu\" }", &["`initial.polarity.file`", "no such file"]);
    let both = "file = \"a.msh\"\nshape = \"strip-with-disc\"";
    wrong("shape = \"strip-with-disc\"", both, &["`mesh.file`", "exactly one", "remove one of the two"]);
}

#[test]
fn tags_of_the_mesh() {
    let strip = Scene::parse(STRIP, Path::new("strip.toml")).unwrap();
    let tags = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    let line = STRIP[..STRIP.find("[boundary.walls]").unwrap()].matches('\n').count() + 1;
    let error = strip.check_tags(&tags(&["inlet", "outlet", "wall", "disc"])).unwrap_err().to_string();
    let at = format!("strip.toml, line {line}: ");
    says(&error, &[&at, "[boundary.walls]", "did you mean `wall`?", "inlet, outlet, wall, disc"]);
    let error = strip.check_tags(&tags(&["inlet", "outlet", "walls", "disc", "hole"])).unwrap_err().to_string();
    says(&error, &["strip.toml", "`hole`", "has no condition", "add [boundary.hole]"]);
}

fn set(path: &str, value: &str) -> String {
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    let result = source.set(path, value).map(|()| source.clone()).and_then(Scene::check);
    result.expect_err("the override is wrong").to_string()
}

#[test]
fn overrides() {
    let known = ["strip.toml with `model.pecle` set", "`model.pecle`", "did you mean `peclet`?", "coherence"];
    says(&set("model.pecle", "4.0"), &known);
    says(&set("modle.peclet", "4.0"), &["`modle`", "did you mean `model`?", "space, boundary"]);
    says(&set("model.peclet", "fast"), &["`model.peclet` set", "= \"fast\"", "expected a number"]);
    says(&set("model.peclet", "-4"), &["`model.peclet` set", "`model.peclet` = -4", "greater than 0"]);
    says(&set("model.friction", "2"), &["here are both", "--set model.beta="]);
    says(&set("output.9.every.time", "1"), &["`9` is no element of a list of 4", "counted from 0"]);
    for (path, value) in
        [("body.0.radius", "1"), ("body.0.radius", ""), ("bodies.3.count", "1"), ("wall.0.a", "[0, 0]")]
    {
        let list = path.split('.').next().unwrap();
        let rule = format!("there is no list `{list}`, and so no element");
        says(&set(path, value), &[path, &rule, "hint: ", "the lists of this file are `output` (elements 0 to 3)"]);
    }
    says(&set("output.9.every.time", ""), &["`9` is no element of a list of 4"]);
    says(&set("output.4", "{ fields = [\"velocty\"] }"), &["`output.4.fields.0`", "did you mean `velocity`?"]);
    says(&set("mesh.centre.0", "1"), &["there is no list `centre`", "as a whole, in brackets"]);
    says(&set("output.0.every.tiem", "1"), &["`output.0.every.tiem`", "time, steps"]);
    says(&set("output.0.every.steps", "1"), &["`output.0.every`", "exactly one of `time` and `steps`"]);
    says(&set("boundary.disc.velocity.traction", "[1, 0]"), &["\"slip\"", "no key `traction`", "as a whole"]);
    says(&set("mesh.length", "[-30, 50"), &["`mesh.length`", "not a TOML value", "quote it for the shell"]);
    says(&set("model", "3"), &["`model` = 3", "expected a table;"]);
    says(&set("model..peclet", "3"), &["no path of keys"]);
    says(&set("boundary.inlet.velocity", "slipp"), &["did you mean `slip`?", "\"no-tangential\""]);
    says(&set("time.step_min", "1.0"), &["`time.step` = 0.1", "time.step_min = 1"]);
}

#[test]
fn whole_elements_are_appended() {
    let mut source = SceneSource::parse(STRIP, Path::new("strip.toml")).unwrap();
    source.set("output.4", "{ measures = [\"asymmetry\"] }").unwrap();
    assert_eq!(Scene::check(source).unwrap().outputs.len(), 5);
    let without = STRIP.split("[[output]]").next().unwrap();
    let mut source = SceneSource::parse(without, Path::new("strip.toml")).unwrap();
    let refused = source.set("output.7.every", "5").expect_err("there are no outputs").to_string();
    says(&refused, &["there is no list `output`, and so no element `7` of it", "no lists of tables"]);
    source.set("output.0", "{ measures = [\"asymmetry\"] }").unwrap();
    assert_eq!(Scene::check(source).unwrap().outputs.len(), 1);
}

const SQUARE: &str = include_str!("../studies/mms/square.toml");

/// The manufactured scene with `from` replaced by `to` is refused on the line of the change.
#[track_caller]
fn wrong_square(from: &str, to: &str, parts: &[&str]) {
    let at = SQUARE.find(from).unwrap_or_else(|| panic!("the square scene has no `{from}`"));
    let message = refused_as("square.toml", &SQUARE.replacen(from, to, 1));
    says(&message, &[&format!("square.toml, line {}: ", SQUARE[..at].matches('\n').count() + 1)]);
    says(&message, parts);
}

fn refused_as(name: &str, text: &str) -> String {
    Scene::parse(text, Path::new(name)).expect_err("the scene is wrong").to_string()
}

#[test]
fn what_needs_exact_fields() {
    let rule = ["the scene has no exact fields", "hint: add a table [exact]"];
    wrong("\"aligned-around-disc\"", "\"exact\"", &["`initial.polarity` = \"exact\"", rule[0], rule[1]]);
    wrong("step = 0.1", "start = \"exact\"\nstep = 0.1", &["`time.start` = \"exact\"", rule[0], rule[1]]);
    let bare = "`dirichlet` needs its two components, because there is no [exact] to take them from";
    wrong("\"traction\"", "\"dirichlet\"", &["`boundary.outlet.velocity` = \"dirichlet\"", bare]);
    wrong("\"neumann\"", "\"dirichlet\"", &["`boundary.walls.polarity` = \"dirichlet\"", bare]);
}

#[test]
fn exact_fields_that_cannot_be_read() {
    let table = ["`exact.presure`", "did you mean `pressure`?", "velocity, pressure, density, polarity, boundary"];
    wrong_square("pressure = ", "presure = ", &table);
    let (head, tail) = SQUARE.split_once("pressure = ").unwrap();
    let without = format!("{head}{}", tail.split_once('\n').unwrap().1);
    says(&refused_as("square.toml", &without), &["`exact.pressure` is missing", "to [exact]"]);
    wrong_square("\"atan(t*(x-1/2)*(y-1/2))\"", "\"atan(t\"", &["`exact.pressure` = \"atan(t\"", "expected `)`"]);
    wrong_square("\"atan(t*(x-1/2)*(y-1/2))\"", "\"pecle*x\"", &["`exact.pressure`", "did you mean `peclet`?"]);
    wrong_square("\"atan(t*(x-1/2)*(y-1/2))\"", "\"log(-1)\"", &["`exact.pressure`", "is NaN", "must be finite"]);
    let boundary = ["`exact.boundary` = \"scen\"", "did you mean `scene`?", "exact, scene"];
    wrong_square("pressure = ", "boundary = \"scen\"\npressure = ", &boundary);
}

#[test]
fn choices_for_orders_of_convergence() {
    let kinds = ["`coupling.kind` = \"newtn\"", "did you mean `newton`?", "fixed-point, anderson, newton"];
    wrong_square("kind = \"newton\"", "kind = \"newtn\"", &kinds);
    let forces = ["`model.elastic_force` = \"energy\"", "not among the choices", "stress, energy-consistent"];
    wrong_square("alignment = 1.0", "elastic_force = \"energy\"", &forces);
    let start = ["`time.start` = \"exakt\"", "did you mean `exact`?", "low-order, exact"];
    wrong_square("scheme = \"bdf2\"", "start = \"exakt\"\nscheme = \"bdf2\"", &start);
    for alternate in ["0.5", "6", "nan", "-1", "inf"] {
        let parts = ["`time.alternate` = ", "must lie between 1 and 5", "1 keeps the steps equal"];
        wrong_square("scheme = \"bdf2\"", &format!("alternate = {alternate}\nscheme = \"bdf2\""), &parts);
    }
}

const SHEET: &str = include_str!("data/compressible.toml");

/// The compressible scene with `from` replaced by `to` is refused on the line of the change, or on that of the table
/// around.
#[track_caller]
fn wrong_sheet(from: &str, to: &str, parts: &[&str]) {
    let at = SHEET.find(from).unwrap_or_else(|| panic!("the compressible scene has no `{from}`"));
    let message = refused_as("sheet.toml", &SHEET.replacen(from, to, 1));
    // what is missing is placed in the table that lacks it
    if !to.is_empty() {
        says(&message, &[&format!("sheet.toml, line {}: ", SHEET[..at].matches('\n').count() + 1)]);
    }
    says(&message, parts);
}

#[test]
fn parameters_of_a_compressible_sheet() {
    let table = "density = { penalty = 2.0, critical = 0.25 }";
    let known = ["`model.density.penality`", "did you mean `penalty`?", "penalty, exponent, critical"];
    wrong_sheet("penalty = 2.0", "penality = 2.0", &known);
    wrong_sheet("penalty = 2.0, ", "", &["`model.density.penalty` is missing", "to [model.density]"]);
    wrong_sheet(table, "", &["`model.density` = (missing)", "density penalty", "hint: add the table [model.density]"]);
    wrong_sheet("penalty = 2.0", "penalty = -1", &["`model.density.penalty` = -1", "not negative", "c_0"]);
    wrong_sheet("critical = 0.25", "critical = -0.1", &["`model.density.critical` = -0.1", "not negative", "ρ_min"]);
    wrong_sheet("critical = 0.25", "exponent = -2", &["`model.density.exponent` = -2", "not negative", "γ = 1"]);
    wrong_sheet("critical = 0.25", "exponent = 1000", &["`model.density.exponent` = 1000", "at most 50", "c_0"]);
    wrong_sheet("critical = 0.25", "exponent = inf", &["`model.density.exponent` = inf", "must be finite"]);
    wrong_sheet("_iso = 0.1", "_iso = nan", &["`model.active_stress_iso` = NaN", "must be finite"]);
    let energy = ["`model.elastic_force` = \"energy-consistent\"", "squeezed", "\"stress\""];
    wrong_sheet("active_stress_iso = 0.1", "elastic_force = \"energy-consistent\"", &energy);
}

#[test]
fn keys_of_a_density_in_an_incompressible_scene() {
    let hint = "hint: remove it, or take kind = \"compressible\"";
    let one = "the density of an incompressible sheet is 1 everywhere";
    let peclet = |more: &str| format!("peclet = 2.0\n{more}");
    let text = changed("peclet = 2.0", &peclet("density = { penalty = 1 }")).0;
    says(&refused(&text), &["line 8: `model.density` = (a table)", one, hint]);
    let text = changed("peclet = 2.0", &peclet("active_stress_iso = 0.5")).0;
    says(&refused(&text), &["line 8: `model.active_stress_iso` = 0.5", "the pressure takes up", hint]);
    wrong("k = 1 ", "degree = { density = 1 } ", &["`space.degree.density` = 1", one, hint]);
    let inlet = "[boundary.inlet]\n";
    let text = changed(inlet, &format!("{inlet}density = 1\n")).0;
    says(&refused(&text), &["`boundary.inlet.density` = \"1\"", one, hint]);
    let polarity = "polarity = \"aligned-around-disc\"";
    let text = changed(polarity, &format!("density = 1\n{polarity}")).0;
    says(&refused(&text), &["`initial.density`", one, hint]);
    wrong("step = 0.1", "density_scheme = \"bdf\"\nstep = 0.1", &["`time.density_scheme`", one, hint]);
    let text = changed("[time]", "[source]\ndensity = \"x\"\n[time]").0;
    says(&refused(&text), &["`source.density` = \"x\"", one, hint]);
    wrong("\"pressure\"", "\"density\"", &["`output.0.fields` = \"density\"", one, hint]);
    for measure in ["mass", "density_min", "limited_cells"] {
        let quoted = format!("\"{measure}\"");
        wrong("\"overshoot\"", &quoted, &[&format!("`output.1.measures` = {quoted}"), one, hint]);
    }
}

#[test]
fn densities_of_a_compressible_sheet() {
    let unknown = ["tissue may flow in here", "hint: add `density = 1.0` or a formula"];
    for (tag, condition, density) in [
        ("inlet", "{ dirichlet = [1, 0] }", "\ndensity = 1.0"),
        ("outlet", "\"traction\"", "\ndensity = \"0.5*density_penalty + 0.1*t\""),
        ("outlet", "\"no-tangential\"", "\ndensity = \"0.5*density_penalty + 0.1*t\""),
    ] {
        let text = SHEET.replacen(density, "", 1).replace("\"traction\"", condition);
        let key = format!("`boundary.{tag}.density` = (missing)");
        says(&refused_as("sheet.toml", &text), &["sheet.toml, line", &key, unknown[0], unknown[1]]);
    }
    let text = SHEET.replace("velocity = \"slip\"", "velocity = \"slip\"\ndensity = 1");
    says(&refused_as("sheet.toml", &text), &["`boundary.walls.density` = \"1\"", "nothing passes", "remove it"]);
    wrong_sheet("density = 1.0", "density = -1.0", &["`boundary.inlet.density` = \"-1\"", "must not be negative"]);
    wrong_sheet("density = 1.0", "density = [1, 0]", &["`boundary.inlet.density`", "expected a formula"]);
    wrong_sheet("0.5*density_penalty", "0.5*density_penlty", &["did you mean `density_penalty`?", "active_stress_iso"]);
    let start = "density = \"1 + 0.1*cos(x)\"";
    wrong_sheet(start, "", &["`initial.density` is missing", "add `density = 1.0` or a formula to [initial]"]);
    wrong_sheet(start, "density = -0.5", &["`initial.density` = \"-0.5\"", "must not be negative"]);
    wrong_sheet(
        start,
        "density = \"exact\"",
        &["`initial.density` = \"exact\"", "no exact fields", "velocity, density"],
    );
    wrong_sheet(start, "density = { file = \"gone.bin\" }", &["`initial.density.file`", "no such file"]);
    wrong_sheet(start, "density = { flie = \"gone.bin\" }", &["`initial.density.flie`", "did you mean `file`?"]);
    wrong_sheet(start, "density = true", &["`initial.density` = true", "a formula, a number, \"exact\""]);
}

#[test]
fn degrees_and_schemes_of_a_compressible_sheet() {
    let with = |degree: &str| format!("[space]\ndegree = {{ {degree} }}\n[initial]\n");
    let refuses = |degree: &str, parts: &[&str]| {
        says(&refused_as("sheet.toml", &SHEET.replacen("[initial]\n", &with(degree), 1)), parts);
    };
    refuses("pressure = 1", &["`space.degree.pressure` = 1", "follows from its density"]);
    refuses("density = 6", &["`space.degree.density` = 6", "between 1 and 5"]);
    refuses("density = 0", &["`space.degree.density` = 0", "between 1 and 5"]);
    refuses("velocity = 0", &["`space.degree.velocity` = 0", "between 1 and 5"]);
    let text = SHEET.replacen("[initial]\n", "[space]\nk = 4\n[initial]\n", 1);
    says(&refused_as("sheet.toml", &text), &["`space.k` = 4", "velocity k+1, density k, polarity k+1"]);
    let choices = ["`time.density_scheme`", "`abd` is not among the choices", "abdf, bdf"];
    wrong_sheet("step = 0.1", "density_scheme = \"abd\"\nstep = 0.1", &choices);
    let text = SHEET.replace("end = 2.0", "end = 2.0\nstop = { energy_rate = 1e-6 }");
    let text = text.replace("elasticity = 0.3", "").replace("penalty = 2.0", "penalty = 0");
    let energy = ["`time.stop.energy_rate`", "density.penalty = 0", "free energy is zero"];
    says(&refused_as("sheet.toml", &text), &energy);
}

#[test]
fn exact_fields_of_a_compressible_sheet() {
    let exact = |fields: &str| {
        let table = format!("\n[exact]\nvelocity = [\"x\", 0]\npolarity = [1, 0]\n{fields}\n[initial]\n");
        SHEET.replacen("[initial]\n", &table, 1)
    };
    let refuses = |fields: &str, parts: &[&str]| says(&refused_as("sheet.toml", &exact(fields)), parts);
    refuses("", &["`exact.density` is missing", "add `density = …` to [exact]"]);
    refuses("pressure = \"x\"", &["`exact.pressure` = \"x\"", "follows from its density", "give `density`"]);
    refuses("density = -2", &["`exact.density` = \"-2\"", "must not be negative"]);
    let hint = "take kind = \"compressible\"";
    wrong_square("pressure = ", "density = 1\npressure = ", &["`exact.density` = \"1\"", "is 1 everywhere", hint]);
}

#[test]
fn data_that_never_rest_and_a_stop() {
    let moving = "[\"1 + 0.1*sin(t)\", \"0\"]";
    let (text, line) =
        changed("velocity = { dirichlet = [\"1\", \"0\"] }", &format!("velocity = {{ dirichlet = {moving} }}"));
    let parts =
        ["`boundary.inlet.velocity` = \"1 + 0.1*sin(t)\"", "not constant from some time on", "`time.stop.residual`"];
    says(&refused(&text), &parts);
    says(&refused(&text), &[&format!("line {line}"), "hint: remove `time.stop.residual`, or let the formula stay"]);
    let rate = text.replace("residual = 1e-8", "energy_rate = 1e-8");
    says(&refused(&rate), &["`boundary.inlet.velocity`", "`time.stop.energy_rate`"]);
    let forced = |formula: &str| format!("{STRIP}\n[source]\nforce = [\"0\", \"{formula}\"]\n");
    says(&refused(&forced("x*t")), &["`source.force` = \"x*t\"", "not constant"]);
    let scene = Scene::parse(&forced("x*min(t, 2)"), Path::new("strip.toml")).expect("constant from t = 2 on");
    assert_eq!(scene.time.rests_from, 2.0);
    let without = text.replace("stop = { residual = 1e-8 }", "");
    Scene::parse(&without, Path::new("strip.toml")).expect("without a stop, data may do what they like");
}

#[test]
fn huge_amounts() {
    let more = |text: &str| format!("{STRIP}\n[[output]]\n{text}\n");
    let cut = more("cuts = [{ name = \"a\", from = [0, 0], to = [1, 0], points = 100000000000 }]");
    says(&refused(&cut), &["points` = 100000000000", "between 2 and 10000000"]);
    let circle = more("cuts = [{ name = \"a\", centre = [0, 0], radius = 2.0, points = 100000000000 }]");
    says(&refused(&circle), &["points` = 100000000000", "between 3 and 10000000"]);
    for what in
        ["fields = [\"velocity\"]", "maps = [\"speed\"]", "cuts = [{ name = \"a\", from = [0, 0], to = [1, 0] }]"]
    {
        let often = more(&format!("{what}\nevery = {{ time = 1e-7 }}"));
        says(&refused(&often), &["every.time` = 1e-7", "outputs until the end", "at most 1e6"]);
    }
    let measures = more("measures = [\"free-energy\"]\nevery = { time = 1e-12 }");
    says(&refused(&measures), &["every.time`", "at most 1e9"]);
    let step = changed("step = ", "step_min = 1e-15\nstep = 1e-9 # ").0;
    says(&refused(&step), &["`time.step` = 1e-9", "steps, and at most 1e9 may be taken", "max_steps"]);
    let few = step.replace("step_min = 1e-15", "step_min = 1e-15\nmax_steps = 10");
    Scene::parse(&few, Path::new("strip.toml")).expect("ten steps are few, however short they are");
}

#[test]
fn walls_with_friction() {
    let strip = |condition: &str| {
        let (text, line) =
            changed("[boundary.walls]\nvelocity = \"slip\"", &format!("[boundary.walls]\nvelocity = {condition}"));
        (text, format!("line {}: ", line + 1))
    };
    for (condition, parts) in [
        (
            "{ friction = -1 }",
            &["`boundary.walls.velocity.friction` = \"-1\"", "must not be negative", "0 is a wall"][..],
        ),
        ("{ friction = \"1 + t\" }", &["`boundary.walls.velocity.friction`", "must not depend on t"]),
        ("{ friction = nan }", &["`boundary.walls.velocity.friction`"]),
        ("{ friction = \"1/0\" }", &["`boundary.walls.velocity.friction`", "finite"]),
        ("{ friction = [1, 0] }", &["`boundary.walls.velocity`", "takes one number or formula"]),
        ("\"friction\"", &["`boundary.walls.velocity`", "needs a number or a formula", "{ friction = b }"]),
        ("{ fricton = 3 }", &["`boundary.walls.velocity`", "did you mean `friction`?"]),
        ("{ slip = 3 }", &["`boundary.walls.velocity`", "`slip` takes no values"]),
        ("{ traction = 3 }", &["`boundary.walls.velocity", "array of length 2"]),
    ] {
        let (text, line) = strip(condition);
        let message = refused(&text);
        says(&message, &[&line]);
        says(&message, parts);
    }
    for condition in ["{ friction = 3 }", "{ friction = 0.5 }", "{ friction = \"friction + x^2\" }", "{ friction = 0 }"]
    {
        let scene = Scene::parse(&strip(condition).0, Path::new("strip.toml")).unwrap_or_else(|e| panic!("{e}"));
        let again = Scene::parse(&scene.resolved_toml(), Path::new("strip.toml")).unwrap();
        assert_eq!(again.boundary, scene.boundary);
    }
}
