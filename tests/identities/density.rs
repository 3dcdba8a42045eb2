//! Forms that carry a density: their derivatives, what they are for a density of one, and what the balance of mass keeps.

use std::sync::Arc;

use crate::common::*;
use monolayer::form::compression::Compression;
use monolayer::form::upwind::Carrier;
use monolayer::form::words::Jet;
use monolayer::form::{
    Bilinear, Density, FacePoint, Faces, Integrator, Linear, elastic, mass, polarity, stokes, swip, transport, upwind,
};
use monolayer::mesh::{Mesh, Point};
use monolayer::space::{Field, Space, project};

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

#[test]
fn the_transport_of_mass_has_the_derivatives_of_its_forms() {
    for s in Sheet::all() {
        let (v, rho, space) = (&s.v, &s.rho, &s.rho.space);
        let along = |rho: &Field, v: &Field| s.vector(transport::transport(rho, v, s.part, incoming), space);
        let form = transport::a_mass(space, v, s.part);
        s.differentiate("a_mass along ρ", &form, (rho, space), |rho| along(rho, v));
        let form = transport::transport_by_flow(rho, v, s.part, incoming);
        s.differentiate("a_mass along v", &form, (v, space), |v| along(rho, v));

        // the parts: a_mass(ρ,z) − l_mass(z)
        let matrix = s.loops.triplets(&transport::a_mass(space, v, s.part), space, space);
        let brought = s.vector(transport::l_mass(space, v, s.part, incoming), space);
        for ((a, l), both) in times(&matrix, space.dof_count(), &rho.values).iter().zip(brought).zip(along(rho, v)) {
            close(a - l, both, 1.0, 1e-13);
        }
    }
}

#[test]
fn rows_of_the_derivatives_along_the_flow_see_their_own_cell_alone() {
    for s in Sheet::all() {
        let carrier = Carrier { density: Density::Of(&s.rho), ..Carrier::from(&s.v) };
        let spaces = [&s.rho.space, &s.p.space].map(|test| {
            let size = test.cell_dof_count() * s.v.space.cell_dof_count() * test.mesh.cells.len();
            (test, vec![0.0; size], vec![0.0; 3 * size])
        });
        for (test, mut own, mut off) in spaces {
            if test.components == 1 {
                let form = transport::transport_by_flow(&s.rho, &s.v, s.part, incoming);
                s.loops.add_rows(&form, (&s.v.space, test), &mut own, &mut off);
            } else {
                let form = upwind::advection_by_flow(&s.p, carrier, s.part, data);
                s.loops.add_rows(&form, (&s.v.space, test), &mut own, &mut off);
            }
            assert!(own.iter().any(|a| a.abs() > 0.01) && off.iter().all(|a| *a == 0.0));
        }
    }
}

#[test]
fn the_advection_of_polarity_has_the_derivatives_of_its_forms() {
    for s in Sheet::all() {
        let (v, rho, p, space) = (&s.v, &s.rho, &s.p, &s.p.space);
        let carrier = Carrier { density: Density::Of(rho), ..Carrier::from(v) };
        let of = |p: &Field, v: &Field, rho: &Field| {
            let carrier = Carrier { density: Density::Of(rho), ..Carrier::from(v) };
            s.vector(upwind::advection(p, carrier, s.part, data), space)
        };
        let form = upwind::advection_by_density(p, v, &rho.space, s.part, data);
        s.differentiate("advection along ρ", &form, (rho, space), |rho| of(p, v, rho));
        let form = upwind::advection_by_flow(p, carrier, s.part, data);
        s.differentiate("advection along v", &form, (v, space), |v| of(p, v, rho));

        // affine in p: a_upw(p,q;ρv) − l_upw(q;ρv); the data are of degree 2, below that of p on the left
        let scalar = discontinuous(&p.space.mesh, space.degree, 1);
        let matrix = s.loops.triplets(&upwind::a_upw(&scalar, carrier, s.part), &scalar, &scalar);
        let brought = s.vector(upwind::l_upw(space, carrier, s.part, space.degree, data), space);
        for ((a, l), both) in times_alike(&matrix, p).iter().zip(brought).zip(of(p, v, rho)) {
            close(a - l, both, 1.0, 1e-13);
        }
    }
}

