//! What a run shows of itself between two steps: fields by their names, rigid bodies, and what only a tissue has.

use super::RunError;
use crate::form::Integrator;
use crate::measure::list::{Bodies, OfMarch};
use crate::model::fields::{DENSITY, POLARITY, VELOCITY};
use crate::model::immersed::FlowWithBodies;
use crate::model::immersed::flow::Flow;
use crate::model::{ModelKind, State};
use crate::scene::Field as Name;
use crate::space::Field;
use crate::time::{Sheet, SheetKind};

/// The fields of a state, by their names. Fields that follow from the velocity alone, such as the stream function, are
/// made of it by whoever writes them.
pub trait Fields: Sync {
    /// Of the whole mesh.
    fn loops(&self) -> &Integrator;

    /// Over what flows: all of the mesh that no body covers.
    fn flowing(&self) -> Integrator;

    /// The field of this name; `None` where there is none.
    ///
    /// # Errors
    /// One that has to be solved for and cannot be.
    fn field(&self, name: Name) -> Result<Option<Field>, RunError>;

    /// The largest degree of a field's space.
    fn degree(&self) -> usize;

    /// Whether a density weighs pressure and diffusion, as their symbols tell.
    fn kind(&self) -> ModelKind {
        ModelKind::Incompressible
    }
}

/// A tissue in a state, at a time.
#[derive(Debug, Clone, Copy)]
pub struct TissueFields<'a> {
    /// What is solved.
    pub model: &'a dyn Sheet,
    /// Its fields.
    pub state: &'a State,
    /// Time of the state.
    pub t: f64,
}

impl Fields for TissueFields<'_> {
    fn loops(&self) -> &Integrator {
        self.model.loops()
    }

    fn flowing(&self) -> Integrator {
        match self.model.kind() {
            SheetKind::Incompressible(model) => model.tissue().clone(),
            SheetKind::Compressible(model) => model.loops.clone(),
        }
    }

    fn field(&self, name: Name) -> Result<Option<Field>, RunError> {
        let Self { model, state, t } = *self;
        Ok(Some(match name {
            Name::Velocity => state[VELOCITY].clone(),
            Name::Pressure => model.pressure(state)?,
            Name::Density => match state.get(DENSITY) {
                Some(density) => density.clone(),
                None => return Ok(None),
            },
            Name::Polarity => state[POLARITY].clone(),
            Name::MolecularField => model.molecular_field(state, t),
            Name::PolarityLaplacian => model.polarity_laplacian(state, t),
            Name::TissueVelocity => {
                let frame_speed = model.parameters().traction / model.parameters().friction;
                let mut v = state[VELOCITY].clone();
                v.values.iter_mut().step_by(2).for_each(|v1| *v1 -= frame_speed);
                v
            }
            Name::StreamFunction | Name::ElasticStrain => return Ok(None),
        }))
    }

    fn degree(&self) -> usize {
        let fields = self.model.fields();
        fields.into_iter().map(|(_, space)| space.degree).max().unwrap_or(1)
    }

    fn kind(&self) -> ModelKind {
        self.model.parameters().kind()
    }
}

/// A Stokes flow that carries bodies, or none.
#[derive(Debug, Clone, Copy)]
pub struct FlowFields<'a> {
    /// What is solved.
    pub flow: &'a Flow,
    /// Its fields and the motion of its bodies.
    pub carried: &'a FlowWithBodies,
}

impl Fields for FlowFields<'_> {
    fn loops(&self) -> &Integrator {
        &self.flow.loops
    }

    fn flowing(&self) -> Integrator {
        let loops = &self.flow.loops;
        let outside = self.flow.momentum.bodies().map(|bodies| loops.outside(&bodies.immersion.cover));
        outside.unwrap_or_else(|| loops.clone())
    }

    fn field(&self, name: Name) -> Result<Option<Field>, RunError> {
        let momentum = &self.flow.momentum;
        Ok(match name {
            Name::Velocity => Some(Field::new(&momentum.velocity, self.carried.v.clone())),
            Name::Pressure => Some(Field::new(&momentum.pressure, self.carried.pi.clone())),
            Name::Density | Name::Polarity | Name::MolecularField | Name::StreamFunction => None,
            Name::TissueVelocity | Name::PolarityLaplacian | Name::ElasticStrain => None,
        })
    }

    fn degree(&self) -> usize {
        self.flow.momentum.velocity.degree
    }
}

/// What only a tissue shows.
#[derive(Debug, Clone, Copy)]
pub struct TissueNow<'a> {
    /// What is solved.
    pub model: &'a dyn Sheet,
    /// Its fields.
    pub state: &'a State,
    /// `∂_t p`
    pub rate_of_p: &'a [f64],
    /// What the march has counted.
    pub march: OfMarch,
}

/// All that there is between two steps.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Time of the state.
    pub t: f64,
    /// `None` where there is nothing but bodies.
    pub fields: Option<&'a dyn Fields>,
    /// `None` where there are no bodies.
    pub bodies: Option<Bodies<'a>>,
    /// `None` where there is no tissue.
    pub tissue: Option<TissueNow<'a>>,
}
