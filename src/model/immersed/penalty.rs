//! What bodies add to the momentum balance, cell by cell: `(2/ε) ∫_B D(v):D(w)` [L1.13], their friction, and the means
//! that tell how they move.
//!
//! On a cell K that a body cuts, a polynomial without strain in the body has none in the rest of the cell either: the
//! full penalty would let the body grow by up to a cell. So ε is larger there,
//!
//! ```text
//! Σ_K (2/ε_K) ∫_{K∩B} D(v):D(w),   ε_K = ε + 1 − θ_K,   θ_K = |K∩B|/|K|
//! ```
//! At the surface of a rigid body the strain is that of fluid in layers along it, whose viscosities add up like
//! resistances in series: the harmonic mean over the cell, `1/(1−θ+θε/(1+ε)) = 1 + θ/(ε+1−θ)`, is what ε_K gives a
//! constant strain. A cell that is all body has `ε_K = ε`. [`Strength::Full`] keeps `ε_K = ε` everywhere.
//!
//! A disc that falls in a box (`cargo run --release --example bodies -- settling`), ε = 1e-8, squares of 2n² triangles
//! that the disc cuts, n = 10, 20, 40, 80: least-squares orders 1.37 in L², 0.44 in H¹, and 1.3 of the speed, beside
//! 1.44 and 0.44 of the L² projection of the exact flow; with `ε_K = ε` 0.54, 0.22 and 0.51. On meshes whose edges
//! follow the disc up to slivers, 2.85 and 1.68 (n = 6 to 12).
use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::cut::{Class, Cover};
use crate::form::{Integrator, mass, stokes};
use crate::mesh::Point;
use crate::shape::{Pose, Twist, Wrench, rigid_motion};
use crate::space::Space;

/// A part of a cell or of a body that is smaller than this, relative to the smaller of both, adds no viscosity: its
/// corner is within rounding of the body's outline.
const SLIVER: f64 = 1e-10;
/// Softer cells are so soft that the penalty may act on the rigid motions there.
const SOFT: f64 = 1e-3;

/// Why bodies cannot be put into a flow.
#[derive(Debug, Clone, thiserror::Error)]
pub enum BodyError {
    #[error("no part of the body `{body}` lies inside the mesh; hint: move it into the domain")]
    Outside { body: String, number: usize },
    #[error(
        "the body `{body}` has gone out through `{tag}`, where bodies do not leave: no part of it lies inside the mesh; \
         hint: set `boundary.{tag}.bodies = \"wall\"` to keep it inside, or `\"leave\"` to let it go"
    )]
    NoExit { body: String, tag: String },
    #[error("the body `{body}` covers the whole domain: no flow is left; hint: make it smaller")]
    Everything { body: String },
    #[error(
        "the body `{body}` lies over a boundary whose prescribed velocities no rigid motion has (they differ from one by {misfit:.1e}); hint: keep the \
         body a cell away from this boundary, or let the velocity be rigid there"
    )]
    Wall { body: String, misfit: f64 },
    #[error(
        "the motion that is prescribed for the body `{body}` contradicts the boundary or another body, with which it shares cells (by {misfit:.1e}); \
         hint: keep a cell between them, or give them the same motion"
    )]
    Contradiction { body: String, misfit: f64 },
    #[error(
        "the body `{body}` touches cells of a curved wall with slip, whose velocities are no nodal ones from degree 3 on; hint: set \
         `space.walls = \"penalty\"`, a lower degree, or keep the body away from the wall"
    )]
    Bent { body: String },
}

/// The penalty in cells that a body cuts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Strength {
    /// `ε_K = ε + 1 − θ_K`, so that a body keeps its size.
    #[default]
    Harmonic,
    /// `ε_K = ε`: every cell with a part of a body is rigid.
    Full,
}

/// How viscous bodies are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalty {
    /// ε, relative to the viscosity of what surrounds them.
    pub epsilon: f64,
    /// In cells that they cut.
    pub strength: Strength,
}

impl Penalty {
    /// With the harmonic mean in cut cells.
    pub fn harmonic(epsilon: f64) -> Self {
        Self { epsilon, strength: Strength::Harmonic }
    }

