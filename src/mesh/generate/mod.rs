//! Meshes that a scene describes by shape and local size.

mod expect;
mod fitted;
mod front;
mod keys;
mod mirror;
mod outline;
mod relax;
mod rules;
mod size;
mod square;
mod stretch;
mod track;

use serde::{Deserialize, Serialize};

use super::{Mesh, MeshError, Slits};

pub use track::Track;

/// The domains that can be generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// Structured unit-cell square, `2 n²` cells; tags `left`, `right`, `bottom`, `top`.
    Square,
    /// The square with a circle of radius `radius` about `centre` (its middle) in it, which edges follow: `4n` of them, about `14 n²` cells; tags of the
    /// square.
    SquareWithCircle,
    /// Rectangle `length × [−width/2, width/2]`; tags `inlet`, `outlet`, `walls`.
    Strip,
    /// The strip without the disc of radius `radius` about `centre`; tags of the strip and `disc`.
    StripWithDisc,
    /// Disc of radius `radius` about `centre`; tag `wall`.
    Disc,
    /// Ring between `inner_radius` and `radius`; tags `inner`, `outer`.
    Annulus,
    /// Closed stadium-shaped band of width `width` with two straight arms of length `arm` (along x₁) joined by half rings
    /// whose centre line has radius `turn_radius`, a disc of radius `radius` in the middle of each arm, of the upper one alone
    /// (`discs = 1`) or of none (`discs = 0`); tags `outer`, `inner`, `disc`.
    Racetrack,
}

/// The table `[mesh]` of a scene: a shape with its sizes, or a file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshScene {
    /// Domain to generate; exactly one of `shape` and `file`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<Shape>,
    /// File of Gmsh (MSH 2.2, 4.0 or 4.1), relative to the scene's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// `file`: boundary edges that lie on one another are walls without thickness, not nodes that were not merged
    /// (default false).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slits: Option<bool>,
    /// Cells per side of `square`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n: Option<usize>,
    /// `square`: inner vertices are moved by this fraction (0 to 0.3) of the cell size, seeded by `seed`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<f64>,
    /// Seed of what is random in the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Extent along x₁ of `strip` and `strip-with-disc`; side `[x₀, x₁]` of `square` (default `[0, 1]`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<[f64; 2]>,
    /// Extent across the strip or the racetrack's band.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width: Option<f64>,
    /// Radius of the disc, or of the outer circle (default 1).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Radius of the inner circle of `annulus`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inner_radius: Option<f64>,
    /// Centre of the disc (default the origin).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 2]>,
    /// Length of a straight arm of `racetrack`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm: Option<f64>,
    /// Radius of the centre line of the half rings of `racetrack`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turn_radius: Option<f64>,
    /// Discs on `racetrack`: 0, 1 or 2 (default 2).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub discs: Option<usize>,
    /// Edge length far from the disc.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub h: Option<f64>,
    /// Edge length on the disc (default `h`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub h_disc: Option<f64>,
    /// Growth of the edge length per unit of distance from the disc (default 0.15).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grading: Option<f64>,
    /// Cells are this much longer along x₁ than across, away from the disc (default 1; up to 1000). About a disc the
    /// mesh stays isotropic; from there the cells grow by a third each until the stretch is reached.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stretch: Option<f64>,
    /// The mesh is its own exact mirror image in x₂ = 0 (default false).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub symmetric: Option<bool>,
    /// Isoparametric degree of cells on circles: 1, 2 or 3 (default 3).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curved: Option<usize>,
}

impl MeshScene {
    /// Generates the mesh. The same scene gives the same bits.
    ///
    /// # Errors
    /// [`MeshError::BadKey`] names the key that is missing, does not apply to the shape, or has a value of which no mesh
    /// can be made; the errors of [`Mesh::build`] and [`Mesh::bend`].
    pub fn build(&self) -> Result<Mesh, MeshError> {
        let Some(shape) = self.shape else {
            let hint = "name one of square, square-with-circle, strip, strip-with-disc, disc, annulus, racetrack";
            return Err(keys::bad("shape", "(missing)", "a mesh is generated from its shape", hint));
        };
        let scene = self.defaults_filled();
        scene.check(shape)?;
        if shape == Shape::Square {
            return square::build(&scene);
        }
        if shape == Shape::SquareWithCircle {
            return fitted::build(&scene);
        }
        let outline = outline::Outline::new(&scene, shape);
        let size = size::Size::new(&scene, shape);
        let border = outline.divide(&size);
        let points = relax::relax(front::fill(&border, &size), &border, &size);
        let cells = front::triangulate(&points, &border.edges);
        let draft = mirror::Draft { points, cells, border, outline };
        let stretch = if scene.stretch.is_some() { stretch::Stretch::new(&scene) } else { stretch::Stretch::NONE };
        let mut mesh = draft.finish(scene.symmetric == Some(true), &stretch)?;
        mesh.bend(scene.curved.unwrap_or(1))?;
        mesh.check_embedding(Slits::Refused)?;
        Ok(mesh)
    }
}
