//! The multifrontal factorisation on its own.

mod grid;
mod random;
mod saddle_point;
