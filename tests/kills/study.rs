//! A study that is killed again and again ends in the table of one that was not.

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = include_str!("../../studies/mms/square.toml");

fn study(folder: &Path, out: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_monolayer"));
    command.args(["study", "killed.toml", "-q", "--jobs", "2", "--out", out]).current_dir(folder);
    command.stdout(Stdio::null()).process_group(0);
    command
}

/// The table without what it cost.
fn table(folder: &Path, out: &str) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_path(folder.join(out).join("results.csv")).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let kept = header.len() - 3;
    assert_eq!(header[kept..], ["seconds", "peak_memory_mib", "threads"]);
    let rows = reader.records().map(|row| row.unwrap().iter().take(kept).map(str::to_owned).collect());
    std::iter::once(header[..kept].to_vec()).chain(rows).collect()
}

/// The study and all its children, at once.
fn kill(child: &mut Child) {
    let group = format!("-{}", child.id());
    assert!(Command::new("kill").args(["-KILL", "--", &group]).status().unwrap().success());
    child.wait().unwrap();
}

/// Always the same numbers, between 0 and 1.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

/// Kills and resumes `times` times, in as many folders as that takes, and compares.
fn survives(text: &str, times: usize, seed: u64) -> Vec<Vec<String>> {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path();
    std::fs::write(folder.join("square.toml"), SCENE.replace("end = 1.0", "end = 0.25")).unwrap();
    std::fs::write(folder.join("killed.toml"), text).unwrap();
    let begin = Instant::now();
    assert!(study(folder, "whole").status().unwrap().success());
    let whole = begin.elapsed();
    let expected = table(folder, "whole");
    let (mut dice, mut kills, mut tries) = (Dice(seed), 0, 0);
    while kills < times {
        let out = format!("killed-{tries}");
        tries += 1;
        loop {
            let mut child = study(folder, &out).spawn().unwrap();
            let patience = if kills < times { whole.mul_f64(0.6 * dice.roll()) } else { Duration::from_secs(300) };
            let begin = Instant::now();
            let ended = loop {
                match child.try_wait().unwrap() {
                    Some(status) => break Some(status),
                    None if begin.elapsed() > patience => break None,
                    None => std::thread::sleep(Duration::from_millis(2)),
                }
            };
            match ended {
                Some(status) => {
                    assert!(status.success(), "{status}");
                    break;
                }
                None => {
                    kill(&mut child);
                    kills += 1;
                }
            }
        }
        assert_eq!(table(folder, &out), expected, "after {kills} kills");
    }
    expected
}

#[test]
fn ten_kills_change_nothing() {
    let text = r#"scene = "square.toml"
set = { "mesh.n" = 2, "time.step" = 0.025, "output" = [
    { measures = ["free_energy"], every = { steps = 3 } }, { checkpoint = true, every = { steps = 2 } },
] }
vary = { "model.peclet" = [0.5, 1.0, 2.0], "model.coherence" = [1.0, 0.01] }
[[case]]
name = "steady"
set = { "steady.want" = "any", "initial.polarity" = [0.1, 0], "exact.pressure" = 0, "exact.velocity" = [
    "sin(pi*x)*cos(pi*y)", "-cos(pi*x)*sin(pi*y)",
], "exact.polarity" = ["(1-cos(2*pi*x))*cos(pi*y)/2", "cos(pi*x)*(1-cos(2*pi*y))/2"] }
[[case]]
name = "late"
set = { "coupling.max_iterations" = 1, "coupling.tolerance" = 1e-12, "coupling.accept" = 1e3 }
"#;
    let table = survives(text, 10, 1);
    assert_eq!(table.len(), 9);
}

#[test]
fn kills_change_no_chain_of_warm_starts() {
    let text = r#"scene = "square.toml"
warm_start = "model.peclet"
set = { "mesh.n" = 2, "time.step" = 0.05, "output" = [{ checkpoint = true, every = { steps = 1 } }] }
vary = { "model.alignment" = [0.0, 1.0], "model.peclet" = [0.5, 1.0, 2.0] }
"#;
    let table = survives(text, 4, 2);
    let branch = table[0].iter().position(|name| name == "branch").unwrap();
    let starts: Vec<&str> = table[1..].iter().map(|row| row[branch].as_str()).collect();
    assert_eq!((starts[0], starts[3]), ("start", "start"));
    assert!([1, 2, 4, 5].iter().all(|&at| starts[at] != "start"), "{starts:?}");
}