#[test]
fn the_molecular_field_has_the_derivatives_of_its_forms() {
    let critical = 0.4;
    for s in Sheet::all() {
        let (rho, p, space) = (&s.rho, &s.p, &s.p.space);
        let well = |p: &Field, rho: &Field| s.vector(elastic::double_well(space, p, Density::Of(rho), critical), space);
        let form = elastic::double_well_tangent(space, p, Density::Of(rho), critical);
        s.differentiate("double well along p", &form, (p, space), |p| well(p, rho));
        let form = elastic::double_well_by_density(p, &rho.space);
        s.differentiate("double well along ρ", &form, (rho, space), |rho| well(p, rho));
        let form = swip::by_density(p, rho, s.part, DATA_DEGREE, data);
        s.differentiate("diffusion along ρ", &form, (rho, space), |rho| s.diffusion(p, rho));
    }
}

#[test]
fn turning_and_inertia_have_the_derivatives_of_their_forms() {
    let a = 0.6;
    for s in Sheet::all() {
        let (v, rho, p, space) = (&s.v, &s.rho, &s.p, &s.p.space);
        let of = |p: &Field, v: &Field, rho: &Field| s.vector(polarity::turning(p, v, a, Density::Of(rho)), space);
        let form = polarity::objective(space, v, a, Density::Of(rho));
        s.differentiate("turning along p", &form, (p, space), |p| of(p, v, rho));
        let form =
            polarity::rotation(space, v, Density::Of(rho)) + a * polarity::stretching(space, v, Density::Of(rho));
        s.differentiate("turning in two parts", &form, (p, space), |p| of(p, v, rho));
        let form = polarity::turning_by_flow(&v.space, p, a, Density::Of(rho));
        s.differentiate("turning along v", &form, (v, space), |v| of(p, v, rho));
        let form = polarity::turning_by_density(p, v, a, &rho.space);
        s.differentiate("turning along ρ", &form, (rho, space), |rho| of(p, v, rho));

        let rate = random(space, 9);
        let form = mass::load_by_density(space, &rho.space, space.degree, |x| rate.vector(&x.site));
        let degree = rho.space.degree + space.degree;
        s.differentiate("inertia along ρ", &form, (rho, space), |rho| {
            s.vector(mass::load(space, degree, |x| rate.vector(&x.site) * rho.scalar(&x.site)), space)
        });
    }
}

#[test]
fn the_force_has_the_derivatives_of_its_forms() {
    for s in Sheet::all() {
        let (v, rho, p, velocity) = (&s.v, &s.rho, &s.p, &s.v.space);
        let elastic_force =
            |p: &Field, rho: &Field| s.vector(elastic::ericksen(velocity, p, Density::Of(rho)), velocity);
        let form = elastic::ericksen_tangent(velocity, p, Density::Of(rho));
        s.differentiate("c_h along p", &form, (p, velocity), |p| elastic_force(p, rho));
        let form = elastic::ericksen_by_density(velocity, p, &rho.space);
        s.differentiate("c_h along ρ", &form, (rho, velocity), |rho| elastic_force(p, rho));

        let active =
            |p: &Field, rho: &Field| s.vector(polarity::stretching_force(velocity, p, p, Density::Of(rho)), velocity);
        let form = 2.0 * polarity::force_by_field(velocity, p, 0.0, 1.0, Density::Of(rho));
        s.differentiate("active stress along p", &form, (p, velocity), |p| active(p, rho));
        let form = polarity::stretching_force_by_density(velocity, p, &rho.space);
        s.differentiate("active stress along ρ", &form, (rho, velocity), |rho| active(p, rho));

        let form = stokes::viscosity_by_density(v, &rho.space);
        s.differentiate("viscosity along ρ", &form, (rho, velocity), |rho| {
            let matrix = s.loops.triplets(&stokes::weighted_viscosity(velocity, rho), velocity, velocity);
            times(&matrix, velocity.dof_count(), &v.values)
        });

        for c in compressions() {
            let isotropic = |p: &Field, rho: &Field| s.vector(c.force(velocity, rho, p), velocity);
            let form = c.by_polarity(velocity, rho, p);
            s.differentiate("isotropic stress along p", &form, (p, velocity), |p| isotropic(p, rho));
            let form = c.by_density(velocity, rho, p);
            s.differentiate("isotropic stress along ρ", &form, (rho, velocity), |rho| isotropic(p, rho));
        }
    }
}

