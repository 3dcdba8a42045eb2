//! Bodies with nothing between them.

use std::f64::consts::PI;

use crate::common::{Left, disc, particles, resume, run, segment, with_threads};

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
    bodies += "[[body]]\nname = \"slab\"\nshape = \
               { polygon = { vertices = [[-0.5, 1.0], [4.5, 1.0], [4.5, 2.0], [-0.5, 2.0]] } }\n";
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
        + "[[body]]\nname = \"bar\"\nshape = { capsule = { length = 0.6, radius = 0.05 } }\nposition = [1.4, 1.0]\n\
           spin = 0.3\n";
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
            "[[bodies]]\ncount = 60\nradius = [0.02, 0.05]\nbox = [[0, 0], [1, 2]]\n{}{}{}[contact]\nlaw = \"gluey\"\n\
             gamma_min = -0.1\n",
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

/// Places of a body by time.
fn places(left: &Left, body: &str) -> Vec<[f64; 2]> {
    left.track(body).iter().map(|row| [row.time, row.x]).collect()
}

/// Largest distance from `0.3 + 0.2 cos(ωt)`, relative to the amplitude.
fn off_phase(left: &Left, omega: f64) -> f64 {
    let off = |[t, x]: &[f64; 2]| (x - 0.3 - 0.2 * (omega * t).cos()).abs();
    places(left, "ball").iter().map(off).fold(0.0, f64::max) / 0.2
}

#[test]
fn a_stiff_spring_swings_with_its_period_whatever_the_step() {
    let spring = disc("ball", 0.1, 0.5, 0.0, "force = [\"-410*mass*(x-0.3)\", \"0\"]");
    let left = run(&coarse(&particles("", &spring, 0.1, 10.0))).ended();
    let omega = 410.0_f64.sqrt();
    let worst = off_phase(&left, omega);
    assert!(worst < 1e-3, "off by {worst} of the amplitude");
    assert!(left.summary.counts.rejected > 0);
    assert!(left.summary.said.iter().any(|note| note.contains("steps are shortened") && note.contains("`ball`")));
    // the table of steps counts them
    let steps = run(&particles("", &spring, 0.1, 3.0)).ended();
    assert!(steps.summary.counts.rejected > 0 && steps.most("rejected") > 0.0 && off_phase(&steps, omega) < 1e-3);
    // outputs land on their times, and a shorter tolerance is nearer
    let finer = particles("", &spring, 0.1, 3.0).replace("end = 3.0", "end = 3.0\ntolerance = 1e-4");
    let finer = run(&finer.replace("every = { steps = 1 }", "every = { time = 0.25 }")).ended();
    assert_eq!(places(&finer, "ball").len(), 13);
    assert!(off_phase(&finer, omega) < 0.1 * worst, "off by {}", off_phase(&finer, omega));
    // 1592 periods
    let stiff = spring.replace("410", "1e6");
    let hard = particles("", &stiff, 0.1, 10.0).replace("every = { steps = 1 }", "every = { time = 0.5 }");
    let worst = off_phase(&run(&hard).ended(), 1e3);
    assert!(worst < 1e-3, "off by {worst} of the amplitude");
}

/// The scene with fewer outputs.
fn coarse(scene: &str) -> String {
    scene.replace("every = { steps = 1 }", "every = { time = 0.05 }")
}

