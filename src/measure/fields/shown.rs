//! What output fields are found in: the fields of a state, whatever moves them, and what was made for their domain.

use std::sync::OnceLock;

use nalgebra::Matrix2;

use crate::form::Integrator;
use crate::measure::{MeasureError, Strain, StreamFunction};
use crate::model::fields::{PRESSURE, VELOCITY};
use crate::model::immersed::FlowWithBodies;
use crate::model::immersed::flow::Flow;
use crate::model::{FieldId, ModelKind, State};
use crate::space::Field;
use crate::time::{Sheet, SheetKind};

/// The fields of a state.
pub trait Fields: Sync {
    /// Of the whole mesh.
    fn loops(&self) -> &Integrator;

    /// Over what flows: all of the mesh that no body covers.
    fn flowing(&self) -> Integrator;

    /// A field of the model; the pressure of a compressible sheet follows from density and polarity. `None` where there
    /// is none.
    ///
    /// # Errors
    /// One that has to be solved for and cannot be.
    fn field(&self, id: FieldId) -> Result<Option<Field>, MeasureError>;

    /// The largest degree of a field's space.
    fn degree(&self) -> usize;

    /// Whether a density weighs pressure and diffusion, as their symbols tell.
    fn kind(&self) -> ModelKind {
        ModelKind::Incompressible
    }

    /// The whole state, where it is one of a tissue.
    fn tissue(&self) -> Option<TissueFields<'_>> {
        None
    }
}

/// A state and what was made for its domain.
#[derive(Clone, Copy)]
pub struct At<'a> {
    /// The fields of the state.
    pub fields: &'a dyn Fields,
    /// What was made once.
    pub tools: &'a Tools,
}

impl At<'_> {
    /// A scalar that follows from `∇v`, `G_ij = ∂_j v_i`, at each point, cell by cell: with the degree of `∇v` on
    /// straight cells, where it is exact if it is linear. `None` without a velocity.
    ///
    /// # Errors
    /// A velocity that cannot be solved for.
    pub fn of_gradient(&self, of: impl Fn(&Matrix2<f64>) -> f64 + Sync) -> Result<Option<Field>, MeasureError> {
        let Some(v) = self.fields.field(VELOCITY)? else { return Ok(None) };
        let degree = (v.space.degree - 1).max(1);
        Ok(Some(self.fields.loops().at_nodes(degree, |x| [of(&v.vector_gradient(x))])))
    }
}

/// What is made once for a domain, for fields that have to be solved for.
#[derive(Debug, Default)]
pub struct Tools {
    /// The equation of the elastic strain, where something needs it.
    pub strain: Option<Strain>,
    stream: OnceLock<StreamFunction>,
}

impl Tools {
    /// The equation of the stream function of these fields' velocity, made when it is first needed; `None` without a
    /// velocity.
    ///
    /// # Errors
    /// A matrix that cannot be factorised.
    pub fn stream(&self, fields: &dyn Fields) -> Result<Option<&StreamFunction>, MeasureError> {
        if self.stream.get().is_none() {
            let Some(v) = fields.field(VELOCITY)? else { return Ok(None) };
            let stream = StreamFunction::new(fields.loops(), &v.space)?;
            // whoever came first has made the same
            let _ = self.stream.set(stream);
        }
        Ok(self.stream.get())
    }

    /// Unknowns of the stream function, where it was needed.
    pub fn stream_unknowns(&self) -> Option<usize> {
        self.stream.get().map(|stream| stream.space.dof_count())
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

    fn field(&self, id: FieldId) -> Result<Option<Field>, MeasureError> {
        if *id == *PRESSURE {
            return Ok(Some(self.model.pressure(self.state)?));
        }
        Ok(self.state.get(id).cloned())
    }

    fn degree(&self) -> usize {
        let fields = self.model.fields();
        fields.into_iter().map(|(_, space)| space.degree).max().unwrap_or(1)
    }

    fn kind(&self) -> ModelKind {
        self.model.parameters().kind()
    }

    fn tissue(&self) -> Option<TissueFields<'_>> {
        Some(*self)
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
        let outside = self.flow.momentum.cover().map(|cover| loops.outside(cover));
        outside.unwrap_or_else(|| loops.clone())
    }

    fn field(&self, id: FieldId) -> Result<Option<Field>, MeasureError> {
        let momentum = &self.flow.momentum;
        Ok(match id {
            id if *id == *VELOCITY => Some(Field::new(&momentum.velocity, self.carried.v.clone())),
            id if *id == *PRESSURE => Some(Field::new(&momentum.pressure, self.carried.pi.clone())),
            _ => None,
        })
    }

    fn degree(&self) -> usize {
        self.flow.momentum.velocity.degree
    }
}
