//! A tissue whose bodies, if it has some, are fixed: its march as a stepper, and its plan.

use super::tissue::has_moving_bodies;
use crate::measure::fields::TissueFields;
use crate::measure::list::{Bodies, OfMarch};
use crate::run::maps::Caption;
use crate::run::stepper::{Halt, Limits, MARCH_COLUMNS, Plan, Stage, Stepper, Stride, Wanted};
use crate::run::summary::Unknowns;
use crate::run::view::{TissueNow, View};
use crate::run::{RunError, Setup, extremes};
use crate::scene::Scene;
use crate::shape::Twist;
use crate::time::march::Counts;
use crate::time::{March, MarchError, Sheet, SheetKind, StepFailure};

/// The march of a tissue.
pub(super) struct SheetStepper<'m> {
    march: March<'m>,
}

impl Stepper for SheetStepper<'_> {
    fn advance(&mut self, _: f64, landing: f64) -> Result<Stride, Halt> {
        self.march.advance(landing).map(Stride::from).map_err(Halt::from)
    }

    fn state(&self) -> Vec<u8> {
        postcard::to_stdvec(&self.march.checkpoint()).expect("numbers are always written")
    }

    fn counts(&mut self) -> Option<Counts> {
        Some(self.march.counts)
    }

    fn look(&mut self, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError> {
        show(&self.march, then)
    }

    fn step_columns(&self) -> &'static [&'static str] {
        MARCH_COLUMNS
    }

    fn with_march(&mut self, then: &mut dyn FnMut(&mut March)) {
        then(&mut self.march);
    }
}

impl From<MarchError> for Halt {
    fn from(error: MarchError) -> Self {
        let of_formula =
            matches!(&error, MarchError::Failed { cause, .. } if matches!(**cause, StepFailure::Formula(_)));
        match error {
            MarchError::Interrupted { .. } => Halt::Interrupted,
            other => Halt::Failed { reason: other.to_string(), blame: !of_formula },
        }
    }
}

/// Shows a march whose bodies, if it has some, are fixed.
///
/// # Errors
/// Those of `then`.
pub(in crate::run) fn show(march: &March, then: &mut dyn FnMut(&View) -> Result<(), RunError>) -> Result<(), RunError> {
    let (model, state, t) = (march.model, &march.state, march.t);
    let fields = TissueFields { model, state, t };
    let counted = OfMarch { limited: march.limited(), mass_counted: march.mass_counted() };
    let tissue = TissueNow { model, state, rate_of_p: march.rate_of_p(), march: counted };
    show_bodies_at_rest(model, &mut |bodies| {
        then(&View { t, fields: Some(&fields), bodies, tissue: Some(tissue), flow: None })
    })
}

/// Shows the bodies of a tissue, if it has some: they are fixed.
///
/// # Errors
/// Those of `then`.
pub(in crate::run) fn show_bodies_at_rest(
    model: &dyn Sheet,
    then: &mut dyn FnMut(Option<Bodies>) -> Result<(), RunError>,
) -> Result<(), RunError> {
    let SheetKind::Incompressible(model) = model.kind() else { return then(None) };
    let Some(floating) = &model.bodies else { return then(None) };
    let twists = vec![Twist::ZERO; floating.bodies().len()];
    let (bodies, poses) = (floating.bodies(), model.poses());
    then(Some(Bodies { bodies, poses, twists: &twists, contacts: &[], flow: &[] }))
}

impl Setup {
    /// What the loop needs of the scene of a tissue.
    pub fn plan<'a>(&self, scene: &'a Scene) -> Plan<'a> {
        let (model, time, bodies) = (&self.model, &scene.time, scene.bodies.as_ref());
        Plan {
            title: scene.title.as_deref(),
            source: scene.source(),
            text: scene.resolved_toml(),
            limits: Limits {
                end: time.end,
                max_steps: time.max_steps,
                rests_from: time.rests_from,
                stop_residual: time.stop_residual,
                stop_energy_rate: time.stop_energy_rate,
            },
            suspect: extremes::of_scene(scene),
            outputs: &scene.outputs,
            bodies: bodies.map_or(&[], |bodies| &bodies.bodies),
            walls: bodies.map_or_else(Vec::new, |bodies| bodies.walls_on(&self.ground.mesh)),
            tells_of_bodies: has_moving_bodies(scene),
            terms: scene.terms(),
            remarks: self.remarks(scene),
            said_of_start: self.said_of_start.get().cloned(),
            exact: scene.sources.exact.clone(),
            tissue: Some(scene),
            caption: Caption::of(scene),
            unknowns: Unknowns {
                fields: model.fields().into_iter().map(|(id, space)| (id.name, space.dof_count())).collect(),
                stokes_system: model.flow_unknowns(),
                ..Unknowns::default()
            },
            setup_seconds: self.seconds,
        }
    }
}

/// Prepares a tissue whose bodies are fixed, at its start or where its checkpoint has it.
///
/// # Errors
/// Anything that is wrong before the first step.
pub(super) fn stage(scene: &Scene, wanted: &Wanted, then: &mut Stage) -> Result<(), RunError> {
    let setup = wanted.setup(scene)?;
    let mut march = match wanted.saved {
        Some(saved) => {
            wanted.check_mesh(&setup.ground.mesh)?;
            let march = saved.march().ok().filter(|march| setup.fits(march));
            March::resume(&*setup.model, scene.march(), march.ok_or_else(|| wanted.unfit("space"))?)
        }
        None => setup.start(scene)?,
    };
    if let Some(interrupt) = wanted.purpose.interrupt() {
        march.interrupt = interrupt;
    }
    then(&setup.plan(scene), Some(&setup.ground), &mut SheetStepper { march })
}
