//! Steady states: the eigenvalues of their linearisation, the search for them, and their branches.

mod arnoldi;
mod branches;
mod common;
mod find;
mod self_advection;
mod spectrum;
mod tangent;
