//! Runs of scenes with exact fields.

use std::path::Path;

use monolayer::measure::errors::{History, Norm, errors};
use monolayer::model::fields::FieldId;
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};
use monolayer::time::Counts;

use super::slope;

/// Errors of a scene over all its steps, with `sets` applied, and the size of its cells.
pub fn run(text: &str, sets: &[(&str, String)]) -> (f64, History) {
    let (h, history, _) = run_and_count(text, sets);
    (h, history)
}

/// As [`run`], with what the steps took.
pub fn run_and_count(text: &str, sets: &[(&str, String)]) -> (f64, History, Counts) {
    let mut source = SceneSource::parse(text, Path::new("tests/orders")).unwrap();
    for (key, value) in sets {
        source.set(key, value).unwrap();
    }
    let scene = Scene::check(source).unwrap();
    let setup = Setup::new(&scene).unwrap();
    let mut march = setup.start(&scene).unwrap();
    let mut history = History::default();
    while march.t < scene.time.end * (1.0 - 1e-12) {
        let dt = march.advance(scene.time.end).unwrap().dt;
        history.add(&errors(&*setup.model, scene.sources.exact.as_ref().unwrap(), &march.state, march.t), dt);
    }
    (setup.ground.quality.h_max, history, march.counts)
}

/// Orders of every field in both norms between runs of sizes and errors, least squares; prints the table.
pub struct Orders {
    pub name: String,
    pub runs: Vec<(f64, History)>,
}

impl Orders {
    pub fn new(name: &str, runs: Vec<(f64, History)>) -> Self {
        println!("{name}");
        let this = Self { name: name.to_owned(), runs };
        for field in this.runs[0].1.fields() {
            for norm in Norm::ALL {
                let errors: Vec<String> =
                    this.runs.iter().map(|(_, e)| format!("{:.2e}", e.error(field, norm))).collect();
                let (order, errors) = (this.of(field, norm), errors.join("  "));
                println!("  {:<10} {:<11} {errors}  order {order:.2}", field.name, norm.name());
            }
        }
        this
    }

    pub fn of(&self, field: FieldId, norm: Norm) -> f64 {
        slope(&self.runs.iter().map(|(h, e)| (*h, e.error(field, norm))).collect::<Vec<_>>())
    }

    /// The smaller of the orders in both norms.
    pub fn least(&self, field: FieldId) -> f64 {
        Norm::ALL.iter().map(|norm| self.of(field, *norm)).fold(f64::INFINITY, f64::min)
    }

    pub fn last(&self, field: FieldId, norm: Norm) -> f64 {
        self.runs.last().unwrap().1.error(field, norm)
    }

    #[track_caller]
    pub fn at_least(&self, bounds: [(FieldId, f64); 4]) {
        for (field, bound) in bounds {
            let order = self.least(field);
            assert!(order >= bound, "{}: {} has order {order:.2}, not {bound}", self.name, field.name);
        }
    }
}
