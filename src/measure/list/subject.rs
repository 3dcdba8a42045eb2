//! What measures are taken of, and what takes them.

use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use super::Column;
use crate::body::Body;
use crate::contact::Contact;
use crate::form::Integrator;
use crate::measure::{Census, MeasureError, Strain};
use crate::mesh::generate::Track;
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::model::momentum::MomentumError;
use crate::model::{Reactions, State};
use crate::shape::Wrench;
use crate::shape::{Pose, Twist};
use crate::space::Field;
use crate::time::Sheet;

/// The domain of a flow: what stays while its state changes.
#[derive(Debug, Clone, Copy)]
pub struct Domain<'a> {
    /// Its cells.
    pub mesh: &'a Arc<Mesh>,
    /// Finds the cell of a point.
    pub locator: &'a Locator,
    /// Of the disc, which axes refer to.
    pub centre: [f64; 2],
    /// Of the same disc.
    pub radius: f64,
    /// The largest `x₁`.
    pub end: f64,
    /// The way around, where there is one.
    pub track: Option<Track>,
    /// The equation of the elastic strain, where the scene needs it.
    pub strain: Option<&'a Strain>,
    /// Degree of the polarity, where there is one.
    pub polarity: usize,
}

/// A tissue in a state.
#[derive(Clone, Copy)]
pub struct Tissue<'a> {
    /// Where it is.
    pub domain: &'a Domain<'a>,
    /// With the parameters of the state; its mesh is that of the domain.
    pub model: &'a dyn Sheet,
    /// Its fields.
    pub state: &'a State,
    /// The time of the state.
    pub t: f64,
    /// `∂_t p`
    pub rate_of_p: &'a [f64],
    /// `F` and `dF/dt`, where somebody asked for them.
    pub energy: Option<(f64, f64)>,
    /// What a state at rest does not have.
    pub march: Option<OfMarch>,
}

/// Counts of a march in time.
#[derive(Debug, Clone, Copy)]
pub struct OfMarch {
    /// Cells whose density was limited in the last step.
    pub limited: usize,
    /// The mass at the start and what came in since.
    pub mass_counted: f64,
}

/// All that measures can be taken of at a moment.
#[derive(Clone, Copy, Default)]
pub struct Subject<'a> {
    /// What flows.
    pub flow: Option<Flow<'a>>,
    /// What bounds a flow that forces drive.
    pub boundary: Option<&'a Boundary<'a>>,
    /// What is rigid.
    pub bodies: Option<Bodies<'a>>,
    /// What acts on the bodies in a flow.
    pub acting: Option<&'a Acting<'a>>,
    /// What they take of the energy of a tissue.
    pub powers: Option<&'a Powers<'a>>,
    /// What only a tissue has.
    pub tissue: Option<Tissue<'a>>,
}

/// A flow.
#[derive(Clone, Copy)]
pub struct Flow<'a> {
    /// Its velocity.
    pub v: &'a Field,
    /// Over what flows: all of the mesh that no body covers.
    pub loops: &'a Integrator,
}

/// Forces of a flow that are found when they are first asked for.
pub struct Forces<'a, T> {
    find: &'a dyn Fn() -> Result<T, MomentumError>,
    found: OnceCell<T>,
}

/// On its boundary.
pub type Boundary<'a> = Forces<'a, Reactions>;
/// On every body in it.
pub type Acting<'a> = Forces<'a, Vec<ActsOn>>;
/// What every body takes of the energy.
pub type Powers<'a> = Forces<'a, Vec<f64>>;

/// What acts on a body in a flow: forces, and torques about its centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActsOn {
    /// Of the flow.
    pub flow: Wrench,
    /// Those that hold it to what is prescribed of its motion; zero of a free body.
    pub holding: Wrench,
}

impl<'a, T> Forces<'a, T> {
    /// With what finds them.
    pub fn new(find: &'a dyn Fn() -> Result<T, MomentumError>) -> Self {
        Self { find, found: OnceCell::new() }
    }

    fn get(&self) -> Result<&T, MeasureError> {
        if let Some(found) = self.found.get() {
            return Ok(found);
        }
        let found = (self.find)()?;
        Ok(self.found.get_or_init(|| found))
    }
}

/// Where on a boundary a measure is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Of the mesh.
    pub tag: usize,
    /// What a torque is about.
    pub around: Point,
}

/// Rigid bodies.
#[derive(Clone, Copy)]
pub struct Bodies<'a> {
    /// What they are, without those that have left.
    pub bodies: &'a [Body],
    /// One for each body.
    pub poses: &'a [Pose],
    /// One for each body.
    pub twists: &'a [Twist],
    /// Pairs that are close or touch.
    pub contacts: &'a [Contact],
    /// Forces and torques of a Stokes flow, one for each body; none of other flows.
    pub flow: &'a [Wrench],
}

impl Bodies<'_> {
    /// Force and torque of a Stokes flow on every body.
    pub fn wrenches_by_name(&self) -> BTreeMap<String, [f64; 3]> {
        let one = |(body, flow): (&Body, &Wrench)| (body.name.clone(), [flow.force.x, flow.force.y, flow.torque]);
        self.bodies.iter().zip(self.flow).map(one).collect()
    }
}

