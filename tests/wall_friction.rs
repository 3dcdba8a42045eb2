//! Walls with friction, `v·n = 0` and `(n·σ)·t = −β_w v·t`: closed forms, orders, limits, and the energy law.

use std::path::Path;
use std::sync::Arc;

use monolayer::expression::Expression;
use monolayer::form::mass;
use monolayer::measure::Budget;
use monolayer::measure::errors::{History, Norm, errors};
use monolayer::mesh::generate::MeshScene;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::compressible::Compressible;
use monolayer::model::fields::{DENSITY, POLARITY, PRESSURE, VELOCITY};
use monolayer::model::immersed::flow::{Flow, Settings};
use monolayer::model::incompressible::{Degrees, Description, Incompressible, State};
use monolayer::model::momentum::{MomentumError, SlipTreatment};
use monolayer::model::{
    Conditions, DensityLaw, ElasticForce, Parameters, PolarityCondition, Sources, VelocityCondition,
};
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};
use monolayer::space::{Field, project};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TREATMENTS: [SlipTreatment; 2] = [SlipTreatment::Rotated, SlipTreatment::Penalty { epsilon: 1e-8 }];

fn formula(text: &str) -> Expression {
    Expression::parse(text, &[]).expect("the test's formula parses")
}

fn mesh(text: &str) -> Arc<Mesh> {
    let scene: MeshScene = toml::from_str(text).expect("the test's mesh table parses");
    Arc::new(scene.build().expect("the test's mesh is good"))
}

fn square(n: usize) -> Arc<Mesh> {
    mesh(&format!("shape = \"square\"\nn = {n}\ndistortion = 0.2\nseed = 7"))
}

fn friction(beta: &str) -> VelocityCondition {
    VelocityCondition::Friction(formula(beta))
}

fn with(velocity: VelocityCondition) -> Conditions {
    let density = (!velocity.is_impermeable()).then(|| formula("1"));
    Conditions { velocity, polarity: PolarityCondition::Neumann, density }
}

fn describe(mesh: &Mesh, parameters: Parameters, velocity: impl Fn(&str) -> VelocityCondition) -> Description {
    Description {
        parameters,
        degrees: Degrees { velocity: 2, pressure: 1, density: 1, polarity: 2 },
        conditions: mesh.tags.iter().map(|tag| with(velocity(tag))).collect(),
        sources: Sources::default(),
        slip: SlipTreatment::Rotated,
    }
}

/// Neither friction with the substrate nor activity.
const STOKES: Parameters = Parameters { friction: 0.0, traction: 0.0, ..Parameters::PLAIN };

/// The force along the channel.
const PUSH: f64 = 2.0;

/// Walls that resist in different ways, one of them by a formula, and open ends without a normal stress.
fn channel(tag: &str) -> VelocityCondition {
    match tag {
        "bottom" => friction("3"),
        "top" => friction("0.2 + 0.3*sin(x)^2 + 0.3*cos(x)^2"),
        _ => VelocityCondition::NoTangential,
    }
}

/// `−μ u″ = PUSH`, `μ u′(0) = β₀ u(0)`, `μ u′(1) = −β₁ u(1)` with β₀ = 3 and β₁ = ½.
fn profile(viscosity: f64, y: f64) -> f64 {
    let (g, b0, b1) = (PUSH / viscosity, 3.0 / viscosity, 0.5 / viscosity);
    let at_wall = g * (1.0 + 0.5 * b1) / (b0 * (1.0 + b1) + b1);
    at_wall * (1.0 + b0 * y) - 0.5 * g * y * y
}

#[track_caller]
fn is_profile(v: &Field, viscosity: f64, tolerance: f64) {
    for (node, x) in v.space.node_positions().into_iter().enumerate() {
        let found = Point::new(v.values[2 * node], v.values[2 * node + 1]);
        let apart = (found - Point::new(profile(viscosity, x.y), 0.0)).norm();
        assert!(apart < tolerance, "at {x}: {found}, not {}", profile(viscosity, x.y));
    }
}

