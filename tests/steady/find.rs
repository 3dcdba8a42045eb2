//! The search: what it finds, in which order it tries, and how it is stopped.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::*;
use monolayer::measure::errors::{self, History, Norm, errors};
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::output::progress::Verbosity;
use monolayer::run::{self, Ending, Options, Setup};
use monolayer::scene::{Scene, SceneSource};
use monolayer::steady::{Event, Found, Search, SearchSettings, Stability, Stall, Steady, SteadySettings, Way, find};
use monolayer::time::Phases;

static NEVER: AtomicBool = AtomicBool::new(false);

fn search_with<'m>(
    scene: &Scene,
    setup: &'m Setup,
    settings: SteadySettings,
    interrupt: &'m AtomicBool,
    seen: &mut dyn FnMut(Event<'_, 'm>) -> Result<(), Stall>,
) -> Search {
    let start = setup.initial(scene).unwrap();
    let settings = SearchSettings { steady: settings, marching: scene.march() };
    find(&*setup.model, start.values, &settings, interrupt, &mut Phases::default(), seen).unwrap()
}

fn search(scene: &Scene, setup: &Setup) -> Search {
    search_with(scene, setup, scene.steady.unwrap(), &NEVER, &mut |_| Ok(()))
}

#[track_caller]
fn steady(search: &Search) -> &Steady {
    match &search.found {
        Found::Steady(steady) => steady,
        other => panic!("{other:?}: {:?}", search.tries),
    }
}

fn ways(search: &Search) -> Vec<Way> {
    search.tries.iter().map(|attempt| attempt.way).collect()
}

const EXACT: &str = include_str!("../../studies/extremes/steady.toml");

fn exact(sets: &[(&str, &str)]) -> (Scene, Setup) {
    let mut source = SceneSource::parse(EXACT, Path::new("tests/steady")).unwrap();
    for (key, value) in sets.iter().chain(&[("mesh.n", "4"), ("steady", "{ residual = 1e-10, want = \"any\" }")]) {
        source.set(key, value).unwrap();
    }
    let scene = Scene::check(source).unwrap();
    let setup = Setup::new(&scene).unwrap();
    (scene, setup)
}

#[test]
fn exact_fields_are_found_with_the_errors_that_marching_leaves() {
    let (scene, setup) = exact(&[("initial.polarity", "[\"1/2\", \"1/2\"]")]);
    let found = search(&scene, &setup);
    let steady = steady(&found);
    assert!(steady.residuals.total() < 1e-9, "{:?}", steady.residuals);
    let (scene, marched) = exact(&[]);
    let mut march = marched.start(&scene).unwrap();
    while march.residuals().unwrap().total() > 1e-9 {
        assert!(march.t < 200.0, "marching comes to rest");
        march.advance(1e9).unwrap();
    }
    let exact = scene.sources.exact.as_ref().unwrap();
    let mut both = [History::default(), History::default()];
    both[0].add(&errors(&*setup.model, exact, &steady.state, 0.0), 1.0);
    both[1].add(&errors(&*setup.model, exact, &march.state, 0.0), 1.0);
    for field in errors::INCOMPRESSIBLE {
        for norm in Norm::ALL {
            let [by_search, by_marching] = both.each_ref().map(|history| history.error(field, norm));
            near(by_search / by_marching, 1.0, 1e-5, field.name);
        }
        assert!(both[0].error(field, Norm::Square) < 0.5, "{}", field.name);
    }
    assert!(both[0].error(POLARITY, Norm::Square) < 0.02, "the exact state, not another one");
}

#[test]
fn no_polarity_is_kept_or_left_as_the_scene_wants() {
    let square = || Square::new().set("initial.polarity", "[0, 0]").set("model.coherence", "0.4");
    let (scene, setup) = square().set("steady.want", "any").setup();
    let found = search(&scene, &setup);
    let kept = steady(&found);
    assert!(kept.state[POLARITY].values.iter().all(|v| *v == 0.0));
    assert_eq!(kept.spectrum.as_ref().unwrap().stability(), Stability::Unstable);
    assert_eq!(ways(&found), [Way::PseudoTransient]);

    let (scene, setup) = square().setup();
    let mut notes = String::new();
    let found = search_with(&scene, &setup, scene.steady.unwrap(), &NEVER, &mut |event| {
        if let Event::Note(text) = event {
            notes += &text;
        }
        Ok(())
    });
    let left = steady(&found);
    for (cell, xi) in [(0, [0.2, 0.3]), (7, [0.1, 0.6]), (31, [1.0 / 3.0; 2])] {
        near(left.state[POLARITY].vector_at(cell, xi.into()).norm(), 1.0, 1e-8, "|p|");
    }
    assert_eq!(ways(&found)[..2], [Way::PseudoTransient, Way::Departure]);
    assert!(
        notes.contains("on the way, a steady state that is unstable: a disturbance grows at the rate 1.25"),
        "{notes}"
    );
    assert_ne!(left.spectrum.as_ref().unwrap().stability(), Stability::Unstable);
}

