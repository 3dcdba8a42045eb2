//! Bodies in a tissue.

use crate::common::{disc, has, refused, run, tissue, with_threads};

#[test]
fn penalties_from_1e_2_to_1e_14() {
    let speed = |epsilon: f64| {
        let rest = format!("{}[rigid]\nepsilon = {epsilon:?}\n", disc("disc", 0.6, 0.1, 0.05, ""));
        let left = run(&tissue(&rest, 0.05, 0.1)).ended();
        let row = left.last("disc").clone();
        [row.vx, row.vy, row.spin]
    };
    let limit = speed(1e-14);
    assert!((0.5..3.0).contains(&limit[0]), "{limit:?}");
    for epsilon in [1e-2, 1e-6, 1e-8, 1e-10] {
        let error = speed(epsilon).iter().zip(limit).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // the coupling stops at 1e-8
        assert!(error < 3.0 * epsilon + 1e-7, "ε {epsilon:e}: {error:e}");
    }
}

#[test]
fn a_body_a_thousandth_of_a_cell_goes_with_the_tissue() {
    let left = run(&tissue(&disc("tiny", 8e-4, 0.05, 0.03, "friction = 3.0"), 0.1, 0.2)).ended();
    let row = left.last("tiny");
    assert!((row.vx - 1.0).abs() < 0.1 && row.vy.abs() < 0.05, "{row:?}");
}

#[test]
fn long_steps_and_huge_forces_go_through_no_wall() {
    let walls = "[[wall]]\ntag = \"walls\"\n[contact]\nmargin = 0.05\n";
    let rest = disc("pushed", 0.4, -1.0, 0.0, "force = [\"-300\", \"1e3\"]") + walls;
    let left = run(&tissue(&rest, 0.1, 0.3));
    assert!(left.rows.len() > 1, "{:?}", left.summary.ending);
    for row in &left.rows {
        assert!(row.y <= 2.0 - 0.4 + 1e-9, "{row:?}");
    }
}

#[test]
fn a_tissue_has_the_same_bits_with_one_thread_and_two() {
    let scene = tissue(&(disc("a", 0.5, -0.8, 0.1, "") + &disc("b", 0.3, 0.4, 0.0, "friction = 10.0")), 0.1, 0.3);
    let [one, two] = [1, 2].map(|threads| with_threads(threads, || run(&scene).ended()));
    for file in ["bodies.csv", "history.csv", "checkpoint.bin"] {
        assert!(one.bytes(file) == two.bytes(file), "{file} differs");
    }
}

#[test]
fn a_searched_steady_state_with_bodies_that_move_is_refused() {
    let scene = tissue(&disc("a", 0.5, -0.8, 0.1, ""), 0.1, 0.3) + "[steady]\n";
    has(&refused(&scene), &["`steady`", "no steady state"]);
}

#[test]
fn steps_that_a_tissue_halves_are_counted() {
    let body = disc("ball", 0.6, 0.3, 0.0, "force = [\"-600*(x-0.2)\", \"-600*y\"]");
    let left = run(&tissue(&body, 0.1, 0.1)).ended();
    let counts = left.summary.counts;
    assert!(counts.rejected > 0 && counts.steps > 1, "{counts:?}");
    let mut table = csv::Reader::from_path(left.folder.path().join("out/history.csv")).unwrap();
    let at = table.headers().unwrap().iter().position(|name| name == "rejected").expect("a column");
    let sum: f64 = table.records().map(|row| row.unwrap()[at].parse::<f64>().unwrap()).sum();
    assert_eq!(sum, counts.rejected as f64);
    let last = left.last("ball");
    assert!((last.x - 0.2).abs() < 0.1 && last.y.abs() < 0.1, "{last:?}");
}
