//! `monolayer order`: the files of a study, its exit codes, and what it says about wrong ones.

mod tiny_study;

use std::path::PathBuf;
use std::process::Command;

use monolayer::scene::Scene;
use tiny_study::{SCENE, error_of, program, refused_in, succeeds, with_study};

const STUDY: &str = r#"title = "Tiny"
scene = "square.toml"
levels = [2, 3, 4]
vary = { "mesh.n" = "n", "time.step" = "1/(4*n)" }
"#;

fn rows(path: PathBuf) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let list = |row: &csv::StringRecord| row.iter().map(str::to_owned).collect::<Vec<_>>();
    (list(reader.headers().unwrap()), reader.records().map(|row| list(&row.unwrap())).collect())
}

/// Every field and norm with its sizes, errors and orders by level.
fn series(orders: &[Vec<String>]) -> Vec<Vec<[f64; 4]>> {
    let mut names: Vec<&[String]> = orders.iter().map(|row| &row[3..5]).collect();
    names.sort();
    names.dedup();
    let number = |text: &str| if text.is_empty() { f64::NAN } else { text.parse().unwrap() };
    let of = |name: &&[String]| {
        let own = orders.iter().filter(|row| row[3..5] == **name);
        own.map(|row| [number(&row[1]), number(&row[2]), number(&row[5]), number(&row[6])]).collect()
    };
    names.iter().map(of).collect()
}