#[test]
fn a_channel_with_resisting_walls_has_its_parabola() {
    for (slip, tolerance) in TREATMENTS.into_iter().zip([1e-12, 1e-7]) {
        let mesh = square(3);
        let mut description = describe(&mesh, STOKES, channel);
        description.slip = slip;
        description.sources.force = Some([formula("2"), formula("0")]);
        let tissue = Incompressible::new(&mesh, &description).expect("the walls hold the tissue");
        let (v, pi) = tissue.flow(&tissue.zero()[POLARITY], 0.0).unwrap();
        is_profile(&v, 1.0, tolerance);
        assert!(pi.values.iter().all(|pi| pi.abs() < 1e-6));
        // the slip length is 1/β_w: the tangent at the wall meets zero that far behind it
        let slope = (profile(1.0, 1e-6) - profile(1.0, 0.0)) / 1e-6;
        assert!((profile(1.0, 0.0) / slope - 1.0 / 3.0).abs() < 1e-5);

        let settings = Settings::default();
        let conditions = &description.conditions;
        let flow = Flow::new(&mesh, (2, 1), conditions, (0.0, slip), Vec::new(), (settings, 0.0)).unwrap();
        let carried = flow.solve(&mass::load(&flow.momentum.velocity, 0, |_| Point::new(PUSH, 0.0))).unwrap();
        is_profile(&Field::new(&flow.momentum.velocity, carried.v), 1.0, tolerance);

        let law = DensityLaw { penalty: 0.0, exponent: 1.0, critical: 0.0, active_stress_iso: 0.0 };
        description.parameters.density = Some(law);
        let sheet = Compressible::new(&mesh, &description).expect("the walls hold the tissue");
        let rho = project::interpolate_scalar(&sheet.density.space, |_| 2.0);
        let p = Field::zero(&sheet.polarity.space);
        let (v, _) = sheet.flow(&rho, &p, None, &sheet.inputs(0.0).unwrap()).unwrap();
        is_profile(&v, 2.0, tolerance);
    }
}

/// Error of the flow in a ring whose outer wall turns and whose inner one resists: `v_θ = A r + B/r` with
/// `2B/a² = −β (A a + B/a)` and `A b + B/b = b`.
fn ring_error(h: f64, slip: SlipTreatment) -> f64 {
    let mesh = mesh(&format!("shape = \"annulus\"\nradius = 2.0\ninner_radius = 1.0\nh = {h}\ncurved = 2"));
    let beta = 4.0;
    // with a = 1, b = 2: B = −βA/(2 + β)
    let a = 1.0 / (1.0 - beta / (2.0 + beta) / 4.0);
    let b = -beta * a / (2.0 + beta);
    let outer = || VelocityCondition::Dirichlet([formula("-y"), formula("x")]);
    let mut description = describe(&mesh, STOKES, |tag| if tag.contains("inner") { friction("4") } else { outer() });
    description.slip = slip;
    let walls = description.conditions.iter().filter(|c| c.velocity.resistance().is_some()).count();
    assert_eq!(walls, 1, "{:?}", mesh.tags);
    let model = Incompressible::new(&mesh, &description).unwrap();
    let (v, _) = model.flow(&model.zero()[POLARITY], 0.0).unwrap();
    let square = model.loops.sum(10, |x| {
        let at = x.site.x;
        (v.vector(&x.site) - Point::new(-at.y, at.x) * (a + b / at.norm_squared())).norm_squared()
    });
    square.sqrt()
}

#[test]
fn a_curved_wall_resists_with_the_order_of_the_velocity() {
    for slip in TREATMENTS {
        let [coarse, fine] = [0.4, 0.2].map(|h| ring_error(h, slip));
        println!("{slip:?}: {coarse:.2e}, {fine:.2e}");
        assert!(fine < 1e-3 && coarse / fine > 6.0, "{slip:?}: {coarse:e}, {fine:e}");
    }
}

