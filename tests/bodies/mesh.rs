//! The square whose edges follow a circle.

use std::f64::consts::TAU;

use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::{MeshError, Point};

fn scene(n: usize, radius: f64) -> MeshScene {
    MeshScene::of("square-with-circle").with("n", n).with("radius", radius)
}

#[test]
fn edges_follow_the_circle() {
    for (n, radius) in [(1, 0.2), (4, 0.1), (9, 0.3), (5, 0.45)] {
        let mesh = scene(n, radius).build().expect("a mesh");
        let centre = Point::new(0.5, 0.5);
        let apothem = radius * (0.5 * TAU / (4.0 * n as f64)).cos();
        let inside = |cell: &usize| (mesh.centroid(*cell) - centre).norm() < apothem;
        let area: f64 = (0..mesh.cells.len()).filter(inside).map(|cell| mesh.cell_area(cell)).sum();
        let polygon = 0.5 * 4.0 * n as f64 * radius * radius * (TAU / (4.0 * n as f64)).sin();
        assert!((area - polygon).abs() < 1e-12, "n = {n}: {area} of {polygon}");
        assert!((mesh.area() - 1.0).abs() < 1e-12);
        let on_circle = mesh.vertices.iter().filter(|x| ((*x - centre).norm() - radius).abs() < 1e-12).count();
        assert_eq!(on_circle, 4 * n);
        assert_eq!(mesh.faces.iter().filter(|face| face.tag.is_some()).count(), 4 * n);
    }
}

#[test]
fn circles_that_do_not_fit_are_refused() {
    let cases = [(scene(4, 0.6), "mesh.radius"), (scene(4, 1e-3), "mesh.radius"), (scene(0, 0.1), "mesh.n")];
    let without = MeshScene::of("square-with-circle").with("n", 4_usize);
    let distorted = scene(4, 0.1).with("distortion", 0.1);
    for (scene, key) in cases.into_iter().chain([(without, "mesh.radius"), (distorted, "mesh.distortion")]) {
        match scene.build() {
            Err(MeshError::BadKey { key: blamed, hint, .. }) => {
                assert_eq!(blamed, key);
                assert!(!hint.is_empty());
            }
            other => panic!("{key}: {other:?}"),
        }
    }
}
