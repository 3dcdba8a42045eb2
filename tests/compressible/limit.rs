//! Tissue that resists compression more and more is the incompressible sheet.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::*;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::incompressible::Incompressible;
use monolayer::model::{DensityLaw, Parameters, State};
use monolayer::space::{Field, project};
use monolayer::time::sheet::Sheet;
use monolayer::time::{CouplingKind, March, MarchSettings};

/// Degrees high enough that what the two discretisations differ by is far below what compression does.
const DEGREE: usize = 3;

fn parameters(density: Option<DensityLaw>) -> Parameters {
    Parameters { traction: 3.0, friction: 1.0, coherence: 0.5, density, ..PARAMETERS }
}

fn end(model: &dyn Sheet, y: Vec<f64>) -> State {
    let settings: MarchSettings = settings(0.02, 2, CouplingKind::Newton);
    let mut march = March::start(model, settings, y).unwrap();
    for _ in 0..10 {
        march.advance(1e9).unwrap();
    }
    march.state
}

fn start(x: Point) -> Point {
    let (a, b) = (PI * x.x, PI * x.y);
    Point::new(0.2 + 0.3 * a.cos() - 0.6 * b.cos(), 0.7 * a.cos() * b.cos() + 0.2)
}

/// Starts with the density that has the pressure of the incompressible sheet: from another one, sound would have to fade first,
/// and steps much longer than 1/c_0 do not resolve that.
fn compressible(mesh: &Arc<Mesh>, penalty: f64, pi: &Field) -> (State, f64) {
    let law = DensityLaw { penalty, exponent: 1.0, critical: 0.0, active_stress_iso: 0.0 };
    let model = sheet(mesh, parameters(Some(law)), DEGREE, closed);
    let mut y = carried(&model, |_| 1.0, start);
    for cell in 0..mesh.cells.len() {
        for i in 0..model.density.space.n {
            // c_0 ρ² = c_0 + Π
            y[model.density.space.dof(cell, 0, i)] = (1.0 + pi.values[pi.space.dof(cell, 0, i)] / penalty).sqrt();
        }
    }
    let state = end(&model, y);
    let compression = state.volume().values.iter().fold(0.0_f64, |m, rho| m.max((rho - 1.0).abs()));
    (state, compression)
}

#[test]
fn stiff_tissue_moves_like_an_incompressible_sheet() {
    let n: usize = std::env::var("LN").map_or(3, |n| n.parse().unwrap());
    let mesh = mesh(&format!("shape = \"square\"\nn = {n}"));
    let other = Incompressible::new(&mesh, &describe(&mesh, parameters(None), DEGREE, closed)).unwrap();
    let p = project::interpolate_vector(&other.polarity.space, start);
    let (_, pi) = other.flow(&p, 0.0).unwrap();
    println!("Π {}", largest(&pi.values));
    let rest = end(&other, p.values);
    let speed = largest(&rest.v.values);
    println!("speed {speed}");
    assert!(speed > 0.05, "it moves: {speed}");
    let mut rows = Vec::new();
    for penalty in [10.0, 100.0, 1e3, 1e4] {
        let (state, compression) = compressible(&mesh, penalty, &pi);
        let velocity = Sheet::velocity_mass(&other).quadratic(&minus(&state.v.values, &rest.v.values)).sqrt();
        let d = minus(&state.p.values, &rest.p.values);
        let polarity = dot(&d, &other.polarity.mass_times(&d)).sqrt();
        rows.push([penalty, velocity, polarity, compression]);
        println!("c_0 = {penalty}: v {velocity:.3e}, p {polarity:.3e}, ρ {compression:.3e}");
    }
    for (column, name) in [(1, "velocity"), (2, "polarity"), (3, "density")] {
        for pair in rows.windows(2) {
            let rate = (pair[0][column] / pair[1][column]).log10();
            println!("{name}: from c_0 = {} rate {rate:.2}", pair[0][0]);
            assert!(rate > 0.8, "{name} from c_0 = {}: rate {rate:.2} in 1/c_0", pair[0][0]);
        }
    }
}