#[test]
fn data_that_depend_on_time_are_refused() {
    let refusal = |text: &str, key: &str, value: &str, named: &str| {
        let mut source = SceneSource::parse(text, Path::new("scene.toml")).unwrap();
        source.set("steady", "{}").unwrap();
        source.set(key, value).unwrap();
        let error = Scene::check(source).unwrap_err().to_string();
        let parts =
            [&format!("`{named}` = a formula of t"), "must not depend on t where a steady state", "; hint: take"];
        assert!(parts.iter().all(|part| error.contains(part)) && error.contains("scene.toml"), "{error}");
    };
    refusal(CLOSED, "boundary.left.polarity", "{ dirichlet = [\"cos(t)\", \"0\"] }", "boundary.left.polarity");
    refusal(CLOSED, "boundary.top.velocity", "{ dirichlet = [\"t\", \"0\"] }", "boundary.top.velocity");
    refusal(CLOSED, "boundary.top.velocity", "{ traction = [\"t\", \"0\"] }", "boundary.top.velocity");
    refusal(CLOSED, "source.force", "[\"x\", \"t\"]", "source.force");
    refusal(CLOSED, "source.polarity", "[\"t\", \"0\"]", "source.polarity");
    refusal(EXACT, "exact.pressure", "\"x*t\"", "exact");
}

/// Tissue that flows through a square, with every term of the model.
fn channel(sets: &[(&str, &str)]) -> (Scene, Setup) {
    let square = Square::new()
        .set("mesh.n", "3")
        .set("boundary.left.velocity", "{ dirichlet = [\"1\", \"y/2\"] }")
        .set("boundary.left.polarity", "{ dirichlet = [\"1\", \"y\"] }")
        .set("boundary.right.velocity", "\"traction\"")
        .set("model.traction", "1.0")
        .set("model.active_stress", "0.6")
        .set("model.elasticity", "0.4")
        .set("initial.polarity", "[\"1\", \"sin(9*y)\"]");
    sets.iter().fold(square, |square, (key, value)| square.set(key, value)).setup()
}

#[test]
fn every_way_is_tried_in_its_turn() {
    let (scene, setup) = channel(&[]);
    let direct = search(&scene, &setup);
    let rest = &steady(&direct).state;
    assert_eq!(ways(&direct), [Way::PseudoTransient]);
    assert_eq!(steady(&direct).spectrum.as_ref().unwrap().stability(), Stability::Stable);
    let steps = direct.tries[0].steps;
    assert!(steps > 3, "{steps} steps");

    // one pseudo-step is enough for none of the first three ways
    let one = SteadySettings { max_steps: 1, ..scene.steady.unwrap() };
    let mut notes = Vec::new();
    let found = search_with(&scene, &setup, one, &NEVER, &mut |event| {
        if let Event::Note(text) = event {
            notes.push(text);
        }
        Ok(())
    });
    let all = [Way::PseudoTransient, Way::SmallerSteps, Way::Parameters, Way::Marching];
    assert_eq!(ways(&found), all);
    assert!(found.tries[..3].iter().all(|attempt| attempt.outcome.contains("1 pseudo-steps were not enough")));
    assert!(found.tries[3].outcome.contains("steady at t = "), "{}", found.tries[3].outcome);
    assert!(notes.len() >= 4 && notes[3].contains("marching in time"), "{notes:?}");
    near(
        distance(model_of(&setup), &steady(&found).state[POLARITY], &rest[POLARITY]),
        0.0,
        1e-7,
        "the state by marching",
    );

    // the first way rejects some of its steps: smaller ones come to the end in as many
    let fewer = SteadySettings { max_steps: steps + 1, ..scene.steady.unwrap() };
    let found = search_with(&scene, &setup, fewer, &NEVER, &mut |_| Ok(()));
    assert_eq!(ways(&found), all[..2], "{:?}", found.tries);
    near(
        distance(model_of(&setup), &steady(&found).state[POLARITY], &rest[POLARITY]),
        0.0,
        1e-7,
        "the state by smaller steps",
    );

    // absurd first steps lead to the same state
    for step in [1e-9, 1e9] {
        let found =
            search_with(&scene, &setup, SteadySettings { step, ..scene.steady.unwrap() }, &NEVER, &mut |_| Ok(()));
        println!("{:?}", found.tries);
        near(
            distance(model_of(&setup), &steady(&found).state[POLARITY], &rest[POLARITY]),
            0.0,
            1e-7,
            "the state from an absurd step",
        );
    }
}