    /// With all of it in cut cells.
    pub fn full(epsilon: f64) -> Self {
        Self { epsilon, strength: Strength::Full }
    }
}

/// What a body and a cell have in common.
#[derive(Debug, Clone)]
pub struct CoveredPart {
    /// `∫ 2 D(v):D(w)` over the part, to be multiplied by [`CoveredPart::strength`]; `None` where the part is too
    /// small to count.
    pub viscosity: Option<Vec<f64>>,
    /// `∫ v·w` over the part.
    pub mass: Vec<f64>,
    pub area: f64,
    /// `θ = |K ∩ B|/|K|`
    pub share: f64,
    /// `ε_K − ε`
    softness: f64,
    /// Whether the [`Kernel`](super::kernel::Kernel) of the penalty is rigid here.
    pub rigid: bool,
}

impl CoveredPart {
    /// `1/ε_K`
    pub fn strength(&self, epsilon: f64) -> f64 {
        1.0 / (epsilon + self.softness)
    }
}

/// Means over a body: `twist = G⁻¹ Rᵀ M v`, R the three rigid motions, M the mass over the body, `G = RᵀMR`. For a body
/// that lies inside the mesh these are `V = (1/|B|) ∫_B v` and `ω = ∫_B (x−x_B)^⊥·v / ∫_B |x−x_B|²` by the quadrature
/// in use; of a body that leaves it, the rigid motion nearest to the flow in the part that is left. A rigid flow has
/// exactly its own twist.
#[derive(Debug, Clone)]
pub struct Means {
    /// Velocity dofs and their row of `G⁻¹ Rᵀ M`.
    pub rows: Vec<(usize, Vector3<f64>)>,
    /// Area, by the same quadrature.
    pub area: f64,
}

impl Means {
    /// The body's velocity and spin in a flow.
    pub fn twist(&self, v: &[f64]) -> Twist {
        let sum: Vector3<f64> = self.rows.iter().map(|(dof, row)| row * v[*dof]).sum();
        Twist { velocity: Point::new(sum.x, sum.y), spin: sum.z }
    }

    /// Adds the functional whose work is `F·V + τω`.
    pub fn add_load(&self, load: Wrench, f: &mut [f64]) {
        let load = Vector3::new(load.force.x, load.force.y, load.torque);
        self.rows.iter().for_each(|(dof, row)| f[*dof] += row.dot(&load));
    }
}

/// Bodies in a velocity space.
#[derive(Debug, Clone)]
pub struct Immersion {
    pub names: Arc<[String]>,
    pub velocity: Arc<Space>,
    pub cover: Arc<Cover>,
    pub poses: Vec<Pose>,
    /// The cells of every body.
    pub parts: Vec<BTreeMap<usize, CoveredPart>>,
    pub means: Vec<Means>,
    strength: Strength,
    positions: Arc<[Point]>,
}

impl Immersion {
    /// Integrates over the bodies of `cover`.
    ///
    /// # Errors
    /// A body outside of the mesh, or all over it.
    pub fn new(
        loops: &Integrator,
        velocity: &Arc<Space>,
        cover: Arc<Cover>,
        names: &[String],
        (poses, strength): (&[Pose], Strength),
    ) -> Result<Self, BodyError> {
        let cells = cover.touched().to_vec();
        let mut new = Self {
            names: names.into(),
            velocity: velocity.clone(),
            cover,
            poses: poses.to_vec(),
            parts: vec![BTreeMap::new(); names.len()],
            means: Vec::new(),
            strength,
            positions: velocity.node_positions().into(),
        };
        new.integrate(loops, &cells)?;
        Ok(new)
    }

    /// The bodies at other places, and the cells where something changed.
    ///
    /// # Errors
    /// As [`Immersion::new`].
    pub fn moved(&self, loops: &Integrator, poses: &[Pose]) -> Result<(Self, Vec<usize>), BodyError> {
        let (cover, changed) = self.cover.moved(poses);
        let mut new = Self { cover: Arc::new(cover), poses: poses.to_vec(), ..self.clone() };
        new.parts.iter_mut().for_each(|parts| changed.iter().for_each(|cell| drop(parts.remove(cell))));
        new.integrate(loops, &changed)?;
        Ok((new, changed))
    }

