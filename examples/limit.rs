//! How fast the compressible sheet becomes the incompressible one as its penalty c_0 grows:
//! `cargo run --release --example limit`.
//!
//! Both sheets have the same mesh and the same spaces of velocity and polarity, so that their difference is a field of
//! those spaces. The columns named `last` compare with the largest c_0 instead, which leaves out how differently two
//! discretisations keep div v = 0.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use monolayer::model::fields::{DENSITY, POLARITY, VELOCITY};
use monolayer::model::{State, VelocityCondition};
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};
use monolayer::solve::{dot, root};
use monolayer::steady::{Found, SearchSettings, find};
use monolayer::time::{Phases, Sheet};

/// Penalties; the last one stands for the limit of this discretisation.
const PENALTIES: [f64; 7] = [10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e8];

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    // rounding of a pressure of size c_0 hides a residual of 1e-9 beyond 1e6
    for (name, end) in [("square", 1e8), ("strip", 1e6)] {
        let path = Path::new("studies/limit").join(format!("{name}.toml"));
        let source = SceneSource::read(&path)?;
        let penalties: Vec<f64> = PENALTIES.into_iter().filter(|c| *c <= end).collect();
        let mut states: Vec<(Setup, State)> = Vec::new();
        for penalty in &penalties {
            let mut source = source.clone();
            source.set("model.density.penalty", &penalty.to_string())?;
            // steady states are followed from one penalty to the next: there may be others
            let near = states.last().map(|(_, state)| state);
            states.push(solve(&Scene::check(source)?, near)?);
        }
        let (_, without) = solve(&incompressible(source.clone())?, states.last().map(|(_, state)| state))?;
        let (_, last) = states.last().expect("there are penalties");
        println!("{name}: distances in L², the largest |ρ − 1| at a node, and orders in 1/c_0");
        println!("{:>8} {:>10} {:>10} {:>10} {:>10} {:>10}", "c_0", "v", "p", "v last", "p last", "ρ − 1");
        let mut before: Option<[f64; 5]> = None;
        for (penalty, (setup, state)) in penalties.iter().zip(&states) {
            let rho = state.get(DENSITY).expect("the sheet is compressible");
            let squeezed = rho.values.iter().fold(0.0_f64, |m, r| m.max((r - 1.0).abs()));
            let [v, p] = distance(&*setup.model, state, &without);
            let [v_last, p_last] = distance(&*setup.model, state, last);
            let now = [v, p, v_last, p_last, squeezed];
            println!("{penalty:>8.0e} {}", now.map(|d| format!("{d:>10.2e}")).join(" "));
            if let Some(before) = before {
                let orders: Vec<String> =
                    before.iter().zip(&now).map(|(a, b)| format!("{:>10.2}", (a / b).log10())).collect();
                println!("{:>8} {}", "order", orders.join(" "));
            }
            before = Some(now);
        }
        println!();
    }
    Ok(())
}

/// The same scene without density, its polarity in the space of the other.
fn incompressible(mut source: SceneSource) -> Result<Scene, Failure> {
    let boundary = Scene::check(source.clone())?.boundary;
    for (key, value) in [
        ("model.kind", "incompressible"),
        ("model.density", ""),
        ("initial.density", ""),
        ("space.degree.polarity", "2"),
        ("output", "[]"),
    ] {
        source.set(key, value)?;
    }
    for (tag, conditions) in boundary {
        if conditions.density.is_some() {
            source.set(&format!("boundary.{tag}.density"), "")?;
        }
        if matches!(conditions.velocity, VelocityCondition::Traction(_)) {
            source.set(&format!("boundary.{tag}.velocity"), "\"traction\"")?;
        }
    }
    Ok(Scene::check(source)?)
}

/// The state at the end of a scene, or the steady state that it asks for, searched for from `near`.
fn solve(scene: &Scene, near: Option<&State>) -> Result<(Setup, State), Failure> {
    let setup = Setup::new(scene)?;
    let mut march = setup.start(scene)?;
    let Some(settings) = &scene.steady else {
        while march.t < scene.time.end * (1.0 - 1e-12) {
            march.advance(scene.time.end)?;
        }
        let state = march.state.clone();
        return Ok((setup, state));
    };
    let interrupt = AtomicBool::new(false);
    // what is carried alone: the flow follows from it
    let fields = march.state.fields();
    let start = State::of(fields.map(|(id, own)| (id, near.and_then(|near| near.get(id)).unwrap_or(own).clone())));
    let start = start.carried();
    let settings = SearchSettings { steady: *settings, marching: scene.march() };
    let search = find(&*setup.model, start, &settings, &interrupt, &mut Phases::default(), &mut |_| Ok(()))?;
    match search.found {
        Found::Steady(steady) => Ok((setup, steady.state)),
        Found::Oscillating { .. } | Found::Nothing | Found::Interrupted => Err("no steady state".into()),
    }
}

/// `‖v − v'‖` and `‖p − p'‖`.
fn distance(model: &dyn Sheet, a: &State, b: &State) -> [f64; 2] {
    let minus = |x: &[f64], y: &[f64]| -> Vec<f64> { x.iter().zip(y).map(|(x, y)| x - y).collect() };
    let dp = minus(&a[POLARITY].values, &b[POLARITY].values);
    let dv = model.velocity_mass().quadratic(&minus(&a[VELOCITY].values, &b[VELOCITY].values));
    [root(dv), root(dot(&dp, &model.polarity().mass_times(&dp)))]
}
