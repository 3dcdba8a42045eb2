//! The same dimensionless problem in any unit of length gives the same numbers.

use std::path::Path;

use monolayer::measure::{Line, cut};
use monolayer::mesh::Point;
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::locate::Locator;
use monolayer::model::fields::VELOCITY;
use monolayer::run::Setup;
use monolayer::scene::Scene;
use monolayer::space::project;

use super::common::discontinuous;

const UNITS: [f64; 5] = [1.0, 1e-9, 1e-3, 1e3, 1e9];

/// Tissue that flows through a square of side L: `C_F` goes with L⁻², `T_a` with L⁻¹, `κ` and speeds with L.
fn scene(unit: f64, kind: &str, more: &str, space: &str) -> String {
    let number = |value: f64| format!("{value:e}");
    let (friction, traction) = (number(3.0 / unit.powi(2)), number(3.0 / unit));
    let (side, coherence) = (number(unit), number(0.2 * unit));
    format!(
        r#"
[model]
kind = "{kind}"
friction = {friction}
traction = {traction}
active_stress = 0.5
peclet = 1.0
coherence = {coherence}
elasticity = 0.4
{more}
[mesh]
shape = "square"
n = 4
length = [0.0, {side}]
[space]
{space}
[boundary.left]
velocity = {{ dirichlet = ["{side}", "0"] }}
polarity = {{ dirichlet = ["1", "0"] }}
#rho density = 1.0
[boundary.right]
velocity = "traction"
polarity = "neumann"
#rho density = 1.0
[boundary.bottom]
velocity = "slip"
polarity = "neumann"
[boundary.top]
velocity = "slip"
polarity = "neumann"
[initial]
polarity = ["cos(2*x/{side})", "sin(3*y/{side})"]
#rho density = "1 + 0.2*sin(4*x/{side})"
[time]
scheme = "bdf2"
step = 0.05
end = 0.2
"#
    )
}

/// Every field, the velocity over the unit, the residual, and the free energy over the unit's square, at the end.
fn end_of(text: &str, unit: f64) -> Vec<(&'static str, Vec<f64>)> {
    let scene = Scene::parse(text, Path::new("units.toml")).unwrap();
    let setup = Setup::new(&scene).unwrap();
    let mut march = setup.start(&scene).unwrap();
    while march.t < scene.time.end * (1.0 - 1e-12) {
        march.advance(scene.time.end).unwrap();
    }
    let residuals = march.residuals().unwrap();
    let energy = setup.model.free_energy(&march.state, march.t) / unit.powi(2);
    let scale = |id| if id == VELOCITY { unit } else { 1.0 };
    let fields =
        march.state.fields().map(|(id, field)| (id.name, field.values.iter().map(|v| v / scale(id)).collect()));
    fields.chain([("residual", vec![residuals.total()]), ("energy", vec![energy])]).collect()
}

fn alike(what: &str, unit: f64, ours: &[f64], theirs: &[f64]) {
    let size = theirs.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let apart = ours.iter().zip(theirs).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(apart <= 1e-9 * size, "{what} at L = {unit:e}: off by {:e}", apart / size);
}

fn in_all_units(text: &dyn Fn(f64) -> String) {
    let reference = end_of(&text(1.0), 1.0);
    for unit in UNITS {
        let found = end_of(&text(unit), unit);
        assert_eq!(found.len(), 5);
        for ((name, ours), (_, theirs)) in found.iter().zip(&reference) {
            alike(name, unit, ours, theirs);
        }
    }
}

#[test]
fn an_incompressible_sheet() {
    for space in ["walls = \"rotated\"", "walls = \"penalty\""] {
        in_all_units(&|unit| scene(unit, "incompressible", "", space));
    }
    for kind in ["fixed-point", "anderson"] {
        let coupling = format!("\n[coupling]\nkind = \"{kind}\"\n");
        in_all_units(&|unit| scene(unit, "incompressible", "", "") + &coupling);
    }
}

#[test]
fn a_compressible_sheet() {
    let law = "density = { penalty = 2.0, critical = 0.2 }";
    in_all_units(&|unit| scene(unit, "compressible", law, "").replace("#rho ", ""));
}

#[test]
fn cuts_take_the_sides_of_a_line_in_any_unit() {
    for unit in [1e-9, 1e-6, 1.0, 1e6, 1e9] {
        let scene: MeshScene = toml::from_str(&format!("shape = \"square\"\nn = 5\nlength = [0.0, {unit:e}]")).unwrap();
        let mesh = std::sync::Arc::new(scene.build().unwrap());
        let locator = Locator::new(&mesh);
        let p = project::interpolate_vector(&discontinuous(&mesh, 2, 2), |x| Point::new(1.0 + x.y / unit, 0.0));
        for (from, to) in [(0.0, 1.0), (1.0, 0.0)] {
            let [from, to] = [from, to].map(|x| Point::new(x, 0.4) * unit);
            let line = Line { name: "cut".into(), from, to, points: 51 };
            let samples = line.samples(&mesh, &locator);
            assert_eq!(samples.len(), 51);
            for sample in samples {
                let value = cut::value(&p, &sample.at, 0);
                assert!((value - 1.4).abs() < 1e-12, "L = {unit:e}, s = {}: {value}", sample.s);
            }
        }
    }
}
