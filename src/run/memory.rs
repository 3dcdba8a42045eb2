//! The memory of a computation, known before it is taken.
//!
//! The blocks of the coupled matrix and its factors are counted. The Stokes part is estimated from the sparsity of
//! its matrix, with
//! factors that were measured on strips, discs and squares of 500 to 9000 cells: with k = 1 and 2, the estimate lies
//! between 5 percent
//! below and 15 percent above the largest resident memory on Linux.
//!
//! Not counted is what only a run in trouble takes: the direct solution of a small polarity system whose iteration
//! stalled.

use std::sync::Arc;

use super::RunError;
use super::cuts;
use super::forecast::{Count, Samples};
use super::setup::describe;
use crate::form::Faces;
use crate::form::words::Vector;
use crate::measure::Strain;
use crate::measure::fields::Tool;
use crate::mesh::Mesh;
use crate::model::closed::ClosedParts;
use crate::model::frames::Frames;
use crate::model::incompressible::Description;
use crate::model::lagged::{Layout, Structure};
use crate::model::parameters::{ElasticForce, ModelKind};
use crate::model::terms::{MOLECULAR, MOMENTUM, POLARITY, Sum, Term};
use crate::scene::{Cut, Initial, Scene, What};
use crate::solve::SolveError;
use crate::solve::blocks::{Neighbours, neighbours};
use crate::solve::multifrontal::Precision;
use crate::solve::sparse::factor_bound;
use crate::space::{Continuity, Skeleton, Space};
use crate::steady::{SteadySettings, Want, spectrum};
use crate::time::CouplingKind;

/// Bytes of a number.
const NUMBER: f64 = 8.0;
/// Bytes of a MiB.
pub const MIB: f64 = 1024.0 * 1024.0;

/// Bytes of the program and of its tables.
const PROGRAM: f64 = 8.5 * MIB;
/// Bytes that every thread takes for the products of dense blocks.
const KERNELS: f64 = 6.0 * MIB;
/// Bytes of the momentum balance per entry of R in `S = QR`, the Stokes matrix S: factors, and what their
/// factorisation holds.
const STOKES: f64 = 27.0;
/// Those of them that are free again after the factorisation.
const FREED: f64 = 10.0;
/// Bytes of the momentum balance per entry of the cells' blocks: lists of entries on the way to sparse matrices.
const BLOCKS: f64 = 130.0;
/// Bytes of the aligned start per entry of R of its matrix, and per entry of its cells' blocks.
const ALIGNED: [f64; 2] = [7.5, 40.0];
/// Bytes of the stream function per entry of R of the Stokes matrix.
const STREAM: f64 = 1.5;
/// Share of a fixed point's own memory that finds no room in what the Stokes factorisation has freed.
const FIXED_POINT: f64 = 0.15;
/// Bytes of drawing curves, and of drawing maps: pixels, the encoded picture, tables.
const PICTURES: [f64; 2] = [19.0 * MIB, 32.0 * MIB];
/// Bytes of a row of a section's table: only those of one batch are held.
const ROW: f64 = 250.0;
/// For whatever is small.
const MARGIN: f64 = 1.03;
/// Vectors that GMRES usually holds.
const KRYLOV: usize = 40;

/// Spaces and frames of a scene: what its unknowns are, before anything is assembled.
#[derive(Debug)]
pub struct Unknowns {
    /// The space of v.
    pub velocity: Space,
    /// Of pressure or density.
    pub volume: Space,
    /// The space of p.
    pub polarity: Space,
    /// Its traces in hybrid form.
    traces: Option<Skeleton>,
    /// Where `v·n` is an unknown of its own.
    pub frames: Frames,
    kind: ModelKind,
    closed: ClosedParts,
    neighbours: Neighbours,
}

/// What is held at one time besides the model.
#[derive(Debug, Clone, Copy)]
pub enum Work<'s> {
    /// The polarity's operator, its incomplete factors, and so many vectors.
    Apart {
        /// Vectors that are kept beside the factors.
        vectors: usize,
    },
    /// Derivative and factors of the whole coupled matrix, and so many vectors of the polarity's size.
    Coupled {
        /// Of the coupled matrix.
        structure: &'s Structure,
        /// What the factors are kept in.
        precision: Precision,
        /// Vectors that are kept beside the factors.
        vectors: usize,
    },
}

