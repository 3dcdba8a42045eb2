//! Slip on curved walls: rotated nodal unknowns against the penalty of the thesis, on straight and on curved cells.
//!
//! `v = g(r) (−y, x)` on the ring 1 < r < 2 with `g = 1 + ½ cos π(r−1)` slips along both circles: `g' = 0` there, so
//! that the shear stress vanishes. The force is `(C_F g − g'' − 3g'/r)(−y, x)`, the pressure zero.

use std::sync::Arc;

use monolayer::expression::Expression;
use monolayer::mesh::Point;
use monolayer::mesh::generate::MeshScene;
use monolayer::model::fields::POLARITY;
use monolayer::model::momentum::SlipTreatment;
use monolayer::model::{Conditions, Degrees, Description, Incompressible, Parameters, Sources};

use super::slope;

const FRICTION: f64 = 2.0;

fn error(h: f64, curved: usize, slip: SlipTreatment) -> f64 {
    let ring = MeshScene::of("annulus").with("radius", 2.0).with("inner_radius", 1.0);
    let mesh = Arc::new(ring.with("h", h).with("curved", curved).build().unwrap());
    let s = "pi*(sqrt(x^2+y^2)-1)";
    let force = format!("({FRICTION}*(1+0.5*cos({s})) + 0.5*pi^2*cos({s}) + 1.5*pi*sin({s})/sqrt(x^2+y^2))");
    let formula = |text: String| Expression::parse(&text, &[]).unwrap();
    let parameters = Parameters { friction: FRICTION, traction: 0.0, ..Parameters::PLAIN };
    let usual = Description::new(&mesh, parameters, |_| Conditions::slip());
    let force = Some([formula(format!("-y*{force}")), formula(format!("x*{force}"))]);
    let sources = Sources { force, ..Sources::default() };
    let description = Description { degrees: Degrees { polarity: 1, ..usual.degrees }, sources, slip, ..usual };
    let model = Incompressible::new(&mesh, &description).unwrap();
    let (v, _) = model.flow(&model.zero()[POLARITY], 0.0).unwrap();
    let square = model.loops.sum(10, |x| {
        let at = x.site.x;
        let g = 1.0 + 0.5 * (std::f64::consts::PI * (at.norm() - 1.0)).cos();
        (v.vector(&x.site) - Point::new(-at.y, at.x) * g).norm_squared()
    });
    square.sqrt()
}

#[test]
fn rotated_slip_on_curved_cells_is_optimal_and_the_most_accurate() {
    let sizes = [0.4, 0.2, 0.1];
    let treatments = [
        ("rotated", SlipTreatment::Rotated),
        ("penalty 1e-4", SlipTreatment::Penalty { epsilon: 1e-4 }),
        ("penalty 1e-8", SlipTreatment::Penalty { epsilon: 1e-8 }),
    ];
    println!("L2 error of v, P2/P1, h = {sizes:?}");
    let mut finest = Vec::new();
    for curved in 1..=3 {
        for (name, slip) in treatments {
            let table: Vec<(f64, f64)> = sizes.iter().map(|&h| (h, error(h, curved, slip))).collect();
            let order = slope(&table);
            let errors: Vec<String> = table.iter().map(|(_, e)| format!("{e:.2e}")).collect();
            println!("curved {curved}  {name:<13} {}  order {order:.2}", errors.join("  "));
            finest.push((curved, name, table[2].1, order));
        }
    }
    let of = |curved: usize, name: &str| *finest.iter().find(|f| f.0 == curved && f.1 == name).unwrap();
    for curved in [2, 3] {
        let (_, _, error, order) = of(curved, "rotated");
        assert!(order > 2.8, "curved {curved}: order {order}");
        assert!(error < 3e-4, "curved {curved}: error {error}");
        for penalty in ["penalty 1e-4", "penalty 1e-8"] {
            assert!(error <= 1.05 * of(curved, penalty).2, "curved {curved}: {penalty} is more accurate");
        }
    }
    assert!(of(3, "rotated").2 < 0.1 * of(1, "rotated").2, "curved cells pay");
}
