//! Restarts and threads: the same bits.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::common::*;
use monolayer::output::checkpoint::Saved;
use monolayer::output::progress::Verbosity;
use monolayer::run::{self, Ending, Options, Summary};
use monolayer::scene::{Scene, SceneSource};
use monolayer::time::{Checkpoint, CouplingKind, March};

static NEVER: AtomicBool = AtomicBool::new(false);

/// Tissue that enters a strip, leaves it, and has an edge where the limiter works.
const SCENE: &str = r#"
[model]
kind = "compressible"
friction = 1.0
traction = 1.5
active_stress = 0.5
active_stress_iso = 0.2
peclet = 0.7
coherence = 0.3
elasticity = 0.4
density = { penalty = 0.5, exponent = 1.5, critical = 0.1 }

[mesh]
shape = "square"
n = 3

[boundary.left]
velocity = { dirichlet = ["1 + 0.3*sin(4*t)", "0"] }
polarity = { dirichlet = ["1", "0.2"] }
density = "0.5 + 0.4*cos(3*t)"
[boundary.right]
velocity = "traction"
polarity = "neumann"
density = 1.0
[boundary.bottom]
velocity = "slip"
polarity = "neumann"
[boundary.top]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = ["0.5", "0.2*y"]
density = "exp(-40*x^2) + 1e-8"

[time]
scheme = "bdf3"
step = 0.04
end = 0.25

[[output]]
fields = ["velocity", "density", "pressure", "polarity"]
every = { time = 0.1 }
[[output]]
measures = ["free_energy", "mass", "density_min", "limited_cells"]
every = { steps = 1 }
"#;

fn scene(sets: &[(&str, &str)]) -> Scene {
    let mut source = SceneSource::parse(SCENE, Path::new("test.toml")).expect("the test's scene parses");
    for (key, value) in sets {
        source.set(key, value).expect("the test's override fits");
    }
    Scene::check(source).expect("the test's scene is good")
}

fn run_in(folder: &Path, scene: &Scene, resume: bool) -> Summary {
    let options = Options { out: folder.to_owned(), resume, verbosity: Verbosity::Quiet, interrupt: &NEVER };
    run::run(scene, &options).unwrap()
}

#[test]
fn a_resumed_run_has_the_bits_of_an_uninterrupted_one() {
    for kind in ["newton", "anderson", "fixed-point"] {
        let root = tempfile::tempdir().unwrap();
        let (whole, parts) = (root.path().join("whole"), root.path().join("parts"));
        let coupling = ("coupling.kind", kind);
        let summary = run_in(&whole, &scene(&[coupling]), false);
        assert_eq!(summary.ending, Ending::EndTime);
        for stop in ["4", "7"] {
            let first = run_in(&parts, &scene(&[coupling, ("time.max_steps", stop)]), stop != "4");
            assert_eq!(first.ending, Ending::MaxSteps);
        }
        let last = run_in(&parts, &scene(&[coupling]), true);
        println!("{kind}: {:?}", summary.counts);
        assert!(summary.counts.limited > 0, "the limiter is at work");
        assert_eq!(last.counts, summary.counts);
        let name = format!("fields/step-{:06}.vtu", summary.counts.steps);
        for file in ["history.csv", name.as_str()] {
            let [a, b] = [&whole, &parts].map(|folder| std::fs::read(folder.join(file)).unwrap());
            assert!(a == b, "{kind}: {file} differs");
        }
        let [a, b] =
            [&whole, &parts].map(|folder| Saved::read(&folder.join("checkpoint.bin")).unwrap().march().unwrap());
        assert!(a == b, "{kind}: the checkpoints differ");
    }
}

/// A march with inflow, outflow and limited cells.
fn march(threads: usize, kind: CouplingKind) -> (Checkpoint, Vec<u64>) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let model = sheet(&square(3), PARAMETERS, 1, channel);
        let mut march = March::start(&model, settings(0.05, 3, kind), smooth(&model)).unwrap();
        for _ in 0..5 {
            march.advance(1e9).unwrap();
        }
        let (energy, rate) = march.energy();
        let residuals = march.residuals().unwrap();
        let residuals = residuals.each().map(|(_, residual)| residual);
        let numbers: Vec<f64> = [energy, rate, march.mass_counted()].into_iter().chain(residuals).collect();
        (march.checkpoint(), numbers.into_iter().map(f64::to_bits).collect::<Vec<_>>())
    })
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    for kind in [CouplingKind::Newton, CouplingKind::Anderson { depth: 5 }] {
        let one = march(1, kind);
        assert!(one == march(2, kind), "{kind:?}");
        assert!(one == march(3, kind), "{kind:?}");
    }
}
