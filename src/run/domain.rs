//! The mesh of a scene: made or read, and what is worth knowing of it.

use std::path::Path;

use super::RunError;
use crate::form::Faces;
use crate::mesh::generate::MeshScene;
use crate::mesh::{Mesh, MeshError, NearMiss, Point, Slits, gmsh};
use crate::output::progress::{Progress, Verbosity};
use crate::scene::{Scene, SceneSource};

/// Builds or reads the mesh of a scene.
///
/// # Errors
/// Bad keys, an unreadable file, inverted cells.
pub fn build_mesh(scene: &Scene) -> Result<Mesh, RunError> {
    mesh_of(&scene.mesh, scene.source())
}

/// Says so where making the mesh takes a while.
pub fn announce_mesh(table: &MeshScene, verbosity: Verbosity) {
    if let Some(cells) = table.expected().filter(|cells| *cells > table.quickly_built()) {
        Progress::new(verbosity, 0.0).say(&format!("the mesh will have about {cells:.0} cells"));
    }
}

/// Smallest and largest extent of a mesh from a file, and the smallest relative to its coordinates.
const EXTENTS: [f64; 2] = [1e-9, 2e9];
const NARROWEST: f64 = 1e-9;

/// Refuses a mesh whose areas leave the range of numbers, or whose vertices coincide in their rounding.
fn check_extent(mesh: Mesh, file: &str) -> Result<Mesh, MeshError> {
    let first = mesh.vertices[0];
    let corners = |(low, high): (Point, Point), x: &Point| (low.inf(x), high.sup(x));
    let (low, high) = mesh.vertices.iter().fold((first, first), corners);
    let (extent, reach) = ((high - low).max(), low.amax().max(high.amax()));
    if (EXTENTS[0]..=EXTENTS[1]).contains(&extent) && extent >= NARROWEST * reach {
        return Ok(mesh);
    }
    Err(MeshError::BadKey {
        key: "mesh.file".into(),
        value: format!("\"{file}\""),
        rule: format!(
            "the mesh is {extent:e} across at coordinates up to {reach:e}; an extent lies between 1e-9 and 1e9, and is at least \
             1e-9 of the coordinates"
        ),
        hint: "scale the mesh to a unit of length in which it is near 1 across, and put the origin into it".into(),
    })
}

/// Builds or reads the mesh of a scene of any kind.
///
/// # Errors
/// As [`build_mesh`].
pub fn mesh_of(table: &MeshScene, source: &SceneSource) -> Result<Mesh, RunError> {
    let curved = table.get::<usize>("curved");
    let built = match &table.file {
        None => table.build(),
        Some(_) if curved.is_some_and(|degree| !(1..=3).contains(&degree)) => Err(MeshError::BadKey {
            key: "mesh.curved".into(),
            value: curved.unwrap_or_default().to_string(),
            rule: "must be 1, 2 or 3".into(),
            hint: "leave it out to keep the geometry of the file".into(),
        }),
        Some(file) => {
            let slits = if table.slits == Some(true) { Slits::Kept } else { Slits::Refused };
            gmsh::read_as(Path::new(file), gmsh::Reading { curved, slits }).and_then(|mesh| check_extent(mesh, file))
        }
    };
    let few_tags = built.and_then(|mesh| match mesh.tags.len() {
        count if count > Faces::MAX_TAGS => Err(MeshError::BadKey {
            key: "mesh.file".into(),
            value: format!("{count} boundary tags"),
            rule: format!("a mesh may have at most {}", Faces::MAX_TAGS),
            hint: "join boundary curves with the same conditions in one physical group".into(),
        }),
        _ => Ok(mesh),
    });
    few_tags.map_err(|error| {
        let origin = match &error {
            MeshError::BadKey { key, .. } => source.place(key).to_string(),
            MeshError::Inverted { .. }
            | MeshError::Folded { .. }
            | MeshError::Overlap { .. }
            | MeshError::Pinched { .. }
            | MeshError::Cut { .. }
            | MeshError::NonManifold { .. }
            | MeshError::Untagged { .. }
            | MeshError::NotOnBoundary { .. }
            | MeshError::BadVertex { .. }
            | MeshError::Empty
            | MeshError::File { .. } => source.place("mesh").to_string(),
        };
        RunError::Mesh { origin, error: Box::new(error) }
    })
}

/// What was left out of the mesh's file, and what its parts mean for the pressure.
pub fn mesh_remarks(mesh: &Mesh) -> Vec<String> {
    let mut remarks: Vec<String> = mesh.notes.iter().map(|note| format!("mesh file: {note}")).collect();
    let count = mesh.parts().count;
    if count > 1 {
        remarks.push(format!(
            "the mesh has {count} parts that share no faces; each has a flow of its own, and where nothing else \
             fixes its pressure, a \
             pressure of zero mean"
        ));
    }
    if let Some(&first) = mesh.coincident.first() {
        let (x, lie) = (mesh.vertices[first], mesh.coincident.len());
        remarks.push(format!(
            "{lie} boundary vertices lie on others without being joined, the first at ({:.4}, {:.4})",
            x.x, x.y
        ));
    }
    if let Some(NearMiss { count, at, distance, length }) = mesh.near_miss() {
        let pairs = if count == 1 { "a pair".to_owned() } else { format!("{count} pairs") };
        remarks.push(format!(
            "{pairs} of boundary edges nearly touch: near ({:.4}, {:.4}) two edges are {distance:.1e} \
             apart, and the shorter one is {length:.1e} long; nothing passes from one to the other; hint: \
             if they belong together, let them share their nodes (`Coherence` in Gmsh, with a larger \
             `Geometry.Tolerance`)",
            at.x, at.y
        ));
    }
    remarks
}
