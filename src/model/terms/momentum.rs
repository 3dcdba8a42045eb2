//! The terms of the momentum balance, test w   [7.11a], [7.34]

mod polar_stress;

use super::{At, Formula, Functional, Line, Power, Side, Strong, Switch, Term, Weak};
use crate::expression::Taylor;
use crate::form::compression::Compression;
use crate::form::power;
use crate::form::words::{Vector, sym};
use crate::form::{Bilinear, CellPoint, Density, FacePoint, Linear, elastic, mass, polarity, stokes};
use crate::mesh::Point;
use crate::model::numbers::Numbers;
use crate::model::parameters::{ElasticForce, Parameters};
use polar_stress::POLAR_STRESS;

/// In the order of the model page.
pub const MOMENTUM: &[Term<Vector>] = &[
    VISCOSITY,
    DIVERGENCE_VISCOSITY,
    FRICTION,
    MULTIPLIER,
    TRACTION,
    PRESSURE,
    ELASTIC_ROTATION,
    ELASTIC_STRETCHING,
    ELASTIC_STRESS,
    ELASTIC_FORCE,
    ACTIVE_STRESS,
    ISOTROPIC_ACTIVE_STRESS,
    POLAR_STRESS,
    MOLECULAR_FIELD,
];

pub(super) const VISCOSITY: Term<Vector> = Term {
    name: "viscosity",
    formula: Formula::Both("2(D(v)|D(w))", "2(ρD(v)|D(w))"),
    tag: "[7.11a]",
    weak: Weak::Flow {
        weight: |_| 1.0,
        matrix: |velocity, rho| match rho {
            Density::One => stokes::viscosity(velocity),
            Density::Of(rho) => stokes::weighted_viscosity(velocity, rho),
        },
        by_density: |at| stokes::viscosity_by_density(at.v(), at.density().1),
    },
    strong: Strong::Stress(|s| s.stress_of(|i, j| s.weighed(s.stretching(i, j)))),
    power: Some(Power {
        line: Line { column: "budget_viscosity", words: "energy law: viscosity", short: "viscosity" },
        of: |at, loops| {
            let (v, rho) = (at.v(), at.rho);
            // bodies by penalty have a share of it
            2.0 * loops.flow.sum(2 * (v.space.degree - 1) + rho.degree(), |x| {
                let g = v.vector_gradient(&x.site);
                match rho {
                    Density::One => sym(&g).norm_squared(),
                    Density::Of(rho) => rho.scalar(&x.site) * (sym(&g).norm_squared() + g.trace().powi(2)),
                }
            })
        },
    }),
    ..Term::PLAIN
};

const DIVERGENCE_VISCOSITY: Term<Vector> = Term {
    name: "divergence viscosity",
    formula: Formula::Compressible("2(ρ div v|div w)"),
    tag: "[7.34]",
    weak: Weak::With("viscosity"),
    strong: Strong::Stress(|s| s.isotropic(2.0 * s.weighed(s.divergence()))),
    ..Term::PLAIN
};

pub(super) const FRICTION: Term<Vector> = Term {
    name: "friction",
    formula: Formula::Both("C_F (v|w)", "C_F (v|w)"),
    tag: "[7.11a]",
    on: |m| Some(Switch::By("friction", m.friction())),
    weak: Weak::Flow {
        weight: |m| m.friction(),
        matrix: |velocity, _| mass::vector_mass(velocity),
        by_density: |_| Bilinear::zero(),
    },
    strong: Strong::Vector(|s| s.numbers.friction() * s.velocity()),
    power: Some(Power {
        line: Line { column: "budget_friction", words: "energy law: friction", short: "friction" },
        of: |at, loops| {
            let v = at.v();
            at.parameters.friction * loops.tissue.sum(2 * v.space.degree, |x| v.vector(&x.site).norm_squared())
        },
    }),
    ..Term::PLAIN
};

