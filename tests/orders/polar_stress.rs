//! A stress of gradients of the polarity, whose form has integrals over faces, keeps the orders of both sheets.

use monolayer::measure::errors::Norm;
use monolayer::model::fields::{POLARITY, VELOCITY};

use super::common::{Orders, run};

#[test]
fn the_stress_of_gradients_keeps_the_orders_in_both_sheets() {
    let sheets = [
        ("incompressible", include_str!("../../studies/mms/square.toml"), 3.6),
        ("compressible", include_str!("../../studies/mms/squeezed-square.toml"), 2.75),
    ];
    for (sheet, text, of_polarity) in sheets {
        let level = |n: usize| {
            let sets = [
                ("model.polar_stress", "0.8".to_owned()),
                ("mesh.n", n.to_string()),
                ("time.scheme", "bdf4".to_owned()),
                ("time.start", "exact".to_owned()),
                ("time.step", "0.0125".to_owned()),
                ("time.end", "0.25".to_owned()),
                ("coupling.tolerance", "1e-10".to_owned()),
            ];
            run(text, &sets)
        };
        let found = Orders::new(sheet, [4, 8, 16].map(level).to_vec());
        let [v, p] = [VELOCITY, POLARITY].map(|field| found.of(field, Norm::Square));
        assert!(v >= 2.75 && p >= of_polarity, "{sheet}: orders {v:.2} of v and {p:.2} of p");
    }
}
