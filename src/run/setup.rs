//! Mesh, model and initial state of a scene.

use std::path::Path;
use std::sync::Arc;

use super::RunError;
use super::available::available;
use super::exact::check_exact;
use super::memory::{self, Unknowns};
use crate::form::Faces;
use crate::measure::{MeasureError, Strain};
use crate::mesh::generate::{MeshScene, Shape};
use crate::mesh::locate::Locator;
use crate::mesh::quality::Quality;
use crate::mesh::{Mesh, MeshError, Point, gmsh};
use crate::model::compressible::Compressible;
use crate::model::incompressible::{Degrees, Description, Incompressible};
use crate::model::manufactured::Volume;
use crate::model::momentum::MomentumError;
use crate::model::{Expression, ModelKind, start};
use crate::output::checkpoint::Saved;
use crate::scene::{Initial, InitialDensity, Measure, Scene, SceneSource, What};
use crate::space::{Continuity, Field, Space, project};
use crate::time::{Checkpoint, March, Sheet};

/// All that is built before the first step.
#[derive(Debug)]
pub struct Setup {
    pub mesh: Arc<Mesh>,
    pub quality: Quality,
    pub locator: Locator,
    pub model: Box<dyn Sheet>,
    /// The equation of the elastic strain, where some output needs it.
    pub strain: Option<Strain>,
    /// Wall seconds that the setup took.
    pub seconds: f64,
}

/// Length over which the aligned start is smoothed, in disc radii   [10.4].
const ALIGNED_LENGTH: f64 = 1.0;

/// Builds or reads the mesh of a scene.
///
/// # Errors
/// Bad keys, an unreadable file, inverted cells.
pub fn build_mesh(scene: &Scene) -> Result<Mesh, RunError> {
    mesh_of(&scene.mesh, scene.source())
}

/// Builds or reads the mesh of a scene of any kind.
///
/// # Errors
/// As [`build_mesh`].
pub fn mesh_of(table: &MeshScene, source: &SceneSource) -> Result<Mesh, RunError> {
    let built = match &table.file {
        None => table.build(),
        Some(file) => gmsh::read(Path::new(file)).and_then(|mut mesh| match table.curved {
            None => Ok(mesh),
            Some(degree @ 1..=3) => mesh.bend(degree).map(|()| mesh),
            Some(other) => Err(MeshError::BadKey {
                key: "mesh.curved".into(),
                value: other.to_string(),
                rule: "must be 1, 2 or 3".into(),
                hint: "leave it out to keep the geometry of the file".into(),
            }),
        }),
    };
    let few_tags = built.and_then(|mesh| match mesh.tags.len() {
        count if count > Faces::MAX_TAGS => Err(MeshError::BadKey {
            key: "mesh.file".into(),
            value: format!("{count} boundary tags"),
            rule: format!("a mesh may have at most {}", Faces::MAX_TAGS),
            hint: "join boundary curves with the same conditions in one physical group".into(),
        }),
        _ => Ok(mesh),
    });
    few_tags.map_err(|error| {
        let origin = match &error {
            MeshError::BadKey { key, .. } => source.place(key).to_string(),
            MeshError::Inverted { .. }
            | MeshError::NonManifold { .. }
            | MeshError::Untagged { .. }
            | MeshError::NotOnBoundary { .. }
            | MeshError::BadVertex { .. }
            | MeshError::Empty
            | MeshError::File { .. } => source.place("mesh").to_string(),
        };
        RunError::Mesh { origin, error: Box::new(error) }
    })
}

/// The model of a kind.
fn build(kind: ModelKind, mesh: &Arc<Mesh>, description: &Description) -> Result<Box<dyn Sheet>, MomentumError> {
    Ok(match kind {
        ModelKind::Incompressible => Box::new(Incompressible::new(mesh, description)?),
        ModelKind::Compressible => Box::new(Compressible::new(mesh, description)?),
    })
}

impl Setup {
    /// Builds the mesh, compares its tags with the scene, assembles and factorises.
    ///
    /// # Errors
    /// As [`Setup::within`] and [`available`].
    pub fn new(scene: &Scene) -> Result<Self, RunError> {
        Self::within(scene, available()?)
    }

