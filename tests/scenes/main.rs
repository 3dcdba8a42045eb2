//! Every scene in `studies/` runs, coarse and short, and the program says what it should on the command line.

mod pins;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

fn scenes(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            scenes(&path, out);
        } else if path.extension().is_some_and(|e| e == "toml") {
            out.push(path);
        }
    }
}

#[test]
fn every_scene_runs_coarse() {
    let mut all = Vec::new();
    scenes(&root().join("studies"), &mut all);
    all.retain(|path| !names_a_scene(path) && !is_comparison(path));
    assert!(all.len() >= 4, "{all:?}");
    let temporary = tempfile::tempdir().unwrap();
    for (k, scene) in all.iter().enumerate() {
        let text = std::fs::read_to_string(scene).unwrap();
        let mut arguments = vec!["run", scene.to_str().unwrap(), "-q", "--set", "time.max_steps=2"];
        coarse_mesh(&text).iter().for_each(|set| arguments.extend(["--set", set]));
        let few = few_bodies(&table_of(scene));
        few.iter().for_each(|set| arguments.extend(["--set", set]));
        // two steps of marching, whatever the scene is for
        if table_of(scene).contains_key("steady") {
            arguments.extend(["--set", "steady="]);
        }
        let out = temporary.path().join(k.to_string());
        arguments.extend(["--out", out.to_str().unwrap()]);
        let output = program(&arguments, temporary.path());
        assert!(output.status.success(), "{}: {}", scene.display(), String::from_utf8_lossy(&output.stderr));
        assert!(output.stdout.is_empty(), "quiet means quiet");
        let summary: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(summary["steps"], 2, "{}", scene.display());
        // nothing is stationary where bodies move
        if is_tissue(&table_of(scene)) && summary["bodies"].is_null() {
            assert!(summary["residual"].as_f64().is_some_and(f64::is_finite), "{}", scene.display());
        } else if table_of(scene).contains_key("exact") {
            assert!(summary["errors"]["velocity"].is_object(), "{}", scene.display());
        } else {
            assert!(summary["bodies"].as_u64().is_some_and(|count| count > 0), "{}", scene.display());
        }
    }
}

/// `--set`s that make the mesh of a scene coarse.
fn coarse_mesh(scene: &str) -> &'static [&'static str] {
    if scene.contains("shape = \"square\"") {
        &["mesh.n=4"]
    } else if scene.contains("h_disc =") {
        &["mesh.h_disc=0.5", "mesh.h=2.0"]
    } else if scene.contains("shape = \"disc\"") {
        &["mesh.h=0.3"]
    } else if scene.contains("shape = \"racetrack\"") {
        &["mesh.h=1.0"]
    } else {
        &[]
    }
}

/// Of a strip the piece about the disc.
fn piece(coarse: &[&str]) -> &'static [&'static str] {
    if coarse.iter().any(|set| set.contains("h_disc")) { &["mesh.length=[-4.0, 6.0]"] } else { &[] }
}

/// `--set`s that leave a scene few of the bodies that it places at random.
fn few_bodies(scene: &toml::Table) -> Vec<String> {
    let groups = scene.get("bodies").and_then(toml::Value::as_array);
    let many = |(_, group): &(usize, &toml::Value)| {
        let count = group.get("count").and_then(toml::Value::as_integer);
        group.get("ring").is_none() && count.is_some_and(|count| count > 30)
    };
    let numbered = groups.into_iter().flatten().enumerate().filter(many);
    numbered.map(|(at, _)| format!("bodies.{at}.count=30")).collect()
}

/// Flows and particles alone have no residual.
fn is_tissue(scene: &toml::Table) -> bool {
    !matches!(scene["model"]["kind"].as_str(), Some("stokes" | "particles"))
}

