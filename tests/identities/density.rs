//! Forms that carry a density.

mod derivatives;
mod values;

use std::sync::Arc;

use crate::common::*;
use monolayer::form::compression::Compression;
use monolayer::form::words::Jet;
use monolayer::form::{Bilinear, Density, FacePoint, Faces, Integrator, Linear, swip};
use monolayer::mesh::{Mesh, Point};
use monolayer::space::{Field, Space};

const DATA_DEGREE: usize = 3;

/// Polarity on the boundary.
fn data(s: &FacePoint) -> Point {
    Point::new(0.3 + s.minus.x.y, s.minus.x.x * s.minus.x.y - 0.2)
}

/// Density that flows in.
fn incoming(s: &FacePoint) -> f64 {
    0.7 + 0.2 * s.minus.x.x
}

/// Independent coefficients in [½, 3/2]: with degree 1, a density of that range, and one that jumps.
fn positive(space: &Arc<Space>, seed: u64) -> Field {
    let mut field = random(space, seed);
    field.values.iter_mut().for_each(|v| *v = 1.0 + 0.5 * *v);
    field
}

/// A sheet on one mesh in no special state.
struct Sheet {
    loops: Integrator,
    v: Field,
    rho: Field,
    p: Field,
    /// Part of the boundary: where the polarity is given, and where mass passes.
    part: Faces,
}

impl Sheet {
    fn new(mesh: &Arc<Mesh>, k: usize) -> Self {
        let v = random(&continuous(mesh, k + 1, 2), 1);
        let (rho, p) = (positive(&discontinuous(mesh, k, 1), 2), random(&discontinuous(mesh, k + 1, 2), 3));
        Self { loops: loops(mesh), v, rho, p, part: Faces::tag(0) }
    }

    /// Straight, curved, and of higher degree.
    fn all() -> Vec<Sheet> {
        vec![Sheet::new(&square(2), 1), Sheet::new(&mesh("shape = \"disc\"\nh = 0.9"), 1), Sheet::new(&square(2), 2)]
    }

    /// `form` as a matrix times `change` is the central difference of `functional` along `change`, at `from`.
    #[track_caller]
    fn differentiate<U: Jet, V: Jet>(
        &self,
        what: &str,
        form: &Bilinear<U, V>,
        (from, test): (&Field, &Arc<Space>),
        functional: impl Fn(&Field) -> Vec<f64>,
    ) {
        let matrix = self.loops.triplets(form, &from.space, test);
        for seed in 10..12 {
            let change = random(&from.space, seed);
            let product = times(&matrix, test.dof_count(), &change.values);
            let h = 1e-5;
            let at = |h: f64| functional(&plus(from, h, &change));
            let largest = product.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!(largest > 1e-3, "{what}: the derivative is there");
            for (i, (a, (right, left))) in product.iter().zip(at(h).iter().zip(at(-h))).enumerate() {
                let difference = (right - left) / (2.0 * h);
                assert!(
                    (a - difference).abs() < 1e-8 * largest.max(1.0),
                    "{what}, row {i}: {a}, difference {difference}"
                );
            }
        }
    }

    fn vector<V: Jet>(&self, form: Linear<V>, test: &Space) -> Vec<f64> {
        self.loops.vector(&form, test)
    }

    /// `a_swip(p,q;ρ) − l_swip(q;ρ)` as a functional of q.
    fn diffusion(&self, p: &Field, rho: &Field) -> Vec<f64> {
        let scalar = discontinuous(&p.space.mesh, p.space.degree, 1);
        let form = swip::a_swip(&scalar, self.part, Density::Of(rho));
        let mut out = times_alike(&self.loops.triplets(&form, &scalar, &scalar), p);
        let imposed = swip::l_swip(&p.space, self.part, Density::Of(rho), DATA_DEGREE, data);
        out.iter_mut().zip(self.loops.vector(&imposed, &p.space)).for_each(|(out, g)| *out -= g);
        out
    }
}

fn plus(a: &Field, h: f64, b: &Field) -> Field {
    Field::new(&a.space, a.values.iter().zip(&b.values).map(|(a, b)| a + h * b).collect())
}

fn times(matrix: &[(usize, usize, f64)], rows: usize, x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; rows];
    matrix.iter().for_each(|&(i, j, a)| out[i] += a * x[j]);
    out
}

/// A matrix of scalars times each component of a discontinuous vector field.
fn times_alike(matrix: &[(usize, usize, f64)], p: &Field) -> Vec<f64> {
    let n = p.space.n;
    let mut out = vec![0.0; p.values.len()];
    for &(i, j, a) in matrix {
        for c in 0..2 {
            let of = |k: usize| (k / n * 2 + c) * n + k % n;
            out[of(i)] += a * p.values[of(j)];
        }
    }
    out
}

fn compressions() -> [Compression; 3] {
    let all = Compression { penalty: 0.8, exponent: 1.5, elasticity: 0.7, critical: 0.4, active: -0.3 };
    [all, Compression { exponent: 2.0, ..all }, Compression { exponent: 0.0, active: 0.0, ..all }]
}
