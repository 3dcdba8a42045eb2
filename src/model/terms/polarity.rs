//! The terms of the polarity's equation, test q   [7.11c], [7.34]

mod self_advection;

use super::{At, Factor, Formula, Functional, Line, Pass, Power, Side, Strong, Switch, Term, Weak, power};
use crate::form::words::{Scalar, Vector};
use crate::form::{Bilinear, FacePoint, Faces, Linear, elastic, hybrid, mass, polarity, swip, upwind};
use crate::mesh::Point;
use crate::model::polarity::FORMULA_DEGREE;
use self_advection::SELF_ADVECTION;

/// What the flow does to the polarity, in the order of the model page.
pub const POLARITY: &[Term<Vector>] = &[RATE, ADVECTION, ROTATION, STRETCHING, FLOW_ALIGNMENT, SELF_ADVECTION];

/// The terms of `(1/B)(L_h|q)`, the derivative of the free energy, which the polarity's equation has as well   [7.10]
pub const MOLECULAR: &[Term<Vector>] = &[RELAXATION, COHERENCE];

const RATE: Term<Vector> = Term {
    name: "polarity rate",
    formula: Formula::Both("Pe (∂_t p|q)", "Pe (ρ∂_t p|q)"),
    tag: "[7.11c]",
    strong: Strong::Vector(|s| s.parameters().peclet * s.rho().value() * s.polarity_rate()),
    ..Term::PLAIN
};

const ADVECTION: Term<Vector> = Term {
    name: "polarity advection",
    formula: Formula::Both("Pe a_upw(p,q;v)", "Pe a_upw(p,q;ρv)"),
    tag: "[7.11c]",
    weak: Weak::Functional(Functional {
        value: |at| {
            let (carrier, inflow) = (at.carrier(), at.given.dirichlet);
            at.parameters.peclet
                * match at.traces() {
                    None => upwind::advection(at.p, carrier, inflow, data(at)),
                    Some(traces) => hybrid::advection((at.p, traces), carrier, inflow, data(at)),
                }
        },
        by_velocity: |at| {
            let (carrier, inflow) = (at.carrier(), at.given.dirichlet);
            at.parameters.peclet
                * match at.traces() {
                    None => upwind::advection_by_flow(at.p, carrier, inflow, data(at)),
                    Some(traces) => hybrid::advection_by_flow((at.p, traces), carrier, inflow, data(at)),
                }
        },
        by_density: |at| {
            let density = at.density().1;
            at.parameters.peclet
                * upwind::advection_by_density(at.p, at.carrier(), density, at.given.dirichlet, data(at))
        },
        by_components: |at| {
            let (space, carrier, inflow) = (&at.p.space, at.carrier(), at.given.dirichlet);
            at.parameters.peclet
                * match at.traces() {
                    None => upwind::a_upw(space, carrier, inflow),
                    Some(_) => hybrid::a_advection(space, carrier, inflow),
                }
        },
        ..Functional::NOTHING
    }),
    pass: Pass::Implicit { data: Some(brought_in) },
    strong: Strong::Vector(|s| {
        let v = s.velocity();
        let along = Point::new(s.p()[0].gradient().dot(&v), s.p()[1].gradient().dot(&v));
        s.parameters().peclet * s.rho().value() * along
    }),
    ..Term::PLAIN
};

/// `−Pe ∫_ΓDp ρ(v·n)⊖ p_D·q`, at the points of [`upwind::advection`]: a pass then solves the same equation, also where
/// the flow turns round on a face.
fn brought_in<'a>(at: &At<'a>) -> Linear<'a, Vector> {
    let (space, faces) = (&*at.p.space, at.given.dirichlet);
    -at.parameters.peclet * upwind::l_upw(space, at.carrier(), faces, space.degree, data(at))
}

/// `p_D`
fn data<'a>(at: &At<'a>) -> impl Fn(&FacePoint) -> Point + Sync + Copy + use<'a> {
    let given = at.given;
    move |s: &FacePoint| given.polarity(s)
}

