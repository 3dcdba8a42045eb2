//! Particles: report and run.

use std::fmt;
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use crate::body::Hold;
use crate::body::stiffness::Stiffness;
use crate::contact::particles::{self, Drive, Motion, Particle, ParticleState, Particles};
use crate::contact::{Contact, ContactError, Settings, Solver};
use crate::expression::Expression;
use crate::measure::list::Bodies as BodiesNow;
use crate::mesh::Point;
use crate::mesh::generate::MeshScene;
use crate::model::TermStatus;
use crate::run::bodies::{BodiesReport, contact_term};
use crate::run::kinds::{self, Amounts, Kind};
use crate::run::maps::Caption;
use crate::run::memory::MIB;
use crate::run::report::head;
use crate::run::stepper::{Halt, Limits, Plan, Stage, Stepper, Stride, Wanted, shortened};
use crate::run::summary::Unknowns;
use crate::run::view::View;
use crate::run::{RunError, disk};
use crate::scene::bodies::Bodies;
use crate::scene::bodies::place::given_overlap;
use crate::scene::kinds::particles::Dynamics;
use crate::scene::{Output, ParticlesScene, SceneSource, measured};
use crate::scheme::adaptive::{AdaptedStep, AdaptiveStep, EASY, Refusal};
use crate::shape::{Pose, Twist};

/// What will be computed, and with how much.
#[derive(Debug, Clone, Serialize)]
pub struct ParticlesReport {
    /// One line for reports.
    pub title: Option<String>,
    /// The terms of the equations, on and off.
    pub terms: Vec<TermStatus>,
    /// How many there are.
    pub bodies: usize,
    /// Bodies that forces and contact move.
    pub moving: usize,
    /// Smallest and largest distance of a body's points from its centre.
    pub size: [f64; 2],
    /// Of all bodies together.
    pub area: f64,
    /// Of all bodies together.
    pub mass: f64,
    /// How many there are.
    pub walls: usize,
    /// At least, to the end.
    pub steps: f64,
    /// How the bodies are and meet.
    pub body: BodiesReport,
    /// Estimate of what a run writes.
    pub disk_mib: f64,
    /// What a reader should know.
    pub remarks: Vec<String>,
    /// Why a run is refused here and now, by a lack of memory or disk; the rest of the report is right nonetheless.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<String>,
}

/// Says what a scene has; moves nothing.
///
/// # Errors
/// All that a run could say before its first step, besides what its folder holds.
pub fn report(scene: &ParticlesScene) -> Result<ParticlesReport, RunError> {
    Swarm::new(scene)?;
    let bytes = written(scene);
    let bodies = &scene.bodies.bodies;
    let moves = |hold: &Hold| match hold {
        Hold::Free | Hold::Pinned(_) => true,
        Hold::Fixed | Hold::Held { .. } | Hold::Path { .. } => false,
    };
    let sizes = || bodies.iter().map(|body| body.shape.circumradius());
    Ok(ParticlesReport {
        title: scene.title.clone(),
        terms: terms(scene),
        bodies: bodies.len(),
        moving: bodies.iter().filter(|body| moves(&body.hold)).count(),
        size: [sizes().fold(f64::INFINITY, f64::min), sizes().fold(0.0, f64::max)],
        area: bodies.iter().map(|body| body.shape.area()).sum(),
        mass: bodies.iter().map(|body| body.mass()).sum(),
        walls: scene.bodies.walls.len(),
        steps: disk::steps(scene.time.bounds.step, scene.time.end, scene.time.max_steps),
        disk_mib: bytes / MIB,
        body: BodiesReport::new(&scene.bodies),
        remarks: remarks(scene),
        refused: crate::run::report::refusals([disk::check(scene.source(), bytes, Path::new("."))]),
    })
}

/// Bytes that a run writes.
fn written(scene: &ParticlesScene) -> f64 {
    let bodies = scene.bodies.bodies.len();
    let sizes = disk::Sizes {
        cells: 0.0,
        degree: 1,
        bodies,
        checkpoint: 12.0 * bodies as f64,
        columns: measured(&scene.outputs).len(),
        steps: disk::steps(scene.time.bounds.step, scene.time.end, scene.time.max_steps),
        end: scene.time.end,
    };
    disk::bytes(&scene.outputs, &sizes)
}