#[test]
fn the_molecular_field_is_the_derivative_of_the_energy() {
    let kappa = 0.3;
    for s in Sheet::all() {
        for c in compressions() {
            let energy = |p: &Field| elastic::energy_of(&s.loops, (&s.rho, p), &c, kappa, s.part, DATA_DEGREE, data);
            let well = elastic::double_well(&s.p.space, &s.p, Density::Of(&s.rho), c.critical);
            let mut l = s.vector(well, &s.p.space);
            l.iter_mut().zip(s.diffusion(&s.p, &s.rho)).for_each(|(l, d)| *l += kappa * kappa * d);
            for seed in 20..24 {
                // of fourth degree in the step: this combination of four values is its derivative, without an error
                let change = random(&s.p.space, seed);
                let at = |h: f64| energy(&plus(&s.p, h, &change));
                let slope = (8.0 * (at(0.5) - at(-0.5)) - (at(1.0) - at(-1.0))) / 6.0;
                close(c.elasticity * dot(&l, &change.values), slope, slope.abs().max(1.0), 1e-12);
            }
        }
    }
}

#[test]
fn the_energy_of_crowding_has_the_pressure_of_the_stress() {
    for c in compressions() {
        for rho in [0.05, 0.3, 1.0, 2.5] {
            let h = 1e-5 * rho;
            let slope = (c.potential(rho + h) - c.potential(rho - h)) / (2.0 * h);
            close(rho * slope - c.potential(rho), c.stress(rho, 0.0), 1.0, 1e-8);
        }
        assert_eq!((c.potential(0.0), c.stress(0.0, 0.0)), (0.0, 0.0));
        assert!(c.stress_by_density(0.0, 0.0).is_finite());
    }
}

/// Flow along one direction, so that no face is crossed both ways and `|v·n|` is a polynomial on it.
fn one_way(velocity: &Arc<Space>) -> Field {
    project::interpolate_vector(velocity, |x| Point::new(1.0, 0.37) * (1.0 + x.x * x.y))
}

#[track_caller]
fn alike(a: &[f64], b: &[f64]) {
    let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(largest > 1e-3);
    a.iter().zip(b).for_each(|(a, b)| close(*a, *b, largest, 1e-13));
}

