//! The polarity in hybrid form: against its primal form, its derivative, and its condensed matrix.

use std::sync::Arc;

use crate::common::*;
use crate::model::{PARAMETERS, formula};
use monolayer::form::words::{Trace, Vector, penalty_constant};
use monolayer::form::{FacePoint, Faces, Linear};
use monolayer::mesh::{Mesh, Point};
use monolayer::model::condensed::Condensed;
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::lagged::Lagged;
use monolayer::model::parameters::PolarityForm;
use monolayer::model::tangent::HybridTangent;
use monolayer::model::terms::{At, factor};
use monolayer::model::{Conditions, Description, ElasticForce, Parameters, VelocityCondition};
use monolayer::solve::multifrontal::Precision;
use monolayer::space::{Field, Traces, project};

/// Dirichlet at the left with a polarity that flows in, slip with Dirichlet polarity below, traction at the right, slip
/// above.
fn mixed(tag: &str) -> Conditions {
    let data = || [formula("0.7 + y"), formula("x - 0.2")];
    match tag {
        "left" => Conditions::flow([formula("1 + y"), formula("0.3")]).with_polarity(data()),
        "bottom" => Conditions::slip().with_polarity(data()),
        "right" => Conditions::new(VelocityCondition::Traction([formula("0.1"), formula("y")])),
        _ => Conditions::slip(),
    }
}

fn build(mesh: &Arc<Mesh>, form: PolarityForm, condition: fn(&str) -> Conditions) -> Incompressible {
    let factors = PARAMETERS.factors.with("flow_alignment", 0.7);
    let parameters = Parameters { form, factors, ..PARAMETERS };
    let model = Incompressible::new(mesh, &Description::new(mesh, parameters, condition)).expect("the model builds");
    assert_eq!(model.polarity.hybrid().is_some(), form == PolarityForm::Hybrid);
    model
}

fn hybrids() -> Vec<Incompressible> {
    let slip: fn(&str) -> Conditions = |_| Conditions::slip();
    let on = |(mesh, condition)| build(&mesh, PolarityForm::Hybrid, condition);
    [(square(2), mixed as fn(&str) -> Conditions), (disc(), slip), (meshes().remove(2), slip)].map(on).into()
}

/// A state that solves nothing.
fn state(model: &Incompressible, seed: u64) -> State {
    let p = random(&model.polarity.space, seed);
    State::incompressible(random(&model.momentum.velocity, seed + 1), random(&model.momentum.pressure, seed + 2), p)
}

#[track_caller]
fn agree(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let off = a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    println!("{what}: off by {off:.1e} of {size:.1e}");
    assert!(size > 1e-3 && off < tolerance * size, "{what}: off by {off:.1e} of {size:.1e}");
}

/// `[∂_np]` and `[∂_nq]` on an inner face.
fn slopes(p: &Field, s: &FacePoint) -> Point {
    let plus = s.plus.as_ref().expect("an inner face");
    (p.vector_gradient(&s.minus) - p.vector_gradient(plus)) * s.n
}

fn slopes_of(q: &Trace<Vector>, n: Point) -> Point {
    (q.minus.grad - q.plus.grad) * n
}

