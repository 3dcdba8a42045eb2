use std::f64::consts::TAU;

use monolayer::element::quadrature;
use monolayer::mesh::Point;
use monolayer::shape::outline::Piece;
use monolayer::shape::{Capsule, Core, Disc, Ellipse, Figure, Form, Polygon, Pose, Shape, ShapeError, ShapeTable};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::close;
use crate::listed::{listed, tables};

/// Shapes of every row of the list by its own examples, among them flat and nearly round ones, and a few more; all
/// lengths times `scale`.
pub fn shapes(scale: f64) -> Vec<Shape> {
    let corners = |points: &[(f64, f64)]| points.iter().map(|&(x, y)| scale * Point::new(x, y)).collect();
    let more = [
        Shape::from(Disc { radius: 0.3 * scale }),
        Shape::from(Ellipse { semi_axes: [0.4 * scale, 0.15 * scale] }),
        Shape::from(Ellipse { semi_axes: [0.02 * scale, 0.35 * scale] }),
        Shape::from(Ellipse { semi_axes: [0.2 * scale, 0.2 * scale] }),
        Shape::from(Capsule { half_length: 0.25 * scale, radius: 0.1 * scale }),
        Shape::from(Capsule { half_length: 0.0, radius: 0.2 * scale }),
        Shape::from(Polygon { vertices: corners(&[(0.0, 0.0), (0.5, 0.1), (0.2, 0.6)]) }),
        Shape::from(Polygon { vertices: corners(&[(0.0, 0.0), (0.0, 0.4), (0.5, 0.4), (0.5, 0.0)]) }),
        Shape::from(Polygon {
            vertices: (0..7)
                .map(|k| 0.3 * scale * Point::new((k as f64 * TAU / 7.0).cos(), (k as f64 * TAU / 7.0).sin()))
                .collect(),
        }),
    ];
    let more = more.into_iter().map(|shape| shape.checked().expect("a shape"));
    more.chain(listed(scale)).collect()
}

/// `∮ f·n ds` over a boundary, by Gauss rules of high order on short parts.
pub fn through(boundary: &[Piece], f: impl Fn(Point) -> Point) -> f64 {
    let gauss = quadrature::interval(39);
    let mut total = 0.0;
    for piece in boundary {
        let (from, to) = piece.range();
        let step = (to - from) / 16.0;
        for part in 0..16 {
            for (s, w) in gauss.points.iter().zip(&gauss.weights) {
                let t = from + (part as f64 + s) * step;
                let slope = piece.slope(t);
                total += w * step * f(piece.at(t)).dot(&Point::new(slope.y, -slope.x));
            }
        }
    }
    total
}

/// `∫ f` over the shape by the divergence theorem, with `∂F/∂x = f`.
fn by_boundary(shape: &Shape, antiderivative: impl Fn(Point) -> f64) -> f64 {
    through(&shape.boundary(), |x| Point::new(antiderivative(x), 0.0))
}

#[test]
fn area_and_moments_are_those_of_the_boundary() {
    for shape in shapes(1.0) {
        let size = shape.circumradius();
        let area = by_boundary(&shape, |x| x.x);
        close(shape.area(), area, area, 1e-13);
        let moment = by_boundary(&shape, |x| x.x.powi(3) / 3.0 + x.x * x.y * x.y);
        close(shape.second_moment(), moment, moment, 1e-13);
        for first in [by_boundary(&shape, |x| 0.5 * x.x * x.x), by_boundary(&shape, |x| x.x * x.y)] {
            close(first, 0.0, area * size, 1e-13);
        }
    }
}

#[test]
fn signed_distance_is_that_of_the_nearest_boundary_point() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for shape in shapes(1.0) {
        let fine: Vec<Point> = shape
            .boundary()
            .iter()
            .flat_map(|piece| {
                let (piece, (a, b)) = (*piece, piece.range());
                (0..=5000).map(move |k| piece.at(a + (b - a) * k as f64 / 5000.0))
            })
            .collect();
        let reach = shape.circumradius();
        for k in 0..200 {
            let mut x = Point::new(random.random_range(-2.0..2.0), random.random_range(-2.0..2.0)) * reach;
            match k % 5 {
                0 => x.x = 0.0,
                1 => x.y = 0.0,
                _ => {}
            }
            let (distance, gradient) = shape.signed_distance(x);
            let nearest = fine.iter().map(|y| (x - y).norm()).fold(f64::INFINITY, f64::min);
            assert!(
                distance.abs() <= nearest * (1.0 + 1e-12) && nearest - distance.abs() < 2e-4 * reach,
                "{shape:?} {x}"
            );
            assert_eq!(distance <= 0.0, shape.contains(x), "{shape:?} at {x}: {distance}");
            close(gradient.norm(), 1.0, 1.0, 1e-14);
            // the foot lies on the boundary, and the gradient is the same there
            let foot = x - gradient * distance;
            let (left, normal) = shape.signed_distance(foot);
            close(left, 0.0, reach, 1e-13);
            if !matches!(shape.figure(), Figure::Around { core: Core::Polygon(_), radius: 0.0 }) {
                close((normal - gradient).norm(), 0.0, 1.0, 1e-7);
            }
        }
    }
}