/// With `div v = 0`, which it belongs to.
pub(super) const MULTIPLIER: Term<Vector> = Term {
    name: "pressure",
    formula: Formula::Incompressible("b(w,Π), b(v,ξ)"),
    tag: "[7.11a]",
    strong: Strong::Stress(|s| s.isotropic(-s.pressure())),
    ..Term::PLAIN
};

const TRACTION: Term<Vector> = Term {
    name: "traction",
    formula: Formula::Both("T_a (p|w)", "T_a (p|w)"),
    tag: "[7.11a]",
    side: Side::Right,
    on: |m| Some(Switch::By("traction", m.sheet()?.traction)),
    weak: Weak::Functional(Functional {
        value: |at| {
            let p = at.p;
            at.parameters.traction * mass::load(at.velocity(), p.space.degree, move |x| p.vector(&x.site))
        },
        by_polarity: |at| at.parameters.traction * mass::vector_load_by(at.velocity(), &at.p.space),
        ..Functional::NOTHING
    }),
    strong: Strong::Vector(|s| -s.parameters().traction * s.polarity()),
    power: Some(Power {
        line: Line { column: "budget_traction", words: "energy law: traction", short: "traction" },
        of: |at, loops| {
            let (v, p) = (at.v(), at.p);
            let along = |x: &CellPoint| p.vector(&x.site).dot(&v.vector(&x.site));
            at.parameters.traction * loops.tissue.sum(v.space.degree + p.space.degree, along)
        },
    }),
    ..Term::PLAIN
};

/// `ρΠ = c_0 ρ^(γ+1) − ½Bρ_min|p|²`: two parts, each of which may be off.
const PRESSURE: Term<Vector> = Term {
    name: "pressure",
    formula: Formula::Compressible("−b(w,ρΠ)"),
    tag: "[7.34]",
    side: Side::Right,
    on: |m| {
        let m = m.sheet()?;
        let law = m.density?;
        let polar = m.elasticity * law.critical;
        Some(match law.penalty == 0.0 && polar != 0.0 {
            true => Switch::By("elasticity*density.critical", polar),
            false => Switch::By("density.penalty", law.penalty),
        })
    },
    weak: Weak::Functional(Functional {
        value: |at| -crowding(at.parameters).force(at.velocity(), at.density().0, at.p),
        by_density: |at| -crowding(at.parameters).by_density(at.velocity(), at.density().0, at.p),
        by_polarity: |at| -crowding(at.parameters).by_polarity(at.velocity(), at.density().0, at.p),
        ..Functional::NOTHING
    }),
    strong: Strong::Stress(|s| {
        let law = s.law();
        let polar = 0.5 * s.parameters().elasticity * law.critical * s.square();
        // without a penalty no power is taken: it need not exist
        let crowding = match law.penalty {
            0.0 => Taylor::constant(0.0),
            c => c * s.rho().powf(law.exponent + 1.0),
        };
        s.isotropic(polar - crowding)
    }),
    ..Term::PLAIN
};

/// The isotropic stress of the density law, without activity.
fn crowding(m: &Parameters) -> Compression {
    Compression { active: 0.0, ..m.compression() }
}

/// That of the activity alone.
fn activity(m: &Parameters) -> Compression {
    Compression { penalty: 0.0, critical: 0.0, ..m.compression() }
}

const ELASTIC_ROTATION: Term<Vector> = Term {
    name: "elastic rotation",
    formula: Formula::Both("−ω(p,L_h,w)", "−ω(p,L_h,w)"),
    tag: "[7.11a]",
    side: Side::Right,
    on: |m| Some(Switch::By("elasticity", m.sheet()?.elasticity)),
    weak: Weak::Functional(Functional {
        value: |at| {
            let (m, l) = (at.parameters, at.molecular());
            let rotation = -m.elasticity * polarity::rotation_force(at.velocity(), at.p, l);
            match stretch(m) {
                0.0 => rotation,
                stretch => rotation - stretch * polarity::stretching_force(at.velocity(), at.p, l, Density::One),
            }
        },
        by_polarity: |at| {
            let m = at.parameters;
            -polarity::force_by_polarity(at.velocity(), at.molecular(), m.elasticity, stretch(m))
        },
        by_field: |at| {
            let m = at.parameters;
            -polarity::force_by_field(at.velocity(), at.p, m.elasticity, stretch(m), Density::One)
        },
        ..Functional::NOTHING
    }),
    strong: Strong::Stress(|s| {
        let (p, l) = (s.p(), s.molecular());
        s.stress_of(|i, j| 0.5 * (p[i] * l[j] - l[i] * p[j]))
    }),
    ..Term::PLAIN
};

