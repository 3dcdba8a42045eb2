//! The cells with fluid, and what hangs together there.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::twists::Twists;
use crate::cut::{Class, Cover, Surface};
use crate::form::Integrator;
use crate::mesh::{Mesh, Point};
use crate::model::momentum::MomentumError;
use crate::shape::{Pose, rigid_motion};
use crate::space::Space;

/// In no part.
const NONE: u32 = u32::MAX;
/// Openings of the boundary in which a body stands, in sizes of cells, that are none: what does not touch a wall by
/// more moves as if it did not touch it.
pub(super) const CLOSED: f64 = 0.1;
/// Singular values below this, relative to the largest one, are zero.
const RANK: f64 = 1e-9;
/// Largest net flux through the boundary of a closed pool, relative to its size and the largest velocity.
const FLUX: f64 = 1e-3;

/// Where there is fluid, for one placement of the bodies.
#[derive(Debug, Clone)]
pub(super) struct Domain {
    pub cover: Arc<Cover>,
    pub poses: Vec<Pose>,
    /// Boundaries that the fluid touches.
    pub surface: Surface,
    /// By cell.
    pub active: Vec<bool>,
    /// Faces with fluid between active cells one of which at least is cut, ascending.
    pub ghosts: Vec<usize>,
    pub parts: Parts,
    pools: Pools,
}

/// Parts of the fluid that share no pressure.
#[derive(Debug, Clone)]
pub(super) struct Parts {
    of_cell: Vec<u32>,
    /// The last pressure of every closed part: one that has no face whose condition fixes the pressure.
    pub last: Vec<usize>,
    /// Combinations of their pressures' means that nothing determines, one number for each closed part.
    pub means: Vec<Vec<f64>>,
}

/// Parts of the fluid between which nothing flows.
#[derive(Debug, Clone)]
struct Pools {
    of_cell: Vec<u32>,
    /// A cell of each.
    first: Vec<usize>,
    areas: Vec<f64>,
    /// Whether a condition leaves open what flows through its boundary.
    open: Vec<bool>,
    /// `∫ n·w` of the rigid motions w over what a pool touches of a body, by pool and body, where it is not closed.
    passages: BTreeMap<(usize, usize), [f64; 3]>,
}

impl Domain {
    /// `open` are the faces whose conditions fix the pressure.
    pub fn new(cover: Arc<Cover>, poses: &[Pose], (loops, pressure): (&Integrator, &Space), open: &[usize]) -> Self {
        let mesh = cover.mesh().clone();
        let active: Vec<bool> = (0..mesh.cells.len()).map(|cell| cover.is_active(cell)).collect();
        let is_cut = |cell: usize| matches!(cover.cell(cell), Class::Cut(_));
        let between = |face: usize| {
            let (minus, plus) = (mesh.faces[face].minus.cell, mesh.faces[face].plus?.cell);
            (active[minus] && active[plus] && cover.is_wet(face)).then_some([minus, plus])
        };
        let surface = cover.surface();
        let links: Vec<[usize; 2]> = (0..mesh.faces.len()).filter_map(between).collect();
        let ghosts =
            (0..mesh.faces.len()).filter(|&face| between(face).is_some_and(|sides| sides.iter().any(|&c| is_cut(c))));
        let ghosts = ghosts.collect();
        let wet = |face: &&usize| active[mesh.faces[**face].minus.cell] && cover.is_wet(**face);
        let open: Vec<usize> = open.iter().filter(wet).map(|&face| mesh.faces[face].minus.cell).collect();
        let parts = Parts::new(pressure, &active, &open);
        let mut pools = Pools::new(&mesh, &active, &links, &open);
        pools.find_passages(loops, &surface, poses);
        Self { surface, poses: poses.to_vec(), active, ghosts, parts, pools, cover }
    }

    /// How the motions of a body change the volumes of the closed pools that it bounds.
    pub fn closed_passages(&self, body: usize) -> Vec<[f64; 3]> {
        let own = self.pools.passages.iter().filter(|((pool, other), _)| *other == body && !self.pools.open[*pool]);
        own.map(|(_, flux)| *flux).collect()
    }