#[test]
fn ellipses_of_any_aspect_keep_their_distance_on_the_axes() {
    for [a, b] in [[1.0, 1e-6], [1e-6, 1.0], [1.0, 1.0 - 1e-15], [1e3, 1e-3], [1.0, 1.0]] {
        let shape = Shape::from(Ellipse { semi_axes: [a, b] }).checked().expect("an ellipse");
        let (depth, _) = shape.signed_distance(Point::zeros());
        close(depth, -f64::min(a, b), f64::min(a, b), 1e-12);
        for share in [1e-300, 1e-20, 1e-8, 0.5, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 2.0, 1e6] {
            for tiny in [0.0, 1e-300, 1e-30, 1e-17] {
                for x in
                    [Point::new(share * a, tiny * b), Point::new(tiny * a, share * b), Point::new(share * a, share * b)]
                {
                    let (distance, gradient) = shape.signed_distance(x);
                    assert!(
                        distance.is_finite() && (gradient.norm() - 1.0).abs() < 1e-14,
                        "{a} {b} {x}: {distance} {gradient}"
                    );
                    let foot = x - gradient * distance;
                    // exact to the rounding of the point's own coordinates
                    let scale = a.max(b).max(x.norm());
                    let off = ((foot.x / a).hypot(foot.y / b) - 1.0) * f64::min(a, b);
                    close(off, 0.0, scale, 1e-14);
                }
            }
        }
        close(shape.signed_distance(Point::new(3.0 * a, 0.0)).0, 2.0 * a, a, 1e-14);
        close(shape.signed_distance(Point::new(0.0, -3.0 * b)).0, 2.0 * b, b.max(1e-10 * a), 1e-12);
    }
}

#[test]
fn placed_shapes_lie_in_their_boxes() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    for shape in shapes(1.0) {
        let pose =
            Pose { position: Point::new(random.random_range(-1.0..1.0), 0.7), angle: random.random_range(-9.0..9.0) };
        let placed = shape.at(pose);
        let [low, high] = placed.bounds();
        let outline = placed.outline(400);
        let (mut least, mut most) = (high, low);
        for (k, x) in outline.iter().enumerate() {
            close(placed.signed_distance(*x).0, 0.0, 1.0, 1e-14);
            least = least.inf(x);
            most = most.sup(x);
            let next = outline[(k + 1) % outline.len()];
            assert!((x - pose.position).perp(&(next - pose.position)) > 0.0, "{shape:?} runs clockwise");
        }
        close((least - low).norm() + (most - high).norm(), 0.0, 1.0, 1e-3);
        assert!(
            least.x >= low.x - 1e-14
                && least.y >= low.y - 1e-14
                && most.x <= high.x + 1e-14
                && most.y <= high.y + 1e-14
        );
        for _ in 0..20 {
            let d = Point::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0));
            let far = placed.support(d);
            close(placed.signed_distance(far).0, 0.0, 1.0, 1e-14);
            assert!(outline.iter().all(|x| x.dot(&d) <= far.dot(&d) + 1e-14));
        }
    }
}

#[test]
fn shapes_that_are_none_are_refused() {
    let polygon = |points: &[(f64, f64)]| {
        Shape::from(Polygon { vertices: points.iter().map(|&(x, y)| Point::new(x, y)).collect() })
    };
    type Expected = fn(&ShapeError) -> bool;
    let wrong: Vec<(Shape, Expected)> = vec![
        (Shape::from(Disc { radius: 0.0 }), |e| matches!(e, ShapeError::Size { .. })),
        (Shape::from(Disc { radius: f64::NAN }), |e| matches!(e, ShapeError::Size { .. })),
        (Shape::from(Ellipse { semi_axes: [1.0, -1.0] }), |e| matches!(e, ShapeError::Size { .. })),
        (Shape::from(Ellipse { semi_axes: [1.0, 1e-9] }), |e| matches!(e, ShapeError::Sliver { .. })),
        (Shape::from(Capsule { half_length: -0.1, radius: 0.1 }), |e| matches!(e, ShapeError::Negative { .. })),
        (Shape::from(Capsule { half_length: f64::INFINITY, radius: 0.1 }), |e| {
            matches!(e, ShapeError::Negative { .. })
        }),
        (polygon(&[(0.0, 0.0), (1.0, 0.0)]), |e| matches!(e, ShapeError::FewVertices { .. })),
        (polygon(&[(0.0, 0.0), (1.0, 0.0), (f64::NAN, 1.0)]), |e| matches!(e, ShapeError::NotFinite { index: 2, .. })),
        (polygon(&[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, 0.0)]), |e| matches!(e, ShapeError::Repeated { .. })),
        (polygon(&[(0.0, 0.0), (1.0, 0.0), (0.2, 0.2), (0.0, 1.0)]), |e| {
            matches!(e, ShapeError::NotConvex { index: 2, .. })
        }),
        (polygon(&[(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (0.0, 1.0)]), |e| {
            matches!(e, ShapeError::NotConvex { index: 1, .. })
        }),
        (polygon(&[(0.0, 0.0), (1.0, 0.0), (0.5, 1e-8)]), |e| matches!(e, ShapeError::Sliver { .. })),
        (polygon(&[0, 2, 4, 1, 3].map(|k| ((k as f64 * TAU / 5.0).cos(), (k as f64 * TAU / 5.0).sin()))), |e| {
            matches!(e, ShapeError::Winding)
        }),
    ];
    for (shape, expected) in wrong {
        let found = shape.clone().checked().expect_err("a wrong shape");
        assert!(expected(&found) && found.to_string().contains("; hint: "), "{shape:?}: {found}");
    }
    let (square, centre) =
        Polygon::centred(vec![Point::new(2.0, 1.0), Point::new(2.0, 3.0), Point::new(4.0, 3.0), Point::new(4.0, 1.0)])
            .expect("a square, clockwise");
    assert_eq!(centre, Point::new(3.0, 2.0));
    assert_eq!(square.area(), 4.0);
}

