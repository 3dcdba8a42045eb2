//! Stretched meshes are isotropic in a coordinate `X(x₁)`.

use super::keys::Meaning;
use super::size::Size;
use crate::schema::Range;

/// How much longer cells may be.
pub(super) const STRETCH: Meaning = Meaning::Within {
    range: Range::within(1.0, 1000.0),
    rule: "it must lie in 1 to 1000",
    hint: "1 gives isotropic cells",
};

/// Growth of the cell length per cell, where the stretch sets in.
const GROWTH: f64 = 0.3;

/// The odd, monotone map `x₁ → X` about the disc's centre.
///
/// `dX/dx₁ = 1/m(d)` with `m = 1` within the distance `core` of the centre, `m = 1 + γ(d − core)/h` beyond, up to
/// `m = stretch`: the cells there are `m·h` long and grow by the constant factor `e^γ` from one to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    centre: f64,
    ends: [f64; 2],
    core: f64,
    h: f64,
    factor: f64,
}

impl Stretch {
    /// The map of a strip with these ends; the same factor everywhere where it has no disc, which the size would name.
    pub fn new(ends: [f64; 2], factor: f64, size: &Size) -> Self {
        let h = size.h;
        let Some(disc) = size.centres.first() else { return Self { centre: ends[0], ends, core: 0.0, h, factor } };
        // The size function must be constant where the map bends, and some room behind the disc must stay isotropic.
        let graded = (h - size.h_disc) / size.grading;
        Self { centre: disc.x, ends, core: size.radius + graded.max(size.radius), h, factor }
    }

    /// No map at all.
    pub const NONE: Self = Self { centre: 0.0, ends: [0.0; 2], core: f64::INFINITY, h: 1.0, factor: 1.0 };

    /// Where the strip begins and ends in `X`.
    pub fn image(&self) -> [f64; 2] {
        self.ends.map(|x| self.forward(x))
    }

    /// Length of the strip in `X`.
    pub fn image_length(&self) -> f64 {
        let [a, b] = self.image();
        b - a
    }

    /// `X(x₁)`; the identity, to the last bit, near the disc.
    fn forward(&self, x: f64) -> f64 {
        let d = (x - self.centre).abs() - self.core;
        if self.factor <= 1.0 || (self.core > 0.0 && d <= 0.0) {
            return x;
        }
        let beyond = if self.core == 0.0 {
            d / self.factor
        } else {
            let bend = (self.factor - 1.0) * self.h / GROWTH;
            let curved = self.h / GROWTH * (GROWTH * d.min(bend) / self.h).ln_1p();
            curved + (d - bend).max(0.0) / self.factor
        };
        self.centre + (self.core + beyond).copysign(x - self.centre)
    }

    /// `x₁(X)`; the ends of the strip come back exactly.
    pub fn back(&self, image: f64) -> f64 {
        let d = (image - self.centre).abs() - self.core;
        if self.factor <= 1.0 || (self.core > 0.0 && d <= 0.0) {
            return image;
        }
        let [first, last] = self.image();
        if image == first || image == last {
            return self.ends[usize::from(image == last)];
        }
        let beyond = if self.core == 0.0 {
            d * self.factor
        } else {
            let bend = self.h / GROWTH * self.factor.ln();
            let curved = self.h / GROWTH * (GROWTH * d.min(bend) / self.h).exp_m1();
            curved + (d - bend).max(0.0) * self.factor
        };
        self.centre + (self.core + beyond).copysign(image - self.centre)
    }
}
