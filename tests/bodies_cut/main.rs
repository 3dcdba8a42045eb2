//! Bodies on meshes: shapes, and quadrature on what they cut.

#[allow(dead_code)]
#[path = "../identities/common.rs"]
mod common;
mod cells;
mod shapes;
