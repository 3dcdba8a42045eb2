//! Points are found in the cell that contains them, to rounding, on straight, curved and stretched meshes.

mod hand;

use monolayer::mesh::locate::Locator;
use monolayer::mesh::{Mesh, Point};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn meshes() -> Vec<Mesh> {
    let stretched = [hand::square(9, [1.0, 1e-5]), hand::square(8, [300.0, 0.01])];
    let mut all = vec![hand::square(7, [1.0, 1.0]), turned(&hand::square(12, [1.0, 1e-3]), 0.7)];
    all.extend(stretched);
    // With 7 sectors arcs bulge out of the boxes of their corners.
    all.extend([1, 2, 3].map(|degree| hand::disc(3, 7, degree)));
    all.push(hand::disc(40, 48, 3));
    all
}

/// The straight mesh turned about the origin, so that its long cells lie askew in their bounding boxes.
fn turned(mesh: &Mesh, angle: f64) -> Mesh {
    let (sin, cos) = angle.sin_cos();
    let mut mesh = mesh.clone();
    mesh.vertices.iter_mut().for_each(|x| *x = Point::new(cos * x.x - sin * x.y, sin * x.x + cos * x.y));
    mesh
}

fn longest(mesh: &Mesh, cell: usize) -> f64 {
    let [a, b, c] = mesh.corners(cell);
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

fn smallest_barycentric(xi: Point) -> f64 {
    xi.x.min(xi.y).min(1.0 - xi.x - xi.y)
}

/// The reference points on local face `face`, from its first vertex to its second.
fn on_face(face: usize, s: f64) -> Point {
    let corner = [Point::new(0.0, 0.0), Point::new(1.0, 0.0), Point::new(0.0, 1.0)];
    corner[(face + 1) % 3] * (1.0 - s) + corner[(face + 2) % 3] * s
}

fn assert_found(mesh: &Mesh, x: Point, found: Option<(usize, Point)>) -> (usize, Point) {
    let (cell, xi) = found.unwrap_or_else(|| panic!("({}, {}) not found", x.x, x.y));
    let residual = (mesh.map(cell).at(xi).0 - x).norm();
    assert!(residual < 1e-12 * (1.0 + x.norm()), "residual {residual:e}");
    (cell, xi)
}

#[test]
fn random_points_are_found_in_their_cell() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for mesh in meshes() {
        let locator = Locator::new(&mesh);
        for _ in 0..2000 {
            let cell = random.random_range(0..mesh.cells.len());
            let (s, t): (f64, f64) = (random.random(), random.random());
            let xi = if s + t > 1.0 { Point::new(1.0 - s, 1.0 - t) } else { Point::new(s, t) };
            if smallest_barycentric(xi) < 1e-3 {
                continue;
            }
            let x = mesh.map(cell).at(xi).0;
            let (found, at) = assert_found(&mesh, x, locator.locate(&mesh, x));
            assert_eq!(found, cell);
            assert!((at - xi).norm() < 1e-9);
        }
    }
}

#[test]
fn points_on_shared_faces_and_vertices_belong_to_the_lowest_cell() {
    for mesh in meshes() {
        let locator = Locator::new(&mesh);
        for face in &mesh.faces {
            let Some(plus) = face.plus else { continue };
            for s in [0.1, 0.5, 0.77] {
                let x = mesh.map(face.minus.cell).at(on_face(face.minus.face, s)).0;
                let (found, _) = assert_found(&mesh, x, locator.locate(&mesh, x));
                assert_eq!(found, face.minus.cell.min(plus.cell));
            }
        }
        for (vertex, &x) in mesh.vertices.iter().enumerate() {
            let lowest = mesh.cells.iter().position(|cell| cell.contains(&vertex));
            assert_eq!(locator.locate(&mesh, x).map(|(cell, _)| cell), lowest);
        }
    }
}

#[test]
fn the_boundary_has_a_tolerance_of_a_billionth_of_the_cell() {
    for mesh in meshes() {
        let locator = Locator::new(&mesh);
        for face in mesh.faces.iter().filter(|face| face.plus.is_none()) {
            let cell = face.minus.cell;
            for s in [0.05, 0.5, 0.6] {
                let (x, jacobian) = mesh.map(cell).at(on_face(face.minus.face, s));
                let tangent = jacobian * (on_face(face.minus.face, 1.0) - on_face(face.minus.face, 0.0));
                let outward = Point::new(tangent.y, -tangent.x).normalize() * longest(&mesh, cell);
                for shift in [0.0, 0.8e-9, -0.8e-9] {
                    let x = x + outward * shift;
                    assert_eq!(assert_found(&mesh, x, locator.locate(&mesh, x)).0, cell);
                }
                assert!(locator.locate(&mesh, x + outward * 1e-8).is_none(), "beyond the tolerance");
            }
        }
    }
}

