//! The crate as a library: passive tissue in a ring relaxes, and its free energy never grows.
//!
//! `cargo run --release --example relaxation`

use std::sync::Arc;

use monolayer::mesh::Point;
use monolayer::mesh::generate::MeshScene;
use monolayer::model::incompressible::{Degrees, Description, Incompressible};
use monolayer::model::momentum::SlipTreatment;
use monolayer::model::{Conditions, Parameters, PolarityCondition, Sources, VelocityCondition};
use monolayer::scheme::ControlSettings;
use monolayer::space::project;
use monolayer::time::{CouplingKind, CouplingSettings, March, MarchSettings};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ring = MeshScene::of("annulus").with("radius", 2.0).with("inner_radius", 1.0).with("h", 0.3);
    let mesh = Arc::new(ring.build()?);
    let slip = Conditions { velocity: VelocityCondition::Slip, polarity: PolarityCondition::Neumann, density: None };
    let model = Incompressible::new(
        &mesh,
        &Description {
            parameters: Parameters { traction: 0.0, coherence: 0.3, elasticity: 1.0, ..Parameters::PLAIN },
            degrees: Degrees { velocity: 2, pressure: 1, density: 0, polarity: 3 },
            conditions: vec![slip; mesh.tags.len()],
            sources: Sources::default(),
            slip: SlipTreatment::Rotated,
        },
    )?;
    let start = project::interpolate_vector(&model.polarity.space, |x| Point::new((3.0 * x.y).sin(), x.x.cos()));
    let settings = MarchSettings {
        order: 1,
        control: ControlSettings::new(0.05, 1e-6),
        alternate: 1.0,
        coupling: CouplingSettings {
            tolerance: 1e-8,
            accept: 1e-4,
            diverged: 1e4,
            max_iterations: 100,
            kind: CouplingKind::Anderson { depth: 5 },
        },
        density_implicit: false,
    };
    let mut march = March::start(&model, settings, start.values)?;
    println!("{} cells, {} unknowns of the polarity", mesh.cells.len(), model.polarity.space.dof_count());
    let mut last = f64::INFINITY;
    for _ in 0..10 {
        for _ in 0..4 {
            march.advance(f64::MAX)?;
        }
        let (energy, rate) = march.energy();
        println!("t = {:.2}   F = {energy:.6}   dF/dt = {rate:+.2e}", march.t);
        assert!(energy <= last, "the free energy grew");
        last = energy;
    }
    Ok(())
}
