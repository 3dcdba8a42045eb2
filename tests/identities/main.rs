//! Identities that hold to rounding on any mesh; the modules mirror `src/`.

mod abdf;
mod common;
mod defects;
mod density;
mod element;
mod energy;
mod fields;
mod form;
mod hybrid;
mod limiter;
mod measure;
mod mesh_generate;
mod model;
mod newton;
mod parts;
mod project;
mod reactions;
mod solve;
mod space;
mod start;
mod strain;
mod terms;
mod time;
mod units;