    /// As [`Setup::new`] with so many bytes of memory; `None` is as many as are asked for.
    ///
    /// # Errors
    /// As [`build_mesh`], [`Scene::check_tags`], [`memory::check`] and [`Incompressible::new`].
    pub fn within(scene: &Scene, available: Option<f64>) -> Result<Self, RunError> {
        let begin = std::time::Instant::now();
        let mesh = Arc::new(build_mesh(scene)?);
        scene.check_tags(&mesh.tags)?;
        scene.check_bodies(&mesh)?;
        super::tissue::check(scene)?;
        check_measures(scene, &mesh)?;
        check_exact(scene, &mesh)?;
        let description = describe(scene, &mesh);
        let need = memory::need(scene, &Unknowns::new(scene, &mesh, &description).layout())?;
        memory::check(scene, &need, available)?;
        let model: Result<Box<dyn Sheet>, _> = match &scene.bodies {
            None => build(scene.parameters.kind(), &mesh, &description),
            Some(bodies) => super::tissue::around(&mesh, &description, bodies).map(|model| Box::new(model) as _),
        };
        let model =
            model.map_err(|e| RunError::Model { origin: scene.source().origin().into(), error: Box::new(e) })?;
        if let Some(structure) = need.structure {
            model.know_structure(structure);
        }
        let locator = Locator::new(&mesh);
        let strain = super::strain::prepare(scene, &mesh, model.conditions())?;
        Ok(Self { quality: mesh.quality(), locator, model, strain, mesh, seconds: begin.elapsed().as_secs_f64() })
    }

    /// The polarity at t = 0.
    ///
    /// # Errors
    /// Formulas that are not finite; a file that does not fit.
    pub fn initial(&self, scene: &Scene) -> Result<Field, RunError> {
        let origin = || scene.source().origin().to_owned();
        let space = &self.model.polarity().space;
        match &scene.initial {
            Initial::AlignedAroundDisc => {
                let length = ALIGNED_LENGTH * scene.mesh.radius.unwrap_or(1.0);
                start::aligned(self.model.loops(), space, self.model.conditions(), length)
                    .map_err(|e| RunError::Model { origin: origin(), error: Box::new(e) })
            }
            Initial::Circulating => {
                let track = scene.mesh.track().expect("the scene was checked for a track");
                Ok(project::interpolate_vector(space, |x| track.tangent(x)))
            }
            Initial::Exact => {
                let exact = scene.sources.exact.as_ref().expect("the scene was checked for exact fields");
                start::formulas(space, exact.polarity(), 0.0).map_err(|e| RunError::Formula {
                    origin: scene.source().place("exact.polarity").to_string(),
                    error: Box::new(e),
                })
            }
            Initial::Expressions(formulas) => start::formulas(space, formulas, 0.0).map_err(|e| RunError::Formula {
                origin: scene.source().place("initial.polarity").to_string(),
                error: Box::new(e),
            }),
            Initial::Random { seed, amplitude, h_coarse } => start::random(space, *seed, *amplitude, *h_coarse)
                .ok_or_else(|| RunError::Start {
                    file: scene.source().place("initial.polarity").to_string(),
                    what: format!("`initial.polarity.random.h_coarse` = {h_coarse} needs too many random vectors"),
                    hint: "take about the size of the structures, such as 0.25".into(),
                }),
            Initial::File(path) => from_checkpoint(space, path, Carried::Polarity),
        }
    }

    /// The density at t = 0, where there is one.
    ///
    /// # Errors
    /// As [`Setup::initial`]; a density below zero.
    pub fn initial_density(&self, scene: &Scene) -> Result<Option<Field>, RunError> {
        let Some(start) = &scene.initial_density else { return Ok(None) };
        let space = self.model.volume();
        let formula = |key: &str, formula: &Expression| {
            start::density(space, formula, 0.0)
                .map_err(|e| RunError::Formula { origin: scene.source().place(key).to_string(), error: Box::new(e) })
        };
        let field = match start {
            InitialDensity::Formula(given) => formula("initial.density", given)?,
            InitialDensity::Exact => formula("exact.density", exact_density(scene))?,
            InitialDensity::File(path) => from_checkpoint(space, path, Carried::Density)?,
        };
        Ok(Some(field))
    }

    /// What is carried at t = 0.
    fn carried(&self, scene: &Scene) -> Result<Vec<f64>, RunError> {
        let p = self.initial(scene)?.values;
        Ok(match self.initial_density(scene)? {
            None => p,
            Some(rho) => [rho.values, p].concat(),
        })
    }

