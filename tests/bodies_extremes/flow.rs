//! Bodies in a Stokes flow.

use crate::common::{Left, REST, disc, has, refused, resume, run, segment, stokes, with_threads};

const SHEAR: &str = "[\"0\", \"x\"]";
/// The penalty that makes every cell rigid in which a body is.
const FULL: &str = "[rigid]\nstrength = \"full\"\n";

/// Two steps so short that nothing moves.
fn once(n: usize, v: &str, bodies: &str) -> Left {
    run(&stokes(n, v, bodies, 1e-9, 2e-9)).ended()
}

/// The same by penalty.
fn by_penalty(n: usize, v: &str, bodies: &str, epsilon: f64) -> Left {
    once(n, v, &format!("{bodies}[rigid]\nepsilon = {epsilon:?}\n"))
}

#[test]
fn penalties_from_1e_2_to_1e_14_converge() {
    let twist = |epsilon: f64| {
        let left = by_penalty(10, SHEAR, &disc("disc", 0.2, 0.5, 0.5, "force = [\"1\", \"-3\"]"), epsilon);
        let row = left.last("disc").clone();
        [row.vx, row.vy, row.spin]
    };
    let limit = twist(1e-14);
    let error = |epsilon: f64| twist(epsilon).iter().zip(limit).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!((limit[2] - 0.5).abs() < 0.02, "{limit:?}");
    let errors = [1e-2, 1e-6, 1e-8, 1e-10].map(error);
    for (error, epsilon) in errors.iter().zip([1e-2, 1e-6, 1e-8, 1e-10]) {
        assert!(*error < 5.0 * epsilon + 1e-11, "ε {epsilon:e}: {error:e}");
    }
    assert!(errors[0] > 1e3 * errors[1], "the penalty has an effect: {errors:?}");
}

#[test]
fn a_body_over_a_wall_at_rest_rests_and_over_a_sliding_one_goes_along() {
    let left = once(8, REST, &disc("stuck", 0.15, 0.02, 0.5, "force = [\"0\", \"-100\"]"));
    assert!(left.last("stuck").vy.abs() < 1e-5, "{:?}", left.last("stuck"));
    let left = once(8, "[\"0\", \"2\"]", &disc("carried", 0.15, 0.02, 0.5, ""));
    let row = left.last("carried");
    assert!((row.vy - 2.0).abs() < 1e-8 && row.vx.abs() < 1e-8 && row.spin.abs() < 1e-7, "{row:?}");
    // no rigid motion has this velocity
    let message = refused(&stokes(
        8,
        "[\"y*(1-y)*(x-1)*0\", \"y^2*0 + if(x < 0.001, y*(1-y), 0)\"]",
        &disc("torn", 0.2, 0.02, 0.5, ""),
        0.1,
        1.0,
    ));
    has(&message, &["`torn`"]);
}

#[test]
fn a_body_at_a_vertex_and_one_along_the_mesh() {
    let square = "[[body]]\nname = \"fitted\"\nshape = \
                  { polygon = { vertices = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]] } }\n";
    let fitted = once(8, SHEAR, square);
    let row = fitted.last("fitted");
    assert!((row.spin - 0.5).abs() < 0.04 && (row.vy - 0.5).abs() < 0.02 && row.vx.abs() < 0.02, "{row:?}");
    // moved by rounding and by a little it does nearly the same
    for offset in [1e-15, 1e-12, 1e-8, 1e-4] {
        let moved = square.replace("0.25", &format!("{:?}", 0.25 - offset));
        let other = once(8, SHEAR, &moved);
        let row2 = other.last("fitted");
        assert!((row2.spin - row.spin).abs() < 0.02, "offset {offset:e}: {row2:?}");
    }
    // through the vertex (0.5, 0.5) with its centre, and with its edge through four vertices
    for radius in [0.25, 0.125, 0.17677669529663687] {
        let left = once(8, SHEAR, &disc("disc", radius, 0.5, 0.5, ""));
        let row = left.last("disc");
        assert!((row.spin - 0.5).abs() < 0.03 && (row.vy - 0.5).abs() < 1e-2, "radius {radius}: {row:?}");
    }
}

#[test]
fn a_body_a_thousandth_of_a_cell() {
    for position in [[0.53, 0.49], [0.5, 0.5], [0.5, 0.53]] {
        let left = once(8, SHEAR, &disc("tiny", 1.25e-4, position[0], position[1], ""));
        let row = left.last("tiny");
        assert!((row.vy - position[0]).abs() < 0.02 && row.vx.abs() < 0.02, "{position:?}: {row:?}");
    }
    // and it may be pushed
    let left = once(8, REST, &disc("tiny", 1.25e-4, 0.53, 0.49, "force = [\"1\", \"0\"]"));
    let row = left.last("tiny");
    assert!((0.05..2.0).contains(&row.vx), "{row:?}");
}