/// The memory of a scene, and what was found on the way to it.
#[derive(Debug)]
pub struct Need {
    /// Largest resident memory.
    pub bytes: f64,
    /// That of the coupled matrix, where the scene uses it.
    pub structure: Option<Structure>,
}

impl Unknowns {
    /// Numbers the unknowns of a scene on its mesh.
    pub fn new(scene: &Scene, mesh: &Arc<Mesh>, description: &Description) -> Self {
        let velocity = Space::new(mesh, Continuity::Continuous, scene.space.velocity, 2);
        let frames = Frames::new(&velocity, &description.conditions, scene.space.slip.points());
        let kind = scene.parameters.kind();
        let (volume, closed) = match kind {
            ModelKind::Incompressible => {
                let pressure = Space::new(mesh, Continuity::Continuous, scene.space.pressure, 1);
                let closed = ClosedParts::new(&pressure, &description.conditions);
                (pressure, closed)
            }
            ModelKind::Compressible => {
                (Space::new(mesh, Continuity::Discontinuous, scene.space.density, 1), ClosedParts::default())
            }
        };
        let hybrid = scene.parameters.is_hybrid() && scene.bodies.is_none();
        Self {
            traces: hybrid.then(|| Skeleton::new(mesh, scene.space.polarity)),
            volume,
            kind,
            polarity: Space::new(mesh, Continuity::Discontinuous, scene.space.polarity, 2),
            frames,
            closed,
            neighbours: neighbours(mesh),
            velocity,
        }
    }

    /// Of velocity, pressure or density, polarity, and the flow's linear system.
    pub fn counts(&self) -> [f64; 4] {
        let Self { velocity, volume, polarity, .. } = self;
        [velocity.dof_count(), volume.dof_count(), polarity.dof_count(), self.layout().first()].map(|n| n as f64)
    }

    /// How they hang together.
    pub fn layout(&self) -> Layout<'_> {
        let (pressure, density) = match self.kind {
            ModelKind::Incompressible => (Some(&self.volume), None),
            ModelKind::Compressible => (None, Some(&self.volume)),
        };
        Layout {
            velocity: &self.velocity,
            pressure,
            carried: [density, Some(&self.polarity)],
            traces: self.traces.as_ref(),
            frames: &self.frames,
            closed: &self.closed,
            neighbours: &self.neighbours,
        }
    }
}

/// Bytes that a scene's model and some work take at most at one time, the program included.
pub fn memory_of(scene: &Scene, layout: &Layout, work: Work) -> f64 {
    let r = factor_bound(&stokes_pattern(layout)) as f64;
    let cells = layout.velocity.mesh.cells.len() as f64;
    let rows = layout.velocity.cell_dof_count() as f64;
    let streams = scene.outputs.iter().any(|output| output.what.takes(Tool::StreamFunction));
    let stream = if streams { STREAM * r } else { 0.0 };
    let model = PROGRAM + STOKES * r + BLOCKS * cells * rows * rows;
    let start = match scene.initial {
        Initial::AlignedAroundDisc => aligned(layout, r),
        Initial::Circulating | Initial::Exact | Initial::Expressions(_) | Initial::Random { .. } | Initial::File(_) => {
            0.0
        }
    };
    MARGIN * (model + start.max(stream + work.bytes(scene, layout)))
}

/// Bytes that a Stokes flow takes at most at one time, the program and pictures included.
pub fn of_flow(velocity: &Space, pressure: &Space, frames: &Frames, closed: &ClosedParts) -> f64 {
    let neighbours = neighbours(&velocity.mesh);
    let layout = Layout {
        velocity,
        pressure: Some(pressure),
        carried: [None, None],
        traces: None,
        frames,
        closed,
        neighbours: &neighbours,
    };
    let r = factor_bound(&stokes_pattern(&layout)) as f64;
    let (cells, rows) = (velocity.mesh.cells.len() as f64, velocity.cell_dof_count() as f64);
    MARGIN * (PROGRAM + STOKES * r + BLOCKS * cells * rows * rows) + PICTURES[0]
}

