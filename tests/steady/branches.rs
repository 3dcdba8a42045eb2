//! Branches with folds and forks whose places are known.

use std::sync::atomic::AtomicBool;

use crate::common::near;
use monolayer::model::fields::POLARITY;
use monolayer::output::progress::Verbosity;
use monolayer::steady::branch::{Branch, End, Point, Special};
use monolayer::study::BranchStudy;
use monolayer::study::branch::{Diagram, run};

/// A closed square about the axis.
const SCENE: &str = r#"
[model]
kind = "incompressible"
friction = 0.0
traction = 0.0
peclet = 1.0
coherence = 1.0

[mesh]
shape = "strip"
length = [0.0, 1.0]
width = 1.0
h = 0.5

[boundary.inlet]
velocity = "slip"
polarity = "neumann"
[boundary.outlet]
velocity = "slip"
polarity = "neumann"
[boundary.walls]
velocity = "slip"
polarity = "neumann"

[initial]
polarity = ["1", "0"]

[time]
scheme = "bdf2"
step = 0.5
end = 50.0

[[output]]
measures = ["asymmetry"]
"#;

fn diagram(scene: &str, study: &str) -> Diagram {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("scene.toml"), scene).unwrap();
    let file = root.path().join("branches.toml");
    std::fs::write(&file, study).unwrap();
    let study = BranchStudy::read(&file, &[]).unwrap();
    let found = run(&study, &root.path().join("out"), Verbosity::Quiet, &AtomicBool::new(false)).unwrap();
    println!("{found}");
    found
}

fn special(branch: &Branch) -> Vec<(Special, f64)> {
    branch.points.iter().filter_map(|point| Some((point.special?, point.parameter))).collect()
}

/// `p` if it is everywhere `(p, 0)`.
#[track_caller]
fn uniform(point: &Point) -> f64 {
    let p = &point.place.state[POLARITY];
    let first = p.values[0];
    for (k, value) in p.values.iter().enumerate() {
        let along = (k / p.space.n).is_multiple_of(2);
        near(*value, if along { first } else { 0.0 }, 1e-6, "polarity");
    }
    first
}

#[test]
fn folds_and_forks_of_a_cubic_are_found_where_they_are() {
    // without flow the alignment parameter acts on nothing, and may give the source f: uniform states obey s³ − s = f
    let scene = format!("{SCENE}\n[source]\npolarity = [\"slip\", \"0\"]\n");
    let study = r#"scene = "scene.toml"
parameter = "model.alignment"
range = [-1.0, 1.0]
start = 0.8
measure = "asymmetry_polarity"
max_branches = 1
"#;
    let found = diagram(&scene, study);
    assert_eq!(found.branches.len(), 2, "one each way");
    assert!(found.branches.iter().all(|branch| branch.curve == 0), "both are of one branch");
    assert_eq!(found.left, 2, "the branches at f = 0 are not followed");
    assert!(found.to_string().contains("1 branch, "), "{found}");
    assert!(found.to_string().contains("2 branches that begin were not followed: a larger `max_branches`"), "{found}");
    let fold = 2.0 / (3.0 * 3.0_f64.sqrt());
    let exact =
        [(Special::BranchPoint, 0.0), (Special::Fold, -fold), (Special::Fold, fold), (Special::BranchPoint, 0.0)];
    let places = special(&found.branches[0]);
    assert_eq!(places.len(), exact.len(), "{places:?}");
    for ((kind, f), (exact_kind, exact_f)) in places.iter().zip(exact) {
        assert_eq!(*kind, exact_kind, "{places:?}");
        near(*f, exact_f, 1e-4, "place");
    }
    assert!(special(&found.branches[1]).is_empty());
    for (branch, end) in found.branches.iter().zip([-1.0, 1.0]) {
        assert_eq!(branch.points.last().unwrap().parameter, end, "{}", branch.end);
        assert_eq!(branch.end, End::Range);
        for point in &branch.points {
            let s = uniform(point);
            near(s.powi(3) - s, point.parameter, 1e-7, "s³ − s");
            near(point.eigenvalues[0].re, (1.0 - s * s).max(1.0 - 3.0 * s * s), 1e-6, "growth rate");
            let across = usize::from(s.abs() < 1.0);
            let along = usize::from(3.0 * s * s < 1.0);
            if point.special.is_none() {
                assert_eq!(point.unstable_dimension, across + along, "s = {s}");
            }
        }
    }
}

