//! Every derivative against central differences of its functional.

use super::*;
use monolayer::form::upwind::Carrier;
use monolayer::form::{Density, elastic, mass, polarity, stokes, swip, transport, upwind};

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
        let of =
            |p: &Field, v: &Field, rho: &Field| s.vector(polarity::turning(p, v, [1.0, a], Density::Of(rho)), space);
        let form = polarity::turning_by_polarity(space, v, [1.0, a], Density::Of(rho));
        s.differentiate("turning along p", &form, (p, space), |p| of(p, v, rho));
        let form = polarity::turning_by_polarity(space, v, [1.0, 0.0], Density::Of(rho))
            + a * polarity::turning_by_polarity(space, v, [0.0, 1.0], Density::Of(rho));
        s.differentiate("turning in two parts", &form, (p, space), |p| of(p, v, rho));
        let form = polarity::turning_by_flow(&v.space, p, [1.0, a], Density::Of(rho));
        s.differentiate("turning along v", &form, (v, space), |v| of(p, v, rho));
        let form = polarity::turning_by_density(p, v, [1.0, a], &rho.space);
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
            let energy = |p: &Field| {
                let polar =
                    elastic::PolarEnergy { loops: &s.loops, p, kappa, dirichlet: s.part, degree: DATA_DEGREE, data };
                polar.with(&s.rho, &c)
            };
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