fn table_of(path: &Path) -> toml::Table {
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

/// Studies name their scene; scenes have none.
fn names_a_scene(path: &Path) -> bool {
    table_of(path).contains_key("scene")
}

/// A comparison names its data.
fn is_comparison(path: &Path) -> bool {
    table_of(path).contains_key("data")
}

/// A study of orders; other studies are sweeps.
fn is_study(path: &Path) -> bool {
    names_a_scene(path) && table_of(path).contains_key("levels")
}

/// A study of branches.
fn is_branch(path: &Path) -> bool {
    names_a_scene(path) && table_of(path).contains_key("parameter")
}

/// A study of what accuracy costs.
fn is_tradeoff(path: &Path) -> bool {
    names_a_scene(path) && table_of(path).contains_key("setting")
}

/// `--set`s that make the first two levels of a study small: few steps, and a coarse mesh where the study does not vary
/// it.
fn coarse(study: &Path) -> Vec<String> {
    let table: toml::Table = std::fs::read_to_string(study).unwrap().parse().unwrap();
    let levels: Vec<String> = table["levels"].as_array().unwrap()[..2].iter().map(ToString::to_string).collect();
    let mut sets = vec![format!("levels=[{}]", levels.join(", ")), "expect=".to_owned()];
    // BDF6 after an exact start takes its first step as the sixth
    sets.push("time.max_steps=7".to_owned());
    if !table["vary"].as_table().unwrap().keys().any(|key| key.starts_with("mesh.")) {
        sets.push("mesh.n=4".to_owned());
    }
    sets
}

#[test]
fn every_study_runs_coarse() {
    let mut all = Vec::new();
    scenes(&root().join("studies"), &mut all);
    all.retain(|path| is_study(path));
    assert!(!all.is_empty());
    let temporary = tempfile::tempdir().unwrap();
    for (k, study) in all.iter().enumerate() {
        let (out, sets) = (k.to_string(), coarse(study));
        let mut arguments = vec!["order", study.to_str().unwrap(), "-q", "--out", &out];
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        let output = program(&arguments, temporary.path());
        let mut runs = csv::Reader::from_path(temporary.path().join(out).join("runs.csv")).unwrap();
        // every level came as far as it was allowed to
        let went =
            |row: &csv::StringRecord| row.iter().any(|c| c == "complete" || c.contains("`time.max_steps` was reached"));
        let rows: Vec<csv::StringRecord> = runs.records().map(Result::unwrap).collect();
        assert!(rows.len() >= 2 && rows.iter().all(went), "{}: {rows:?}", study.display());
        assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{}", study.display());
    }
}

/// `--set`s that make a sweep short: two steps, a coarse mesh, and of every list the first and the last value.
fn short(sweep: &Path) -> Vec<String> {
    let table = table_of(sweep);
    let scene = sweep.parent().unwrap().join(table["scene"].as_str().unwrap());
    let empty = toml::Table::new();
    let keys_of = |table: &toml::Table, key: &str| {
        table.get(key).and_then(toml::Value::as_table).unwrap_or(&empty).keys().cloned().collect::<Vec<_>>()
    };
    let mut taken = keys_of(&table, "vary");
    for case in table.get("case").and_then(toml::Value::as_array).into_iter().flatten() {
        taken.extend(keys_of(case.as_table().unwrap(), "set"));
    }
    let mut sets = vec!["time.max_steps=2".to_owned()];
    let mesh = coarse_mesh(&std::fs::read_to_string(&scene).unwrap());
    let mesh = mesh.iter().chain(piece(mesh));
    sets.extend(mesh.filter(|set| !taken.iter().any(|key| set.starts_with(key))).map(|set| (*set).to_owned()));
    if let Some(vary) = table.get("vary").and_then(toml::Value::as_table) {
        let ends = |(key, list): (&String, &toml::Value)| {
            let list = list.as_array().unwrap();
            // the last mesh is the finest, and a shorter step only a reference
            let once = key.starts_with("mesh.") || key == "time.step";
            let last = if once { &[] } else { &list[list.len() - 1..] };
            let kept: toml::Value = list[..1].iter().chain(last).cloned().collect::<Vec<_>>().into();
            format!("\"{key}\" = {kept}")
        };
        sets.push(format!("vary={{ {} }}", vary.iter().map(ends).collect::<Vec<_>>().join(", ")));
    }
    sets.extend(few_bodies(&table_of(&scene)));
    sets.extend(marching(&table));
    sets.extend(without_maps(&table_of(&scene)));
    sets
}

/// Pictures of a scene are drawn where it is run itself.
fn without_maps(scene: &toml::Table) -> Option<String> {
    let all = scene.get("output")?.as_array()?;
    let others: Vec<toml::Value> = all.iter().filter(|output| output.get("maps").is_none()).cloned().collect();
    (others.len() < all.len()).then(|| format!("output={}", toml::Value::Array(others)))
}

/// A sweep of searches for steady states, on meshes of its own, made one of marching on coarse meshes.
fn marching(sweep: &toml::Table) -> Vec<String> {
    let mut set = sweep.get("set").and_then(toml::Value::as_table).cloned().unwrap_or_default();
    let before = set.len();
    set.retain(|key, _| !key.starts_with("steady."));
    if set.len() == before {
        return Vec::new();
    }
    let coarsen = |set: &mut toml::Table| {
        for (key, value) in set.iter_mut().filter(|(key, _)| key.starts_with("mesh.h") || *key == "mesh.grading") {
            // gentle gradings need many cells
            let coarse = if key == "mesh.grading" { 0.3 } else { 5.0 * value.as_float().unwrap() };
            *value = coarse.into();
        }
    };
    coarsen(&mut set);
    let mut cases = sweep.get("case").and_then(toml::Value::as_array).cloned().unwrap_or_default();
    cases.iter_mut().filter_map(|case| case.get_mut("set")?.as_table_mut()).for_each(coarsen);
    let mut sets = vec![format!("set={}", toml::Value::Table(set))];
    if !cases.is_empty() {
        sets.push(format!("case={}", toml::Value::Array(cases)));
    }
    sets
}

#[test]
fn every_sweep_runs_coarse() {
    let mut all = Vec::new();
    scenes(&root().join("studies"), &mut all);
    all.retain(|path| names_a_scene(path) && !is_study(path) && !is_branch(path) && !is_tradeoff(path));
    assert!(all.len() >= 20, "{all:?}");
    let temporary = tempfile::tempdir().unwrap();
    for (k, sweep) in all.iter().enumerate() {
        let (out, sets) = (k.to_string(), short(sweep));
        let mut arguments = vec!["study", sweep.to_str().unwrap(), "-q", "--out", &out];
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        let output = program(&arguments, temporary.path());
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!error.contains("panicked"), "{}: {error}", sweep.display());
        let results = temporary.path().join(out).join("results.csv");
        let text = std::fs::read_to_string(&results).unwrap_or_else(|_| panic!("{}: {error}", sweep.display()));
        let mut table = csv::Reader::from_reader(text.as_bytes());
        let columns = table.headers().unwrap().clone();
        let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
        // what is varied has a dot in its name, and may be infinite
        let finite = |(name, cell): (&str, &str)| name.contains('.') || cell.parse().map_or(true, f64::is_finite);
        assert!(rows.iter().all(|row| columns.iter().zip(row).all(finite)), "{}: {text}", sweep.display());
        // a penalty that rounding defeats is refused, and blamed
        let went =
            |row: &csv::StringRecord| row.iter().any(|c| c == "finished" || c.contains("`space.penalty` = 1e-1"));
        assert!(!rows.is_empty() && rows.iter().all(went), "{}: {text}", sweep.display());
    }
}