/// The lowest `μ` with `−κ²u″ + c x u′ = μ u`, `u(±½) = 0`, by the power series of the even solution.
fn lowest(kappa: f64, c: f64) -> f64 {
    let end = |mu: f64| {
        let (mut sum, mut term) = (0.0, 1.0);
        for k in (0..200).step_by(2) {
            sum += term;
            let k = f64::from(k);
            term *= 0.25 * (c * k - mu) / (kappa * kappa * (k + 1.0) * (k + 2.0));
        }
        sum
    };
    bisect(end, 0.0, 4.0 * (kappa * std::f64::consts::PI).powi(2))
}

fn bisect(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    assert!(f(a) * f(b) < 0.0, "a change of sign");
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        if f(a) * f(middle) <= 0.0 { b = middle } else { a = middle }
    }
    0.5 * (a + b)
}

#[test]
fn a_polarity_that_breaks_the_symmetry_begins_at_a_pitchfork() {
    let mut scene = SCENE.replace("h = 0.5", "h = 0.4").replace("[\"1\", \"0\"]", "[\"0\", \"0\"]");
    scene = scene.replace("\"slip\"", "{ dirichlet = [\"(x-1/2)/2\", \"-y/2\"] }");
    scene = scene.replace("\"neumann\"", "{ dirichlet = [\"0\", \"0\"] }");
    let study = r#"scene = "scene.toml"
parameter = "model.coherence"
range = [0.25, 0.31]
start = 0.3
measure = "asymmetry_polarity"
max_branches = 2
max_points = 16
"#;
    let found = diagram(&scene, study);
    // p₁ is stretched and grows first: μ_x + μ_y = 1 + ½
    let rest = |kappa: f64| lowest(kappa, 0.5) + lowest(kappa, -0.5) - 1.5;
    let critical = bisect(rest, 0.2, 0.35);
    let trivial = &found.branches[0];
    assert!(trivial.points.iter().all(|point| point.place.state[POLARITY].values.iter().all(|v| v.abs() < 1e-9)));
    let places = special(trivial);
    assert_eq!(places.iter().map(|(kind, _)| *kind).collect::<Vec<_>>(), [Special::Pitchfork]);
    near(places[0].1, critical, 2e-4, "where p = 0 loses its stability");
    for point in trivial.points.iter().filter(|point| point.special.is_none()) {
        assert_eq!(point.unstable_dimension, usize::from(point.parameter < critical), "κ = {}", point.parameter);
    }
    let fork = trivial.points.iter().position(|point| point.special.is_some()).unwrap();
    let branch = found.branches.last().unwrap();
    assert_eq!(branch.parent, Some([0, fork]));
    assert_eq!((branch.curve, found.left), (1, 0), "the second branch of two");
    assert!(branch.points.len() > 5);
    let (mut logarithms, mut farthest) = (Vec::new(), 0.0_f64);
    for point in &branch.points {
        assert_eq!(point.unstable_dimension, 0, "κ = {}", point.parameter);
        let p = &point.place.state[POLARITY].values;
        let amplitude = p.iter().map(|v| v * v).sum::<f64>().sqrt();
        farthest = farthest.max(p.iter().fold(0.0_f64, |m, v| m.max(v.abs())));
        let beyond = places[0].1 - point.parameter;
        if (1e-4..5e-3).contains(&beyond) {
            logarithms.push((beyond.ln(), amplitude.ln()));
        }
    }
    assert!(farthest > 0.2, "the branch leads away: {farthest}");
    assert!(logarithms.len() >= 3, "{logarithms:?}");
    for pair in logarithms.windows(2) {
        near((pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0), 0.5, 0.02, "exponent of the amplitude");
    }
}
