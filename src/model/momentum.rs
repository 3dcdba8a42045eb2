//! The velocity and pressure of a given polarity: a generalised Stokes problem, factorised once.

mod bodies;
mod error;
mod factors;
mod matrix;
mod outer;
mod residual;

use std::sync::Arc;

use super::boundary::{Conditions, VelocityCondition};
use super::closed::ClosedParts;
use super::frames::{Frames, WallPoints};
use super::immersed::nitsche::{Forms, Nitsche};
use super::immersed::{Embedding, Ground, Immersed};
use super::terms::FlowTerms;
use super::walls::Walls;
use crate::body::guide::Rule;
use crate::form::{CellPoint, Faces, Integrator, mass, stokes};
use crate::shape::Wrench;
use crate::solve::SolveError;
use crate::solve::sparse::{Factored, Matrix};
use crate::space::Space;
use error::blame_penalty;
use factors::{System, factorise};
use matrix::cell_means;

pub use error::MomentumError;
pub(super) use matrix::Stiffness;
pub use outer::{body_force, outer_force};

/// How `v·n = 0` is imposed.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum SlipTreatment {
    /// Nodal unknowns in the frame of the exact normal.
    #[default]
    Rotated,
    /// `(1/ε_r) ∫ (v·n)(w·n) ds`   [10.3]
    Penalty {
        /// `ε_r`, in units of `√|Ω|`.
        epsilon: f64,
    },
}

impl SlipTreatment {
    /// Where the frames of the velocity meet the condition.
    pub fn points(self) -> WallPoints {
        match self {
            SlipTreatment::Rotated => WallPoints::Lobatto,
            SlipTreatment::Penalty { .. } => WallPoints::Penalty,
        }
    }
}

/// `2(D(v)|D(w)) + C_F(v|w) + b(w,Π) = F(w)`, `b(v,ξ) = 0`   [7.11a], [7.11b]
#[derive(Debug)]
pub struct Momentum {
    /// The space of v.
    pub velocity: Arc<Space>,
    /// The space of Π.
    pub pressure: Arc<Space>,
    /// How `v·n = 0` is imposed.
    pub slip: SlipTreatment,
    /// Where `v·n` is an unknown of its own.
    pub frames: Frames,
    /// The parts in which the pressure is determined up to a constant, and has zero mean.
    pub closed: ClosedParts,
    /// `∫ ξ` of every pressure function.
    means: Vec<f64>,
    /// The terms that are linear in the flow, `2(D(v)|D(w)) + C_F(v|w)`, and the forms of walls.
    stiffness: Matrix,
    /// `b(w,Π)`: velocity rows, pressure columns.
    gradient: Matrix,
    /// `b(v,ξ)`.
    divergence: Matrix,
    /// `(v|w)`
    pub velocity_mass: Matrix,
    /// `(Π|χ)`
    pub pressure_mass: Matrix,
    system: System,
    /// Factorised masses of the stationary residuals, free velocity unknowns and pressure.
    residual_masses: (Factored, Factored),
    /// What the pressures of the factors are multiples of.
    unit: f64,
    made_of: Stiffness,
}

impl Momentum {
    /// Assembles and factorises.
    ///
    /// # Errors
    /// A rigid motion that nothing holds; a factorisation that fails.
    pub fn new(
        loops: &Integrator,
        velocity: &Arc<Space>,
        pressure: &Arc<Space>,
        conditions: &[Conditions],
        terms: &FlowTerms,
        slip: SlipTreatment,
    ) -> Result<Self, MomentumError> {
        Self::build(loops, (velocity, pressure), conditions, terms, slip, None)
    }

    /// The same with rigid bodies in the flow.
    ///
    /// # Errors
    /// As [`Momentum::new`]; bodies of which nothing lies inside the mesh, or that meet boundaries in a way that cannot
    /// be.
    pub fn with_bodies(
        loops: &Integrator,
        spaces: (&Arc<Space>, &Arc<Space>),
        conditions: &[Conditions],
        terms: &FlowTerms,
        slip: SlipTreatment,
        bodies: Embedding,
    ) -> Result<Self, MomentumError> {
        Self::build(loops, spaces, conditions, terms, slip, Some(bodies))
    }

