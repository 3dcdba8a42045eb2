//! Time stepping: BDF weights, the A-BDF of the density, the coupling within a step, step control, and schedules that
//! steps land on.

pub mod abdf;
pub mod bdf;
mod compressible;
pub mod control;
pub mod coupling;
pub mod equations;
mod incompressible;
pub mod march;
pub mod memory;
pub mod moving;
pub mod newton;
pub mod pace;
pub mod phases;
pub mod schedule;
pub mod sheet;

pub use control::{Control, ControlSettings};
pub use coupling::{CouplingKind, CouplingSettings, StepFailure, StepOutcome};
pub use march::{Checkpoint, Counts, March, MarchError, MarchSettings, StepReport};
pub use phases::Phases;
pub use schedule::Schedule;
pub use sheet::{Kind, Sheet, Weights};