#[test]
fn every_study_of_branches_runs_coarse() {
    let mut all = Vec::new();
    scenes(&root().join("studies"), &mut all);
    all.retain(|path| is_branch(path));
    assert!(!all.is_empty());
    let temporary = tempfile::tempdir().unwrap();
    for (k, study) in all.iter().enumerate() {
        let out = k.to_string();
        let mut arguments = vec!["branch", study.to_str().unwrap(), "-q", "--out", &out];
        let scene = study.parent().unwrap().join(table_of(study)["scene"].as_str().unwrap());
        let mesh = coarse_mesh(&std::fs::read_to_string(scene).unwrap());
        let short = ["max_points=2", "max_branches=1", "steady.eigenvalues=1"];
        short.iter().chain(mesh).chain(piece(mesh)).for_each(|set| arguments.extend(["--set", set]));
        let output = program(&arguments, temporary.path());
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && output.stdout.is_empty(), "{}: {error}", study.display());
        let mut table = csv::Reader::from_path(temporary.path().join(out).join("branches.csv")).unwrap();
        let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
        let finite = |cell: &str| cell.parse::<f64>().map_or(true, f64::is_finite);
        assert!(rows.len() >= 2 && rows.iter().all(|row| row.iter().all(finite)), "{}: {rows:?}", study.display());
    }
}

#[test]
fn every_comparison_runs() {
    let mut all = Vec::new();
    scenes(&root().join("studies"), &mut all);
    all.retain(|path| is_comparison(path));
    assert!(!all.is_empty());
    let temporary = tempfile::tempdir().unwrap();
    for (k, study) in all.iter().enumerate() {
        let out = k.to_string();
        let output = program(&["compare", study.to_str().unwrap(), "-q", "--out", &out], temporary.path());
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && output.stdout.is_empty(), "{}: {error}", study.display());
        let mut table = csv::Reader::from_path(temporary.path().join(out).join("field.csv")).unwrap();
        let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
        let filled = rows.iter().filter(|row| !row[4].is_empty()).count();
        assert!(2 * filled > rows.len(), "{}: {filled} of {} bins", study.display(), rows.len());
    }
}

