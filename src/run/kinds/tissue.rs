//! A tissue in which bodies move: what of a scene it cannot have, and its run.
//!
//! Bodies that are all fixed need none of this: their scene runs like any other, search for a steady state included.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{Amounts, Compared, Kind, sheet};
use crate::body::guide::Guide;
use crate::body::{Body, Hold};
use crate::contact::Wall;
use crate::contact::in_flow::FlowContact;
use crate::measure::fields::TissueFields;
use crate::measure::list::{Bodies as BodiesNow, OfMarch};
use crate::mesh::generate::MeshScene;
use crate::mesh::{Mesh, Point};
use crate::model::ModelKind;
use crate::model::fields::{DENSITY, DIFFUSION, LAPLACIAN, POLARITY, PRESSURE, VELOCITY};
use crate::model::incompressible::{Description, Incompressible};
use crate::model::momentum::MomentumError;
use crate::run::kinds;
use crate::run::resolution::Resolution;
use crate::run::stepper::{Halt, MARCH_COLUMNS, Stage, Stepper, Stride, Wanted};
use crate::run::view::{TissueNow, View};
use crate::run::{RunError, Setup, extremes, report, setup};
use crate::scene::bodies::Bodies;
use crate::scene::maps::MapOptions;
use crate::scene::{MapRule, Output, Scene, SceneError, SceneSource, Space, What};
use crate::time::march::Counts;
use crate::time::moving::{MovingCheckpoint, MovingError, MovingMarch};
use crate::time::{self, March, OwnedSheet};

/// Whether a scene has bodies that move.
pub fn has_moving_bodies(scene: &Scene) -> bool {
    let rests = |body: &Body| matches!(body.hold, Hold::Fixed);
    scene.bodies.as_ref().is_some_and(|bodies| !bodies.bodies.iter().all(rests))
}

/// Centre and downstream end of the one disc in a scene, where it is a body.
pub fn wake(scene: &Scene) -> Option<(Point, f64)> {
    let [Body { shape, start, .. }] = &scene.bodies.as_ref()?.bodies[..] else { return None };
    shape.round_radius().map(|radius| (start.position, start.position.x + radius))
}

/// The tissue around the bodies of a scene, where they start.
///
/// # Errors
/// As [`Incompressible::around`]; paths without a derivative.
pub fn around(mesh: &Arc<Mesh>, description: &Description, bodies: &Bodies) -> Result<Incompressible, MomentumError> {
    let guide = Arc::new(Guide::new(bodies.bodies.clone())?);
    let poses = guide.starts(0.0)?;
    Incompressible::around(mesh, description, &guide, &poses, bodies.rigid.method)
}

/// Refuses what would read the inside of bodies as tissue, or what does not exist with bodies that move.
///
/// # Errors
/// The first key.
pub fn check(scene: &Scene) -> Result<(), RunError> {
    if scene.bodies.is_none() {
        return Ok(());
    }
    let refuse = |key: String, value: &str, rule: &str, hint: &str| {
        let [value, rule, hint] = [value, rule, hint].map(str::to_owned);
        Err(RunError::from(SceneError::Value { place: scene.source().place(&key), key, value, rule, hint }))
    };
    let moving = has_moving_bodies(scene);
    let energy = scene.parameters.elastic_force == crate::model::ElasticForce::Energy;
    if moving && energy && scene.parameters.elasticity != 0.0 {
        let rule = "this form of the elastic force has no traction on bodies that move";
        let hint = "take elastic_force = \"stress\", or fix the bodies";
        return refuse("model.elastic_force".into(), "\"energy-consistent\"", rule, hint);
    }
    for (at, output) in scene.outputs.iter().enumerate() {
        match &output.what {
            What::Bodies { contacts: true } if !moving => {
                let rule = "bodies that are all fixed have no contacts";
                return refuse(format!("output.{at}.contacts"), "true", rule, "remove it");
            }
            What::Measures(measures) => {
                if let Some(idle) = measures.iter().find(|asked| !moving && asked.measure.needs_motion()) {
                    let (key, name) = (format!("output.{at}.measures"), idle.to_string());
                    let rule = "bodies that are all fixed neither move nor touch anything anew";
                    return refuse(key, &name, rule, "take `holding`, the force that holds the first body, or `body`");
                }
                if let Some(reading) = measures.iter().find(|asked| asked.measure.reads_bodies()) {
                    let (key, name) = (format!("output.{at}.measures"), reading.to_string());
                    let rule = "this measure would take the inside of bodies for tissue";
                    return refuse(key, &name, rule, "leave it out, or take a mesh with a hole");
                }
            }
            What::Maps(_) | What::Cuts { .. } | What::Fields(_) | What::Bodies { .. } | What::Checkpoint => {}
        }
    }
    if !moving {
        return Ok(());
    }
    let rest = "bodies that move";
    if scene.steady.is_some() {
        let rule = format!("a tissue with {rest} has no steady state to look for");
        return refuse("steady".into(), "(given)", &rule, "fix the bodies, or march");
    }
    if scene.time.stop_residual.is_some() || scene.time.stop_energy_rate.is_some() {
        let rule = format!("a tissue with {rest} is not tested for rest");
        return refuse("time.stop".into(), "(given)", &rule, "remove it; `time.end` ends the run");
    }
    Ok(())
}

