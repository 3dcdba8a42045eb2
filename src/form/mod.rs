//! Weak forms: one vocabulary, one pair of integration loops, and one file per form of the model page.
//!
//! A form is a value. It can be added, scaled and tested alone; its integrand is written for two arbitrary functions
//! `phi` (trial) and `chi` (test) at one point, and the loops of [`integrate`] turn it into matrices and vectors.

mod assemble;
pub mod bilinear;
pub mod compression;
pub mod density;
pub mod elastic;
pub mod ghost;
pub mod gradient;
pub mod integrate;
mod kernel;
pub mod linear;
pub mod mass;
pub mod polarity;
pub mod power;
mod restrict;
pub mod stokes;
pub mod swip;
pub mod transport;
pub mod upwind;
pub mod words;
mod worker;

pub use bilinear::Bilinear;
pub use density::Density;
pub use integrate::{CellPoint, FacePoint, Faces, Integrator};
pub use linear::Linear;