#[test]
fn what_a_figure_says_is_what_closed_forms_say() {
    /// A shape of which no closed form is known.
    struct Bare<'s>(&'s Shape);
    impl Form for Bare<'_> {
        fn figure(&self) -> Figure<'_> {
            self.0.figure()
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for shape in &shapes(1.0) {
        let (bare, size) = (Bare(shape), shape.circumradius());
        close(bare.area(), shape.area(), shape.area(), 1e-14);
        close(bare.second_moment(), shape.second_moment(), shape.second_moment(), 1e-13);
        close(bare.circumradius(), size, size, 1e-15);
        close(bare.inradius(), shape.inradius(), size, 1e-14);
        let around = through(&bare.boundary(), |x| Point::new(x.x, 0.0));
        close(around, shape.area(), shape.area(), 1e-13);
        for _ in 0..100 {
            let x = Point::new(random.random_range(-2.0..2.0), random.random_range(-2.0..2.0)) * size;
            let ((found, slope), (distance, gradient)) = (bare.signed_distance(x), shape.signed_distance(x));
            close(found, distance, size, 1e-14);
            close((slope - gradient).norm(), 0.0, 1.0, 1e-12);
            assert_eq!(bare.contains(x), shape.contains(x), "{shape:?} at {x}");
            close((bare.support(x) - shape.support(x)).norm(), 0.0, size, 1e-14);
        }
        assert_eq!(
            shape.round_radius().is_some(),
            (shape.circumradius() - shape.inradius()) == 0.0 && !is_ellipse(shape)
        );
    }
}

fn is_ellipse(shape: &Shape) -> bool {
    matches!(shape.figure(), Figure::Ellipse { .. })
}

#[test]
fn outlines_of_pictures_enclose_the_area_of_their_shapes() {
    for shape in shapes(1.0) {
        let points = shape.outline(720);
        let next = points.iter().cycle().skip(1);
        let area: f64 = points.iter().zip(next).map(|(p, q)| 0.5 * p.perp(q)).sum();
        assert!((area / shape.area() - 1.0).abs() < 2e-5, "{shape:?}: {area}");
        for x in &points {
            assert!(shape.contains(0.999 * x) && !shape.contains(1.001 * x), "{shape:?} at {x}");
        }
    }
}

#[test]
fn shapes_and_their_tables_are_read_back_as_they_were_written() {
    for shape in shapes(1.0) {
        let text = serde_json::to_string(&shape).expect("JSON");
        assert_eq!(serde_json::from_str::<Shape>(&text).expect("a shape"), shape);
    }
    for (name, value) in tables() {
        let table: ShapeTable = value.clone().try_into().expect("a table");
        let back: ShapeTable = toml::from_str(&toml::to_string(&table).expect("TOML")).expect("a table");
        assert_eq!(back, table, "{name}");
        // a key that there is not is refused with the keys that there are
        let mut wrong = value;
        wrong[name].as_table_mut().expect("a table").insert("colour".into(), toml::Value::Integer(1));
        let refused = toml::from_str::<ShapeTable>(&toml::to_string(&wrong).expect("TOML")).expect_err("no such key");
        assert!(refused.to_string().contains("unknown field `colour`, expected"), "{refused}");
    }
    // files of earlier versions
    let old = r#"{ "capsule": { "half_length": 0.5, "radius": 0.25 } }"#;
    let capsule = Shape::from(Capsule { half_length: 0.5, radius: 0.25 });
    assert_eq!(serde_json::from_str::<Shape>(old).expect("a shape"), capsule);
}
