//! With the density 1 everywhere and nothing that resists compression, every term is that of the incompressible sheet.

use crate::common::*;
use monolayer::mesh::Point;
use monolayer::model::compressible::{Compressible, Viscous};
use monolayer::model::incompressible::Incompressible;
use monolayer::model::parameters::PolarityForm;
use monolayer::model::{Conditions, DensityLaw, Parameters, State};
use monolayer::space::{Field, project};
use monolayer::time::sheet::Sheet;

fn without_density(tag: &str) -> Conditions {
    Conditions { density: None, ..channel(tag) }
}

/// Both sheets on a mesh, with the same spaces of velocity and polarity.
fn both(mesh: &std::sync::Arc<monolayer::mesh::Mesh>, open: bool) -> (Compressible, Incompressible) {
    let law = DensityLaw { penalty: 0.0, exponent: 1.0, critical: 0.0, active_stress_iso: 0.0 };
    let parameters = Parameters { density: Some(law), ..PARAMETERS };
    // a compressible sheet has no hybrid form
    let free = Parameters { density: None, form: PolarityForm::Direct, ..PARAMETERS };
    type Condition = fn(&str) -> Conditions;
    let (here, there): (Condition, Condition) = if open { (channel, without_density) } else { (closed, closed) };
    let incompressible = Incompressible::new(mesh, &describe(mesh, free, 2, there)).unwrap();
    (sheet(mesh, parameters, 2, here), incompressible)
}

/// A flow without divergence that the velocity space holds exactly on straight cells.
fn flow(x: Point) -> Point {
    Point::new(1.0 + x.y * x.y - x.x * x.x, 2.0 * x.x * x.y - 0.1 * x.x * x.x - 0.2)
}

#[track_caller]
fn close(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    let (error, scale) = (largest(&minus(a, b)), largest(b));
    println!("{what}: {error:.1e} of {scale:.1e}");
    assert!(scale > 1e-2 && error < tolerance * scale.max(1.0), "{what}: off by {error:.1e} of {scale:.1e}");
}

#[test]
fn with_a_density_of_one_every_term_is_that_of_the_incompressible_sheet() {
    for (mesh, open) in [(square(3), true), (square(3), false), (disc(), false)] {
        let (model, other) = both(&mesh, open);
        let (t, straight) = (0.3, mesh.curved.iter().all(Option::is_none));
        // a factor ρ asks for a rule of higher degree, and on curved cells none is exact
        let tolerance = if straight { 1e-12 } else { 1e-6 };
        let agree = |a: &[f64], b: &[f64], what: &str| close(a, b, tolerance, what);
        let p = random_field(&other.polarity.space, 5);
        let v = project::interpolate_vector(&other.momentum.velocity, flow);
        let one = project::interpolate_scalar(&model.density.space, |_| 1.0);
        let state = State::compressible(v.clone(), one.clone(), p.clone());
        let pressure = Field::zero(&other.momentum.pressure);
        let same = State::incompressible(v.clone(), pressure, p.clone());
        let (inputs, others) = (model.inputs(t).unwrap(), other.inputs(t).unwrap());
        let well = model.molecular_functional(&one, &p, t);
        agree(&well, &other.molecular_functional(&p, &v, t), "(1/B)(L_h|q)");
        let (l, m) = (Sheet::molecular_field(&model, &state, t), Sheet::molecular_field(&other, &same, t));
        agree(&l.values, &m.values, "L_h");
        // |v·n| is no polynomial where v·n changes its sign on a face: the flow is uniform there, or nothing jumps
        let uniform = project::interpolate_vector(&model.velocity, |_| Point::new(1.0, 0.3));
        let smooth =
            project::interpolate_vector(&other.polarity.space, |x| Point::new(x.y - x.x * x.y, 0.5 + x.x * x.x));
        for (p, v) in [(&p, &uniform), (&smooth, &v)] {
            let well = model.molecular_functional(&one, p, t);
            let residual = model.polarity_residual(&one, p, v, &well, &inputs);
            let same = State::incompressible(v.clone(), Field::zero(&other.momentum.pressure), p.clone());
            agree(&residual, &other.polarity_residual(&same, t), "residual of the polarity");
        }
        let force = model.force(&one, &p, model.molecular(&well).as_ref(), &inputs);
        agree(&force, &other.force(&p, &v, &others).flow, "force");
        let inertia = Sheet::inertia_times(&model, &state, &model.stacked(&one.values, &p.values));
        let inertia = &inertia[one.values.len()..];
        agree(inertia, &Sheet::inertia_times(&other, &same, &p.values), "what multiplies ∂_t p");
        // a double well of density 1 is that of the incompressible sheet
        let (here, there) = (Sheet::free_energy(&model, &state, t), Sheet::free_energy(&other, &same, t));
        agree(&[here], &[there], "free energy");
        let rate = random(p.values.len(), 6);
        let by_polarity = PARAMETERS.elasticity * dot(&well, &rate);
        agree(&[by_polarity], &[Sheet::energy_rate(&other, &same, &rate, t)], "rate of the free energy");
        // what resists the flow: on straight cells div v = 0 exactly
        if straight {
            let viscous = Viscous::new(&model, &one).unwrap().times(&model, &v.values);
            let w = random_field(&other.momentum.velocity, 9);
            let direct = other.loops.sum(8, |x| {
                let (g, h) = (v.vector_gradient(&x.site), w.vector_gradient(&x.site));
                PARAMETERS.friction * v.vector(&x.site).dot(&w.vector(&x.site))
                    + (g + g.transpose()).dot(&((h + h.transpose()) * 0.5))
            });
            agree(&[dot(&viscous, &w.values)], &[direct], "viscous force");
        }
        // nothing is squeezed
        let rate = Sheet::density_rate(&model, &state, t).unwrap();
        if !open && straight {
            // slip boundaries let nothing through, whatever the interpolated flow does there
            let whole = project::interpolate_vector(&model.velocity, |x| {
                Point::new(x.x * (1.0 - x.x) * (1.0 - 2.0 * x.y), -x.y * (1.0 - x.y) * (1.0 - 2.0 * x.x))
            });
            let closed = State::compressible(whole, one.clone(), p.clone());
            let still = largest(&Sheet::density_rate(&model, &closed, t).unwrap());
            assert!(largest(&rate) > 1e-2 && still < 1e-12, "{still:.1e}");
        }
    }
}