    /// The march of a scene at its start: from the initial polarity, or after b − 1 steps with the exact one.
    ///
    /// # Errors
    /// As [`Setup::initial`]; a formula that is not finite.
    pub fn start(&self, scene: &Scene) -> Result<March<'_>, RunError> {
        let origin = || scene.source().origin().to_owned();
        let failed = |e| RunError::begin(scene.source().origin(), e);
        let formula = |e| RunError::Formula { origin: origin(), error: Box::new(e) };
        self.model.check_formulas(0.0).map_err(formula)?;
        let settings = scene.march();
        let Some(exact) = scene.sources.exact.as_ref().filter(|_| scene.time.exact_start) else {
            return March::start(&*self.model, settings, self.carried(scene)?).map_err(failed);
        };
        let mut past = Vec::new();
        let mut t = 0.0;
        for step in 0..settings.order {
            let p = start::formulas(&self.model.polarity().space, exact.polarity(), t).map_err(formula)?.values;
            let y = match exact.volume() {
                Volume::Pressure(_) => p,
                Volume::Density { value, .. } => {
                    [start::density(self.model.volume(), value, t).map_err(formula)?.values, p].concat()
                }
            };
            past.insert(0, (t, y));
            t += settings.length(settings.control.step, step);
        }
        March::start_after(&*self.model, settings, past).map_err(failed)
    }

    /// Whether a saved state has the unknowns of this problem.
    pub fn fits(&self, saved: &Checkpoint) -> bool {
        let (velocity, unknowns) = (self.model.velocity().dof_count(), self.model.carried_len());
        saved.velocity.len() == velocity
            && saved.volume.len() == self.model.volume().dof_count()
            && saved.rate_of_p.len() == self.model.polarity().space.dof_count()
            && saved.origin.as_ref().is_none_or(|o| o.fits(velocity, unknowns))
            && !saved.past.is_empty()
            && saved.past.iter().all(|(_, p)| p.len() == unknowns)
    }

    /// Remarks of the scene, and those that need the mesh.
    pub fn remarks(&self, scene: &Scene) -> Vec<String> {
        let mut remarks = scene.remarks();
        remarks.extend(resolution_remark(scene, &self.quality));
        remarks
    }
}

/// A warning when even the smallest cells do not resolve the coherence length.
pub fn resolution_remark(scene: &Scene, quality: &Quality) -> Option<String> {
    let (h, kappa, degree) = (quality.h_min, scene.parameters.coherence, scene.space.polarity);
    (h / degree as f64 > kappa).then(|| {
        format!(
            "the smallest cell, {h:.3}, over the polarity's degree {degree} is larger than the coherence length {kappa}: \
             layers of the polarity are not resolved"
        )
    })
}

/// Refuses measures that the domain does not have.
///
/// # Errors
/// An overshoot where there is no disc with tissue behind it.
pub fn check_measures(scene: &Scene, mesh: &Mesh) -> Result<(), RunError> {
    let asked = scene.outputs.iter().any(|output| match &output.what {
        What::Measures(measures) => measures.contains(&Measure::Overshoot),
        What::Fields(_) | What::Cuts(_) | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => false,
    });
    let behind = scene.mesh.centre.unwrap_or([0.0, 0.0])[0] + scene.mesh.radius.unwrap_or(1.0);
    let single_disc = mesh.tag("disc").is_some() && scene.mesh.shape != Some(Shape::Racetrack);
    if asked && super::tissue::wake(scene).is_some_and(|(_, end)| mesh.vertices.iter().any(|x| x.x > end)) {
        return Ok(());
    }
    if asked && !(single_disc && mesh.vertices.iter().any(|x| x.x > behind)) {
        return Err(RunError::Measure(MeasureError::NoDisc { behind }));
    }
    Ok(())
}

/// The problem in the model's terms.
pub fn describe(scene: &Scene, mesh: &Mesh) -> Description {
    Description {
        parameters: scene.parameters,
        degrees: Degrees {
            velocity: scene.space.velocity,
            pressure: scene.space.pressure,
            density: scene.space.density,
            polarity: scene.space.polarity,
        },
        conditions: mesh.tags.iter().map(|tag| scene.boundary[tag].clone()).collect(),
        sources: scene.sources.clone(),
        slip: scene.space.slip,
    }
}

/// A field that checkpoints keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Carried {
    Density,
    Polarity,
}

/// The formula of the exact density.
fn exact_density(scene: &Scene) -> &Expression {
    let exact = scene.sources.exact.as_ref().expect("the scene was checked for exact fields");
    exact.volume().density().expect("the exact fields of a compressible sheet have a density")
}

/// A field of another run's checkpoint, interpolated: mesh and degree may differ, the domain must not.
fn from_checkpoint(space: &Arc<Space>, path: &Path, which: Carried) -> Result<Field, RunError> {
    let file = path.display().to_string();
    let wrong = |what: String| RunError::Start {
        file: file.clone(),
        what,
        hint: "give a `checkpoint.bin` of a run on the same domain".into(),
    };
    let saved = Saved::read(path).map_err(|e| wrong(e.to_string()))?;
    let scene = Scene::parse(&saved.scene, path)?;
    let mesh = Arc::new(build_mesh(&scene)?);
    let discontinuous =
        |degree: usize, components: usize| Arc::new(Space::new(&mesh, Continuity::Discontinuous, degree, components));
    let polarity = discontinuous(scene.space.polarity, 2);
    // an incompressible sheet has no space of densities
    let density = match scene.parameters.kind() {
        ModelKind::Incompressible => None,
        ModelKind::Compressible => Some(discontinuous(scene.space.density, 1)),
    };
    let before = density.as_ref().map_or(0, |space| space.dof_count());
    let count = before + polarity.dof_count();
    let (first, other) = match (which, density) {
        (Carried::Density, Some(density)) => (0, density),
        (Carried::Density, None) => {
            return Err(wrong("its run was of an incompressible sheet, which has no density".into()));
        }
        (Carried::Polarity, _) => (before, polarity),
    };
    if saved.mesh != mesh.fingerprint() {
        return Err(wrong("the mesh of its run has changed since".into()));
    }
    let values = saved.march.past.into_iter().next().map(|(_, y)| y).filter(|y| y.len() == count);
    let values = values.ok_or_else(|| wrong("its fields do not fit its mesh".into()))?;
    let field = Field::new(&other, values[first..first + other.dof_count()].to_vec());
    interpolate(space, &field, &mesh)
        .map_err(|x| wrong(format!("its mesh does not cover the point ({:.4}, {:.4})", x.x, x.y)))
}

