//! Meshes and fields that the tests share.

use std::sync::Arc;

use monolayer::form::Integrator;
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::{Mesh, Point};
use monolayer::space::{Continuity, Field, Space};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub fn mesh(text: &str) -> Arc<Mesh> {
    let scene: MeshScene = toml::from_str(text).expect("the test's mesh table parses");
    let known = ["square", "strip", "strip-with-disc", "disc", "annulus", "racetrack"];
    assert!(scene.shape().is_none_or(|shape| known.contains(&shape)), "{text}");
    Arc::new(scene.build().expect("the test's mesh is good"))
}

/// Unit square with moved inner vertices.
pub fn square(n: usize) -> Arc<Mesh> {
    mesh(&format!("shape = \"square\"\nn = {n}\ndistortion = 0.2\nseed = 7"))
}

/// Unit disc with curved cells.
pub fn disc() -> Arc<Mesh> {
    mesh("shape = \"disc\"\nh = 0.5")
}

/// Three unlike meshes: straight and distorted, curved, and with a hole.
pub fn meshes() -> Vec<Arc<Mesh>> {
    vec![square(3), disc(), mesh("shape = \"annulus\"\nradius = 2.0\ninner_radius = 1.0\nh = 0.6")]
}

pub fn discontinuous(mesh: &Arc<Mesh>, degree: usize, components: usize) -> Arc<Space> {
    Arc::new(Space::new(mesh, Continuity::Discontinuous, degree, components))
}

pub fn continuous(mesh: &Arc<Mesh>, degree: usize, components: usize) -> Arc<Space> {
    Arc::new(Space::new(mesh, Continuity::Continuous, degree, components))
}

/// Independent coefficients in [−1, 1].
pub fn random(space: &Arc<Space>, seed: u64) -> Field {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    Field::new(space, (0..space.dof_count()).map(|_| generator.random_range(-1.0..1.0)).collect())
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `xᵀ A y` of a matrix in triplets.
pub fn apply(triplets: &[(usize, usize, f64)], x: &[f64], y: &[f64]) -> f64 {
    triplets.iter().map(|&(i, j, a)| x[i] * a * y[j]).sum()
}

pub fn loops(mesh: &Arc<Mesh>) -> Integrator {
    Integrator::new(mesh)
}

/// `a` and `b` agree to `tolerance` relative to `scale`.
#[track_caller]
pub fn close(a: f64, b: f64, scale: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance * scale.abs(), "{a} and {b} differ by {:e} of {scale}", (a - b).abs() / scale);
}

pub fn turn(angle: f64, x: Point) -> Point {
    let (s, c) = angle.sin_cos();
    Point::new(c * x.x - s * x.y, s * x.x + c * x.y)
}
