//! What the forms are for a density of one, for polynomials and in a vacuum, and what the balance of mass keeps.

use super::*;
use monolayer::form::upwind::Carrier;
use monolayer::form::{
    Bilinear, Density, FacePoint, Faces, Linear, elastic, mass, polarity, stokes, swip, transport, upwind,
};
use monolayer::mesh::Point;
use monolayer::space::project;

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
    vectors(densities.map(|d| polarity::turning(p, &v, [1.0, 0.6], d)), space);
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
    matrices(densities.map(|d| polarity::turning_by_polarity(space, &v, [1.0, 0.6], d)), (&l, space));
    matrices(densities.map(|d| polarity::turning_by_flow(velocity, p, [1.0, 0.6], d)), (&s.v, space));
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
