//! From a TOML file to a checked description of one computation; the only place that knows the file format.
//!
//! [`SceneSource`] is the text with its overrides, [`Scene`] what the solver reads. Every default is filled in.

pub mod bodies;
mod check;
mod edit;
mod error;
pub mod kinds;
mod locate;
pub mod maps;
pub mod output;
pub mod path;
pub mod presets;
pub mod renamed;
mod resolve;
pub mod schema;
mod source;
pub mod start;
pub(crate) mod tables;
mod translate;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::expression::Expression;
use crate::measure::fields::Tool;
use crate::measure::list::Premise;
use crate::mesh::Mesh;
use crate::mesh::generate::MeshScene;
use crate::model::{Conditions, ModelKind, Parameters, TermStatus};

pub use crate::model::Sources;
pub use crate::model::momentum::SlipTreatment;
pub use crate::scheme::{ControlSettings, Schedule};
pub use crate::steady::{SteadySettings, Want};
pub use crate::time::{CouplingSettings, MarchSettings};
pub use bodies::Bodies;
pub use check::MapRule;
pub use error::{Place, SceneError};
pub use kinds::SceneKind;
pub use kinds::particles::ParticlesScene;
pub use kinds::stokes::StokesScene;
pub use maps::{ArrowsOf, MapOptions, MapRequest, Quantity};
pub use output::{Axis, AxisLine, Cut, Output, What, measured};
pub use source::SceneSource;

/// One computation, checked as far as possible without its mesh.
#[derive(Debug, Clone)]
pub struct Scene {
    /// One line for reports.
    pub title: Option<String>,
    /// The numbers of the model.
    pub parameters: Parameters,
    /// `mesh.file` is absolute.
    pub mesh: MeshScene,
    /// Polynomial degrees.
    pub space: Space,
    /// By boundary tag; [`Scene::check_tags`] compares with the mesh.
    pub boundary: BTreeMap<String, Conditions>,
    /// The polarity at t = 0.
    pub initial: Initial,
    /// Of the compressible sheet.
    pub initial_density: Option<InitialDensity>,
    /// What enters the equations from outside.
    pub sources: Sources,
    /// How time is discretised, and where it ends.
    pub time: Time,
    /// How a steady state is searched for, where the scene asks for one.
    pub steady: Option<SteadySettings>,
    /// How a step is solved.
    pub coupling: CouplingSettings,
    /// Of the elastic strain, where the scene has one.
    pub strain: Option<StrainSettings>,
    /// Rigid bodies that the tissue carries.
    pub bodies: Option<Bodies>,
    /// What is written, and when.
    pub outputs: Vec<Output>,
    /// Keys and values that `accuracy` has filled in.
    pub preset: presets::Filled,
    resolved: tables::SceneFile,
    source: SceneSource,
}

/// The elastic strain that the flow carries [12.3].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StrainSettings {
    /// `We`
    pub weissenberg: f64,
    /// Polynomial degree.
    pub degree: usize,
}

/// Polynomial degrees, and how slip is imposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Space {
    /// Of v, continuous.
    pub velocity: usize,
    /// Of Π, continuous; 0 in the compressible sheet, which has none.
    pub pressure: usize,
    /// Of ρ, discontinuous; 0 in the incompressible sheet, which has none.
    pub density: usize,
    /// Of p, discontinuous.
    pub polarity: usize,
    /// How `v·n = 0` is imposed.
    pub slip: SlipTreatment,
}

/// Initial polarity.
#[derive(Debug, Clone, PartialEq)]
pub enum Initial {
    /// [10.4–10.5]
    AlignedAroundDisc,
    /// The unit vector along the track, counterclockwise.
    Circulating,
    /// That of the exact fields.
    Exact,
    /// `p(x, 0)`
    Expressions([Expression; 2]),
    /// [10.4.4]: at the nodes of a mesh of edge length `h_coarse` a uniform direction times a normal deviate of
    /// standard deviation `amplitude`, interpolated.
    Random {
        /// The same seed gives the same start.
        seed: u64,
        /// Standard deviation of the length of vectors.
        amplitude: f64,
        /// Distance of the points that have a vector of their own.
        h_coarse: f64,
    },
    /// Absolute path of fields that were written before.
    File(PathBuf),
}

/// Initial density.
#[derive(Debug, Clone, PartialEq)]
pub enum InitialDensity {
    /// `ρ(x, 0)`
    Formula(Expression),
    /// That of the exact fields.
    Exact,
    /// Absolute path of a compressible run's checkpoint.
    File(PathBuf),
}

/// Time scheme, step control (Algorithm 1 [9.1.2]) and endings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// Order of the BDF, 1 to 6.
    pub order: usize,
    /// Whether the density is always marched by the implicit BDF, never by A-BDF(θ*).
    pub density_implicit: bool,
    /// Steps and how they change.
    pub control: ControlSettings,
    /// The run ends at this time.
    pub end: f64,
    /// Whether the first b − 1 steps take the exact polarity.
    pub exact_start: bool,
    /// Ratio in which successive steps alternate.
    pub alternate: f64,
    /// `n_max`
    pub max_steps: Option<usize>,
    /// `δ_stop` on the total stationary residual.
    pub stop_residual: Option<f64>,
    /// Bound on `|dF/dt|` that ends the run.
    pub stop_energy_rate: Option<f64>,
    /// From then on the data of the scene are constant, and the run may stop; 0 where it does not stop.
    pub rests_from: f64,
}