#[test]
fn springs_with_drag_pins_and_a_load_of_time_keep_their_phase() {
    // x″ + γx′ + ω²x = sin(3t), from rest at 0.2
    let (gamma, square) = (0.7_f64, 400.0_f64);
    let one = disc("ball", 0.1, 0.2, 0.0, "force = [\"mass*(-400*x + sin(3*t))\", \"0\"]");
    let left = run(&coarse(&particles("drag = 0.7", &one, 0.1, 5.0))).ended();
    let (real, imaginary) = (square - 9.0, 3.0 * gamma);
    let size = real * real + imaginary * imaginary;
    let (s, c) = (real / size, -imaginary / size);
    let (half, omega) = (0.5 * gamma, (square - 0.25 * gamma * gamma).sqrt());
    let a = 0.2 - c;
    let b = (half * a - 3.0 * s) / omega;
    let exact = |t: f64| {
        (-half * t).exp() * (a * (omega * t).cos() + b * (omega * t).sin()) + s * (3.0 * t).sin() + c * (3.0 * t).cos()
    };
    let worst = places(&left, "ball").iter().map(|[t, x]| (x - exact(*t)).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-3 * 0.2, "off by {worst}");
    // about a pivot, by a small angle: I_p θ″ = −k I_p θ
    let bar = "[[body]]\nname = \"bar\"\nshape = { capsule = { length = 0.8, radius = 0.1 } }\nposition = [0.0, 0.0]\n\
        angle = 0.01\n\
        motion = { pinned = [-0.3, 0.0] }\ntorque = \"-400*(inertia + 0.09*mass)*theta\"\n";
    let left = run(&coarse(&particles("", bar, 0.1, 5.0))).ended();
    let off = |row: &&crate::common::Row| (row.theta - 0.01 * (20.0 * row.time).cos()).abs();
    let worst = left.track("bar").iter().map(off).fold(0.0, f64::max);
    assert!(worst < 1e-3 * 0.01, "off by {worst}");
}

#[test]
fn a_spring_presses_against_a_floor_and_lets_go() {
    // at rest on the floor the spring presses with 400·0.1·mass
    let ball = disc("ball", 0.1, 0.0, 0.1, "force = [\"0\", \"-400*mass*y\"]");
    let left = run(&particles("", &(ball + &floor()), 0.01, 0.5)).ended();
    no_overlap(&left, 1e-12);
    let force = left.measure("wall_force_x2") / (40.0 * PI * 0.01);
    assert!((force + 1.0).abs() < 1e-9 && left.most("kinetic_energy") < 1e-20, "force over weight {force}");
    // from above it meets the floor at t = acos(1/4)/ω and stays
    let ball = disc("ball", 0.1, 0.0, 0.4, "force = [\"0\", \"-400*mass*y\"]");
    let left = run(&particles("", &(ball + &floor()), 0.01, 0.5)).ended();
    no_overlap(&left, 1e-12);
    let meets = 0.25_f64.acos() / 20.0;
    for row in left.track("ball") {
        let exact = if row.time < meets { 0.4 * (20.0 * row.time).cos() } else { 0.1 };
        assert!((row.y - exact).abs() < 1e-4, "{row:?}, not at {exact}");
    }
}

#[test]
fn a_swing_keeps_its_amplitude_over_many_periods_of_a_hard_spring() {
    // the force grows with the cube of the way, so the step would like to be longer where the ball turns
    let scene = particles("", &disc("ball", 0.1, 0.5, 0.0, "force = [\"-4000*mass*x^3\", \"0\"]"), 0.1, 10.0);
    let left = run(&scene.replace("every = { steps = 1 }", "every = { time = 0.02 }")).ended();
    let rows = places(&left, "ball");
    let late = rows.iter().filter(|[t, _]| *t > 9.0).map(|[_, x]| x.abs()).fold(0.0, f64::max);
    assert!((late - 0.5).abs() < 0.02, "the amplitude became {late}");
}

#[test]
fn forces_and_velocities_that_draw_back_settle_without_overshoot() {
    let drag = "dynamics = \"overdamped\"\ndrag = 1.0";
    let force = disc("ball", 0.1, 0.5, 0.0, "force = [\"-400*mass*(x-0.3)\", \"0\"]\ntorque = \"-50*inertia*theta\"");
    let held = disc("ball", 0.1, 0.5, 0.0, "motion = { held = { velocity = [\"-400*(x-0.3)\", \"0\"] } }");
    for scene in [particles(drag, &force, 0.1, 1.0), particles("", &held, 0.1, 1.0)] {
        let left = run(&scene.replace("every = { steps = 1 }", "every = { time = 0.01 }")).ended();
        let rows = places(&left, "ball");
        assert!(rows.windows(2).all(|pair| pair[1][1] <= pair[0][1] && pair[1][1] >= 0.3 - 1e-15), "{rows:?}");
        assert!((left.last("ball").x - 0.3).abs() < 1e-6, "{:?}", left.last("ball"));
    }
}