/// Errors of a shipped manufactured case with friction on its lower side, over all steps.
fn manufactured(scene: &str, n: usize, sets: &[(&str, &str)]) -> History {
    let text = std::fs::read_to_string(scene).unwrap();
    let mut source = SceneSource::parse(&text, Path::new("tests")).unwrap();
    source.set("mesh.n", &n.to_string()).unwrap();
    source.set("time.step", &(1.0 / (3 * n) as f64).to_string()).unwrap();
    source.set("time.end", "0.25").unwrap();
    sets.iter().for_each(|(key, value)| source.set(key, value).unwrap());
    let scene = Scene::check(source).unwrap();
    let setup = Setup::new(&scene).unwrap();
    let mut march = setup.start(&scene).unwrap();
    let mut history = History::default();
    while march.t < scene.time.end * (1.0 - 1e-12) {
        let dt = march.advance(scene.time.end).unwrap().dt;
        history.add(&errors(&*setup.model, scene.sources.exact.as_ref().unwrap(), &march.state, march.t), dt);
    }
    history
}

#[test]
fn exact_fields_stay_exact_on_walls_that_resist() {
    let resisting = [("boundary.bottom.velocity", "{ friction = \"3 + x\" }")];
    let by_penalty = [resisting[0], ("space.walls", "penalty")];
    let fields = [VELOCITY, PRESSURE, POLARITY];
    let squeezed = [VELOCITY, DENSITY, POLARITY];
    for (scene, fields, least) in [
        ("studies/mms/square.toml", fields, [2.8, 1.9, 1.9]),
        ("studies/mms/squeezed-square.toml", squeezed, [1.9, 1.8, 1.8]),
    ] {
        let slip = manufactured(scene, 16, &[]);
        for sets in [&resisting, &by_penalty[..]] {
            let [coarse, fine] = [8, 16].map(|n| manufactured(scene, n, sets));
            for (field, least) in fields.into_iter().zip(least) {
                let of = |history: &History| history.error(field, Norm::Square);
                let order = (of(&coarse) / of(&fine)).log2();
                println!("{scene} {}: {:.2e}, {:.2e}, order {order:.2}", field.name, of(&coarse), of(&fine));
                assert!(order > least, "{scene}: {} has order {order:.2}, not {least}", field.name);
                assert!(of(&fine) < 1.5 * of(&slip), "{scene}: {} is worse than with slip", field.name);
            }
        }
    }
}

const ACTIVE: Parameters = Parameters {
    friction: 2.0,
    traction: 3.0,
    active_stress: 0.7,
    peclet: 1.3,
    coherence: 0.3,
    elasticity: 0.6,
    alignment: 0.8,
    ..Parameters::PLAIN
};

fn random(count: usize, seed: u64) -> Vec<f64> {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| generator.random_range(-1.0..1.0)).collect()
}

