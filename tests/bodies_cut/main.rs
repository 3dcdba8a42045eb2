//! Bodies on meshes: shapes, and quadrature on what they cut.

mod cells;
#[allow(dead_code)]
#[path = "../identities/common.rs"]
mod common;
#[path = "../listed/mod.rs"]
mod listed;
mod shapes;
mod surface;
