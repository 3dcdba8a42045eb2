//! Stretched meshes are isotropic in a coordinate `X(x₁)`.

use super::{MeshScene, Shape};

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
    /// The map of a scene whose values have been checked.
    pub fn new(scene: &MeshScene) -> Self {
        let h = scene.h.unwrap_or(1.0);
        let ends = scene.length.unwrap_or_default();
        let factor = scene.stretch.unwrap_or(1.0);
        let with_disc = scene.shape == Some(Shape::StripWithDisc);
        let centre = if with_disc { scene.centre.unwrap_or_default()[0] } else { ends[0] };
        // The size function must be constant where the map bends, and some room behind the disc must stay isotropic.
        let radius = scene.radius.unwrap_or(1.0);
        let graded = (h - scene.h_disc.unwrap_or(h)) / scene.grading.unwrap_or(1.0);
        let core = if with_disc { radius + graded.max(radius) } else { 0.0 };
        Self { centre, ends, core, h, factor }
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
