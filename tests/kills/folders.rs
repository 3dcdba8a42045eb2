//! Folders that hold somebody's own files, or in which somebody is at work.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::{SQUARE, files, good, program, ran, said};

const STUDY: &str = "# mine\nscene = \"square.toml\"\nvary = { \"model.peclet\" = [1.0, 2.0] } # two\n";

fn with(texts: &[(&str, &str)]) -> tempfile::TempDir {
    let temporary = tempfile::tempdir().unwrap();
    for (name, text) in [("square.toml", SQUARE)].iter().chain(texts) {
        let path = temporary.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    temporary
}

/// Refuses, names the file, and leaves everything as it was.
#[track_caller]
fn refused(folder: &Path, arguments: &[&str], file: &str) {
    let before = files(folder);
    let output = ran(folder, arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", said(&output));
    let text = said(&output);
    assert!(text.contains(file) && text.contains("will not be replaced"), "{arguments:?}: {text}");
    assert!(files(folder) == before, "{arguments:?} changed something");
}

#[test]
fn a_run_replaces_no_file_that_is_not_its_own() {
    let names = [
        "scene.toml",
        "history.csv",
        "fields/notes.txt",
        "plots/speed-000000.png",
        "cuts/axis-1.csv",
        "bodies.csv",
        "frames-speed.txt",
        "summary.json",
        "checkpoint.bin",
        "estimate/a.txt",
        "lock",
        "history.csv.part",
    ];
    for name in names {
        let temporary = with(&[(&format!("k/{name}"), "somebody's own words")]);
        let first = name.split('/').next().unwrap();
        for out in ["k", "./k/../k"] {
            let output = ran(temporary.path(), &["run", "square.toml", "-q", "--out", out]);
            assert_eq!(output.status.code(), Some(1), "{name}: {}", said(&output));
            assert!(
                said(&output).contains(first) || said(&output).contains("earlier run"),
                "{name}: {}",
                said(&output)
            );
        }
        assert_eq!(std::fs::read_to_string(temporary.path().join("k").join(name)).unwrap(), "somebody's own words");
        // locks are not among the files
        let before = if name == "lock" { 1 } else { 2 };
        assert_eq!(files(temporary.path()).len(), before, "{name}: nothing was added");
    }
}

#[test]
fn the_input_itself_stays_as_it_is() {
    let text = format!("# mine\n{SQUARE}");
    let temporary = with(&[("scene.toml", &text), ("study.toml", STUDY), ("a/notes.txt", "mine")]);
    let folder = temporary.path();
    std::os::unix::fs::symlink("../scene.toml", folder.join("a/scene.toml")).unwrap();
    std::fs::create_dir(folder.join("b")).unwrap();
    std::fs::hard_link(folder.join("scene.toml"), folder.join("b/scene.toml")).unwrap();
    refused(folder, &["run", "scene.toml", "--out", "."], "scene.toml");
    refused(folder, &["run", "scene.toml", "--out", ".", "--set", "model.peclet=3"], "scene.toml");
    refused(folder, &["run", "a/scene.toml", "--out", "a"], "scene.toml");
    refused(folder, &["run", "b/scene.toml", "--out", "b"], "scene.toml");
    refused(folder, &["study", "study.toml", "--out", "."], "will not be replaced");
    // what does not meet stays beside the results
    good(folder, &["run", "square.toml", "-q", "--out", "c"]);
    std::fs::write(folder.join("c/notes.txt"), "mine").unwrap();
    good(folder, &["run", "square.toml", "-q", "--out", "c", "--resume", "--set", "time.end=0.6"]);
    assert_eq!(std::fs::read_to_string(folder.join("c/notes.txt")).unwrap(), "mine");
}

#[test]
fn a_study_clears_no_folder_that_is_not_its_own() {
    for name in ["out/1/thesis.tex", "out/01/thesis.tex", "out/results.csv", "out/plots/a.svg", "out/results.parquet"] {
        let temporary = with(&[("study.toml", STUDY), (name, "mine")]);
        let folder = temporary.path();
        let output = ran(folder, &["study", "study.toml", "-q", "--out", "out"]);
        let there = std::fs::read_to_string(folder.join(name)).unwrap_or_default();
        assert_eq!(there, "mine", "{name}");
        // the folder of a run may have another name, and then there is room
        assert!(output.status.success() || said(&output).contains("will not be replaced"), "{}", said(&output));
        assert!(!output.status.success() || name.contains("thesis"), "{name}");
    }
    // one that appears later
    let temporary = with(&[("study.toml", STUDY)]);
    let folder = temporary.path();
    good(folder, &["study", "study.toml", "-q", "--out", "out"]);
    let run = std::fs::read_dir(folder.join("out")).unwrap().map(|e| e.unwrap().path()).find(|p| p.is_dir()).unwrap();
    std::fs::remove_dir_all(&run).unwrap();
    std::fs::create_dir(&run).unwrap();
    std::fs::write(run.join("mine.txt"), "mine").unwrap();
    refused(folder, &["study", "study.toml", "-q", "--out", "out"], "mine.txt");
}

#[test]
fn the_scene_in_the_folder_of_a_run_may_be_commented() {
    let temporary = with(&[]);
    let folder = temporary.path();
    good(folder, &["run", "square.toml", "-q", "--out", "out"]);
    let path = folder.join("out/scene.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let commented = format!("# mine\n{}", text.replace("end = 0.5", "end = 0.8"));
    assert!(commented.contains("end = 0.8"));
    std::fs::write(&path, &commented).unwrap();
    good(folder, &["run", "out/scene.toml", "-q", "--out", "out", "--resume"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), commented);
    // with another override it would have to be rewritten
    let more = ["run", "out/scene.toml", "-q", "--out", "out", "--resume", "--set", "time.end=0.9"];
    refused(folder, &more, "scene.toml");
}

#[test]
fn pictures_pages_and_meshes_replace_their_own_kind_only() {
    let temporary =
        with(&[("pictures/out-speed-000005.png", "mine"), ("page.html", "<p>mine"), ("m/square.msh", "mine")]);
    let folder = temporary.path();
    good(
        folder,
        &[
            "run",
            "square.toml",
            "-q",
            "--out",
            "out",
            "--set",
            "output=[{ measures = [\"free_energy\"], every = { steps = 1 } }]",
        ],
    );
    // a map takes another name
    good(folder, &["map", "out", "--of", "speed", "--out", "pictures"]);
    let pictures = folder.join("pictures");
    assert_eq!(std::fs::read_to_string(pictures.join("out-speed-000005.png")).unwrap(), "mine");
    std::fs::write(pictures.join("energy.svg"), "mine").unwrap();
    refused(folder, &["plot", "out", "--out", "pictures"], "energy.svg");
    refused(folder, &["report", "out", "--out", "page.html"], "page.html");
    refused(folder, &["mesh", "square.toml", "--out", "m"], "square.msh");
    for again in 0..2 {
        good(folder, &["map", "out", "--of", "speed", "--out", "new"]);
        good(folder, &["plot", "out", "--out", "new"]);
        good(folder, &["report", "out", "--out", "new.html"]);
        good(folder, &["mesh", "square.toml", "--out", "new"]);
        assert!(folder.join("new/square.msh").exists(), "{again}");
    }
    // a mesh file is not written over itself
    std::fs::copy("tests/data/square-with-disc-order1.msh", folder.join("disc.msh")).unwrap();
    refused(folder, &["mesh", "disc.msh", "--out", "."], "disc.msh");
}

/// A run that takes a while, at work.
fn at_work(folder: &Path, more: &[&str]) -> std::process::Child {
    let sets = ["--set", "time.step=0.0005", "--set", "time.end=100.0"];
    let arguments = [&["run", "square.toml", "-q", "--out", "out"], &sets[..], more].concat();
    program(folder, &arguments).stderr(Stdio::null()).spawn().unwrap()
}

fn wait_for(path: &Path) {
    let begin = Instant::now();
    while !path.exists() {
        assert!(begin.elapsed() < Duration::from_secs(60), "{} should be there", path.display());
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_folder_in_which_a_run_is_at_work_is_left_to_it() {
    let temporary = with(&[]);
    let folder = temporary.path();
    let mut first = at_work(folder, &[]);
    wait_for(&folder.join("out/checkpoint.bin"));
    for more in [&[][..], &["--resume"]] {
        let output = ran(folder, &[&["run", "square.toml", "--out", "out"], more].concat());
        let text = said(&output);
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains(&format!("in use by process {}", first.id())) && text.contains("began"), "{text}");
    }
    // a process that dies takes its lock along
    first.kill().unwrap();
    first.wait().unwrap();
    let mut second = at_work(folder, &["--resume"]);
    std::thread::sleep(Duration::from_millis(300));
    assert!(second.try_wait().unwrap().is_none(), "it goes on");
    Command::new("kill").args(["-TERM", &second.id().to_string()]).status().unwrap();
    assert_eq!(second.wait().unwrap().code(), Some(130));
    let mark = std::fs::read_to_string(folder.join("out/lock")).unwrap();
    assert!(!mark.contains("process"), "nobody is at work: {mark}");
}

#[test]
fn a_run_without_a_checkpoint_can_be_begun_again() {
    let temporary = with(&[]);
    let folder = temporary.path();
    good(folder, &["run", "square.toml", "-q", "--out", "whole"]);
    // killed while its mesh was made, and between its first row and its first checkpoint
    let mark = std::fs::read(folder.join("whole/lock")).unwrap();
    for (name, files) in [("early", &[][..]), ("late", &["history.csv", "scene.toml"])] {
        let out = folder.join(name);
        std::fs::create_dir(&out).unwrap();
        std::fs::write(out.join("lock"), &mark).unwrap();
        files.iter().for_each(|file| {
            std::fs::write(out.join(file), std::fs::read(folder.join("whole").join(file)).unwrap()).unwrap()
        });
        if name == "late" {
            let output = ran(folder, &["run", "square.toml", "--out", name]);
            assert!(said(&output).contains("--resume"), "{}", said(&output));
        }
        let output = ran(folder, &["run", "square.toml", "--out", name, "--resume"]);
        assert!(output.status.success() && said(&output).contains("begins anew"), "{}", said(&output));
        let table = |name: &str| std::fs::read(folder.join(name).join("history.csv")).unwrap();
        assert!(table(name) == table("whole"));
    }
    // a folder that no run has seen is not resumed
    std::fs::create_dir(folder.join("empty")).unwrap();
    for name in ["empty", "missing"] {
        let output = ran(folder, &["run", "square.toml", "--out", name, "--resume"]);
        assert!(said(&output).contains("holds no checkpoint.bin"), "{}", said(&output));
    }
    assert!(!folder.join("missing").exists() && std::fs::read_dir(folder.join("empty")).unwrap().next().is_none());
}

#[test]
fn the_first_signal_ends_what_has_nothing_to_save() {
    let temporary = with(&[]);
    let folder = temporary.path();
    let fine = ["run", "square.toml", "--out", "out", "--set", "mesh.n=700"];
    let mut command = program(folder, &fine);
    command.env("MONOLAYER_MEMORY", "1e9").stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    wait_for(&folder.join("out/lock"));
    std::thread::sleep(Duration::from_millis(100));
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let begin = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(begin.elapsed() < Duration::from_secs(5), "{:?}", begin.elapsed());
    // and the folder is free again
    good(folder, &["run", "square.toml", "-q", "--out", "out"]);
}

/// A table of millions of rows holds no signal up; whoever resumes the run gets it.
#[test]
fn a_long_cut_is_left_by_a_signal_and_written_on_resume() {
    let temporary = with(&[]);
    let folder = temporary.path();
    let cut = |points: usize| {
        format!("output=[{{ cuts = [{{ name = \"long\", from = [0, 0.3], to = [1, 0.7], points = {points} }}] }}]")
    };
    let mut command = program(folder, &["run", "square.toml", "--out", "out", "--set", &cut(9_000_000)]);
    let mut child = command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    wait_for(&folder.join("out/cuts/long.csv.part"));
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    let begin = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(begin.elapsed() < Duration::from_secs(10), "{:?}", begin.elapsed());
    assert!(std::fs::read_dir(folder.join("out/cuts")).unwrap().next().is_none(), "no half of a table is left");
    good(folder, &["run", "square.toml", "--out", "out", "--resume", "--set", &cut(300_000)]);
    let table = std::fs::read_to_string(folder.join("out/cuts/long.csv")).unwrap();
    assert_eq!(table.lines().count(), 300_001);
}

#[test]
fn a_terminal_that_goes_away_ends_a_run_cleanly_unless_it_was_told_to_stay() {
    for (shell, code) in [("exec", 130), ("trap '' HUP; exec", 0)] {
        let temporary = with(&[]);
        let folder = temporary.path();
        let line = format!(
            "{shell} {:?} run square.toml -q --out out --set time.step=0.002 --set time.end=4.0",
            env!("CARGO_BIN_EXE_monolayer")
        );
        let mut child =
            Command::new("sh").args(["-c", &line]).current_dir(folder).stdin(Stdio::null()).spawn().unwrap();
        wait_for(&folder.join("out/checkpoint.bin"));
        // a shell that goes down, and the system, each say it once
        for _ in 0..2 {
            Command::new("kill").args(["-HUP", &child.id().to_string()]).status().unwrap();
        }
        assert_eq!(child.wait().unwrap().code(), Some(code), "{shell}");
        let summary: serde_json::Value =
            serde_json::from_slice(&std::fs::read(folder.join("out/summary.json")).unwrap()).unwrap();
        assert_eq!(summary["status"], if code == 0 { "finished" } else { "interrupted" });
    }
}

/// Files under names of steps that are not there yet, with somebody's own words, survive a resumption.
#[test]
fn resuming_removes_what_runs_write_alone() {
    let temporary = with(&[]);
    let first = ran(temporary.path(), &["run", "square.toml", "-q", "--set", "time.max_steps=1", "--out", "k"]);
    assert!(first.status.success(), "{}", said(&first));
    let own = ["fields/step-000900.vtu", "cuts/mine-step-000900.csv", "bodies/step-000900.vtp"];
    for name in own {
        let path = temporary.path().join("k").join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "somebody's own words").unwrap();
    }
    let second =
        ran(temporary.path(), &["run", "square.toml", "-q", "--set", "time.max_steps=2", "--out", "k", "--resume"]);
    assert!(second.status.success(), "{}", said(&second));
    for name in own {
        let kept = std::fs::read_to_string(temporary.path().join("k").join(name));
        assert_eq!(kept.unwrap_or_default(), "somebody's own words", "{name}");
    }
}
