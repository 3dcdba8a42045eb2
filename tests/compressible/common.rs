//! Sheets and fields that the tests share.

use std::sync::Arc;

use monolayer::expression::Expression;
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::compressible::Compressible;
use monolayer::model::{Conditions, Degrees, DensityLaw, Description, ModelKind, Parameters, VelocityCondition};
use monolayer::scheme::ControlSettings;
use monolayer::space::{Field, Space, project};
use monolayer::time::{CouplingKind, CouplingSettings, MarchSettings};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const LAW: DensityLaw = DensityLaw { penalty: 1.5, exponent: 2.5, critical: 0.3, active_stress_iso: 0.4 };

/// Every term is on.
pub const PARAMETERS: Parameters = Parameters {
    friction: 1.3,
    traction: 0.8,
    active_stress: 0.9,
    peclet: 1.2,
    coherence: 0.4,
    elasticity: 0.6,
    alignment: 0.7,
    density: Some(LAW),
    ..Parameters::PLAIN
};

pub fn mesh(text: &str) -> Arc<Mesh> {
    let scene: MeshScene = toml::from_str(text).expect("the test's mesh table parses");
    Arc::new(scene.build().expect("the test's mesh is good"))
}

/// Unit square with moved inner vertices.
pub fn square(n: usize) -> Arc<Mesh> {
    mesh(&format!("shape = \"square\"\nn = {n}\ndistortion = 0.2\nseed = 7"))
}

/// Unit disc with few curved cells.
pub fn disc() -> Arc<Mesh> {
    mesh("shape = \"disc\"\nh = 0.9")
}

pub fn formula(text: &str) -> Expression {
    Expression::parse(text, &[]).expect("the test's formula parses")
}

pub fn pair(f: &str, g: &str) -> [Expression; 2] {
    [formula(f), formula(g)]
}

pub fn closed(_: &str) -> Conditions {
    Conditions::slip()
}

/// Tissue enters on the left, pulsating in speed and density, and leaves on the right.
pub fn channel(tag: &str) -> Conditions {
    let turned = || pair("0.7 + y", "x - 0.2");
    match tag {
        "left" => Conditions::flow(pair("1 + 0.4*sin(5*t)*y", "0.3"))
            .with_polarity(turned())
            .with_density(formula("1 + 0.5*sin(3*t) + 0.3*y")),
        "right" => {
            Conditions::new(VelocityCondition::Traction(pair("0.1", "y"))).with_density(formula("0.6 + 0.1*cos(t)"))
        }
        "bottom" => closed(tag).with_polarity(turned()),
        _ => closed(tag),
    }
}

/// Degrees `k + 1`, `k`, `k + 1` of velocity, density and polarity.
pub fn describe(mesh: &Mesh, parameters: Parameters, k: usize, condition: fn(&str) -> Conditions) -> Description {
    let degrees = Degrees::of(ModelKind::Compressible, k);
    Description { degrees, ..Description::new(mesh, parameters, condition) }
}

pub fn sheet(mesh: &Arc<Mesh>, parameters: Parameters, k: usize, condition: fn(&str) -> Conditions) -> Compressible {
    Compressible::new(mesh, &describe(mesh, parameters, k, condition)).expect("the sheet builds")
}

pub fn settings(step: f64, order: usize, kind: CouplingKind) -> MarchSettings {
    let bounds = CouplingSettings { tolerance: 1e-9, accept: 1e-8, max_iterations: 60, ..Default::default() };
    let (control, coupling) = (ControlSettings::new(step).down_to(1e-9), CouplingSettings { kind, ..bounds });
    MarchSettings { control, coupling, ..MarchSettings::new(order, step) }
}

/// The carried vector of two functions.
pub fn carried(model: &Compressible, rho: impl Fn(Point) -> f64, p: impl Fn(Point) -> Point) -> Vec<f64> {
    let rho = project::interpolate_scalar(&model.density.space, rho);
    model.stacked(&rho.values, &project::interpolate_vector(&model.polarity.space, p).values)
}

/// Smooth density between 0.4 and 1.7, smooth polarity of every length below 1.2.
pub fn smooth(model: &Compressible) -> Vec<f64> {
    carried(model, smooth_density, |x| Point::new(0.7 * (2.0 * x.y).cos() + 0.2, 0.9 * (3.0 * x.x - x.y).sin()))
}

pub fn smooth_density(x: Point) -> f64 {
    1.05 + 0.65 * (2.0 * x.x + 0.5).sin() * (1.5 * x.y + 0.3).cos()
}

/// Independent values in [−1, 1].
pub fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| generator.random_range(-1.0..1.0)).collect()
}

pub fn random_field(space: &Arc<Space>, seed: u64) -> Field {
    Field::new(space, random(space.dof_count(), seed))
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m, v| m.max(v.abs()))
}

pub fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// The least density over every point at which one is evaluated.
pub fn least(model: &Compressible, rho: &Field) -> f64 {
    model.density.limiter.smallest(rho)
}