#[test]
fn two_bodies_in_a_cell() {
    let pair = disc("a", 0.02, 0.52, 0.51, "force = [\"1\", \"0\"]") + &disc("b", 0.02, 0.57, 0.52, "");
    let left = once(8, REST, &pair);
    let (a, b) = (left.last("a"), left.last("b"));
    // as on cells a sixteenth as long
    assert!((a.vx / 0.1637 - 1.0).abs() < 0.06 && (b.vx / 0.1385 - 1.0).abs() < 0.1, "{a:?} {b:?}");
    // the full penalty makes the cells rigid that they share
    let left = once(8, REST, &format!("{pair}{FULL}"));
    let (a, b) = (left.last("a"), left.last("b"));
    assert!(a.vx > 0.0 && (a.vx - b.vx).abs() < 0.05 * a.vx, "{a:?} {b:?}");
    // pressed together for some time
    let pressed =
        disc("a", 0.02, 0.52, 0.51, "force = [\"1\", \"0\"]") + &disc("b", 0.02, 0.57, 0.51, "force = [\"-1\", \"0\"]");
    let left = run(&stokes(8, REST, &pressed, 0.05, 0.5)).ended();
    assert!(left.most("overlap") < 1e-6 * 0.02, "{:e}", left.most("overlap"));
}

#[test]
fn steps_of_10_go_through_neither_walls_nor_bodies() {
    let walls: String = ["left", "right", "bottom", "top"].map(|tag| format!("[[wall]]\ntag = \"{tag}\"\n")).concat();
    let bodies = disc("a", 0.1, 0.4, 0.6, "force = [\"3\", \"-30\"]") + &disc("b", 0.1, 0.45, 0.3, "");
    let left = run(&stokes(8, REST, &(bodies + &walls + "[contact]\nmargin = 0.02\n"), 10.0, 50.0)).ended();
    for row in &left.rows {
        assert!((0.1..=0.9).contains(&row.x) && (0.1..=0.9).contains(&row.y), "{row:?}");
    }
    let (a, b) = (left.last("a"), left.last("b"));
    assert!((a.x - b.x).hypot(a.y - b.y) >= 0.2, "{a:?} {b:?}");
    assert!(left.most("gap") > 0.0);
}

