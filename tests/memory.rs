//! The memory of a run, known before it is taken: estimate and truth, refusals, what `check` says.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

use monolayer::model::lagged::Structure;
use monolayer::run::domain::build_mesh;
use monolayer::run::memory::{MIB, Unknowns, Work, memory_of};
use monolayer::run::report::report_within;
use monolayer::run::setup::describe;
use monolayer::run::{RunError, Setup};
use monolayer::scene::{Scene, SceneSource};
use monolayer::solve::multifrontal::Precision;
use monolayer::solve::sparse::factor_bound;

/// A strip of some 600 cells.
const COARSE: [(&str, &str); 3] = [("mesh.h", "2.0"), ("mesh.h_disc", "0.75"), ("time.max_steps", "2")];

fn strip_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/strip/strip.toml")
}

fn strip(sets: &[(&str, &str)]) -> Scene {
    let mut source = SceneSource::read(&strip_file()).expect("the study can be read");
    for (key, value) in COARSE.iter().chain(sets) {
        source.set(key, value).expect("the study has this key");
    }
    Scene::check(source).expect("the scene is good")
}

fn unknowns(scene: &Scene) -> Unknowns {
    let mesh = Arc::new(build_mesh(scene).expect("the mesh can be built"));
    Unknowns::new(scene, &mesh, &describe(scene, &mesh))
}

fn needed(scene: &Scene) -> f64 {
    report_within(scene, None).expect("the scene is good").memory_mib
}

/// The program on the coarse strip in a folder of its own.
fn program(folder: &Path, command: &str, memory: Option<&str>, sets: &[(&str, &str)], more: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_monolayer"));
    program.current_dir(folder).arg(command).arg(strip_file()).args(more).env_remove("MONOLAYER_MEMORY");
    for (key, value) in COARSE.iter().chain(sets) {
        program.args(["--set", &format!("{key}={value}")]);
    }
    if let Some(memory) = memory {
        program.env("MONOLAYER_MEMORY", memory);
    }
    program.output().expect("the program starts")
}

fn error_of(output: &Output) -> String {
    let error = String::from_utf8(output.stderr.clone()).expect("text");
    assert_eq!((output.status.code(), error.lines().count()), (Some(1), 1), "{error}");
    error
}

#[test]
fn the_bound_on_factors_is_exact_where_it_can_be_counted_by_hand() {
    let n = 20;
    let dense: Vec<Vec<usize>> = vec![(0..n).collect(); n];
    assert_eq!(factor_bound(&dense), n * (n + 1) / 2);
    let diagonal: Vec<Vec<usize>> = (0..n).map(|i| vec![i]).collect();
    assert_eq!(factor_bound(&diagonal), n);
    // one full row and column: AᵀA is full in every order
    let arrow: Vec<Vec<usize>> = (0..n).map(|i| if i == 0 { (0..n).collect() } else { vec![0, i] }).collect();
    assert_eq!(factor_bound(&arrow), n * (n + 1) / 2);
    let blocks: Vec<Vec<usize>> = (0..n).map(|i| (i / 5 * 5..i / 5 * 5 + 5).collect()).collect();
    assert_eq!(factor_bound(&blocks), 4 * 15);
    assert_eq!(factor_bound(&[]), 0);
}

#[test]
fn a_run_that_does_not_fit_is_refused_before_anything_is_assembled() {
    for (sets, gentler) in [(&[("coupling.kind", "newton")][..], true), (&[], false)] {
        let scene = strip(sets);
        let need = needed(&scene);
        let error = Setup::within(&scene, Some(0.99 * need * MIB)).expect_err("one percent is missing");
        let RunError::Memory { needed, available, .. } = &error else { panic!("{error}") };
        assert_eq!((*needed, *available), (need, 0.99 * need));
        let text = error.to_string();
        for part in ["strip.toml", "does not fit", &format!("about {need:.0} MiB"), "hint: ", "coarser mesh", "space.k"]
        {
            assert!(text.contains(part), "`{part}` is not in: {text}");
        }
        assert_eq!(text.contains("coupling.kind = \"anderson\""), gentler, "{text}");
        for enough in [Some(1.01 * need * MIB), None] {
            Setup::within(&scene, enough).expect("it fits");
        }
    }
}