#[test]
fn what_explodes_has_failed() {
    let scene = particles("", &disc("ball", 0.1, 0.5, 0.0, "force = [\"410*mass*x\", \"0\"]"), 0.1, 10.0);
    let scene = scene.replace("every = { steps = 1 }", "every = { time = 1.0 }");
    let away = run(&scene.replace("[time]\n", "[time]\nstep_min = 1e-5\n"));
    assert!(away.reason().contains("`ball`") && away.reason().contains("scene.toml"), "{}", away.reason());
    let pushed = run(&particles("", &disc("ball", 0.1, 0.5, 0.0, "force = [\"1e15*mass\", \"0\"]"), 0.1, 10.0));
    assert!(pushed.reason().contains("the body `ball` is lost"), "{}", pushed.reason());
    let burst = run(&particles("", &disc("ball", 0.1, 0.5, 0.0, "force = [\"1e308\", \"0\"]"), 10.0, 10.0));
    assert!(burst.reason().contains("ball"), "{}", burst.reason());
}

#[test]
fn a_constant_force_takes_the_steps_of_the_scene() {
    let left =
        run(&particles(FALL, &(disc("ball", 0.1, 0.0, 0.5, "force = [\"sin(t)\", \"0\"]") + &floor()), 0.05, 2.0))
            .ended();
    assert_eq!((left.summary.counts.steps, left.summary.counts.rejected), (40, 0));
}

#[test]
fn a_rod_that_turns_fast_stops_at_what_is_in_its_way() {
    let rod =
        "[[body]]\nname = \"rod\"\nshape = { capsule = { length = 0.8, radius = 0.02 } }\nposition = [0.0, 0.0]\n";
    let post = disc("post", 0.05, 0.0, 0.3, "motion = \"fixed\"");
    let turning = format!("{rod}motion = {{ pinned = [0.0, 0.0] }}\nspin = 31.4159\n{post}");
    let left = run(&particles("", &turning, 0.1, 1.0)).ended();
    let last = left.last("rod");
    // it lies against the post: its axis passes the centre at the sum of the radii
    let against = 0.5 * std::f64::consts::PI - (0.07_f64 / 0.3).asin();
    assert!((last.theta - against).abs() < 1e-6 && last.spin.abs() < 1e-9, "{last:?}, {against}");
    no_overlap(&left, 1e-10);
    assert!(left.summary.counts.rejected > 0);
    // on a path nothing stops it: it carries a free disc along
    let ball = disc("ball", 0.05, 0.0, 0.3, "");
    let path = rod.replace(
        "position = [0.0, 0.0]\n",
        "motion = { path = { position = [\"0\", \"0\"], angle = \"31.4159*t\" } }\n",
    ) + &ball;
    let left = run(&particles("", &path, 0.1, 0.1)).ended();
    no_overlap(&left, 1e-9);
    assert!(left.last("ball").vx.hypot(left.last("ball").vy) > 3.0, "{:?}", left.last("ball"));
}

#[test]
fn a_fast_disc_passes_through_nothing_thin() {
    let wall = "[[body]]\nname = \"plate\"\nshape = { capsule = { length = 2.0, radius = 0.005 } }\nposition = [0.0, \
        0.0]\nangle = 1.2\nmotion = \"fixed\"\n";
    for obstacle in [wall.to_owned(), segment([0.4, 1.0], [-0.4, -1.0])] {
        let left =
            run(&particles("", &(disc("ball", 0.05, -3.0, 0.1, "velocity = [1000.0, 0.0]") + &obstacle), 0.1, 0.2))
                .ended();
        no_overlap(&left, 1e-9);
        // beside the obstacle it is on the side from which it came
        assert!(
            left.track("ball").iter().all(|row| row.y.abs() > 1.0 || row.x < 0.4 * row.y),
            "{:?}",
            left.last("ball")
        );
        // inelastic and without friction: what is left slides along the plate, about which steps are short
        let (last, along) = (left.last("ball"), 1.2_f64);
        let slides = 1000.0 * along.cos();
        let off = (last.vx - slides * along.cos()).hypot(last.vy - slides * along.sin());
        assert!(obstacle != wall || off < 1e-6 * slides, "{last:?} slides {off} beside its obstacle");
    }
    // beside it there is nothing to stop it
    let free =
        run(&particles("", &(disc("ball", 0.05, -3.0, 1.2, "velocity = [1000.0, 0.0]") + wall), 0.1, 0.2)).ended();
    assert!((free.last("ball").x - 197.0).abs() < 1e-9, "{:?}", free.last("ball"));
}

