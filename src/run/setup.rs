//! Model and initial state of a scene on its mesh.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use super::RunError;
use super::available::available;
use super::domain::{build_mesh, mesh_remarks};
use super::exact::Claim;
use super::forecast::{COUNTED, Count, Samples};
use super::last_state::{LastState, polarity_of};
use super::memory::{self, Need, Unknowns};
use super::resolution;
use super::stepper::Ground;
use crate::expression::Expression;
use crate::form::Integrator;
use crate::measure::list::Premise;
use crate::measure::{Inlet, MeasureError};
use crate::mesh::Mesh;
use crate::mesh::quality::Quality;
use crate::model::boundary::PolarityCondition;
use crate::model::compressible::Compressible;
use crate::model::fields::VELOCITY;
use crate::model::incompressible::{Degrees, Description, Incompressible};
use crate::model::manufactured::Volume;
use crate::model::momentum::{MomentumError, check_held};
use crate::model::{Conditions, ModelKind, rotation, start};
use crate::scene::path::quoted;
use crate::scene::{Initial, InitialDensity, Scene, StrainSettings, measured};
use crate::scheme::schedule::plain;
use crate::space::{Continuity, Field, Space, project};
use crate::time::{Checkpoint, March, Sheet, SheetKind};

/// All that is built before the first step.
#[derive(Debug)]
pub struct Setup {
    /// The mesh, and what is prepared on it.
    pub ground: Ground,
    /// The equations, assembled.
    pub model: Box<dyn Sheet>,
    /// Wall seconds that the setup took.
    pub seconds: f64,
    /// A remark on the start of a run, once it was made.
    pub said_of_start: OnceLock<String>,
}

/// Masses that differ by this share are the same.
const SAME_MASS: f64 = 1e-10;

/// Length over which the aligned start is smoothed, in disc radii   [10.4].
const ALIGNED_LENGTH: f64 = 1.0;

/// Refuses what does not go together with the mesh.
///
/// # Errors
/// Tags without conditions, bodies without a place, measures that the domain does not have, exact fields that are no
/// solution, a flow that nothing holds.
pub fn check_on(scene: &Scene, mesh: &Arc<Mesh>) -> Result<(), RunError> {
    scene.check_tags(&mesh.tags)?;
    scene.check_bodies(mesh)?;
    super::kinds::tissue::check(scene)?;
    check_measures(scene, mesh)?;
    if let Some(exact) = &scene.sources.exact {
        let (source, boundary, end) = (scene.source(), &scene.boundary, scene.time.end);
        Claim { exact, source, boundary, end }.check(mesh)?;
    }
    if scene.parameters.friction == 0.0 {
        let velocity = Space::new(mesh, Continuity::Continuous, scene.space.velocity, 2);
        check_held(&velocity, &describe(scene, mesh).conditions).map_err(|error| {
            let origin = scene.source().place("model.friction").to_string();
            RunError::Model { origin, error: Box::new(error) }
        })?;
    }
    Ok(())
}

/// A mesh on which the unknowns cannot be counted.
pub(super) fn uncounted(scene: &Scene) -> RunError {
    RunError::Start {
        file: scene.source().place("mesh").to_string(),
        what: "the unknowns on this mesh cannot be counted".to_owned(),
        hint: "take a coarser mesh; `monolayer mesh` tells what it is like".to_owned(),
    }
}

/// What a scene takes, by the number of cells that its mesh will have; a mesh from a file is read.
///
/// # Errors
/// A mesh that cannot be built, tags without conditions, unknowns that cannot be counted.
pub fn forecast(scene: &Scene) -> Result<Count, RunError> {
    let uncounted = || uncounted(scene);
    if let Some(cells) = scene.mesh.expected().filter(|cells| *cells > COUNTED) {
        return memory::samples(scene, cells).map(|samples| samples.at(cells)).ok_or_else(uncounted);
    }
    let mesh = Arc::new(build_mesh(scene)?);
    scene.check_tags(&mesh.tags)?;
    let cells = mesh.cells.len() as f64;
    let large = (cells > COUNTED).then(|| memory::samples(scene, cells)).flatten();
    large.map(|samples| samples.at(cells)).or_else(|| memory::count(scene, &mesh)).ok_or_else(uncounted)
}