#[test]
fn the_estimate_grows_with_the_mesh_the_degree_the_coupling_and_the_search() {
    // pictures take the same, whatever the scene
    let bare = |sets: &[(&str, &str)]| needed(&strip(&[&[("output", "[]"), ("time.stop", "")], sets].concat()));
    let anderson = bare(&[]);
    let newton = bare(&[("coupling.kind", "newton")]);
    assert!(newton > 2.0 * anderson, "{newton} {anderson}");
    assert!(bare(&[("space.k", "2")]) > 2.0 * anderson);
    assert!(bare(&[("mesh.h_disc", "0.3")]) > 1.2 * anderson);
    let energy = [("coupling.kind", "newton"), ("model.elastic_force", "energy-consistent")];
    assert!(bare(&energy) > newton);
    let drawn = needed(&strip(&[]));
    assert!((20.0..40.0).contains(&(drawn - anderson)), "{drawn} {anderson}");
}

#[test]
fn vectors_and_factors_are_counted_one_by_one() {
    let scene = strip(&[("initial.polarity", "[\"1\", \"0\"]")]);
    let unknowns = unknowns(&scene);
    let layout = unknowns.layout();
    let structure = Structure::new("coupled", &layout).expect("a sound structure");
    for precision in [Precision::Single, Precision::Double] {
        let with = |vectors| memory_of(&scene, &layout, Work::Coupled { structure: &structure, precision, vectors });
        let more = (with(200) - with(100)) / (100 * 8 * unknowns.polarity.dof_count()) as f64;
        assert!((1.0..1.1).contains(&more), "{more}");
        let room = |threads| structure.room(threads, precision);
        assert!(with(0) > (structure.bytes(precision) + room(1)) as f64);
        assert!(room(2) >= room(1) && room(1) > 0);
    }
    assert_eq!(structure.bytes(Precision::Double), 2 * structure.bytes(Precision::Single));
}