const ROTATION: Term<Vector> = Term {
    name: "polarity rotation",
    formula: Formula::Both("−Pe ω(p,q,v)", "−Pe ω(p,ρq,v)"),
    tag: "[7.11c]",
    weak: Weak::Functional(Functional {
        value: |at| -at.parameters.peclet * polarity::turning(at.p, at.v(), weights(at), at.rho),
        by_velocity: |at| -at.parameters.peclet * polarity::turning_by_flow(at.velocity(), at.p, weights(at), at.rho),
        by_density: |at| {
            -at.parameters.peclet * polarity::turning_by_density(at.p, at.v(), weights(at), at.density().1)
        },
        by_polarity: |at| {
            -at.parameters.peclet * polarity::turning_by_polarity(&at.p.space, at.v(), weights(at), at.rho)
        },
        ..Functional::NOTHING
    }),
    pass: Pass::Implicit { data: None },
    strong: Strong::Vector(|s| {
        let [along, across] = [s.v[0].gradient(), s.v[1].gradient()];
        let spin = 0.5 * (along.y - across.x);
        let p = s.polarity();
        -s.parameters().peclet * s.rho().value() * Point::new(spin * p.y, -spin * p.x)
    }),
    ..Term::PLAIN
};

const STRETCHING: Term<Vector> = Term {
    name: "polarity stretching",
    formula: Formula::Both("−Pe a δ(p,q,v)", "−Pe a δ(p,ρq,v)"),
    tag: "[7.11c]",
    on: |m| Some(Switch::By("alignment", m.sheet()?.alignment)),
    weak: Weak::With("polarity rotation"),
    strong: Strong::Vector(|s| {
        let [along, across] = [s.v[0].gradient(), s.v[1].gradient()];
        let shear = 0.5 * (along.y + across.x);
        let p = s.polarity();
        let stretched = Point::new(along.x * p.x + shear * p.y, shear * p.x + across.y * p.y);
        -s.parameters().peclet * s.parameters().alignment * s.rho().value() * stretched
    }),
    ..Term::PLAIN
};

/// Of W(v) and D(v) in `ω + a δ`.
fn weights(at: &At) -> [f64; 2] {
    [1.0, at.parameters.alignment]
}

/// The polarity aligns with the flow, `γv`, as in the model of Alert and Trepat (2019).
const FLOW_ALIGNMENT: Term<Vector> = Term {
    name: "flow alignment",
    formula: Formula::Both("γ (v|q)", "γ (v|q)"),
    tag: "[T2]",
    side: Side::Right,
    factor: Some(Factor {
        key: "flow_alignment",
        symbol: "γ_v",
        help: "rate at which the flow makes polarity along itself",
    }),
    weak: Weak::Functional(Functional {
        value: |at| {
            let v = at.v();
            mass::load(&at.p.space, v.space.degree, move |x| v.vector(&x.site))
        },
        by_velocity: |at| mass::vector_load_by(&at.p.space, at.velocity()),
        ..Functional::NOTHING
    }),
    strong: Strong::Vector(|s| -s.velocity()),
    power: Some(Power {
        line: Line { column: "budget_flow_alignment", words: "energy law: flow alignment", short: "flow alignment" },
        of: |at, loops| {
            let v = at.v();
            power::along_field(at, loops, mass::load(&at.p.space, v.space.degree, move |x| v.vector(&x.site)))
        },
    }),
    ..Term::PLAIN
};

