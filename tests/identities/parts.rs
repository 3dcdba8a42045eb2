//! Parts of a mesh that share no faces are solved as if each were alone.

use std::sync::Arc;

use crate::common::*;
use crate::model::{PARAMETERS, formula, settings};
use monolayer::measure::StreamFunction;
use monolayer::mesh::{BoundaryEdge, Mesh, Point};
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::Incompressible;
use monolayer::model::momentum::MomentumError;
use monolayer::model::{Conditions, Description, ElasticForce, Parameters, VelocityCondition};
use monolayer::space::Field;
use monolayer::time::equations::Equations;
use monolayer::time::{CouplingKind, March, Phases, Weights};

/// A mesh moved aside, its tags with a prefix.
fn moved(mesh: &Mesh, by: Point, prefix: &str) -> Mesh {
    joined(&[(mesh, by, prefix)])
}

/// Meshes beside each other as one, cells in their order.
fn joined(parts: &[(&Mesh, Point, &str)]) -> Mesh {
    let (mut vertices, mut cells, mut boundary) = (Vec::new(), Vec::new(), Vec::new());
    let mut tags = Vec::new();
    for (mesh, by, prefix) in parts {
        let (v, t) = (vertices.len(), tags.len());
        vertices.extend(mesh.vertices.iter().map(|x| x + by));
        cells.extend(mesh.cells.iter().map(|cell| cell.map(|k| k + v)));
        tags.extend(mesh.tags.iter().map(|tag| format!("{prefix}{tag}")));
        let edge = |face: &monolayer::mesh::Face| {
            let tag = face.tag? + t;
            Some(BoundaryEdge { vertices: mesh.face_vertices(face).map(|k| k + v), tag, curve: None })
        };
        boundary.extend(mesh.faces.iter().filter_map(edge));
    }
    Mesh::build(vertices, cells, &boundary, tags, Vec::new()).expect("parts lie apart")
}

/// Two squares of different size, alone and together.
fn meshes() -> [Arc<Mesh>; 3] {
    let (a, b) = (square(3), mesh("shape = \"square\"\nn = 2\nlength = [0.0, 1.5]\ndistortion = 0.1"));
    let (zero, by) = (Point::zeros(), Point::new(4.0, 0.5));
    [moved(&a, zero, "a:"), moved(&b, by, "b:"), joined(&[(&a, zero, "a:"), (&b, by, "b:")])].map(Arc::new)
}

fn dirichlet(u: &str, v: &str) -> Conditions {
    Conditions::flow([formula(u), formula(v)])
}

/// Polarity of one value flows in.
fn uniform() -> Conditions {
    open().with_polarity([formula("0.5"), formula("1")])
}

/// Polarity flows in whose value varies, on a face where the flow turns round.
fn open() -> Conditions {
    let pulled = Conditions::new(VelocityCondition::Traction([formula("0.3"), formula("y")]));
    pulled.with_polarity([formula("0.5"), formula("cos(3*y)")])
}

fn assert_close(alone: [Vec<f64>; 2], together: &[f64], what: &str) {
    let alone = alone.concat();
    let scale = alone.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    assert_eq!(alone.len(), together.len());
    let worst = alone.iter().zip(together).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(scale > 0.0 && worst < 1e-8 * scale, "{what}: {worst:e} of {scale}");
}

const CONDITIONS: [fn(&str) -> Conditions; 6] = [
    |_| Conditions::slip(),
    |tag| if tag == "a:left" { uniform() } else { Conditions::slip() },
    |tag| if tag == "b:top" { uniform() } else { Conditions::slip() },
    |tag| if tag == "a:left" { open() } else { Conditions::slip() },
    |tag| if tag == "b:top" { open() } else { Conditions::slip() },
    |tag| match tag {
        "a:left" | "a:right" => dirichlet("1 + y", "0"),
        _ => Conditions::slip(),
    },
];

const KINDS: [CouplingKind; 2] = [CouplingKind::Newton, CouplingKind::Anderson { depth: 5 }];

/// The sheets on both parts alone and together, each with its rough start.
fn cases(elastic_force: ElasticForce, condition: fn(&str) -> Conditions) -> [(Incompressible, Vec<f64>); 3] {
    let models = meshes().map(|mesh| {
        let parameters = Parameters { elastic_force, ..PARAMETERS };
        Incompressible::new(&mesh, &Description::new(&mesh, parameters, condition)).unwrap()
    });
    let [a, b] = [0, 1].map(|part| random(&models[part].polarity.space, part as u64 + 1).values);
    let both = [a.clone(), b.clone()].concat();
    let mut starts = [a, b, both].into_iter();
    models.map(|model| (model, starts.next().unwrap()))
}

/// Velocity, pressure and polarity after three steps, none of which is refused: the time would be another.
fn after_three(model: &Incompressible, start: &[f64], step: f64, kind: CouplingKind) -> [Vec<f64>; 3] {
    let mut settings = settings(step, 2);
    settings.coupling.kind = kind;
    let mut march = March::start(model, settings, start.to_vec()).unwrap();
    for _ in 0..3 {
        assert_eq!(march.advance(1e9).expect("the step converges").rejected, 0, "{kind:?}");
    }
    let pressure = model.pressure(&march.state).unwrap();
    let velocity = model.momentum.velocity.by_cell(&march.state[VELOCITY].values);
    [velocity, pressure.space.by_cell(&pressure.values), march.state[POLARITY].values.clone()]
}