    fn build(
        loops: &Integrator,
        (velocity, pressure): (&Arc<Space>, &Arc<Space>),
        conditions: &[Conditions],
        terms: &FlowTerms,
        slip: SlipTreatment,
        bodies: Option<Embedding>,
    ) -> Result<Self, MomentumError> {
        let frames = Frames::new(velocity, conditions, slip.points());
        if terms.friction() == 0.0 {
            check_held(velocity, conditions)?;
        }
        let made_of = Stiffness { terms: terms.clone(), walls: Walls::new(loops, conditions, slip)? };
        let (nv, np) = (velocity.dof_count(), pressure.dof_count());
        let stiffness = Matrix::from_triplets(nv, nv, &loops.triplets(&made_of.form(velocity), velocity, velocity));
        let b = loops.triplets(&stokes::divergence(velocity, pressure), pressure, velocity);
        let gradient = Matrix::from_triplets(nv, np, &b);
        let transposed: Vec<_> = b.iter().map(|&(i, j, v)| (j, i, v)).collect();
        let divergence = Matrix::from_triplets(np, nv, &transposed);
        let vm = loops.triplets(&mass::vector_mass(velocity), velocity, velocity);
        let velocity_mass = Matrix::from_triplets(nv, nv, &vm);
        let pm = loops.triplets(&mass::mass(pressure), pressure, pressure);
        let pressure_mass = Matrix::from_triplets(np, np, &pm);
        let reduced_mass = Matrix::from_triplets(frames.free, frames.free, &frames.reduce(&velocity_mass));
        let residual_masses =
            (Factored::new("velocity mass", reduced_mass)?, Factored::new("pressure mass", pressure_mass.clone())?);
        let closed = ClosedParts::new(pressure, conditions);
        let means = pressure_mass.times(&vec![1.0; np]);
        let unit = pressure_unit(loops.mesh.area());
        let system = match bodies {
            None => {
                let system = factorise(&frames, &stiffness, &gradient, (&means, unit), &closed);
                system.map_err(|error| blame_penalty(slip, error))?
            }
            Some(Embedding::Nitsche(placement)) => {
                let (stiffness, divergence) = made_of.blocks(loops, (velocity, pressure));
                let whole = [stiffness, divergence, cell_means(loops, pressure)];
                let ground = Ground { velocity, pressure, frames: &frames, closed: &closed };
                let forms = Forms { loops, velocity: &made_of };
                System::Nitsche(Box::new(Nitsche::new(ground, forms, whole, open_faces(loops, conditions), placement)?))
            }
            Some(Embedding::Penalty(immersion, rigidity)) => {
                let blocks = made_of.blocks(loops, (velocity, pressure));
                let means = if closed.count() > 0 { cell_means(loops, pressure) } else { Vec::new() };
                let ground = Ground { velocity, pressure, frames: &frames, closed: &closed };
                let bodies = Immersed::new(ground, blocks, means, terms.friction(), immersion, rigidity)?;
                System::Immersed(Box::new(bodies))
            }
        };
        Ok(Self {
            velocity: velocity.clone(),
            pressure: pressure.clone(),
            slip,
            frames,
            closed,
            means,
            stiffness,
            gradient,
            divergence,
            velocity_mass,
            pressure_mass,
            system,
            residual_masses,
            unit,
            made_of,
        })
    }

    /// What walls add to the stiffness.
    pub fn walls(&self) -> &Walls {
        &self.made_of.walls
    }

    /// Whether the pressure of some part is only defined up to a constant, and normalised to mean zero.
    pub fn is_closed(&self) -> bool {
        self.closed.count() > 0
    }

    /// A closed boundary lets nothing through, part by part.
    fn check_flux(&self, volume: &[f64], prescribed: &[f64]) -> Result<(), MomentumError> {
        let space = &self.velocity;
        let mut fastest = vec![0.0_f64; self.closed.count()];
        for &cell in self.closed.cells() {
            let cell = cell as usize;
            let part = self.closed.of_cell(cell).expect("the cell of a closed part");
            let values =
                (0..space.cell_dof_count()).map(|k| prescribed[space.dof(cell, k / space.n, k % space.n)].abs());
            fastest[part] = values.fold(fastest[part], f64::max);
        }
        let (fluxes, areas) = (self.closed.sums(volume), self.closed.sums(&self.means));
        for (part, ((&flux, fastest), area)) in fluxes.iter().zip(fastest).zip(areas).enumerate() {
            if flux.abs() > 1e-3 * fastest * area.sqrt() {
                return Err(MomentumError::Flux { flux, part: self.closed.shown(part) });
            }
        }
        Ok(())
    }

    /// `∫_K ξ` of every pressure function on every cell K.
    pub fn cell_means(&self, loops: &Integrator) -> Vec<f64> {
        cell_means(loops, &self.pressure)
    }

    /// Takes `(1/|Ω|) ∫_Ω π` off a pressure in every closed part Ω.
    pub fn take_off_means(&self, pi: &mut [f64]) {
        let sums = self.closed.sums(&self.pressure_mass.times(pi));
        let means: Vec<f64> = sums.iter().zip(self.closed.sums(&self.means)).map(|(sum, area)| sum / area).collect();
        self.closed.shift(pi, &means, |_| 1.0);
    }