/// The memory of a scene on its mesh: counted where that is quick, else judged by smaller meshes.
///
/// # Errors
/// Unknowns that cannot be ordered.
pub fn need_on(scene: &Scene, mesh: &Arc<Mesh>, samples: Option<Samples>) -> Result<Need, RunError> {
    let cells = mesh.cells.len() as f64;
    if cells > COUNTED
        && let Some(samples) = samples.or_else(|| memory::samples(scene, cells))
    {
        return Ok(Need { bytes: samples.at(cells).bytes, structure: None });
    }
    Ok(memory::need(scene, &Unknowns::new(scene, mesh, &describe(scene, mesh)).layout())?)
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
        let large = scene.mesh.expected().filter(|cells| *cells > COUNTED);
        let samples = large.and_then(|cells| Some((cells, memory::samples(scene, cells)?)));
        if let Some((cells, samples)) = &samples {
            // before the mesh is made, which takes its time and memory, too
            memory::check(scene, samples.at(*cells).bytes, available)?;
        }
        let mesh = Arc::new(build_mesh(scene)?);
        check_on(scene, &mesh)?;
        let description = describe(scene, &mesh);
        let need = need_on(scene, &mesh, samples.map(|(_, samples)| samples))?;
        memory::check(scene, need.bytes, available)?;
        let model: Result<Box<dyn Sheet>, _> = match &scene.bodies {
            None => build(scene.parameters.kind(), &mesh, &description),
            Some(bodies) => super::kinds::tissue::around(&mesh, &description, bodies).map(|model| Box::new(model) as _),
        };
        let model =
            model.map_err(|e| RunError::Model { origin: scene.source().origin().into(), error: Box::new(e) })?;
        if let Some(structure) = need.structure {
            model.know_structure(structure);
        }
        let mut ground = Ground::new(&mesh, &scene.mesh);
        ground.disc = super::kinds::tissue::wake(scene).map(|(middle, end)| (middle.into(), end - middle.x));
        let mut setup = Self { ground, model, seconds: 0.0, said_of_start: OnceLock::new() };
        setup.prepare_strain(scene.strain_needed())?;
        setup.seconds = begin.elapsed().as_secs_f64();
        Ok(setup)
    }

    /// Makes the equation of the elastic strain, where there is none yet.
    ///
    /// # Errors
    /// A structure that contradicts itself.
    pub fn prepare_strain(&mut self, settings: Option<StrainSettings>) -> Result<(), RunError> {
        if let (Some(settings), None) = (settings, &self.ground.tools.strain) {
            self.ground.tools.strain =
                Some(super::strain::prepare(settings, &self.ground.mesh, self.model.conditions())?);
        }
        Ok(())
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
                let length = ALIGNED_LENGTH * scene.mesh.radius();
                start::aligned(self.model.loops(), space, self.model.conditions(), length)
                    .map_err(|e| RunError::Model { origin: origin(), error: Box::new(e) })
            }
            Initial::Circulating => {
                let track = scene.mesh.track().expect("the scene was checked for a track");
                Ok(project::project_vector(space, &[], |x| track.tangent(x)))
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
            Initial::File(path) => polarity_of(space, path),
        }
    }

    /// The density at t = 0, where there is one: nowhere negative.
    ///
    /// # Errors
    /// As [`Setup::initial`]; a density below zero.
    pub fn initial_density(&self, scene: &Scene) -> Result<Option<Field>, RunError> {
        let (Some(start), SheetKind::Compressible(sheet)) = (&scene.initial_density, self.model.kind()) else {
            return Ok(None);
        };
        let limiter = &sheet.density.limiter;
        let formula = |key: &str, formula: &Expression| {
            start::density(limiter, formula, 0.0)
                .map_err(|e| RunError::Formula { origin: scene.source().place(key).to_string(), error: Box::new(e) })
        };
        Ok(Some(match start {
            InitialDensity::Formula(given) => formula("initial.density", given)?,
            InitialDensity::Exact => formula("exact.density", exact_density(scene))?,
            InitialDensity::File(path) => {
                let source = LastState::read(path)?.density()?;
                let field = limiter.limit_start(&source.on(limiter.space())?);
                self.compare_masses(path, &source.field, &field);
                field
            }
        }))
    }

    /// Notes when the mass of a density that was taken from another run is not the same here.
    fn compare_masses(&self, path: &Path, source: &Field, field: &Field) {
        let mass = |rho: &Field| Integrator::new(&rho.space.mesh).sum(rho.space.degree, |x| rho.scalar(&x.site));
        let (there, here) = (mass(source), mass(field));
        let change = (here - there) / there.abs().max(f64::MIN_POSITIVE);
        if change.abs() > SAME_MASS {
            let note = format!(
                "the density of {} has the mass {there:.9} on its own mesh and {here:.9} on this one, a relative \
                 change of {change:.1e}: the two meshes do not cover the same points at the boundary",
                path.display()
            );
            let _ = self.said_of_start.set(note);
        }
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
                    let SheetKind::Compressible(sheet) = self.model.kind() else {
                        unreachable!("the exact fields of a scene are those of its kind")
                    };
                    [start::density(&sheet.density.limiter, value, t).map_err(formula)?.values, p].concat()
                }
            };
            past.insert(0, (t, y));
            t = plain(t + settings.length(settings.control.step, step), 0.0);
        }
        March::start_after(&*self.model, settings, past).map_err(failed)
    }

    /// Whether a saved state has the unknowns of this problem.
    pub fn fits(&self, saved: &Checkpoint) -> bool {
        saved.fits(&*self.model)
    }

    /// Refuses results that the disk of their folder cannot take.
    ///
    /// # Errors
    /// [`RunError::Disk`]
    pub fn check_disk(&self, scene: &Scene, folder: &Path) -> Result<(), RunError> {
        let model = &self.model;
        let [velocity, volume, polarity] = [0, 1, 2].map(|k| model.fields()[k].1.dof_count() as f64);
        let bytes =
            super::report::written_on(scene, self.ground.mesh.cells.len() as f64, [velocity, volume, polarity, 0.0]);
        super::disk::check(scene.source(), bytes, folder)
    }

    /// Remarks of the scene, and those that need the mesh.
    pub fn remarks(&self, scene: &Scene) -> Vec<String> {
        let mut remarks = scene.remarks();
        remarks.extend(mesh_remarks(&self.ground.mesh));
        remarks.extend(resolution_remarks(scene, &self.ground.mesh, &self.ground.quality));
        let (model, friction) = (&self.model, scene.parameters.friction);
        remarks.extend(rotation::remark(
            &self.ground.mesh,
            model.space(VELOCITY),
            model.conditions(),
            friction,
            scene.space.slip,
        ));
        remarks
    }
}

