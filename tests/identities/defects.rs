use crate::common::*;
use monolayer::measure::{Census, Defects};
use monolayer::mesh::{Mesh, Point};
use monolayer::space::{Field, project};
use std::sync::Arc;

/// A field whose angle is `Σ charge · arg(x − place)`, and whose length is 1 away from the places.
fn winding_about(mesh: &Arc<Mesh>, places: &[(Point, i32)]) -> Field {
    project::interpolate_vector(&discontinuous(mesh, 3, 2), |x| {
        let angle: f64 = places.iter().map(|(at, charge)| f64::from(*charge) * (x.y - at.y).atan2(x.x - at.x)).sum();
        let size: f64 = places.iter().map(|(at, _)| ((x - at).norm() / 0.1).tanh()).product();
        Point::new(angle.cos(), angle.sin()) * size
    })
}

/// `Σ charges = winding of the outer boundary − Σ windings of the holes`.
fn balances(finder: &Defects, census: &Census) {
    let total: i32 = census.defects.iter().map(|d| d.charge).sum();
    let around = finder.boundaries.iter().zip(&census.windings).map(|(b, w)| if b.outer { *w } else { -w });
    assert_eq!(total, around.sum::<i32>());
}

#[test]
fn defects_are_found_with_their_charge_and_place() {
    for mesh in
        [mesh("shape = 'disc'\nh = 0.2"), mesh("shape = 'square'\nlength = [-1.0, 1.0]\nn = 10\ndistortion = 0.2")]
    {
        let [a, b, c] = [Point::new(0.31, 0.22), Point::new(-0.35, -0.1), Point::new(0.1, -0.52)];
        let cases: [&[(Point, i32)]; 6] =
            [&[(a, 1)], &[(b, -1)], &[(a, 1), (b, -1)], &[(a, 1), (b, 1)], &[(a, -1), (b, -1), (c, 1)], &[]];
        let finder = Defects::new(&mesh);
        for places in cases {
            let p = winding_about(&mesh, places);
            let census = finder.of(&p);
            assert_eq!(census.defects.len(), places.len(), "{places:?}: {:?}", census.defects);
            for (place, charge) in places {
                let near = |x: &Point| (x - place).norm();
                let found = census.defects.iter().min_by(|d, e| near(&d.x).total_cmp(&near(&e.x))).unwrap();
                // a small triangle is a fifth of a cell
                assert!(near(&found.x) < 0.2 / 5.0, "{} of {place:?}", near(&found.x));
                assert_eq!(found.charge, *charge);
                assert!(found.size < 0.5, "{}", found.size);
            }
            assert_eq!(census.windings, [places.iter().map(|(_, charge)| charge).sum::<i32>()]);
            balances(&finder, &census);
        }
    }
}

#[test]
fn a_linear_polarity_has_its_zero_where_it_is() {
    let mesh = square(4);
    let at = Point::new(0.4321, 0.6173);
    let p = project::interpolate_vector(&discontinuous(&mesh, 3, 2), |x| turn(0.7, x - at));
    let defects = Defects::new(&mesh).of(&p).defects;
    assert_eq!((defects.len(), defects[0].charge), (1, 1));
    assert!((defects[0].x - at).norm() < 1e-12 && defects[0].size < 1e-12, "{:?}", defects[0]);
}

#[test]
fn a_defect_at_a_vertex_counts_once() {
    // on the undistorted square (½, ½) is a vertex, where p vanishes exactly; the angle there is any
    let mesh = mesh("shape = 'square'\nn = 4");
    let finder = Defects::new(&mesh);
    for (p, charge) in [(1.0, 1), (-1.0, -1)].map(|(sign, charge)| {
        let field = |x: Point| Point::new(x.x - 0.5, sign * (x.y - 0.5));
        (project::interpolate_vector(&discontinuous(&mesh, 3, 2), field), charge)
    }) {
        let census = finder.of(&p);
        assert_eq!(census.defects.iter().map(|d| d.charge).collect::<Vec<_>>(), [charge]);
        assert!((census.defects[0].x - Point::new(0.5, 0.5)).norm() < 1e-12);
        assert_eq!(census.windings, [charge]);
    }
}