#[test]
fn a_force_of_1e12_and_none() {
    let floor: &str = &["left", "right", "bottom", "top"].map(|tag| format!("[[wall]]\ntag = \"{tag}\"\n")).concat();
    let left =
        run(&stokes(6, REST, &(disc("a", 0.1, 0.5, 0.6, "force = [\"0\", \"-1e12\"]") + floor), 0.01, 0.05)).ended();
    assert!((left.last("a").y - 0.1).abs() < 1e-6, "{:?}", left.last("a"));
    let left = run(&stokes(6, REST, &(disc("a", 0.1, 0.5, 0.6, "") + floor), 0.1, 0.5)).ended();
    let row = left.last("a");
    assert_eq!([row.x, row.y, row.theta, row.vx, row.vy, row.spin], [0.5, 0.6, 0.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_gluey_cluster_of_ten_in_a_flow() {
    let mut bodies = String::new();
    for (k, count) in [4, 3, 2, 1].into_iter().enumerate() {
        for i in 0..count {
            let (x, y) =
                (0.35 + 0.1 * f64::from(i) + 0.05 * k as f64, 0.1 + 0.05 * 3.0f64.sqrt() * (1.0 + 1e-12) * k as f64);
            bodies += &disc(&format!("d{k}-{i}"), 0.05, x, y, "force = [\"0\", \"if(t < 0.05, -30, 30)*area\"]");
        }
    }
    let rest = bodies + &segment([0.0, 0.05], [1.0, 0.05]) + "[contact]\nlaw = \"gluey\"\n";
    for (rigid, together) in [("", false), (FULL, true)] {
        let left = run(&stokes(8, REST, &format!("{rest}{rigid}"), 0.01, 0.08)).ended();
        assert!(left.most("overlap") < 1e-7 * 0.05, "{:e}", left.most("overlap"));
        // pressed for 0.05, pulled for less: nobody has left the wall, nor the pile where its cells are rigid; else the
        // upper ones press those below apart, which nothing has pressed together
        for row in left.rows.iter().filter(|row| together || row.body.starts_with("d0")) {
            let first = left.track(&row.body)[0];
            assert!((row.y - first.y).abs() < 1e-6, "{row:?}");
        }
        let top = left.track("d3-0");
        let fallen = top.iter().map(|row| top[0].y - row.y).fold(0.0, f64::max);
        assert!(together || (1e-5..1e-2).contains(&fallen), "{fallen}");
    }
}

#[test]
fn a_flow_has_the_same_bits_with_one_thread_and_two() {
    let bodies = disc("a", 0.1, 0.4, 0.5, "force = [\"0\", \"-5\"]") + &disc("b", 0.07, 0.45, 0.3, "");
    let scene = stokes(8, SHEAR, &(bodies + "[[wall]]\ntag = \"bottom\"\n"), 0.05, 0.3);
    let [one, two] = [1, 2].map(|threads| with_threads(threads, || run(&scene).ended()));
    for file in ["bodies.csv", "history.csv", "checkpoint.bin"] {
        assert!(one.bytes(file) == two.bytes(file), "{file} differs");
    }
}

#[test]
fn a_force_that_draws_back_settles_without_overshoot() {
    let left =
        run(&stokes(8, REST, &disc("ball", 0.1, 0.5, 0.5, "force = [\"-400*(x-0.3)\", \"0\"]"), 0.1, 0.6)).ended();
    let track = left.track("ball");
    assert!(track.windows(2).all(|pair| pair[1].x <= pair[0].x + 1e-12 && pair[1].x > 0.3 - 1e-6), "{track:?}");
    assert!((left.last("ball").x - 0.3).abs() < 1e-3, "{:?}", left.last("ball"));
    assert!(left.summary.counts.rejected > 0);
    // resumed half-way it has the same bits
    let scene =
        |end: f64| stokes(8, REST, &disc("ball", 0.1, 0.5, 0.5, "force = [\"-400*(x-0.3)\", \"0\"]"), 0.05, end);
    let whole = run(&scene(0.2)).ended();
    let most = whole.summary.counts.steps / 2;
    let half = run(&scene(0.2).replace("end = 0.2", &format!("end = 0.2\nmax_steps = {most}")));
    let parts = resume(half, &scene(0.2)).ended();
    assert!(
        parts.bytes("checkpoint.bin") == whole.bytes("checkpoint.bin")
            && parts.bytes("bodies.csv") == whole.bytes("bodies.csv")
    );
}

#[test]
fn bodies_smaller_than_a_cell_are_told() {
    let told = |radius: f64| {
        let left =
            run(&stokes(8, REST, &disc("grain", radius, 0.43, 0.52, "force = [\"1\", \"0\"]"), 1e-9, 2e-9)).ended();
        left.summary.said.iter().filter(|note| note.contains("`grain` is not resolved")).cloned().collect::<Vec<_>>()
    };
    let note = &told(1e-3)[0];
    // cells of n = 8 have the size (2|K|)^½ = 1/8
    has(note, &["1.000e-3", "8.00e-3 of the cell", "1.250e-1"]);
    assert!(told(0.2).is_empty());
    // one that comes into larger cells is told there
    let sizes =
        "[[body]]\nname = \"rod\"\nshape = { capsule = { length = 0.3, radius = 0.01 } }\nposition = [0.5, 0.5]\n";
    let left = run(&stokes(8, REST, sizes, 1e-9, 2e-9)).ended();
    assert!(left.summary.said.iter().any(|note| note.contains("`rod` is not resolved")), "{:?}", left.summary.said);
}

#[test]
fn a_body_that_is_pushed_over_a_wall_is_told() {
    let pushed = |force: &str, rigid: &str| {
        let body = disc("pushed", 0.2, 0.5, 0.5, &format!("force = [\"{force}\", \"0\"]\n{rigid}"));
        let left = run(&stokes(4, REST, &body, 0.001, 0.05)).ended();
        let told = left.summary.said.iter().any(|note| note.contains("`pushed` reaches over the boundary"));
        (left.last("pushed").x, told)
    };
    let penalty = "[rigid]\nmethod = \"penalty\"\n";
    let (x, told) = pushed("1e3", penalty);
    assert!(x > 0.85 && told, "{x}, told: {told}");
    let (x, told) = pushed("1", penalty);
    assert!(x < 0.75 && !told, "{x}, told: {told}");
    // a boundary of the fluid squeezes no film to nothing
    let (x, told) = pushed("1e3", "");
    assert!((0.75..0.81).contains(&x) && !told, "{x}, told: {told}");
}
