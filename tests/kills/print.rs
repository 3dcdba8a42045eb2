//! Nobody has to listen: streams that are closed or full change neither results nor exit codes.

use std::fs::File;
use std::path::Path;
use std::process::Stdio;

use crate::{SQUARE, good, program, said};

const STUDY: &str = "scene = \"square.toml\"\nvary = { \"model.peclet\" = [1.0, 2.0] }\n";

const ORDER: &str =
    "expect = {}\nscene = \"exact.toml\"\nlevels = [2, 3]\nvary = { \"mesh.n\" = \"n\", \"time.step\" = \"0.5/n\" }\n";

fn prepared() -> tempfile::TempDir {
    let temporary = tempfile::tempdir().unwrap();
    let measured = "[[output]]\nmeasures = [\"free_energy\"]\nevery = { steps = 1 }\n";
    let exact = include_str!("../../studies/mms/square.toml");
    let texts =
        [("square.toml", SQUARE.to_owned() + measured), ("study.toml", STUDY.into()), ("exact.toml", exact.into())];
    texts.iter().for_each(|(name, text)| std::fs::write(temporary.path().join(name), text).unwrap());
    std::fs::write(temporary.path().join("order.toml"), ORDER).unwrap();
    temporary
}

/// The other end of the pipe is closed before a word was said.
fn closed() -> Stdio {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    Stdio::from(writer)
}

fn full() -> Stdio {
    Stdio::from(File::options().write(true).open("/dev/full").unwrap())
}

/// Whether a command comes to its end, with its results at `left`, when nobody listens.
#[track_caller]
fn ends_well(folder: &Path, arguments: &[&str], left: &str) {
    let streams: [fn() -> Stdio; 2] = [closed, full];
    for (k, stream) in streams.into_iter().enumerate() {
        for both in [false, true] {
            let out = format!("{}-{k}-{both}", arguments[0]);
            let mut command = program(folder, &[arguments, &["--out", &out]].concat());
            command.stderr(stream()).stdout(if both { stream() } else { Stdio::null() });
            let status = command.status().unwrap();
            assert_eq!(status.code(), Some(0), "{arguments:?} {out}");
            assert!(folder.join(out).join(left).exists(), "{arguments:?}");
        }
    }
}

#[test]
fn closed_and_full_streams_end_nothing() {
    let temporary = prepared();
    let folder = temporary.path();
    ends_well(folder, &["run", "square.toml", "-v"], "summary.json");
    ends_well(folder, &["study", "study.toml", "-v"], "results.csv");
    ends_well(folder, &["order", "order.toml", "-v"], "orders.csv");
    ends_well(folder, &["mesh", "square.toml"], "square.msh");
    good(folder, &["run", "square.toml", "-q", "--out", "whole"]);
    ends_well(folder, &["plot", "whole"], "energy.svg");
    ends_well(folder, &["map", "whole"], "whole-speed-000005.svg");
    // what was begun so is a run like any other
    let whole = std::fs::read(folder.join("whole/history.csv")).unwrap();
    assert!(std::fs::read(folder.join("run-1-true/history.csv")).unwrap() == whole);
}

#[test]
fn a_failed_run_keeps_its_exit_code() {
    let temporary = prepared();
    let folder = temporary.path();
    let sets = ["--set", "coupling.max_iterations=1", "--set", "time.step_min=0.1", "--set", "coupling.accept=1e-14"];
    let mut command = program(folder, &[&["run", "square.toml", "--out", "out"], &sets[..]].concat());
    assert_eq!(command.stderr(closed()).stdout(full()).status().unwrap().code(), Some(1));
    // a wrong word on the command line has the code of clap
    assert_eq!(program(folder, &["rn"]).stderr(full()).status().unwrap().code(), Some(2));
    assert_eq!(program(folder, &["--help"]).stdout(closed()).status().unwrap().code(), Some(0));
}

#[test]
fn an_answer_that_cannot_be_given_is_an_error_and_no_panic() {
    let temporary = prepared();
    let folder = temporary.path();
    for arguments in [&["check", "square.toml"][..], &["check", "square.toml", "--json"], &["mesh", "square.toml"]] {
        let output = program(folder, arguments).stdout(full()).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        assert!(said(&output).starts_with("error: standard output cannot be written"), "{}", said(&output));
        let output = program(folder, arguments).stdout(closed()).output().unwrap();
        assert!(output.status.success() && said(&output).is_empty(), "{arguments:?}: {}", said(&output));
    }
}
