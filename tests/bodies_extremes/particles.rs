//! Bodies with nothing between them.

use std::f64::consts::PI;

use crate::common::{Left, disc, particles, run, segment, with_threads};

const FALL: &str = "gravity = [\"0\", \"-1\"]";

fn floor() -> String {
    segment([-50.0, 0.0], [50.0, 0.0])
}

/// Nothing may overlap, nothing may get energy from nowhere.
fn no_overlap(left: &Left, most: f64) {
    let overlap = left.most("overlap");
    assert!(overlap <= most, "overlap {overlap:e}, allowed {most:e}");
}

#[test]
fn a_gap_of_1e_14_closes_and_nothing_blows_up() {
    for contact in ["", "[contact]\nlaw = \"gluey\""] {
        let pair = |v: f64| {
            disc("left", 0.5, 0.0, 0.0, &format!("velocity = [{v:?}, 0.0]")) + &disc("right", 0.5, 1.0 + 1e-14, 0.0, "")
        };
        let closing = run(&particles("", &(pair(1.0) + contact), 0.1, 1.0)).ended();
        no_overlap(&closing, 1e-12);
        for name in ["left", "right"] {
            assert!((closing.last(name).vx - 0.5).abs() < 1e-12, "{:?}", closing.last(name));
        }
        let energy = 0.5 * 2.0 * PI * 0.25 * 0.25;
        assert!((closing.measure("kinetic_energy") / energy - 1.0).abs() < 1e-12);
        let opening = run(&particles("", &(pair(-1.0) + contact), 0.1, 1.0)).ended();
        assert!((opening.last("left").x + 1.0).abs() < 1e-12, "{contact}: {:?}", opening.last("left"));
    }
}

/// A gap of 1e-14 on all sides, and a push that closes all of them.
#[test]
fn a_row_with_gaps_of_1e_14_is_pressed_against_a_wall() {
    let pitch = 0.2 + 1e-14;
    let row: String = (0..20)
        .map(|k| {
            disc(&format!("d{k}"), 0.1, 0.1 + 1e-14 + pitch * f64::from(k), 0.0, "force = [\"-1000*mass\", \"0\"]")
        })
        .collect();
    let left = run(&particles("", &(row + &segment([0.0, 5.0], [0.0, -5.0])), 0.01, 0.2)).ended();
    no_overlap(&left, 1e-12);
    assert!(left.most("kinetic_energy") < 1e-12, "{}", left.most("kinetic_energy"));
    let force = left.measure("wall_force_x1") / (20.0 * 1000.0 * PI * 0.01);
    assert!((force + 1.0).abs() < 1e-9, "force over weight {force}");
}

#[test]
fn a_mass_ratio_of_1e9_light_between_heavy_and_wall() {
    let bodies = disc("light", 0.5, 0.0, 0.5, "density = 1e-9") + &disc("heavy", 0.5, 0.0, 1.5, "");
    let left = run(&particles(FALL, &(bodies + &floor()), 0.01, 0.5)).ended();
    no_overlap(&left, 1e-11);
    let weight = PI * 0.25 * (1.0 + 1e-9);
    assert!((left.measure("wall_force_x2") / weight + 1.0).abs() < 1e-6, "{}", left.measure("wall_force_x2"));
    assert!((left.last("heavy").y - 1.5).abs() < 1e-10, "{:?}", left.last("heavy"));
    // and it may be driven into the light one at speed
    let driven = disc("light", 0.5, 0.0, 0.6, "density = 1e-9") + &disc("heavy", 0.5, 0.0, 1.7, "velocity = [0, -10]");
    let left = run(&particles(FALL, &(driven + &floor()), 0.01, 0.5)).ended();
    no_overlap(&left, 1e-11);
    assert!(left.last("heavy").y >= 1.5 - 1e-11 && left.last("heavy").vy.abs() < 1e-5, "{:?}", left.last("heavy"));
}

