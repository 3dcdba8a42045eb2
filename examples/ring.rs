//! Passive tissue in a ring relaxes, and its free energy never grows: `cargo run --release --example ring`
use std::sync::Arc;

use monolayer::mesh::{Point, generate::MeshScene};
use monolayer::model::{Conditions, Description, Incompressible, Parameters};
use monolayer::space::project;
use monolayer::time::{March, MarchSettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ring = MeshScene::of("annulus").with("radius", 2.0).with("inner_radius", 1.0).with("h", 0.3);
    let mesh = Arc::new(ring.build()?);
    let passive = Parameters { traction: 0.0, coherence: 0.3, elasticity: 1.0, ..Parameters::PLAIN };
    let model = Incompressible::new(&mesh, &Description::new(&mesh, passive, |_| Conditions::slip()))?;
    let start = project::interpolate_vector(&model.polarity.space, |x| Point::new((3.0 * x.y).sin(), x.x.cos()));
    let mut march = March::start(&model, MarchSettings::new(1, 0.05), start.values)?;
    let mut last = f64::INFINITY;
    while march.t < 2.0 {
        march.advance(2.0)?;
        let (energy, rate) = march.energy();
        println!("t = {:.2}   F = {energy:.6}   dF/dt = {rate:+.2e}", march.t);
        assert!(energy <= last, "the free energy grew");
        last = energy;
    }
    Ok(())
}