/// The last polarity of the run that left a checkpoint, on that run's own mesh.
///
/// # Errors
/// A file that is none, a mesh that has changed since.
pub fn last_polarity(checkpoint: &Path) -> Result<(Arc<Mesh>, Field), RunError> {
    let saved = Saved::read(checkpoint)?;
    let scene = Scene::parse(&saved.scene, checkpoint)?;
    let mesh = Arc::new(build_mesh(&scene)?);
    let space = Arc::new(Space::new(&mesh, Continuity::Discontinuous, scene.space.polarity, 2));
    let values = saved.march.past.into_iter().next().map(|(_, y)| y).unwrap_or_default();
    let first = values.len().checked_sub(space.dof_count());
    let (Some(first), true) = (first, saved.mesh == mesh.fingerprint()) else {
        let (file, what) = (checkpoint.display().to_string(), "its fields do not fit its mesh".to_owned());
        return Err(RunError::Start { file, what, hint: "the mesh of its run has changed since: run it again".into() });
    };
    let field = Field::new(&space, values[first..].to_vec());
    Ok((mesh, field))
}

/// The last polarity of the run that left a checkpoint, interpolated into another space.
///
/// # Errors
/// As [`last_polarity`]; a domain that does not cover this one.
pub fn polarity_of(space: &Arc<Space>, checkpoint: &Path) -> Result<Field, RunError> {
    from_checkpoint(space, checkpoint, Carried::Polarity)
}

/// A field at the nodes of another space, or a point that its mesh does not cover.
fn interpolate(space: &Arc<Space>, field: &Field, mesh: &Mesh) -> Result<Field, Point> {
    let locator = Locator::new(mesh);
    let mut missing = None;
    // nodes lie on the boundaries of cells: evaluate a little inside of the own cell to take the value of the right side
    let inside = 1e-9;
    let mut out = Field::zero(space);
    let reference = crate::element::basis::nodes(space.degree);
    for cell in 0..space.mesh.cells.len() {
        let centre = space.mesh.map(cell).at(Point::new(1.0 / 3.0, 1.0 / 3.0)).0;
        for (i, &xi) in reference.iter().enumerate() {
            let x = space.mesh.map(cell).at(xi).0;
            match locator.locate_near(mesh, x + (centre - x) * inside, 0.05) {
                Some((from, eta)) => {
                    for c in 0..space.components {
                        out.values[space.dof(cell, c, i)] = field.component_at(from, eta, c);
                    }
                }
                None => missing = missing.or(Some(x)),
            }
        }
    }
    match missing {
        None => Ok(out),
        Some(x) => Err(x),
    }
}

/// The first key in which two resolved scenes differ, of those that define the problem.
pub fn first_difference(saved: &str, now: &str) -> Option<String> {
    let read = |text: &str| -> toml::Table {
        let mut table = crate::scene::renamed::table(text).unwrap_or_default();
        for key in ["output", "title", "accuracy", "coupling", "steady", "strain"] {
            table.remove(key);
        }
        if let Some(time) = table.get_mut("time").and_then(toml::Value::as_table_mut) {
            time.retain(|key, _| key == "scheme");
        }
        table
    };
    differing("", &toml::Value::Table(read(saved)), &toml::Value::Table(read(now)))
}

/// The first key in which two tables differ, below `path`.
pub(crate) fn differing(path: &str, a: &toml::Value, b: &toml::Value) -> Option<String> {
    match (a.as_table(), b.as_table()) {
        (Some(a), Some(b)) => a.keys().chain(b.keys()).find_map(|key| {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            match (a.get(key), b.get(key)) {
                (Some(a), Some(b)) => differing(&path, a, b),
                (None, None) => None,
                (Some(_), None) | (None, Some(_)) => Some(path),
            }
        }),
        (Some(_), None) | (None, Some(_)) => Some(path.into()),
        (None, None) => (a != b).then(|| path.into()),
    }
}
