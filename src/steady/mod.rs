//! Steady states: found by pseudo-transient continuation into Newton's method, judged by the eigenvalues of their
//! linearisation.
//!
//! The steady flow past a disc on a coarse mesh, which overshoots behind it:
//!
//! ```
//! use std::sync::{Arc, atomic::AtomicBool};
//!
//! use monolayer::expression::Expression;
//! use monolayer::mesh::generate::MeshScene;
//! use monolayer::model::fields::VELOCITY;
//! use monolayer::model::{Conditions, Description, Incompressible, Parameters, start};
//! use monolayer::steady::{Found, SearchSettings, SteadySettings, find};
//! use monolayer::time::{MarchSettings, Phases};
//!
//! let strip = MeshScene::of("strip-with-disc").with("length", [-6.0, 9.0]).with("width", 10.0);
//! let mesh = Arc::new(strip.with("h", 2.0).with("h_disc", 0.5).build()?);
//! let ahead = || [1.0, 0.0].map(Expression::constant);
//! let parameters =
//!     Parameters { friction: 3.0, traction: 3.0, peclet: 2.0, coherence: 0.3, elasticity: 0.4, ..Parameters::PLAIN };
//! let problem = Description::new(&mesh, parameters, |tag| match tag {
//!     "inlet" => Conditions::flow(ahead()).with_polarity(ahead()),
//!     "outlet" => Conditions::open().with_polarity(ahead()),
//!     _ => Conditions::slip(),
//! });
//! let model = Incompressible::new(&mesh, &problem)?;
//! let p = start::aligned(&model.loops, &model.polarity.space, &model.conditions, 1.0)?;
//! let settings = SearchSettings { steady: SteadySettings::default(), marching: MarchSettings::new(2, 1.0) };
//! let (never, mut phases) = (AtomicBool::new(false), Phases::default());
//! let search = find(&model, p.values, &settings, &never, &mut phases, &mut |_| Ok(()))?;
//! let Found::Steady(steady) = search.found else { panic!("{:?}", search.tries) };
//! let fastest = steady.state[VELOCITY].values.iter().fold(0.0_f64, |most, v| most.max(*v));
//! assert!(steady.residuals.total() < 1e-9 && fastest > 1.05, "{fastest}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod arclength;
pub mod branch;
pub mod find;
mod fork;
pub mod oscillation;
pub mod pseudo;
pub mod spectrum;

pub use find::{Event, Found, Search, SearchSettings, Steady, SteadySettings, Try, Want, Way, find};
pub use oscillation::Oscillation;
pub use pseudo::{PseudoStep, Stall};
pub use spectrum::{Spectrum, Stability};
