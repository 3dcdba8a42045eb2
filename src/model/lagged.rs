//! The whole coupled matrix of one step, factorised: velocity, pressure and polarity, with the molecular field
//! eliminated cell by cell.
//!
//! ```text
//! [ K    G    −F′   ]        rows: momentum, volume, polarity
//! [ Gᵀ   0     0    ]        F′ = F_p + F_L M⁻¹ Λ′
//! [ D    0    J_pp  ]
//! ```
//! Unknowns are numbered `û | Π | λ | p`, where λ has a multiplier of the pressure's zero mean for every closed part
//! of the domain. The energy-consistent force couples cells two faces apart; these factors take the local force in
//! its stead, which is close enough for a preconditioner. Of other forces they have all but what those see two faces
//! away.

mod parts;

use std::collections::BTreeSet;
use std::sync::{Arc, OnceLock};

pub use self::parts::Parts;
use super::closed::ClosedParts;
use super::condensed::Eliminated;
use super::frames::Frames;
use crate::solve::SolveError;
use crate::solve::blocks::{NONE, Neighbours};
use crate::solve::dissection::{Group, LEAF, LateGroup, dissect};
use crate::solve::multifrontal::{Multifrontal, Precision};
use crate::solve::symbolic::{Element, Symbolic};
use crate::space::{Skeleton, Space};

/// Factors with more entries outgrow the caches of most machines.
const LARGE: usize = 1 << 20;

/// How the unknowns of the coupled matrix hang together: made once for a model, shared by all factorisations.
#[derive(Debug, Clone)]
pub struct Structure {
    /// The order of elimination, and where the factors have entries.
    pub symbolic: Arc<Symbolic>,
    /// Where the polarity begins.
    first: usize,
}

/// A structure that is found when somebody first asks for it.
#[derive(Debug, Default)]
pub struct Found(OnceLock<Structure>);

impl Found {
    /// The structure of the coupled matrix.
    ///
    /// # Errors
    /// As [`Structure::new`].
    pub fn of(&self, layout: &Layout) -> Result<&Structure, SolveError> {
        if self.0.get().is_none() {
            self.know(Structure::new("coupled", layout)?);
        }
        Ok(self.0.get().expect("just found"))
    }

    /// What is known already.
    pub fn known(&self) -> Option<&Structure> {
        self.0.get()
    }

    /// Keeps a structure that was found from the same layout; a later one changes nothing.
    pub fn know(&self, structure: Structure) {
        // whoever was first has found the same
        let _ = self.0.set(structure);
    }
}

/// Factors of the coupled matrix at one state.
#[derive(Debug)]
pub struct Lagged {
    factors: Factors,
    first: usize,
    /// Where the polarities of the cells are not in the matrix.
    eliminated: Option<Arc<Eliminated>>,
}

#[derive(Debug)]
enum Factors {
    Single(Multifrontal<f32>),
    Double(Multifrontal<f64>),
}

impl Structure {
    /// Nested dissection of the mesh: the polarity of a cell and the velocities of a node stay together, pressures come
    /// after the velocities around them.
    ///
    /// # Errors
    /// A structure that contradicts itself.
    pub fn new(name: &str, layout: &Layout) -> Result<Self, SolveError> {
        let first = layout.first();
        let size = first + layout.carried_count();
        // the constant pressures are settled at the very end, together with the multipliers of the means
        let constants = layout.closed.last().iter().map(|&dof| (layout.frames.free + dof) as u32);
        let last: Vec<u32> = constants.chain((first - layout.closed.count()) as u32..first as u32).collect();
        let (groups, adjacency, late) = layout.groups();
        let tree = dissect(&groups, &adjacency, &late, &last, LEAF);
        let cells = layout.velocity.mesh.cells.len();
        let pattern = |e: usize, element: &mut Element| {
            if e < cells {
                layout.unknowns(e, element);
            } else {
                layout.mean_unknowns(e - cells, element);
            }
        };
        // the multipliers' rows are elements of their own: they are eliminated last, and the cells' elements need not
        // wait for them
        let elements = cells + layout.closed.cells().len();
        let symbolic = Symbolic::new(name, size, &tree, elements, pattern)?;
        Ok(Self { symbolic: Arc::new(symbolic), first })
    }

