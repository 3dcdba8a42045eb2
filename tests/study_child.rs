//! A scene in a process of its own: what it leaves, how it is stopped, and what is said of one that dies.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use monolayer::scene::{Scene, SceneSource};
use monolayer::study::child::{Ended, Job, run};

/// The square with other values, resolved.
fn scene(sets: &[(&str, &str)]) -> String {
    let mut source = SceneSource::read(Path::new("studies/mms/square.toml")).unwrap();
    for (key, value) in [("mesh.n", "2"), ("time.step", "0.125"), ("time.end", "0.25")].iter().chain(sets) {
        source.set(key, value).unwrap();
    }
    Scene::check(source).unwrap().resolved_toml()
}

fn job<'a>(scene: &'a str, out: PathBuf) -> Job<'a> {
    let program = Path::new(env!("CARGO_BIN_EXE_monolayer"));
    Job { program, scene, out, threads: 1, resume: false, memory: None, verbose: false, lock: None }
}

fn ends(job: Job) -> Ended {
    run(job, &AtomicBool::new(false), &|_| ()).unwrap()
}

#[test]
fn the_summary_comes_back_with_errors_and_notes() {
    let root = tempfile::tempdir().unwrap();
    let text = scene(&[("model.coherence", "0.01")]);
    let ended = ends(job(&text, root.path().join("a")));
    assert!(ended.status.success(), "{ended:?}");
    let summary = ended.summary.unwrap();
    assert_eq!((summary.status.as_str(), summary.counts.steps, summary.mesh.cells), ("finished", 2, 8));
    assert!(summary.error("velocity", "L2(L2)").is_some_and(|e| e > 0.0 && e < 1.0), "{:?}", summary.errors);
    assert!(summary.said.iter().any(|note| note.contains("coherence length 0.01")), "{:?}", summary.said);
    assert_eq!(summary.threads, 1);
}

#[test]
fn a_scene_that_cannot_be_run_gives_its_reason() {
    let root = tempfile::tempdir().unwrap();
    let text = scene(&[("exact.velocity", "[\"x\", 0]")]);
    let ended = ends(job(&text, root.path().join("a")));
    assert_eq!((ended.status.code(), &ended.summary), (Some(1), &None));
    assert!(ended.reason().starts_with("a/scene.toml") && ended.reason().contains("div v = 1"), "{}", ended.reason());
    // no memory at all
    let text = scene(&[]);
    let ended = ends(Job { memory: Some(1e6), ..job(&text, root.path().join("b")) });
    assert!(ended.reason().contains("does not fit into memory"), "{}", ended.reason());
}

#[test]
fn an_interrupt_leaves_a_checkpoint_that_goes_on_with_the_same_errors() {
    let root = tempfile::tempdir().unwrap();
    let text = scene(&[("time.step", "0.004"), ("mesh.n", "3"), ("model.coherence", "0.01")]);
    let whole = ends(job(&text, root.path().join("whole"))).summary.unwrap();
    let out = root.path().join("cut");
    let interrupt = AtomicBool::new(false);
    let ended = std::thread::scope(|scope| {
        scope.spawn(|| {
            let begin = std::time::Instant::now();
            let history = out.join("history.csv");
            while std::fs::read_to_string(&history).map_or(0, |text| text.lines().count()) < 10 {
                assert!(begin.elapsed().as_secs() < 60, "the run should have begun");
                std::thread::sleep(std::time::Duration::from_millis(2));
            }
            interrupt.store(true, Ordering::Relaxed);
        });
        run(job(&text, out.clone()), &interrupt, &|_| ()).unwrap()
    });
    assert_eq!(ended.status.code(), Some(130), "{ended:?}");
    let cut = ended.summary.unwrap();
    assert_eq!(cut.status, "interrupted");
    assert!(cut.counts.steps < whole.counts.steps, "it should have been stopped before its end");
    let rest = ends(Job { resume: true, ..job(&text, out) }).summary.unwrap();
    assert_eq!((rest.counts, &rest.errors, &rest.said), (whole.counts, &whole.errors, &whole.said));
}

#[cfg(unix)]
#[test]
fn a_process_that_dies_is_told_of_by_its_last_words() {
    use std::os::unix::fs::PermissionsExt;
    let root = tempfile::tempdir().unwrap();
    let program = root.path().join("dying");
    std::fs::write(&program, "#!/bin/sh\necho out of breath >&2\nkill -9 $$\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let ended = ends(Job { program: &program, ..job("", root.path().join("a")) });
    assert!(ended.was_killed() && ended.summary.is_none());
    let reason = ended.reason();
    assert!(reason.contains("signal: 9") && reason.contains("out of breath") && reason.contains("hint"), "{reason}");
}
