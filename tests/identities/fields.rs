//! Every listed output field: what it says of itself, and its symmetries.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::common::*;
use monolayer::form::Faces;
use monolayer::measure::fields::{ALL, At, IN_CUTS, PartOf, Scalar, TissueFields, Tool, Tools, Value};
use monolayer::measure::{OutputField, Strain};
use monolayer::mesh::{Mesh, Point};
use monolayer::model::{
    Compressible, Conditions, DensityLaw, Description, ElasticForce, Incompressible, Parameters, State, fields,
};
use monolayer::space::{Field, project};
use monolayer::time::Sheet;

/// Sheets that have every field between them, without a traction: with one, free tissue goes along x₁.
fn sheets() -> [Parameters; 3] {
    let plain = Parameters {
        friction: 1.3,
        traction: 0.0,
        coherence: 0.4,
        elasticity: 0.6,
        alignment: 0.8,
        ..Parameters::PLAIN
    };
    let law = DensityLaw { penalty: 1.5, exponent: 1.0, critical: 0.3, active_stress_iso: 0.4 };
    [plain, Parameters { elastic_force: ElasticForce::Energy, ..plain }, Parameters { density: Some(law), ..plain }]
}

fn sheet(mesh: &Arc<Mesh>, m: Parameters) -> Box<dyn Sheet> {
    let description = Description::new(mesh, m, |_| Conditions::slip());
    match m.density {
        None => Box::new(Incompressible::new(mesh, &description).expect("a model")),
        Some(_) => Box::new(Compressible::new(mesh, &description).expect("a model")),
    }
}

/// A state of a sheet with the values of these functions: v, p, and one of Π and ρ.
fn state(
    model: &dyn Sheet,
    v: impl Fn(Point) -> Point,
    p: impl Fn(Point) -> Point,
    volume: impl Fn(Point) -> f64,
) -> State {
    State::of(model.fields().into_iter().map(|(id, space)| {
        let values = match id {
            id if *id == *fields::VELOCITY => project::interpolate_vector(space, &v),
            id if *id == *fields::POLARITY => project::interpolate_vector(space, &p),
            _ => project::interpolate_scalar(space, &volume),
        };
        (id, values)
    }))
}

