//! Identities that hold to rounding on any mesh; the modules mirror `src/`.

mod common;
mod element;
mod form;
mod measure;
mod mesh_generate;
mod model;
mod solve;
mod space;
mod start;
mod time;