const RELAXATION: Term<Vector> = Term {
    name: "polarity relaxation",
    formula: Formula::Both("((|p|²−1)p|q)", "([ρ|p|²−(ρ−ρ_min)]p|q)"),
    tag: "[7.10]",
    weak: Weak::Functional(Functional {
        value: |at| elastic::double_well(&at.p.space, at.p, at.rho, critical(at)),
        by_density: |at| elastic::double_well_by_density(at.p, at.density().1),
        by_polarity: |at| elastic::double_well_tangent(&at.p.space, at.p, at.rho, critical(at)),
        ..Functional::NOTHING
    }),
    pass: Pass::Frozen {
        operator: |at| {
            let (p, rho, critical) = (at.p, at.rho, critical(at));
            mass::weighted_mass(&p.space, 2 * p.space.degree + rho.degree(), move |x| {
                rho.at(&x.site) * p.vector(&x.site).norm_squared() + critical
            })
        },
        rest: |at| {
            let (p, rho) = (at.p, at.rho);
            -mass::load(&p.space, p.space.degree + rho.degree(), move |x| p.vector(&x.site) * rho.at(&x.site))
        },
    },
    strong: Strong::Vector(|s| {
        let (rho, p) = (s.rho().value(), s.polarity());
        (rho * p.norm_squared() - rho + s.critical()) * p
    }),
    ..Term::PLAIN
};

/// ρ_min
fn critical(at: &At) -> f64 {
    at.parameters.density.map_or(0.0, |law| law.critical)
}

const COHERENCE: Term<Vector> = Term {
    name: "polarity coherence",
    formula: Formula::Both("κ² a_swip(p,q)", "κ² a_swip(p,q;ρ)"),
    tag: "[7.10]",
    weak: Weak::Functional(Functional {
        value: |at| {
            let dirichlet = at.given.dirichlet;
            let form = match at.traces() {
                None => swip::diffusion(at.p, dirichlet, at.rho, FORMULA_DEGREE, data(at)),
                Some(traces) => hybrid::diffusion((at.p, traces), dirichlet, FORMULA_DEGREE, data(at)),
            };
            kappa2(at) * sloped(at, form)
        },
        by_density: |at| kappa2(at) * by_density(at),
        by_components: |at| {
            kappa2(at)
                * match at.traces() {
                    None => swip::a_swip(&at.p.space, at.given.dirichlet, at.rho),
                    Some(_) => hybrid::a_diffusion(&at.p.space, at.given.dirichlet),
                }
        },
        is_constant: true,
        ..Functional::NOTHING
    }),
    pass: Pass::Implicit {
        data: Some(|at| {
            let (space, faces) = (&*at.p.space, at.given.dirichlet);
            let form = match faces == Faces::NONE {
                true => Linear::zero(),
                false => -swip::l_swip(space, faces, at.rho, FORMULA_DEGREE, data(at)),
            };
            kappa2(at) * sloped(at, form)
        }),
    },
    strong: Strong::Vector(|s| {
        let [first, second] = s.diffusion();
        -s.parameters().coherence.powi(2) * Point::new(first.value(), second.value())
    }),
    ..Term::PLAIN
};

/// κ²
fn kappa2(at: &At) -> f64 {
    at.parameters.coherence.powi(2)
}

/// `form − ∫ ρ ∂_np·q` where exact fields give the slope   [6.25]
fn sloped<'a>(at: &At<'a>, form: Linear<'a, Vector>) -> Linear<'a, Vector> {
    let (given, rho) = (at.given, at.rho);
    let Some((faces, _)) = given.sloped else { return form };
    let slope = move |s: &FacePoint| given.slope(s) * rho.mean(s);
    form - mass::face_load(&at.p.space, faces, FORMULA_DEGREE + rho.degree(), slope)
}

fn by_density<'a>(at: &At<'a>) -> Bilinear<'a, Scalar, Vector> {
    let (given, (rho, density)) = (at.given, at.density());
    let form = swip::by_density(at.p, rho, given.dirichlet, FORMULA_DEGREE, data(at));
    let Some((faces, _)) = given.sloped else { return form };
    let slope = move |s: &FacePoint| given.slope(s);
    form - mass::face_load_by_density(&at.p.space, density, faces, FORMULA_DEGREE, slope)
}
