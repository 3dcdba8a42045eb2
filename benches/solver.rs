//! What a time step is made of, on the strip with a disc: assembly, factorisations, solves, and whole steps.
//!
//! On a coarse mesh, or with `MONOLAYER_BENCH=full` on that of the study. The number after the name is that of the
//! cells.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, BenchmarkId, Criterion, SamplingMode, criterion_group, criterion_main};
use monolayer::form::upwind::Carrier;
use monolayer::form::{mass, stokes};
use monolayer::model::condensed::Condensed;
use monolayer::model::fields::{POLARITY, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::lagged::{Lagged, Parts, Structure};
use monolayer::model::tangent::{HybridTangent, Tangent};
use monolayer::model::terms::At;
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};
use monolayer::solve::multifrontal::Precision;
use monolayer::solve::sparse::{Factored, Matrix};
use monolayer::time::sheet::SheetKind;
use monolayer::time::{Checkpoint, March};

/// What the coupled factors are kept in, and how making them is called.
const PRECISIONS: [(Precision, [&str; 2]); 2] = [
    (Precision::Double, ["coupled new", "coupled renew"]),
    (Precision::Single, ["coupled single new", "coupled single renew"]),
];

/// Steps before the state at which everything is measured: the BDF has its order, and Newton's method its factors.
const STEPS: usize = 3;

/// The strip of the study with a coupling and a form of the polarity, on the mesh that the environment asks for.
fn strip(coupling: &str, form: &str) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/strip/strip.toml");
    let mut source = SceneSource::read(&file).expect("the study can be read");
    let full = std::env::var("MONOLAYER_BENCH").is_ok_and(|size| size == "full");
    let mesh: &[(&str, &str)] = if full { &[] } else { &[("mesh.h", "2.0"), ("mesh.h_disc", "0.4")] };
    for (key, value) in [("coupling.kind", coupling), ("model.polarity_form", form)].iter().chain(mesh) {
        source.set(key, value).expect("the study has this key");
    }
    Scene::check(source).expect("the scene is good")
}

/// The model and the march after its first steps.
struct Bench {
    scene: Scene,
    setup: Setup,
    after: Checkpoint,
}

impl Bench {
    fn new(coupling: &str, form: &str) -> Self {
        let scene = strip(coupling, form);
        let setup = Setup::new(&scene).expect("the model builds");
        let mut march = setup.start(&scene).expect("the start is good");
        for _ in 0..STEPS {
            march.advance(f64::INFINITY).expect("the step converges");
        }
        let after = march.checkpoint();
        Self { scene, setup, after }
    }

    fn model(&self) -> &Incompressible {
        match self.setup.model.kind() {
            SheetKind::Incompressible(model) => model,
            SheetKind::Compressible(_) => panic!("the strip is incompressible"),
        }
    }

    fn march(&self) -> March<'_> {
        March::resume(self.model(), self.scene.march(), self.after.clone())
    }

    fn state(&self) -> State {
        self.march().state
    }

    fn id(&self, name: &str) -> BenchmarkId {
        BenchmarkId::new(name, self.setup.ground.mesh.cells.len())
    }

    /// Weight `α₀/Δt` of the new polarity in BDF2.
    fn weight(&self) -> f64 {
        1.5 / self.scene.time.control.step
    }

    fn tangent<'s>(&'s self, state: &'s State) -> Tangent<'s> {
        Tangent::new(self.model(), state, &state[VELOCITY], self.weight(), self.after.t)
    }
}

/// The hybrid form: derivative, condensation, factors, a solve with them, and a product with the condensed matrix.
fn hybrid(criterion: &mut Criterion, bench: &Bench) {
    let (model, state) = (bench.model(), &bench.state());
    let new = || HybridTangent::new(model, state, bench.weight(), bench.after.t);
    let condense = |tangent| Condensed::new(model.frame(), tangent).expect("the cells are regular");
    let mut group = group(criterion, "hybrid", 5);
    group.bench_function(bench.id("tangent"), |b| b.iter(new));
    let tangent = new();
    group.bench_function(bench.id("condense"), |b| b.iter(|| condense(&tangent)));
    let condensed = condense(&tangent);
    let structure = Structure::new("coupled", &model.layout()).expect("the structure is sound");
    let right = model.polarity.mass_times(&state[POLARITY].values);
    for (precision, [new, renew, solve]) in [
        (Precision::Double, ["coupled new", "coupled renew", "coupled solve"]),
        (Precision::Single, ["coupled single new", "coupled single renew", "coupled single solve"]),
    ] {
        let make = || Lagged::new(&structure, &condensed, precision).expect("the matrix is regular");
        group.bench_function(bench.id(new), |b| b.iter(make));
        let mut lagged = make();
        group.bench_function(bench.id(renew), |b| {
            b.iter(|| lagged.renew(&condensed).expect("the matrix is regular"));
        });
        group.bench_function(bench.id(solve), |b| {
            b.iter_batched_ref(|| right.clone(), |r| lagged.solve(r), BatchSize::LargeInput);
        });
    }
    let x = condensed.eliminated().forward(&right);
    let mut y = vec![0.0; x.len()];
    group.bench_function(bench.id("product"), |b| b.iter(|| condensed.times(&x, &mut y)));
    group.finish();
}

/// Few samples: one of them may take a second. Each benchmark of the group is given some seconds, or what ten samples
/// take.
fn group<'c>(criterion: &'c mut Criterion, name: &str, seconds: u64) -> BenchmarkGroup<'c, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(seconds));
    group
}

