use crate::common::*;
use monolayer::form::{Density, Faces, elastic, polarity, stokes, swip, upwind};
use monolayer::mesh::Point;
use monolayer::space::project;

#[test]
fn rotation_of_a_field_against_itself_vanishes() {
    // ω(p,p,w) = 0 for all w
    for mesh in meshes() {
        let loops = loops(&mesh);
        let velocity = continuous(&mesh, 2, 2);
        for degree in 1..=5 {
            let p = random(&discontinuous(&mesh, degree, 2), 3);
            let form = polarity::rotation_force(&velocity, &p, &p);
            let size = loops.vector(&polarity::stretching_force(&velocity, &p, &p, Density::One), &velocity);
            let worst = loops.vector(&form, &velocity).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!(worst < 1e-14 * dot(&size, &size).sqrt().max(1.0), "{worst}");
            let v = random(&velocity, 4);
            let operator = loops.triplets(
                &polarity::turning_by_polarity(&p.space, &v, [1.0, 0.0], Density::One),
                &p.space,
                &p.space,
            );
            let scale: f64 = operator.iter().map(|t| t.2.abs()).sum();
            close(apply(&operator, &p.values, &p.values), 0.0, scale, 1e-14);
        }
    }
}

#[test]
fn what_turns_the_polarity_is_what_the_molecular_field_feels() {
    // the bilinear and the linear faces of ω and δ are one trilinear form
    for mesh in meshes() {
        let loops = loops(&mesh);
        let (velocity, space) = (continuous(&mesh, 2, 2), discontinuous(&mesh, 3, 2));
        let (v, p, l) = (random(&velocity, 1), random(&space, 2), random(&space, 3));
        let pairs = [
            (
                loops.triplets(&polarity::turning_by_polarity(&space, &v, [1.0, 0.0], Density::One), &space, &space),
                polarity::rotation_force(&velocity, &p, &l),
            ),
            (
                loops.triplets(&polarity::turning_by_polarity(&space, &v, [0.0, 1.0], Density::One), &space, &space),
                polarity::stretching_force(&velocity, &p, &l, Density::One),
            ),
        ];
        let mut both = 0.0;
        for (operator, force) in pairs {
            let one = apply(&operator, &l.values, &p.values);
            let other = dot(&loops.vector(&force, &velocity), &v.values);
            close(one, other, one.abs().max(1.0), 1e-12);
            both += one;
        }
        let objective =
            loops.triplets(&polarity::turning_by_polarity(&space, &v, [1.0, 1.0], Density::One), &space, &space);
        close(apply(&objective, &l.values, &p.values), both, both.abs().max(1.0), 1e-12);
    }
}

#[test]
fn upwind_dissipation_is_half_the_squared_jumps() {
    // a_upw(φ,φ;v) + ½∫ div v φ² = ½ Σ ∫|v·n|[φ]² + ½ ∫_∂Ω |v·n| φ²
    for mesh in meshes() {
        let loops = loops(&mesh);
        let v = random(&continuous(&mesh, 2, 2), 5);
        let phi = random(&discontinuous(&mesh, 3, 1), 6);
        let form = upwind::a_upw(&phi.space, &v, Faces::BOUNDARY);
        let operator = loops.triplets(&form, &phi.space, &phi.space);
        let growth = 0.5 * loops.sum(8, |x| v.vector_gradient(&x.site).trace() * phi.scalar(&x.site).powi(2));
        let jumps = 0.5
            * loops.sum_faces(Faces::INTERIOR | Faces::BOUNDARY, 8, |s| {
                let outer = s.plus.as_ref().map_or(0.0, |plus| phi.scalar(plus));
                v.vector(&s.minus).dot(&s.n).abs() * (phi.scalar(&s.minus) - outer).powi(2)
            });
        close(apply(&operator, &phi.values, &phi.values) + growth, jumps, jumps, 1e-12);
    }
}