#[test]
fn given_bodies_that_are_led_into_each_other_overlap() {
    let held = disc("led", 0.2, -1.0, 0.0, "motion = { held = { velocity = [\"1\", \"0\"] } }");
    for (obstacle, name) in
        [(disc("post", 0.2, 0.0, 0.0, "motion = \"fixed\""), "`post`"), (segment([0.0, 1.0], [0.0, -1.0]), "wall 1")]
    {
        let left = run(&particles("", &format!("{held}{obstacle}"), 0.1, 2.0)).ended();
        let deepest = left.most("overlap");
        assert!(deepest > 0.15, "{deepest}");
        // at the end they are apart again, and the summary still knows
        assert_eq!(left.overlap(), deepest);
        assert!(left.summary.to_string().contains(&format!("largest overlap {deepest:.3e}")), "{}", left.summary);
        assert!(name != "`post`" || left.measure("overlap") == 0.0, "{}", left.measure("overlap"));
        let told = left
            .summary
            .said
            .iter()
            .filter(|note| note.contains("`led`") && note.contains(name) && note.contains("overlap"));
        assert!(told.count() >= 1, "{:?}", left.summary.said);
    }
    // the depth is that of the discs
    let left = run(&particles("", &(held + &disc("post", 0.2, 0.0, 0.0, "motion = \"fixed\"")), 0.1, 0.8)).ended();
    assert!((left.measure("overlap") - 0.2).abs() < 1e-9, "{}", left.measure("overlap"));
}

#[test]
fn the_largest_overlap_is_that_of_all_parts_of_a_run() {
    let bodies = disc("led", 0.2, -1.0, 0.0, "motion = { held = { velocity = [\"1\", \"0\"] } }")
        + &disc("post", 0.2, 0.0, 0.1, "motion = \"fixed\"");
    // nothing is measured
    let scene = |end: f64| {
        let text = particles("", &bodies, 0.1, end);
        text[..text.find("[[output]]").unwrap()].to_owned()
    };
    let first = run(&scene(1.0)).ended();
    assert!((first.overlap() - 0.3).abs() < 1e-9, "{}", first.overlap());
    let whole = resume(first, &scene(2.0)).ended();
    assert!((whole.summary.time - 2.0).abs() < 1e-12, "the led disc has passed: {}", whole.summary.time);
    assert!((whole.overlap() - 0.3).abs() < 1e-9, "{}", whole.overlap());
    let apart = run(&particles("", &disc("one", 0.2, 0.0, 0.0, ""), 0.1, 0.2)).ended();
    assert_eq!(apart.overlap(), 0.0);
    assert!(!apart.summary.to_string().contains("largest overlap"), "{}", apart.summary);
}

#[test]
fn a_path_that_turns_round_within_a_step_is_followed() {
    let path = "[[body]]\nname = \"a\"\nshape = { disc = { radius = 0.1 } }\nmotion = { path = { position = \
        [\"cos(20*pi*t)\", \"sin(20*pi*t)\"] } }\n";
    let left = run(&particles("", &(path.to_owned() + &disc("b", 0.1, -1.0, 0.0, "")), 0.1, 0.1)).ended();
    assert!(
        left.last("b").x.hypot(left.last("b").y + 0.0) > 1.0 && left.last("b").vy.abs() > 1.0,
        "{:?}",
        left.last("b")
    );
    no_overlap(&left, 1e-9);
}