#[test]
fn parts_flow_as_if_alone() {
    for (kind, condition) in KINDS.into_iter().flat_map(|kind| CONDITIONS.map(|condition| (kind, condition))) {
        for elastic_force in [ElasticForce::Stress, ElasticForce::Energy] {
            let cases = cases(elastic_force, condition);
            let ends: Vec<[Vec<f64>; 3]> =
                cases.iter().map(|(model, start)| after_three(model, start, 0.02, kind)).collect();
            for (at, field) in ["velocity", "pressure", "polarity"].into_iter().enumerate() {
                let what = format!("{field}, {kind:?}, {elastic_force:?}");
                assert_close([ends[0][at].clone(), ends[1][at].clone()], &ends[2][at], &what);
            }
        }
    }
}

/// Newton's method and iterations in turn solve the same equations, flow and polarity together, also where the flow
/// turns round on a face through which polarity enters.
#[test]
fn whatever_a_step_ends_at_solves_its_equations() {
    for (kind, condition) in KINDS.into_iter().flat_map(|kind| CONDITIONS.map(|condition| (kind, condition))) {
        for (model, start) in &cases(ElasticForce::Energy, condition) {
            let mut settings = settings(0.02, 2);
            settings.coupling.kind = kind;
            let mut march = March::start(model, settings, start.clone()).unwrap();
            let before = march.state[VELOCITY].clone();
            let dt = march.advance(1e9).expect("the step converges").dt;
            let (weights, history) = (Weights::both(1.0 / dt), start.iter().map(|y| -y / dt).collect());
            let inputs = model.inputs(march.t).unwrap();
            let equations = Equations { model, inputs, before, weights, history };
            let size = |y: &[f64]| equations.evaluate(y.to_vec(), &mut Phases::default()).unwrap();
            let (first, last) = (size(start), size(&march.state[POLARITY].values));
            assert!(last.size < 1e-12 * first.size, "{kind:?}: {:e} of {:e}", last.size, first.size);
            let flows = last.state[VELOCITY].values.iter().zip(&march.state[VELOCITY].values);
            let apart = flows.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9, "{kind:?}: the flow is not that of its polarity: {apart:e}");
        }
    }
}

#[test]
fn every_closed_part_has_a_pressure_of_zero_mean_and_its_own_count() {
    let [_, _, both] = meshes();
    for (condition, count) in [
        ((|_| Conditions::slip()) as fn(&str) -> Conditions, 2),
        (|tag| if tag == "a:left" { open() } else { Conditions::slip() }, 1),
        (|tag| if tag.ends_with("left") { open() } else { Conditions::slip() }, 0),
    ] {
        let model = Incompressible::new(&both, &Description::new(&both, PARAMETERS, condition)).unwrap();
        let closed = &model.momentum.closed;
        assert_eq!(closed.count(), count);
        let (_, pi) = model.flow(&random(&model.polarity.space, 3), 0.0).unwrap();
        for part in 0..count {
            let over = |x: &monolayer::form::CellPoint| closed.of_cell(x.site.cell) == Some(part);
            let mean = model.loops.sum(4, |x| if over(x) { pi.scalar(&x.site) } else { 0.0 });
            assert!(mean.abs() < 1e-12, "part {part}: {mean:e}");
        }
    }
}

#[test]
fn a_net_flux_and_a_free_motion_are_blamed_on_their_part() {
    let [_, _, both] = meshes();
    // together the fluxes cancel
    let leaks = |tag: &str| match tag {
        "a:right" => dirichlet("1.5", "0"),
        "b:right" => dirichlet("-1", "0"),
        _ => Conditions::slip(),
    };
    let model = Incompressible::new(&both, &Description::new(&both, PARAMETERS, leaks)).unwrap();
    let error = model.flow(&model.zero().into_field(POLARITY), 0.0).unwrap_err();
    let MomentumError::Flux { flux, .. } = &error else { panic!("{error}") };
    assert!((flux.abs() - 1.5).abs() < 1e-9 && error.to_string().contains("of the part of the mesh at (0."), "{error}");

    let free = Conditions::open();
    let parameters = Parameters { friction: 0.0, ..PARAMETERS };
    let held = |tag: &str| if tag == "a:left" { dirichlet("0", "0") } else { free.clone() };
    let error = Incompressible::new(&both, &Description::new(&both, parameters, held)).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, MomentumError::Unheld { .. }), "{text}");
    assert!(text.contains("of the part of the mesh around (4.") && text.contains("every part"), "{text}");
}

#[test]
fn every_part_has_its_own_stream_function() {
    let [a, b, both] = meshes().map(|mesh| {
        let (loops, velocity) = (loops(&mesh), continuous(&mesh, 2, 2));
        let flow = |x: Point| Point::new(x.y * x.y - x.x, x.y + 0.3 * x.x * x.x);
        let nodal: Vec<Point> = velocity.node_positions().into_iter().map(flow).collect();
        let values = nodal.iter().flat_map(|v| [v.x, v.y]).collect();
        let psi = StreamFunction::new(&loops, &velocity).unwrap().of(&loops, &Field::new(&velocity, values)).unwrap();
        psi.space.by_cell(&psi.values)
    });
    assert_close([a, b], &both, "stream function");
}