impl Time {
    /// Order of the density's scheme: A-BDF(θ*) has positive coefficients up to order 3.
    pub fn density_order(&self) -> usize {
        self.order.min(3)
    }
}

impl Scene {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// Whatever is wrong with it, see [`SceneError`].
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::read(path)?)
    }

    /// Checks a text; `origin` is its file, for messages and relative paths.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, origin: &Path) -> Result<Self, SceneError> {
        Self::check(SceneSource::parse(text, origin)?)
    }

    /// Checks a scene with its overrides: every rule that does not need the mesh.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn check(source: SceneSource) -> Result<Self, SceneError> {
        check::check(source)
    }

    /// Changes one value and checks again; unchanged on error. See [`SceneSource::set`].
    ///
    /// # Errors
    /// As [`SceneSource::set`] and [`read`](Self::read).
    pub fn set(&mut self, path: &str, value: &str) -> Result<(), SceneError> {
        let mut source = self.source.clone();
        source.set(path, value)?;
        *self = Self::check(source)?;
        Ok(())
    }

    /// The settings of the elastic strain where some output needs it: a field, a measure, or a cut.
    pub fn strain_needed(&self) -> Option<StrainSettings> {
        let measured = |what: &What| what.measures().iter().any(|asked| asked.measure.needs(Premise::Strain));
        let needs = |output: &Output| measured(&output.what) || output.what.takes(Tool::Strain);
        self.strain.filter(|_| self.outputs.iter().any(needs))
    }

    /// The text that the scene was checked from, for further overrides.
    pub fn source(&self) -> &SceneSource {
        &self.source
    }

    /// The scene as TOML with every default and override filled in; it parses back to the same scene.
    pub fn resolved_toml(&self) -> String {
        resolve::to_toml(&self.resolved)
    }

    /// Compares the boundary conditions with the tags of the mesh: each tag has one, each one has a tag.
    ///
    /// # Errors
    /// The first condition without a tag, else the first tag without a condition.
    pub fn check_tags(&self, tags: &[String]) -> Result<(), SceneError> {
        kinds::stokes::check_tags(&self.source, self.boundary.keys(), tags)
    }

    /// Compares walls and bodies, if there are any, with the mesh.
    ///
    /// # Errors
    /// As [`Bodies::check_mesh`].
    pub fn check_bodies(&self, mesh: &Mesh) -> Result<(), SceneError> {
        self.bodies.as_ref().map_or(Ok(()), |bodies| bodies.check_mesh(&self.source, mesh))
    }

    /// The preset that the scene names.
    pub fn accuracy(&self) -> Option<presets::Accuracy> {
        self.resolved.accuracy
    }

    /// How the scene is marched in time.
    pub fn march(&self) -> MarchSettings {
        let Time { order, control, alternate, density_implicit, .. } = self.time;
        MarchSettings { order, control, alternate, coupling: self.coupling, density_implicit }
    }

    /// Whether Π is determined only up to a constant and takes zero mean: the sheet is incompressible, and no tag
    /// prescribes a normal stress.
    pub fn pressure_is_free(&self) -> bool {
        match self.parameters.kind() {
            ModelKind::Incompressible => !self.boundary.values().any(|c| c.velocity.fixes_pressure()),
            ModelKind::Compressible => false,
        }
    }

    /// The scene on another mesh, for counting: tags that it does not know take the conditions of those that it does,
    /// in turn.
    pub fn on(&self, mesh: &MeshScene, tags: &[String]) -> Scene {
        Scene { mesh: mesh.clone(), boundary: kinds::stokes::conditions_on(&self.boundary, tags), ..self.clone() }
    }

    /// The model's terms and the sources, on and off.
    pub fn terms(&self) -> Vec<TermStatus> {
        let mut terms = self.parameters.terms();
        if self.pressure_is_free() {
            tell_of_zero_mean(&mut terms);
        }
        terms.extend(self.sources.terms(&self.parameters));
        if self.strain.is_some() {
            let on = self.strain_needed().is_some();
            let reason = if on { "an output needs it" } else { "no output needs it" };
            terms.push(TermStatus {
                name: "elastic strain",
                formula: "ε▽ + ε/We = 2D(v)",
                on,
                reason: reason.to_owned(),
            });
        }
        terms
    }

    /// What is worth knowing before the run and no error.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = self.source.notes().to_vec();
        let steps = self.time.end / self.time.control.step;
        if steps > 1e6 && self.time.max_steps.is_none() {
            remarks.push(format!("{steps:.1e} steps of {} lead to the end {}", self.time.control.step, self.time.end));
        }
        let from = self.time.rests_from;
        if from > 0.0 {
            let never = if from > self.time.end { ", after `time.end`: it cannot end the run" } else { "" };
            remarks.push(format!("the data change until t = {from}; `time.stop` looks from then on{never}"));
        }
        remarks
    }
}

/// Says of the pressure that only its gradient counts.
fn tell_of_zero_mean(terms: &mut [TermStatus]) {
    let reason = "always on; its mean is 0, as no tag prescribes a normal stress";
    terms.iter_mut().filter(|term| term.name == "pressure").for_each(|term| term.reason = reason.to_owned());
}