#[test]
fn a_mass_ratio_of_1e9_heavy_on_many_light_ones() {
    let mut bodies: String =
        (0..5).map(|k| disc(&format!("light{k}"), 0.5, f64::from(k), 0.5, "density = 1e-9")).collect();
    bodies += "[[body]]\nname = \"slab\"\nshape = { polygon = { vertices = [[-0.5, 1.0], [4.5, 1.0], [4.5, 2.0], [-0.5, 2.0]] } }\n";
    let left = run(&particles(FALL, &(bodies + &floor()), 0.01, 0.3)).ended();
    no_overlap(&left, 1e-11);
    let slab = left.last("slab");
    assert!((slab.y - 1.5).abs() < 1e-9 && slab.theta.abs() < 1e-9, "{slab:?}");
    assert!((left.measure("wall_force_x2") / 5.0 + 1.0).abs() < 1e-6);
}

#[test]
fn a_stack_of_100_discs_rests() {
    let bodies: String = (0..100).map(|k| disc(&format!("d{k}"), 0.05, 0.0, 0.05 + 0.1 * f64::from(k), "")).collect();
    let left = run(&particles(FALL, &(bodies + &floor()), 0.01, 0.3)).ended();
    no_overlap(&left, 1e-9 * 0.05);
    let weight = 100.0 * PI * 0.0025;
    let mut table = csv::Reader::from_path(left.folder.path().join("out/history.csv")).unwrap();
    let at = table.headers().unwrap().iter().position(|name| name == "wall_force_x2").unwrap();
    for row in table.records().map(Result::unwrap) {
        let force: f64 = row[at].parse().unwrap();
        assert!((force / weight + 1.0).abs() < 1e-8, "force over weight {}", force / weight);
    }
    for k in 0..100 {
        let body = left.last(&format!("d{k}"));
        assert!((body.y - 0.05 - 0.1 * f64::from(k)).abs() < 1e-11 && body.x == 0.0, "{body:?}");
    }
}

#[test]
fn a_radius_ratio_of_1000() {
    let mut bodies = disc("large", 1.0, 0.0, 1.0 + 5e-3, "");
    bodies +=
        &(0..60).map(|k| disc(&format!("d{k}"), 1e-3, -0.06 + 2.1e-3 * f64::from(k), 1e-3, "")).collect::<String>();
    let left = run(&particles(FALL, &(bodies + &floor()), 0.01, 0.5)).ended();
    no_overlap(&left, 1e-12);
    let large = left.last("large").y;
    assert!((1.0..1.0 + 2.1e-3).contains(&large), "the large disc lies at {large}");
    let weight = PI * (1.0 + 60.0 * 1e-6);
    assert!((left.measure("wall_force_x2") / weight + 1.0).abs() < 1e-6, "{}", left.measure("wall_force_x2") / weight);
}

/// Without walls a body goes wherever it likes.
#[test]
fn a_particle_that_leaves_everything_behind() {
    let body = disc("far", 0.1, 0.0, 0.0, "velocity = [1e9, -1e9]") + &disc("home", 0.1, 0.0, 1.0, "");
    let left = run(&particles("", &body, 0.5, 5.0)).ended();
    let far = left.last("far");
    assert!((far.x - 5e9).abs() < 1e-5 && (far.y + 5e9).abs() < 1e-5, "{far:?}");
    assert_eq!((left.last("home").x, left.last("home").y), (0.0, 1.0));
}

/// Ten in a heap, each touching its neighbours.
fn cluster(more: &str) -> String {
    let rows = [4, 3, 2, 1];
    let mut bodies = String::new();
    for (k, count) in rows.into_iter().enumerate() {
        for i in 0..count {
            let x = 0.2 * f64::from(i) + 0.1 * k as f64;
            let y = 0.1 + 0.1 * 3.0f64.sqrt() * (1.0 + 1e-13) * k as f64;
            bodies += &disc(&format!("d{k}-{i}"), 0.1, x, y, more);
        }
    }
    bodies
}