impl Kind for Scene {
    fn title(&self) -> Option<&str> {
        self.title.as_deref()
    }

    fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    fn source(&self) -> &SceneSource {
        self.source()
    }

    fn resolved_toml(&self) -> String {
        self.resolved_toml()
    }

    fn mesh(&self) -> Option<&MeshScene> {
        Some(&self.mesh)
    }

    fn bytes(&self) -> Option<f64> {
        setup::forecast(self).ok().map(|count| count.bytes)
    }

    fn report(&self) -> Result<Box<dyn kinds::Report>, RunError> {
        Ok(Box::new(report::report(self)?))
    }

    fn stage(&self, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
        stage(self, wanted, then)
    }

    fn suspect(&self) -> Option<String> {
        extremes::of_scene(self)
    }

    fn tissue(&self) -> Option<&Scene> {
        Some(self)
    }

    /// With velocities of degree q, pressures r, polarities s: `v` min(q+1, r+2, s+1), `Π` min(q, r+1, s), `p`
    /// min(s+1, q+1), `Δ_h p` s−1; in a compressible sheet with densities d `v` min(q, d)+1, `ρ` min(d+1, q), `p`
    /// min(s, q, d)+1, `div_h(ρ∇p)` min(s−1, d).
    fn compared(&self) -> Option<Compared<'_>> {
        let exact = self.sources.exact.as_deref()?;
        let Space { velocity: q, pressure: r, density: d, polarity: s, .. } = self.space;
        let orders = match self.parameters.kind() {
            ModelKind::Incompressible => vec![
                (VELOCITY, (q + 1).min(r + 2).min(s + 1)),
                (PRESSURE, q.min(r + 1).min(s)),
                (POLARITY, s.min(q) + 1),
                (LAPLACIAN, s - 1),
            ],
            ModelKind::Compressible => vec![
                (VELOCITY, q.min(d) + 1),
                (DENSITY, q.min(d + 1)),
                (POLARITY, s.min(q).min(d) + 1),
                (DIFFUSION, (s - 1).min(d)),
            ],
        };
        let (step, end) = (self.time.control.step, self.time.end);
        let longest = (0..2).map(|k| self.march().length(step, k)).fold(0.0, f64::max);
        let started = if self.time.exact_start { usize::MAX } else { 2 };
        let order_in_time = Some(self.time.order.min(started));
        Some(Compared { exact, step, longest, end, orders, order_in_time, tolerance: self.coupling.tolerance })
    }

    fn check_map(&self, options: &MapOptions) -> Result<(), MapRule> {
        options.check(&self.parameters)?;
        options.check_strain(self.strain)
    }
}

impl kinds::Report for report::Report {
    fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }

    fn refused(&self) -> &[String] {
        &self.refused
    }

    fn amounts(&self) -> Amounts {
        Amounts {
            cells: self.mesh.cells(),
            steps: self.steps.unwrap_or(0.0),
            memory_mib: self.memory_mib,
            disk_mib: self.disk_mib,
        }
    }
}

/// Prepares a tissue, with bodies that move or without, at its start or where its checkpoint has it.
///
/// # Errors
/// Anything that is wrong before the first step.
pub(in crate::run) fn stage(scene: &Scene, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
    if !has_moving_bodies(scene) {
        return sheet::stage(scene, wanted, then);
    }
    let setup = wanted.setup(scene)?;
    let p = setup.initial(scene)?.values;
    let plan = setup.plan(scene);
    let Setup { ground, model, .. } = setup;
    let OwnedSheet::Incompressible(model) = model.owned() else {
        unreachable!("bodies in a compressible sheet are refused with the scene")
    };
    let bodies = scene.bodies.as_ref().expect("the scene has bodies");
    let mut stepper = MovingTissue::new((scene, bodies, &plan.walls), *model, p, wanted)?;
    then(&plan, Some(&ground), &mut stepper)
}

