//! Tissue that resists compression more and more is the incompressible sheet.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::*;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::fields::{DENSITY, POLARITY, VELOCITY};
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
    Point::new(a.sin().powi(2) * (0.6 - 0.8 * b.cos()), b.sin().powi(2) * (0.9 * a.cos() + 0.3))
}

/// Starts with the density that has the pressure of the incompressible sheet: from another one, sound would have to
/// fade first, and steps much longer than 1/c_0 do not resolve that.
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
    let compression = state[DENSITY].values.iter().fold(0.0_f64, |m, rho| m.max((rho - 1.0).abs()));
    (state, compression)
}

/// Distances in L² of velocity and polarity.
fn apart(model: &Incompressible, a: &State, b: &State) -> [f64; 2] {
    let dp = minus(&a[POLARITY].values, &b[POLARITY].values);
    let dv = minus(&a[VELOCITY].values, &b[VELOCITY].values);
    [Sheet::velocity_mass(model).quadratic(&dv).sqrt(), dot(&dp, &model.polarity.mass_times(&dp)).sqrt()]
}

/// The states at the end of the incompressible sheet and of sheets of growing stiffness.
struct Ends {
    other: Incompressible,
    incompressible: State,
    stiff: Vec<(State, f64)>,
}

fn ends(n: usize, penalties: &[f64]) -> Ends {
    let mesh = mesh(&format!("shape = \"square\"\nn = {n}"));
    let other = Incompressible::new(&mesh, &describe(&mesh, parameters(None), DEGREE, closed)).unwrap();
    let p = project::interpolate_vector(&other.polarity.space, start);
    let (_, pi) = other.flow(&p, 0.0).unwrap();
    let incompressible = end(&other, p.values);
    let stiff = penalties.iter().map(|c| compressible(&mesh, *c, &pi)).collect();
    Ends { other, incompressible, stiff }
}

const PENALTIES: [f64; 5] = [10.0, 100.0, 1e3, 1e4, 1e6];

#[test]
fn stiff_tissue_moves_like_an_incompressible_sheet() {
    let Ends { other, incompressible, stiff } = ends(4, &PENALTIES);
    let speed = largest(&incompressible[VELOCITY].values);
    assert!(speed > 0.05, "it moves: {speed}");
    let limit = &stiff.last().unwrap().0;
    let rows: Vec<[f64; 5]> = stiff
        .iter()
        .map(|(state, compression)| {
            let ([v, p], [dv, dp]) = (apart(&other, state, &incompressible), apart(&other, state, limit));
            println!("v {v:.3e}, p {p:.3e}; from the stiffest v {dv:.3e}, p {dp:.3e}; ρ {compression:.3e}");
            [v, p, dv, dp, *compression]
        })
        .collect();
    let names = ["velocity", "polarity", "velocity from the stiffest", "polarity from the stiffest", "density"];
    for (column, name) in names.into_iter().enumerate() {
        // beyond c_0 = 1000, what the discretisations of the velocity differ by in the corners is larger
        let count = if column == 0 { 2 } else { 3 };
        for (pair, penalty) in rows.windows(2).zip(PENALTIES).take(count) {
            let rate = (pair[0][column] / pair[1][column]).log10();
            println!("{name}: from c_0 = {penalty} rate {rate:.2}");
            assert!(rate > 0.8, "{name} from c_0 = {penalty}: rate {rate:.2} in 1/c_0");
        }
    }
}

#[test]
fn what_remains_between_the_stiffest_sheet_and_the_incompressible_one_falls_with_the_mesh() {
    let left = [2, 4].map(|n| {
        let Ends { other, incompressible, stiff } = ends(n, &[1e6]);
        apart(&other, &stiff[0].0, &incompressible)
    });
    println!("{left:?}");
    for (coarse, fine) in left[0].iter().zip(left[1]) {
        assert!(fine < 0.35 * coarse && fine < 1e-4, "{left:?}");
    }
}