#[test]
fn a_study_leaves_tables_plots_and_what_was_studied() {
    let root = with_study(STUDY);
    let output = succeeds(root.path(), &["order", "tiny.toml", "--out", "out"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("velocity") && text.contains("fit") && text.contains("results in out"), "{text}");
    let out = root.path().join("out");
    let mut files: Vec<String> =
        std::fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    files.sort();
    assert_eq!(files, ["lock", "orders.csv", "orders.png", "orders.svg", "runs.csv", "scene.toml", "study.toml"]);
    let (header, orders) = rows(out.join("orders.csv"));
    assert_eq!(header, ["n", "h", "dt", "field", "norm", "error", "order"]);
    // four fields in two norms each, and the velocity in a third
    assert_eq!(orders.len(), 3 * 9);
    let series = series(&orders);
    assert_eq!(series.len(), 9);
    for levels in series {
        assert!(levels[0][3].is_nan() && levels.iter().all(|level| level[2] > 0.0));
        for (pair, n) in levels.windows(2).zip([3.0, 4.0]) {
            let [[h, _, coarse, _], [fine_h, dt, fine, order]] = [pair[0], pair[1]];
            assert!((order - (coarse / fine).ln() / (h / fine_h).ln()).abs() < 1e-12);
            assert!(order > 1.0, "{order}");
            assert!((fine_h - 2f64.sqrt() / n).abs() < 1e-14 && (dt - 0.25 / n).abs() < 1e-14, "{fine_h} {dt}");
        }
    }
    let (header, runs) = rows(out.join("runs.csv"));
    let value = |row: &[String], name: &str| row[header.iter().position(|h| h == name).unwrap()].clone();
    assert_eq!(runs.len(), 3);
    for (row, n) in runs.iter().zip([2, 3, 4]) {
        assert_eq!(value(row, "cells"), (2 * n * n).to_string());
        assert_eq!(value(row, "steps"), n.to_string());
        assert_eq!((value(row, "status"), value(row, "reason")), ("complete".into(), String::new()));
    }
    assert!(std::fs::read(out.join("orders.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(std::fs::read_to_string(out.join("orders.svg")).unwrap().contains("</svg>"));
}

/// A Stokes flow has orders of its own, and what has no exact fields has none.
#[test]
fn a_study_of_a_stokes_flow() {
    let root = tempfile::tempdir().unwrap();
    for name in ["stokes.toml", "stokes-square.toml"] {
        std::fs::copy(format!("studies/mms/{name}"), root.path().join(name)).unwrap();
    }
    let output = succeeds(root.path(), &["order", "stokes.toml", "--set", "levels=[4, 8]", "--out", "out"]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("L2(H1)") && !text.contains("polarity"), "{text}");
    let (_, orders) = rows(root.path().join("out/orders.csv"));
    let last = |field: &str, norm: &str| {
        let row = orders.iter().rev().find(|row| row[3] == field && row[4] == norm).unwrap();
        row[6].parse::<f64>().unwrap()
    };
    assert_eq!(orders.len(), 2 * 5);
    assert!(last("velocity", "L2(L2)") > 2.8 && last("velocity", "L2(H1)") > 1.9 && last("pressure", "L2(L2)") > 1.9);
    let (header, runs) = rows(root.path().join("out/runs.csv"));
    let value = |row: &[String], name: &str| row[header.iter().position(|h| h == name).unwrap()].clone();
    assert_eq!((value(&runs[1], "cells"), value(&runs[1], "steps")), ("128".into(), "2".into()));
    // an order that the degrees do not have is an error, with the norm in which it falls short
    let least = ["order", "stokes.toml", "-q", "--set", "levels=[4, 8]", "--set", "expect={ velocity = 3.5 }"];
    let output = program(root.path(), &[&least[..], &["--out", "missed"]].concat());
    assert!(error_of(&output).contains("velocity in L2(L2): order "), "{}", error_of(&output));
    let scene = std::fs::read_to_string(root.path().join("stokes-square.toml")).unwrap();
    let bare =
        scene.split("[exact]").next().unwrap().replace("\"dirichlet\"", "\"slip\"") + "[time]\nstep = 1\nend = 1\n";
    std::fs::write(root.path().join("stokes-square.toml"), bare).unwrap();
    let output = program(root.path(), &["order", "stokes.toml", "-q", "--out", "none"]);
    assert!(error_of(&output).contains("no exact fields"), "{}", error_of(&output));
}

#[test]
fn what_a_study_leaves_repeats_it() {
    let root = with_study(STUDY);
    let sets = ["--set", "levels=[2, 3]", "--set", "model.peclet=0.5"];
    succeeds(root.path(), &[&["order", "tiny.toml", "--out", "a"], &sets[..]].concat());
    let out = root.path().join("a");
    let resolved = std::fs::read_to_string(out.join("scene.toml")).unwrap();
    let scene = Scene::read(&out.join("scene.toml")).unwrap();
    assert_eq!(scene.resolved_toml(), resolved);
    assert_eq!((scene.parameters.peclet, scene.mesh.get("n")), (0.5, Some(2_usize)));
    // the study finds its scene from its new folder
    std::fs::create_dir(root.path().join("elsewhere")).unwrap();
    std::fs::rename(out.join("study.toml"), root.path().join("elsewhere/study.toml")).unwrap();
    succeeds(root.path(), &["order", "elsewhere/study.toml", "--out", "b", "--set", "model.peclet=0.5", "-q"]);
    succeeds(root.path(), &["order", "elsewhere/study.toml", "--out", "c", "-q", "--threads", "1"]);
    let table = |name: &str| std::fs::read_to_string(root.path().join(name).join("orders.csv")).unwrap();
    assert_eq!(table("a"), table("b"));
    assert_ne!(table("a"), table("c"), "model.peclet was set for the first");
}

#[test]
fn variants_have_their_own_folders() {
    let variants = r#"
[[variant]]
name = "newton"
[[variant]]
name = "anderson"
set = { "coupling.kind" = "anderson", "boundary.left.velocity" = { dirichlet = [0, "-ln(1+t)/ln(2)*sin(pi*y)"] } }
"#;
    let root =
        with_study(&format!("{STUDY}{}", variants.replace("[0, \"exact_v\"]", "[0, \"-ln(1+t)/ln(2)*sin(pi*y)\"]")));
    let arguments = ["order", "tiny.toml", "--set", "levels=[2, 3]", "--out", "out"];
    let output = succeeds(root.path(), &arguments);
    assert!(error_of(&output).contains("anderson: n = 3: 18 cells"), "{}", error_of(&output));
    let out = root.path().join("out");
    for (name, kind) in [("newton", "newton"), ("anderson", "anderson")] {
        let (_, orders) = rows(out.join(name).join("orders.csv"));
        assert_eq!(orders.len(), 2 * 9);
        let scene = std::fs::read_to_string(out.join(name).join("scene.toml")).unwrap();
        assert!(scene.contains(&format!("kind = \"{kind}\"")), "{scene}");
        assert!(out.join(name).join("orders.svg").exists() && out.join(name).join("orders.png").exists());
    }
    assert!(!out.join("orders.csv").exists() && out.join("study.toml").exists());
    let (_, runs) = rows(out.join("runs.csv"));
    let names: Vec<&str> = runs.iter().map(|row| row[0].as_str()).collect();
    assert_eq!(names, ["newton", "newton", "anderson", "anderson"]);
}

#[test]
fn orders_in_time_refer_to_the_step() {
    // on a mesh this coarse nothing falls with the step
    let study = STUDY.replace("\"mesh.n\" = \"n\", ", "").replace("[2, 3, 4]", "[4, 8]") + "expect = {}\n";
    let root = with_study(&study);
    let exact = ["--set", "time.start=exact", "--set", "time.alternate=2", "--set", "mesh.n=2"];
    succeeds(root.path(), &[&["order", "tiny.toml", "--out", "out"], &exact[..]].concat());
    let (_, orders) = rows(root.path().join("out/orders.csv"));
    for levels in series(&orders) {
        let [[h, dt, coarse, _], [fine_h, fine_dt, fine, order]] = [levels[0], levels[1]];
        assert_eq!(h, fine_h);
        assert!((dt / fine_dt - 2.0).abs() < 1e-12, "{dt} {fine_dt}");
        assert!((order - (coarse / fine).log2()).abs() < 1e-12);
    }
}

#[test]
fn an_expectation_that_is_missed_is_an_error() {
    let root = with_study(STUDY);
    let base = ["order", "tiny.toml", "-q", "--set", "levels=[2, 3]"];
    let met = succeeds(root.path(), &[&base[..], &["--set", "expect={ velocity = 1.5 }", "--out", "a"]].concat());
    assert!(met.stdout.is_empty() && met.stderr.is_empty(), "quiet means quiet: {}", error_of(&met));
    let missed = program(root.path(), &[&base[..], &["--set", "expect={ velocity = 9 }", "--out", "b"]].concat());
    assert_eq!(missed.status.code(), Some(1));
    let error = error_of(&missed);
    assert!(error.contains("velocity in L2(L2): order ") && error.contains("expected at least 9"), "{error}");
    assert!(root.path().join("b/orders.svg").exists(), "the results are there all the same");
}

#[test]
fn orders_that_fall_short_of_the_degrees_are_errors() {
    // a kink in the polarity: the sources know nothing of it, and nothing converges
    let root = with_study(STUDY);
    let kinked =
        SCENE.replace("end = 1.0", "end = 0.25").replace("\"tan(pi*t/4)*(1-cos(2*pi*x))*cos(pi*y)\"", "\"abs(x-0.3)\"");
    std::fs::write(root.path().join("square.toml"), kinked).unwrap();
    let base = ["order", "tiny.toml", "-q", "--set", "levels=[4, 8]"];
    let output = program(root.path(), &[&base[..], &["--out", "a"]].concat());
    let error = error_of(&output);
    assert_eq!(output.status.code(), Some(1), "{error}");
    for field in ["velocity", "pressure", "polarity", "laplacian"] {
        let line = error.lines().find(|line| line.contains(&format!("{field} in L2(L2): order "))).expect("a line");
        assert!(line.contains("expected 2.0 by "), "{line}");
    }
    assert!(error.contains("kinks") && error.contains("`expect`"), "{error}");
    succeeds(root.path(), &[&base[..], &["--set", "expect={}", "--out", "b"]].concat());
}

#[test]
fn exact_polynomials_have_no_order_and_miss_none() {
    let root = with_study(STUDY);
    let from = SCENE.find("[exact]").unwrap();
    let to = SCENE.find("[initial]").unwrap();
    let exact = "[exact]\nvelocity = [\"0\", \"0\"]\npressure = \"x-1/2\"\npolarity = [\"1\", \"1/2\"]\n";
    let scene = [&SCENE[..from], exact, &SCENE[to..]].concat().replace("end = 1.0", "end = 0.25");
    std::fs::write(root.path().join("square.toml"), scene).unwrap();
    let base = ["order", "tiny.toml", "-q", "--set", "levels=[2, 3]"];
    succeeds(root.path(), &[&base[..], &["--out", "a"]].concat());
    succeeds(root.path(), &[&base[..], &["--set", "expect={ polarity = 3 }", "--out", "b"]].concat());
}

#[test]
fn a_level_that_fails_leaves_the_others() {
    let study = STUDY.replace("vary = {", "vary = { \"coupling.max_iterations\" = \"if(abs(n-3) < 0.5, 1, 100)\",");
    let root = with_study(&study);
    let sets = ["--set", "time.step_min=0.05", "--set", "coupling.accept=2e-8"];
    let output = program(root.path(), &[&["order", "tiny.toml", "-q", "--out", "out"], &sets[..]].concat());
    assert_eq!(output.status.code(), Some(1));
    let error = error_of(&output);
    assert!(error.contains("n = 3: step 1 from t = 0 failed") && error.contains("hint"), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
    let (_, runs) = rows(root.path().join("out/runs.csv"));
    let status: Vec<&str> = runs.iter().map(|row| row[13].as_str()).collect();
    assert_eq!(status, ["complete", "failed", "complete"]);
    assert!(runs[1][14].contains("time.step_min"), "{:?}", runs[1]);
    let (_, orders) = rows(root.path().join("out/orders.csv"));
    let levels: Vec<&str> = orders.iter().step_by(9).map(|row| row[0].as_str()).collect();
    assert_eq!(levels, ["2", "4"]);
    for levels in series(&orders) {
        // the order is that to the last level that was complete
        let [[h, _, coarse, _], [fine_h, _, fine, order]] = [levels[0], levels[1]];
        assert!((order - (coarse / fine).ln() / (h / fine_h).ln()).abs() < 1e-12);
    }
}

#[test]
fn results_are_not_overwritten() {
    let root = with_study(STUDY);
    let arguments = ["order", "tiny.toml", "-q", "--set", "levels=[2, 3]"];
    let into = [&arguments[..], &["--out", "out"]].concat();
    succeeds(root.path(), &into);
    let before = std::fs::read(root.path().join("out/orders.csv")).unwrap();
    let again = program(root.path(), &into);
    assert_eq!(again.status.code(), Some(1));
    let error = error_of(&again);
    assert!(
        error.contains("error: out: holds the results") && error.contains("hint: choose another `--out`"),
        "{error}"
    );
    assert_eq!(std::fs::read(root.path().join("out/orders.csv")).unwrap(), before);
    // without --out the folders are numbered; those of runs count
    succeeds(root.path(), &arguments);
    succeeds(root.path(), &["run", "square.toml", "-q", "--set", "mesh.n=2", "--out", "out/tiny-2"]);
    succeeds(root.path(), &arguments);
    for (folder, there) in [("tiny", true), ("tiny-2", false), ("tiny-3", true)] {
        assert_eq!(root.path().join("out").join(folder).join("orders.csv").exists(), there, "{folder}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_study_keeps_its_finished_levels() {
    // the last level would take minutes
    let root = with_study(&STUDY.replace("[2, 3, 4]", "[2, 3, 24]").replace("1/(4*n)", "if(n > 20, 1e-5, 1/(4*n))"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_monolayer"))
        .args(["order", "tiny.toml", "-q", "--out", "out"])
        .current_dir(root.path())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let runs = root.path().join("out/runs.csv");
    let begin = std::time::Instant::now();
    while !std::fs::read_to_string(&runs).is_ok_and(|text| text.lines().count() == 3) {
        assert!(begin.elapsed().as_secs() < 120, "the second level should have ended");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let (_, runs) = rows(runs);
    let status: Vec<&str> = runs.iter().map(|row| row[13].as_str()).collect();
    assert_eq!(status, ["complete", "complete", "failed"]);
    assert!(runs[2][14].contains("stopped from outside"), "{:?}", runs[2]);
    assert_eq!(rows(root.path().join("out/orders.csv")).1.len(), 2 * 9);
    assert!(root.path().join("out/orders.png").exists());
}

/// The study with `from` replaced by `to` is refused, with its line.
#[track_caller]
fn wrong(from: &str, to: &str, parts: &[&str]) {
    let at = STUDY.find(from).unwrap_or_else(|| panic!("the study has no `{from}`"));
    let line = format!("tiny.toml, line {}", STUDY[..at].matches('\n').count() + 1);
    let root = with_study(&STUDY.replacen(from, to, 1));
    refused_in(&root, &["order", "tiny.toml"], &[&[line.as_str()], parts].concat());
}

/// The study with a `--set` is refused.
#[track_caller]
fn wrong_set(set: &str, parts: &[&str]) {
    refused_in(&with_study(STUDY), &["order", "tiny.toml", "--set", set], parts);
}

#[test]
fn keys_and_levels() {
    let known = "title, scene, levels, vary, expect, variant";
    wrong("levels", "level", &["there is no key `level` (did you mean `levels`?)", known]);
    wrong("title = \"Tiny\"", "variants = []", &["`variants` (did you mean `variant`?)", known]);
    wrong("square.toml", "sqare.toml", &["`scene` = \"sqare.toml\"", "no such file", "the study's folder"]);
    for levels in ["[2]", "[]", "[2, 2]", "[3, 2]", "[0, 1]", "[-2, 2]", "[2, inf]", "[nan, 2]"] {
        wrong("[2, 3, 4]", levels, &["`levels` = [", "at least two positive numbers", "such as [8, 16, 32]"]);
    }
    wrong("[2, 3, 4]", "\"2, 3\"", &["`levels` = \"2, 3\"", "expected a list", "brackets"]);
    wrong("[2, 3, 4]", "4", &["`levels` = 4", "expected a list"]);
    wrong("[2, 3, 4]", "[2, \"3\"]", &["`levels.1` = \"3\"", "expected a number"]);
    refused_in(
        &with_study("scene = \"square.toml\"\nlevels = [2, 3]\n"),
        &["order", "tiny.toml"],
        &["`vary` is missing"],
    );
    let gone = ["gone.toml: cannot be read", "the path of a study"];
    refused_in(&with_study(STUDY), &["order", "gone.toml"], &gone);
    refused_in(&with_study("levels = = 3"), &["order", "tiny.toml"], &["tiny.toml, line 1: not TOML"]);
    let all = ["square.toml with `level` set", "(did you mean `levels`?)", "model, mesh", "of the study title, scene"];
    wrong_set("level=[2, 3]", &all);
    wrong_set("levels=[3, 2]", &["tiny.toml with `levels` set", "`levels` = [3.0, 2.0]"]);
    wrong_set("model.pecle=3", &["square.toml with `model.pecle` set", "did you mean `peclet`?"]);
    wrong_set("mesh.n=4", &["`mesh.n` = 4", "`vary` of the study sets it at every level"]);
}

#[test]
fn values_that_vary() {
    let n = "\"mesh.n\" = \"n\"";
    wrong(n, "\"mesh.m\" = \"n\"", &["level n = 2", "no key `mesh.m` (did you mean `n`?)", "shape, file, slits, n"]);
    wrong(n, "\"mesh.n\" = \"2*m\"", &["`vary.\"mesh.n\"` = \"2*m\"", "`m`, which is not defined", "x, y, t, n"]);
    wrong(n, "\"mesh.n\" = \"n+\"", &["`vary.\"mesh.n\"` = \"n+\"", "no formula: at character 3"]);
    wrong("1/(4*n)", "1/(n-2)", &["`vary.\"time.step\"` = \"1/(n-2)\"", "is inf", "at n = 2", "must be finite"]);
    wrong(n, "\"mesh.n\" = \"n/4\"", &["level n = 2: square.toml with `mesh.n` set: `mesh.n` = 0.5", "a whole number"]);
    wrong("1/(4*n)", "(3-n)/8", &["level n = 3: square.toml with `time.step` set: `time.step` = 0", "greater than 0"]);
    wrong("1/(4*n)", "n", &["level n = 2: square.toml with `time.step` set: `time.step` = 2", "time.end = 0.25"]);
    wrong(n, "mesh.n = \"n\"", &["`vary.mesh` = a table", "expected a formula", "quote a key that has dots"]);
    // nothing that is refined
    for vary in ["{}", "{ \"mesh.n\" = \"3\" }", "{ \"model.peclet\" = \"n\" }", "{ \"mesh.n\" = \"floor(n/2)\" }"] {
        wrong_set(
            &format!("vary={vary}"),
            &["tiny.toml with `vary` set: `vary` = {", "must change [mesh] at every level"],
        );
    }
}

#[test]
fn variants_and_expectations() {
    let variants = |text: &str, parts: &[&str]| {
        let line = STUDY.lines().count() + text.lines().position(|l| l.contains("WRONG")).unwrap() + 1;
        let root = with_study(&format!("{STUDY}{}", text.replace("WRONG", "a")));
        refused_in(&root, &["order", "tiny.toml"], &[&[format!("tiny.toml, line {line}").as_str()], parts].concat());
    };
    let name = "must be a name of its own of letters, digits, - and _";
    variants("[[variant]]\nname = \"a\"\n[[variant]]\nname = \"WRONG\"\n", &["`variant.1.name` = \"a\"", name]);
    variants("[[variant]]\nname = \"WRONG/b\"\n", &["`variant.0.name` = \"a/b\"", name]);
    variants("[[variant]]\nname = \"../WRONG\"\n", &["`variant.0.name` = \"../a\"", name]);
    variants("[[variant]]\nnam = \"WRONG\"\n", &["no key `variant.0.nam` (did you mean `name`?)", "name, set"]);
    let table = "[[variant]]\nname = \"a\"\nset.coupling.kind = \"WRONG\"\n";
    variants(table, &["`variant.0.set.coupling`", "replace the whole table [coupling]", "quote a key that has dots"]);
    let both = "[[variant]]\nname = \"a\"\nset = { \"mesh.n\" = 3 } # WRONG\n";
    variants(both, &["`variant.0.set.\"mesh.n\"` = 3", "`vary` sets it at every level"]);
    let kind = "[[variant]]\nname = \"a\"\nset = { \"coupling.kind\" = \"newtn\" } # WRONG\n";
    variants(kind, &["variant `a`: square.toml with `coupling.kind` set", "did you mean `newton`?"]);
    variants("[expect]\nvelocitty = 3 # WRONG\n", &["`expect.velocitty` = 3", "did you mean `velocity`?", "laplacian"]);
    variants("[expect]\nvelocity = nan # WRONG\n", &["`expect.velocity` = NaN", "must be finite"]);
    variants("[expect]\nvelocity = \"WRONG\"\n", &["`expect.velocity` = \"a\"", "expected a number"]);
}

#[test]
fn scenes_that_no_study_can_have() {
    let root = with_study(STUDY);
    let scene = SCENE.replace("[exact]", "[other]");
    let (head, tail) = scene.split_once("[other]").unwrap();
    let tail = tail.split_once("[initial]").unwrap().1.replace("\"exact\"", "[0, 0]");
    std::fs::write(root.path().join("square.toml"), format!("{head}[initial]{tail}")).unwrap();
    refused_in(&root, &["order", "tiny.toml"], &["square.toml: the scene has no exact fields", "add [exact]"]);
    let level = "tiny.toml, line 3, level n = 2: square.toml with";
    wrong_set("exact.velocity=[\"x\", 0]", &[level, "`exact.velocity` has div v = 1", "stream function"]);
    wrong_set("exact.pressure=1/x", &[level, "`exact.pressure` = `1/x` is inf at x = 0", "must be finite"]);
    wrong_set("exact.polarity=[\"sqrt(t-1)\", 0]", &["`exact.polarity` = `sqrt(t-1)` is NaN", "t = 0"]);
    wrong_set("exact.pressure=sqrt(0.2-t)", &["`exact.pressure` = `sqrt(0.2-t)` is NaN", "t = 0.25", "`time.end`"]);
    wrong_set("boundary.left.velocity=", &["`boundary.left.velocity` is missing"]);
    wrong_set(
        "boundary.lef={ velocity = \"slip\", polarity = \"neumann\" }",
        &["[boundary.lef]", "did you mean `left`?"],
    );
}

#[test]
fn scenes_and_studies_are_told_apart() {
    let root = with_study(STUDY);
    for command in ["run", "mesh"] {
        let parts =
            ["tiny.toml: this is a study, not a scene", "`monolayer order tiny.toml`", "its scene is square.toml"];
        refused_in(&root, &[command, "tiny.toml"], &parts);
        refused_in(&root, &[command, "tiny.toml", "--set", "model.peclet=2"], &parts);
    }
    let parts = ["square.toml: this is a scene, not a study", "`monolayer run square.toml`", "`levels`"];
    refused_in(&root, &["order", "square.toml"], &parts);
    refused_in(&root, &["order", "tiny.toml", "--set", "scene=tiny.toml"], &["this is a study, not a scene"]);
}

#[test]
fn folders_that_cannot_be_written() {
    let root = with_study(STUDY);
    for (folder, hint) in
        [("square.toml", "a file is where a folder should be"), ("square.toml/out", "a file is where")]
    {
        refused_in(&root, &["order", "tiny.toml", "--out", folder], &[&format!("error: {folder}: "), hint]);
        refused_in(&root, &["run", "square.toml", "--set", "mesh.n=2", "--out", folder], &[folder, hint]);
    }
}

#[test]
fn a_level_that_stops_early_is_not_complete() {
    let root = with_study(STUDY);
    let output = program(root.path(), &["order", "tiny.toml", "--out", "short", "--set", "time.max_steps=1"]);
    assert!(!output.status.success());
    let text = std::fs::read_to_string(root.path().join("short/runs.csv")).unwrap();
    assert!(text.contains("failed") && text.contains("max_steps") && !text.contains("complete"), "{text}");
}

#[test]
fn an_exact_start_that_leaves_no_step_is_refused() {
    let root = with_study(STUDY);
    let sets = ["--set", "time.start=exact", "--set", "time.scheme=bdf6", "--out", "late"];
    let output = program(root.path(), &[&["order", "tiny.toml"], &sets[..]].concat());
    let error = error_of(&output);
    assert!(!output.status.success() && error.contains("time.start") && error.contains("5 steps"), "{error}");
    assert!(!root.path().join("late").exists());
}
