//! Identities that hold to rounding on any mesh; the modules mirror `src/`.

mod common;
mod element;
mod form;
mod measure;
mod model;
mod solve;
mod space;
mod time;
