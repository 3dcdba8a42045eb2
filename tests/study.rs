//! `monolayer study`: the table of a sweep, its exit codes, and what it says about wrong ones.

mod tiny_study;

use std::path::PathBuf;
use std::process::Command;

use tiny_study::{error_of, program, refused_in, succeeds, with_study};

const STUDY: &str = r#"title = "Tiny"
scene = "square.toml"
set = { "mesh.n" = 2, "time.step" = 0.125 }
vary = { "model.peclet" = [0.5, 2.0], "model.coherence" = [1.0, 0.01] }
"#;

/// A table with its header.
struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(path: PathBuf) -> Self {
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert!(!text.contains("NaN") && !text.contains("inf,"), "{text}");
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let list = |row: &csv::StringRecord| row.iter().map(str::to_owned).collect::<Vec<_>>();
        Self {
            header: list(reader.headers().unwrap()),
            rows: reader.records().map(|row| list(&row.unwrap())).collect(),
        }
    }

    #[track_caller]
    fn column(&self, name: &str) -> Vec<&str> {
        let at = self.header.iter().position(|h| h == name);
        let at = at.unwrap_or_else(|| panic!("no column {name} in {:?}", self.header));
        self.rows.iter().map(|row| row[at].as_str()).collect()
    }
}

fn results(root: &tempfile::TempDir) -> Table {
    Table::read(root.path().join("out/results.csv"))
}