    /// Finds out which pressures nothing determines: those of closed parts, unless they push a body that may move.
    pub fn settle_means(&mut self, twists: &Twists) {
        let closed = self.parts.last.len();
        let mut fluxes = DMatrix::<f64>::zeros(twists.count().max(closed), closed);
        for (&(pool, body), flux) in &self.pools.passages {
            let Some(part) = self.parts.of_cell(self.pools.first[pool]) else { continue };
            let length = flux[0].hypot(flux[1]);
            let mut sums: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
            for (k, flux) in flux.iter().enumerate() {
                for (unknown, a) in twists.of(body, k) {
                    let [sum, size] = sums.entry(unknown).or_default();
                    let least = if k < 2 { length } else { 0.0 };
                    (*sum, *size) = (*sum + a * flux, size.max(a.abs() * flux.abs().max(least)));
                }
            }
            let counts = sums.into_iter().filter(|(_, [sum, size])| sum.abs() > RANK * size);
            counts.for_each(|(unknown, [sum, _])| fluxes[(unknown, part)] += sum);
        }
        self.parts.means = kernel(fluxes);
    }

    /// A pool from which nothing can leave must lose nothing to what is given: nodal velocities at the boundary, and
    /// the motions of bodies.
    ///
    /// # Errors
    /// [`MomentumError::Flux`]
    pub fn check_flux(
        &self,
        loops: &Integrator,
        (space, prescribed): (&Space, &[f64]),
        (motions, twists): (&[[f64; 3]], &Twists),
    ) -> Result<(), MomentumError> {
        let (mesh, count) = (&loops.mesh, self.pools.first.len());
        let outside = loops.outside(&self.cover);
        let (mut fluxes, mut fastest, mut open) = (vec![0.0; count], vec![0.0_f64; count], self.pools.open.clone());
        for (index, face) in mesh.faces.iter().enumerate().filter(|(_, face)| face.plus.is_none()) {
            let cell = face.minus.cell;
            if !self.active[cell] {
                continue;
            }
            let pool = self.pools.of_cell[cell] as usize;
            outside.each_face_point(index, space.degree, &mut |s| {
                let phi = s.minus.table(space.degree).values(s.minus.q);
                let nodal = |i: usize| Point::from([0, 1].map(|c| prescribed[space.dof(cell, c, i)]));
                let v: Point = (0..space.n).map(|i| nodal(i) * phi[i]).sum();
                fluxes[pool] += s.weight * v.dot(&s.n);
                fastest[pool] = fastest[pool].max(v.norm());
            });
        }
        for (&(pool, body), flux) in &self.pools.passages {
            let moves = (0..3).any(|k| twists.of(body, k).any(|_| flux[k] != 0.0));
            open[pool] |= moves;
            fluxes[pool] += (0..3).map(|k| flux[k] * motions[body][k]).sum::<f64>();
            fastest[pool] = fastest[pool].max(motions[body][0].hypot(motions[body][1]));
        }
        let leaks =
            |&pool: &usize| !open[pool] && fluxes[pool].abs() > FLUX * fastest[pool] * self.pools.areas[pool].sqrt();
        match (0..count).find(leaks) {
            None => Ok(()),
            Some(pool) => {
                let x = mesh.centroid(self.pools.first[pool]);
                let part = if count > 1 { format!(" of the fluid at ({:.4}, {:.4})", x.x, x.y) } else { String::new() };
                Err(MomentumError::Flux { flux: fluxes[pool], part })
            }
        }
    }
}

/// An orthonormal basis of what a matrix takes to zero, which has no fewer rows than columns.
fn kernel(matrix: DMatrix<f64>) -> Vec<Vec<f64>> {
    let columns = matrix.ncols();
    let unit = |k: usize| (0..columns).map(|j| f64::from(u8::from(j == k))).collect();
    if columns == 0 || matrix.amax() == 0.0 {
        return (0..columns).map(unit).collect();
    }
    let svd = matrix.svd(false, true);
    let right = svd.v_t.expect("it was asked for");
    let zero = |k: &usize| svd.singular_values[*k] <= RANK * svd.singular_values.max();
    (0..columns).filter(zero).map(|k| right.row(k).iter().copied().collect()).collect()
}

