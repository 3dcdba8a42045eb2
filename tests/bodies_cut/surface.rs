//! Quadrature on the boundaries of bodies, cell by cell.

use std::sync::Arc;

use monolayer::cut::{Cover, Surface};
use monolayer::element::quadrature;
use monolayer::form::{Faces, Integrator};
use monolayer::mesh::{Mesh, Point};
use monolayer::shape::outline::Piece;
use monolayer::shape::{Capsule, Disc, Ellipse, Polygon, Pose, Shape};
use monolayer::space::Field;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::*;
use crate::shapes::shapes;

fn at(x: f64, y: f64, angle: f64) -> Pose {
    Pose { position: Point::new(x, y), angle }
}

/// Length of a boundary, by Gauss rules of high order on parts that are halved towards where an ellipse is most bent.
fn length(boundary: &[Piece]) -> f64 {
    let gauss = quadrature::interval(39);
    let mut total = 0.0;
    for piece in boundary {
        let (from, to) = piece.range();
        for part in 0..512 {
            let step = (to - from) / 512.0;
            for (s, w) in gauss.points.iter().zip(&gauss.weights) {
                total += w * step * piece.slope(from + (part as f64 + s) * step).norm();
            }
        }
    }
    total
}

/// Length and `∫ x·n` of every body that lies inside the mesh, relative to the exact ones.
fn check_closed(loops: &Integrator, bodies: &[(Shape, Pose)], tolerance: f64) -> Surface {
    let cover = Arc::new(Cover::new(&loops.mesh, None, bodies));
    let surface = cover.surface();
    for (body, (shape, pose)) in bodies.iter().enumerate() {
        let exact = length(&shape.boundary());
        close(loops.sum_outline(&surface, body, 0, |_| 1.0), exact, exact, tolerance);
        let moment = loops.sum_outline(&surface, body, 1, |x| (x.site.x - pose.position).dot(&x.n));
        close(moment, -2.0 * shape.area(), exact * shape.circumradius(), tolerance);
        let closed = [0, 1].map(|k| loops.sum_outline(&surface, body, 0, |x| x.n[k]).abs());
        assert!(closed.iter().all(|sum| *sum < tolerance * exact), "{shape:?}: {closed:?}");
    }
    surface
}

fn meshes() -> Vec<(Arc<Mesh>, Point)> {
    let middle = Point::new(0.5, 0.5);
    vec![
        (mesh("shape = \"square\"\nn = 8"), middle),
        (square(7), middle),
        (mesh("shape = \"disc\"\nh = 0.5\ncurved = 2"), Point::zeros()),
        (mesh("shape = \"disc\"\nh = 0.4\ncurved = 3"), Point::zeros()),
    ]
}

#[test]
fn boundaries_have_their_length() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for (mesh, middle) in meshes() {
        let loops = loops(&mesh);
        for k in 0..shapes(1.0).len() {
            for scale in [1e-3, 0.05, 0.4, 0.9] {
                let shift = Point::new(random.random_range(-0.05..0.05), random.random_range(-0.05..0.05));
                let pose = Pose { position: middle + shift, angle: random.random_range(-4.0..4.0) };
                check_closed(&loops, &[(shapes(scale)[k].clone(), pose)], 1e-12);
            }
        }
    }
}

