//! What defines a problem of tissue besides its mesh, with the usual values where nothing is said.

use super::boundary::Conditions;
use super::momentum::SlipTreatment;
use super::parameters::{ModelKind, Parameters};
use super::sources::Sources;
use crate::mesh::Mesh;

/// Polynomial degrees of the fields; those of fields that a model does not have do not matter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Degrees {
    /// Of v, continuous.
    pub velocity: usize,
    /// Of Π, continuous; incompressible only.
    pub pressure: usize,
    /// Of ρ, discontinuous; compressible only.
    pub density: usize,
    /// Of p, discontinuous.
    pub polarity: usize,
}

impl Degrees {
    /// The usual degrees of order k: velocity k+1, pressure or density k, and polarity k+2, in a compressible sheet
    /// k+1.
    pub fn of(kind: ModelKind, k: usize) -> Self {
        let polarity = match kind {
            ModelKind::Incompressible => k + 2,
            ModelKind::Compressible => k + 1,
        };
        Self { velocity: k + 1, pressure: k, density: k, polarity }
    }
}

/// All that defines a problem besides its mesh.
///
/// [`Description::new`] has the usual values of what it is not told; others are set by name:
///
/// ```
/// use monolayer::mesh::generate::MeshScene;
/// use monolayer::model::{Conditions, Degrees, Description, Parameters};
///
/// let mesh = MeshScene::of("square").with("n", 2).build()?;
/// let usual = Description::new(&mesh, Parameters::PLAIN, |_| Conditions::slip());
/// let finer = Description { degrees: Degrees { polarity: 4, ..usual.degrees }, ..usual };
/// assert_eq!((finer.degrees.velocity, finer.conditions.len()), (2, mesh.tags.len()));
/// # Ok::<(), monolayer::mesh::MeshError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Description {
    /// The numbers of the model.
    pub parameters: Parameters,
    /// How fine the fields are.
    pub degrees: Degrees,
    /// One per tag of the mesh.
    pub conditions: Vec<Conditions>,
    /// What enters the equations from outside.
    pub sources: Sources,
    /// How `v·n = 0` is imposed.
    pub slip: SlipTreatment,
}

impl Description {
    /// With the conditions that a tag of the mesh has, the degrees of order 1, no sources, and exact slip.
    pub fn new(mesh: &Mesh, parameters: Parameters, conditions: impl Fn(&str) -> Conditions) -> Self {
        Self {
            parameters,
            degrees: Degrees::of(parameters.kind(), 1),
            conditions: mesh.tags.iter().map(|tag| conditions(tag)).collect(),
            sources: Sources::default(),
            slip: SlipTreatment::default(),
        }
    }
}
