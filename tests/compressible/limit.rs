//! Tissue that resists compression more and more is the incompressible sheet.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::*;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::incompressible::Incompressible;
use monolayer::model::{DensityLaw, Parameters, State};
use monolayer::space::project;
use monolayer::time::sheet::Sheet;
use monolayer::time::{CouplingKind, March, MarchSettings};

/// Degrees high enough that what the two discretisations differ by is far below what compression does.
const DEGREE: usize = 3;

fn parameters(density: Option<DensityLaw>) -> Parameters {
    Parameters { traction: 10.0, friction: 0.5, coherence: 0.3, density, ..PARAMETERS }
}

fn end(model: &dyn Sheet, y: Vec<f64>) -> State {
    let settings: MarchSettings = settings(0.02, 2, CouplingKind::Newton);
    let mut march = March::start(model, settings, y).unwrap();
    for _ in 0..10 {
        march.advance(1e9).unwrap();
    }
    march.state
}

/// A polarity that a mirror in any side of the square leaves as it is.
fn start(x: Point) -> Point {
    let (a, b) = (PI * x.x, PI * x.y);
    Point::new(0.2 + 0.3 * a.cos() - 0.6 * b.cos(), 0.7 * a.cos() * b.cos() + 0.2)
}

fn compressible(mesh: &Arc<Mesh>, penalty: f64) -> (State, Vec<f64>) {
    let law = DensityLaw { penalty, exponent: 1.0, critical: 0.0, active_stress_iso: 0.0 };
    let model = sheet(mesh, parameters(Some(law)), DEGREE, closed);
    let state = end(&model, carried(&model, |_| 1.0, start));
    let compression = minus(&state.volume().values, &vec![1.0; model.density.space.dof_count()]);
    (state, compression)
}

#[test]
fn stiff_tissue_moves_like_an_incompressible_sheet() {
    let mesh = mesh("shape = \"square\"\nn = 3");
    let other = Incompressible::new(&mesh, &describe(&mesh, parameters(None), DEGREE, closed)).unwrap();
    let p = project::interpolate_vector(&other.polarity.space, start);
    let rest = end(&other, p.values);
    let speed = largest(&rest.v.values);
    assert!(speed > 0.05, "it moves: {speed}");
    let mut rows = Vec::new();
    for penalty in [10.0, 100.0, 1e3, 1e4] {
        let (state, compression) = compressible(&mesh, penalty);
        let velocity = Sheet::velocity_mass(&other).quadratic(&minus(&state.v.values, &rest.v.values)).sqrt();
        let d = minus(&state.p.values, &rest.p.values);
        let polarity = dot(&d, &other.polarity.mass_times(&d)).sqrt();
        rows.push([penalty, velocity, polarity, largest(&compression)]);
        println!("c_0 = {penalty}: v {velocity:.3e}, p {polarity:.3e}, ρ {:.3e}", largest(&compression));
    }
    for (column, name) in [(1, "velocity"), (2, "polarity"), (3, "density")] {
        for pair in rows.windows(2) {
            let rate = (pair[0][column] / pair[1][column]).log10();
            println!("{name}: from c_0 = {} rate {rate:.2}", pair[0][0]);
            assert!(rate > 0.8, "{name} from c_0 = {}: rate {rate:.2} in 1/c_0", pair[0][0]);
        }
    }
}
