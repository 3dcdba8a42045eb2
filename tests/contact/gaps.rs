//! Gaps, nearest points and gradients of all pairs of shapes.

use monolayer::contact::gap::{Placed, Touch, touches};
use monolayer::contact::{Wall, Walls};
use monolayer::mesh::Point;
use monolayer::shape::outline::Piece;
use monolayer::shape::{Capsule, Disc, Ellipse, Pose, Shape};
use rand::RngExt;

use crate::common::{at, rectangle, regular, rng};
use crate::listed::listed;

/// Shapes of every row of the list, about as large as those that are named.
fn shapes() -> Vec<Shape> {
    let mut all = vec![
        Shape::from(Disc { radius: 0.4 }),
        Shape::from(Ellipse { semi_axes: [0.9, 0.3] }),
        Shape::from(Capsule { half_length: 0.5, radius: 0.2 }),
        rectangle(0.7, 0.25),
        regular(5, 0.5),
    ];
    all.extend(listed(1.5).into_iter().filter(|shape| shape.inradius() > 0.12));
    all
}

fn between(a: (&Shape, Pose), b: (&Shape, Pose)) -> Vec<Touch> {
    let mut out = Vec::new();
    touches(&Placed::new(a.0, &a.1), &Placed::new(b.0, &b.1), f64::INFINITY, &mut out);
    out
}

fn least(touches: &[Touch]) -> f64 {
    touches.iter().map(|t| t.gap).fold(f64::INFINITY, f64::min)
}

/// Points of a boundary, `count` on each piece.
fn boundary(shape: &Shape, pose: &Pose, count: usize) -> Vec<Point> {
    let along = |piece: Piece| {
        let (from, to) = piece.range();
        (0..count).map(move |k| piece.at(from + (to - from) * k as f64 / count as f64))
    };
    shape.at(*pose).boundary().into_iter().flat_map(along).collect()
}

#[test]
fn gaps_are_the_least_distances_of_the_boundaries() {
    let mut rng = rng(7);
    for a in &shapes() {
        for b in &shapes() {
            for _ in 0..10 {
                let here = at(0.3, -0.2, rng.random_range(0.0..7.0));
                let angle: f64 = rng.random_range(0.0..7.0);
                let far = rng.random_range(1.9..2.4);
                let there = at(0.3 + far * angle.cos(), -0.2 + far * angle.sin(), rng.random_range(0.0..7.0));
                let found = between((a, here), (b, there));
                let (p, q) = (boundary(a, &here, 400), boundary(b, &there, 400));
                let sampled =
                    p.iter().flat_map(|x| q.iter().map(move |y| (y - x).norm())).fold(f64::INFINITY, f64::min);
                let gap = least(&found);
                assert!(gap <= sampled + 1e-12 && sampled - gap < 2e-3, "{a:?} {b:?}: {gap} against {sampled}");
                for t in &found {
                    assert!((t.on_second - t.on_first - t.gap * t.normal).norm() < 1e-12, "{a:?} {b:?}: {t:?}");
                }
                let back = least(&between((b, there), (a, here)));
                assert!((back - gap).abs() < 1e-14 * 10.0, "{a:?} {b:?}: {gap} and back {back}");
            }
        }
    }
}