#[test]
fn every_study_of_a_trade_off_runs_coarse() {
    let mut all = Vec::new();
    scenes(&root().join("studies"), &mut all);
    all.retain(|path| is_tradeoff(path));
    assert!(all.len() >= 3, "{all:?}");
    let temporary = tempfile::tempdir().unwrap();
    for (k, study) in all.iter().enumerate() {
        // every setting of the file itself makes a scene
        let read = monolayer::study::TradeoffStudy::read(study, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert!(read.settings.iter().filter(|setting| setting.name.starts_with("preset ")).count() == 3);
        let out = k.to_string();
        let scene = study.parent().unwrap().join(table_of(study)["scene"].as_str().unwrap());
        let mesh = coarse_mesh(&std::fs::read_to_string(scene).unwrap());
        let mut sets = vec!["time.max_steps=2".to_owned(), "set=".to_owned()];
        sets.extend(mesh.iter().map(|set| (*set).to_owned()));
        sets.push("setting=[{ name = \"a\" }, { name = \"b\", set = { \"space.k\" = 2 } }]".to_owned());
        if table_of(study)["reference"].is_table() {
            sets.push("reference={ set = {}, coarser = { \"coupling.tolerance\" = 1e-3 } }".to_owned());
        }
        let mut arguments = vec!["tradeoff", study.to_str().unwrap(), "-q", "--out", &out];
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        let output = program(&arguments, temporary.path());
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && output.stdout.is_empty(), "{}: {error}", study.display());
        let text = std::fs::read_to_string(temporary.path().join(out).join("tradeoff.csv")).unwrap();
        assert!(text.lines().count() >= 3 && !text.contains("NaN"), "{}: {text}", study.display());
    }
}

#[test]
fn a_penalty_that_rounding_defeats_is_named() {
    let scene = root().join("studies/mms/disc.toml");
    let sets = ["--set", "space.walls=penalty", "--set", "space.penalty=1e-14", "--set", "mesh.h=0.3"];
    let named = ["the Stokes system was solved with relative residual", "`space.penalty` = 1e-14", "space.walls"];
    fails(&[&["run", scene.to_str().unwrap()], &sets[..]].concat(), &named);
}

#[test]
fn check_says_what_is_on_and_solves_nothing() {
    let temporary = tempfile::tempdir().unwrap();
    let scene = root().join("studies/strip/strip.toml");
    let scene = scene.to_str().unwrap();
    let output = program(&["check", scene, "--set", "model.elasticity=0"], temporary.path());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains("unknowns") && text.contains("memory"), "{text}");
    let molecular = text.lines().find(|l| l.contains("molecular field")).unwrap();
    assert!(molecular.contains("off"), "{molecular}");
    let json = program(&["check", scene, "--json"], temporary.path());
    let report: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let cells = report["mesh"]["cells"].as_u64().unwrap();
    assert!((2700..3300).contains(&cells), "the reference mesh has {cells} cells");
    assert!(std::fs::read_dir(temporary.path()).unwrap().next().is_none(), "check writes nothing");
}

#[test]
fn mesh_writes_files_that_read_back() {
    let temporary = tempfile::tempdir().unwrap();
    let scene = root().join("studies/quick/quick.toml");
    let output = program(&["mesh", scene.to_str().unwrap(), "--out", "."], temporary.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let again = program(&["mesh", "quick.msh"], temporary.path());
    let count = |output: &Output| {
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        text.lines().find(|l| l.starts_with("cells")).map(str::to_owned)
    };
    assert_eq!(count(&output), count(&again));
    assert!(temporary.path().join("quick.vtu").exists());
}

#[track_caller]
fn fails(arguments: &[&str], parts: &[&str]) {
    let temporary = tempfile::tempdir().unwrap();
    let output = program(arguments, temporary.path());
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "{arguments:?} should fail");
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
    assert!(!error.contains("panicked"), "{error}");
}

#[test]
fn wrong_words_on_the_command_line_are_explained() {
    let scene = root().join("studies/quick/quick.toml");
    let scene = scene.to_str().unwrap();
    fails(&["run", "nothing.toml"], &["nothing.toml", "hint"]);
    fails(&["run", scene, "--set", "model.pecle=2"], &["model.pecle", "did you mean `peclet`"]);
    fails(&["run", scene, "--set", "model.peclet"], &["has no `=`", "hint"]);
    fails(&["run", scene, "--set", "model.peclet=-1"], &["model.peclet", "-1", "greater than 0"]);
    fails(&["run", scene, "--set", "time.step=1e-9", "--set", "time.step_min=1e-6"], &["time.step", "time.step_min"]);
    fails(&["mesh", "nothing.msh"], &["nothing.msh", "hint"]);
    fails(&["check", scene, "--set", "mesh.curved=4"], &["mesh.curved", "4"]);
    fails(&["run", scene, "--threads", "0"], &["--threads"]);
}
