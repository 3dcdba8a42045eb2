//! A regular grid of bins.

use crate::mesh::Point;

/// `count[0]` × `count[1]` equal bins of a box; bin `(i, j)` has the number `j·count[0] + i`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bins {
    /// Lower left corner.
    pub low: Point,
    /// Upper right corner.
    pub high: Point,
    /// Bins across and up.
    pub count: [usize; 2],
}

impl Bins {
    /// Number of bins.
    pub fn len(&self) -> usize {
        self.count[0] * self.count[1]
    }

    /// Whether there is no bin.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Lengths of the sides of a bin.
    pub fn size(&self) -> Point {
        let counts = Point::new(self.count[0] as f64, self.count[1] as f64);
        (self.high - self.low).component_div(&counts)
    }

    /// Centre of the bin with this number.
    pub fn centre(&self, bin: usize) -> Point {
        self.inside(bin, Point::new(0.5, 0.5))
    }

    /// The point of a bin at these shares, 0 to 1, of its sides.
    pub fn inside(&self, bin: usize, shares: Point) -> Point {
        let corner = Point::new((bin % self.count[0]) as f64, (bin / self.count[0]) as f64);
        self.low + self.size().component_mul(&(corner + shares))
    }

    /// Number of the bin that contains a point. Lower sides belong to a bin, upper sides to the next, those of the box
    /// to the last.
    pub fn find(&self, x: Point) -> Option<usize> {
        let within = (0..2).all(|c| (self.low[c]..=self.high[c]).contains(&x[c]));
        let place = (x - self.low).component_div(&self.size());
        let [i, j] = [0, 1].map(|c| (place[c].max(0.0) as usize).min(self.count[c] - 1));
        within.then_some(j * self.count[0] + i)
    }

    /// The four bins whose centres surround a point of the box, with the weights of bilinear interpolation; beyond the
    /// outermost centres the nearest ones.
    pub(super) fn around(&self, x: Point) -> Option<[(usize, f64); 4]> {
        self.find(x)?;
        let place = (x - self.low).component_div(&self.size());
        let axis = |c: usize| {
            let last = self.count[c] - 1;
            let at = (place[c] - 0.5).clamp(0.0, last as f64);
            let first = (at as usize).min(last.saturating_sub(1));
            [(first, 1.0 - (at - first as f64)), ((first + 1).min(last), at - first as f64)]
        };
        let ([a, b], [c, d]) = (axis(0), axis(1));
        Some([(a, c), (b, c), (a, d), (b, d)].map(|((i, s), (j, t))| (j * self.count[0] + i, s * t)))
    }
}