#[test]
fn a_density_of_one_is_no_density() {
    // the field has a degree, so the rules differ and the integrands have to be polynomials
    let s = Sheet::new(&square(2), 1);
    let (velocity, space, scalar) = (&s.v.space, &s.p.space, discontinuous(&s.v.space.mesh, 2, 1));
    let (v, p, l) = (one_way(velocity), &s.p, random(space, 7));
    let one = project::interpolate_scalar(&s.rho.space, |_| 1.0);
    let densities = [Density::One, Density::Of(&one)];
    let carriers = densities.map(|density| Carrier { density, ..Carrier::from(&v) });
    let g = |_: &FacePoint| Point::new(0.4, -0.9);

    let vectors = |forms: [Linear<_>; 2], test: &Space| {
        let [a, b] = forms.map(|form| s.loops.vector(&form, test));
        alike(&a, &b);
    };
    vectors(densities.map(|d| swip::l_swip(space, s.part, d, 0, g)), space);
    vectors(densities.map(|d| elastic::double_well(space, p, d, 0.0)), space);
    vectors(densities.map(|d| polarity::turning(p, &v, 0.6, d)), space);
    vectors(densities.map(|d| elastic::ericksen(velocity, p, d)), velocity);
    vectors(densities.map(|d| polarity::stretching_force(velocity, p, &l, d)), velocity);
    vectors(carriers.map(|c| upwind::advection(p, c, s.part, g)), space);
    vectors(carriers.map(|c| upwind::l_upw(space, c, Faces::BOUNDARY, 0, g)), space);

    let matrices = |forms: [Bilinear<_, _>; 2], (trial, test): (&Field, &Space)| {
        let [a, b] = forms.map(|f| times(&s.loops.triplets(&f, &trial.space, test), test.dof_count(), &trial.values));
        alike(&a, &b);
    };
    matrices(densities.map(|d| elastic::double_well_tangent(space, p, d, 0.0)), (&l, space));
    matrices(densities.map(|d| elastic::ericksen_tangent(velocity, p, d)), (&l, velocity));
    matrices(densities.map(|d| polarity::rotation(space, &v, d)), (&l, space));
    matrices(densities.map(|d| polarity::stretching(space, &v, d)), (&l, space));
    matrices(densities.map(|d| polarity::objective(space, &v, 0.6, d)), (&l, space));
    matrices(densities.map(|d| polarity::turning_by_flow(velocity, p, 0.6, d)), (&s.v, space));
    matrices(densities.map(|d| polarity::force_by_field(velocity, p, 0.3, 0.6, d)), (&l, velocity));
    matrices(carriers.map(|c| upwind::advection_by_flow(p, c, s.part, g)), (&s.v, space));

    let phi = random(&scalar, 8);
    let scalars = |forms: [Bilinear<_, _>; 2]| {
        let [a, b] = forms.map(|f| times(&s.loops.triplets(&f, &scalar, &scalar), phi.values.len(), &phi.values));
        alike(&a, &b);
    };
    scalars(densities.map(|d| swip::a_swip(&scalar, s.part, d)));
    scalars(carriers.map(|c| upwind::a_upw(&scalar, c, s.part)));
}

#[test]
fn mass_leaves_through_open_boundaries_alone() {
    // z = 1: ∫_Γ (v·n)⊕ ρ − (v·n)⊖ g, and nothing where all is closed
    for mesh in meshes() {
        let s = Sheet::new(&mesh, 1);
        for open in [Faces::NONE, s.part, Faces::BOUNDARY] {
            let lost: f64 = s.vector(transport::transport(&s.rho, &s.v, open, incoming), &s.rho.space).iter().sum();
            let flux = s.loops.sum_faces(open, 2 * s.rho.space.degree + s.v.space.degree, |x| {
                let vn = s.v.vector(&x.minus).dot(&x.n);
                vn * if vn > 0.0 { s.rho.scalar(&x.minus) } else { incoming(x) }
            });
            let through = s.loops.sum_faces(Faces::BOUNDARY, 6, |x| s.v.vector(&x.minus).dot(&x.n).abs());
            assert!(open == Faces::NONE || flux.abs() > 1e-3 * through);
            close(lost, flux, through, 1e-13);
        }
    }
}

