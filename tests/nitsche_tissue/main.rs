//! Rigid bodies in the incompressible tissue by Nitsche's method: tractions of the whole stress on their boundaries.

mod balance;
#[path = "../identities/common.rs"]
#[allow(dead_code)]
mod common;
mod energy;
mod force;
mod moving;
mod newton;
mod order;
mod scene;
mod setting;
