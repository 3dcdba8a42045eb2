//! The image of a scene has the image of its solution.

use std::sync::Arc;

use crate::common::*;
use monolayer::form::Integrator;
use monolayer::mesh::locate::Locator;
use monolayer::mesh::{BoundaryEdge, Curve, Mesh, Point};
use monolayer::model::State;
use monolayer::model::fields::{DENSITY, POLARITY, VELOCITY};
use monolayer::time::{CouplingKind, March};

/// A copy of `mesh` with every point mapped; `reflect` turns the cells so that they stay counterclockwise.
fn mapped(mesh: &Mesh, map: impl Fn(Point) -> Point, reflect: bool) -> Mesh {
    let vertices = mesh.vertices.iter().map(|x| map(*x)).collect();
    let mut curves = mesh.curves.clone();
    for curve in &mut curves {
        match curve {
            Curve::Circle { centre, .. } => *centre = map(*centre),
        }
    }
    let edge = |f: &monolayer::mesh::Face| BoundaryEdge {
        vertices: mesh.face_vertices(f),
        tag: f.tag.expect("boundary faces have tags"),
        curve: f.curve,
    };
    let boundary: Vec<_> = mesh.faces.iter().filter(|f| f.plus.is_none()).map(edge).collect();
    let cells = mesh.cells.iter().map(|&[a, b, c]| if reflect { [a, c, b] } else { [a, b, c] }).collect();
    let degree = mesh.curved.iter().flatten().map(|n| n.degree).max().unwrap_or(1);
    let mut out = Mesh::build(vertices, cells, &boundary, mesh.tags.clone(), curves).expect("a mapped mesh");
    out.bend(degree).expect("bends like the original");
    out
}

fn solve(mesh: &Arc<Mesh>, rho: &dyn Fn(Point) -> f64, p: &dyn Fn(Point) -> Point) -> State {
    let model = sheet(mesh, PARAMETERS, 1, closed);
    let mut settings = settings(0.05, 2, CouplingKind::Newton);
    settings.coupling.tolerance = 1e-11;
    settings.coupling.accept = 1e-10;
    let mut march = March::start(&model, settings, carried(&model, rho, p)).unwrap();
    for _ in 0..4 {
        march.advance(1e9).unwrap();
    }
    march.state
}

/// Solves on a mesh and on its image under an orthogonal map, from images of one start, and compares at the images of
/// points.
fn compare(map: impl Fn(Point) -> Point + Copy, reflect: bool) {
    let mesh = mesh("shape = \"annulus\"\nradius = 2.0\ninner_radius = 1.0\nh = 0.9");
    let image = Arc::new(mapped(&mesh, map, reflect));
    let start = |x: Point| Point::new(0.7 + 0.3 * (x.x * x.y).sin(), 0.5 * (x.x - 0.4 * x.y).cos());
    let inverse = |y: Point| Point::new(map(Point::x()).dot(&y), map(Point::y()).dot(&y));
    let one = solve(&mesh, &smooth_density, &start);
    let two = solve(&image, &|y| smooth_density(inverse(y)), &|y| map(start(inverse(y))));
    let (here, there) = (Integrator::new(&mesh), Locator::new(&image));
    let (mut speed, mut worst) = (0.0_f64, 0.0_f64);
    for cell in 0..mesh.cells.len() {
        here.each_cell_point(cell, 2, &mut |x| {
            let (other, xi) = there.locate_near(&image, map(x.site.x), 1e-6).expect("the image of a point");
            let (v, p) = (one[VELOCITY].vector(&x.site), one[POLARITY].vector(&x.site));
            worst = worst.max((map(v) - two[VELOCITY].vector_at(other, xi)).norm());
            worst = worst.max((map(p) - two[POLARITY].vector_at(other, xi)).norm());
            worst = worst.max((one[DENSITY].scalar(&x.site) - two[DENSITY].scalar_at(other, xi)).abs());
            speed = speed.max(v.norm());
        });
    }
    println!("{worst:.1e}, speed {speed:.2}");
    assert!(speed > 0.1, "something flows: {speed}");
    assert!(worst < 1e-8, "the image differs by {worst:.1e}");
}

#[test]
fn a_rotated_scene_gives_the_rotated_solution() {
    let (s, c) = 0.7_f64.sin_cos();
    compare(|x| Point::new(c * x.x - s * x.y, s * x.x + c * x.y), false);
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_solution() {
    compare(|x| Point::new(x.x, -x.y), true);
}
