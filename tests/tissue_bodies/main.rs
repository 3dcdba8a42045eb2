//! Rigid bodies in the incompressible tissue: the polarity near cut cells, the coupling, moving bodies.

#[path = "../identities/common.rs"]
#[allow(dead_code)]
mod common;
mod coupling;
mod order;