/// What is worth knowing before the run and no error.
fn remarks(scene: &ParticlesScene) -> Vec<String> {
    let mut remarks = scene.source().notes().to_vec();
    let steps = scene.time.end / scene.time.bounds.step;
    if steps > 1e6 && scene.time.max_steps.is_none() {
        remarks.push(format!("{steps:.1e} steps of {} lead to the end {}", scene.time.bounds.step, scene.time.end));
    }
    remarks.extend(given_overlap(&scene.bodies.bodies, &scene.bodies.walls));
    remarks
}

/// The terms of the motion, on and off.
pub fn terms(scene: &ParticlesScene) -> Vec<TermStatus> {
    let term = |name, formula, on, reason: String| TermStatus { name, formula, on, reason };
    let inertial = scene.dynamics == Dynamics::Inertial;
    let forced = scene
        .bodies
        .bodies
        .iter()
        .filter(|body| !(body.force.iter().all(Expression::is_zero) && body.torque.is_zero()));
    let (forced, [g1, g2]) = (forced.count(), &scene.gravity);
    let dynamics = if inertial { "inertial" } else { "overdamped" };
    vec![
        term("inertia", "m dV/dt, I dω/dt", inertial, format!("dynamics = \"{dynamics}\"")),
        term("gravity", "m g", !(g1.is_zero() && g2.is_zero()), format!("gravity = [{}, {}]", g1.text(), g2.text())),
        term("drag", "−drag m V, −drag I ω", scene.drag > 0.0, format!("drag = {}", scene.drag)),
        term("forces", "F(t, x, θ), torque", forced > 0, format!("{forced} of {} bodies", scene.bodies.bodies.len())),
        contact_term(&scene.bodies),
    ]
}

impl fmt::Display for ParticlesReport {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        head(out, self.title.as_deref(), &self.terms)?;
        writeln!(out, "\nbodies         {} ({} that forces and contact move)", self.bodies, self.moving)?;
        writeln!(out, "size           {} to {} from centre to edge", self.size[0], self.size[1])?;
        writeln!(out, "area, mass     {:.6}, {:.6} in all", self.area, self.mass)?;
        writeln!(out, "walls          {}", self.walls)?;
        writeln!(out, "steps          {:.0}", self.steps)?;
        write!(out, "disk           about {}", disk::shown(self.disk_mib))?;
        self.remarks.iter().try_for_each(|remark| write!(out, "\n\nnote: {remark}"))
    }
}

impl Kind for ParticlesScene {
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
        None
    }

    fn bytes(&self) -> Option<f64> {
        None
    }

    fn report(&self) -> Result<Box<dyn kinds::Report>, RunError> {
        Ok(Box::new(report(self)?))
    }

    fn stage(&self, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
        stage(self, wanted, then)
    }
}

impl kinds::Report for ParticlesReport {
    fn json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }

    fn refused(&self) -> &[String] {
        &self.refused
    }

    fn amounts(&self) -> Amounts {
        Amounts { cells: 0, steps: self.steps, memory_mib: 0.0, disk_mib: self.disk_mib }
    }
}

/// Prepares particles, at their start or where a checkpoint has them.
///
/// # Errors
/// Anything that is wrong before the first step.
fn stage(scene: &ParticlesScene, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
    let begin = Instant::now();
    wanted.purpose.options().map_or(Ok(()), |options| disk::check(scene.source(), written(scene), &options.out))?;
    let mut stepper = Swarm::new(scene)?;
    if let Some(state) = wanted.unpack()? {
        stepper.restore(state, wanted)?;
    }
    let bodies = &scene.bodies;
    let unknowns = 3 * bodies.bodies.len();
    let plan = Plan {
        title: scene.title.as_deref(),
        source: scene.source(),
        text: scene.resolved_toml(),
        limits: Limits::at(scene.time.end, scene.time.max_steps),
        suspect: crate::run::extremes::of_source(scene.source()),
        outputs: &scene.outputs,
        bodies: &bodies.bodies,
        walls: bodies.walls.clone(),
        tells_of_bodies: true,
        terms: terms(scene),
        remarks: remarks(scene),
        said_of_start: None,
        exact: None,
        tissue: None,
        caption: Caption::default(),
        unknowns: Unknowns { stokes_system: unknowns, ..Unknowns::default() },
        setup_seconds: begin.elapsed().as_secs_f64(),
    };
    then(&plan, None, &mut stepper)
}