#[test]
fn a_uniform_polarity_has_no_defect() {
    for mesh in meshes() {
        let p = project::interpolate_vector(&discontinuous(&mesh, 3, 2), |_| Point::new(0.6, -0.8));
        let census = Defects::new(&mesh).of(&p);
        assert!(census.defects.is_empty() && census.windings.iter().all(|w| *w == 0));
    }
}

#[test]
fn a_polarity_that_circulates_winds_about_both_rims() {
    let mesh = mesh("shape = 'annulus'\nradius = 2.0\ninner_radius = 1.0\nh = 0.6");
    let finder = Defects::new(&mesh);
    let p = project::interpolate_vector(&discontinuous(&mesh, 3, 2), |x| Point::new(-x.y, x.x) / x.norm());
    let census = finder.of(&p);
    assert!(census.defects.is_empty());
    assert_eq!(census.windings, [1, 1]);
    let mut names: Vec<_> = finder.boundaries.iter().map(|b| (b.name.as_str(), b.outer)).collect();
    names.sort_unstable();
    assert_eq!(names, [("inner", false), ("outer", true)]);
}

#[test]
fn charges_are_the_turns_along_the_boundary_for_any_polarity() {
    let all =
        [meshes(), vec![mesh("shape = 'racetrack'\narm = 4.0\nturn_radius = 3.0\nwidth = 3.0\nh = 0.9\nh_disc = 0.5")]];
    for (seed, mesh) in all.concat().into_iter().enumerate() {
        let finder = Defects::new(&mesh);
        let p = random(&discontinuous(&mesh, 3, 2), seed as u64);
        let census = finder.of(&p);
        assert!(census.count(1) > 0 && census.count(-1) > 0);
        assert_eq!(census.count(1) + census.count(-1), census.defects.len());
        balances(&finder, &census);
    }
}

#[test]
fn turning_the_polarity_by_an_angle_changes_nothing() {
    let mesh = disc();
    let finder = Defects::new(&mesh);
    let p = random(&discontinuous(&mesh, 3, 2), 5);
    let census = finder.of(&p);
    let mut turned = p.clone();
    for cell in 0..mesh.cells.len() {
        for i in 0..p.space.n {
            let [first, second] = [0, 1].map(|c| p.space.dof(cell, c, i));
            let x = turn(1.234, Point::new(p.values[first], p.values[second]));
            (turned.values[first], turned.values[second]) = (x.x, x.y);
        }
    }
    let other = finder.of(&turned);
    assert_eq!(census.windings, other.windings);
    assert_eq!(census.defects.len(), other.defects.len());
    for (d, e) in census.defects.iter().zip(&other.defects) {
        assert_eq!(d.charge, e.charge);
        assert!((d.x - e.x).norm() < 1e-9 && (d.size - e.size).abs() < 1e-9);
    }
}

#[test]
fn boundary_curves_with_the_same_tags_are_told_apart() {
    let track = mesh("shape = 'racetrack'\narm = 4.0\nturn_radius = 3.0\nwidth = 3.0\nh = 0.9\nh_disc = 0.5");
    let mut names: Vec<_> = Defects::new(&track).boundaries.into_iter().map(|b| b.name).collect();
    names.sort_unstable();
    assert_eq!(names, ["disc", "disc 2", "inner", "outer"]);
    let strip = mesh("shape = 'strip'\nlength = [0.0, 3.0]\nwidth = 2.0\nh = 0.7");
    let rim = &Defects::new(&strip).boundaries;
    assert!(rim.len() == 1 && rim[0].outer && rim[0].name.split('+').count() == 3, "{rim:?}");
}
