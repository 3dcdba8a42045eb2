//! The velocities on which the penalty vanishes: rigid motions of bodies, as unknowns of their own.
//!
//! The penalty grows without bounds, like 1/ε, in the cells that a body fills; in those that it cuts it is bounded and
//! does no harm. Cells that a body fills and that hang together by edges are a patch: the penalty vanishes for nodal
//! fields that are rigid on it. A body without such cells has no patch; one whose cells meet in a vertex alone has
//! several, which that vertex joins like a hinge. Where patches share nodes the motions agree there; where conditions
//! prescribe a velocity, they follow it. With these fields as unknowns in exchange for as many nodal ones (the
//! exchanged dofs), 1/ε multiplies what is small of order ε alone, and rounding of 1/ε never meets the balance of
//! forces.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector, Matrix2, SVD};

use super::penalty::{BodyError, Immersion};
use crate::mesh::Point;
use crate::model::frames::Frames;
use crate::shape::rigid_motion;

/// Singular values below this, relative to the largest one, are zero.
const RANK: f64 = 1e-9;
/// Largest misfit of prescribed velocities, relative to the largest one, that counts as rounding.
const MISFIT: f64 = 1e-7;
/// Cells with this share of the area of a body's best cell can have exchanged dofs.
const STRONG: f64 = 0.3;

/// A nodal field in terms of free unknowns.
pub type Sparse = Vec<(usize, f64)>;

/// Cells of a body that hang together, all filled by it.
#[derive(Debug, Clone)]
struct Patch {
    body: usize,
    cells: Vec<usize>,
    /// Ascending.
    nodes: Vec<usize>,
    /// Largest distance of a node from the body's centre.
    reach: f64,
}

/// Patches that share nodes, and the conditions on their rigid motions.
#[derive(Debug, Clone)]
struct Cluster {
    patches: Vec<usize>,
    /// Node and direction in which it is prescribed; `None` for a node of two patches, whose row holds 0.
    rows: Vec<Option<(usize, Point)>>,
    /// Of the conditions, one per row, on the coefficients of the patches' motions.
    conditions: Option<SVD<f64, nalgebra::Dyn, nalgebra::Dyn>>,
    matrix: DMatrix<f64>,
}

/// Rigid motions that the conditions leave free.
#[derive(Debug, Clone)]
pub struct Kernel {
    /// Fields of the free motions, by free unknown, ascending.
    pub fields: Vec<Sparse>,
    /// As many free unknowns, ascending, whose nodal functions the fields replace.
    pub exchanged: Vec<usize>,
    patches: Vec<Patch>,
    clusters: Vec<Cluster>,
}

impl Kernel {
    /// The motions of bodies.
    ///
    /// # Errors
    /// Nodes that have no components of their own.
    pub fn new(immersion: &Immersion, frames: &Frames) -> Result<Self, BodyError> {
        let patches = (0..immersion.parts.len()).flat_map(|body| patches(immersion, body)).collect();
        let mut kernel = Self { fields: Vec::new(), exchanged: Vec::new(), patches, clusters: Vec::new() };
        let owners = kernel.owners();
        for patches in clusters(kernel.patches.len(), &owners) {
            let cluster = kernel.cluster(immersion, frames, patches, &owners)?;
            let fields: Vec<Sparse> =
                cluster.free_motions().iter().map(|c| kernel.field(immersion, frames, &cluster.patches, c)).collect();
            let exchanged = kernel.exchanged_by(immersion, frames, &cluster.patches, &fields);
            kernel.fields.extend(fields);
            kernel.exchanged.extend(exchanged);
            kernel.clusters.push(cluster);
        }
        kernel.exchanged.sort_unstable();
        Ok(kernel)
    }

    /// Whether the penalty of a body is without bounds somewhere.
    pub fn has_patch(&self, body: usize) -> bool {
        self.patches.iter().any(|patch| patch.body == body)
    }

    /// The rigid motion `k` of a patch at a node; rotations have the size of translations at the patch's rim.
    fn motion(&self, immersion: &Immersion, patch: usize, k: usize, node: usize) -> Point {
        let Patch { body, reach, .. } = self.patches[patch];
        let scale = if k == 2 { 1.0 / reach } else { 1.0 };
        rigid_motion(k, immersion.poses[body].position, immersion.positions()[node]) * scale
    }

    /// The patches that hold a node.
    fn owners(&self) -> BTreeMap<usize, Vec<usize>> {
        let mut owners: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (index, patch) in self.patches.iter().enumerate() {
            patch.nodes.iter().for_each(|&node| owners.entry(node).or_default().push(index));
        }
        owners
    }

