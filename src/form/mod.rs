//! Weak forms: one vocabulary, one pair of integration loops, and one file per form of the model page.
//!
//! A form is a value. It can be added, scaled and tested alone; its integrand is written for two arbitrary functions
//! `phi` (trial) and `chi` (test) at one point, and the loops of [`integrate`] turn it into matrices and vectors.
//!
//! The order of a form of one's own, `(φ|χ) + (∇φ|∇χ)`, whose natural condition is `∂_nφ = 0`:
//!
//! ```
//! use std::f64::consts::PI;
//! use std::sync::Arc;
//!
//! use monolayer::form::words::Scalar;
//! use monolayer::form::{Bilinear, Integrator, mass};
//! use monolayer::mesh::{Point, generate::MeshScene};
//! use monolayer::solve::sparse::{Factored, Matrix};
//! use monolayer::space::{Continuity, Field, Space};
//!
//! fn error(n: usize) -> Result<f64, Box<dyn std::error::Error>> {
//!     let mesh = Arc::new(MeshScene::of("square").with("n", n).build()?);
//!     let (loops, space) = (Integrator::new(&mesh), Arc::new(Space::new(&mesh, Continuity::Continuous, 2, 1)));
//!     let form = Bilinear::cells(4, |_| |phi: Scalar, chi: Scalar| phi.value * chi.value + phi.grad.dot(&chi.grad));
//!     let exact = |x: Point| (PI * x.x).cos() * (PI * x.y).cos();
//!     let load = mass::scalar_load(&space, 6, |x| (1.0 + 2.0 * PI * PI) * exact(x.site.x));
//!     let size = space.dof_count();
//!     let matrix = Matrix::from_triplets(size, size, &loops.triplets(&form, &space, &space));
//!     let values = Factored::new("my equation", matrix)?.solve(&loops.vector(&load, &space))?;
//!     let phi = Field::new(&space, values);
//!     Ok(loops.sum(8, |x| (phi.scalar(&x.site) - exact(x.site.x)).powi(2)).sqrt())
//! }
//!
//! let order = (error(4)? / error(8)?).log2();
//! assert!((order - 3.0).abs() < 0.2, "{order}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod bilinear;
mod blocks;
pub mod compression;
pub mod density;
pub mod elastic;
pub mod ghost;
pub mod gradient;
pub mod hybrid;
pub mod integrate;
mod kernel;
pub mod linear;
pub mod mass;
pub mod nitsche;
mod nodal;
pub mod outline;
pub mod polarity;
pub mod power;
mod restrict;
pub mod side;
pub mod stokes;
pub mod swip;
pub mod traction;
pub mod transport;
pub mod upwind;
pub mod words;
mod worker;

pub use bilinear::Bilinear;
pub use density::Density;
pub use integrate::{CellPoint, FacePoint, Faces, Integrator};
pub use linear::Linear;
pub use outline::OutlinePoint;
