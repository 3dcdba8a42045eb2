//! Scenes that the tests share, and what they ask of them.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::model::incompressible::{Incompressible, State};
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};
use monolayer::space::Field;
use monolayer::steady::pseudo::Work;
use monolayer::steady::spectrum::{Mode, Spectrum, SpectrumSettings, spectrum};
use monolayer::time::Phases;
use monolayer::time::kept_factors::KeptFactors;
use monolayer::time::sheet::SheetKind;

/// A closed square of tissue that nothing drives.
pub const CLOSED: &str = r#"
[model]
kind = "incompressible"
friction = 1.0
traction = 0.0
peclet = 0.8
coherence = 0.3
alignment = 0.7

[mesh]
shape = "square"
n = 4

[boundary.left]
velocity = "slip"
polarity = "neumann"
[boundary.right]
velocity = "slip"
polarity = "neumann"
[boundary.bottom]
velocity = "slip"
polarity = "neumann"
[boundary.top]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = ["1", "0"]

[time]
scheme = "bdf2"
step = 0.1
end = 20.0

[steady]
"#;

/// The closed square with other values; `velocity` and `polarity` are the conditions on all sides.
pub struct Square {
    source: SceneSource,
}

impl Square {
    pub fn new() -> Self {
        Self { source: SceneSource::parse(CLOSED, Path::new("tests/steady")).unwrap() }
    }

    pub fn set(mut self, key: &str, value: &str) -> Self {
        self.source.set(key, value).unwrap();
        self
    }

    /// The same condition on all sides.
    pub fn sides(self, key: &str, value: &str) -> Self {
        ["left", "right", "bottom", "top"]
            .iter()
            .fold(self, |square, side| square.set(&format!("boundary.{side}.{key}"), value))
    }

    pub fn scene(self) -> Scene {
        Scene::check(self.source).unwrap()
    }

    pub fn setup(self) -> (Scene, Setup) {
        let scene = self.scene();
        let setup = Setup::new(&scene).unwrap();
        (scene, setup)
    }
}

/// The incompressible sheet that a scene describes.
pub fn model_of(setup: &Setup) -> &Incompressible {
    match setup.model.kind() {
        SheetKind::Incompressible(model) => model,
        SheetKind::Compressible(_) => panic!("the scene is incompressible"),
    }
}

/// A polarity with its flow.
pub fn state(model: &Incompressible, p: Field) -> State {
    let (v, pi) = model.flow(&p, 0.0).unwrap();
    State::incompressible(v, pi, p)
}

/// The spectrum about a state.
pub fn spectrum_of(model: &Incompressible, state: &State, wanted: usize) -> Spectrum {
    let (mut kept, mut phases, interrupt) = (KeptFactors::default(), Phases::default(), AtomicBool::new(false));
    let mut work = Work { kept: &mut kept, phases: &mut phases, interrupt: &interrupt };
    spectrum(model, state, SpectrumSettings { wanted, growing_suffices: false, fast: true }, &mut work).unwrap()
}

/// `‖x‖` in the space of polarities.
pub fn size(model: &Incompressible, x: &[f64]) -> f64 {
    x.iter().zip(model.polarity.mass_times(x)).map(|(x, m)| x * m).sum::<f64>().sqrt()
}

/// `‖a − b‖` in the space of polarities.
pub fn distance(model: &Incompressible, a: &Field, b: &Field) -> f64 {
    size(model, &a.values.iter().zip(&b.values).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// Real modes and upper halves of pairs, each with its real and imaginary part.
pub fn values(modes: &[Mode]) -> Vec<(f64, f64)> {
    modes.iter().map(|mode| (mode.value.re, mode.value.im)).collect()
}

#[track_caller]
pub fn near(found: f64, exact: f64, tolerance: f64, what: &str) {
    assert!((found - exact).abs() <= tolerance, "{what}: {found} instead of {exact}, off by {:.1e}", found - exact);
}