/// Calls `then` with each field that a state has.
fn each_field(model: &dyn Sheet, state: &State, mut then: impl FnMut(&'static OutputField, Field)) {
    let mut tools = Tools::default();
    tools.strain = Some(Strain::new(&model.loops().mesh, 1, 0.2, Faces::BOUNDARY).expect("an equation"));
    let shown = TissueFields { model, state, t: 0.0 };
    for field in ALL {
        let found = (field.find)(&At { fields: &shown, tools: &tools }).expect("it can be solved for");
        found.into_iter().for_each(|found| then(field, found));
    }
}

#[test]
fn names_and_columns_are_said_once() {
    let (mut names, mut columns, mut scalars) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for field in ALL {
        assert!(names.insert(field.name), "{field:?} is there twice");
        assert!(!field.help.is_empty() && !field.needs.is_empty() && !field.kinds().is_empty(), "{field:?}");
        assert_eq!(field.columns.len(), field.value.components(), "{field:?}");
        field.columns.iter().for_each(|column| assert!(columns.insert(column), "{column} is there twice"));
        assert_eq!(field.length().is_some(), field.value == Value::Vector, "{field:?}: vectors have a length");
        let components = field.parts.iter().filter(|part| part.of != PartOf::Length);
        assert_eq!(components.count(), field.value.components(), "{field:?}");
    }
    for scalar in Scalar::all() {
        assert!(scalars.insert(scalar.part.name), "{} is there twice", scalar.part.name);
        assert_eq!(Scalar::named(scalar.part.name), Some(scalar));
        assert!(scalar.columns().iter().all(|column| scalar.field.columns.contains(column)));
    }
    assert!(IN_CUTS.iter().all(|field| ALL.contains(field)));
}

#[test]
fn every_field_is_found_in_some_sheet_with_its_components() {
    let mesh = square(2);
    let mut found = BTreeSet::new();
    for m in sheets() {
        let model = sheet(&mesh, m);
        let state = state(&*model, |x| turn(0.5, x), |x| turn(0.2, x), |_| 1.1);
        let degree = model.fields().iter().map(|(_, space)| space.degree).max().expect("fields");
        each_field(&*model, &state, |field, values| {
            assert_eq!(values.space.components, field.value.components(), "{field:?}");
            assert!(values.space.degree <= degree, "{field:?}: files have the highest degree of the model");
            assert!(values.values.iter().all(|value| value.is_finite()), "{field:?}");
            found.insert(field.name);
        });
    }
    assert_eq!(found, ALL.iter().map(|field| field.name).collect());
}

/// A uniform state has uniform fields; only the stream function is linear, which on curved cells is not in its space.
#[test]
fn uniform_states_have_uniform_fields() {
    for mesh in [square(3), disc()] {
        for m in sheets() {
            let model = sheet(&mesh, m);
            let (v, p) = (Point::new(0.3, -0.2), Point::new(0.8, 0.4));
            let state = state(&*model, |_| v, |_| p, |_| 1.1);
            let straight = mesh.curved.iter().all(Option::is_none);
            each_field(&*model, &state, |field, found| {
                if field.tool == Some(Tool::StreamFunction) && !straight {
                    return;
                }
                let cells = found.space.mesh.cells.len();
                let at = |share: f64, c: usize| {
                    let cell = (share * cells as f64) as usize;
                    let xi = Point::new(0.2, 0.3);
                    (found.component_at(cell, xi, c), found.space.mesh.map(cell).at(xi).0)
                };
                for c in 0..found.space.components {
                    let ((a, x), (b, y)) = (at(0.1, c), at(0.9, c));
                    let step = match field.tool {
                        // v = (∂₂ψ, −∂₁ψ)
                        Some(Tool::StreamFunction) => v.x * (y.y - x.y) - v.y * (y.x - x.x),
                        Some(Tool::Strain) | None => 0.0,
                    };
                    let off = (b - a - step).abs();
                    assert!(off < 1e-9, "{field:?}, component {c}: {a} and {b}");
                }
            });
        }
    }
}

/// A flow that turns, stretches and grows alike everywhere; on cells that are bent no more than the velocity is it lies
/// in its space.
#[test]
fn gradients_of_a_linear_flow_are_exact() {
    for mesh in [square(3), mesh("shape = \"disc\"\nh = 0.5\ncurved = 2")] {
        let model = sheet(&mesh, sheets()[0]);
        let v = |x: Point| Point::new(0.5 * x.x - 1.2 * x.y, 0.8 * x.x + 0.1 * x.y);
        let state = state(&*model, v, |x| x, |_| 1.0);
        let mut seen = 0;
        each_field(&*model, &state, |field, found| {
            let wanted = match field.name {
                "vorticity" => 2.0,
                "divergence" => 0.6,
                _ => return,
            };
            let off = found.values.iter().map(|value| (value - wanted).abs()).fold(0.0, f64::max);
            assert!(off < 1e-11, "{field:?}: {off:e}");
            seen += 1;
        });
        assert_eq!(seen, 2);
    }
}

/// A mesh of straight cells about the origin, turned.
fn turned(mesh: &Mesh, angle: f64) -> Arc<Mesh> {
    let mut mesh = mesh.clone();
    mesh.vertices.iter_mut().for_each(|x| *x = turn(angle, *x));
    Arc::new(mesh)
}

/// The value of a field where the whole plane was turned.
fn turned_value(value: Value, at: &[f64], angle: f64) -> Vec<f64> {
    let (s, c) = angle.sin_cos();
    match value {
        Value::Scalar => at.to_vec(),
        Value::Vector => turn(angle, Point::new(at[0], at[1])).iter().copied().collect(),
        Value::Tensor => {
            let [a, b, d] = [at[0], at[1], at[2]];
            let off = (a - d) * s * c + b * (c * c - s * s);
            vec![a * c * c - 2.0 * b * s * c + d * s * s, off, a * s * s + 2.0 * b * s * c + d * c * c]
        }
    }
}

/// No field knows a direction of its own: a turned state has turned fields.
#[test]
fn fields_turn_with_the_state() {
    let angle = 0.7;
    let mesh = square(3);
    let other = turned(&mesh, angle);
    let v = |x: Point| Point::new(0.3 * x.y.sin() + 0.2, 0.4 * x.x * x.y - 0.1);
    let p = |x: Point| Point::new((x.x + 2.0 * x.y).cos(), 0.3 * x.x * x.x - x.y);
    let rho = |x: Point| 1.1 + 0.2 * x.x - 0.3 * x.y * x.x;
    for m in sheets() {
        let (one, two) = (sheet(&mesh, m), sheet(&other, m));
        let before = state(&*one, v, p, rho);
        let back = |x: Point| turn(-angle, x);
        let after = state(&*two, |x| turn(angle, v(back(x))), |x| turn(angle, p(back(x))), |x| rho(back(x)));
        let mut found = Vec::new();
        each_field(&*one, &before, |field, values| found.push((field, values)));
        let mut found = found.into_iter();
        each_field(&*two, &after, |field, values| {
            let (same, wanted) = found.next().expect("the same fields");
            assert_eq!(field, same);
            let scale = wanted.values.iter().fold(1e-3_f64, |most, value| most.max(value.abs()));
            for cell in 0..mesh.cells.len() {
                for xi in [Point::new(0.1, 0.2), Point::new(0.7, 0.1), Point::new(0.0, 0.5)] {
                    let at = |of: &Field| -> Vec<f64> {
                        (0..of.space.components).map(|c| of.component_at(cell, xi, c)).collect()
                    };
                    let (found, wanted) = (at(&values), turned_value(field.value, &at(&wanted), angle));
                    let off = found.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                    assert!(off < 1e-8 * scale, "{field:?}: {found:?}, not {wanted:?}");
                }
            }
        });
        assert!(found.next().is_none());
    }
}