    /// How viscous the bodies are in cells that they cut.
    pub fn strength(&self) -> Strength {
        self.strength
    }

    /// Positions of the velocity nodes.
    pub fn positions(&self) -> &[Point] {
        &self.positions
    }

    fn integrate(&mut self, loops: &Integrator, cells: &[usize]) -> Result<(), BodyError> {
        let space = &*self.velocity;
        let (viscosity, mass) = (stokes::viscosity(space), mass::vector_mass(space));
        for body in 0..self.parts.len() {
            let own: Vec<usize> =
                cells.iter().copied().filter(|&cell| self.cover.bodies_of_cell(cell).contains(&body)).collect();
            let inside = loops.inside(&self.cover, Some(body));
            let stiff = inside.blocks_of(&viscosity, (space, space), &own);
            let masses = inside.blocks_of(&mass, (space, space), &own);
            for ((&cell, viscosity), mass) in own.iter().zip(stiff).zip(masses) {
                let n = space.n;
                let area = mass.chunks_exact(2 * n).take(n).flat_map(|row| &row[..n]).sum();
                let share = match self.cover.cell(cell) {
                    Class::Inside(_) => 1.0,
                    Class::Outside | Class::Cut(_) => f64::min(area / loops.mesh.cell_area(cell), 1.0),
                };
                let softness = if self.strength == Strength::Full { 0.0 } else { 1.0 - share };
                let part = CoveredPart { viscosity: Some(viscosity), mass, area, share, softness, rigid: false };
                self.parts[body].insert(cell, part);
            }
        }
        self.means = (0..self.parts.len()).map(|body| self.mean(body)).collect::<Result<_, _>>()?;
        for (parts, means) in self.parts.iter_mut().zip(&self.means) {
            for (&cell, part) in parts.iter_mut() {
                if part.area < SLIVER * means.area.min(loops.mesh.cell_area(cell)) {
                    part.viscosity = None;
                }
                part.rigid = part.viscosity.is_some() && part.softness < SOFT;
            }
        }
        let domain = loops.mesh.area();
        match self.means.iter().position(|m| m.area > (1.0 - 1e-9) * domain) {
            Some(body) => Err(BodyError::Everything { body: self.names[body].clone() }),
            None => Ok(()),
        }
    }

    fn mean(&self, body: usize) -> Result<Means, BodyError> {
        let (space, centre) = (&*self.velocity, self.poses[body].position);
        let outside = || BodyError::Outside { body: self.names[body].clone(), number: body };
        let mut rows: BTreeMap<usize, Vector3<f64>> = BTreeMap::new();
        let (mut area, mut gram) = (0.0, Matrix3::zeros());
        for (&cell, part) in &self.parts[body] {
            let m = space.cell_dof_count();
            area += part.area;
            let motions: Vec<Vector3<f64>> = (0..m).map(|k| self.motions_of_dof(centre, cell, k)).collect();
            for (k, row) in part.mass.chunks_exact(m).enumerate() {
                let moment: Vector3<f64> = row.iter().zip(&motions).map(|(a, motion)| motion * *a).sum();
                *rows.entry(space.dof(cell, k / space.n, k % space.n)).or_default() += moment;
                gram += motions[k] * moment.transpose();
            }
        }
        // of less than a sliver nothing tells how the body moves
        if area <= SLIVER * self.cover.body(body).shape.area() || area.is_nan() {
            return Err(outside());
        }
        // lengths in the body's own size
        let reach = (gram[(2, 2)] / area).sqrt();
        let scale = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0 / reach));
        let inverse = (scale * gram * scale / area).try_inverse().ok_or_else(outside)?;
        let inverse = scale * inverse * scale / area;
        Ok(Means { rows: rows.into_iter().map(|(dof, row)| (dof, inverse * row)).collect(), area })
    }

    /// The three rigid motions at dof `k` of a cell.
    fn motions_of_dof(&self, centre: Point, cell: usize, k: usize) -> Vector3<f64> {
        let space = &*self.velocity;
        let x = self.positions[space.node(cell, k % space.n)];
        Vector3::from_fn(|i, _| rigid_motion(i, centre, x)[k / space.n])
    }
}