/// What the mesh does not resolve.
pub fn resolution_remarks(scene: &Scene, mesh: &Mesh, quality: &Quality) -> Vec<String> {
    let of_bodies = scene.bodies.as_ref().and_then(|bodies| resolution::at_start(mesh, &bodies.bodies));
    resolution_remark(scene, quality).into_iter().chain(of_bodies).collect()
}

/// A warning when even the smallest cells do not resolve the coherence length.
fn resolution_remark(scene: &Scene, quality: &Quality) -> Option<String> {
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
/// An overshoot where there is no disc with tissue behind it, or no inflow before it.
pub fn check_measures(scene: &Scene, mesh: &Mesh) -> Result<(), RunError> {
    let asked = measured(&scene.outputs).into_iter().map(|asked| asked.measure).find(|m| m.needs(Premise::Wake));
    let Some(measure) = asked.map(|measure| measure.name) else { return Ok(()) };
    let behind = scene.mesh.centre()[0] + scene.mesh.radius();
    let single_disc = mesh.tag("disc").is_some() && scene.mesh.track().is_none();
    let wake = super::kinds::tissue::wake(scene);
    let carried = wake.is_some_and(|(_, end)| mesh.vertices.iter().any(|x| x.x > end));
    if !(carried || single_disc && mesh.vertices.iter().any(|x| x.x > behind)) {
        return Err(RunError::Measure(MeasureError::NoDisc { measure, behind }));
    }
    let axis = wake.map_or(scene.mesh.centre()[1], |(middle, _)| middle.y);
    check_inflow(scene, mesh, measure, axis)
}

/// Refuses a measure over an inflow that cannot be one.
fn check_inflow(scene: &Scene, mesh: &Mesh, measure: &'static str, axis: f64) -> Result<(), RunError> {
    let wrong = |what: String| Err(RunError::Measure(MeasureError::NoInflow { measure, axis, what }));
    let Some(inlet) = Inlet::on(mesh, axis) else { return wrong("the axis meets no boundary".to_owned()) };
    let (tag, Conditions { velocity, polarity, .. }) = (&mesh.tags[inlet.tag], &scene.boundary[&mesh.tags[inlet.tag]]);
    let constant =
        |given: &[Expression; 2]| (!given.iter().any(Expression::depends_on_time)).then(|| given[0].eval(inlet.x, 0.0));
    if velocity.is_impermeable() {
        return wrong(format!("nothing passes `{tag}`, its left end, which is \"{}\"", velocity.name()));
    }
    if let Some(given) = velocity.value().filter(|given| constant(given).is_some_and(|v| v <= 0.0)) {
        return wrong(format!("the velocity of `{tag}`, its left end, is {}", given[0].text()));
    }
    match polarity {
        PolarityCondition::Dirichlet(given) if constant(given) == Some(0.0) => {
            wrong(format!("the polarity of `{tag}`, its left end, is {}", given[0].text()))
        }
        PolarityCondition::Dirichlet(_) | PolarityCondition::Neumann => Ok(()),
    }
}

/// The problem in the model's terms.
pub fn describe(scene: &Scene, mesh: &Mesh) -> Description {
    let crate::scene::Space { velocity, pressure, density, polarity, slip } = scene.space;
    Description {
        degrees: Degrees { velocity, pressure, density, polarity },
        sources: scene.sources.clone(),
        slip,
        ..Description::new(mesh, scene.parameters, |tag| scene.boundary[tag].clone())
    }
}

/// The formula of the exact density.
fn exact_density(scene: &Scene) -> &Expression {
    let exact = scene.sources.exact.as_ref().expect("the scene was checked for exact fields");
    exact.volume().density().expect("the exact fields of a compressible sheet have a density")
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
            let path = if path.is_empty() { quoted(key) } else { format!("{path}.{}", quoted(key)) };
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
