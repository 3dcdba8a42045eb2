//! The vocabulary of the forms.
//!
//! | code | mathematics |
//! | --- | --- |
//! | `phi.value`, `phi.grad` | φ, ∇φ (`grad[(i, j)] = ∂_j φ_i` for a vector) |
//! | `w.sym()`, `w.skw()`, `w.div()` | D(w) = sym ∇w, W(w) = skw ∇w, div w |
//! | `t.jump()` | `[φ] = φ− − φ+`; the inner trace on the boundary |
//! | `t.mean()` | `{φ} = ½(φ− + φ+)`; the inner trace on the boundary |
//! | `t.mean_dn(n)` | `{∂_n φ}`; the inner trace on the boundary |
//! | `rho.mean(s)` | `{ρ}`, the weight of a flux; the inner trace on the boundary |
//! | `rho.harmonic(s)` | `η = 2ρ−ρ+/(ρ− + ρ+)`, the weight in `{ρ∂_nφ}_ω = η{∂_nφ}`; the inner trace on the boundary |
//! | `negative(x)` | `x⊖ = ½(|x|−x)` |
//! | `s.n`, `s.exact_n` | normal of the face from minus to plus; normal of the exact boundary curve |
//! | `s.varpi` | `ϖ_S = max(|∂K−|/|K−|, |∂K+|/|K+|)` |
//! | `penalty_constant(q)` | `C = (q+1)(q+2)/2` |

use nalgebra::Matrix2;

use crate::mesh::Point;
use crate::space::Field;
use crate::space::field::Site;

/// Value and first derivatives of a basis function at a point: the arguments of an integrand.
pub trait Jet: Copy {
    /// Numbers in a jet: three per component.
    const SLOTS: usize;
    /// The jet that is one in one slot: slot `3c` the value of component `c`, slots `3c+1`, `3c+2` its derivatives.
    fn unit(slot: usize) -> Self;
    /// The zero jet.
    fn zero() -> Self;
    /// The slots of a field at a point; those that the jet does not have are zero.
    fn slots(field: &Field, site: &Site) -> [f64; 6];
}

/// Jet of a scalar function.
#[derive(Debug, Clone, Copy)]
pub struct Scalar {
    /// φ
    pub value: f64,
    /// ∇φ
    pub grad: Point,
}

/// Jet of a vector function.
#[derive(Debug, Clone, Copy)]
pub struct Vector {
    /// w
    pub value: Point,
    /// ∇w, `(∇w)_ij = ∂_j w_i`
    pub grad: Matrix2<f64>,
}

impl Jet for Scalar {
    const SLOTS: usize = 3;

    fn unit(slot: usize) -> Self {
        let one = |k| f64::from(u8::from(slot == k));
        Self { value: one(0), grad: Point::new(one(1), one(2)) }
    }

    fn zero() -> Self {
        Self { value: 0.0, grad: Point::zeros() }
    }

    fn slots(field: &Field, site: &Site) -> [f64; 6] {
        let slope = field.scalar_gradient(site);
        [field.scalar(site), slope.x, slope.y, 0.0, 0.0, 0.0]
    }
}

impl Jet for Vector {
    const SLOTS: usize = 6;

    fn unit(slot: usize) -> Self {
        let one = |k| f64::from(u8::from(slot == k));
        Self { value: Point::new(one(0), one(3)), grad: Matrix2::new(one(1), one(2), one(4), one(5)) }
    }

    fn zero() -> Self {
        Self { value: Point::zeros(), grad: Matrix2::zeros() }
    }

    fn slots(field: &Field, site: &Site) -> [f64; 6] {
        let (v, slope) = (field.vector(site), field.vector_gradient(site));
        [v.x, slope[(0, 0)], slope[(0, 1)], v.y, slope[(1, 0)], slope[(1, 1)]]
    }
}

impl Vector {
    /// `D(w) = ½(∇w + ∇wᵀ)`.
    pub fn sym(&self) -> Matrix2<f64> {
        sym(&self.grad)
    }

    /// `W(w) = ½(∇w − ∇wᵀ)`.
    pub fn skw(&self) -> Matrix2<f64> {
        skw(&self.grad)
    }

    /// `div w`.
    pub fn div(&self) -> f64 {
        self.grad.trace()
    }
}

/// Symmetric part.
pub fn sym(g: &Matrix2<f64>) -> Matrix2<f64> {
    (g + g.transpose()) * 0.5
}

/// Skew part, `W_ij = ½(∂_j v_i − ∂_i v_j)` for `g_ij = ∂_j v_i`.
pub fn skw(g: &Matrix2<f64>) -> Matrix2<f64> {
    (g - g.transpose()) * 0.5
}

/// The two traces of a function on a face; on the boundary only `minus` counts.
#[derive(Debug, Clone, Copy)]
pub struct Trace<J> {
    /// From the side that the normal leaves.
    pub minus: J,
    /// From the other side; zero on the boundary.
    pub plus: J,
    /// Whether there is no other side: jump and mean are then those of the boundary.
    pub boundary: bool,
}

impl Trace<Scalar> {
    /// `[φ]`.
    pub fn jump(&self) -> f64 {
        if self.boundary { self.minus.value } else { self.minus.value - self.plus.value }
    }

    /// `{φ}`.
    pub fn mean(&self) -> f64 {
        if self.boundary { self.minus.value } else { 0.5 * (self.minus.value + self.plus.value) }
    }

    /// `{∂_n φ}`.
    pub fn mean_dn(&self, n: Point) -> f64 {
        let inner = self.minus.grad.dot(&n);
        if self.boundary { inner } else { 0.5 * (inner + self.plus.grad.dot(&n)) }
    }
}

impl Trace<Vector> {
    /// `[φ]`.
    pub fn jump(&self) -> Point {
        if self.boundary { self.minus.value } else { self.minus.value - self.plus.value }
    }

    /// `{φ}`.
    pub fn mean(&self) -> Point {
        if self.boundary { self.minus.value } else { (self.minus.value + self.plus.value) * 0.5 }
    }

    /// `{∂_n φ}`.
    pub fn mean_dn(&self, n: Point) -> Point {
        let inner = self.minus.grad * n;
        if self.boundary { inner } else { (inner + self.plus.grad * n) * 0.5 }
    }
}

/// `x⊖ = ½(|x| − x)`.
pub fn negative(x: f64) -> f64 {
    (-x).max(0.0)
}

/// `C = (q+1)(q+2)/2`, the interior-penalty constant of degree `q` [6.25].
pub fn penalty_constant(q: usize) -> f64 {
    0.5 * ((q + 1) * (q + 2)) as f64
}