impl Work<'_> {
    /// Bytes besides the model.
    fn bytes(self, scene: &Scene, layout: &Layout) -> f64 {
        let cells = layout.velocity.mesh.cells.len() as f64;
        let polarity = polarity_of(layout);
        let (n, np) = (polarity.n as f64, layout.pressure.map_or(0, |space| space.n) as f64);
        let (columns, rows) = (polarity.cell_dof_count() as f64, layout.velocity.cell_dof_count() as f64);
        let carried: usize = layout.carried.iter().flatten().map(|space| space.dof_count()).sum();
        let vector = NUMBER * carried as f64;
        let m = &scene.parameters;
        // blocks of a cell and its neighbours, whole ones where a term mixes the components across faces
        let blocks = |lists: &[&'static [Term<Vector>]]| if Sum::of(lists).is_wide(m) { 7.0 + 12.0 } else { 7.0 };
        match self {
            // operator, factors, and room to assemble
            Work::Apart { vectors } => {
                let operator = blocks(&[POLARITY, MOLECULAR]);
                FIXED_POINT * (NUMBER * cells * (operator + 4.0 + 1.0) * n * n + vectors as f64 * vector)
            }
            Work::Coupled { structure, precision, vectors } => {
                // own blocks and those of three neighbours; the energy-consistent force is made a second time, local
                let force = if Sum::of(&[MOMENTUM]).is_wide(m) { 4.0 } else { 1.0 };
                let local = match m.elastic_force {
                    ElasticForce::Stress => 0.0,
                    ElasticForce::Energy => 1.0,
                };
                let density = layout.carried[0].map_or(0.0, |space| space.n as f64);
                // by the density: force, drag, polarity and molecular field twice, transport, and the flow's blocks
                // and factors
                let squeezed = if density > 0.0 {
                    density * (2.0 * rows + 8.0 * columns + 4.0 * density) + 2.0 * rows * rows
                } else {
                    0.0
                };
                let operators = blocks(&[POLARITY, MOLECULAR]) + blocks(&[MOLECULAR]);
                let tangent = match layout.traces {
                    None => operators * n * n + (2.0 * force + 1.0) * columns * rows + squeezed,
                    Some(skeleton) => condensed(n, rows, np, skeleton.modes() as f64),
                };
                let parts = rows * rows + rows * np + 2.0 * local * columns * rows;
                let threads = rayon::current_num_threads();
                let made = NUMBER * cells * parts + structure.room(threads, precision) as f64;
                let held = KERNELS * threads as f64 + NUMBER * cells * tangent + structure.bytes(precision) as f64;
                held + made + vectors as f64 * vector
            }
        }
    }
}

/// Numbers per cell of the derivative in hybrid form: its parts, and the condensed element with what the elimination
/// leaves, which the factors keep from an earlier state, too.
fn condensed(n: f64, rows: f64, np: f64, modes: f64) -> f64 {
    let (columns, faces) = (2.0 * n, 6.0 * modes);
    let parts = (n + 3.0 * modes).powi(2) + 2.0 * columns * columns + (3.0 * columns + faces) * rows;
    let element = rows + np + faces;
    parts + element * element + 2.0 * (columns * columns + 2.0 * columns * element)
}

/// What a scene takes, its elastic strain included, which is solved for while everything else is held.
///
/// # Errors
/// As [`Structure::new`].
pub fn need(scene: &Scene, layout: &Layout) -> Result<Need, SolveError> {
    let mut need = need_without_strain(scene, layout)?;
    need.bytes += pictures(scene);
    if let Some(settings) = scene.strain_needed() {
        let strain = Strain::new(&layout.velocity.mesh, settings.degree, settings.weissenberg, Faces::NONE)?;
        need.bytes += MARGIN * strain.bytes(rayon::current_num_threads()) as f64;
    }
    Ok(need)
}