/// One disc of mass π/100 on the floor, pressed for 1 and pulled from then on.
fn glued(gamma_min: &str) -> Left {
    let contact = format!("[contact]\nlaw = \"gluey\"\ngamma_min = {gamma_min}\n");
    let one = disc("one", 0.1, 0.0, 0.1, "force = [\"0\", \"if(t < 1, -mass, mass)\"]");
    run(&particles("", &(one + &floor() + &contact), 0.01, 2.5)).ended()
}

#[test]
fn thresholds_of_roughness_0_1_and_infinity() {
    let [none, some, all] = ["0.0", "-1.0", "-inf"].map(glued);
    // γ̇ = −λ/r², so that γ = −π t: what γ_min lets stay is pulled off in 1/π
    let leaves = |left: &Left| left.track("one").into_iter().find(|row| row.y > 0.1 + 1e-9).expect("it leaves").time;
    for (left, time) in [(&none, 1.0), (&some, 1.0 + 1.0 / PI), (&all, 2.0)] {
        no_overlap(left, 1e-12);
        assert!((leaves(left) - time).abs() < 0.03, "it leaves at {} and not at {time}", leaves(left));
    }
}

#[test]
fn a_heap_of_ten_without_glue_is_the_one_of_inelastic_contact() {
    let force = "force = [\"0\", \"if(t < 1, -mass, mass)\"]";
    let heap = |contact: &str| run(&particles("", &(cluster(force) + &floor() + contact), 0.01, 2.5)).ended();
    let (dry, none) = (heap(""), heap("[contact]\nlaw = \"gluey\"\ngamma_min = 0.0\n"));
    no_overlap(&dry, 1e-11);
    assert!((dry.last("d0-0").y - 0.1 - 0.5 * 1.5 * 1.5).abs() < 0.03, "{:?}", dry.last("d0-0"));
    let worst = dry.rows.iter().zip(&none.rows).map(|(a, b)| (a.x - b.x).hypot(a.y - b.y)).fold(0.0, f64::max);
    assert!(dry.rows.len() == none.rows.len() && worst < 1e-9, "they differ by {worst:e}");
}

#[test]
fn a_force_of_1e12_goes_neither_through_walls_nor_through_bodies() {
    let pushed = "force = [\"1e12\", \"-1e12\"]";
    let bodies = disc("a", 0.1, 0.1, 0.15, pushed) + &disc("b", 0.1, 0.5, 0.1, "") + &disc("c", 0.02, 0.9, 0.5, pushed);
    let walls = segment([0.0, 0.0], [2.0, 0.0]) + &segment([2.0, 0.0], [2.0, 2.0]);
    let left = run(&particles("", &(bodies + &walls), 0.01, 0.1)).ended();
    no_overlap(&left, 1e-10);
    for row in &left.rows {
        let radius = if row.body == "c" { 0.02 } else { 0.1 };
        assert!(row.y >= radius - 1e-9 && row.x <= 2.0 - radius + 1e-9, "{row:?}");
    }
    assert!(left.last("b").x > left.last("a").x, "one went through the other");
    let force = left.measure("wall_force_x1");
    assert!((force / 2e12 - 1.0).abs() < 1e-6, "{force:e}");
}

#[test]
fn without_forces_nothing_moves_by_a_bit() {
    let spinning = "[contact]\nlaw = \"gluey\"\n";
    for contact in ["", spinning] {
        let left = run(&particles("", &(cluster("") + &floor() + contact), 0.01, 1.0)).ended();
        for body in left.rows.iter().map(|row| row.body.clone()).collect::<std::collections::BTreeSet<_>>() {
            let track = left.track(&body);
            assert_eq!(track.len(), 101, "a row for each step");
            let place =
                |row: &crate::common::Row| [row.x, row.y, row.theta, row.vx, row.vy, row.spin].map(f64::to_bits);
            assert!(track.iter().all(|row| place(row) == place(track[0])), "`{body}` moved: {:?}", track.last());
        }
        assert_eq!(left.most("kinetic_energy"), 0.0);
    }
}