fn assemble(criterion: &mut Criterion, bench: &Bench) {
    let (model, state) = (bench.model(), &bench.state());
    let inputs = model.inputs(bench.after.t).expect("the formulas are finite");
    let mut operator = model.polarity.empty_operator();
    let mut group = group(criterion, "assemble", 3);
    group.bench_function(bench.id("polarity operator"), |b| {
        b.iter(|| {
            let given = model.given(bench.after.t);
            let at = At::new(&model.parameters, &state[POLARITY], &given)
                .with_flow(&state[VELOCITY].space, Carrier::from(&state[VELOCITY]));
            model.polarity.pass(&model.loops, bench.weight(), &at, &mut operator)
        });
    });
    group.bench_function(bench.id("force"), |b| b.iter(|| model.force(&state[POLARITY], &state[VELOCITY], &inputs)));
    group.bench_function(bench.id("tangent"), |b| b.iter(|| bench.tangent(black_box(state))));
    group.finish();
}

/// `[K G; Gᵀ 0]` of the free unknowns.
fn stokes_matrix(model: &Incompressible) -> Matrix {
    let (momentum, loops) = (&model.momentum, &model.loops);
    let (velocity, pressure, frames) = (&*momentum.velocity, &*momentum.pressure, &momentum.frames);
    let (nv, np) = (velocity.dof_count(), pressure.dof_count());
    let form = stokes::viscosity(velocity) + model.parameters.friction * mass::vector_mass(velocity);
    let stiffness = Matrix::from_triplets(nv, nv, &loops.triplets(&form, velocity, velocity));
    let gradient = loops.triplets(&stokes::divergence(velocity, pressure), pressure, velocity);
    let mut triplets = frames.reduce(&stiffness);
    for (i, j, value) in frames.reduce_rows(&Matrix::from_triplets(nv, np, &gradient)) {
        triplets.extend([(i, frames.free + j, value), (frames.free + j, i, value)]);
    }
    Matrix::from_triplets(frames.free + np, frames.free + np, &triplets)
}

fn factorise(criterion: &mut Criterion, bench: &Bench) {
    let (model, state) = (bench.model(), bench.state());
    let (stokes, tangent) = (stokes_matrix(model), bench.tangent(&state));
    let structure = Structure::new("coupled", &model.layout()).expect("the structure is sound");
    let mut group = group(criterion, "factorise", 5);
    group.bench_function(bench.id("stokes"), |b| {
        let factor = |matrix| Factored::new("Stokes", matrix).expect("the matrix is regular");
        b.iter_batched(|| stokes.clone(), factor, BatchSize::PerIteration);
    });
    group.bench_function(bench.id("coupled structure"), |b| b.iter(|| Structure::new("coupled", &model.layout())));
    for (precision, [new, renew]) in PRECISIONS {
        let make = || Lagged::new(&structure, &Parts::new(&tangent), precision).expect("the matrix is regular");
        group.bench_function(bench.id(new), |b| b.iter(make));
        let mut lagged = make();
        group.bench_function(bench.id(renew), |b| {
            b.iter(|| lagged.renew(&Parts::new(&tangent)).expect("the matrix is regular"));
        });
    }
    group.finish();
}

fn solve(criterion: &mut Criterion, bench: &Bench) {
    let (model, state) = (bench.model(), &bench.state());
    let inputs = model.inputs(bench.after.t).expect("the formulas are finite");
    let force = model.force(&state[POLARITY], &state[VELOCITY], &inputs);
    let structure = Structure::new("coupled", &model.layout()).expect("the structure is sound");
    let right = model.polarity.mass_times(&state[POLARITY].values);
    let mut group = group(criterion, "solve", 3);
    group.bench_function(bench.id("stokes"), |b| b.iter(|| model.flow_of(&force, &inputs)));
    let tangent = bench.tangent(state);
    for (precision, name) in [(Precision::Double, "coupled"), (Precision::Single, "coupled single")] {
        let lagged = Lagged::new(&structure, &Parts::new(&tangent), precision).expect("the matrix is regular");
        group.bench_function(bench.id(name), |b| {
            b.iter_batched_ref(|| right.clone(), |r| lagged.solve(r), BatchSize::LargeInput);
        });
    }
    group.finish();
}

fn step(criterion: &mut Criterion, name: &str, bench: &Bench) {
    let mut group = group(criterion, "step", 10);
    // the march is returned so that it is dropped off the clock
    fn advance(mut march: March<'_>) -> March<'_> {
        march.advance(f64::INFINITY).expect("the step converges");
        march
    }
    group.bench_function(bench.id(name), |b| b.iter_batched(|| bench.march(), advance, BatchSize::PerIteration));
    group.finish();
}

fn all(criterion: &mut Criterion) {
    let newton = Bench::new("newton", "direct");
    assemble(criterion, &newton);
    factorise(criterion, &newton);
    solve(criterion, &newton);
    step(criterion, "newton", &newton);
    step(criterion, "anderson", &Bench::new("anderson", "direct"));
    drop(newton);
    let newton = Bench::new("newton", "hybrid");
    hybrid(criterion, &newton);
    step(criterion, "hybrid newton", &newton);
    step(criterion, "hybrid anderson", &Bench::new("anderson", "hybrid"));
}

criterion_group!(benches, all);
criterion_main!(benches);
