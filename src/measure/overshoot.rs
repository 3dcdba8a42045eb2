//! The overshoot behind the obstacle.

use serde::Serialize;

use super::MeasureError;
use super::cut::{both_sides, value};
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::space::Field;

/// Largest first component on axis 1 behind the disc.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Overshoot {
    /// `100 (max c₁/c_in − 1)`, percent.
    pub percent: f64,
    /// Where the maximum lies, in scene lengths.
    pub x1: f64,
}

/// Points of the first, coarse search.
const COARSE: usize = 4000;

/// The search ends when it knows the place to this share of their distance.
const NARROW: f64 = 1e-4;

impl Overshoot {
    /// Searches `x₁ > start` up to `end` on the line `x₂ = axis`: a scan, then golden-section search about its best
    /// point. `inflow` is the first component `c_in` of what flows in on that line.
    ///
    /// # Errors
    /// When the line meets no cell.
    pub fn of(
        field: &Field,
        mesh: &Mesh,
        locator: &Locator,
        (start, end): (f64, f64),
        (axis, inflow): (f64, f64),
    ) -> Result<Self, MeasureError> {
        let at = |x1: f64| {
            let cells = both_sides(mesh, locator, Point::new(x1, axis), Point::x());
            if cells.is_empty() { f64::NEG_INFINITY } else { value(field, &cells, 0) / inflow }
        };
        let spacing = (end - start) / COARSE as f64;
        let place = |k: usize| start + (k as f64 + 0.5) * spacing;
        let mut best = (f64::NEG_INFINITY, start);
        for k in 0..COARSE {
            let found = at(place(k));
            if found > best.0 {
                best = (found, place(k));
            }
        }
        if best.0 == f64::NEG_INFINITY {
            return Err(MeasureError::Outside { what: "overshoot's axis", from: start, to: end, y: axis });
        }
        let (mut a, mut b) = ((best.1 - spacing).max(start), (best.1 + spacing).min(end));
        let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
        while b - a > NARROW * spacing {
            let (c, d) = (b - ratio * (b - a), a + ratio * (b - a));
            if at(c) > at(d) { b = d } else { a = c }
        }
        let middle = 0.5 * (a + b);
        let refined = at(middle);
        if refined > best.0 {
            best = (refined, middle);
        }
        Ok(Self { percent: 100.0 * (best.0 - 1.0), x1: best.1 })
    }
}

/// Where the line `x₂ = axis` enters the domain from the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inlet {
    /// Index of the boundary face, and its tag.
    pub face: usize,
    /// Number of the boundary tag.
    pub tag: usize,
    /// Where the axis meets it.
    pub x: Point,
}

impl Inlet {
    /// The first boundary face on the line; `None` where the line meets none.
    pub fn on(mesh: &Mesh, axis: f64) -> Option<Self> {
        let crossings = mesh.faces.iter().enumerate().filter_map(|(face, on)| {
            let [a, b] = mesh.face_vertices(on).map(|v| mesh.vertices[v]);
            let (below, above) = (a.y.min(b.y), a.y.max(b.y));
            if !(below <= axis && axis <= above && below < above) {
                return None;
            }
            let x = a + (b - a) * ((axis - a.y) / (b.y - a.y));
            Some(Self { face, tag: on.tag?, x: Point::new(x.x, axis) })
        });
        crossings.min_by(|a, b| a.x.x.total_cmp(&b.x.x))
    }

    /// The first component of a field there.
    pub fn value(&self, field: &Field, mesh: &Mesh, locator: &Locator) -> Option<f64> {
        let cells = both_sides(mesh, locator, self.x, Point::x());
        (!cells.is_empty()).then(|| value(field, &cells, 0))
    }
}
