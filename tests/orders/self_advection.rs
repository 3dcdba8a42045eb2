//! POLARITY that carries itself along, in both sheets: with little diffusion, and with values that come in where the
//! polarity at the boundary points inwards, it has the order k + ½ of an upwind method in P(k) in L², or better.

use monolayer::measure::errors::Norm;
use monolayer::model::fields::POLARITY;

use super::common::{Orders, run};

const PLAIN: &str = include_str!("../../studies/mms/square.toml");
const SQUEEZED: &str = include_str!("../../studies/mms/squeezed-square.toml");

fn sets(n: usize, factor: f64, coupling: &str) -> Vec<(&'static str, String)> {
    let keys =
        ["boundary.left.polarity", "boundary.right.polarity", "boundary.bottom.polarity", "boundary.top.polarity"];
    let others = [
        ("model.self_advection", factor.to_string()),
        ("model.coherence", "0.05".to_owned()),
        ("model.elasticity", "0".to_owned()),
        ("mesh.n", n.to_string()),
        ("space.degree.velocity", "3".to_owned()),
        ("space.degree.polarity", "2".to_owned()),
        ("time.scheme", "bdf4".to_owned()),
        ("time.start", "exact".to_owned()),
        ("time.step", "0.025".to_owned()),
        ("time.end", "0.25".to_owned()),
        ("coupling.kind", format!("\"{coupling}\"")),
        ("coupling.tolerance", "1e-10".to_owned()),
    ];
    others.into_iter().chain(keys.map(|key| (key, "\"dirichlet\"".to_owned()))).collect()
}

#[test]
fn self_advection_has_the_order_of_an_upwind_method_in_both_sheets() {
    for (sheet, text) in [("incompressible", PLAIN), ("compressible", SQUEEZED)] {
        for factor in [1.5, -1.5] {
            let level = |n: usize| {
                let mut sets = sets(n, factor, "newton");
                if text == SQUEEZED {
                    // a density of degree 1 would bound the order of what it carries along, and so would its time
                    // scheme
                    sets.extend([("space.degree.density", "2".to_owned()), ("time.step", "0.0125".to_owned())]);
                }
                run(text, &sets)
            };
            let found = Orders::new(&format!("{sheet}, ζ = {factor}"), [4, 8, 16].map(level).to_vec());
            let order = found.of(POLARITY, Norm::Square);
            assert!(order >= 2.5, "{sheet}, ζ = {factor}: P2 has order {order:.2}");
        }
    }
}

/// The equations in turn, with the transported polarity implicit and the carrying one of the last iterate, have the
/// same solution as Newton's method.
#[test]
fn equations_in_turn_have_the_same_solution() {
    for text in [PLAIN, SQUEEZED] {
        let of = |coupling: &str| run(text, &sets(4, 1.5, coupling)).1.error(POLARITY, Norm::Square);
        let (newton, turns, mixed) = (of("newton"), of("fixed-point"), of("anderson"));
        assert!((turns / newton - 1.0).abs() < 1e-6, "fixed point {turns}, Newton {newton}");
        assert!((mixed / newton - 1.0).abs() < 1e-6, "Anderson {mixed}, Newton {newton}");
    }
}
