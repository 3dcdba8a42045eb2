//! Rigid bodies in a Stokes flow, on cells that they cut, by Nitsche's method.

mod channel;
mod common;
mod exact;
mod hard;
mod settling;
