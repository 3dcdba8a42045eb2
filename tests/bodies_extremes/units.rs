//! The same dimensionless motion of bodies in any unit of length.

use crate::common::{Left, Row, run, try_to_run};

const UNITS: [f64; 6] = [1e-9, 1e-7, 1e-3, 1e3, 1e8, 1e9];

/// A scene whose lengths, marked as `<0.1>`, `<0.1|L2>` and so on, are multiples of a power of the unit.
fn in_unit(text: &str, unit: f64) -> String {
    let mut parts = text.split('<');
    let mut out = parts.next().unwrap().to_owned();
    for part in parts {
        let (marked, rest) = part.split_once('>').expect("a mark ends");
        let (value, power) = marked.split_once("|L").unwrap_or((marked, "1"));
        let value: f64 = value.parse().expect("a number");
        out += &format!("{:e}{rest}", value * unit.powi(power.parse().expect("a power")));
    }
    out
}

/// A row without units: place, angle, velocity, spin, and the force and torque of contact, whose powers are given.
fn plain(row: &Row, unit: f64, [force, torque]: [i32; 2]) -> [f64; 9] {
    let (force, torque) = (unit.powi(force), unit.powi(torque));
    let Row { x, y, theta, vx, vy, spin, fx, fy, torque: turning, .. } = *row;
    [x / unit, y / unit, theta, vx / unit, vy / unit, spin, fx / force, fy / force, turning / torque]
}

/// All rows and measures are those of the unit 1, up to rounding of what is largest in a column.
fn alike_in_all_units(text: &str, powers: [i32; 2]) {
    let reference = run(&in_unit(text, 1.0)).ended();
    assert!(reference.most("contacts") >= 2.0, "they meet: {}", reference.most("contacts"));
    let expected: Vec<_> = reference.rows.iter().map(|row| plain(row, 1.0, powers)).collect();
    for unit in UNITS {
        let left = match try_to_run(&in_unit(text, unit)) {
            Ok(left) => left.ended(),
            // of lengths that nobody can mean
            Err(message) => {
                assert!(unit == 1e-9 && message.contains("choose a unit in which lengths are near 1"), "{message}");
                continue;
            }
        };
        let counts = |left: &Left| (left.summary.counts.steps, left.summary.counts.rejected);
        assert_eq!(counts(&left), counts(&reference), "L = {unit:e}");
        assert_eq!(left.rows.len(), reference.rows.len());
        for column in 0..9 {
            let size = expected.iter().fold(0.0_f64, |most, row| most.max(row[column].abs()));
            for (row, expected) in left.rows.iter().zip(&expected) {
                let found = plain(row, unit, powers)[column];
                let off = (found - expected[column]).abs() / size.max(f64::MIN_POSITIVE);
                assert!(
                    off < 1e-9,
                    "L = {unit:e}: column {column} of `{}` at {} is off by {off:e}",
                    row.body,
                    row.time
                );
            }
        }
    }
}

const EVERY: &str = r#"
[[output]]
bodies = true
every = { time = 0.1 }
[[output]]
measures = ["gap", "overlap", "contacts"]
every = { time = 0.1 }
"#;

/// A floor and a side, discs, a capsule and a polygon that fall on them, one on a spring, one led, one that turns about
/// a pin.
const PARTICLES: &str = r#"
[model]
kind = "particles"
gravity = ["0", "<-1>"]
drag = 0.3
[[wall]]
segment = [[<-3>, <0>], [<3>, <0>]]
[[wall]]
segment = [[<3>, <0>], [<3>, <3>]]
[[body]]
name = "low"
shape = { disc = { radius = <0.2> } }
position = [<0>, <0.25>]
[[body]]
name = "high"
shape = { disc = { radius = <0.15> } }
position = [<0.05>, <0.7>]
velocity = [<0.1>, <-0.5>]
[[body]]
name = "rod"
shape = { capsule = { length = <0.6>, radius = <0.06> } }
position = [<1>, <0.5>]
angle = 0.4
spin = 0.5
[[body]]
name = "stone"
shape = { polygon = { vertices = [[<1.8>, <0.3>], [<2.2>, <0.3>], [<2.1>, <0.7>]] } }
velocity = [<0.9>, <0>]
[[body]]
name = "spring"
shape = { disc = { radius = <0.1> } }
position = [<-1.5>, <1>]
force = ["-50*mass*(x - <-1.2>)", "mass*<1>"]
[[body]]
name = "led"
shape = { disc = { radius = <0.1> } }
position = [<-0.8>, <0.12>]
motion = { held = { velocity = ["<0.6>", "0"] } }
[[body]]
name = "pinned"
shape = { capsule = { length = <0.5>, radius = <0.05> } }
position = [<-2.4>, <1>]
motion = { pinned = [<-2.2>, <1>] }
"#;