const ELASTIC_STRETCHING: Term<Vector> = Term {
    name: "elastic stretching",
    formula: Formula::Both("−a δ(p,L_h,w)", "−a δ(p,L_h,w)"),
    tag: "[7.11a]",
    side: Side::Right,
    on: |m| {
        let m = m.sheet()?;
        Some(match m.elasticity == 0.0 {
            true => Switch::By("elasticity", m.elasticity),
            false => Switch::By("alignment", m.alignment),
        })
    },
    weak: Weak::With("elastic rotation"),
    strong: Strong::Stress(|s| {
        let (p, l, a) = (s.p(), s.molecular(), s.parameters().alignment);
        s.stress_of(|i, j| 0.5 * a * (p[i] * l[j] + l[i] * p[j]))
    }),
    ..Term::PLAIN
};

/// `aB`
fn stretch(m: &Parameters) -> f64 {
    m.alignment * m.elasticity
}

const ELASTIC_STRESS: Term<Vector> = Term {
    name: "elastic stress",
    formula: Formula::Both("κ²B c_h(p,p,w)", "κ²B c_h(p,p,w;ρ)"),
    tag: "[7.11a]",
    side: Side::Right,
    on: |m| by_elasticity(m, ElasticForce::Stress),
    weak: Weak::Functional(Functional {
        value: |at| slope(at.parameters) * elastic::ericksen(at.velocity(), at.p, at.rho),
        by_density: |at| slope(at.parameters) * elastic::ericksen_by_density(at.velocity(), at.p, at.density().1),
        by_polarity: |at| slope(at.parameters) * elastic::ericksen_tangent(at.velocity(), at.p, at.rho),
        ..Functional::NOTHING
    }),
    strong: ERICKSEN,
    ..Term::PLAIN
};

/// The elastic force of a sheet is one of two.
fn by_elasticity(m: Numbers, force: ElasticForce) -> Option<Switch> {
    let m = m.sheet()?;
    (m.elastic_force == force).then_some(Switch::By("elasticity", m.elasticity))
}

/// `κ²B`
fn slope(m: &Parameters) -> f64 {
    m.coherence.powi(2) * m.elasticity
}

/// `−κ²Bρ ∇pᵀ·∇p`
const ERICKSEN: Strong = Strong::Stress(|s| {
    let slope = slope(s.parameters());
    s.stress_of(|i, j| s.weighed(-slope * s.slopes(i, j)))
});

/// The power of advection and relaxation as a functional of w; up to a gradient, which the pressure takes up, it is the
/// elastic stress.
const ELASTIC_FORCE: Term<Vector> = Term {
    name: "elastic force",
    formula: Formula::Incompressible("X(w), energy-consistent"),
    tag: "[7.18]",
    side: Side::Right,
    on: |m| by_elasticity(m, ElasticForce::Energy),
    weak: Weak::Functional(Functional {
        value: |at| at.parameters.elasticity * (power_of(at).force() - natural_traction(at)),
        by_polarity: |at| at.parameters.elasticity * (power_of(at).by_polarity() - natural_traction_tangent(at)),
        by_field: |at| at.parameters.elasticity * power_of(at).by_field(),
        wide: true,
        ..Functional::NOTHING
    }),
    strong: ERICKSEN,
    ..Term::PLAIN
};

fn power_of<'a>(at: &At<'a>) -> power::Power<'a, impl Fn(&FacePoint) -> Point + Sync + Copy + 'a> {
    let given = at.given;
    let data = move |s: &FacePoint| given.polarity(s);
    power::Power { p: at.p, l: at.molecular(), carrier: at.carrier(), inflow: given.dirichlet, data }
}