#[test]
fn steps_of_10_go_through_nothing() {
    let bodies = disc("a", 0.1, 0.5, 5.0, "velocity = [3, -7]")
        + &disc("b", 0.1, 0.6, 2.0, "velocity = [-5, 1]")
        + "[[body]]\nname = \"bar\"\nshape = { capsule = { length = 0.6, radius = 0.05 } }\nposition = [1.4, 1.0]\nspin = 0.3\n";
    let walls = segment([0.0, 0.0], [2.0, 0.0]) + &segment([2.0, 0.0], [2.0, 90.0]) + &segment([0.0, 90.0], [0.0, 0.0]);
    let left = run(&particles(FALL, &(bodies + &walls), 10.0, 100.0)).ended();
    no_overlap(&left, 1e-9);
    for row in &left.rows {
        assert!((0.04..=1.96).contains(&row.x) && row.y >= 0.04, "{row:?}");
    }
    let (a, b) = (left.last("a"), left.last("b"));
    assert!((a.x - b.x).hypot(a.y - b.y) >= 0.2 - 1e-9, "{a:?} {b:?}");
}

#[test]
fn a_pinned_body_with_a_torque_turns_about_its_pin() {
    let bar = |more: &str| {
        format!(
            "[[body]]\nname = \"bar\"\nshape = {{ polygon = {{ vertices = [[0, 0], [2, 0], [2, 0.2], [0, 0.2]] }} }}\n\
             motion = {{ pinned = [0, 0.1] }}\n{more}\n"
        )
    };
    // about the pin: I + m d²
    let about = 0.4 * (4.0 + 0.04) / 12.0 + 0.4;
    let left = run(&particles("", &bar("torque = \"0.3\""), 0.01, 2.0)).ended();
    let last = left.last("bar");
    assert!((last.spin - 0.3 / about * 2.0).abs() < 1e-10, "{last:?}, {about}");
    let (s, c) = last.theta.sin_cos();
    assert!((last.x - c).abs() < 1e-9 && (last.y - 0.1 - s).abs() < 1e-9, "{last:?}");
    let slow = run(&particles("dynamics = \"overdamped\"\ndrag = 2.0", &bar("torque = \"0.3\""), 0.01, 1.0)).ended();
    assert!((slow.last("bar").spin - 0.3 / (2.0 * about)).abs() < 1e-10, "{:?}", slow.last("bar"));
    // a weight at the centre, against the torque that carries it
    let balanced = bar("torque = \"mass\"\nforce = [\"0\", \"-mass\"]");
    let still = run(&particles("", &balanced, 0.01, 1.0)).ended();
    assert!(still.last("bar").theta.abs() < 1e-12, "{:?}", still.last("bar"));
}

#[test]
fn particles_have_the_same_bits_with_one_thread_and_two() {
    let scene = particles(
        FALL,
        &format!(
            "[[bodies]]\ncount = 60\nradius = [0.02, 0.05]\nbox = [[0, 0], [1, 2]]\n{}{}{}[contact]\nlaw = \"gluey\"\ngamma_min = -0.1\n",
            segment([0.0, 3.0], [0.0, 0.0]),
            segment([0.0, 0.0], [1.0, 0.0]),
            segment([1.0, 0.0], [1.0, 3.0])
        ),
        0.01,
        1.0,
    );
    let [one, two] = [1, 2].map(|threads| with_threads(threads, || run(&scene).ended()));
    assert!(one.most("contacts") > 10.0);
    for file in ["bodies.csv", "history.csv", "checkpoint.bin"] {
        assert!(one.bytes(file) == two.bytes(file), "{file} differs");
    }
}
