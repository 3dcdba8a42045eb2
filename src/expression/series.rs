//! A tree evaluated in Taylor series: the functions that formulas know, and a short cut for what does not vary.

use std::f64::consts::LN_10;

use super::taylor::Taylor;
use super::tree::{Arithmetic, Binary, Unary, Variable};

/// A series, or a number as long as no coordinate has come in. A number costs no more than in a plain evaluation, and
/// never meets a derivative that may be infinite, such as that of `sqrt(t)` at `t = 0`.
pub(super) enum Series {
    Number(f64),
    Varying(Taylor),
}

impl Series {
    fn value(&self) -> f64 {
        match self {
            Self::Number(value) => *value,
            Self::Varying(taylor) => taylor.value(),
        }
    }
}

impl From<Series> for Taylor {
    fn from(series: Series) -> Self {
        match series {
            Series::Number(value) => Self::constant(value),
            Series::Varying(taylor) => taylor,
        }
    }
}

impl Arithmetic for Series {
    #[inline]
    fn number(value: f64) -> Self {
        Self::Number(value)
    }

    #[inline]
    fn variable(variable: Variable, value: f64) -> Self {
        match variable {
            Variable::X => Self::Varying(Taylor::x(value)),
            Variable::Y => Self::Varying(Taylor::y(value)),
            Variable::T | Variable::Theta => Self::Number(value),
        }
    }

    // apart, so that the calls of a long formula fit the stack of a thread
    #[inline(never)]
    fn unary(f: Unary, a: Self) -> Self {
        match a {
            Self::Number(a) => Self::Number(f.apply(a)),
            Self::Varying(a) => apply(f, &a),
        }
    }

    #[inline(never)]
    fn binary(f: Binary, a: Self, b: Self) -> Self {
        use Series::{Number, Varying};
        match (f, a, b) {
            (_, Number(a), Number(b)) => Number(f.apply(a, b)),
            (Binary::Add, Varying(a), Number(b)) | (Binary::Add, Number(b), Varying(a)) => Varying(a + b),
            (Binary::Sub, Varying(a), Number(b)) => Varying(a - b),
            (Binary::Sub, Number(a), Varying(b)) => Varying(-b + a),
            (Binary::Mul, Varying(a), Number(b)) | (Binary::Mul, Number(b), Varying(a)) => Varying(a * b),
            (Binary::Div, Varying(a), Number(b)) => Varying(a.over(b)),
            (Binary::Div, Number(a), Varying(b)) => Varying(b.compose(reciprocal(a, b.value()))),
            (Binary::Pow, Varying(a), Number(b)) => Varying(a.powf(b)),
            (Binary::Pow, Number(a), Varying(b)) => Varying(exponential(a.powf(b.value()), b * a.ln())),
            (Binary::Add, Varying(a), Varying(b)) => Varying(a + b),
            (Binary::Sub, Varying(a), Varying(b)) => Varying(a - b),
            (Binary::Mul, Varying(a), Varying(b)) => Varying(a * b),
            (Binary::Div, Varying(a), Varying(b)) => Varying(a / b),
            (Binary::Pow, Varying(a), Varying(b)) => {
                let logarithm = a.compose(logarithm(a.value(), a.value().ln(), 1.0));
                Varying(exponential(a.value().powf(b.value()), b * logarithm))
            }
            (Binary::Less | Binary::LessEqual | Binary::Greater | Binary::GreaterEqual, a, b) => {
                Number(f.apply(a.value(), b.value()))
            }
            // a NaN on the left is kept, as in a plain evaluation
            (Binary::Min, a, b) => {
                if a.value().is_nan() || a.value() < b.value() {
                    a
                } else {
                    b
                }
            }
            (Binary::Max, a, b) => {
                if a.value().is_nan() || a.value() > b.value() {
                    a
                } else {
                    b
                }
            }
            (Binary::Atan2, a, b) => Varying(angle(a.into(), b.into())),
            (Binary::Hypot, a, b) => Varying(length(a.into(), b.into())),
        }
    }
}