#[test]
fn swip_is_symmetric_and_positive() {
    for mesh in meshes() {
        let loops = loops(&mesh);
        for degree in 1..=5 {
            let space = discontinuous(&mesh, degree, 1);
            let operator = loops.triplets(&swip::a_swip(&space, Faces::BOUNDARY, Density::One), &space, &space);
            let neumann = loops.triplets(&swip::a_swip(&space, Faces::NONE, Density::One), &space, &space);
            for seed in 0..5 {
                let (a, b) = (random(&space, seed), random(&space, seed + 10));
                let (ab, ba) = (apply(&operator, &a.values, &b.values), apply(&operator, &b.values, &a.values));
                let aa = apply(&operator, &a.values, &a.values);
                close(ab, ba, aa, 1e-12);
                assert!(aa > 0.0, "degree {degree}: {aa}");
                assert!(apply(&neumann, &a.values, &a.values) > 0.0);
            }
            // constants are the kernel without Dirichlet faces, and only there
            let one = vec![1.0; space.dof_count()];
            let scale: f64 = neumann.iter().map(|t| t.2.abs()).sum();
            close(apply(&neumann, &one, &one), 0.0, scale, 1e-14);
            assert!(apply(&operator, &one, &one) > 1.0);
        }
    }
}

#[test]
fn swip_is_exact_on_polynomials() {
    // a_swip(u,χ) − l_swip(χ) = −∫ Δu χ for u = x² − 3xy + 2y², Δu = 6
    let mesh = square(4);
    let loops = loops(&mesh);
    let u = |x: Point| x.x * x.x - 3.0 * x.x * x.y + 2.0 * x.y * x.y;
    for degree in 2..=5 {
        let (scalar, vector) = (discontinuous(&mesh, degree, 1), discontinuous(&mesh, degree, 2));
        let field = project::interpolate_scalar(&scalar, u);
        let operator = loops.triplets(&swip::a_swip(&scalar, Faces::BOUNDARY, Density::One), &scalar, &scalar);
        let mut residual = vec![0.0; scalar.dof_count()];
        for (i, j, a) in operator {
            residual[i] += a * field.values[j];
        }
        let data = loops.vector(
            &swip::l_swip(&vector, Faces::BOUNDARY, Density::One, 2, |s| Point::new(u(s.minus.x), 0.0)),
            &vector,
        );
        let source = loops.vector(&monolayer::form::mass::scalar_load(&scalar, 0, |_| 6.0), &scalar);
        let scale = data.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        for cell in 0..mesh.cells.len() {
            for i in 0..scalar.n {
                let k = scalar.dof(cell, 0, i);
                let found = residual[k] - data[vector.dof(cell, 0, i)] + source[k];
                close(found, 0.0, scale, 1e-11);
                assert_eq!(data[vector.dof(cell, 1, i)], 0.0);
            }
        }
    }
}

#[test]
fn viscosity_ignores_rigid_motions_and_divergence_sees_expansion() {
    for mesh in [square(3), mesh("shape = \"disc\"\nh = 0.5\ncurved = 2")] {
        let loops = loops(&mesh);
        let (velocity, pressure) = (continuous(&mesh, 2, 2), continuous(&mesh, 1, 1));
        let rigid = project::interpolate_vector(&velocity, |x| Point::new(1.0 - x.y, 2.0 + x.x));
        let viscous = loops.triplets(&stokes::viscosity(&velocity), &velocity, &velocity);
        close(apply(&viscous, &rigid.values, &rigid.values), 0.0, viscous.iter().map(|t| t.2.abs()).sum(), 1e-14);
        // b(v, 1) = −∫ div v = −2|Ω| for v = x
        let expansion = project::interpolate_vector(&velocity, |x| x);
        let b = loops.triplets(&stokes::divergence(&velocity, &pressure), &pressure, &velocity);
        let one = vec![1.0; pressure.dof_count()];
        close(apply(&b, &expansion.values, &one), -2.0 * mesh.area(), mesh.area(), 1e-12);
    }
}

#[test]
fn the_ericksen_force_is_the_integral_of_its_stress() {
    let mesh = square(3);
    let loops = loops(&mesh);
    let (velocity, space) = (continuous(&mesh, 2, 2), discontinuous(&mesh, 3, 2));
    let (v, p) = (random(&velocity, 1), random(&space, 2));
    let force = dot(&loops.vector(&elastic::ericksen(&velocity, &p, Density::One), &velocity), &v.values);
    let direct = loops.sum(12, |x| {
        let (g, d) = (p.vector_gradient(&x.site), v.vector_gradient(&x.site));
        let mut sum = 0.0;
        for i in 0..2 {
            for j in 0..2 {
                // ∂_i p·∂_j p D_ij, written out
                sum += (g[(0, i)] * g[(0, j)] + g[(1, i)] * g[(1, j)]) * 0.5 * (d[(i, j)] + d[(j, i)]);
            }
        }
        sum
    });
    close(force, direct, direct.abs().max(1.0), 1e-12);
}
