//! Every listed term: the derivatives of its weak form, its strong form, its symmetries, and nothing where it is off.

use std::sync::Arc;

use crate::common::*;
use crate::model::formula;
use monolayer::expression::Expression;
use monolayer::form::upwind::Carrier;
use monolayer::form::words::{Jet, Scalar};
use monolayer::form::{Bilinear, CellPoint, Density, Faces, Integrator, mass};
use monolayer::mesh::{Mesh, Point};
use monolayer::model::manufactured::Series;
use monolayer::model::parameters::DensityLaw;
use monolayer::model::terms::{
    At, FlowTerms, Functional, Given, MASS, MOLECULAR, MOMENTUM, POLARITY, Strong, Sum, Term, Weak, factor,
};
use monolayer::model::{Conditions, ElasticForce, Exact, Fluid, Parameters};
use monolayer::space::{Field, Space, project};

/// Sheets in which every term is on, one of each kind and with either elastic force, and with factors of either sign.
fn sheets() -> Vec<Parameters> {
    let plain = Parameters { active_stress: 0.7, coherence: 0.4, elasticity: 0.6, alignment: 0.8, ..Parameters::PLAIN };
    let law = DensityLaw { penalty: 1.5, exponent: 1.0, critical: 0.3, active_stress_iso: 0.4 };
    let sheets = [
        Parameters { friction: 1.3, traction: 1.7, peclet: 1.2, ..plain },
        Parameters { elastic_force: ElasticForce::Energy, ..plain },
        Parameters { density: Some(law), ..plain },
    ];
    let with = |sheet: Parameters, value: f64| {
        let factors = factor::of_kind(sheet.kind()).fold(sheet.factors, |all, factor| all.with(factor.key, value));
        Parameters { factors, ..sheet }
    };
    let [stress, energy, compressible] = sheets;
    vec![with(stress, 0.9), with(energy, 0.9), with(compressible, 0.9), with(stress, -0.8), with(compressible, -0.8)]
}

/// A state on a mesh; the density is positive.
struct Fields {
    loops: Integrator,
    v: Field,
    sides: Field,
    rho: Field,
    p: Field,
    l: Field,
    conditions: Vec<Conditions>,
}

impl Fields {
    fn random(mesh: &Arc<Mesh>) -> Self {
        let (velocity, density, polarity) =
            (continuous(mesh, 2, 2), discontinuous(mesh, 1, 1), discontinuous(mesh, 2, 2));
        let mut rho = random(&density, 4);
        rho.values.iter_mut().for_each(|r| *r = 1.2 + 0.4 * *r);
        let v = random(&velocity, 3);
        let given = [formula("0.7 + y"), formula("x - 0.2")];
        let inflow = || Conditions::slip().with_polarity(given.clone()).with_density(formula("1.1 + 0.2*x"));
        let conditions =
            mesh.tags.iter().map(|tag| if tag == "left" || tag == "wall" { inflow() } else { Conditions::slip() });
        Self {
            loops: loops(mesh),
            sides: v.clone(),
            v,
            rho,
            p: random(&polarity, 5),
            l: random(&polarity, 6),
            conditions: conditions.collect(),
        }
    }

    fn given(&self) -> Given<'_> {
        let of = |condition: &dyn Fn(&Conditions) -> bool| {
            let tags = self.conditions.iter().enumerate().filter(|(_, c)| condition(c));
            tags.fold(Faces::NONE, |faces, (tag, _)| faces | Faces::tag(tag))
        };
        let dirichlet = of(&|c| c.density.is_some());
        Given::new(&self.loops.mesh, &self.conditions, dirichlet, None, 0.3)
            .with_open(dirichlet)
            .with_natural([Faces::BOUNDARY, dirichlet])
    }

    fn at<'a>(&'a self, m: &'a Parameters, given: &'a Given<'a>) -> At<'a> {
        let carrier = Carrier { flow: &self.v, sides: &self.sides, density: Density::One };
        let at = At::new(m, &self.p, given).with_flow(&self.v.space, carrier).with_field(Some(&self.l));
        if m.density.is_some() { at.with_density(&self.rho) } else { at }
    }

    /// The functional of a term, on a space of test functions.
    fn value<V: Jet>(&self, term: &Term<V>, m: &Parameters, test: &Space) -> Vec<f64> {
        let given = self.given();
        match &term.weak {
            Weak::Functional(functional) => self.loops.vector(&(functional.value)(&self.at(m, &given)), test),
            Weak::Flow { weight, matrix, .. } => {
                let rho = if m.density.is_some() { Density::Of(&self.rho) } else { Density::One };
                times(&self.loops, &(weight(m.into()) * matrix(&self.v.space, rho)), &self.v, &self.v.space)
            }
            Weak::With(_) | Weak::Frame => vec![0.0; test.dof_count()],
        }
    }
}