/// `f(a)`
fn apply(f: Unary, series: &Taylor) -> Series {
    let a = series.value();
    // [f, f′, f″/2, f‴/6] at a
    let outer = match f {
        Unary::Minus => return Series::Varying(-*series),
        Unary::Sign | Unary::Floor | Unary::Heaviside => return Series::Number(f.apply(a)),
        Unary::Abs => [a.abs(), Unary::Sign.apply(a), 0.0, 0.0],
        Unary::Sin => {
            let (s, c) = a.sin_cos();
            [s, c, -0.5 * s, c / -6.0]
        }
        Unary::Cos => {
            let (s, c) = a.sin_cos();
            [c, -s, -0.5 * c, s / 6.0]
        }
        Unary::Tan => {
            let tan = a.tan();
            let first = 1.0 + tan * tan;
            [tan, first, tan * first, first * (1.0 + 3.0 * tan * tan) / 3.0]
        }
        Unary::Asin => arcsine(a, a.asin(), 1.0),
        Unary::Acos => arcsine(a, a.acos(), -1.0),
        Unary::Atan => {
            let first = 1.0 / (1.0 + a * a);
            [a.atan(), first, -a * first * first, (3.0 * a * a - 1.0) * first * first * first / 3.0]
        }
        Unary::Sinh => [a.sinh(), a.cosh(), 0.5 * a.sinh(), a.cosh() / 6.0],
        Unary::Cosh => [a.cosh(), a.sinh(), 0.5 * a.cosh(), a.sinh() / 6.0],
        Unary::Tanh => {
            let tanh = a.tanh();
            let first = (1.0 - tanh) * (1.0 + tanh);
            [tanh, first, -tanh * first, first * (3.0 * tanh * tanh - 1.0) / 3.0]
        }
        Unary::Exp => return Series::Varying(exponential(a.exp(), *series)),
        Unary::Ln | Unary::Log => logarithm(a, a.ln(), 1.0),
        Unary::Log10 => logarithm(a, a.log10(), 1.0 / LN_10),
        Unary::Sqrt => {
            let root = a.sqrt();
            let first = 0.5 / root;
            let second = first / (-4.0 * a);
            [root, first, second, second / (-2.0 * a)]
        }
    };
    Series::Varying(series.compose(outer))
}

/// Derivatives of asin, with `sign` −1 of acos: `1/√(1−a²)` and so on.
fn arcsine(a: f64, value: f64, sign: f64) -> [f64; 4] {
    let square = 1.0 / ((1.0 - a) * (1.0 + a));
    let first = sign * square.sqrt();
    [value, first, 0.5 * a * square * first, (1.0 + 2.0 * a * a) * square * square * first / 6.0]
}

/// Derivatives of `scale·ln`.
fn logarithm(a: f64, value: f64, scale: f64) -> [f64; 4] {
    let r = 1.0 / a;
    [value, scale * r, -0.5 * scale * r * r, scale * r * r * r / 3.0]
}

/// Derivatives of `s ↦ numerator/s`.
fn reciprocal(numerator: f64, a: f64) -> [f64; 4] {
    let (value, r) = (numerator / a, 1.0 / a);
    [value, -value * r, value * r * r, -value * r * r * r]
}

/// The exponential of the series, whose value is known.
fn exponential(value: f64, exponent: Taylor) -> Taylor {
    exponent.compose([value, value, 0.5 * value, value / 6.0])
}

/// `atan2(a, b) = θ_0 + atan((a b_0 − b a_0)/(a a_0 + b b_0))`, the angle from the direction `(b_0, a_0)` at the point.
fn angle(a: Taylor, b: Taylor) -> Taylor {
    let (a0, b0) = (a.value(), b.value());
    let tangent = (a * b0 - b * a0) / (a * a0 + b * b0);
    tangent.compose([a0.atan2(b0), 1.0, 0.0, -1.0 / 3.0])
}

/// `h_0 √((a/h_0)² + (b/h_0)²)` with `h_0 = hypot(a_0, b_0)`, which neither over- nor underflows.
fn length(a: Taylor, b: Taylor) -> Taylor {
    let value = a.value().hypot(b.value());
    let (a, b) = (a.over(value), b.over(value));
    (a * a + b * b).compose([value, 0.5 * value, -0.125 * value, 0.0625 * value])
}
