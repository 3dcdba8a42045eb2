//! Identities that hold to rounding on any mesh; the modules mirror `src/`.

mod abdf;
mod common;
mod density;
mod element;
mod energy;
mod form;
mod limiter;
mod measure;
mod mesh_generate;
mod model;
mod newton;
mod solve;
mod space;
mod start;
mod time;
