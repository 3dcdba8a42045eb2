//! Thin active tissue on a substrate: velocity `v`, pressure `Π`, polarity `p`, everything dimensionless.
//!
//! ```text
//! −div(σᵀ) + C_F v = T_a p + f_v,   div v = 0                                   momentum and volume  [5.47]
//! Pe p□ + (|p|²−1) p − κ²Δp = f_p                                               polarity             [5.47]
//! σ = −Π I + 2D(v) + (a+1)/2 p⊗ℓ + (a−1)/2 ℓ⊗p − κ²B ∇pᵀ·∇p − S_a p⊗p           stress               [5.48]
//! ℓ = B[(|p|²−1) p − κ²Δp]                                                      molecular field
//! p□ = ∂_t p + (v·∇)p − W(v)·p − a D(v)·p                                       objective derivative
//! D(v) = sym ∇v,  W(v) = skw ∇v,  (∇v)_ij = ∂_j v_i
//! ```
//! The compressible sheet [5.49] has a density: `∂_t ρ + div(ρv) = f_ρ` in place of `div v = 0`, and a pressure that
//! follows from ρ.
//!
//! `v` and `Π` are continuous (Taylor–Hood), `p` and `ρ` are discontinuous; time is discretised by BDF, for ρ by A-BDF.
//! The page `docs/model.md` gives every formula with the tag that the code cites; numbers in square brackets are those
//! of Shourick's thesis (2024).

pub mod body;
pub mod contact;
pub mod cut;
pub mod element;
pub mod expression;
pub mod form;
pub mod measure;
pub mod mesh;
pub mod model;
pub mod names;
pub mod output;
pub mod report;
pub mod results;
pub mod run;
pub mod scene;
pub mod schema;
pub mod scheme;
pub mod shape;
pub mod solve;
pub mod space;
pub mod steady;
pub mod study;
pub mod time;