#[test]
fn the_structure_that_was_counted_is_the_models() {
    let disc = "shape = \"disc\"\nh = 0.4";
    let closed = format!(
        "[model]\nkind = \"incompressible\"\nbeta = 0.5\npeclet = 1.0\ncoherence = 0.3\n[mesh]\n{disc}\n\
         [boundary.wall]\n\
         velocity = \"slip\"\npolarity = \"neumann\"\n[initial]\npolarity = [\"1\", \"x\"]\n[time]\nscheme = \"bdf1\"\n\
         step = 0.1\nend = 1.0\n[coupling]\nkind = \"newton\"\n"
    );
    let closed = Scene::parse(&closed, Path::new("closed.toml")).expect("a good scene");
    for scene in [strip(&[("coupling.kind", "newton")]), closed] {
        let setup = Setup::within(&scene, None).expect("it builds");
        let own = Structure::new("coupled", &setup.model.layout()).expect("a sound structure");
        let kept = setup.model.structure().expect("a sound structure");
        assert_eq!(kept.symbolic.unknowns(), own.symbolic.unknowns());
        let bytes = |structure: &Structure| {
            let precision = structure.precision();
            (structure.bytes(precision), structure.room(3, precision))
        };
        assert_eq!(bytes(kept), bytes(&own));
        assert!(Arc::ptr_eq(&kept.symbolic, &setup.model.structure().expect("the same").symbolic), "found once");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn the_estimate_is_near_the_largest_resident_memory() {
    let json = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).expect("JSON");
    for coupling in ["anderson", "newton"] {
        let folder = tempfile::tempdir().expect("a folder");
        let sets = [("coupling.kind", coupling)];
        let said = program(folder.path(), "check", None, &sets, &["--json"]);
        let estimate = json(&said.stdout)["memory_mib"].as_f64().expect("a number");
        let run = program(folder.path(), "run", None, &sets, &["-q", "--out", "results"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let summary = std::fs::read(folder.path().join("results/summary.json")).expect("a summary");
        let peak = json(&summary)["peak_memory_mib"].as_f64().expect("a number");
        // allocators differ: what is fitted within 15 percent on one system is not quite so on another
        assert!((0.75..1.35).contains(&(estimate / peak)), "{coupling}: {estimate} MiB instead of {peak}");
    }
}

/// Cuts are made row by row: a million points take no more than a few.
#[cfg(target_os = "linux")]
#[test]
fn points_of_cuts_are_not_held() {
    let json = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).expect("JSON");
    let folder = tempfile::tempdir().expect("a folder");
    let cut = "[{ cuts = [{ name = \"long\", from = [-5.0, 2.0], to = [5.0, 2.0], points = 1000000 }] }]";
    let sets = [("output", cut), ("time.stop", ""), ("coupling.kind", "anderson")];
    let said = program(folder.path(), "check", None, &sets, &["--json"]);
    let estimate = json(&said.stdout)["memory_mib"].as_f64().expect("a number");
    let run = program(folder.path(), "run", None, &sets, &["-q", "--out", "results"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let summary = std::fs::read(folder.path().join("results/summary.json")).expect("a summary");
    let peak = json(&summary)["peak_memory_mib"].as_f64().expect("a number");
    assert!((0.7..1.4).contains(&(estimate / peak)), "{estimate} MiB instead of {peak}");
    let table = std::fs::read_to_string(folder.path().join("results/cuts/long.csv")).expect("a table");
    assert_eq!(table.lines().count(), 1_000_001);
    let mut last = -1.0;
    for row in table.lines().skip(1) {
        let s: f64 = row.split(',').next().and_then(|s| s.parse().ok()).expect("a number");
        assert!(s > last, "rows are in their order: {s} after {last}");
        last = s;
    }
}

#[test]
fn studies_are_refused_for_memory_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = strip_file().display().to_string();
    let study = format!(
        "scene = '{scene}'\nset = {{ \"mesh.h\" = 2.0, \"time.max_steps\" = 2 }}\n\
         vary = {{ \"mesh.h_disc\" = [0.75, 0.6] }}\n"
    );
    std::fs::write(folder.path().join("study.toml"), study).expect("written");
    let check = |memory: &str| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_monolayer"));
        program.current_dir(folder.path()).args(["check", "study.toml", "--json"]).env("MONOLAYER_MEMORY", memory);
        program.output().expect("the program starts")
    };
    let small = check("20");
    let report: serde_json::Value = serde_json::from_slice(&small.stdout).expect("JSON");
    let error = String::from_utf8_lossy(&small.stderr);
    assert_eq!((small.status.code(), report["refused"].as_array().map(Vec::len)), (Some(1), Some(2)), "{error}");
    assert_eq!(error.matches("does not fit into memory").count(), 2, "{error}");
    assert!(report["memory_mib"].as_f64().is_some_and(|mib| mib > 20.0), "the amounts are told nonetheless");
    assert!(check("100000").status.success());
}

#[test]
fn the_program_refuses_and_check_tells() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = error_of(&program(folder.path(), "run", Some("20"), &[], &["--out", "results"]));
    assert!(error.contains("strip.toml: the run does not fit") && error.contains("at most the 20 MiB"), "{error}");
    assert!(!folder.path().join("results").exists(), "nothing was computed, so nothing is to be written");

    let check = |memory| program(folder.path(), "check", Some(memory), &[], &[]);
    let (small, large) = (check("20"), check("100000"));
    assert!(large.status.success());
    let text = |output: &Output| String::from_utf8(output.stdout.clone()).expect("text");
    assert!(text(&small).contains("memory  about") && !text(&small).contains("does not fit"), "{}", text(&small));
    // in the words of the run
    assert_eq!(error_of(&small), error);
    assert!(!text(&large).contains("does not fit"), "{}", text(&large));

    for wrong in ["much", "-5", "0", "NaN"] {
        let error = error_of(&program(folder.path(), "check", Some(wrong), &[], &[]));
        assert!(error.contains(&format!("MONOLAYER_MEMORY = `{wrong}`: must be")) && error.contains("hint"), "{error}");
    }
}

#[test]
fn a_mesh_that_cannot_fit_is_refused_without_being_built() {
    // 4.5 million cells, some 2.5 TB
    let folder = tempfile::tempdir().expect("a folder");
    let square = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/mms/square.toml"))
        .expect("a scene");
    std::fs::write(folder.path().join("square.toml"), square).expect("written");
    let begin = std::time::Instant::now();
    let program = |command: &str, more: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_monolayer"));
        program.current_dir(folder.path()).args([command, "square.toml", "--set", "mesh.n=1500"]).args(more);
        program.env("MONOLAYER_MEMORY", "24000").output().expect("the program starts")
    };
    let error = error_of(&program("run", &["-q", "--out", "results"]));
    assert!(error.contains("does not fit into memory") && error.contains("24000 MiB"), "{error}");
    let said = program("check", &["--json"]);
    assert_eq!(error_of(&said), error);
    let report: serde_json::Value = serde_json::from_slice(&said.stdout).expect("JSON");
    assert_eq!(error, format!("error: {}\n", report["refused"][0].as_str().expect("a reason")));
    assert_eq!((&report["mesh"]["cells"], &report["mesh"]["expected"]), (&4_500_000.into(), &true.into()));
    let vertices = report["mesh"]["vertices"].as_f64().expect("a number");
    assert!((vertices / (1501.0 * 1501.0) - 1.0).abs() < 0.01, "{vertices}");
    assert!(report["memory_mib"].as_f64().is_some_and(|mib| mib > 1e5));
    // building the mesh alone takes longer on any machine
    assert!(begin.elapsed().as_secs_f64() < 30.0, "{:?}", begin.elapsed());
}

