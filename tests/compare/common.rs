//! A run to compare with, and tables made from it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use monolayer::study::compare::{CompareStudy, Comparison, RunVelocity, Synthesis, compare, synthesize};

pub fn program(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_monolayer")).args(arguments).current_dir(folder).output().unwrap()
}

/// The folder of a run of the coarse strip, two steps long, made once.
pub fn strip() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| shared(Path::new(env!("CARGO_TARGET_TMPDIR"))))
}

/// The run in `root`, of this program and these tests. They may each be in a process of their own: whoever finds no run
/// makes one aside and moves it into place as a whole, and where somebody was faster, takes that one.
fn shared(root: &Path) -> PathBuf {
    let folder = root.join(format!("compare-strip-{:x}", built()));
    if folder.is_dir() {
        return folder;
    }
    let aside = tempfile::tempdir_in(root).unwrap();
    let made = aside.path().join("strip");
    make_strip(&made);
    // a folder that is not empty is never replaced
    if let Err(error) = std::fs::rename(&made, &folder) {
        assert!(folder.is_dir(), "{}: {error}", folder.display());
    }
    folder
}

/// When the program and these tests were built, whichever was later, in nanoseconds.
fn built() -> u128 {
    let time = |path: &Path| std::fs::metadata(path).and_then(|file| file.modified()).unwrap();
    let tests = std::env::current_exe().unwrap();
    let last = time(Path::new(env!("CARGO_BIN_EXE_monolayer"))).max(time(&tests));
    last.duration_since(std::time::UNIX_EPOCH).unwrap().as_nanos()
}

fn make_strip(folder: &Path) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/strip.toml");
    let mut arguments = vec!["run", scene.to_str().unwrap(), "-q", "--out", folder.to_str().unwrap()];
    let sets = [
        "mesh.length=[-6, 8]",
        "mesh.h=2.5",
        "mesh.h_disc=0.6",
        "mesh.grading=0.3",
        "time.max_steps=2",
        "time.stop=",
        "output=[]",
    ];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    let output = program(&arguments, Path::new("."));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_run_that_all_processes_share_is_made_whole_and_once() {
    let root = tempfile::tempdir().unwrap();
    let found: Vec<PathBuf> = std::thread::scope(|scope| {
        let threads = [0; 3].map(|_| scope.spawn(|| shared(root.path())));
        threads.map(|thread| thread.join().unwrap()).into()
    });
    assert!(found.iter().all(|folder| *folder == found[0] && folder.join("checkpoint.bin").is_file()), "{found:?}");
    let left: Vec<_> = std::fs::read_dir(root.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(left, found[..1], "nothing else is left");
    let made = |folder: &Path| std::fs::metadata(folder.join("checkpoint.bin")).unwrap().modified().unwrap();
    let first = made(&found[0]);
    assert_eq!((shared(root.path()), made(&found[0])), (found[0].clone(), first));
}

/// Cells in a frame of a table.
pub const CELLS: usize = 500;

/// A table of the strip's velocity in `folder`, and its path.
pub fn table(folder: &Path, frames: usize, noise: f64, trend: f64) -> PathBuf {
    let path = folder.join(format!("{frames}-{noise}-{trend}.csv"));
    let synthesis = Synthesis { cells: CELLS, frames, noise, trend, seed: 5, view: None };
    synthesize(&RunVelocity::read(strip()).unwrap(), &synthesis, &path).unwrap();
    path
}

/// A study of a table with more keys, in the table's folder.
pub fn study(table: &Path, keys: &str) -> CompareStudy {
    let file = table.with_extension("toml");
    let data = table.file_name().unwrap().to_str().unwrap();
    let text = format!("data = \"{data}\"\nrun = '{}'\n{keys}", strip().display());
    std::fs::write(&file, text).unwrap();
    CompareStudy::read(&file, &[]).unwrap_or_else(|error| panic!("{error}"))
}

pub fn compared(table: &Path, keys: &str) -> Comparison {
    compare(&study(table, keys)).unwrap_or_else(|error| panic!("{error}"))
}

pub fn reading(found: &Comparison, name: &str) -> (f64, f64) {
    let reading = found.readings.iter().find(|reading| reading.name == name).unwrap();
    (reading.value, reading.error)
}