#[test]
fn boundaries_along_and_beside_mesh_lines_are_there_once() {
    let mesh = mesh("shape = \"square\"\nn = 4");
    let loops = loops(&mesh);
    let square = |half: f64| {
        let corner = |x: f64, y: f64| Point::new(x * half, y * half);
        let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Shape::from(Polygon { vertices })
    };
    for gap in [0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6] {
        for half in [0.125, 0.25, 0.25 - gap, 0.25 + gap, 0.125 - gap, 0.125 + gap] {
            let more = [
                square(half),
                Shape::from(Disc { radius: half }),
                Shape::from(Ellipse { semi_axes: [half, 0.3 * half] }),
                Shape::from(Capsule { half_length: 0.5 * half, radius: 0.5 * half }),
            ];
            for shape in more {
                for angle in [0.0, 0.25 * std::f64::consts::PI, 0.5 * std::f64::consts::PI, 1e-15] {
                    for position in [Point::new(0.5, 0.5), Point::new(0.5 + gap, 0.5), Point::new(0.5, 0.5 - gap)] {
                        let pose = Pose { position, angle };
                        let surface = check_closed(&loops, &[(shape.clone(), pose)], 1e-12);
                        // every part has fluid beside it
                        let cover = Cover::new(&mesh, None, &[(shape.clone(), pose)]);
                        assert!(surface.cells().all(|cell| cover.share_outside(cell) > 1e-12), "{shape:?} {pose:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn several_bodies_in_a_cell_have_their_own_boundaries() {
    let mesh = square(3);
    let loops = loops(&mesh);
    let small = |radius: f64| Shape::from(Disc { radius });
    let bodies = [
        (small(0.02), at(0.48, 0.5, 0.0)),
        (small(0.015), at(0.52, 0.5, 0.0)),
        (Shape::from(Ellipse { semi_axes: [0.03, 0.001] }), at(0.5, 0.53, 0.4)),
        (Shape::from(Capsule { half_length: 0.3, radius: 0.01 }), at(0.5, 0.4, 0.2)),
    ];
    let surface = check_closed(&loops, &bodies, 1e-12);
    assert!(surface.cells().any(|cell| surface.bodies_of_cell(cell).len() >= 3));
}

#[test]
fn only_what_the_fluid_touches_counts() {
    let mesh = mesh("shape = \"square\"\nn = 4");
    let loops = loops(&mesh);
    let disc = Shape::from(Disc { radius: 0.2 });
    // half of a disc on a wall, a quarter in a corner
    for (pose, share) in [(at(0.0, 0.5, 0.3), 0.5), (at(0.55, 1.0, 1.0), 0.5), (at(1.0, 0.0, 0.0), 0.25)] {
        let cover = Cover::new(&mesh, None, &[(disc.clone(), pose)]);
        let whole = 0.4 * std::f64::consts::PI;
        close(loops.sum_outline(&cover.surface(), 0, 0, |_| 1.0), share * whole, whole, 1e-12);
    }
    // a box whose lower side lies on the wall, and another one on top of it
    let vertices = [(-0.2, -0.1), (0.2, -0.1), (0.2, 0.1), (-0.2, 0.1)].map(|(x, y)| Point::new(x, y)).to_vec();
    let flat = Shape::from(Polygon { vertices });
    let bodies = [(flat.clone(), at(0.5, 0.1, 0.0)), (flat, at(0.5, 0.3, 0.0))];
    let surface = Cover::new(&mesh, None, &bodies).surface();
    close(loops.sum_outline(&surface, 0, 0, |_| 1.0), 0.4, 1.0, 1e-9);
    close(loops.sum_outline(&surface, 1, 0, |_| 1.0), 0.8, 1.0, 1e-9);
}

/// `∫_{Ω∖B} ∇·w = Σ ∫ [w]·n + Σ_i ∫_∂B_i w·n` for a discontinuous field.
fn divergence_theorem(loops: &Integrator, bodies: &[(Shape, Pose)], w: &Field) -> f64 {
    let cover = Arc::new(Cover::new(&loops.mesh, None, bodies));
    let (outside, surface) = (loops.outside(&cover), cover.surface());
    let degree = w.space.degree;
    let volume = outside.sum(degree, |x| w.vector_gradient(&x.site).trace());
    let faces = outside.sum_faces(Faces::INTERIOR | Faces::BOUNDARY, degree, |s| {
        let outer = s.plus.as_ref().map_or(Point::zeros(), |plus| w.vector(plus));
        (w.vector(&s.minus) - outer).dot(&s.n)
    });
    let through = |body: usize| loops.sum_outline(&surface, body, degree, |x| w.vector(&x.site).dot(&x.n));
    (volume - faces - (0..bodies.len()).map(through).sum::<f64>()).abs()
}

#[test]
fn cells_faces_and_boundaries_obey_the_divergence_theorem() {
    let mut random_poses = ChaCha8Rng::seed_from_u64(12);
    for (mesh, middle) in meshes() {
        let loops = loops(&mesh);
        let w = random(&discontinuous(&mesh, 3, 2), 8);
        for scale in [0.03, 0.4, 1.2] {
            let mut worst = 0.0_f64;
            for shape in shapes(scale) {
                // near the boundary, so that curved cells are cut and bodies leave the domain
                let mut offset = || random_poses.random_range(-0.3..0.3);
                let position = middle + Point::new(0.3 + offset(), 0.3 + offset());
                let bodies = [(shape, Pose { position, angle: 9.0 * offset() })];
                worst = worst.max(divergence_theorem(&loops, &bodies, &w));
            }
            println!("{} cells, bodies of scale {scale}: {worst:.1e}", mesh.cells.len());
            assert!(worst < 3e-12, "{worst:e}");
        }
    }
    let mesh = square(3);
    let bodies = [
        (Shape::from(Disc { radius: 0.1 }), at(0.45, 0.5, 0.0)),
        (Shape::from(Capsule { half_length: 0.2, radius: 0.03 }), at(0.5, 0.66, 0.1)),
        (Shape::from(Disc { radius: 0.04 }), at(0.62, 0.5, 0.0)),
    ];
    let error = divergence_theorem(&loops(&mesh), &bodies, &random(&discontinuous(&mesh, 3, 2), 9));
    assert!(error < 3e-12, "{error:e}");
}