#[test]
fn what_a_large_mesh_takes_is_judged_by_smaller_ones() {
    // 5762 cells of the strip: counted here, judged by the program
    for coupling in ["newton", "anderson"] {
        let scene = strip(&[("mesh.h", "0.8"), ("mesh.h_disc", "0.1"), ("coupling.kind", coupling)]);
        let expected = scene.mesh.expected().expect("a generated mesh");
        let counted = unknowns(&scene);
        let cells = counted.velocity.mesh.cells.len() as f64;
        assert!((expected / cells - 1.0).abs() < 0.1, "{expected} cells instead of {cells}");
        let exact = monolayer::run::memory::need(&scene, &counted.layout()).expect("a sound structure").bytes;
        let judged = monolayer::run::memory::samples(&scene, cells).expect("two meshes").at(cells);
        assert!((judged.bytes / exact - 1.0).abs() < 0.15, "{coupling}: {} instead of {exact}", judged.bytes);
        for (judged, exact) in judged.unknowns.iter().zip(counted.counts()) {
            assert!((judged / exact - 1.0).abs() < 0.03, "{judged} unknowns instead of {exact}");
        }
    }
}

#[test]
fn results_are_counted_before_they_are_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let sets = [
        ("output", "[{ fields = [\"velocity\", \"polarity\"], every = { steps = 1 } }, { cuts = [\"axis-1\"] }]"),
        ("time.stop", ""),
        ("coupling.kind", "anderson"),
    ];
    let said = program(folder.path(), "check", None, &sets, &["--json"]);
    let report: serde_json::Value = serde_json::from_slice(&said.stdout).expect("JSON");
    let told = report["disk_mib"].as_f64().expect("a number");
    let run = program(folder.path(), "run", None, &sets, &["-q", "--out", "results"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let size = |path: &Path| std::fs::metadata(path).expect("a file").len() as f64;
    let fields = std::fs::read_dir(folder.path().join("results/fields")).expect("fields");
    let fields: f64 = fields.map(|entry| size(&entry.expect("a file").path())).sum();
    let written = (fields + size(&folder.path().join("results/checkpoint.bin"))) / MIB;
    // how well numbers are packed depends on them
    assert!((0.7..2.5).contains(&(told / written)), "{told} MiB told, {written} written");
}