#[test]
fn gradients_are_the_differences_of_the_gaps() {
    let mut rng = rng(11);
    let h = 1e-5;
    for a in &shapes() {
        for b in &shapes() {
            for _ in 0..8 {
                let here = at(0.1, 0.2, rng.random_range(0.0..7.0));
                let there = at(1.6, rng.random_range(-0.5..0.9), rng.random_range(0.0..7.0));
                for t in between((a, here), (b, there)) {
                    let exact = [t.gradient_first(here.position), t.gradient_second(there.position)].concat();
                    for (k, exact) in exact.iter().enumerate() {
                        let moved = |by: f64| {
                            let mut poses = [here, there];
                            match k % 3 {
                                0 => poses[k / 3].position.x += by,
                                1 => poses[k / 3].position.y += by,
                                _ => poses[k / 3].angle += by,
                            }
                            between((a, poses[0]), (b, poses[1])).into_iter().find(|m| m.slot == t.slot).map(|m| m.gap)
                        };
                        let (Some(up), Some(down)) = (moved(h), moved(-h)) else { continue };
                        let difference = (up - down) / (2.0 * h);
                        assert!(
                            (difference - exact).abs() < 1e-6,
                            "{a:?} {b:?} {t:?} by {k}: {difference} against {exact}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn a_round_ellipse_is_a_disc_to_rounding() {
    let (disc, round) = (Shape::from(Disc { radius: 0.4 }), Shape::from(Ellipse { semi_axes: [0.4, 0.4] }));
    for other in &shapes() {
        for k in 0..20 {
            let there = at(1.4, 0.03 * k as f64, 0.3 * k as f64);
            let (exact, found) = (
                between((&disc, at(0.0, 0.1, 0.0)), (other, there)),
                between((&round, at(0.0, 0.1, 0.7)), (other, there)),
            );
            let (exact, found) = (exact[0], found[0]);
            assert!((exact.gap - found.gap).abs() < 2e-15, "{other:?}: {} against {}", exact.gap, found.gap);
            assert!((exact.on_first - found.on_first).norm() < 1e-7);
        }
    }
}

#[test]
fn overlaps_are_negative_gaps() {
    for a in &shapes() {
        for b in &shapes() {
            let gap = least(&between((a, at(0.0, 0.0, 0.3)), (b, at(0.02, 0.01, 1.1))));
            assert!(gap < -0.2, "{a:?} {b:?}: {gap}");
        }
    }
}

#[test]
fn flat_sides_touch_in_two_places() {
    let (long, short) = (rectangle(1.0, 0.2), rectangle(0.3, 0.2));
    for (x, y) in [(0.0, 0.4), (0.9, 0.4 + 1e-13), (0.2, 0.41)] {
        let found = between((&long, at(0.0, 0.0, 0.0)), (&short, at(x, y, 0.0)));
        assert_eq!(found.len(), 2, "{found:?}");
        for t in found {
            assert!((t.gap - (y - 0.4)).abs() < 1e-15 && (t.normal - Point::new(0.0, 1.0)).norm() < 1e-15);
        }
    }
    let capsule = Shape::from(Capsule { half_length: 0.5, radius: 0.2 });
    assert_eq!(between((&capsule, at(0.0, 0.0, 0.0)), (&capsule, at(0.3, 0.4, 0.0))).len(), 2);
    assert_eq!(between((&capsule, at(0.0, 0.0, 0.0)), (&capsule, at(0.0, 0.9, 1.5))).len(), 1);
}

#[test]
fn walls_are_met_from_both_sides_and_at_their_ends() {
    let wall = Walls::new(&[Wall::Segment([Point::new(0.0, 0.0), Point::new(2.0, 0.0)])]);
    let gap = |shape: &Shape, pose: Pose| {
        let mut out = Vec::new();
        wall.touches(0, &Placed::new(shape, &pose), f64::INFINITY, &mut out);
        least(&out)
    };
    let disc = Shape::from(Disc { radius: 0.5 });
    assert_eq!(gap(&disc, at(1.0, 0.75, 0.0)), 0.25);
    assert_eq!(gap(&disc, at(1.0, -0.75, 0.0)), 0.25);
    assert_eq!(gap(&disc, at(5.0, 4.0, 0.0)), 4.5);
    assert!((gap(&rectangle(0.5, 0.25), at(1.0, 1.0, std::f64::consts::FRAC_PI_2)) - 0.5).abs() < 1e-15);
}

#[test]
fn a_hollow_disc_is_met_by_every_corner() {
    let walls = Walls::new(&[Wall::Hollow { centre: Point::new(0.0, 0.0), radius: 2.0 }]);
    for shape in &shapes() {
        let pose = at(0.3, 0.4, 0.6);
        let mut out = Vec::new();
        walls.touches(0, &Placed::new(shape, &pose), f64::INFINITY, &mut out);
        let farthest = boundary(shape, &pose, 4000).iter().map(|x| x.norm()).fold(0.0, f64::max);
        assert!((least(&out) - (2.0 - farthest)).abs() < 1e-6, "{shape:?}: {} against {}", least(&out), 2.0 - farthest);
    }
}