#[test]
fn every_combination_is_a_row_and_a_folder() {
    let root = with_study(STUDY);
    let output = succeeds(root.path(), &["study", "tiny.toml", "--out", "out"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("4 of 4 runs, results in out"));
    let table = results(&root);
    assert_eq!(table.header[..4], ["run", "model.peclet", "model.coherence", "status"]);
    assert_eq!(table.column("run"), ["01", "02", "03", "04"]);
    assert_eq!(table.column("model.peclet"), ["0.5", "0.5", "2", "2"]);
    assert_eq!(table.column("model.coherence"), ["1", "0.01", "1", "0.01"]);
    assert_eq!(table.column("status"), ["finished"; 4]);
    assert_eq!(table.column("ending"), ["end-time"; 4]);
    assert_eq!(table.column("cells"), ["8"; 4]);
    assert_eq!(table.column("steps"), ["2"; 4]);
    for (folder, peclet) in [("01", 0.5), ("04", 2.0)] {
        let scene = std::fs::read_to_string(root.path().join("out").join(folder).join("scene.toml")).unwrap();
        let scene: toml::Table = scene.parse().unwrap();
        assert_eq!(scene["model"]["peclet"].as_float(), Some(peclet));
        assert_eq!(scene["time"]["step"].as_float(), Some(0.125));
        let summary = std::fs::read(root.path().join("out").join(folder).join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
        assert_eq!(summary["steps"], 2);
    }
    // the notes of a run are those that the program prints
    let said = table.column("said");
    let unresolved = |text: &str| text.contains("is larger than the coherence length 0.01");
    assert_eq!(said.iter().map(|text| unresolved(text)).collect::<Vec<_>>(), [false, true, false, true], "{said:?}");
    assert!(said[1].starts_with("the smallest cell"), "{}", said[1]);
    assert!(error_of(&output).contains("note: the smallest cell"));
}

#[test]
fn errors_are_those_of_a_study_of_orders() {
    let cases = r#"scene = "square.toml"
[[case]]
name = "two"
set = { "mesh.n" = 2, "time.step" = 0.125 }
[[case]]
name = "four"
set = { "mesh.n" = 4, "time.step" = 0.0625 }
"#;
    let root = with_study(cases);
    let orders =
        "scene = \"square.toml\"\nlevels = [2, 4]\nvary = { \"mesh.n\" = \"n\", \"time.step\" = \"1/(4*n)\" }\n";
    std::fs::write(root.path().join("orders.toml"), orders).unwrap();
    succeeds(root.path(), &["study", "tiny.toml", "-q", "--out", "out"]);
    succeeds(root.path(), &["order", "orders.toml", "-q", "--out", "orders"]);
    let (table, orders) = (results(&root), Table::read(root.path().join("orders/orders.csv")));
    assert_eq!(table.column("run"), ["01-two", "02-four"]);
    assert_eq!(table.column("name"), ["two", "four"]);
    for k in 0..orders.rows.len() {
        let of = |name: &str| orders.column(name)[k].to_owned();
        let run = usize::from(of("n") == "4");
        assert_eq!(table.column(&format!("error_{}_{}", of("field"), of("norm")))[run], of("error"));
    }
    assert_eq!(orders.rows.len(), 18);
}

#[test]
fn what_fails_or_is_refused_is_a_row() {
    let study = r#"scene = "square.toml"
set = { "mesh.n" = 2, "time.step" = 0.125, "time.step_min" = 0.1 }
vary = { "model.beta" = [0.5] }
[[case]]
name = "failing"
set = { "coupling.max_iterations" = 1, "coupling.accept" = 2e-8 }
[[case]]
name = "refused"
set = { "model.peclet" = -1 }
[[case]]
name = "late"      # found only when the mesh is there
set = { "exact.velocity" = ["x", 0] }
[[case]]
name = "good"
"#;
    let root = with_study(&study.replace("\"time.step_min\"", "\"model.friction\" = \"\", \"time.step_min\""));
    let base = ["study", "tiny.toml", "-q", "--out", "out"];
    let output = program(root.path(), &base);
    assert_eq!(output.status.code(), Some(1), "only the first run has a friction");
    let table = results(&root);
    assert_eq!(table.column("status"), ["finished", "refused", "refused", "refused", "refused"]);
    assert!(table.column("reason")[4].contains("friction"), "{:?}", table.column("reason"));

    let root = with_study(&study.replace("model.beta\" = [0.5]", "model.alignment\" = [0.5]"));
    let output = program(root.path(), &base);
    assert_eq!(output.status.code(), Some(1));
    let table = results(&root);
    assert_eq!(table.column("status"), ["finished", "failed", "refused", "refused", "finished"]);
    let reasons = table.column("reason");
    assert!(reasons[1].contains("time.step_min") && reasons[1].contains("hint"), "{}", reasons[1]);
    let negative = "tiny.toml, line 9, run 03-refused: square.toml with `model.peclet` set: `model.peclet` = -1";
    assert!(reasons[2].starts_with(negative), "{}", reasons[2]);
    assert!(reasons[3].contains("`exact.velocity` has div v = 1"), "{}", reasons[3]);
    assert!(reasons[0].is_empty() && reasons[4].is_empty());
    let said = error_of(&output);
    assert_eq!(said.lines().count(), 3, "{said}");
    assert!(said.contains("error: run 02-failing: step 1 from t = 0 failed"), "{said}");
    // what did not begin has no numbers
    assert_eq!(table.column("steps"), ["2", "0", "", "", "2"]);
    assert!(table.column("error_velocity_L2(L2)")[1..4].iter().all(|cell| cell.is_empty()));
    for folder in ["03-refused", "04-late"] {
        let folder = root.path().join("out").join(folder);
        assert!(folder.join("row.json").exists() && !folder.join("summary.json").exists());
    }
}

#[test]
fn steps_that_missed_the_tolerance_are_told() {
    let late = "\"coupling.max_iterations\" = 1, \"coupling.tolerance\" = 1e-12, \"coupling.accept\" = 1e3";
    let root = with_study(&STUDY.replace("\"mesh.n\" = 2", &format!("\"mesh.n\" = 2, {late}")));
    succeeds(root.path(), &["study", "tiny.toml", "-q", "--out", "out"]);
    let table = results(&root);
    assert_eq!(table.column("accepted_late"), ["2"; 4]);
    let told =
        "2 of 2 steps did not reach `coupling.tolerance` = 1e-12, and were accepted below `coupling.accept` = 1e3";
    assert!(table.column("said").iter().all(|said| said.contains(told)), "{:?}", table.column("said"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_sweep_keeps_its_rows() {
    // the second run would take minutes
    let study =
        STUDY.replace(&STUDY[STUDY.find("vary").unwrap()..], "vary = { \"time.step\" = [0.125, 1e-5, 0.0625] }");
    let root = with_study(&study.replace(", \"time.step\" = 0.125 }", " }"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_monolayer"))
        .args(["study", "tiny.toml", "-q", "--jobs", "1", "--out", "out"])
        .current_dir(root.path())
        .spawn()
        .unwrap();
    let history = root.path().join("out/02/history.csv");
    let begin = std::time::Instant::now();
    while !std::fs::read_to_string(&history).is_ok_and(|text| text.lines().count() > 3) {
        assert!(begin.elapsed().as_secs() < 120, "the second run should have begun");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let table = results(&root);
    assert_eq!(table.column("status"), ["finished", "interrupted"]);
    assert!(table.column("steps")[1].parse::<usize>().unwrap() > 1);
    assert!(root.path().join("out/02/checkpoint.bin").exists() && !root.path().join("out/03").exists());
}

#[test]
fn overrides_reach_every_run() {
    let root = with_study(STUDY);
    // they win over `set`, and the study's own keys can be set, too
    let sets = ["--set", "time.step=0.25", "--set", "vary={ \"model.alignment\" = [0, 1] }"];
    succeeds(root.path(), &[&["study", "tiny.toml", "-q", "--out", "out"], &sets[..]].concat());
    let table = results(&root);
    assert_eq!((table.column("steps"), table.column("model.alignment")), (vec!["1", "1"], vec!["0", "1"]));
    // what is left repeats it, from any folder
    std::fs::create_dir(root.path().join("elsewhere")).unwrap();
    std::fs::rename(root.path().join("out/study.toml"), root.path().join("elsewhere/study.toml")).unwrap();
    let again = ["study", "elsewhere/study.toml", "-q", "--set", "time.step=0.25", "--out", "again"];
    succeeds(root.path(), &again);
    let again = Table::read(root.path().join("again/results.csv"));
    assert_eq!(table.column("error_polarity_L2(L2)"), again.column("error_polarity_L2(L2)"));
}

#[test]
fn results_are_not_overwritten() {
    let root = with_study(&STUDY.replace(", \"model.coherence\" = [1.0, 0.01]", ""));
    succeeds(root.path(), &["study", "tiny.toml", "-q"]);
    let before = std::fs::read(root.path().join("out/tiny/results.csv")).unwrap();
    let other = |set: &str, key: &str| {
        let again = program(root.path(), &["study", "tiny.toml", "--out", "out/tiny", "--set", set]);
        let (error, key) = (error_of(&again), format!("results of another study: `{key}` differs"));
        assert!(error.starts_with("error: out/tiny: holds the ") && error.contains(&key), "{error}");
        assert!(error.contains("another `--out`"), "{error}");
    };
    other("vary={ \"model.peclet\" = [0.5, 3.0] }", "vary.\"model.peclet\"");
    other("time.step=0.25", "set.\"time.step\"");
    // the scene is another one since
    let scene = std::fs::read_to_string(root.path().join("square.toml")).unwrap();
    std::fs::write(root.path().join("square.toml"), scene.replace("end = 0.25", "end = 0.5")).unwrap();
    other("title=\"t\"", "time.end of the scene of run 01");
    std::fs::write(root.path().join("square.toml"), scene).unwrap();
    assert_eq!(std::fs::read(root.path().join("out/tiny/results.csv")).unwrap(), before);
    succeeds(root.path(), &["study", "tiny.toml", "-q"]);
    assert!(root.path().join("out/tiny-2/results.csv").exists());
}

/// The study with `from` replaced by `to` is refused, with its line.
#[track_caller]
fn wrong(from: &str, to: &str, parts: &[&str]) {
    let at = STUDY.find(from).unwrap_or_else(|| panic!("the study has no `{from}`"));
    let line = format!("tiny.toml, line {}", STUDY[..at].matches('\n').count() + 1);
    let root = with_study(&STUDY.replacen(from, to, 1));
    refused_in(&root, &["study", "tiny.toml"], &[&[line.as_str()], parts].concat());
}

#[test]
fn wrong_studies_are_explained() {
    let known = "title, scene, duration, set, vary";
    wrong("title", "titel", &["there is no key `titel` (did you mean `title`?)", known]);
    wrong("square.toml", "sqare.toml", &["`scene` = \"sqare.toml\"", "no such file", "the study's folder"]);
    wrong("[0.5, 2.0]", "[]", &["`vary.\"model.peclet\"` = []", "the list is empty"]);
    wrong("[0.5, 2.0]", "0.5", &["`vary.\"model.peclet\"` = 0.5", "expected a list", "brackets"]);
    wrong("model.peclet", "model.pecle", &["run 01: square.toml with `model.pecle` set", "did you mean `peclet`?"]);
    wrong("mesh.n", "mesh.m", &["every run: square.toml with `mesh.m` set", "(did you mean `n`?)"]);
    wrong("\"mesh.n\" = 2", "mesh.n = 2", &["`set.mesh`", "replace the whole table [mesh]", "quote a key"]);
    wrong("mesh.n", "model.peclet", &["`set.\"model.peclet\"` = 2", "`vary` sets it from run to run"]);
    wrong("[1.0, 0.01]", "[-1.0, -0.5]", &["run 01: square.toml with `model.coherence` set", "greater than 0"]);
    let many = format!("{:?}", [1.0; 101]);
    let root = with_study(&STUDY.replace("[0.5, 2.0]", &many).replace("[1.0, 0.01]", &many));
    refused_in(&root, &["study", "tiny.toml"], &["10201 combinations", "at most 10000"]);
    refused_in(&with_study("scene = \"square.toml\"\n"), &["study", "tiny.toml"], &["`vary`", "nothing to run"]);
    refused_in(&with_study(STUDY), &["study", "gone.toml"], &["gone.toml: cannot be read", "the path of a study"]);
    refused_in(&with_study("vary = = 3"), &["study", "tiny.toml"], &["tiny.toml, line 1: not TOML"]);
}

#[test]
fn wrong_cases_are_explained() {
    let cases = |text: &str, parts: &[&str]| {
        let line = STUDY.lines().count() + text.lines().position(|l| l.contains("WRONG")).unwrap() + 1;
        let root = with_study(&format!("{STUDY}{}", text.replace("WRONG", "a")));
        refused_in(&root, &["study", "tiny.toml"], &[&[format!("tiny.toml, line {line}").as_str()], parts].concat());
    };
    let name = "must be a name of its own of letters, digits, - and _";
    cases("[[case]]\nname = \"A\"\n[[case]]\nname = \"WRONG\"\n", &["`case.1.name` = \"a\"", name]);
    cases("[[case]]\nname = \"../WRONG\"\n", &["`case.0.name` = \"../a\"", name]);
    cases("[[case]]\nnam = \"WRONG\"\n", &["no key `case.0.nam` (did you mean `name`?)", "name, set"]);
    let key = "[[case]]\nname = \"first\"\n[[case]]\nname = \"a\"\nset = { \"mesh.m\" = 3 } # WRONG\n";
    cases(key, &["run 06-a: square.toml with `mesh.m` set", "did you mean `n`?"]);
    let whole = "[[case]]\nname = \"a\"\nset.coupling.kind = \"WRONG\"\n";
    cases(whole, &["`case.0.set.coupling`", "replace the whole table [coupling]"]);
}

#[test]
fn overrides_that_the_study_undoes_are_refused() {
    let root = with_study(&format!("{STUDY}[[case]]\nname = \"a\"\nset = {{ \"model.alignment\" = 0.5 }}\n"));
    let set = |set: &str, parts: &[&str]| refused_in(&root, &["study", "tiny.toml", "--set", set], parts);
    set("model.peclet=3", &["square.toml with `model.peclet` set: `model.peclet` = 3", "`vary` of the study sets it"]);
    set("model.alignment=0", &["`model.alignment` = 0", "case `a` of the study sets it"]);
    set("vari={}", &["(did you mean `vary`?)", "of the study title, scene, duration, set, vary"]);
}

#[test]
fn scenes_sweeps_and_studies_of_orders_are_told_apart() {
    let root = with_study(STUDY);
    for command in ["run", "mesh"] {
        let parts =
            ["tiny.toml: this is a study, not a scene", "`monolayer study tiny.toml`", "its scene is square.toml"];
        refused_in(&root, &[command, "tiny.toml"], &parts);
    }
    refused_in(&root, &["study", "square.toml"], &["this is a scene, not a study", "`monolayer run square.toml`"]);
    refused_in(&root, &["order", "tiny.toml"], &["this is a sweep", "`monolayer study tiny.toml` runs it"]);
    let orders = with_study("scene = \"square.toml\"\nlevels = [2, 3]\nvary = { \"mesh.n\" = \"n\" }\n");
    refused_in(&orders, &["study", "tiny.toml"], &["this is a study of orders", "`monolayer order tiny.toml` runs it"]);
}

/// What a run of the program made: nothing may change it.
fn stamp(root: &tempfile::TempDir, run: &str) -> std::time::SystemTime {
    std::fs::metadata(root.path().join("out").join(run).join("summary.json")).unwrap().modified().unwrap()
}

#[test]
fn a_study_is_completed_and_what_is_done_stays() {
    let root = with_study(STUDY);
    let base = ["study", "tiny.toml", "-q", "--out", "out"];
    let nothing = program(root.path(), &[&base[..], &["--resume"]].concat());
    assert!(error_of(&nothing).contains("no study that was begun"), "{}", error_of(&nothing));
    succeeds(root.path(), &base);
    let whole = std::fs::read(root.path().join("out/results.csv")).unwrap();
    let before = stamp(&root, "01");
    // a run that has its summary but no row, and one that has nothing
    std::fs::remove_file(root.path().join("out/02/row.json")).unwrap();
    std::fs::remove_dir_all(root.path().join("out/03")).unwrap();
    std::fs::write(root.path().join("out/results.csv"), "run\n").unwrap();
    let (second, third) = (stamp(&root, "02"), ["out/03/summary.json"]);
    succeeds(root.path(), &[&base[..], &["--resume"]].concat());
    assert_eq!((stamp(&root, "01"), stamp(&root, "02")), (before, second));
    assert!(root.path().join(third[0]).exists());
    let without_cost = |bytes: &[u8]| {
        let mut reader = csv::Reader::from_reader(bytes);
        let count = reader.headers().unwrap().len() - 3;
        reader
            .records()
            .map(|row| row.unwrap().iter().take(count).map(str::to_owned).collect())
            .collect::<Vec<Vec<String>>>()
    };
    let now = std::fs::read(root.path().join("out/results.csv")).unwrap();
    assert_eq!(without_cost(&now), without_cost(&whole));
    assert_eq!(results(&root).header[results(&root).header.len() - 3..], ["seconds", "peak_memory_mib", "threads"]);
}

#[test]
fn what_failed_is_done_again_on_demand_only() {
    let study = STUDY.replace("\"mesh.n\" = 2", "\"mesh.n\" = 2, \"exact.velocity\" = [\"x\", 0]");
    let root = with_study(&study);
    let base = ["study", "tiny.toml", "-q", "--out", "out"];
    let row = || std::fs::metadata(root.path().join("out/01/row.json")).unwrap().modified().unwrap();
    assert_eq!(program(root.path(), &base).status.code(), Some(1));
    let first = row();
    assert_eq!(program(root.path(), &base).status.code(), Some(1));
    assert_eq!(row(), first, "a refused run is a result");
    assert_eq!(program(root.path(), &[&base[..], &["--retry-failed"]].concat()).status.code(), Some(1));
    assert!(row() > first);
}

#[test]
fn shards_make_the_table_of_the_whole() {
    let root = with_study(STUDY);
    succeeds(root.path(), &["study", "tiny.toml", "-q", "--out", "whole"]);
    succeeds(root.path(), &["study", "tiny.toml", "-q", "--out", "out", "--shard", "2/3"]);
    let shard = Table::read(root.path().join("out/results.2-of-3.csv"));
    assert_eq!(shard.column("run"), ["02"]);
    assert!(!root.path().join("out/results.csv").exists());
    let partly = program(root.path(), &["study", "--gather", "out"]);
    assert_eq!(partly.status.code(), Some(1));
    assert!(error_of(&partly).contains("not there or not complete: 01, 03, 04"), "{}", error_of(&partly));
    for shard in ["1/3", "3/3"] {
        succeeds(root.path(), &["study", "tiny.toml", "-q", "--out", "out", "--shard", shard]);
    }
    // the scene is not needed any more
    std::fs::remove_file(root.path().join("square.toml")).unwrap();
    succeeds(root.path(), &["study", "--gather", "out", "-q"]);
    let (whole, gathered) = (Table::read(root.path().join("whole/results.csv")), results(&root));
    assert_eq!(whole.header, gathered.header);
    let cost = whole.header.len() - 3;
    for (a, b) in whole.rows.iter().zip(&gathered.rows) {
        assert_eq!(a[..cost], b[..cost]);
    }
    assert_eq!(gathered.rows.len(), 4);
    let output = program(root.path(), &["study", "tiny.toml", "--shard", "4/3"]);
    assert!(error_of(&output).contains("must be I/N"), "{}", error_of(&output));
}

#[test]
fn ranges_pairs_and_seeds_are_rows() {
    let study = r#"scene = "square.toml"
set = { "mesh.n" = 2, "time.step" = 0.25 }
vary = { "model.alignment" = { linspace = [-1, 1, 3] } }
together = [{ "model.peclet" = { logspace = [0.01, 1.0, 3] }, "model.beta" = [0.1, 0.2, 0.3] }]
"#;
    let root = with_study(&study.replace("\"mesh.n\"", "\"model.friction\" = \"\", \"mesh.n\""));
    succeeds(root.path(), &["study", "tiny.toml", "-q", "--out", "out", "--set", "time.end=0.25"]);
    let table = results(&root);
    assert_eq!(table.column("model.alignment"), ["-1", "-1", "-1", "0", "0", "0", "1", "1", "1"]);
    assert_eq!(table.column("model.peclet")[..4], ["0.01", "0.1", "1", "0.01"]);
    assert_eq!(table.column("model.beta")[..4], ["0.1", "0.2", "0.3", "0.1"]);
    let seeds = "scene = \"square.toml\"\nset = { \"mesh.n\" = 2, \"time.step\" = 0.25, \"time.end\" = 0.25, \
                 \"initial.polarity\" = { random = {} } }\nseeds = 2\n";
    let root = with_study(seeds);
    succeeds(root.path(), &["study", "tiny.toml", "-q", "--out", "out"]);
    let (table, key) = (results(&root), "initial.polarity.random.seed");
    assert_eq!(table.column(key), ["1", "2"]);
    let errors = table.column("error_polarity_L2(L2)");
    assert_ne!(errors[0], errors[1], "another seed is another start");
}

#[test]
fn wrong_ranges_pairs_names_and_plots_are_explained() {
    wrong("[0.5, 2.0]", "{ linspace = [0.5, 2.0] }", &["`vary.\"model.peclet\".linspace`", "invalid length 2"]);
    wrong("[0.5, 2.0]", "{ linspace = [0.5, 2.0, 1] }", &["and how many (2 to 10000)"]);
    wrong("[0.5, 2.0]", "{ logspace = [0.0, 2.0, 3] }", &["one sign and not be 0"]);
    wrong("[0.5, 2.0]", "{ geomspace = [0.1, 2.0, 3] }", &["`geomspace`", "{ logspace = [a, b, n] }"]);
    let with = |more: &str, parts: &[&str]| {
        let root = with_study(&format!("{STUDY}{more}\n"));
        let line = format!("tiny.toml, line {}", STUDY.lines().count() + 1);
        refused_in(&root, &["study", "tiny.toml"], &[&[line.as_str()], parts].concat());
    };
    with(
        "together = [{ \"model.beta\" = [0.1, 0.2], \"model.alignment\" = [1] }]",
        &["as many values as `model.alignment`, 1"],
    );
    with("together = [{ \"model.peclet\" = [0.1] }]", &["the key varies already"]);
    // `slip` is what `alignment` was called
    let both = STUDY.replace("model.peclet\" = [0.5, 2.0]", "model.slip\" = [0.5, 2.0]");
    let both = both.replace("model.coherence\" = [1.0, 0.01]", "model.alignment\" = [1.0]");
    refused_in(&with_study(&both), &["study", "tiny.toml"], &["the key varies already"]);
    with("seeds = []", &["`seeds` = []", "one seed or more"]);
    with("seeds = -1", &["`seeds`", "must not be negative"]);
    with("measures = [\"overshot\"]", &["`measures.0` = \"overshot\"", "no run measures it"]);
    with("warm_start = \"model.pecle\"", &["`warm_start`", "names no key that varies", "model.peclet"]);
    with("plot = { x = \"model.pecle\", y = \"steps\" }", &["`x` names no column", "did you mean `model.peclet`?"]);
    with("plot = { x = \"model.peclet\", y = \"steps\", log = \"z\" }", &["`log` must name the axes", "\"xy\""]);
    with("slurm = { time = \"two hours\" }", &["`slurm.time`", "one word"]);
}

#[test]
fn a_plot_and_a_typed_table_lie_beside_the_text() {
    let plot = "plot = [{ x = \"model.peclet\", y = \"iterations\", log = \"x\" }]\nmeasures = [\"free_energy\"]\n\
                duration = \"2 s\"\n";
    let energy = ", \"output\" = [{ measures = [\"free_energy\", \"energy_budget\"] }] }";
    let root = with_study(&format!("{}{plot}", STUDY.replacen(" }", energy, 1)));
    let output = succeeds(root.path(), &["study", "tiny.toml", "--out", "out"]);
    assert!(error_of(&output).contains("4 runs, about 2 s on 2 cores"), "{}", error_of(&output));
    let table = results(&root);
    assert!(table.column("free_energy").iter().all(|cell| cell.parse::<f64>().is_ok()));
    assert!(!table.header.iter().any(|name| name == "free_energy_rate"), "{:?}", table.header);
    let svg = std::fs::read_to_string(root.path().join("out/plots/iterations-by-model.peclet.svg")).unwrap();
    assert!(svg.contains("κ = 0.01") && svg.contains("iterations of the coupling"));
    assert!(root.path().join("out/plots/iterations-by-model.peclet.png").exists());
    assert!(std::fs::read(root.path().join("out/results.parquet")).unwrap().starts_with(b"PAR1"));
}

#[test]
fn check_counts_what_a_study_runs_and_names_what_is_refused() {
    let root = with_study(STUDY);
    let output = succeeds(root.path(), &["check", "tiny.toml", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["kind"], &report["runs"]), (&"study".into(), &4.into()));
    assert_eq!((&report["cells"], &report["steps"]), (&serde_json::json!([8, 8]), &serde_json::json!(8.0)));
    assert!(report["memory_mib"].as_f64().unwrap() > 5.0 && report["refused"].as_array().unwrap().is_empty());
    let text = String::from_utf8(succeeds(root.path(), &["check", "tiny.toml"]).stdout).unwrap();
    assert!(text.contains("a sweep") && text.contains("runs     4") && text.contains("cells    8"), "{text}");
    // two of four combinations have a value that the scene refuses
    let root = with_study(&STUDY.replace("[0.5, 2.0]", "[0.5, -2.0]"));
    let output = program(root.path(), &["check", "tiny.toml"]);
    let error = error_of(&output);
    assert_eq!((output.status.code(), error.lines().count()), (Some(1), 2), "{error}");
    assert!(error.contains("error: run 03: ") && error.contains("`model.peclet` = -2"), "{error}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("refused  2"));
    assert_eq!(std::fs::read_dir(root.path()).unwrap().count(), 2, "check writes nothing");
    // every kind of study
    let orders = with_study("scene = \"square.toml\"\nlevels = [2, 3]\nvary = { \"mesh.n\" = \"n\" }\n");
    let text = String::from_utf8(succeeds(orders.path(), &["check", "tiny.toml"]).stdout).unwrap();
    assert!(text.contains("a study of orders") && text.contains("cells    8 to 18"), "{text}");
}

#[test]
fn huge_studies_are_refused() {
    let seeds = with_study("scene = \"square.toml\"\nseeds = 100000000000000\n");
    refused_in(&seeds, &["study", "tiny.toml"], &["`seeds` = 100000000000000", "at most 10000 seeds"]);
    let list = "{ linspace = [1.0, 2.0, 1000000000] }";
    let long = with_study(&format!("scene = \"square.toml\"\nvary = {{ \"model.peclet\" = {list} }}\n"));
    refused_in(&long, &["check", "tiny.toml"], &["vary.\"model.peclet\"", "2 to 10000"]);
    let list = "{ linspace = [1.0, 2.0, 9000] }";
    let grid =
        format!("scene = \"square.toml\"\nvary = {{ \"model.peclet\" = {list}, \"model.coherence\" = {list} }}\n");
    refused_in(&with_study(&grid), &["check", "tiny.toml"], &["81000000 combinations", "at most 10000"]);
}