/// Bodies that move in a tissue.
struct MovingTissue {
    march: MovingMarch,
    resolution: Resolution,
}

impl MovingTissue {
    /// The bodies at the start of a run, or as its checkpoint has them.
    fn new(
        (scene, bodies, walls): (&Scene, &Bodies, &[Wall]),
        model: Incompressible,
        p: Vec<f64>,
        wanted: &Wanted,
    ) -> Result<Self, RunError> {
        let origin = scene.source().origin();
        let failed = |error: MomentumError| RunError::Model { origin: origin.into(), error: Box::new(error) };
        let contact = match &bodies.contact {
            None => None,
            Some(asked) => {
                let settings = crate::contact::Settings { overlap: 1e-3, ..asked.settings() };
                let fluid = (&bodies.bodies[..], scene.parameters.friction);
                let made = FlowContact::new(fluid, walls, settings, asked.flow);
                Some(made.map_err(|error| RunError::Contact { origin: origin.into(), error: Box::new(error) })?)
            }
        };
        wanted.check_mesh(&model.loops.mesh)?;
        let mut march = match wanted.unpack::<MovingCheckpoint>()? {
            None => MovingMarch::start(model, scene.march(), p, (bodies.rigid.order, contact))
                .map_err(|error| RunError::begin(origin, error))?,
            Some(state) => MovingMarch::resume(model, scene.march(), state, contact).map_err(failed)?,
        };
        let exits = bodies.exits(&march.model().loops.mesh);
        march.let_leave(exits.clone());
        let mesh = &march.model().loops.mesh;
        let mut resolution = Resolution::new(mesh, exits);
        // the run has told of those that are small at its start
        resolution.of_bodies(mesh, march.bodies(), march.poses());
        resolution.of_boundary(mesh, march.bodies(), march.poses());
        if wanted.saved.is_some() {
            // and of the gaps that are narrow now
            resolution.of_gaps(mesh, march.bodies(), march.contacts());
        }
        Ok(Self { resolution, march })
    }
}

/// No step is given up half-way: the loop ends after it.
static NEVER: AtomicBool = AtomicBool::new(false);

impl Stepper for MovingTissue {
    fn advance(&mut self, _: f64, landing: f64) -> Result<Stride, Halt> {
        let report = self.march.advance(landing, &NEVER);
        let report = report.map_err(|error: MovingError| Halt::from(error.to_string()))?;
        let (mesh, bodies) = (&self.march.model().loops.mesh, self.march.bodies());
        let mut notes: Vec<String> = Vec::new();
        notes.extend(self.resolution.of_bodies(mesh, bodies, self.march.poses()));
        notes.extend(self.resolution.of_boundary(mesh, bodies, self.march.poses()));
        notes.extend(self.resolution.of_gaps(mesh, bodies, self.march.contacts()));
        Ok(Stride { notes, left: self.march.left().to_vec(), ..Stride::from(report) })
    }

    fn state(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.march.checkpoint()).expect("numbers are always written")
    }

    fn counts(&mut self) -> Option<Counts> {
        Some(self.march.with(|march| march.counts))
    }

    fn look(&mut self, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError> {
        let Self { march: moving, .. } = self;
        let (poses, twists) = (moving.poses().to_vec(), moving.twists().to_vec());
        let contacts = moving.contacts().to_vec();
        moving.with(|march| {
            let (state, t) = (&march.state, march.t);
            let time::SheetKind::Incompressible(model) = march.model.kind() else {
                unreachable!("bodies move in an incompressible sheet")
            };
            let floating = model.bodies.as_ref().expect("a tissue with bodies");
            let (bodies, contacts) = (floating.bodies(), &contacts[..]);
            let (poses, twists) = (&poses[..], &twists[..]);
            let bodies = BodiesNow { bodies, poses, twists, contacts, flow: &[] };
            let bodies = (!bodies.bodies.is_empty()).then_some(bodies);
            let counted = OfMarch { limited: march.limited(), mass_counted: march.mass_counted() };
            let tissue = TissueNow { model: march.model, state, rate_of_p: march.rate_of_p(), march: counted };
            let fields = TissueFields { model: march.model, state, t };
            then(&View { t, fields: Some(&fields), bodies, tissue: Some(tissue), flow: None })
        })
    }

    fn step_columns(&self) -> &'static [&'static str] {
        MARCH_COLUMNS
    }

    fn with_march(&mut self, then: &mut dyn FnMut(&mut March)) {
        self.march.with(|march| then(march));
    }
}