#[test]
fn inside_and_outside_agree_with_looking_at_every_cell() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mesh = turned(&hand::square(12, [1.0, 0.05]), 0.7);
    let locator = Locator::new(&mesh);
    let signed = |a: Point, b: Point, x: Point| (b - a).perp(&(x - a));
    let (mut inside, mut outside) = (0, 0);
    for _ in 0..3000 {
        let x = Point::new(random.random_range(-0.9..0.9), random.random_range(-0.8..0.8));
        let contains = |cell: &usize| {
            let [a, b, c] = mesh.corners(*cell);
            signed(a, b, x) >= 0.0 && signed(b, c, x) >= 0.0 && signed(c, a, x) >= 0.0
        };
        let expected = (0..mesh.cells.len()).find(contains);
        assert_eq!(locator.locate(&mesh, x).map(|(cell, _)| cell), expected);
        *if expected.is_some() { &mut inside } else { &mut outside } += 1;
    }
    assert!(inside > 100 && outside > 100, "{inside} inside, {outside} outside");
}

#[test]
fn points_far_away_and_in_holes_are_not_found() {
    let far = [[50.0, 0.0], [0.0, -1e9], [1.9, 1.4], [f64::NAN, 0.0], [f64::INFINITY, 0.0]];
    for degree in [1, 2, 3] {
        let mesh = hand::disc(3, 8, degree);
        let locator = Locator::new(&mesh);
        for x in far.map(Point::from) {
            assert!(locator.locate(&mesh, x).is_none() && locator.locate_near(&mesh, x, 0.1).is_none());
        }
    }
    let annulus = monolayer::mesh::gmsh::read(
        &std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/square-with-disc-order2-binary.msh"),
    )
    .unwrap();
    let locator = Locator::new(&annulus);
    assert!(locator.locate(&annulus, Point::new(0.1, -0.2)).is_none());
    assert!(locator.locate(&annulus, Point::new(0.1, 0.29)).is_none());
    assert!(locator.locate(&annulus, Point::new(0.1, 0.31)).is_some());
}

#[test]
fn near_points_belong_to_the_cell_they_miss_by_least() {
    let mesh = hand::square(4, [1.0, 1.0]);
    let locator = Locator::new(&mesh);
    for face in mesh.faces.iter().filter(|face| face.plus.is_none()) {
        let cell = face.minus.cell;
        let inside = on_face(face.minus.face, 0.4);
        // Just outside: the face's own barycentric coordinate is −0.05, far below its share of any other cell.
        let opposite = [Point::new(0.0, 0.0), Point::new(1.0, 0.0), Point::new(0.0, 1.0)][face.minus.face];
        let xi = inside + (inside - opposite) * 0.05;
        let x = mesh.map(cell).at(xi).0;
        assert!(locator.locate(&mesh, x).is_none());
        assert!(locator.locate_near(&mesh, x, 0.04).is_none());
        let (found, at) = assert_found(&mesh, x, locator.locate_near(&mesh, x, 0.06));
        assert_eq!(found, cell);
        assert!((at - xi).norm() < 1e-13);
    }
}

#[test]
fn near_gives_what_locate_gives_where_that_finds_a_cell() {
    let mesh = hand::disc(3, 8, 2);
    let locator = Locator::new(&mesh);
    for &x in &mesh.vertices {
        assert_eq!(locator.locate_near(&mesh, x, 0.3), locator.locate(&mesh, x));
    }
}

#[test]
fn the_exact_circle_is_near_the_bent_cells() {
    let (centre, radius) = (Point::new(0.3, -0.2), 1.5);
    for (degree, slack) in [(1, 0.3), (2, 0.02), (3, 0.005)] {
        let mesh = hand::disc(3, 8, degree);
        let locator = Locator::new(&mesh);
        let mut beyond = 0;
        for k in 0..200 {
            let angle = std::f64::consts::TAU * (k as f64 + 0.3) / 200.0;
            let x = centre + Point::new(angle.cos(), angle.sin()) * radius;
            let (_, xi) = assert_found(&mesh, x, locator.locate_near(&mesh, x, slack));
            assert!(smallest_barycentric(xi) >= -slack);
            beyond += usize::from(locator.locate(&mesh, x).is_none());
        }
        assert!(beyond > 0, "degree {degree}: the slack was not needed");
    }
}