/// What a scene has on a mesh of its own or on one that stands for it; `None` where its unknowns cannot be ordered.
pub fn count(scene: &Scene, mesh: &Arc<Mesh>) -> Option<Count> {
    let unknowns = Unknowns::new(scene, mesh, &describe(scene, mesh));
    let layout = unknowns.layout();
    let coupled = scene.steady.is_some() || scene.coupling.kind == CouplingKind::Newton;
    let kernels = if coupled { KERNELS * rayon::current_num_threads() as f64 } else { 0.0 };
    Some(Count {
        cells: mesh.cells.len() as f64,
        faces: mesh.faces.len() as f64,
        vertices: mesh.vertices.len() as f64,
        unknowns: unknowns.counts(),
        bytes: need(scene, &layout).ok()?.bytes,
        fixed: MARGIN * (PROGRAM + kernels) + pictures(scene),
    })
}

/// Of velocity, pressure, nothing, and the linear system of a Stokes flow.
pub fn unknowns_of_flow(velocity: &Space, pressure: &Space, frames: &Frames) -> [f64; 4] {
    [velocity.dof_count(), pressure.dof_count(), 0, frames.free + pressure.dof_count()].map(|n| n as f64)
}

/// As [`count`] for a Stokes flow of these degrees.
pub fn count_flow(velocity: &Space, pressure: &Space, frames: &Frames, closed: &ClosedParts) -> Count {
    let mesh = &velocity.mesh;
    Count {
        cells: mesh.cells.len() as f64,
        faces: mesh.faces.len() as f64,
        vertices: mesh.vertices.len() as f64,
        unknowns: unknowns_of_flow(velocity, pressure, frames),
        bytes: of_flow(velocity, pressure, frames, closed),
        fixed: MARGIN * PROGRAM + PICTURES[0],
    }
}

/// Two meshes by which those of a scene are judged; `None` where there are none.
pub fn samples(scene: &Scene, cells: f64) -> Option<Samples> {
    Samples::new((&scene.mesh, cells), scene.source(), |table, mesh| count(&scene.on(table, &mesh.tags), &mesh))
}

/// What the rows of sections take, and the largest picture that a run draws.
fn pictures(scene: &Scene) -> f64 {
    let told = scene.time.stop_residual.is_some() || scene.time.stop_energy_rate.is_some() || scene.steady.is_some();
    let drawn = scene.outputs.iter().map(|output| match &output.what {
        What::Measures(_) | What::Cuts { .. } => PICTURES[0],
        What::Maps(_) => PICTURES[1],
        What::Fields(_) | What::Bodies { .. } | What::Checkpoint => 0.0,
    });
    let points = scene.outputs.iter().flat_map(|output| output.what.cuts()).map(Cut::points);
    let batch = cuts::CHUNK * cuts::CHUNKS * rayon::current_num_threads();
    let rows = points.max().unwrap_or(0).min(batch);
    drawn.fold(if told { PICTURES[0] } else { 0.0 }, f64::max) + ROW * rows as f64
}

/// What a scene takes: of a search for steady states with its eigenvalues, else of the coupling.
///
/// # Errors
/// As [`Structure::new`].
fn need_without_strain(scene: &Scene, layout: &Layout) -> Result<Need, SolveError> {
    let vectors = match (&scene.steady, scene.coupling.kind) {
        (Some(search), _) => search_vectors(scene, search),
        (None, CouplingKind::Newton) => KRYLOV,
        (None, CouplingKind::Anderson { depth }) => return Ok(apart(scene, layout, depth)),
        (None, CouplingKind::FixedPoint) => return Ok(apart(scene, layout, 0)),
    };
    let structure = Structure::new("coupled", layout)?;
    // eigenvalues need all digits
    let precision = match &scene.steady {
        Some(search) if search.eigenvalues > 0 => Precision::Double,
        Some(_) | None => structure.precision(),
    };
    let bytes = memory_of(scene, layout, Work::Coupled { structure: &structure, precision, vectors });
    Ok(Need { bytes, structure: Some(structure) })
}

