//! What a scene on a large mesh takes, known in a time that does not grow with the mesh.
//!
//! Two coarse meshes of the same domain are built, and all that [`memory`](super::memory) counts is counted there.
//! Bytes grow as a power
//! of the number C of cells, about `C^1.2`: fields and blocks with C, factors with `C log C` or more. Unknowns grow
//! as `a C + b √C`, inside
//! and on the boundary.

use std::sync::Arc;

use super::domain::mesh_of;
use crate::mesh::Mesh;
use crate::mesh::generate::MeshScene;
use crate::scene::SceneSource;

/// Meshes of up to so many cells are counted themselves.
pub const COUNTED: f64 = 4000.0;
/// Cells of the two meshes that larger ones are judged by.
const SAMPLES: [f64; 2] = [700.0, 2100.0];
/// Unknowns that are told of a scene.
pub const FIELDS: usize = 4;

/// What is counted on a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Count {
    /// Of the mesh.
    pub cells: f64,
    /// Of the mesh.
    pub faces: f64,
    /// Of the mesh.
    pub vertices: f64,
    /// Of velocity, pressure or density, polarity, and the flow's linear system.
    pub unknowns: [f64; FIELDS],
    /// Largest resident memory of a run.
    pub bytes: f64,
    /// The part of it that every mesh takes.
    pub fixed: f64,
}

impl Count {
    /// What a mesh of so many cells has, given two smaller ones.
    fn extrapolated([a, b]: [Count; 2], cells: f64) -> Self {
        // through both values: q = C (s + t f(C))
        let along = |f: fn(f64) -> f64, [qa, qb]: [f64; 2]| {
            let [ra, rb] = [qa / a.cells, qb / b.cells];
            let slope = (rb - ra) / (f(b.cells) - f(a.cells));
            cells * (ra + slope * (f(cells) - f(a.cells)))
        };
        let border = |x: f64| 1.0 / x.sqrt();
        let power = ((b.bytes - b.fixed) / (a.bytes - a.fixed)).ln() / (b.cells / a.cells).ln();
        let number = |of: fn(&Count) -> f64| along(border, [of(&a), of(&b)]).round();
        Self {
            cells,
            faces: number(|count| count.faces),
            vertices: number(|count| count.vertices),
            unknowns: std::array::from_fn(|k| along(border, [a.unknowns[k], b.unknowns[k]]).round()),
            bytes: b.fixed + (b.bytes - b.fixed) * (cells / b.cells).powf(power),
            fixed: b.fixed,
        }
    }
}

/// Two meshes of different size, and what a scene has on them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Samples([Count; 2]);

impl Samples {
    /// Judges the meshes of a table `[mesh]` of about so many cells by two smaller ones, of which `count` tells what
    /// there is: with
    /// longer cells, or, where so few cells cannot follow the shape, squares. `None` where something fails.
    pub fn new(
        (table, cells): (&MeshScene, f64),
        source: &SceneSource,
        count: impl Fn(&MeshScene, Arc<Mesh>) -> Option<Count>,
    ) -> Option<Self> {
        let counted = |size: f64| {
            let (coarse, mesh) = smaller(table, (cells / size).sqrt(), source).or_else(|| square(size, source))?;
            count(&coarse, Arc::new(mesh))
        };
        let [first, second] = SAMPLES.map(counted);
        Some(Self([first?, second?]))
    }

    /// On a mesh of so many cells.
    pub fn at(&self, cells: f64) -> Count {
        Count::extrapolated(self.0, cells)
    }
}

/// The same domain with cells longer by `ratio`.
pub fn smaller(table: &MeshScene, ratio: f64, source: &SceneSource) -> Option<(MeshScene, Mesh)> {
    let coarse = table.coarser(ratio)?;
    let mesh = mesh_of(&coarse, source).ok()?;
    Some((coarse, mesh))
}

fn square(cells: f64, source: &SceneSource) -> Option<(MeshScene, Mesh)> {
    let n = (0.5 * cells).sqrt().round() as usize;
    let table = MeshScene::of("square").with("n", n);
    let mesh = mesh_of(&table, source).ok()?;
    Some((table, mesh))
}