/// The flow of a random polarity under one condition everywhere.
fn flow(mesh: &Arc<Mesh>, velocity: &VelocityCondition) -> Vec<f64> {
    let model = Incompressible::new(mesh, &describe(mesh, ACTIVE, |_| velocity.clone())).unwrap();
    let p = Field::new(&model.polarity.space, random(model.polarity.space.dof_count(), 5));
    model.flow(&p, 0.0).unwrap().0.values
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn no_friction_is_slip_and_much_friction_holds() {
    for mesh in [square(3), mesh("shape = \"disc\"\nh = 0.5")] {
        assert_eq!(flow(&mesh, &friction("0")), flow(&mesh, &VelocityCondition::Slip));
        let held = flow(&mesh, &VelocityCondition::Dirichlet([formula("0"), formula("0")]));
        let rests = |beta: &str| apart(&flow(&mesh, &friction(beta)), &held);
        let [little, much, more] = [rests("1"), rests("1e5"), rests("1e6")];
        println!("{little:.2e}, {much:.2e}, {more:.2e}");
        assert!(much < 1e-3 * little && (much / more - 10.0).abs() < 0.1, "{little:e}, {much:e}, {more:e}");
    }
}

#[test]
fn walls_that_resist_hold_tissue_without_a_substrate() {
    let mesh = mesh("shape = \"disc\"\nh = 0.5");
    let parameters = Parameters { friction: 0.0, ..ACTIVE };
    let built = |beta: &str| Incompressible::new(&mesh, &describe(&mesh, parameters, |_| friction(beta)));
    assert!(built("1e-3").is_ok());
    assert!(matches!(built("0").unwrap_err(), MomentumError::Unheld { .. }));
    let negative = built("x").unwrap_err().to_string();
    assert!(negative.contains("`x` is -") && negative.contains("the friction of a wall must not be"), "{negative}");
}

#[test]
fn the_energy_law_closes_with_what_walls_take() {
    let parameters = Parameters { elastic_force: ElasticForce::Energy, ..ACTIVE };
    // straight cells: on others the budget is as exact as its quadrature
    for mesh in [square(3), mesh("shape = \"disc\"\nh = 0.5\ncurved = 1")] {
        let model = Incompressible::new(&mesh, &describe(&mesh, parameters, |_| friction("2 + x"))).unwrap();
        let p = Field::new(&model.polarity.space, random(model.polarity.space.dof_count(), 3));
        let inputs = model.inputs(0.0).unwrap();
        let (mut v, mut pi) = (model.zero().into_field(VELOCITY), model.zero().into_field(PRESSURE));
        // the force looks upstream: repeat until the directions are those of the flow itself
        for _ in 0..60 {
            (v, pi) = model.flow_of(&model.force(&p, &v, &inputs), &inputs).unwrap();
        }
        let state = State::incompressible(v, pi, p);
        let residual: Vec<f64> =
            model.polarity_residual(&state, 0.0).iter().map(|r| -r / model.parameters.peclet).collect();
        let budget = Budget::at(&model, &state, &model.polarity.mass_solve(&residual), 0.0).unwrap();
        let terms = budget.lines.iter().chain([&budget.rate, &budget.relaxation]);
        let largest = terms.fold(0.0_f64, |most, term| most.max(term.abs()));
        println!("{budget:?}");
        assert!(budget.wall_friction > 1e-3 * largest, "walls take too little to tell: {budget:?}");
        assert!(budget.defect().abs() < 1e-12 * largest, "the law leaves {:e} of {budget:?}", budget.defect());
    }
}

#[test]
fn the_work_on_a_sheet_that_can_be_squeezed_goes_where_the_budget_says() {
    let mesh = square(3);
    let law = DensityLaw { penalty: 1.5, exponent: 2.5, critical: 0.3, active_stress_iso: 0.4 };
    let parameters = Parameters { density: Some(law), ..ACTIVE };
    for slip in [SlipTreatment::Rotated, SlipTreatment::Penalty { epsilon: 1e-8 }] {
        let mut description = describe(&mesh, parameters, |_| friction("2 + x"));
        description.slip = slip;
        let sheet = Compressible::new(&mesh, &description).unwrap();
        let rho = project::interpolate_scalar(&sheet.density.space, |x| 1.0 + 0.3 * x.x * x.y);
        let p = Field::new(&sheet.polarity.space, random(sheet.polarity.space.dof_count(), 3));
        let inputs = sheet.inputs(0.0).unwrap();
        let l = sheet.molecular(&sheet.molecular_functional(&rho, &p, 0.0));
        let (v, _) = sheet.flow(&rho, &p, l.as_ref(), &inputs).unwrap();
        let force = sheet.force(&rho, &p, l.as_ref(), &inputs);
        let work: f64 = force.iter().zip(&v.values).map(|(f, v)| f * v).sum();
        let state = State::compressible(v, rho, p);
        let budget = Budget::at(&sheet, &state, &vec![0.0; sheet.polarity.space.dof_count()], 0.0).unwrap();
        let taken = budget.line("budget_friction") + budget.line("budget_viscosity") + budget.wall_friction;
        let tolerance = if slip == SlipTreatment::Rotated { 1e-10 } else { 1e-5 };
        assert!(budget.wall_friction > 1e-3 * work, "walls take too little to tell: {budget:?}");
        assert!((taken - work).abs() < tolerance * work, "{slip:?}: {taken} of {work}");
    }
}
