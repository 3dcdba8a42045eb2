//! Steady states: the eigenvalues of their linearisation, the search for them, and their branches.

mod arnoldi;
mod branches;
mod common;
mod find;
mod spectrum;
mod tangent;