impl Parts {
    /// `open` are cells at whose faces the pressure is fixed.
    fn new(pressure: &Space, active: &[bool], open: &[usize]) -> Self {
        let cells: Vec<usize> = (0..active.len()).filter(|&cell| active[cell]).collect();
        let mut links = Links::new(pressure.dof_count());
        for &cell in &cells {
            (1..pressure.n).for_each(|i| links.join(pressure.dof(cell, 0, 0), pressure.dof(cell, 0, i)));
        }
        let mut is_open = vec![false; pressure.dof_count()];
        open.iter().for_each(|&cell| is_open[links.root(pressure.dof(cell, 0, 0))] = true);
        let (mut number, mut last) = (vec![NONE; pressure.dof_count()], Vec::new());
        let mut of_cell = vec![NONE; active.len()];
        for &cell in &cells {
            let root = links.root(pressure.dof(cell, 0, 0));
            if is_open[root] {
                continue;
            }
            if number[root] == NONE {
                number[root] = last.len() as u32;
                last.push(0);
            }
            of_cell[cell] = number[root];
            let last = &mut last[number[root] as usize];
            *last = (0..pressure.n).map(|i| pressure.dof(cell, 0, i)).fold(*last, usize::max);
        }
        Self { of_cell, last, means: Vec::new() }
    }

    /// The closed part of an active cell.
    pub fn of_cell(&self, cell: usize) -> Option<usize> {
        Some(self.of_cell[cell]).filter(|&part| part != NONE).map(|part| part as usize)
    }
}

impl Pools {
    /// `between` are cells that share a face with fluid, `open` those at whose faces the pressure is fixed.
    fn new(mesh: &Mesh, active: &[bool], between: &[[usize; 2]], open: &[usize]) -> Self {
        let mut links = Links::new(active.len());
        between.iter().for_each(|&[a, b]| links.join(a, b));
        let (mut of_cell, mut first, mut areas) = (vec![NONE; active.len()], Vec::new(), Vec::new());
        for cell in (0..active.len()).filter(|&cell| active[cell]) {
            // the root is the first cell
            let root = links.root(cell);
            if root == cell {
                of_cell[cell] = first.len() as u32;
                first.push(cell);
                areas.push(0.0);
            }
            of_cell[cell] = of_cell[root];
            areas[of_cell[cell] as usize] += mesh.cell_area(cell);
        }
        let mut is_open = vec![false; first.len()];
        open.iter().for_each(|&cell| is_open[of_cell[cell] as usize] = true);
        Self { of_cell, first, areas, open: is_open, passages: BTreeMap::new() }
    }

    fn find_passages(&mut self, loops: &Integrator, surface: &Surface, poses: &[Pose]) {
        let mut sizes: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for cell in surface.cells() {
            let size = (2.0 * loops.mesh.cell_area(cell)).sqrt();
            for body in surface.bodies_of_cell(cell) {
                let key = (self.of_cell[cell] as usize, body);
                let sum = self.passages.entry(key).or_default();
                loops.each_outline_point(surface, (cell, body), 1, &mut |x| {
                    for (k, sum) in sum.iter_mut().enumerate() {
                        *sum += x.weight * x.n.dot(&rigid_motion(k, poses[body].position, x.site.x));
                    }
                });
                let largest = sizes.entry(key).or_default();
                *largest = largest.max(size);
            }
        }
        self.passages.retain(|key, flux| flux[0].hypot(flux[1]) > CLOSED * sizes[key]);
    }
}

/// Sets that are joined; the root of a set is its least member.
struct Links(Vec<usize>);

impl Links {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn root(&mut self, mut member: usize) -> usize {
        while self.0[member] != member {
            self.0[member] = self.0[self.0[member]];
            member = self.0[member];
        }
        member
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}
