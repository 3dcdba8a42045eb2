//! Time stepping: the equations of a step and their coupling, the march from step to step, moving bodies.

mod compressible;
pub mod coupling;
pub mod equations;
mod incompressible;
pub mod kept_factors;
pub mod march;
pub mod moving;
pub(crate) mod newton;
pub mod phases;
pub mod sheet;

pub use coupling::{CouplingKind, CouplingSettings, StepFailure, StepOutcome};
pub use march::{Checkpoint, Counts, March, MarchError, MarchSettings, StepReport};
pub use phases::Phases;
pub use sheet::{OwnedSheet, Sheet, SheetKind, Weights};
