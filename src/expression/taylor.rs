//! Taylor series in two variables, truncated after degree 3.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::mesh::Point;

/// `f(x_0 + h) = Σ c_ij h_1^i h_2^j` up to total degree `i + j = 3`.
///
/// The ten coefficients are those of `1; h_1, h_2; h_1², h_1h_2, h_2²; h_1³, h_1²h_2, h_1h_2², h_2³`. Products and
/// quotients drop what exceeds degree 3. A derivative knows one degree less than its function; the degree it does not
/// know is zero, and so is what products make of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taylor([f64; 10]);

impl Taylor {
    /// The same value everywhere.
    #[inline]
    pub fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// The first coordinate, near `value`.
    #[inline]
    pub fn x(value: f64) -> Self {
        Self([value, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// The second coordinate, near `value`.
    #[inline]
    pub fn y(value: f64) -> Self {
        Self([value, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// `f` at the point.
    #[inline]
    pub fn value(&self) -> f64 {
        self.0[0]
    }

    /// `(∂_1f, ∂_2f)` at the point.
    #[inline]
    pub fn gradient(&self) -> Point {
        Point::new(self.0[1], self.0[2])
    }

    /// `(∂_1∂_1f, ∂_1∂_2f, ∂_2∂_2f)` at the point.
    pub fn second(&self) -> [f64; 3] {
        let [_, _, _, xx, xy, yy, ..] = self.0;
        [2.0 * xx, xy, 2.0 * yy]
    }

    /// `(∂_1∂_1∂_1f, ∂_1∂_1∂_2f, ∂_1∂_2∂_2f, ∂_2∂_2∂_2f)` at the point.
    pub fn third(&self) -> [f64; 4] {
        let [.., xxx, xxy, xyy, yyy] = self.0;
        [6.0 * xxx, 2.0 * xxy, 2.0 * xyy, 6.0 * yyy]
    }

    /// The series of `∂_1f`, known up to degree 2.
    #[must_use]
    #[inline]
    pub fn dx(&self) -> Self {
        let [_, x, _, xx, xy, _, xxx, xxy, xyy, _] = self.0;
        Self([x, 2.0 * xx, xy, 3.0 * xxx, 2.0 * xxy, xyy, 0.0, 0.0, 0.0, 0.0])
    }

    /// The series of `∂_2f`, known up to degree 2.
    #[must_use]
    #[inline]
    pub fn dy(&self) -> Self {
        let [_, _, y, _, xy, yy, _, xxy, xyy, yyy] = self.0;
        Self([y, xy, 2.0 * yy, xxy, 2.0 * xyy, 3.0 * yyy, 0.0, 0.0, 0.0, 0.0])
    }

    /// The series of `Δf = ∂_1∂_1f + ∂_2∂_2f`, known up to degree 1.
    #[must_use]
    #[inline]
    pub fn laplacian(&self) -> Self {
        let [_, _, _, xx, _, yy, xxx, xxy, xyy, yyy] = self.0;
        let mut of = Self::constant(2.0 * (xx + yy));
        of.0[1] = 6.0 * xxx + 2.0 * xyy;
        of.0[2] = 2.0 * xxy + 6.0 * yyy;
        of
    }

    /// The series up to degree 1, zero above.
    #[must_use]
    #[inline]
    pub fn linear(&self) -> Self {
        let [value, x, y, ..] = self.0;
        Self([value, x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    /// The series divided by a number, coefficient by coefficient.
    #[must_use]
    #[inline]
    pub fn over(self, divisor: f64) -> Self {
        Self(map(self.0, |c| c / divisor))
    }

    /// `f^exponent`; NaN below zero unless the exponent is whole.
    #[must_use]
    #[inline]
    pub fn powf(&self, exponent: f64) -> Self {
        self.compose(power(self.value(), exponent))
    }

    /// `g∘f` from `outer = [g, g′, g″/2, g‴/6]` at the value of `f`.
    #[must_use]
    #[inline]
    pub fn compose(&self, outer: [f64; 4]) -> Self {
        let [value, g1, g2, g3] = outer;
        // the increment h = f − f(x_0) has no constant term: h² starts at degree 2, h³ at degree 3
        let [_, x, y, xx, xy, yy, xxx, xxy, xyy, yyy] = self.0;
        let [x2, y2] = [x * x, y * y];
        let square =
            [x2, 2.0 * x * y, y2, 2.0 * x * xx, 2.0 * (x * xy + y * xx), 2.0 * (x * yy + y * xy), 2.0 * y * yy];
        let cube = [x2 * x, 3.0 * x2 * y, 3.0 * x * y2, y2 * y];
        if !(g1 + g2 + g3).is_finite() {
            return self.compose_singular(outer, &square, &cube);
        }
        Self([
            value,
            g1 * x,
            g1 * y,
            g1 * xx + g2 * square[0],
            g1 * xy + g2 * square[1],
            g1 * yy + g2 * square[2],
            g1 * xxx + g2 * square[3] + g3 * cube[0],
            g1 * xxy + g2 * square[4] + g3 * cube[1],
            g1 * xyy + g2 * square[5] + g3 * cube[2],
            g1 * yyy + g2 * square[6] + g3 * cube[3],
        ])
    }

    /// As [`compose`](Self::compose), where a derivative of `g` is infinite: a direction in which `f` does not vary
    /// keeps its zero derivative.
    #[cold]
    #[inline(never)]
    fn compose_singular(&self, [value, g1, g2, g3]: [f64; 4], square: &[f64; 7], cube: &[f64; 4]) -> Self {
        let times = |g: f64, c: f64| if c == 0.0 { 0.0 } else { g * c };
        Self(std::array::from_fn(|i| {
            let first = if i == 0 { value } else { times(g1, self.0[i]) };
            let second = if i < 3 { 0.0 } else { times(g2, square[i - 3]) };
            let third = if i < 6 { 0.0 } else { times(g3, cube[i - 6]) };
            first + second + third
        }))
    }
}

/// Derivatives of `s ↦ s^b`. A binomial coefficient that is zero ends them: `x^2` has a third derivative at `x = 0`.
fn power(a: f64, b: f64) -> [f64; 4] {
    let mut outer = [a.powf(b), 0.0, 0.0, 0.0];
    let mut binomial = 1.0;
    for (order, derivative) in [1.0, 2.0, 3.0].into_iter().zip(&mut outer[1..]) {
        binomial *= (b - (order - 1.0)) / order;
        if binomial == 0.0 {
            break;
        }
        let rest = b - order;
        let small = rest.fract() == 0.0 && rest.abs() <= 16.0;
        *derivative = binomial * if small { a.powi(rest as i32) } else { a.powf(rest) };
    }
    outer
}

/// Written out: the compiler then drops the coefficients that nobody reads, which it does not see in a loop.
#[inline(always)]
fn map(a: [f64; 10], f: impl Fn(f64) -> f64) -> [f64; 10] {
    [f(a[0]), f(a[1]), f(a[2]), f(a[3]), f(a[4]), f(a[5]), f(a[6]), f(a[7]), f(a[8]), f(a[9])]
}

#[inline(always)]
fn zip(a: [f64; 10], b: [f64; 10], f: impl Fn(f64, f64) -> f64) -> [f64; 10] {
    let low = [f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3]), f(a[4], b[4])];
    let high = [f(a[5], b[5]), f(a[6], b[6]), f(a[7], b[7]), f(a[8], b[8]), f(a[9], b[9])];
    let ([c0, c1, c2, c3, c4], [c5, c6, c7, c8, c9]) = (low, high);
    [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9]
}

impl Add for Taylor {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        Self(zip(self.0, other.0, |a, b| a + b))
    }
}

impl Sub for Taylor {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        Self(zip(self.0, other.0, |a, b| a - b))
    }
}

impl Neg for Taylor {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self(map(self.0, |c| -c))
    }
}

impl Add<f64> for Taylor {
    type Output = Self;

    #[inline]
    fn add(mut self, number: f64) -> Self {
        self.0[0] += number;
        self
    }
}

impl Sub<f64> for Taylor {
    type Output = Self;

    #[inline]
    fn sub(mut self, number: f64) -> Self {
        self.0[0] -= number;
        self
    }
}

impl Mul<f64> for Taylor {
    type Output = Self;

    #[inline]
    fn mul(self, factor: f64) -> Self {
        Self(map(self.0, |c| c * factor))
    }
}

impl Mul<Taylor> for f64 {
    type Output = Taylor;

    #[inline]
    fn mul(self, series: Taylor) -> Taylor {
        series * self
    }
}

impl Mul for Taylor {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (&self.0, &other.0);
        Self([
            a[0] * b[0],
            a[0] * b[1] + a[1] * b[0],
            a[0] * b[2] + a[2] * b[0],
            a[0] * b[3] + a[3] * b[0] + a[1] * b[1],
            a[0] * b[4] + a[4] * b[0] + a[1] * b[2] + a[2] * b[1],
            a[0] * b[5] + a[5] * b[0] + a[2] * b[2],
            a[0] * b[6] + a[6] * b[0] + a[1] * b[3] + a[3] * b[1],
            a[0] * b[7] + a[7] * b[0] + a[1] * b[4] + a[4] * b[1] + a[2] * b[3] + a[3] * b[2],
            a[0] * b[8] + a[8] * b[0] + a[1] * b[5] + a[5] * b[1] + a[2] * b[4] + a[4] * b[2],
            a[0] * b[9] + a[9] * b[0] + a[2] * b[5] + a[5] * b[2],
        ])
    }
}

impl Div for Taylor {
    type Output = Self;

    /// `q` with `q b = a`, degree by degree.
    #[inline]
    fn div(self, other: Self) -> Self {
        let (a, b) = (&self.0, &other.0);
        let r = 1.0 / b[0];
        let q0 = a[0] / b[0];
        let q1 = (a[1] - q0 * b[1]) * r;
        let q2 = (a[2] - q0 * b[2]) * r;
        let q3 = (a[3] - q0 * b[3] - q1 * b[1]) * r;
        let q4 = (a[4] - q0 * b[4] - q1 * b[2] - q2 * b[1]) * r;
        let q5 = (a[5] - q0 * b[5] - q2 * b[2]) * r;
        let q6 = (a[6] - q0 * b[6] - q1 * b[3] - q3 * b[1]) * r;
        let q7 = (a[7] - q0 * b[7] - q1 * b[4] - q4 * b[1] - q2 * b[3] - q3 * b[2]) * r;
        let q8 = (a[8] - q0 * b[8] - q1 * b[5] - q5 * b[1] - q2 * b[4] - q4 * b[2]) * r;
        let q9 = (a[9] - q0 * b[9] - q2 * b[5] - q5 * b[2]) * r;
        Self([q0, q1, q2, q3, q4, q5, q6, q7, q8, q9])
    }
}