#[test]
fn estimates_that_were_killed_are_made_when_the_study_is_resumed() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path();
    let text = r#"scene = "square.toml"
set = { "mesh.n" = 4, "time.step" = 0.05, "output" = [
    { measures = ["free_energy"], every = { steps = 2 }, estimate = true },
] }
vary = { "model.coherence" = [0.5, 1.0] }
plot = { x = "model.coherence", y = "free_energy" }
[[case]]
name = "stationary"
set = { "time.stop" = { residual = 100.0 } }
[[case]]
name = "rest"
set = { "time.stop" = { energy_rate = 100.0 }, "time.end" = 1.0 }
"#;
    // data that rest soon, or no stop would be taken
    let at_rest = [("(1+t)", "(1+min(t,0.1))"), ("pi*t/4", "pi*min(t,0.1)/4"), ("atan(t", "atan(min(t,0.1)")]
        .iter()
        .fold(SCENE.replace("end = 1.0", "end = 0.25"), |text, (from, to)| text.replace(from, to));
    std::fs::write(folder.join("square.toml"), at_rest).unwrap();
    std::fs::write(folder.join("killed.toml"), text).unwrap();
    assert!(study(folder, "whole").status().unwrap().success());
    let expected = table(folder, "whole");
    let mut pending = 0;
    for run in ["01", "02", "03-stationary", "04-rest"] {
        let at = folder.join("killed").join(run);
        let mut child = study(folder, "killed").spawn().unwrap();
        while !at.join("estimate").exists() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        kill(&mut child);
        let summary = std::fs::read_to_string(at.join("summary.json")).unwrap();
        pending += usize::from(summary.contains("\"estimates_pending\": true"));
    }
    assert!(pending > 0, "no estimate was caught at work");
    assert!(study(folder, "killed").status().unwrap().success());
    assert_eq!(table(folder, "killed"), expected, "{pending} of 4 were killed");
    let column = |name: &str| expected[0].iter().position(|n| n == name).unwrap_or_else(|| panic!("no {name}"));
    let [energy, error, ending] = ["free_energy", "free_energy_error", "ending"].map(column);
    assert_eq!(error, energy + 1);
    for row in &expected[1..] {
        let [energy, error] = [energy, error].map(|at| row[at].parse::<f64>().unwrap());
        assert!(error > 0.0 && error < energy, "{row:?}");
    }
    let endings: Vec<&str> = expected[1..].iter().map(|row| row[ending].as_str()).collect();
    assert_eq!(endings, ["end-time", "end-time", "stationary", "energy-at-rest"]);
    let plot = std::fs::read_to_string(folder.join("killed/plots/free_energy-by-model.coherence.svg")).unwrap();
    assert!(plot.contains("free energy F (dimensionless)") && plot.contains("κ"), "{plot}");
    assert!(!plot.contains("model.coherence"), "names are for readers");
}

#[test]
fn two_processes_share_a_folder_without_doing_a_run_twice() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path();
    std::fs::write(folder.join("square.toml"), SCENE.replace("end = 1.0", "end = 0.25")).unwrap();
    let text = "scene = \"square.toml\"\nset = { \"mesh.n\" = 2, \"time.step\" = 0.05 }\n\
                vary = { \"model.peclet\" = [0.5, 1, 2, 4] }\n";
    std::fs::write(folder.join("killed.toml"), text).unwrap();
    let said = |command: &mut Command| command.arg("-v").stderr(Stdio::piped()).spawn().unwrap();
    let both = [(); 2].map(|()| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_monolayer"));
        command.args(["study", "killed.toml", "--jobs", "1", "--out", "out"]).current_dir(folder);
        said(command.stdout(Stdio::null()))
    });
    let said: String = both
        .into_iter()
        .map(|child| {
            let output = child.wait_with_output().unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            String::from_utf8_lossy(&output.stderr).into_owned()
        })
        .collect();
    for run in ["01", "02", "03", "04"] {
        let begun = said.lines().filter(|line| line.starts_with(&format!("{run}: step 1 "))).count();
        assert_eq!(begun, 1, "run {run}:\n{said}");
    }
    assert_eq!(table(folder, "out").len(), 5);
}
