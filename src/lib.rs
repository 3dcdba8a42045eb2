//! Thin active tissue on a substrate: velocity `v`, pressure `Π`, polarity `p`, everything dimensionless.
//!
//! This page leads through the library in the order in which data flow. A ring of passive tissue first, whole:
//!
//! ```
#![doc = include_str!("../examples/ring.rs")]
//! ```
//! | I want to … | look at |
//! | --- | --- |
//! | run a scene file, and read its results | [`run::kinds::run`], [`results`] (with an example) |
//! | march tissue of my own | the ring above; [`model::Description`], [`time::March`] |
//! | find a steady flow and judge its stability | [`steady`] (with an example), [`steady::Spectrum`] |
//! | follow steady states while a parameter varies | [`steady::branch`] |
//! | measure the order of a form of my own | [`form`] (with an example) |
//! | add a term to the equations | [`model::terms`] (with an example) |
//! | put rigid bodies into a Stokes flow | [`model::immersed::flow`] (with an example) |
//! | move bodies that touch | [`contact`] (with an example) |
//! | measure something | [`measure::list`], which has every measure, and [`measure`] |
//! | draw a field or a curve | [`output::plot::map`], [`output::plot`] |
//! | write files for ParaView | [`output::vtk`] |
//! | compute errors against exact fields | [`model::Exact`], [`measure::errors`] |
//!
//! # The equations
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
//!
//! # From a mesh to fields
//!
//! A [`mesh::Mesh`] consists of triangles with straight or curved sides, whose sides on the boundary have *tags*;
//! [`mesh::generate`] makes meshes of known shapes and [`mesh::gmsh`] reads those of others. A [`space::Space`] puts
//! polynomials on a mesh, continuous or not, with the bases and quadratures of [`element`]; a [`space::Field`] is a
//! function in it, and [`space::project`] makes fields from functions. [`expression::Expression`] is a function that
//! somebody has typed: it knows its derivatives, and where it is not smooth.
//!
//! # From fields to equations
//!
//! A form such as `(∇φ|∇χ)` is a value of [`form`]: it is added, scaled and tested alone, and [`form::Integrator`]
//! makes matrices and vectors of it. [`solve`] factorises them, and looks at every solution. [`cut`] and [`shape`] say
//! what of a cell lies in a rigid body.
//!
//! # What is solved
//!
//! [`model::Parameters`] are the numbers of the model, [`model::Conditions`] hold on a tag, [`model::Sources`] enter
//! from outside; a [`model::Description`] gathers them with the degrees of the fields. From it comes an
//! [`model::Incompressible`] or a [`model::Compressible`] sheet, both of which are a [`time::Sheet`]. Each term of
//! their equations stands once, in [`model::terms`]. [`body`] has rigid bodies, which a fluid carries by
//! [`model::immersed`] and which [`contact`] keeps apart.
//!
//! # To another time, or to rest
//!
//! [`time::March`] takes steps by BDF with the weights of [`scheme`], each solved by Newton's method or by a fixed
//! point ([`time::CouplingSettings`]); [`time::moving`] moves bodies with the tissue. [`steady::find`](steady::find())
//! looks for a state at rest, and [`steady::spectrum`] for what grows about it.
//!
//! # What comes out
//!
//! A [`measure`] makes numbers and curves of a state; [`output`] writes fields, tables, checkpoints and pictures.
//!
//! # Files
//!
//! All of this can be said in a file: a [`scene`] is checked as a whole, with a sentence for what is wrong; [`run`]
//! takes it to a folder of results, [`results`] reads that again, a [`study`] does many runs, and `report` makes a page
//! of them. The program of the same name does nothing else.
//!
//! # Features
//!
//! All are on by default; a library that only solves does without (`default-features = false`). What needs one that is
//! missing says so.
//!
//! | feature | has |
//! | --- | --- |
//! | `cli` | the program, and the bar that shows its progress |
//! | `html` | the module `report` |
//! | `parquet` | measured tables as Parquet, and such tables of studies |
//! | `pictures` | plots and maps |

#![warn(clippy::too_many_arguments, clippy::too_many_lines)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod names;
pub mod schema;

pub mod element;
pub mod mesh;
pub mod space;

pub mod expression;

pub mod cut;
pub mod shape;

pub mod form;
pub mod solve;

pub mod scheme;

pub mod body;
pub mod contact;
pub mod model;

pub mod steady;
pub mod time;

pub mod measure;
pub mod output;

pub mod results;
pub mod run;
pub mod scene;
pub mod study;

#[cfg(feature = "html")]
pub mod report;
