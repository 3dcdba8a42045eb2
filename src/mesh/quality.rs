//! What a mesh is worth: counts, sizes, worst cells.

use std::fmt;

use serde::Serialize;

use super::{Mesh, Point};

/// A cell that is the worst in some respect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Worst {
    /// How bad it is.
    pub value: f64,
    /// Number of the cell.
    pub cell: usize,
    /// Its middle.
    pub centroid: [f64; 2],
}

/// Counts, sizes and worst cells of a mesh. Lengths and angles are those of the straight triangles on the corners.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Quality {
    /// Number of cells.
    pub cells: usize,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of faces.
    pub faces: usize,
    /// Number of faces on the boundary.
    pub boundary_faces: usize,
    /// Parts that hang together by faces.
    pub parts: usize,
    /// Boundary vertices that lie where another one lies, and the place of the first.
    pub coincident_vertices: usize,
    /// Where two vertices coincide, if any do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coincident_at: Option<[f64; 2]>,
    /// Cells with a geometry of degree 2 or 3.
    pub curved_cells: usize,
    /// Highest degree of the geometry.
    pub degree: usize,
    /// Area of the domain, curved cells included.
    pub area: f64,
    /// Smallest and largest cell diameter (longest edge of a cell).
    pub h_min: f64,
    /// Longest edge of all.
    pub h_max: f64,
    /// Smallest angle of any cell, in degrees.
    pub worst_angle_degrees: Worst,
    /// Mean over the cells of their smallest angle, in degrees.
    pub mean_angle_degrees: f64,
    /// Largest ratio of the longest edge to the shortest height, `L²/(2|K|)`: 2/√3 for an equilateral cell.
    pub worst_stretch: Worst,
    /// Faces per tag, in the order of the mesh's tags.
    pub tags: Vec<(String, usize)>,
}

impl Mesh {
    /// Measures the mesh.
    pub fn quality(&self) -> Quality {
        let mut angle = Worst { value: f64::INFINITY, cell: 0, centroid: [0.0; 2] };
        let mut stretch = Worst { value: 0.0, ..angle };
        let (mut h_min, mut h_max, mut angles) = (f64::INFINITY, 0.0_f64, 0.0);
        for cell in 0..self.cells.len() {
            let shape = shape(self.corners(cell));
            h_min = h_min.min(shape.longest);
            h_max = h_max.max(shape.longest);
            angles += shape.angle;
            let worst = |value| Worst { value, cell, centroid: self.centroid(cell).into() };
            if shape.angle < angle.value {
                angle = worst(shape.angle);
            }
            if shape.stretch > stretch.value {
                stretch = worst(shape.stretch);
            }
        }
        let count = |tag| self.faces.iter().filter(|f| f.tag == Some(tag)).count();
        Quality {
            cells: self.cells.len(),
            vertices: self.vertices.len(),
            faces: self.faces.len(),
            boundary_faces: self.faces.iter().filter(|f| f.plus.is_none()).count(),
            parts: self.parts().count,
            coincident_vertices: self.coincident.len(),
            coincident_at: self.coincident.first().map(|&v| self.vertices[v].into()),
            curved_cells: self.curved.iter().flatten().count(),
            degree: self.curved.iter().flatten().map(|nodes| nodes.degree).max().unwrap_or(1),
            area: self.area(),
            h_min,
            h_max,
            worst_angle_degrees: angle,
            mean_angle_degrees: angles / self.cells.len() as f64,
            worst_stretch: stretch,
            tags: self.tags.iter().enumerate().map(|(tag, name)| (name.clone(), count(tag))).collect(),
        }
    }
}

/// Longest edge, smallest angle (degrees) and stretch of a triangle.
struct Shape {
    longest: f64,
    angle: f64,
    stretch: f64,
}

fn shape([a, b, c]: [Point; 3]) -> Shape {
    let mut lengths = [(c - b).norm(), (a - c).norm(), (b - a).norm()];
    lengths.sort_by(f64::total_cmp);
    let [_, middle, longest] = lengths;
    let double_area = (b - a).perp(&(c - a));
    // The smallest angle lies between the two longest edges; the sine is exact for slivers, where the cosine is not.
    let angle = (double_area / (middle * longest)).clamp(-1.0, 1.0).asin().to_degrees();
    Shape { longest, angle, stretch: longest * longest / double_area }
}

/// A tag in a line of text, quoted where its end could be missed.
fn shown(tag: &str) -> std::borrow::Cow<'_, str> {
    let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | ' ' | '.');
    if tag.trim() == tag && tag.chars().all(plain) { tag.into() } else { format!("{tag:?}").into() }
}

impl fmt::Display for Worst {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.centroid;
        write!(f, "{:.4} (cell {} at {x:.4}, {y:.4})", self.value, self.cell)
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "cells           {} ({} curved, degree {})", self.cells, self.curved_cells, self.degree)?;
        writeln!(f, "vertices        {}", self.vertices)?;
        writeln!(f, "faces           {} ({} on the boundary)", self.faces, self.boundary_faces)?;
        for (name, count) in &self.tags {
            writeln!(f, "  {:<14}{count}", shown(name))?;
        }
        if self.parts > 1 {
            writeln!(f, "parts           {}, which share no faces", self.parts)?;
        }
        writeln!(f, "area            {:.12}", self.area)?;
        writeln!(f, "longest edges   {:.4} to {:.4}", self.h_min, self.h_max)?;
        writeln!(f, "smallest angle  {} degrees; mean {:.2}", self.worst_angle_degrees, self.mean_angle_degrees)?;
        write!(f, "stretch         at most {}", self.worst_stretch)
    }
}