fn natural_traction<'a>(at: &At<'a>) -> Linear<'a, Vector> {
    let [open, dirichlet] = at.given.natural;
    power::natural_traction(at.velocity(), at.p, at.parameters.coherence, open, dirichlet)
}

fn natural_traction_tangent<'a>(at: &At<'a>) -> Bilinear<'a, Vector, Vector> {
    let [open, dirichlet] = at.given.natural;
    power::natural_traction_tangent(at.velocity(), at.p, at.parameters.coherence, open, dirichlet)
}

/// Of the active stress, all of it.
const ACTIVE: Line =
    Line { column: "budget_active_stress", words: "energy law: active stress", short: "active stress" };

const ACTIVE_STRESS: Term<Vector> = Term {
    name: "active stress",
    formula: Formula::Both("S_a δ(p,p,w)", "S_a δ(ρp,p,w)"),
    tag: "[7.11a]",
    side: Side::Right,
    on: |m| Some(Switch::By("active_stress", m.sheet()?.active_stress)),
    weak: Weak::Functional(Functional {
        value: |at| at.parameters.active_stress * polarity::stretching_force(at.velocity(), at.p, at.p, at.rho),
        by_density: |at| {
            at.parameters.active_stress * polarity::stretching_force_by_density(at.velocity(), at.p, at.density().1)
        },
        by_polarity: |at| 2.0 * polarity::force_by_field(at.velocity(), at.p, 0.0, at.parameters.active_stress, at.rho),
        ..Functional::NOTHING
    }),
    strong: Strong::Stress(|s| {
        let (p, active) = (s.p(), s.parameters().active_stress);
        s.stress_of(|i, j| s.weighed(-active * (p[i] * p[j])))
    }),
    power: Some(Power {
        line: ACTIVE,
        of: |at, loops| {
            let (v, p, rho) = (at.v(), at.p, at.rho);
            let degree = v.space.degree - 1 + 2 * p.space.degree + rho.degree();
            at.parameters.active_stress
                * loops.tissue.sum(degree, |x| {
                    let p = p.vector(&x.site);
                    rho.at(&x.site) * p.dot(&(sym(&v.vector_gradient(&x.site)) * p))
                })
        },
    }),
    ..Term::PLAIN
};

const ISOTROPIC_ACTIVE_STRESS: Term<Vector> = Term {
    name: "isotropic active stress",
    formula: Formula::Compressible("−S_a' b(w,ρ|p|²)"),
    tag: "[7.34]",
    side: Side::Right,
    on: |m| Some(Switch::By("active_stress_iso", m.sheet()?.density?.active_stress_iso)),
    weak: Weak::Functional(Functional {
        value: |at| -activity(at.parameters).force(at.velocity(), at.density().0, at.p),
        by_density: |at| -activity(at.parameters).by_density(at.velocity(), at.density().0, at.p),
        by_polarity: |at| -activity(at.parameters).by_polarity(at.velocity(), at.density().0, at.p),
        ..Functional::NOTHING
    }),
    strong: Strong::Stress(|s| s.isotropic(-s.law().active_stress_iso * s.weighed(s.square()))),
    power: Some(Power {
        line: ACTIVE,
        of: |at, loops| {
            let (v, p, (rho, _)) = (at.v(), at.p, at.density());
            let degree = v.space.degree - 1 + 2 * p.space.degree + rho.space.degree;
            activity(at.parameters).active
                * loops.tissue.sum(degree, |x| {
                    rho.scalar(&x.site) * p.vector(&x.site).norm_squared() * v.vector_gradient(&x.site).trace()
                })
        },
    }),
    ..Term::PLAIN
};

const MOLECULAR_FIELD: Term<Vector> = Term {
    name: "molecular field",
    formula: Formula::Both("L_h by the block-diagonal mass matrix", "L_h by the block-diagonal mass matrix"),
    tag: "[7.10]",
    on: |m| Some(Switch::By("elasticity", m.sheet()?.elasticity)),
    ..Term::PLAIN
};