fn times<U: Jet, V: Jet>(loops: &Integrator, form: &Bilinear<U, V>, x: &Field, test: &Space) -> Vec<f64> {
    let mut out = vec![0.0; test.dof_count()];
    for (i, j, a) in loops.triplets(form, &x.space, test) {
        out[i] += a * x.values[j];
    }
    out
}

/// A scalar form that acts on both components of a vector field alike.
fn times_alike(loops: &Integrator, form: &Bilinear<Scalar, Scalar>, x: &Field) -> Vec<f64> {
    let (space, scalar) = (&x.space, discontinuous(&loops.mesh, x.space.degree, 1));
    let mut out = vec![0.0; space.dof_count()];
    for c in 0..2 {
        let each = || (0..loops.mesh.cells.len()).flat_map(|cell| (0..scalar.n).map(move |i| (cell, i)));
        let mut component = Field::zero(&scalar);
        each().for_each(|(cell, i)| component.values[scalar.dof(cell, 0, i)] = x.values[space.dof(cell, c, i)]);
        let image = times(loops, form, &component, &scalar);
        each().for_each(|(cell, i)| out[space.dof(cell, c, i)] = image[scalar.dof(cell, 0, i)]);
    }
    out
}

/// Compares derivatives of a term along directions with central differences.
fn differentiate<V: Jet>(list: &'static [Term<V>], test: impl Fn(&Fields) -> Arc<Space>) {
    for mesh in [square(2), mesh("shape = \"disc\"\nh = 0.9")] {
        let fields = Fields::random(&mesh);
        let test = test(&fields);
        for m in sheets() {
            for term in list.iter().filter(|term| term.is_on(&m)) {
                let given = fields.given();
                let at = fields.at(&m, &given);
                let loops = &fields.loops;
                let along = |which: usize, field: &dyn Fn(&mut Fields) -> &mut Field| {
                    let mut moved = fields.copy();
                    let direction = random(&field(&mut moved).space, 20 + which as u64);
                    let h = 1e-5;
                    let side = |s: f64| {
                        let mut moved = fields.copy();
                        let values = &mut field(&mut moved).values;
                        values.iter_mut().zip(&direction.values).for_each(|(x, d)| *x += s * h * d);
                        moved.value(term, &m, &test)
                    };
                    let (up, down) = (side(1.0), side(-1.0));
                    let slopes: Vec<f64> = up.iter().zip(down).map(|(a, b)| (a - b) / (2.0 * h)).collect();
                    (direction, slopes)
                };
                let compare = |what: &str, found: Vec<f64>, wanted: Vec<f64>| {
                    let scale = wanted.iter().fold(1.0_f64, |m, w| m.max(w.abs()));
                    for (a, b) in found.iter().zip(&wanted) {
                        assert!((a - b).abs() < 1e-6 * scale, "`{}` along {what}: {a}, differences {b}", term.name);
                    }
                };
                let sum = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
                match &term.weak {
                    Weak::With(_) | Weak::Frame => {}
                    Weak::Flow { weight, by_density, .. } => {
                        if m.density.is_some() {
                            let (direction, slopes) = along(0, &|fields| &mut fields.rho);
                            compare(
                                "ρ",
                                times(loops, &(weight((&m).into()) * by_density(&at)), &direction, &test),
                                slopes,
                            );
                        }
                    }
                    Weak::Functional(functional) => {
                        let Functional { by_velocity, by_density, by_polarity, by_components, by_field, .. } =
                            functional;
                        let (direction, slopes) = along(1, &|fields| &mut fields.v);
                        compare("v", times(loops, &by_velocity(&at), &direction, &test), slopes);
                        let (direction, slopes) = along(2, &|fields| &mut fields.p);
                        let full = times(loops, &by_polarity(&at), &direction, &test);
                        let components = by_components(&at);
                        let alike = match test.dof_count() == fields.p.space.dof_count() {
                            true => times_alike(loops, &components, &direction),
                            false => vec![0.0; test.dof_count()],
                        };
                        compare("p", sum(full, alike), slopes);
                        let (direction, slopes) = along(3, &|fields| &mut fields.l);
                        compare("ℓ", times(loops, &by_field(&at), &direction, &test), slopes);
                        if m.density.is_some() {
                            let (direction, slopes) = along(4, &|fields| &mut fields.rho);
                            compare("ρ", times(loops, &by_density(&at), &direction, &test), slopes);
                        }
                    }
                }
            }
        }
    }
}