    fn cluster(
        &self,
        immersion: &Immersion,
        frames: &Frames,
        patches: Vec<usize>,
        owners: &BTreeMap<usize, Vec<usize>>,
    ) -> Result<Cluster, BodyError> {
        let (mut rows, mut entries) = (Vec::new(), Vec::new());
        let column = |patch: usize| 3 * patches.iter().position(|&p| p == patch).expect("a patch of the cluster");
        let nodes: BTreeSet<usize> = patches.iter().flat_map(|&p| &self.patches[p].nodes).copied().collect();
        for node in nodes {
            let here = &owners[&node];
            for pair in here.windows(2) {
                for c in 0..2 {
                    let row = pair.iter().zip([1.0, -1.0]).flat_map(|(&patch, sign)| {
                        (0..3).map(move |k| (column(patch) + k, sign * self.motion(immersion, patch, k, node)[c]))
                    });
                    entries.push(row.collect::<Vec<_>>());
                    rows.push(None);
                }
            }
            let patch = here[0];
            let bent = || BodyError::Bent { body: immersion.names[self.patches[patch].body].clone() };
            for direction in prescribed_directions(frames, node).ok_or_else(bent)? {
                let row = (0..3).map(|k| (column(patch) + k, self.motion(immersion, patch, k, node).dot(&direction)));
                entries.push(row.collect());
                rows.push(Some((node, direction)));
            }
        }
        let columns = 3 * patches.len();
        // as many rows as columns at least, so that the decomposition has all right singular vectors
        let mut matrix = DMatrix::zeros(rows.len().max(columns), columns);
        entries.iter().enumerate().for_each(|(i, row)| row.iter().for_each(|&(j, value)| matrix[(i, j)] += value));
        let conditions = (!rows.is_empty()).then(|| matrix.clone().svd(true, true));
        Ok(Cluster { patches, rows, conditions, matrix })
    }

    /// A nodal field that is rigid on the patches, in terms of the free unknowns: `Tᵀ r`.
    fn field(&self, immersion: &Immersion, frames: &Frames, patches: &[usize], coefficients: &DVector<f64>) -> Sparse {
        let mut field = BTreeMap::new();
        for (&patch, c) in patches.iter().zip(coefficients.as_slice().chunks_exact(3)) {
            if c.iter().all(|c| *c == 0.0) {
                continue;
            }
            for &node in &self.patches[patch].nodes {
                let r: Point = (0..3).map(|k| self.motion(immersion, patch, k, node) * c[k]).sum();
                field.extend(frames.owned(node).map(|unknown| (unknown, 0.0)));
                for component in 0..2 {
                    for (unknown, a) in frames.of(2 * node + component) {
                        *field.get_mut(&unknown).expect("nodes of patches own their unknowns") += a * r[component];
                    }
                }
            }
        }
        field.into_iter().filter(|(_, value)| *value != 0.0).collect()
    }

    /// Free unknowns on which the fields are independent, by elimination with the largest pivots, from cells that the
    /// bodies fill well.
    fn exchanged_by(&self, immersion: &Immersion, frames: &Frames, patches: &[usize], fields: &[Sparse]) -> Vec<usize> {
        let mut candidates = BTreeSet::new();
        for patch in patches.iter().map(|&patch| &self.patches[patch]) {
            let area = |cell: &usize| immersion.parts[patch.body][cell].area;
            let best = patch.cells.iter().map(area).fold(0.0, f64::max);
            for &cell in patch.cells.iter().filter(|cell| area(cell) >= STRONG * best) {
                let nodes = immersion.velocity.cell_nodes(cell);
                candidates.extend(nodes.iter().flat_map(|&node| frames.owned(node as usize)));
            }
        }
        let values = |unknown: usize| -> Vec<f64> {
            let at = |field: &Sparse| field.binary_search_by_key(&unknown, |(u, _)| *u).map_or(0.0, |i| field[i].1);
            fields.iter().map(at).collect()
        };
        let rows: Vec<(usize, Vec<f64>)> = candidates.iter().map(|&u| (u, values(u))).collect();
        eliminate(rows, fields.len())
    }

    /// A field that is rigid on the patches and follows the prescribed velocities `v_D` of nodes there, by free
    /// unknown.
    ///
    /// # Errors
    /// Prescribed velocities that no rigid motion has.
    pub fn lift(&self, immersion: &Immersion, frames: &Frames, prescribed: &[f64]) -> Result<Sparse, BodyError> {
        let mut lift = Vec::new();
        for cluster in &self.clusters {
            let Some(svd) = &cluster.conditions else { continue };
            let value = |row: &Option<(usize, Point)>| {
                row.map_or(0.0, |(node, d)| d.dot(&Point::new(prescribed[2 * node], prescribed[2 * node + 1])))
            };
            let mut right = DVector::zeros(cluster.matrix.nrows());
            right.iter_mut().zip(&cluster.rows).for_each(|(g, row)| *g = value(row));
            let largest = right.amax();
            if largest == 0.0 {
                continue;
            }
            let c = svd.solve(&right, RANK * svd.singular_values.max()).expect("both factors were asked for");
            let misfit = (&cluster.matrix * &c - right).amax() / largest;
            if misfit > MISFIT {
                let body = immersion.names[self.patches[cluster.patches[0]].body].clone();
                return Err(BodyError::Wall { body, misfit });
            }
            lift.extend(self.field(immersion, frames, &cluster.patches, &c));
        }
        Ok(lift)
    }
}

