//! What is wrong with a comparison is told with file, line, value, rule and hint.

use std::path::Path;

use monolayer::study::compare::{CompareStudy, compare};

use crate::common::{program, strip};

const GOOD: &str = "x,y,t,vx,vy\n2,2,0,1,0\n-2,2,0,1,0\n2,-2,1,1,0\n-2,-2,1,1,0\n";
const KEYS: &str = "data = \"t.csv\"\nbox = [[-4, -3], [4, 3]]\nbins = [4, 4]\n";

/// The message for a table and keys.
fn message(folder: &Path, table: &str, keys: &str) -> Result<(), String> {
    std::fs::write(folder.join("t.csv"), table).unwrap();
    std::fs::write(folder.join("c.toml"), keys).unwrap();
    let study = CompareStudy::read(&folder.join("c.toml"), &[]).map_err(|error| error.to_string())?;
    compare(&study).map(|_| ()).map_err(|error| error.to_string())
}

#[track_caller]
fn fails(table: &str, keys: &str, parts: &[&str]) {
    let temporary = tempfile::tempdir().unwrap();
    let error = message(temporary.path(), table, keys).expect_err("should fail");
    println!("{error}");
    for part in parts.iter().chain(&["hint"]) {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

#[test]
fn the_good_ones_are_good() {
    let temporary = tempfile::tempdir().unwrap();
    message(temporary.path(), GOOD, KEYS).unwrap();
    let wide = KEYS.replace("bins = [4, 4]", "bins = [2, 4]");
    message(temporary.path(), GOOD, &format!("{wide}center = [0, 0]\nwindow = 2\nfilter = 0\n")).unwrap();
    message(temporary.path(), &format!("\u{feff}{}", GOOD.replace('\n', "\r\n")), KEYS).unwrap();
}

#[test]
fn a_bad_table_is_told_with_its_line() {
    fails(&GOOD.replace("2,-2,1,1,0", "2,-2,1,inf,0"), KEYS, &["t.csv, line 4", "`vx` = inf", "finite number"]);
    fails(&GOOD.replace("2,-2,1,1,0", "2,-2,1,1 0,0"), KEYS, &["t.csv, line 4", "`vx` = 1 0"]);
    fails(&GOOD.replace("2,-2,1,1,0", "2,south,1,1,0"), KEYS, &["t.csv, line 4", "`y` = south"]);
    fails(&GOOD.replace("2,-2,1,1,0", "2,-2,1,1"), KEYS, &["t.csv, line 4", "has 4 values", "5 columns"]);
    fails(
        &GOOD.replace("vx,", "v_x,"),
        KEYS,
        &["t.csv, line 1", "no column `vx`", "did you mean `v_x`?", "columns.vx"],
    );
    let commas = format!("{KEYS}separator = \",\"\n");
    fails(&GOOD.replace(',', ";"), &commas, &["t.csv, line 1", "`separator` = \",\"", "one column: x;y;t;vx;vy"]);
    fails(&GOOD.replace("x,y,t", "x,x,t"), KEYS, &["line 1", "2 columns have the name `x`"]);
    fails("x,y,t,vx,vy\n", KEYS, &["t.csv", "has no rows"]);
    fails("", KEYS, &["t.csv", "no column"]);
    fails(&GOOD.replace(",1,1,0", ",0,1,0"), KEYS, &["t.csv", "1 frame", "at least 2"]);
    fails(GOOD, &format!("{KEYS}frames = 50\n"), &["t.csv", "1 frame", "`frames` = 50"]);
    fails(GOOD, &format!("{KEYS}length = 0.01\n"), &["no row lies in `box`", "(-200.0000, -200.0000)", "length"]);
}

#[test]
fn a_bad_key_is_told_with_its_line() {
    let with = |line: &str| format!("{KEYS}{line}\n");
    fails(GOOD, &with("window = -2.5"), &["c.toml, line 4", "`window` = -2.5", "greater than 0"]);
    fails(GOOD, &with("window = 5"), &["line 4", "`window` = 5.0", "must lie in the box"]);
    fails(GOOD, &with("window = 0.5\nobstacle = 3"), &["line 4", "`window`", "x₁ = -0.5"]);
    fails(GOOD, &KEYS.replace("[[-4, -3], [4, 3]]", "[[4, -3], [-4, 3]]"), &["line 2", "`box`", "left of"]);
    fails(GOOD, &KEYS.replace("[[-4, -3], [4, 3]]", "[[-4, 3], [4, -3]]"), &["line 2", "`box`", "below"]);
    fails(GOOD, &KEYS.replace("[[-4, -3], [4, 3]]", "[-4, 4]"), &["line 2", "box"]);
    fails(GOOD, &KEYS.replace("bins = [4, 4]", "bins = [1, 4]"), &["line 3", "`bins` = [1, 4]", "at least 2"]);
    fails(GOOD, &KEYS.replace("bins = [4, 4]", "bins = [-4, 4]"), &["line 3", "bins", "not negative"]);
    fails(GOOD, &with("length = 0"), &["line 4", "`length`", "greater than 0"]);
    for key in ["length", "speed", "pixel", "frame", "frames", "window"] {
        for value in ["0", "-1", "nan", "inf", "1e300", "1e-300"] {
            fails(GOOD, &with(&format!("{key} = {value}")), &["c.toml, line 4", &format!("`{key}` = "), "must "]);
        }
    }
    for (key, value) in [("filter", "1e300"), ("obstacle", "1e-300"), ("centre", "[1e300, 0]")] {
        fails(GOOD, &with(&format!("{key} = {value}")), &["c.toml, line 4", &format!("`{key}` = "), "1e30"]);
    }
    let choices = ["`separator` = \"x\"", "not among the choices;", "the choices are ", "\"\\t\"", "\";\"", "space"];
    fails(GOOD, &with("separator = \"x\""), &choices);
    fails(GOOD, &with("filter = -1"), &["line 4", "`filter`", "0 or greater"]);
    fails(GOOD, &with("filtr = 1"), &["line 4", "no key `filtr`", "did you mean `filter`?"]);
    fails(GOOD, &with("columns = { x = \"y\" }"), &["line 4", "columns.y", "`columns.x` is the same column"]);
    fails(GOOD, &with("run = \"nowhere\""), &["line 4", "`run` = \"nowhere\"", "no such folder"]);
    fails(GOOD, &with("run = \".\""), &["line 4", "no checkpoint.bin"]);
    fails(GOOD, &KEYS.replace("t.csv", "u.csv"), &["line 1", "`data` = \"u.csv\"", "no such file"]);
    fails(GOOD, "data = \"t.csv\"\n", &["c.toml", "`box` is missing", "disc radii"]);
    fails(GOOD, "bins = [4, 4]\n", &["c.toml", "`data` is missing"]);
    fails(GOOD, "[model]\nkind = \"incompressible\"\n", &["a scene", "monolayer run"]);
}

/// Rows lie beside the disc, and the middles of their bins in it.
#[test]
fn bins_outside_of_the_domain_are_told() {
    let keys = "data = \"t.csv\"\nbox = [[-1, -1], [1, 1]]\nbins = [2, 2]\n";
    let keys = format!("{keys}run = '{}'\n", strip().display());
    fails(&GOOD.replace('2', "0.95"), &keys, &["c.toml, line 4", "no bin with cells lies in the domain of the run"]);
}

/// A wrong unit puts most rows out of the domain: that is said with both boxes, and refused where it is all of them.
#[test]
fn rows_outside_of_the_mesh_are_told() {
    let temporary = tempfile::tempdir().unwrap();
    let box_of = KEYS.replace("[[-4, -3], [4, 3]]", "[[-50, -50], [50, 50]]");
    let keys = format!("{box_of}run = '{}'\n", strip().display());
    let noted = |table: &str, keys: &str| {
        std::fs::write(temporary.path().join("t.csv"), table).unwrap();
        std::fs::write(temporary.path().join("c.toml"), keys).unwrap();
        let study = CompareStudy::read(&temporary.path().join("c.toml"), &[]).unwrap();
        compare(&study).unwrap_or_else(|error| panic!("{error}")).tracks.notes.join("; ")
    };
    assert_eq!(noted(GOOD, &keys), "");
    // three of four
    let most = GOOD.replace("-2,2,0", "-42,2,0").replace("2,-2,1", "42,-2,1").replace("-2,-2,1", "-2,-42,1");
    let note = noted(&most, &keys);
    for part in
        ["most rows lie outside of the mesh of the run (3 of 4", "between (-42.0000,", "and (8.0000,", "`length`"]
    {
        assert!(note.contains(part), "`{part}` is not in: {note}");
    }
    let note = noted(&most, &KEYS.replace("bins = [4, 4]", "bins = [4, 4]\n"));
    assert!(note.contains("most rows lie outside of `box` (3 of 4"), "{note}");
}

#[test]
fn a_run_elsewhere_and_wrong_options_are_told() {
    let far = GOOD.replace('2', "42");
    let keys =
        format!("{}run = '{}'\n", KEYS.replace("[[-4, -3], [4, 3]]", "[[40, -43], [44, 43]]"), strip().display());
    fails(
        &far,
        &keys,
        &["c.toml, line 4", "no row lies in the mesh of the run (4 of 4", "between (-42.0000, -42.0000)"],
    );
    let temporary = tempfile::tempdir().unwrap();
    let says = |arguments: &[&str], parts: &[&str]| {
        let output = program(&[&["compare"], arguments].concat(), temporary.path());
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && !error.contains("panicked"), "{arguments:?}");
        parts.iter().for_each(|part| assert!(error.contains(part), "`{part}` is not in: {error}"));
    };
    let run = strip().to_str().unwrap();
    says(&[], &["FILE"]);
    says(&["nothing.toml"], &["nothing.toml", "hint", "comparison"]);
    says(&["--synthesize", "nowhere"], &["nowhere", "hint"]);
    says(&["--synthesize", run, "--noise=-1"], &["--noise", "0 or greater"]);
    says(&["--synthesize", run, "--cells", "0"], &["--cells", "at least 1"]);
    says(&["--synthesize", run, "--box", "1,2,3"], &["four numbers"]);
    says(&["--synthesize", run, "--box", "1,2,0,3"], &["X0 < X1"]);
    says(&["--synthesize", run, "--box", "100,0,101,1"], &["misses the run's domain"]);
    says(&["c.toml", "--cells", "5"], &["--cells", "cannot be used with"]);
    for command in ["run", "study", "order", "branch"] {
        std::fs::write(temporary.path().join("c.toml"), KEYS).unwrap();
        let output = program(&[command, "c.toml"], temporary.path());
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(error.contains("monolayer compare"), "{command}: {error}");
    }
}