#[test]
fn an_incompressible_flow_carries_a_constant_density_unchanged() {
    let mesh = square(3);
    for k in 1..=3 {
        let (velocity, space) = (continuous(&mesh, k + 1, 2), discontinuous(&mesh, k, 1));
        // ψ = x²y + xy − y
        let v = project::interpolate_vector(&velocity, |x| match k {
            1 => Point::new(x.x - 1.0, -x.y),
            _ => Point::new(x.x * x.x + x.x - 1.0, -2.0 * x.x * x.y - x.y),
        });
        let rho = project::interpolate_scalar(&space, |_| 1.7);
        let all_open = loops(&mesh).vector(&transport::transport(&rho, &v, Faces::BOUNDARY, |_| 1.7), &space);
        all_open.iter().for_each(|r| close(*r, 0.0, 1.0, 1e-14));
        let closed = loops(&mesh).vector(&transport::transport(&rho, &v, Faces::NONE, |_| 1.7), &space);
        let on_boundary = |cell: usize| mesh.cell_faces[cell].iter().any(|&f| mesh.faces[f].tag.is_some());
        let (mut inner, mut outer) = (0.0_f64, 0.0_f64);
        for (cell, rows) in closed.chunks(space.n).enumerate() {
            let to = if on_boundary(cell) { &mut outer } else { &mut inner };
            *to = rows.iter().fold(*to, |m, r| m.max(r.abs()));
        }
        assert!(inner < 1e-14 && outer > 1e-3, "inside {inner:e}, at the boundary {outer:e}");
    }
}

#[test]
fn upwind_dissipation_with_a_density_is_half_the_squared_jumps() {
    // a_upw(φ,φ;ρv) + ½∫ div(ρv) φ² = ½ Σ ∫ {ρ}|v·n|[φ]² + ½ Σ ∫ (v·n)[ρ]{φ²} + ½ ∫_∂Ω ρ|v·n| φ²
    for mesh in meshes() {
        let s = Sheet::new(&mesh, 1);
        let phi = random(&discontinuous(&mesh, 3, 1), 6);
        let carrier = Carrier { density: Density::Of(&s.rho), ..Carrier::from(&s.v) };
        let form = upwind::a_upw(&phi.space, carrier, Faces::BOUNDARY);
        let operator = s.loops.triplets(&form, &phi.space, &phi.space);
        let growth = 0.5
            * s.loops.sum(8, |x| {
                let (v, g) = (s.v.vector(&x.site), s.v.vector_gradient(&x.site));
                let divergence = s.rho.scalar(&x.site) * g.trace() + v.dot(&s.rho.scalar_gradient(&x.site));
                divergence * phi.scalar(&x.site).powi(2)
            });
        let jumps = 0.5
            * s.loops.sum_faces(Faces::INTERIOR | Faces::BOUNDARY, 9, |x| {
                let (vn, a, rho) = (s.v.vector(&x.minus).dot(&x.n), phi.scalar(&x.minus), s.rho.scalar(&x.minus));
                let Some(plus) = &x.plus else { return rho * vn.abs() * a * a };
                let (b, other) = (phi.scalar(plus), s.rho.scalar(plus));
                0.5 * (rho + other) * vn.abs() * (a - b).powi(2) + vn * (rho - other) * 0.5 * (a * a + b * b)
            });
        close(apply(&operator, &phi.values, &phi.values) + growth, jumps, jumps, 1e-12);
    }
}

