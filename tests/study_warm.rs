//! Warm starts along a branch of states that is known: `u³ − u − κ²Δu = 0` on the disc with `u = s` on its rim.
//!
//! For s = 1 it is `u = 1`. With falling s the state keeps `u ≈ 1` inside with a layer at the rim, until it ceases to
//! exist before s reaches −1 by far; below that only `u ≈ −1` is left inside.

use std::path::Path;
use std::process::Command;

const SCENE: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
traction = 0.0
peclet = 1.0
coherence = 0.2
elasticity = 0.0
alignment = 0.0

[mesh]
shape = "disc"
radius = 1.0
h = 0.4

[boundary.wall]
velocity = { dirichlet = ["0", "0"] }
polarity = { dirichlet = [1.0, "0"] }

[initial]
polarity = ["1", "0"]

[time]
scheme = "bdf1"
step = 0.1
end = 1.0

[steady]
want = "any"
eigenvalues = 0
"#;

/// Runs a study of the rim's values; the columns `status`, `branch`, `distance` and `said`.
fn rim(root: &Path, values: &str, more: &str) -> Vec<[String; 4]> {
    std::fs::write(root.join("disc.toml"), SCENE).unwrap();
    let text = format!(
        "scene = \"disc.toml\"\nwarm_start = true\nvary = {{ \"boundary.wall.polarity.dirichlet.0\" = {values} }}\n\
         {more}"
    );
    std::fs::write(root.join("rim.toml"), text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_monolayer"));
    let output = command.args(["study", "rim.toml", "--out", "out"]).current_dir(root).output().unwrap();
    println!("{}", String::from_utf8_lossy(&output.stderr));
    let mut reader = csv::Reader::from_path(root.join("out/results.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let at =
        ["status", "branch", "distance", "said"].map(|name| header.iter().position(|other| other == name).unwrap());
    reader.records().map(|row| at.map(|k| row.as_ref().unwrap()[k].to_owned())).collect()
}

#[test]
fn a_branch_is_followed_and_its_end_is_told() {
    let root = tempfile::tempdir().unwrap();
    let rows = rim(root.path(), "[1.0, 0.9, 0.0, -2.0, -1.9]", "");
    assert!(rows.iter().all(|row| row[0] == "finished"), "{rows:?}");
    let distance = |k: usize| rows[k][2].parse::<f64>().unwrap();
    assert_eq!((rows[0][1].as_str(), rows[0][2].as_str()), ("start", ""));
    assert!(rows[1][1] == "same" && distance(1) < 0.2 && distance(1) > 1e-3, "{rows:?}");
    assert!(!root.path().join("out/02/steps").exists());
    // far, but on the same branch: steps in between say so
    assert!(rows[2][1] == "same" && distance(2) > 0.2 && root.path().join("out/03/steps/01").exists(), "{rows:?}");
    assert!(rows[3][1] == "changed" && distance(3) > 1.0 && rows[3][3].contains("belong"), "{rows:?}");
    assert!(rows[4][1] == "same" && distance(4) < 0.2, "{rows:?}");
}

#[test]
fn a_neighbour_that_failed_is_not_followed() {
    let root = tempfile::tempdir().unwrap();
    let rows = rim(root.path(), "[0.5, 0.4]", "set = { \"steady.max_steps\" = 1, \"steady.march\" = 0.0 }\n");
    assert!(rows[1][3].contains("run 01 left no state to start from"), "{rows:?}");
    let rows = rows.iter().map(|row| (row[0].as_str(), row[1].as_str())).collect::<Vec<_>>();
    assert_eq!(rows[1].1, "start", "{rows:?}");
}
