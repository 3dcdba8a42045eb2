//! Arrows on a regular grid.

use super::{Vector, Window};
use crate::output::plot::axis;
use crate::output::plot::layout::Frame;
use crate::output::plot::scene::{INK, Paint, Shape, WHITE};

/// Distance of neighbouring arrows on paper.
const SPACING: f64 = 34.0;
/// Length of the longest arrow on paper.
const LONGEST: f64 = 32.0;
/// Shorter arrows are not drawn.
const SHORTEST: f64 = 2.0;
/// Half of the thickness of the shaft.
const SHAFT: f64 = 1.1;
/// Length of the head, if the arrow is long enough, and half of its width over its length.
const HEAD: f64 = 11.0;
const HEAD_SLOPE: f64 = 0.42;
/// Width of the light edge that keeps arrows readable on dark colours.
const HALO: f64 = 2.4;

/// Arrows on paper.
pub(super) struct Arrows {
    /// Middle and extent, downwards.
    drawn: Vec<((f64, f64), (f64, f64))>,
    /// Length on paper of a vector of length 1; 0 if all are zero.
    scale: f64,
    largest: f64,
}

impl Arrows {
    /// Samples the vector on the grid.
    pub fn sample(of: Vector, window: &Window, frame: &Frame) -> Self {
        let (width, height) = (frame.rect.width(), frame.rect.height());
        let [nx, ny] = [width, height].map(|side| (side / SPACING).floor().max(1.0) as usize);
        let mut found = Vec::new();
        for (j, i) in (0..ny).flat_map(|j| (0..nx).map(move |i| (j, i))) {
            let x = (width - (nx - 1) as f64 * SPACING) / 2.0 + i as f64 * SPACING;
            let y = (height - (ny - 1) as f64 * SPACING) / 2.0 + j as f64 * SPACING;
            let vector = of(window.at(x / width, 1.0 - y / height)).filter(|v| v.x.is_finite() && v.y.is_finite());
            found.extend(vector.map(|v| ((frame.rect.x0 + x, frame.rect.y0 + y), v)));
        }
        let largest = found.iter().map(|(_, v)| v.norm()).fold(0.0, f64::max);
        let scale = if largest > 0.0 { LONGEST / largest } else { 0.0 };
        let drawn = found.into_iter().map(|(at, v)| (at, (v.x * scale, -v.y * scale))).collect();
        Self { drawn, scale, largest }
    }

    /// All arrows: light edges below all dark bodies.
    pub fn shapes(&self) -> Vec<Shape> {
        let long = self.drawn.iter().filter(|(_, (x, y))| x.hypot(*y) >= SHORTEST);
        let bodies: Vec<_> = long.map(|&(at, along)| body(at, along)).collect();
        let halo = bodies.iter().map(|points| paint(points.clone(), Paint::line(WHITE, HALO)));
        let dark = bodies.iter().map(|points| paint(points.clone(), Paint { fill: Some(INK), stroke: None }));
        halo.chain(dark).collect()
    }

    /// A round length of a vector near the largest one, and its arrow from a point to the right; `None` if all are
    /// zero.
    pub fn key(&self, from: (f64, f64)) -> Option<(f64, f64, Shape)> {
        (self.scale > 0.0).then(|| {
            let value = axis::nice_below(self.largest);
            let length = value * self.scale;
            let points = body((from.0 + length / 2.0, from.1), (length, 0.0));
            (value, length, paint(points, Paint { fill: Some(INK), stroke: None }))
        })
    }
}

fn paint(points: Vec<(f64, f64)>, paint: Paint) -> Shape {
    Shape::Poly { points, closed: true, paint }
}

/// Outline of an arrow about its middle.
fn body(middle: (f64, f64), (dx, dy): (f64, f64)) -> Vec<(f64, f64)> {
    let length = dx.hypot(dy);
    let (ux, uy) = (dx / length, dy / length);
    let head = HEAD.min(0.6 * length);
    let wing = (HEAD_SLOPE * head).max(SHAFT);
    let (tail, neck, tip) = (-length / 2.0, length / 2.0 - head, length / 2.0);
    let corners =
        [(tail, SHAFT), (neck, SHAFT), (neck, wing), (tip, 0.0), (neck, -wing), (neck, -SHAFT), (tail, -SHAFT)];
    corners.map(|(s, n)| (middle.0 + s * ux - n * uy, middle.1 + s * uy + n * ux)).to_vec()
}