/// Where `|v·n|` and n are constant on a face, the traces are `{p} − κ²[∂_np]/(2τ)`, and the method is the interior
/// penalty method with upwind fluxes and two terms more:
/// `−Σ ∫ (κ⁴/2τ)[∂_np]·[∂_nq] − Pe Σ ∫ (v·n)(κ²/2τ)[∂_np]·[q]`; the molecular field, which has the traces but not
/// their rows, has `Σ ∫ {κ²δ·[∂_nq] + κ²(τ_κ/τ − 1)[∂_np]·{q}}` with `δ = p̂ − {p}`   [tissue.md, section 10]
#[test]
fn with_the_traces_eliminated_it_is_the_primal_form_with_two_terms_more() {
    for mesh in [square(2), square(3)] {
        let [hybrid, direct] = [PolarityForm::Hybrid, PolarityForm::Direct].map(|form| build(&mesh, form, mixed));
        let v = project::interpolate_vector(&hybrid.momentum.velocity, |_| Point::new(0.8, -0.3));
        let p = random(&hybrid.polarity.space, 4);
        let (kappa2, pe) = (PARAMETERS.coherence.powi(2), PARAMETERS.peclet);
        let c = penalty_constant(p.space.degree);
        let weights = |s: &FacePoint| {
            let (own, through) = (2.0 * kappa2 * c * s.varpi, pe * v.vector(&s.minus).dot(&s.n));
            (own, own + through.abs(), through)
        };
        let more = Linear::zero().faces(Faces::INTERIOR, 8, |s| {
            let ((_, tau, through), slope, n) = (weights(s), slopes(&p, s), s.n);
            let [second, first] = [kappa2 * kappa2 / (2.0 * tau), through * kappa2 / (2.0 * tau)];
            move |q: Trace<Vector>| -second * slope.dot(&slopes_of(&q, n)) - first * slope.dot(&q.jump())
        });
        let field = Linear::zero().faces(Faces::INTERIOR, 8, |s| {
            let ((own, tau, _), slope, n) = (weights(s), slopes(&p, s), s.n);
            let (off, rest) = (slope * (-kappa2 / (2.0 * tau)), kappa2 * (own / tau - 1.0));
            move |q: Trace<Vector>| kappa2 * off.dot(&slopes_of(&q, n)) + rest * slope.dot(&q.mean())
        });
        let with = |mut sum: Vec<f64>, more: &Linear<Vector>| {
            let more = direct.loops.vector(more, &p.space);
            agree(&more, &more, 1e-12, "what is more");
            sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
            sum
        };
        let t = 0.3;
        let field = with(direct.molecular_functional(&p, &v, t), &field);
        agree(&hybrid.molecular_functional(&p, &v, t), &field, 1e-12, "molecular field");
        let state = State::incompressible(v.clone(), Field::zero(&hybrid.momentum.pressure), p.clone());
        // both molecular fields have the diffusion of the equation, that of the traces their rows as well
        let residual = with(direct.polarity_residual(&state, t), &more);
        agree(&hybrid.polarity_residual(&state, t), &residual, 1e-12, "residual");
        let traces = hybrid.traces(&p, &v, t).unwrap();
        hybrid.loops.sum_faces(Faces::INTERIOR, 4, |s| {
            let (_, tau, _) = weights(s);
            let mean = (p.vector(&s.minus) + p.vector(s.plus.as_ref().unwrap())) * 0.5;
            let off = (traces.at(s.face, s.along) - mean + slopes(&p, s) * (kappa2 / (2.0 * tau))).norm();
            assert!(off < 1e-11, "a trace is off by {off:e}");
            off
        });
    }
}

/// A pass of the fixed point solves the same equations: at its own image they hold.
#[test]
fn the_operator_of_a_pass_is_that_of_the_residual() {
    for model in hybrids() {
        let now = state(&model, 3);
        let (v, p, t) = (&now[VELOCITY], &now[POLARITY], 0.3);
        let given = model.given(t);
        let none = Traces::zero(&model.polarity.hybrid().unwrap().skeleton);
        let at = At::new(&model.parameters, p, &given).with_flow(&v.space, v.into()).with_traces(Some(&none));
        let mut operator = model.polarity.empty_operator();
        let mut sum = model.polarity.pass(&model.loops, 0.0, &at, &mut operator);
        let mut image = vec![0.0; sum.len()];
        operator.times(&p.values, &mut image);
        let inputs = model.polarity_inputs(&model.inputs(t).unwrap());
        sum.iter_mut().zip(image).zip(inputs).for_each(|((sum, image), input)| *sum += image - input);
        agree(&sum, &model.polarity_residual(&now, t), 1e-11, "operator, data and inputs");
    }
}

/// `R(p)` with the flow and the traces that follow from p.
fn residual(model: &Incompressible, p: &[f64], w: f64, t: f64) -> Vec<f64> {
    let p = Field::new(&model.polarity.space, p.to_vec());
    let (v, pi) = model.flow(&p, t).unwrap();
    let inertia = model.polarity.mass_times(&p.values);
    let mut r = model.polarity_residual(&State::incompressible(v, pi, p), t);
    r.iter_mut().zip(inertia).for_each(|(r, m)| *r += model.parameters.peclet * w * m);
    r
}

