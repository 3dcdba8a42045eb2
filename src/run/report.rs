//! What `check` says of a scene before anything is solved.

use std::fmt;

use serde::Serialize;

use super::exact::check_exact;
use super::setup::{build_mesh, describe};
use super::{RunError, setup};
use crate::element::basis::node_count;
use crate::mesh::quality::Quality;
use crate::model::Term;
use crate::model::frames::{Frames, WallPoints};
use crate::model::lagged::{Layout, Structure};
use crate::model::momentum::MomentumError;
use crate::scene::Scene;
use crate::solve::blocks::neighbours;
use crate::space::{Continuity, Space};
use crate::time::CouplingKind;

/// What will be solved, and with how much.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    pub title: Option<String>,
    pub terms: Vec<Term>,
    pub mesh: Quality,
    pub velocity_unknowns: usize,
    pub pressure_unknowns: usize,
    pub polarity_unknowns: usize,
    pub stokes_unknowns: usize,
    /// Estimate of the peak memory of a run.
    pub memory_mib: f64,
    pub remarks: Vec<String>,
}

/// Builds the mesh of a scene and counts; solves nothing.
///
/// # Errors
/// As [`build_mesh`], [`Scene::check_tags`] and [`check_exact`].
pub fn report(scene: &Scene) -> Result<Report, RunError> {
    let mesh = std::sync::Arc::new(build_mesh(scene)?);
    scene.check_tags(&mesh.tags)?;
    setup::check_measures(scene, &mesh)?;
    check_exact(scene, &mesh)?;
    let description = describe(scene, &mesh);
    let velocity = Space::new(&mesh, Continuity::Continuous, scene.space.velocity, 2);
    let pressure = Space::new(&mesh, Continuity::Continuous, scene.space.pressure, 1);
    let frames = Frames::new(&velocity, &description.conditions, scene.space.slip.points());
    let held = || Frames::new(&velocity, &description.conditions, WallPoints::Nodes).hold_rigid_motions(&velocity);
    if scene.parameters.friction == 0.0 && !held() {
        let origin = scene.source().place("model.friction").to_string();
        return Err(RunError::Model { origin, error: Box::new(MomentumError::Unheld) });
    }
    let polarity_unknowns = mesh.cells.len() * 2 * node_count(scene.space.polarity);
    let stokes_unknowns = frames.free + pressure.dof_count();
    let coupled = match scene.coupling.kind {
        CouplingKind::FixedPoint | CouplingKind::Anderson { .. } => 0,
        CouplingKind::Newton => {
            let polarity = Space::new(&mesh, Continuity::Discontinuous, scene.space.polarity, 2);
            let layout = Layout {
                velocity: &velocity,
                pressure: &pressure,
                polarity: &polarity,
                frames: &frames,
                closed: scene.pressure_is_free(),
                neighbours: &neighbours(&mesh),
            };
            // two operators and three sets of blocks between velocity and polarity, beside the factors
            let (n, nv) = (polarity.n, velocity.n);
            8 * mesh.cells.len() * (14 * n * n + 12 * n * nv) + Structure::new(&layout)?.bytes()
        }
    };
    let quality = mesh.quality();
    let mut remarks = scene.remarks();
    remarks.extend(setup::resolution_remark(scene, &quality));
    Ok(Report {
        title: scene.title.clone(),
        terms: scene.terms(),
        memory_mib: (memory(scene, mesh.cells.len(), stokes_unknowns) + coupled as f64) / (1024.0 * 1024.0),
        velocity_unknowns: velocity.dof_count(),
        pressure_unknowns: pressure.dof_count(),
        polarity_unknowns,
        stokes_unknowns,
        remarks,
        mesh: quality,
    })
}

/// Bytes of a run without the factors of Newton's method: the dense blocks of the polarity, its Krylov space and history, and the Stokes matrix with its assembly and
/// its factors.
fn memory(scene: &Scene, cells: usize, stokes: usize) -> f64 {
    const BLOCKS: usize = 4 + 2 + 7 + 4 + 1; // diffusion, mass and inverse, operator, factors, room for assembly
    const VECTORS: usize = 40;
    let n = node_count(scene.space.polarity);
    let polarity = cells * n * (BLOCKS * n + 2 * (VECTORS + scene.time.order));
    8.0 * polarity as f64 + STOKES.0 * (stokes as f64).powf(STOKES.1) + PROGRAM
}

/// Factor and exponent of the bytes of the Stokes part, fitted to the measured peaks of meshes of 570, 2978 and 9214 cells.
const STOKES: (f64, f64) = (180.0, 1.41);
/// The program itself.
const PROGRAM: f64 = 20e6;

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(title) = &self.title {
            writeln!(out, "{title}\n")?;
        }
        writeln!(out, "terms")?;
        for term in &self.terms {
            let mark = if term.on { "on " } else { "off" };
            writeln!(out, "  {mark}  {:<26} {:<44} {}", term.name, term.formula, term.reason)?;
        }
        writeln!(out, "\nmesh\n{}", indent(&self.mesh.to_string()))?;
        writeln!(out, "\nunknowns")?;
        for (name, count) in [
            ("velocity", self.velocity_unknowns),
            ("pressure", self.pressure_unknowns),
            ("polarity", self.polarity_unknowns),
            ("Stokes system", self.stokes_unknowns),
        ] {
            writeln!(out, "  {name:<14} {count}")?;
        }
        write!(out, "\nmemory  about {:.0} MiB", self.memory_mib)?;
        for remark in &self.remarks {
            write!(out, "\n\nnote: {remark}")?;
        }
        Ok(())
    }
}

fn indent(text: &str) -> String {
    text.lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