const FOR_1: &str = "[time]\nstep = 0.02\nend = 1.0\n";

#[test]
fn particles_fall_alike_in_any_unit() {
    for contact in ["", "[contact]\nmargin = <0.001>\n", "[contact]\nlaw = \"gluey\"\ngamma_min = <-0.1>\n"] {
        alike_in_all_units(&[PARTICLES, contact, FOR_1, EVERY].concat(), [3, 4]);
    }
    // γ_d m V = F
    let overdamped = PARTICLES.replace("drag = 0.3", "drag = 1.3\ndynamics = \"overdamped\"");
    let overdamped = overdamped.replace("velocity = [<0.1>, <-0.5>]\n", "").replace("velocity = [<0.9>, <0>]\n", "");
    alike_in_all_units(&[&overdamped.replace("spin = 0.5\n", ""), FOR_1, EVERY].concat(), [3, 4]);
}

/// A sheared square with friction in which discs, a rod and a pinned rod are pushed on each other and on a side.
const STOKES: &str = r#"
[model]
kind = "stokes"
friction = <3|L-2>
[mesh]
shape = "square"
n = 6
length = [<0>, <1>]
[boundary.left]
velocity = { dirichlet = ["y", "0"] }
[boundary.right]
velocity = { dirichlet = ["y", "0"] }
[boundary.bottom]
velocity = { dirichlet = ["0", "0"] }
[boundary.top]
velocity = { dirichlet = ["<1>", "0"] }
[source]
force = ["0", "<0.5|L-1>"]
[[body]]
name = "pushed"
shape = { disc = { radius = <0.1> } }
position = [<0.3>, <0.5>]
force = ["<2>", "0"]
torque = "<0.1|L2>"
[[body]]
name = "rod"
shape = { capsule = { length = <0.3>, radius = <0.05> } }
position = [<0.5>, <0.5>]
angle = 1.2
[[body]]
name = "post"
shape = { disc = { radius = <0.08> } }
position = [<0.7>, <0.6>]
motion = "fixed"
[[body]]
name = "down"
shape = { disc = { radius = <0.07> } }
position = [<0.3>, <0.14>]
force = ["0", "<-8>"]
[[wall]]
tag = "bottom"
"#;

const FOR_A_HALF: &str = "[time]\nstep = 0.05\nend = 0.5\n";

#[test]
fn bodies_in_a_flow_move_alike_in_any_unit() {
    // a force per depth is viscosity times velocity, and γ a force times time over an area
    for contact in ["[contact]\n", "[contact]\nlaw = \"gluey\"\ngamma_min = <-2|L-1>\n"] {
        // where a disc is tangent to a wall, rounding decides which sliver is fluid: 2e-9 of the force of contact there
        let kept_apart = [contact, "margin = <0.01>\n"].concat();
        let penalty = ["[rigid]\nmethod = \"penalty\"\n", contact].concat();
        for rest in [kept_apart, penalty] {
            alike_in_all_units(&[STOKES, &rest, FOR_A_HALF, EVERY].concat(), [1, 2]);
        }
    }
    let order = "[rigid]\norder = 1\nepsilon = 1e-6\n";
    alike_in_all_units(&[STOKES, order, FOR_A_HALF, EVERY].concat(), [1, 2]);
}
