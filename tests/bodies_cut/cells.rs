use std::sync::Arc;

use monolayer::body::cut::{Class, Cover};
use monolayer::body::{Pose, Shape};
use monolayer::mesh::Point;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::*;
use crate::shapes::shapes;

fn pose(random: &mut ChaCha8Rng, spread: f64) -> Pose {
    let position = Point::new(random.random_range(-spread..spread), random.random_range(-spread..spread));
    Pose { position: Point::new(0.5, 0.5) + position, angle: random.random_range(-4.0..4.0) }
}

fn scaled(shape: &Shape, s: f64) -> Shape {
    match shape {
        Shape::Disc { radius } => Shape::Disc { radius: s * radius },
        Shape::Ellipse { semi_axes } => Shape::Ellipse { semi_axes: semi_axes.map(|a| s * a) },
        Shape::Capsule { half_length, radius } => Shape::Capsule { half_length: s * half_length, radius: s * radius },
        Shape::Polygon { vertices } => Shape::Polygon { vertices: vertices.iter().map(|v| v * s).collect() },
    }
}

#[test]
fn the_parts_inside_add_up_to_the_body() {
    let mesh = square(5);
    let loops = loops(&mesh);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for shape in shapes() {
        for scale in [1e-3, 0.05, 0.4, 1.0] {
            for _ in 0..6 {
                let (shape, pose) = (scaled(&shape, scale), pose(&mut random, 0.05));
                let cover = Arc::new(Cover::new(&mesh, None, &[(shape.clone(), pose)]));
                let inside = loops.inside(&cover, Some(0));
                let area = inside.sum(2, |_| 1.0);
                close(area, shape.area(), shape.area(), 1e-12);
                let moment = inside.sum(2, |x| (x.site.x - pose.position).norm_squared());
                close(moment, shape.second_moment(), shape.second_moment(), 1e-11);
                let outside = loops.outside(&cover).sum(2, |_| 1.0);
                close(outside, 1.0 - shape.area(), 1.0, 1e-13);
            }
        }
    }
}

#[test]
fn bodies_on_vertices_and_along_edges() {
    let mesh = mesh("shape = \"square\"\nn = 4");
    let loops = loops(&mesh);
    let square = |half: f64| {
        let corner = |x: f64, y: f64| Point::new(x * half, y * half);
        Shape::Polygon { vertices: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)] }
    };
    let mut shapes = vec![];
    for half in [0.125, 0.25, 0.5, 0.25 - 1e-14, 0.25 + 1e-14] {
        shapes.push(square(half));
        shapes.push(Shape::Disc { radius: half });
        shapes.push(Shape::Capsule { half_length: 0.5 * half, radius: 0.5 * half });
    }
    for shape in shapes {
        for angle in [0.0, 0.25 * std::f64::consts::PI, 0.5 * std::f64::consts::PI, 1e-15] {
            for position in [Point::new(0.5, 0.5), Point::new(0.5 + 1e-15, 0.5)] {
                let cover = Arc::new(Cover::new(&mesh, None, &[(shape.clone(), Pose { position, angle })]));
                if shape.at(Pose { position, angle }).bounds()[1].sup(&Point::new(1.0, 1.0)).norm() > 1.42 {
                    continue;
                }
                let area = loops.inside(&cover, None).sum(4, |_| 1.0);
                close(area, shape.area(), shape.area(), 1e-12);
                close(loops.outside(&cover).sum(4, |_| 1.0), 1.0 - shape.area(), 1.0, 1e-12);
            }
        }
    }
    // a body larger than the mesh
    let cover = Arc::new(Cover::new(
        &mesh,
        None,
        &[(Shape::Disc { radius: 9.0 }, Pose { position: Point::zeros(), angle: 0.0 })],
    ));
    assert!((0..mesh.cells.len()).all(|c| cover.cell(c) == Class::Inside(0)));
    assert!((0..mesh.faces.len()).all(|f| cover.face(f) == Class::Inside(0)));
}