    /// The L² projection of `f`, of degree `degree`, on the pressure space.
    ///
    /// # Errors
    /// As [`Factored::solve`].
    pub fn project_pressure(
        &self,
        loops: &Integrator,
        degree: usize,
        f: impl Fn(&CellPoint) -> f64 + Sync,
    ) -> Result<Vec<f64>, SolveError> {
        let load = loops.vector(&mass::scalar_load(&self.pressure, degree, f), &self.pressure);
        self.residual_masses.1.solve(&load)
    }

    /// Unknowns of the linear system.
    pub fn unknowns(&self) -> usize {
        self.frames.free + self.pressure.dof_count()
    }

    /// Solves for `(v, Π)` with the force `f` (a functional on the velocity space) and prescribed nodal values.
    ///
    /// # Errors
    /// As [`Factored::solve`]; prescribed values with a net flux through a closed boundary.
    pub fn solve(&self, f: &[f64], prescribed: &[f64]) -> Result<(Vec<f64>, Vec<f64>), MomentumError> {
        if let System::Immersed(bodies) = &self.system {
            let count = bodies.immersion.parts.len();
            let carried = self.carry(f, prescribed, &vec![Wrench::ZERO; count], &vec![Rule::Free; count])?;
            return Ok((carried.v, carried.pi));
        }
        if let System::Nitsche(bodies) = &self.system {
            let rules = bodies.rules_of_change();
            let carried = self.carry(f, prescribed, &vec![Wrench::ZERO; rules.len()], &rules)?;
            return Ok((carried.v, carried.pi));
        }
        let mut force = f.to_vec();
        self.stiffness.times_add(-1.0, prescribed, &mut force);
        let mut right = self.frames.restrict(&force);
        let volume: Vec<f64> = self.divergence.times(prescribed).iter().map(|v| -v).collect();
        let (free, pressure) = match &self.system {
            System::Immersed(_) | System::Nitsche(_) => unreachable!("bodies have been dealt with"),
            System::Open(factored) => {
                right.extend(volume.iter().map(|v| self.unit * v));
                let mut x = factored.solve(&right).map_err(|error| blame_penalty(self.slip, error))?;
                let pressure = x.split_off(self.frames.free);
                (x, pressure)
            }
            System::Closed(bordered) => {
                self.check_flux(&volume, prescribed)?;
                let last = self.closed.last();
                let kept = volume.iter().enumerate().filter(|(dof, _)| !last.contains(dof));
                right.extend(kept.map(|(_, value)| self.unit * value));
                let border: Vec<f64> = last.iter().flat_map(|&dof| [self.unit * volume[dof], 0.0]).collect();
                let solved = bordered.solve(&right, &border);
                let (mut x, border) = solved.map_err(|error| blame_penalty(self.slip, error))?;
                let mut kept = x.split_off(self.frames.free).into_iter();
                let own = |dof| last.iter().position(|&other| other == dof).map(|part| border[2 * part]);
                let pressure = (0..volume.len()).map(|dof| own(dof).or_else(|| kept.next()).unwrap_or(f64::NAN));
                let pressure = pressure.collect();
                (x, pressure)
            }
        };
        let pressure = pressure.into_iter().map(|pi| self.unit * pi).collect();
        Ok((self.frames.expand(&free, prescribed), pressure))
    }
}

/// The boundary faces on which a condition fixes the pressure.
fn open_faces(loops: &Integrator, conditions: &[Conditions]) -> Vec<usize> {
    let faces = loops.mesh.faces.iter().enumerate();
    let open = faces.filter(|(_, face)| face.tag.is_some_and(|tag| conditions[tag].velocity.fixes_pressure()));
    open.map(|(index, _)| index).collect()
}

/// The boundary faces whose velocity condition is of a kind.
pub fn tagged(conditions: &[Conditions], kind: impl Fn(&VelocityCondition) -> bool) -> Faces {
    let of_kind = conditions.iter().enumerate().filter(|(_, c)| kind(&c.velocity));
    of_kind.fold(Faces::NONE, |faces, (tag, _)| faces | Faces::tag(tag))
}

/// Refuses conditions that leave a rigid motion of some part free.
///
/// # Errors
/// [`MomentumError::Unheld`].
pub fn check_held(velocity: &Space, conditions: &[Conditions]) -> Result<(), MomentumError> {
    let holding: Vec<Conditions> = conditions.iter().map(Conditions::at_rest_where_resisted).collect();
    match Frames::new(velocity, &holding, WallPoints::Nodes).free_part(velocity) {
        None => Ok(()),
        Some(part) => Err(MomentumError::Unheld { part }),
    }
}

/// The power of two next to `|Ω|^-½`: with it as unit of pressure the matrix does not depend on the unit of length, and
/// its factors are as exact in any.
fn pressure_unit(area: f64) -> f64 {
    (-0.5 * area.log2()).round().exp2()
}
