//! Sections along straight lines and circles.

use crate::mesh::locate::{Locator, invert};
use crate::mesh::{Mesh, Point};
use crate::space::Field;

/// A straight section with equidistant points, both ends included.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    pub name: String,
    pub from: Point,
    pub to: Point,
    pub points: usize,
}

/// A point of a section and the cells that meet there.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Distance from the beginning of a line, angle on a circle.
    pub s: f64,
    pub x: Point,
    /// Reference positions in the one cell, or in the cells on both sides of the line where it runs along faces.
    pub at: Vec<(usize, Point)>,
}

impl Line {
    /// The points of the section that lie in the mesh; those in an obstacle are left out.
    pub fn samples(&self, mesh: &Mesh, locator: &Locator) -> Vec<Sample> {
        let length = (self.to - self.from).norm();
        (0..self.points)
            .filter_map(|k| {
                let share = k as f64 / (self.points - 1).max(1) as f64;
                let x = self.from + (self.to - self.from) * share;
                let at = both_sides(mesh, locator, x, self.to - self.from);
                (!at.is_empty()).then_some(Sample { s: share * length, x, at })
            })
            .collect()
    }
}

/// A section along a circle: points at the angles `2πk/points`, counterclockwise from the one to the right of the centre.
#[derive(Debug, Clone, PartialEq)]
pub struct Circle {
    pub name: String,
    pub centre: Point,
    pub radius: f64,
    pub points: usize,
}

/// Barycentric coordinates down to this much below zero count as inside, so that a circle may lie on a bent boundary.
const NEAR: f64 = 1e-3;

impl Circle {
    /// The points of the section that lie in the mesh.
    pub fn samples(&self, mesh: &Mesh, locator: &Locator) -> Vec<Sample> {
        (0..self.points)
            .filter_map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / self.points as f64;
                let out = Point::new(angle.cos(), angle.sin());
                let x = self.centre + out * self.radius;
                let mut at = both_sides(mesh, locator, x, Point::new(-out.y, out.x));
                if at.is_empty() {
                    at.extend(locator.locate_near(mesh, x, NEAR));
                }
                (!at.is_empty()).then_some(Sample { s: angle, x, at })
            })
            .collect()
    }
}

/// The sides of a line are looked for at this share of the longest edge of a cell there: far beyond rounding, far
/// below the cells' heights.
const ASIDE: f64 = 1e-7;

/// The cells left and right of a line through `x`, and where `x` itself lies in them: a discontinuous field has two
/// values where the line runs along faces, and neither is the better one.
pub fn both_sides(mesh: &Mesh, locator: &Locator, x: Point, direction: Point) -> Vec<(usize, Point)> {
    let Some((here, at)) = locator.locate(mesh, x) else { return Vec::new() };
    let [a, b, c] = mesh.corners(here);
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let aside = Point::new(-direction.y, direction.x).normalize() * (ASIDE * longest);
    let mut cells: Vec<usize> =
        [x + aside, x - aside].into_iter().filter_map(|x| locator.locate(mesh, x)).map(|(cell, _)| cell).collect();
    cells.dedup();
    let inside: Vec<(usize, Point)> =
        cells.into_iter().filter_map(|cell| Some((cell, invert(mesh, cell, x)?))).collect();
    if inside.is_empty() { vec![(here, at)] } else { inside }
}

/// Mean over the sides of component `c`.
pub fn value(field: &Field, at: &[(usize, Point)], c: usize) -> f64 {
    at.iter().map(|&(cell, xi)| field.component_at(cell, xi, c)).sum::<f64>() / at.len() as f64
}