#[test]
fn weighted_diffusion_is_exact_on_polynomials() {
    // a_swip(u,χ;ρ) − l_swip(χ;ρ) = −∫ div(ρ∇u) χ for u = x² − 3xy + 2y², ρ = 1 + x/2 − y/3
    let mesh = square(4);
    let s = Sheet { rho: project::interpolate_scalar(&discontinuous(&mesh, 1, 1), density), ..Sheet::new(&mesh, 1) };
    fn density(x: Point) -> f64 {
        1.0 + 0.5 * x.x - x.y / 3.0
    }
    let u = |x: Point| x.x * x.x - 3.0 * x.x * x.y + 2.0 * x.y * x.y;
    for degree in 2..=4 {
        let (scalar, vector) = (discontinuous(&mesh, degree, 1), discontinuous(&mesh, degree, 2));
        let field = project::interpolate_vector(&vector, |x| Point::new(u(x), 0.0));
        let form = swip::a_swip(&scalar, Faces::BOUNDARY, Density::Of(&s.rho));
        let mut residual = times_alike(&s.loops.triplets(&form, &scalar, &scalar), &field);
        let imposed = swip::l_swip(&vector, Faces::BOUNDARY, Density::Of(&s.rho), 2, |s| Point::new(u(s.minus.x), 0.0));
        let source = mass::load(&vector, 1, |x| {
            let x = x.site.x;
            let slope = Point::new(2.0 * x.x - 3.0 * x.y, 4.0 * x.y - 3.0 * x.x);
            Point::new(6.0 * density(x) + slope.dot(&Point::new(0.5, -1.0 / 3.0)), 0.0)
        });
        let data = s.vector(imposed, &vector);
        let scale = data.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        residual.iter_mut().zip(data).zip(s.vector(source, &vector)).for_each(|((r, g), f)| *r += f - g);
        residual.iter().for_each(|r| close(*r, 0.0, scale, 1e-11));
    }
}

#[test]
fn weighted_diffusion_is_symmetric_and_stops_at_a_vacuum() {
    for mesh in meshes() {
        let mut s = Sheet::new(&mesh, 1);
        // half of the cells are empty
        for (cell, rho) in s.rho.values.chunks_mut(3).enumerate() {
            if cell % 2 == 0 {
                rho.fill(0.0);
            }
        }
        let space = discontinuous(&mesh, 2, 1);
        let form = swip::a_swip(&space, Faces::BOUNDARY, Density::Of(&s.rho));
        let operator = s.loops.triplets(&form, &space, &space);
        assert!(operator.iter().all(|t| t.2.is_finite()));
        let (mut a, b) = (random(&space, 4), random(&space, 5));
        let size = apply(&operator, &a.values, &a.values);
        close(apply(&operator, &a.values, &b.values), apply(&operator, &b.values, &a.values), size, 1e-12);
        assert!(size > 0.0);
        let cells = a.values.chunks_mut(space.n).enumerate();
        cells.filter(|(cell, _)| cell % 2 == 1).for_each(|(_, values)| values.fill(0.0));
        assert_eq!(apply(&operator, &a.values, &a.values), 0.0, "what varies in empty cells costs nothing");
        let by_density = swip::by_density(&s.p, &s.rho, s.part, DATA_DEGREE, data);
        assert!(s.loops.triplets(&by_density, &s.rho.space, &s.p.space).iter().all(|t| t.2.is_finite()));
    }
}

#[test]
fn forces_are_the_integrals_of_their_stresses() {
    let s = Sheet::new(&square(3), 1);
    let (v, w) = (&s.v, random(&s.v.space, 30));
    let matrix = s.loops.triplets(&stokes::weighted_viscosity(&v.space, &s.rho), &v.space, &v.space);
    let direct = s.loops.sum(8, |x| {
        let (g, h) = (v.vector_gradient(&x.site), w.vector_gradient(&x.site));
        let mut sum = g.trace() * h.trace();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            sum += 0.25 * (g[(i, j)] + g[(j, i)]) * (h[(i, j)] + h[(j, i)]);
        }
        2.0 * s.rho.scalar(&x.site) * sum
    });
    close(apply(&matrix, &w.values, &v.values), direct, direct.abs().max(1.0), 1e-12);

    let c = Compression { exponent: 2.0, ..compressions()[0] };
    let force = dot(&s.vector(c.force(&v.space, &s.rho, &s.p), &v.space), &w.values);
    let direct = s.loops.sum(8, |x| {
        let (rho, p) = (s.rho.scalar(&x.site), s.p.vector(&x.site));
        let stress = c.penalty * rho * rho * rho + (c.active * rho - 0.5 * c.elasticity * c.critical) * p.dot(&p);
        -stress * w.vector_gradient(&x.site).trace()
    });
    close(force, direct, direct.abs().max(1.0), 1e-12);
}