    /// What preconditioners are kept in: where they are large, memory is what solving with them waits for.
    pub fn precision(&self) -> Precision {
        if self.symbolic.factor_entries() < LARGE { Precision::Double } else { Precision::Single }
    }

    /// Bytes of the factors.
    pub fn bytes(&self, precision: Precision) -> usize {
        precision.bytes() * self.symbolic.factor_entries()
    }

    /// Bytes that making them on so many threads takes at most besides; elements are in double precision.
    pub fn room(&self, threads: usize, precision: Precision) -> usize {
        precision.bytes() * self.symbolic.stack_entries(threads) + 8 * self.symbolic.waiting_entries()
    }
}

impl Lagged {
    /// Factorises the derivative.
    ///
    /// # Errors
    /// A singular matrix.
    pub fn new(structure: &Structure, elements: &dyn Elements, precision: Precision) -> Result<Self, SolveError> {
        let (symbolic, fill) = (structure.symbolic.clone(), |e: usize, out: &mut Element| elements.fill(e, out));
        let factors = match precision {
            Precision::Single => Factors::Single(Multifrontal::new(symbolic, fill)?),
            Precision::Double => Factors::Double(Multifrontal::new(symbolic, fill)?),
        };
        Ok(Self { factors, first: structure.first, eliminated: elements.eliminated() })
    }

    /// What its numbers are kept in.
    pub fn precision(&self) -> Precision {
        match &self.factors {
            Factors::Single(_) => Precision::Single,
            Factors::Double(_) => Precision::Double,
        }
    }

    /// Factorises another derivative in the memory of this one; after an error, the factors are of no use.
    ///
    /// # Errors
    /// A singular matrix.
    pub fn renew(&mut self, elements: &dyn Elements) -> Result<(), SolveError> {
        let fill = |e: usize, out: &mut Element| elements.fill(e, out);
        self.eliminated = elements.eliminated();
        match &mut self.factors {
            Factors::Single(factors) => factors.refactor(fill),
            Factors::Double(factors) => factors.refactor(fill),
        }
    }

    /// Overwrites the right side for the free velocities alone by the solution, where nothing else is in the matrix.
    pub fn solve_flow(&self, free: &mut [f64]) {
        self.solve_all(free);
    }

    /// Overwrites a right side for all unknowns of the matrix by the solution.
    pub fn solve_all(&self, x: &mut [f64]) {
        match &self.factors {
            Factors::Single(factors) => factors.solve_in_place(x),
            Factors::Double(factors) => factors.solve_in_place(x),
        }
    }

    /// Overwrites the residual of what is carried by the carried part of `A⁻¹ (0, 0, r)`.
    pub fn solve(&self, r: &mut [f64]) {
        if let Some(eliminated) = &self.eliminated {
            let mut c = eliminated.forward(r);
            self.solve_all(&mut c);
            eliminated.backward(&c, r);
            return;
        }
        let mut x = vec![0.0; self.first];
        x.extend_from_slice(r);
        self.solve_all(&mut x);
        r.copy_from_slice(&x[self.first..]);
    }
}

/// The dense blocks that a coupled matrix is the sum of.
pub trait Elements: Sync {
    /// The element of number `e`: its unknowns as [`Layout`] numbers them, and its values.
    fn fill(&self, e: usize, out: &mut Element);

    /// How the polarities of the cells follow, where they are not in the matrix.
    fn eliminated(&self) -> Option<Arc<Eliminated>> {
        None
    }
}

impl<E: Elements + ?Sized> Elements for &E {
    fn fill(&self, e: usize, out: &mut Element) {
        (**self).fill(e, out);
    }

    fn eliminated(&self) -> Option<Arc<Eliminated>> {
        (**self).eliminated()
    }
}

/// Adds a block of velocity dofs to an element, in terms of the free unknowns.
pub(super) fn add_velocity_block(block: &[f64], places: &[Vec<(usize, f64)>], columns: usize, values: &mut [f64]) {
    for (row, block) in places.iter().zip(block.chunks_exact(places.len())) {
        for (column, k) in places.iter().zip(block) {
            for (r, a) in row {
                for (c, b) in column {
                    values[r * columns + c] += a * k * b;
                }
            }
        }
    }
}