#[test]
fn easier_parameters_lead_to_those_of_the_scene() {
    let (scene, setup) = channel(&[("model.elasticity", "2"), ("initial.polarity", "[\"1\", \"y\"]")]);
    let direct = search(&scene, &setup);
    assert_eq!(ways(&direct), [Way::PseudoTransient]);
    // one step less than that takes
    let fewer = SteadySettings { max_steps: direct.tries[0].steps - 1, ..scene.steady.unwrap() };
    let found = search_with(&scene, &setup, fewer, &NEVER, &mut |_| Ok(()));
    assert_eq!(ways(&found), [Way::PseudoTransient, Way::SmallerSteps, Way::Parameters], "{:?}", found.tries);
    assert!(found.tries[2].steps > found.tries[0].steps, "several states were passed: {:?}", found.tries);
    let [by_parameters, straight] = [&found, &direct].map(|search| &steady(search).state[POLARITY]);
    near(distance(model_of(&setup), by_parameters, straight), 0.0, 1e-7, "the state by parameters");
}

#[test]
fn nothing_is_found_where_nothing_may_be_tried() {
    let (scene, setup) = channel(&[("steady.max_steps", "1"), ("steady.march", "0.2")]);
    let found = search(&scene, &setup);
    assert!(matches!(found.found, Found::Nothing));
    assert_eq!(found.tries[3].outcome, "neither steady nor periodic at t = 0.2");
    assert_eq!(found.tries[3].steps, 2);
}

#[test]
fn an_interrupted_search_keeps_what_it_has() {
    let (scene, setup) = channel(&[]);
    let interrupt = AtomicBool::new(false);
    let (mut third, mut count) = (None, 0);
    let found = search_with(&scene, &setup, scene.steady.unwrap(), &interrupt, &mut |event| {
        if let Event::Pseudo(step, trial) = event {
            count += 1;
            if step.step == 3 {
                third = Some(trial.y.clone());
                interrupt.store(true, Ordering::Relaxed);
            }
        }
        Ok(())
    });
    assert!(matches!(found.found, Found::Interrupted));
    assert_eq!(count, 3, "the search ends there");
    assert!(found.last == third.unwrap(), "the polarity of the third step");
}

#[test]
fn an_interrupted_run_is_resumed_where_it_was() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    // no residual is as small: the search goes on until it is stopped
    let (endless, _) = channel(&[("steady.residual", "1e-30"), ("steady.want", "any"), ("time.end", "1e6")]);
    let rows = || std::fs::read_to_string(out.join("history.csv")).map_or(0, |text| text.lines().count());
    let interrupt = AtomicBool::new(false);
    let summary = std::thread::scope(|scope| {
        scope.spawn(|| {
            while rows() < 5 {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            interrupt.store(true, Ordering::Relaxed);
        });
        let options = Options { out: out.clone(), resume: false, verbosity: Verbosity::Quiet, interrupt: &interrupt };
        run::run(&endless, &options).unwrap()
    });
    assert_eq!(summary.ending, Ending::Interrupted);
    let before = rows();
    let saved = monolayer::output::checkpoint::Saved::read(&out.join("checkpoint.bin")).unwrap().march().unwrap();
    let (scene, setup) = channel(&[("steady.residual", "1e-9"), ("steady.want", "any"), ("time.end", "1e6")]);
    let start = setup.initial(&scene).unwrap();
    let moved: Vec<f64> = saved.past[0].1.iter().zip(&start.values).map(|(a, b)| a - b).collect();
    assert!(size(model_of(&setup), &moved) > 0.1, "the checkpoint is not the start");
    let options = Options { out: out.clone(), resume: true, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    let summary = run::run(&scene, &options).unwrap();
    assert_eq!(summary.ending, Ending::Steady);
    assert!(rows() >= before, "the history goes on");
    let found = search(&scene, &setup);
    let last = monolayer::output::checkpoint::Saved::read(&out.join("checkpoint.bin")).unwrap().march().unwrap();
    let apart: Vec<f64> =
        last.past[0].1.iter().zip(&steady(&found).state[POLARITY].values).map(|(a, b)| a - b).collect();
    near(size(model_of(&setup), &apart), 0.0, 1e-7, "the state of the resumed run");
}

#[test]
fn one_and_two_threads_find_the_same_bits() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (scene, setup) = channel(&[]);
            let found = search(&scene, &setup);
            let steady = steady(&found);
            let spectrum = steady.spectrum.as_ref().unwrap();
            let modes: Vec<_> = spectrum.modes.iter().map(|mode| (mode.value, mode.vector.clone())).collect();
            (steady.state[POLARITY].values.clone(), steady.state[VELOCITY].values.clone(), modes)
        })
    };
    assert!(with(1) == with(2), "the results differ");
}
