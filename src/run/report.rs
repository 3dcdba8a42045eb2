//! What `check` says of a scene before anything is solved.

use std::fmt;

use serde::Serialize;

use super::available::available;
use super::exact::check_exact;
use super::memory::{self, Unknowns};
use super::setup::{build_mesh, describe};
use super::{RunError, setup};
use crate::mesh::quality::Quality;
use crate::model::momentum::check_held;
use crate::model::{ModelKind, Term, rotation};
use crate::scene::Scene;
use crate::scene::presets::MEASURED;

/// What will be solved, and with how much.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    pub title: Option<String>,
    pub terms: Vec<Term>,
    pub mesh: Quality,
    pub velocity_unknowns: usize,
    /// `pressure` or `density`.
    pub volume: &'static str,
    pub volume_unknowns: usize,
    pub polarity_unknowns: usize,
    /// Of the linear system of the flow.
    pub flow_unknowns: usize,
    /// Estimate of the peak memory of a run.
    pub memory_mib: f64,
    /// What the system can give, where it tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub available_mib: Option<f64>,
    pub remarks: Vec<String>,
    /// What `accuracy` sets, where the scene names one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<PresetReport>,
}

/// What a preset does to a scene, and what it was measured to give.
#[derive(Debug, Clone, Serialize)]
pub struct PresetReport {
    pub name: &'static str,
    /// Keys that the scene leaves out, and their values.
    pub sets: Vec<(String, String)>,
    /// Case, measure, error and wall seconds.
    pub measured: Vec<(&'static str, &'static str, &'static str, f64)>,
}

impl PresetReport {
    fn new(scene: &Scene) -> Option<Self> {
        let accuracy = scene.accuracy()?;
        let at = accuracy as usize;
        let measured = MEASURED.iter().map(|m| (m.case, m.measure, m.errors[at], m.seconds[at])).collect();
        Some(Self { name: accuracy.name(), sets: scene.preset.clone(), measured })
    }
}

/// Builds the mesh of a scene and counts; solves nothing.
///
/// # Errors
/// As [`report_within`] and [`available`].
pub fn report(scene: &Scene) -> Result<Report, RunError> {
    report_within(scene, available()?)
}

/// As [`report`] with so many bytes of memory, where they are known.
///
/// # Errors
/// As [`build_mesh`], [`Scene::check_tags`], [`check_exact`] and [`memory::need`].
pub fn report_within(scene: &Scene, available: Option<f64>) -> Result<Report, RunError> {
    let mesh = std::sync::Arc::new(build_mesh(scene)?);
    scene.check_tags(&mesh.tags)?;
    scene.check_bodies(&mesh)?;
    super::tissue::check(scene)?;
    setup::check_measures(scene, &mesh)?;
    check_exact(scene, &mesh)?;
    let description = describe(scene, &mesh);
    let unknowns = Unknowns::new(scene, &mesh, &description);
    let Unknowns { velocity, volume, polarity, .. } = &unknowns;
    if scene.parameters.friction == 0.0 {
        check_held(velocity, &description.conditions).map_err(|error| {
            let origin = scene.source().place("model.friction").to_string();
            RunError::Model { origin, error: Box::new(error) }
        })?;
    }
    let need = memory::need(scene, &unknowns.layout())?;
    let quality = mesh.quality();
    let mut remarks = scene.remarks();
    remarks.extend(setup::mesh_remarks(&mesh));
    remarks.extend(setup::resolution_remarks(scene, &mesh, &quality));
    let friction = scene.parameters.friction;
    remarks.extend(rotation::remark(&mesh, velocity, &description.conditions, friction));
    remarks.extend(memory::check(scene, &need, available).err().map(|error| error.to_string()));
    Ok(Report {
        title: scene.title.clone(),
        terms: scene.terms(),
        memory_mib: need.bytes / memory::MIB,
        available_mib: available.map(|bytes| bytes / memory::MIB),
        velocity_unknowns: velocity.dof_count(),
        volume: match scene.parameters.kind() {
            ModelKind::Incompressible => "pressure",
            ModelKind::Compressible => "density",
        },
        volume_unknowns: volume.dof_count(),
        polarity_unknowns: polarity.dof_count(),
        flow_unknowns: unknowns.layout().first(),
        remarks,
        accuracy: PresetReport::new(scene),
        mesh: quality,
    })
}

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
            (self.volume, self.volume_unknowns),
            ("polarity", self.polarity_unknowns),
            ("flow system", self.flow_unknowns),
        ] {
            writeln!(out, "  {name:<14} {count}")?;
        }
        write!(out, "\nmemory  about {:.0} MiB", self.memory_mib)?;
        if let Some(preset) = &self.accuracy {
            write!(out, "\n\naccuracy = \"{}\" sets", preset.name)?;
            for (key, value) in &preset.sets {
                write!(out, "\n  {key} = {value}")?;
            }
            if preset.sets.is_empty() {
                write!(out, " nothing: the scene gives every key itself")?;
            }
            write!(out, "\nerrors and wall seconds that it was measured to have (docs/tradeoff.md)")?;
            for (case, measure, error, seconds) in &preset.measured {
                write!(out, "\n  {case:<22} {measure:<34} {error:>12}  {seconds:>6} s")?;
            }
        }
        for remark in &self.remarks {
            write!(out, "\n\nnote: {remark}")?;
        }
        Ok(())
    }
}

pub(super) fn indent(text: &str) -> String {
    text.lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