/// A rigid body.
#[derive(Clone, Copy)]
pub struct OneBody<'a> {
    /// It and the others.
    pub all: &'a Bodies<'a>,
    /// Its number.
    pub index: usize,
    /// What acts on the bodies in a flow.
    pub acting: Option<&'a Acting<'a>>,
    /// What they take of the energy of a tissue.
    pub powers: Option<&'a Powers<'a>>,
}

impl OneBody<'_> {
    /// What acts on it; `None` where nothing flows.
    ///
    /// # Errors
    /// Forces that cannot be found.
    pub fn acting(&self) -> Result<Option<ActsOn>, MeasureError> {
        let Some(acting) = self.acting else { return Ok(None) };
        Ok(acting.get()?.get(self.index).copied())
    }

    /// What it takes of the energy; `None` where there is no tissue.
    ///
    /// # Errors
    /// Forces that cannot be found.
    pub fn power(&self) -> Result<Option<f64>, MeasureError> {
        let Some(powers) = self.powers else { return Ok(None) };
        Ok(powers.get()?.get(self.index).copied())
    }
}

/// What was measured.
#[derive(Debug, Clone, Default)]
pub struct Taken {
    /// By column.
    pub values: BTreeMap<&'static str, f64>,
    /// The defects of the polarity, one by one.
    pub census: Option<Census>,
}

impl Taken {
    /// The numbers of these columns.
    pub fn put<const N: usize>(&mut self, columns: &[Column; N], values: [f64; N]) {
        self.values.extend(columns.iter().map(|column| column.name).zip(values));
    }
}

/// Takes a measure at a state of a tissue.
pub type OfState = fn(&Tissue<'_>, &mut Taken) -> Result<(), MeasureError>;
/// Takes a measure of a flow.
pub type OfFlow = fn(&Flow<'_>, &mut Taken) -> Result<(), MeasureError>;
/// The numbers of a measure on a boundary tag, in the order of its columns.
pub type OfBoundary = fn(&Reactions, &Spot) -> Vec<f64>;
/// Takes a measure of bodies.
pub type OfBodies = fn(&Bodies<'_>, &mut Taken) -> Result<(), MeasureError>;
/// The numbers of a measure of a body, in the order of its columns; none where they do not exist.
pub type OfBody = fn(&OneBody<'_>) -> Result<Vec<f64>, MeasureError>;

/// Takes one measure of a tissue, with what it has prepared.
pub trait Gauge: fmt::Debug + Send + Sync {
    /// Puts down its numbers; those that do not exist in this state are left out.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    fn take(&self, at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError>;
}

/// Of a tissue, with nothing prepared.
#[derive(Debug)]
pub(super) struct OfTissue(pub OfState);

impl Gauge for OfTissue {
    fn take(&self, at: &Tissue, taken: &mut Taken) -> Result<(), MeasureError> {
        (self.0)(at, taken)
    }
}

/// A measure with what it has prepared.
#[derive(Debug)]
pub enum Prepared {
    /// Of a flow.
    Flow(OfFlow),
    /// Of a boundary tag.
    Boundary {
        /// From the forces on the nodes.
        take: OfBoundary,
        /// Where.
        spot: Spot,
        /// Of the tag.
        columns: Vec<&'static str>,
    },
    /// Of bodies.
    Bodies(OfBodies),
    /// Of a body.
    Body {
        /// From the bodies.
        take: OfBody,
        /// Which one; `None` is the first.
        name: Option<String>,
        /// Of the body.
        columns: Vec<&'static str>,
    },
    /// Of a tissue.
    Tissue(Box<dyn Gauge>),
}

impl Prepared {
    /// Of the first body, this name: that of the bodies of a scene, which may leave.
    #[must_use]
    pub fn of_first(self, first: Option<&str>) -> Self {
        match self {
            Prepared::Body { take, name: None, columns } => {
                Prepared::Body { take, name: first.map(str::to_owned), columns }
            }
            other => other,
        }
    }

    /// Puts down its numbers; nothing where there is nothing that it is taken of.
    ///
    /// # Errors
    /// A measure that cannot be taken.
    pub fn take(&self, at: &Subject, taken: &mut Taken) -> Result<(), MeasureError> {
        match self {
            Prepared::Flow(take) => at.flow.map_or(Ok(()), |flow| take(&flow, taken)),
            Prepared::Boundary { take, spot, columns } => {
                let Some(boundary) = at.boundary else { return Ok(()) };
                let numbers = take(boundary.get()?, spot);
                taken.values.extend(columns.iter().copied().zip(numbers));
                Ok(())
            }
            Prepared::Bodies(take) => at.bodies.map_or(Ok(()), |bodies| take(&bodies, taken)),
            Prepared::Body { take, name, columns } => {
                let Some(all) = &at.bodies else { return Ok(()) };
                let is_meant = |body: &Body| name.as_ref().is_none_or(|name| *name == body.name);
                let Some(index) = all.bodies.iter().position(is_meant) else { return Ok(()) };
                let numbers = take(&OneBody { all, index, acting: at.acting, powers: at.powers })?;
                taken.values.extend(columns.iter().copied().zip(numbers));
                Ok(())
            }
            Prepared::Tissue(gauge) => at.tissue.map_or(Ok(()), |tissue| gauge.take(&tissue, taken)),
        }
    }
}