/// The bodies of a scene, and what acts on them.
struct Swarm<'s> {
    scene: &'s ParticlesScene,
    t: f64,
    particles: Particles,
    step_control: AdaptiveStep,
    stiffness: Stiffness,
    poses: Vec<Pose>,
    twists: Vec<Twist>,
    contacts: Vec<Contact>,
}

/// What a checkpoint holds.
type State = (f64, ParticleState, Vec<Contact>, AdaptiveStep);

impl<'s> Swarm<'s> {
    fn new(scene: &'s ParticlesScene) -> Result<Self, RunError> {
        let origin =
            |error: ContactError| RunError::Contact { origin: scene.source().origin().into(), error: Box::new(error) };
        let Bodies { bodies, walls, contact, .. } = &scene.bodies;
        let particles = bodies.iter().map(|body| Particle {
            name: body.name.clone(),
            shape: body.shape.clone(),
            mass: body.mass(),
            inertia: body.inertia(),
            motion: match &body.hold {
                Hold::Free => Motion::Free,
                Hold::Fixed => Motion::Fixed,
                Hold::Pinned(point) => Motion::Pinned(*point),
                Hold::Held { .. } => Motion::Held,
                Hold::Path { .. } => Motion::Path,
            },
            pose: body.start,
            twist: body.start_twist,
        });
        let dynamics = match scene.dynamics {
            Dynamics::Inertial => particles::Dynamics::Inertial { drag: scene.drag },
            Dynamics::Overdamped => particles::Dynamics::Overdamped { drag: scene.drag },
        };
        let settings = contact.map_or_else(Settings::default, |contact| contact.settings());
        let solver = Solver::new(walls, settings).map_err(origin)?;
        let particles = Particles::new(particles.collect(), dynamics, solver).map_err(origin)?;
        let formula = |error| RunError::Formula { origin: scene.source().origin().into(), error: Box::new(error) };
        let stiffness = Stiffness::new(bodies).map_err(formula)?;
        let mut stepper = Self {
            scene,
            t: 0.0,
            particles,
            step_control: AdaptiveStep::default(),
            stiffness,
            poses: Vec::new(),
            twists: Vec::new(),
            contacts: Vec::new(),
        };
        stepper.take_state();
        Ok(stepper)
    }

    fn take_state(&mut self) {
        self.poses = self.particles.bodies().iter().map(|body| body.pose).collect();
        self.twists = self.particles.bodies().iter().map(|body| body.twist).collect();
    }

    fn restore(&mut self, (t, state, contacts, control): State, wanted: &Wanted) -> Result<(), RunError> {
        if state.poses.len() != self.poses.len() {
            return Err(wanted.unfit("body"));
        }
        self.particles.restore(state);
        (self.t, self.contacts, self.step_control) = (t, contacts, control);
        self.take_state();
        Ok(())
    }
}

/// What acts on the bodies in the step from `t` to `end`.
struct Acting<'s> {
    scene: &'s ParticlesScene,
    t: f64,
    end: f64,
}

impl Acting<'_> {
    /// An error with the key of the formula that it comes from.
    fn named(&self, error: &ContactError) -> String {
        let ContactError::NotFinite { body, what, .. } = error else { return error.to_string() };
        if *what == "state" {
            return error.to_string();
        }
        let key = match self.scene.bodies.bodies.iter().find(|other| other.name == *body) {
            _ if self.scene.gravity.iter().any(|g| !g.eval(Point::zeros(), self.t).is_finite()) => {
                "model.gravity".into()
            }
            Some(body) => format!("{}.{what}", body.key),
            None => return error.to_string(),
        };
        format!("`{key}`: {error}")
    }
}