impl Cluster {
    /// Coefficients of motions that meet the conditions.
    fn free_motions(&self) -> Vec<DVector<f64>> {
        let columns = 3 * self.patches.len();
        let Some(svd) = &self.conditions else {
            return (0..columns).map(|k| DVector::from_fn(columns, |i, _| f64::from(u8::from(i == k)))).collect();
        };
        let right = svd.v_t.as_ref().expect("it was asked for");
        let bound = RANK * svd.singular_values.max();
        (0..columns).filter(|&k| svd.singular_values[k] <= bound).map(|k| right.row(k).transpose()).collect()
    }
}

/// The cells that a body fills, in groups that hang together by edges.
fn patches(immersion: &Immersion, body: usize) -> Vec<Patch> {
    let (space, centre) = (&*immersion.velocity, immersion.poses[body].position);
    let mut left: BTreeSet<usize> =
        immersion.parts[body].iter().filter(|(_, part)| part.rigid).map(|(&cell, _)| cell).collect();
    let mut found = Vec::new();
    while let Some(first) = left.pop_first() {
        let mut cells = vec![first];
        let mut next = 0;
        while next < cells.len() {
            for &face in &space.mesh.cell_faces[cells[next]] {
                let face = &space.mesh.faces[face];
                let sides = std::iter::once(face.minus).chain(face.plus).map(|side| side.cell);
                cells.extend(sides.filter(|cell| left.remove(cell)));
            }
            next += 1;
        }
        cells.sort_unstable();
        let nodes: BTreeSet<usize> =
            cells.iter().flat_map(|&cell| space.cell_nodes(cell)).map(|&node| node as usize).collect();
        let reach = nodes.iter().map(|&n| (immersion.positions()[n] - centre).norm()).fold(0.0, f64::max);
        found.push(Patch { body, cells, nodes: nodes.into_iter().collect(), reach });
    }
    found
}

/// Groups of patches that are linked by shared nodes, each ascending.
fn clusters(patches: usize, owners: &BTreeMap<usize, Vec<usize>>) -> Vec<Vec<usize>> {
    let mut parent: Vec<usize> = (0..patches).collect();
    fn root(parent: &[usize], mut patch: usize) -> usize {
        while parent[patch] != patch {
            patch = parent[patch];
        }
        patch
    }
    for here in owners.values() {
        for pair in here.windows(2) {
            let (a, b) = (root(&parent, pair[0]), root(&parent, pair[1]));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    (0..patches).for_each(|patch| groups.entry(root(&parent, patch)).or_default().push(patch));
    groups.into_values().collect()
}

/// Unit vectors along which the velocity of a node is prescribed; `None` for a node whose components are not its own.
pub fn prescribed_directions(frames: &Frames, node: usize) -> Option<Vec<Point>> {
    let owned = frames.owned(node);
    let mut free = Matrix2::zeros();
    for component in 0..2 {
        for (unknown, a) in frames.of(2 * node + component) {
            if !owned.contains(&unknown) {
                return None;
            }
            free[(component, unknown - owned.start)] = a;
        }
    }
    Some(match owned.len() {
        0 => vec![Point::x(), Point::y()],
        1 => vec![Point::new(-free[(1, 0)], free[(0, 0)])],
        _ => Vec::new(),
    })
}

/// The rows of a Gauss elimination with the largest pivots.
fn eliminate(mut rows: Vec<(usize, Vec<f64>)>, columns: usize) -> Vec<usize> {
    let mut taken = Vec::new();
    for _ in 0..columns.min(rows.len()) {
        let (mut best, mut at) = (0.0, (0, 0));
        for (i, (_, row)) in rows.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                if value.abs() > best {
                    (best, at) = (value.abs(), (i, j));
                }
            }
        }
        if best == 0.0 {
            break;
        }
        let (unknown, pivot) = rows.swap_remove(at.0);
        for (_, row) in &mut rows {
            let factor = row[at.1] / pivot[at.1];
            row.iter_mut().zip(&pivot).for_each(|(value, p)| *value -= factor * p);
            row[at.1] = 0.0;
        }
        taken.push(unknown);
    }
    taken
}