/// Vectors that a search for a steady state holds: the Krylov space of its eigenvalues, if they are asked for.
fn search_vectors(scene: &Scene, search: &SteadySettings) -> usize {
    let solving = match scene.parameters.elastic_force {
        ElasticForce::Stress => 0,
        ElasticForce::Energy => 2 * KRYLOV,
    };
    match (search.want, search.eigenvalues) {
        (Want::Any, 0) => 2 * KRYLOV,
        (Want::Any | Want::Stable, _) => spectrum::DIMENSION[1] + solving,
    }
}

fn apart(scene: &Scene, layout: &Layout, depth: usize) -> Need {
    Need { bytes: memory_of(scene, layout, Work::Apart { vectors: KRYLOV + 2 * depth }), structure: None }
}

/// Refuses a need of more bytes than are available; where that is unknown, nothing is refused.
///
/// # Errors
/// [`RunError::Memory`]
pub fn check(scene: &Scene, bytes: f64, available: Option<f64>) -> Result<(), RunError> {
    match available {
        Some(available) if bytes > available => Err(RunError::Memory {
            origin: scene.source().origin().into(),
            needed: bytes / MIB,
            available: available / MIB,
            hint: hint(scene),
        }),
        Some(_) | None => Ok(()),
    }
}

/// What takes less.
fn hint(scene: &Scene) -> String {
    let gentler = match (&scene.steady, scene.coupling.kind) {
        (None, CouplingKind::Newton) => ", `coupling.kind = \"anderson\"`",
        (Some(_), _) | (None, CouplingKind::Anderson { .. } | CouplingKind::FixedPoint) => "",
    };
    format!("take a coarser mesh, a lower degree `space.k`{gentler}; MONOLAYER_MEMORY (MiB) sets what is available")
}

/// The space of the polarity, which every sheet has.
fn polarity_of<'m>(layout: &Layout<'m>) -> &'m Space {
    layout.carried[1].expect("a sheet has a polarity")
}

/// Unknowns that each free velocity and pressure of the Stokes matrix couples to, ascending.
fn stokes_pattern(layout: &Layout) -> Vec<Vec<usize>> {
    let (velocity, frames) = (layout.velocity, layout.frames);
    let count = layout.pressure.map_or(0, |space| space.dof_count());
    let mut columns = vec![Vec::new(); frames.free + count - layout.closed.count()];
    for cell in 0..velocity.mesh.cells.len() {
        let dofs = (0..velocity.cell_dof_count()).map(|k| velocity.dof(cell, k / velocity.n, k % velocity.n));
        let mut moving: Vec<usize> = dofs.flat_map(|dof| frames.of(dof)).map(|(free, _)| free).collect();
        moving.sort_unstable();
        moving.dedup();
        let pressures = layout.pressures(cell).map(|unknown| unknown as usize);
        let pressures: Vec<usize> = pressures.filter(|&unknown| unknown < columns.len()).collect();
        for &v in &moving {
            columns[v].extend(moving.iter().chain(&pressures));
        }
        for &pi in &pressures {
            columns[pi].extend(&moving);
        }
    }
    columns.iter_mut().for_each(|column| {
        column.sort_unstable();
        column.dedup();
    });
    columns
}

/// Bytes that the aligned start takes besides the model. The entries of R of its matrix, which has the polarity's
/// degree and two
/// components, follow from those of the Stokes matrix and the numbers of unknowns.
fn aligned(layout: &Layout, stokes: f64) -> f64 {
    let (mesh, polarity) = (&layout.velocity.mesh, polarity_of(layout));
    let (vertices, edges, cells) = (mesh.vertices.len(), mesh.faces.len(), mesh.cells.len());
    let inside = polarity.degree - 1;
    let nodes = vertices + edges * inside + cells * (inside * inside.saturating_sub(1)) / 2;
    let unknowns = layout.frames.free + layout.pressure.map_or(0, |space| space.dof_count());
    let entries = 0.52 * stokes * (2.0 * nodes as f64 / unknowns as f64).powf(1.6);
    let block = polarity.cell_dof_count().pow(2);
    (ALIGNED[0] * entries + ALIGNED[1] * (cells * block) as f64 - FREED * stokes).max(0.0)
}