impl Drive for Acting<'_> {
    fn load(&self, body: usize, t: f64, pose: &Pose, twist: &Twist) -> [f64; 3] {
        self.load_within(body, (t, self.end - self.t), 0.0, pose, twist)
    }

    fn load_within(&self, body: usize, _: (f64, f64), share: f64, pose: &Pose, _twist: &Twist) -> [f64; 3] {
        let body = &self.scene.bodies.bodies[body];
        let t = self.t + share * (self.end - self.t);
        let value = |formula: &Expression| formula.eval_at(pose.position, pose.angle, t);
        let fall = |formula: &Expression| body.mass() * formula.eval(Point::zeros(), t);
        let ([g1, g2], [f1, f2]) = (&self.scene.gravity, &body.force);
        [fall(g1) + value(f1), fall(g2) + value(f2), value(&body.torque)]
    }

    fn twist(&self, body: usize, _t: f64, pose: &Pose) -> Twist {
        match &self.scene.bodies.bodies[body].hold {
            Hold::Held { velocity: [v1, v2], spin } => {
                let value = |formula: &Expression| formula.eval_at(pose.position, pose.angle, self.t);
                Twist { velocity: Point::new(value(v1), value(v2)), spin: value(spin) }
            }
            Hold::Free | Hold::Fixed | Hold::Pinned(_) | Hold::Path { .. } => Twist::ZERO,
        }
    }

    fn pose(&self, body: usize, _t: f64, now: &Pose) -> Pose {
        match &self.scene.bodies.bodies[body].hold {
            Hold::Path { position: [x1, x2], angle } => {
                let value = |formula: &Expression| formula.eval(Point::zeros(), self.end);
                Pose { position: Point::new(value(x1), value(x2)), angle: value(angle) }
            }
            Hold::Free | Hold::Fixed | Hold::Pinned(_) | Hold::Held { .. } => *now,
        }
    }
}

impl Stepper for Swarm<'_> {
    fn advance(&mut self, t: f64, landing: f64) -> Result<Stride, Halt> {
        let Self { scene, particles, step_control: control, stiffness, .. } = self;
        let made = control.advance((t, landing), &scene.time.bounds, |t, dt| {
            let acting = Acting { scene, t, end: t + dt };
            let failure = |error: ContactError| match error.is_cured_by_a_smaller_step() {
                true => Refusal::Contact(error.to_string()),
                false => Refusal::Failure(acting.named(&error)),
            };
            let easy = particles.strain(stiffness, (t, dt), scene.time.tolerance, &acting).map_err(failure)?;
            let easy = match easy {
                Some(strain) if strain.load > 1.0 => return Err(Refusal::Force(strain.to_string())),
                Some(strain) => strain.load <= EASY,
                None => true,
            };
            Ok((particles.step_along(stiffness, dt, &acting).map_err(failure)?, easy))
        })?;
        let AdaptedStep { t, dt, rejected, why, done: report } = made;
        (self.t, self.contacts) = (t, report.contacts);
        self.take_state();
        let notes = why.iter().map(|why| shortened(t, dt, why)).collect();
        Ok(Stride { t, dt, iterations: report.effort.iterations, rejected, coupled: None, notes, left: Vec::new() })
    }

    fn state(&self) -> Vec<u8> {
        let state = (self.t, self.particles.state(), &self.contacts, &self.step_control);
        postcard::to_stdvec(&state).expect("numbers are always written")
    }

    fn look(&mut self, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError> {
        let (bodies, poses, twists, contacts) =
            (&self.scene.bodies.bodies[..], &self.poses, &self.twists, &self.contacts);
        let bodies = BodiesNow { bodies, poses, twists, contacts, flow: &[] };
        then(&View { t: self.t, fields: None, bodies: Some(bodies), tissue: None, flow: None })
    }
}