/// Which unknowns belong to which cell and node: all that the structure depends on.
#[derive(Debug, Clone, Copy)]
pub struct Layout<'m> {
    /// The space of v.
    pub velocity: &'m Space,
    /// The space of Π, where there is one.
    pub pressure: Option<&'m Space>,
    /// Discontinuous fields that the flow carries: density and polarity, one after the other in a cell and among all
    /// unknowns.
    pub carried: [Option<&'m Space>; 2],
    /// The traces of a polarity in hybrid form, which are unknowns in its stead: it is eliminated in its cells.
    pub traces: Option<&'m Skeleton>,
    /// Where `v·n` is an unknown of its own.
    pub frames: &'m Frames,
    /// The parts in which the pressure has a multiplier of its mean.
    pub closed: &'m ClosedParts,
    /// Cells next to each cell.
    pub neighbours: &'m Neighbours,
}

impl Layout<'_> {
    /// Where the carried fields begin: after the free velocities, the pressures and the multipliers.
    pub fn first(&self) -> usize {
        self.frames.free + self.pressure.map_or(0, Space::dof_count) + self.closed.count()
    }

    /// Unknowns of the carried fields, or of the traces in their stead.
    pub fn carried_count(&self) -> usize {
        self.first_trace() - self.first() + self.traces.map_or(0, Skeleton::dof_count)
    }

    /// The carried fields that are unknowns of the matrix.
    fn kept(&self) -> [Option<&Space>; 2] {
        match self.traces {
            None => self.carried,
            Some(_) => [self.carried[0], None],
        }
    }

    /// Where the traces begin.
    fn first_trace(&self) -> usize {
        self.first() + self.kept().iter().flatten().map(|space| space.dof_count()).sum::<usize>()
    }

    /// Unknowns of the traces on the inner faces of a cell.
    fn traces_of(&self, cell: usize) -> impl Iterator<Item = u32> {
        let first = self.first_trace();
        self.traces.into_iter().flat_map(move |skeleton| {
            let count = skeleton.face_dof_count();
            skeleton
                .of_cell(cell)
                .into_iter()
                .flatten()
                .flat_map(move |begin| (first + begin) as u32..(first + begin + count) as u32)
        })
    }

    /// Unknowns of the carried fields on a cell.
    pub fn block(&self, cell: usize) -> impl Iterator<Item = u32> {
        let mut first = self.first();
        let mut ranges = [0..0, 0..0];
        for (range, space) in ranges.iter_mut().zip(self.kept().into_iter().flatten()) {
            let n = space.cell_dof_count();
            *range = (first + cell * n) as u32..(first + (cell + 1) * n) as u32;
            first += space.dof_count();
        }
        ranges.into_iter().flatten()
    }

    /// Rows and columns of the mean's element of the k-th cell of closed parts: its pressures and the multiplier.
    /// Returns the cell.
    pub(super) fn mean_unknowns(&self, k: usize, out: &mut Element) -> usize {
        let cell = self.closed.cells()[k] as usize;
        let part = self.closed.of_cell(cell).expect("the cell of a closed part");
        out.rows.clear();
        out.rows.extend(self.pressures(cell));
        out.rows.push((self.first() - self.closed.count() + part) as u32);
        out.columns.clone_from(&out.rows);
        cell
    }

    /// `λ ∫ ξ` and its transposed on the k-th cell of closed parts; `means` are the `∫ ξ` of all cells.
    pub(super) fn fill_mean(&self, k: usize, means: &[f64], out: &mut Element) {
        let cell = self.mean_unknowns(k, out);
        let np = out.rows.len() - 1;
        out.values.clear();
        out.values.resize((np + 1) * (np + 1), 0.0);
        for (j, mean) in means[cell * np..(cell + 1) * np].iter().enumerate() {
            out.values[j * (np + 1) + np] = *mean;
            out.values[np * (np + 1) + j] = *mean;
        }
    }

    /// Unknowns of the pressure on a cell.
    pub fn pressures(&self, cell: usize) -> impl Iterator<Item = u32> {
        let free = self.frames.free;
        self.pressure
            .into_iter()
            .flat_map(move |space| (0..space.n).map(move |i| (free + space.dof(cell, 0, i)) as u32))
    }

    /// Rows and columns of a cell's element: its free velocities, pressures, carried fields and traces; columns also the
    /// carried fields of its neighbours. Returns, for every velocity dof of the cell, its places among the rows with
    /// coefficients.
    pub fn unknowns(&self, cell: usize, out: &mut Element) -> Vec<Vec<(usize, f64)>> {
        let velocity = self.velocity;
        let rows = &mut out.rows;
        rows.clear();
        let mut places = Vec::with_capacity(velocity.cell_dof_count());
        for k in 0..velocity.cell_dof_count() {
            let entries = self.frames.of(velocity.dof(cell, k / velocity.n, k % velocity.n));
            let mut place = |free: usize| {
                rows.iter().position(|&u| u == free as u32).unwrap_or_else(|| {
                    rows.push(free as u32);
                    rows.len() - 1
                })
            };
            places.push(entries.map(|(free, a)| (place(free), a)).collect());
        }
        rows.extend(self.pressures(cell));
        rows.extend(self.block(cell));
        rows.extend(self.traces_of(cell));
        out.columns.clear();
        out.columns.extend_from_slice(&out.rows);
        for other in self.neighbours[cell].into_iter().filter(|&o| o != NONE) {
            out.columns.extend(self.block(other));
        }
        places
    }

    /// One group for every cell's carried fields, every face's traces and every velocity node, and who couples to whom;
    /// pressures come late.
    fn groups(&self) -> (Vec<Group>, Vec<Vec<u32>>, Vec<LateGroup>) {
        let (velocity, pressure) = (self.velocity, self.pressure);
        let (mesh, neighbours) = (&velocity.mesh, self.neighbours);
        let cells = if self.kept().iter().any(Option::is_some) { mesh.cells.len() } else { 0 };
        let mut groups: Vec<Group> = (0..cells)
            .map(|cell| Group { unknowns: self.block(cell).collect(), position: mesh.centroid(cell).into() })
            .collect();
        groups.extend(self.face_groups());
        let first_node = groups.len() as u32;
        groups.extend(velocity.node_positions().iter().enumerate().map(|(node, x)| Group {
            unknowns: self.frames.owned(node).map(|u| u as u32).collect(),
            position: (*x).into(),
        }));
        let mut adjacency = vec![BTreeSet::new(); groups.len()];
        let mut around = vec![BTreeSet::new(); pressure.map_or(0, |space| space.node_count)];
        for cell in 0..mesh.cells.len() {
            let nodes: Vec<u32> = velocity.cell_nodes(cell).iter().map(|node| node + first_node).collect();
            let faces = mesh.cell_faces[cell].into_iter();
            let traces = faces.filter_map(|face| Some((cells + self.traces?.place(face)?) as u32));
            let own: Vec<u32> = (0..cells.min(1)).map(|_| cell as u32).chain(traces).collect();
            let others = neighbours[cell].into_iter().filter(|&o| o != NONE && o < cells).map(|o| o as u32);
            let seen: Vec<u32> = own.iter().copied().chain(others).collect();
            for &a in nodes.iter().chain(&own) {
                for &b in nodes.iter().chain(&seen) {
                    if a != b {
                        adjacency[a as usize].insert(b);
                        adjacency[b as usize].insert(a);
                    }
                }
            }
            for &node in pressure.iter().flat_map(|space| space.cell_nodes(cell)) {
                around[node as usize].extend(nodes.iter().copied());
            }
        }
        let late = |(node, around): (usize, BTreeSet<u32>)| LateGroup {
            unknowns: vec![(self.frames.free + node) as u32],
            neighbours: around.into_iter().collect(),
        };
        let adjacency = adjacency.into_iter().map(|set| set.into_iter().collect()).collect();
        (groups, adjacency, around.into_iter().enumerate().map(late).collect())
    }

    /// The traces of every inner face.
    fn face_groups(&self) -> impl Iterator<Item = Group> {
        let first = self.first_trace();
        self.traces.into_iter().flat_map(move |skeleton| {
            let count = skeleton.face_dof_count();
            skeleton.faces.iter().enumerate().map(move |(place, &face)| Group {
                unknowns: ((first + place * count) as u32..(first + (place + 1) * count) as u32).collect(),
                position: skeleton.mesh.midpoint(face as usize).into(),
            })
        })
    }
}