impl Fields {
    fn copy(&self) -> Self {
        Self {
            loops: self.loops.clone(),
            v: self.v.clone(),
            sides: self.sides.clone(),
            rho: self.rho.clone(),
            p: self.p.clone(),
            l: self.l.clone(),
            conditions: self.conditions.clone(),
        }
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    differentiate(MOMENTUM, |fields| fields.v.space.clone());
    differentiate(MASS, |fields| fields.rho.space.clone());
    differentiate(POLARITY, |fields| fields.p.space.clone());
    differentiate(MOLECULAR, |fields| fields.p.space.clone());
}

/// What a pass solves for has the last iterate for its solution where that solves the equation: the operators on it and
/// the rest are the value of the term.
#[test]
fn passes_solve_the_equation_of_the_terms() {
    for mesh in [square(2), mesh("shape = \"disc\"\nh = 0.9")] {
        let fields = Fields::random(&mesh);
        let (loops, given, test) = (&fields.loops, fields.given(), &fields.p.space);
        for m in sheets() {
            let at = fields.at(&m, &given);
            for term in POLARITY.iter().chain(MOLECULAR).filter(|term| term.is_on(&m)) {
                let lists = [std::slice::from_ref(term)];
                let sum = Sum::of(&lists);
                let (forms, value) = (sum.pass(&at), loops.vector(&sum.value(&at), test));
                let alike = times_alike(loops, &forms.components, &fields.p);
                let (full, rest) = (times(loops, &forms.full, &fields.p, test), loops.vector(&forms.rest, test));
                let scale = value.iter().fold(1.0_f64, |s, v| s.max(v.abs()));
                for (i, value) in value.iter().enumerate() {
                    let found = alike[i] + full[i] + rest[i];
                    assert!((found - value).abs() < 1e-11 * scale, "`{}`: {found}, not {value}", term.name);
                }
            }
        }
    }
}

/// Blocks across faces are stored for the terms that have them.
fn width<V: Jet>(list: &'static [Term<V>]) {
    let fields = Fields::random(&square(2));
    let given = fields.given();
    for m in sheets() {
        let at = fields.at(&m, &given);
        for term in list.iter().filter(|term| term.is_on(&m)) {
            if let Weak::Functional(functional) = &term.weak {
                let wide = (functional.by_polarity)(&at).couples_cells() || (functional.by_field)(&at).couples_cells();
                assert_eq!(functional.wide, wide, "`{}`", term.name);
            }
        }
    }
}

#[test]
fn terms_that_see_other_cells_say_so() {
    width(MOMENTUM);
    width(MASS);
    width(POLARITY);
    width(MOLECULAR);
    for m in sheets() {
        let off = Parameters { factors: Parameters::PLAIN.factors, elastic_force: ElasticForce::Stress, ..m };
        assert!(Sum::of(&[POLARITY, MOLECULAR]).is_wide(&m), "self-advection is on");
        assert!(!Sum::of(&[POLARITY, MOLECULAR]).is_wide(&off) && !Sum::of(&[MOMENTUM]).is_wide(&off));
    }
}

/// Fields of low degree, so that every form is integrated exactly and the molecular field lies in the polarity's space.
fn smooth(m: &Parameters) -> Exact {
    let pair = |a: &str, b: &str| [a, b].map(|text| Expression::parse(text, &[]).expect("the formula parses"));
    let polarity = pair("0.4 + 0.3*x - 0.5*y", "0.2 + 0.6*x + 0.1*y");
    let rho = Expression::parse("1.1 + 0.2*x - 0.3*y", &[]).unwrap();
    match m.density {
        None => Exact::new(pair("0.2 + x*y - y^2", "0.1 - 0.5*y^2 + x^2"), rho, polarity),
        Some(_) => Exact::compressible(pair("0.2 + x*y - y^2", "0.1 + 0.5*y^2 + x^2"), rho, polarity),
    }
    .expect("the fields have derivatives")
}

/// What the strong form of a term adds to the residual at a point.
fn strong_at<V: Jet>(term: &Term<V>, series: &Series) -> Option<Point> {
    Some(match &term.strong {
        Strong::Frame => return None,
        Strong::Scalar(of) => Point::new(of(series), 0.0),
        Strong::Vector(of) => of(series),
        Strong::Stress(of) => {
            let sigma = of(series);
            let divergence = |i: usize| sigma[0][i][1] + sigma[1][i][2];
            -Point::new(divergence(0), divergence(1))
        }
    })
}

/// Compares weak and strong forms where test functions do not see the boundary.
fn integrate<V: Jet>(list: &'static [Term<V>], fields: &Fields, test: &Arc<Space>, (m, exact): (&Parameters, &Exact)) {
    let mesh = &fields.loops.mesh;
    // dofs of cells at the boundary
    let near: Vec<usize> = mesh.faces.iter().filter(|face| face.plus.is_none()).map(|face| face.minus.cell).collect();
    let seen = |cell: usize| near.contains(&cell);
    let mut inner = vec![true; test.dof_count()];
    for cell in (0..mesh.cells.len()).filter(|cell| seen(*cell)) {
        (0..test.components).for_each(|c| (0..test.n).for_each(|i| inner[test.dof(cell, c, i)] = false));
    }
    assert!(inner.iter().filter(|inner| **inner).count() > 8);
    for term in list.iter().filter(|term| term.is_on(m)) {
        // up to a gradient, which the multiplier takes up
        if matches!(term.weak, Weak::Frame | Weak::With(_)) || term.name == "elastic force" {
            continue;
        }
        let within = |other: &&Term<V>| matches!(other.weak, Weak::With(name) if name == term.name);
        let together: Vec<&Term<V>> =
            list.iter().filter(|other| other.is_on(m) && (other.name == term.name || within(other))).collect();
        let strong = |x: &CellPoint| {
            let series = exact.series(m, x.site.x, 0.0);
            together.iter().map(|term| strong_at(term, &series).expect("a strong form")).sum::<Point>()
        };
        let wanted = match test.components {
            1 => fields.loops.vector(&mass::scalar_load(test, 10, |x| strong(x).x), test),
            _ => fields.loops.vector(&mass::load(test, 10, strong), test),
        };
        let sign = term.scale(m) / term.factor(m);
        let found = fields.value(term, m, test);
        let scale = wanted.iter().fold(1e-3_f64, |s, w| s.max(w.abs()));
        for ((found, wanted), _) in found.iter().zip(&wanted).zip(&inner).filter(|(_, inner)| **inner) {
            assert!((sign * found - wanted).abs() < 1e-10 * scale, "`{}`: {found}, strong {wanted}", term.name);
        }
    }
}

#[test]
fn strong_forms_are_those_of_the_weak_ones() {
    let mesh = square(5);
    for m in sheets() {
        let exact = smooth(&m);
        let mut fields = Fields::random(&mesh);
        let polarity = discontinuous(&mesh, 4, 2);
        let values = |x: Point| exact.at(x, 0.0);
        fields.v = project::interpolate_vector(&fields.v.space, |x| values(x).velocity);
        fields.sides = fields.v.clone();
        fields.p = project::interpolate_vector(&polarity, |x| values(x).polarity);
        let l = |x: Point| {
            let [a, b] = *exact.series(&m, x, 0.0).molecular();
            Point::new(a.value(), b.value()) / m.elasticity
        };
        fields.l = project::interpolate_vector(&polarity, l);
        if m.density.is_some() {
            fields.rho = project::interpolate_scalar(&fields.rho.space, |x| values(x).volume);
            integrate(MASS, &fields, &fields.rho.space, (&m, &exact));
        }
        integrate(MOMENTUM, &fields, &fields.v.space, (&m, &exact));
        integrate(POLARITY, &fields, &fields.p.space, (&m, &exact));
        integrate(MOLECULAR, &fields, &fields.p.space, (&m, &exact));
    }
}

/// Fields as formulas of turned or mirrored coordinates: `x ↦ R f(Rᵀ x)`.
fn moved(m: &Parameters, [[a, b], [c, d]]: [[f64; 2]; 2]) -> Exact {
    let (x, y) = (format!("({a}*x + {c}*y)"), format!("({b}*x + {d}*y)"));
    let at = |text: &str| text.replace('X', &x).replace('Y', &y);
    let pair = |f: &str, g: &str| {
        let (f, g) = (at(f), at(g));
        [format!("{a}*({f}) + {b}*({g})"), format!("{c}*({f}) + {d}*({g})")]
            .map(|text| Expression::parse(&text, &[]).expect("the formula parses"))
    };
    let rho = Expression::parse(&at("1.1 + 0.2*X - 0.3*Y + 0.1*X*Y"), &[]).unwrap();
    let (v, p) = (pair("sin(X)*Y + t", "cos(Y) - X^2"), pair("cos(X + 2*Y) + 0.1*t", "0.3*X^2 - Y + t"));
    match m.density {
        None => Exact::new(v, rho, p),
        Some(_) => Exact::compressible(v, rho, p),
    }
    .expect("the fields have derivatives")
}

/// No term knows a direction or a handedness of its own: turned and mirrored fields have turned and mirrored values.
fn symmetric<V: Jet>(list: &'static [Term<V>], scalar: bool) {
    let (s, c) = 0.7_f64.sin_cos();
    for m in sheets() {
        for r in [[[c, -s], [s, c]], [[1.0, 0.0], [0.0, -1.0]]] {
            let (before, after) = (moved(&m, [[1.0, 0.0], [0.0, 1.0]]), moved(&m, r));
            let turned = |p: Point| Point::new(r[0][0] * p.x + r[0][1] * p.y, r[1][0] * p.x + r[1][1] * p.y);
            let x = Point::new(0.3, -0.2);
            for term in list.iter().filter(|term| term.is_on(&m)) {
                let (one, other) = (before.series(&m, x, 0.4), after.series(&m, turned(x), 0.4));
                let Some((one, other)) = strong_at(term, &one).zip(strong_at(term, &other)) else { continue };
                let wanted = if scalar { one } else { turned(one) };
                let off = (other - wanted).norm();
                assert!(off < 1e-10 * one.norm().max(1.0), "`{}`: {other} against {wanted}", term.name);
            }
        }
    }
}

#[test]
fn terms_turn_with_the_fields() {
    symmetric(MOMENTUM, false);
    symmetric(MASS, true);
    symmetric(POLARITY, false);
    symmetric(MOLECULAR, false);
}

#[test]
fn a_term_that_is_off_is_not_assembled() {
    let fields = Fields::random(&square(2));
    let given = fields.given();
    let off = Parameters { friction: 0.0, traction: 0.0, alignment: 0.0, ..Parameters::PLAIN };
    let at = fields.at(&off, &given);
    assert!(Sum::of(&[MOMENTUM]).value(&at).is_zero(), "no force without traction, elasticity and activity");
    let on = |m: &Parameters| m.terms().iter().filter(|term| term.on).map(|term| term.name).collect::<Vec<_>>();
    assert_eq!(
        on(&off),
        [
            "viscosity",
            "pressure",
            "polarity rate",
            "polarity advection",
            "polarity rotation",
            "polarity relaxation",
            "polarity coherence"
        ]
    );
    // every term but those that are always on can be switched off
    for m in sheets() {
        let names = on(&m);
        let (has, all) = (names.len(), m.terms().len());
        assert_eq!(has, all, "every term that the sheet has is on: {names:?}");
    }
}

/// A Stokes flow is a sheet without polarity: its matrix and its force are those of the sheet's terms about the flow.
#[test]
fn a_stokes_flow_has_the_terms_of_the_sheet_about_the_flow() {
    let pair = |a: &str, b: &str| [a, b].map(|text| Expression::parse(text, &[]).expect("the formula parses"));
    let v = || pair("sin(x)*exp(y) + t", "-cos(x)*exp(y)");
    let pi = || Expression::parse("x*y^2 - t", &[]).expect("the formula parses");
    let flow = Exact::stokes(v(), pi());
    let sheet = Exact::new(v(), pi(), pair("x", "y")).unwrap();
    assert!(sheet.has_polarity() && !flow.has_polarity());
    for friction in [0.0, 1.3] {
        let (fluid, bare) = (Fluid { friction }, Parameters { friction, traction: 0.0, ..Parameters::PLAIN });
        assert_eq!(FlowTerms::of(&fluid), FlowTerms::of(&bare));
        let told: Vec<(&str, bool)> = fluid.terms().iter().map(|term| (term.name, term.on)).collect();
        assert_eq!(told, [("viscosity", true), ("friction", friction > 0.0), ("pressure", true)]);
        for term in fluid.terms() {
            assert!(bare.terms().contains(&term), "{term:?}");
        }
        let (x, t) = (Point::new(0.3, -0.2), 0.4);
        assert_eq!(flow.force(&fluid, x, t), sheet.force(&bare, x, t));
        assert_eq!(flow.stress(&fluid, x, t), sheet.stress(&bare, x, t));
        // −Δv + ∇Π + C_F v of a solenoidal v, whose Laplacian vanishes here
        let wanted = Point::new(x.y.powi(2), 2.0 * x.x * x.y) + friction * flow.flow(x, t).value;
        assert!((flow.force(&fluid, x, t) - wanted).norm() < 1e-14);
    }
}