#[test]
fn the_derivative_is_that_of_the_equations_and_the_condensed_factors_invert_it() {
    for model in hybrids() {
        let (w, t) = (2.5, 0.3);
        let p = random(&model.polarity.space, 11);
        let (v, pi) = model.flow(&p, t).unwrap();
        let now = State::incompressible(v, pi, p.clone());
        let tangent = HybridTangent::new(&model, &now, w, t);
        let x = random(&model.polarity.space, 8).values;
        let mut y = vec![0.0; x.len()];
        tangent.times(&x, &mut y).unwrap();
        let h = 1e-5;
        let at = |s: f64| {
            let moved: Vec<f64> = p.values.iter().zip(&x).map(|(p, x)| p + s * h * x).collect();
            residual(&model, &moved, w, t)
        };
        let difference: Vec<f64> = at(1.0).iter().zip(at(-1.0)).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        agree(&y, &difference, 1e-7, "derivative");
        let condensed = Condensed::new(model.frame(), &tangent).unwrap();
        for (precision, bound) in [(Precision::Double, 1e-8), (Precision::Single, 1e-2)] {
            let lagged = Lagged::new(model.structure().unwrap(), &condensed, precision).unwrap();
            let mut back = y.clone();
            lagged.solve(&mut back);
            agree(&back, &x, bound, "the factors");
            let (b, mut c) = (condensed.eliminated().forward(&y), condensed.eliminated().forward(&y));
            lagged.solve_all(&mut c);
            let mut image = vec![0.0; c.len()];
            condensed.times(&c, &mut image);
            agree(&image, &b, bound, "products with the condensed matrix");
        }
    }
}

/// Every other term is assembled by cells alone; one that is not would have to say so.
#[test]
fn terms_of_other_models_are_in_hybrid_form_or_say_why_not() {
    let mut hybrid = 0;
    for factor in factor::of_kind(PARAMETERS.kind()) {
        let parameters = Parameters { factors: PARAMETERS.factors.with(factor.key, 0.5), ..PARAMETERS };
        let mesh = square(2);
        let model = Incompressible::new(&mesh, &Description::new(&mesh, parameters, mixed)).unwrap();
        assert_eq!(model.polarity.hybrid().is_some(), parameters.keeps_direct().is_none(), "{}", factor.key);
        if model.polarity.hybrid().is_some() {
            Condensed::new(model.frame(), &HybridTangent::new(&model, &state(&model, 2), 1.0, 0.0)).unwrap();
            hybrid += 1;
        }
    }
    assert!(hybrid > 0, "no term was tried");
}

/// Where a term sees both cells of a face, or there is no coherence, the form stays direct, and says why.
#[test]
fn what_cannot_be_in_hybrid_form_stays_direct() {
    let law = monolayer::model::DensityLaw { penalty: 1.0, exponent: 1.0, critical: 0.0, active_stress_iso: 0.0 };
    let factors = |key| PARAMETERS.factors.with(key, 0.5);
    let wide = Parameters { elastic_force: ElasticForce::Energy, ..PARAMETERS };
    let carried = Parameters { factors: factors("self_advection"), ..PARAMETERS };
    let squeezed = Parameters { density: Some(law), ..PARAMETERS };
    let rough = Parameters { coherence: 0.0, ..PARAMETERS };
    for parameters in [wide, carried, squeezed, rough] {
        assert!(parameters.keeps_direct().is_some() && !parameters.is_hybrid(), "{parameters:?}");
    }
    let plain = Parameters { elastic_force: ElasticForce::Energy, elasticity: 0.0, ..PARAMETERS };
    for parameters in [PARAMETERS, plain] {
        assert!(parameters.keeps_direct().is_none() && parameters.is_hybrid(), "{parameters:?}");
    }
    assert!(!Parameters { form: PolarityForm::Direct, ..PARAMETERS }.is_hybrid());
}

/// With the polarity eliminated, the factors are about a third as large.
#[test]
fn the_factors_are_smaller() {
    let mesh = square(24);
    let [hybrid, direct] = [PolarityForm::Hybrid, PolarityForm::Direct].map(|form| {
        let model = build(&mesh, form, mixed);
        model.structure().unwrap().bytes(Precision::Double) as f64
    });
    println!("{:.3} of {:.1} MB", hybrid / direct, direct / 1e6);
    assert!(hybrid < 0.35 * direct, "{hybrid} of {direct}");
}
