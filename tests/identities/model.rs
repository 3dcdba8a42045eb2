use std::sync::Arc;

use crate::common::*;
use monolayer::expression::Expression;
use monolayer::form::{Density, Faces, elastic, polarity, upwind};
use monolayer::mesh::{Mesh, Point};
use monolayer::model::fields::{POLARITY, PRESSURE, VELOCITY};
use monolayer::model::incompressible::{Incompressible, State};
use monolayer::model::momentum::MomentumError;
use monolayer::model::parameters::PolarityForm;
use monolayer::model::terms::At;
use monolayer::model::{Conditions, Description, Parameters};
use monolayer::scheme::ControlSettings;
use monolayer::solve::sparse::Matrix;
use monolayer::space::{Field, project};
use monolayer::time::{CouplingKind, CouplingSettings, March, MarchSettings};
use rand::{RngExt, SeedableRng};

pub const PARAMETERS: Parameters = Parameters {
    friction: 2.0,
    traction: 3.0,
    active_stress: 0.7,
    peclet: 1.3,
    coherence: 0.3,
    elasticity: 0.6,
    alignment: 0.8,
    ..Parameters::PLAIN
};

pub const FORMS: [PolarityForm; 2] = [PolarityForm::Hybrid, PolarityForm::Direct];

pub fn formula(text: &str) -> Expression {
    Expression::parse(text, &[]).expect("the test's formula parses")
}

pub fn settings(step: f64, order: usize) -> MarchSettings {
    let kind = CouplingKind::Anderson { depth: 5 };
    let bounds = CouplingSettings { tolerance: 1e-11, accept: 1e-10, max_iterations: 200, ..Default::default() };
    let coupling = CouplingSettings { kind, ..bounds };
    MarchSettings { control: ControlSettings::new(step).down_to(1e-9), coupling, ..MarchSettings::new(order, step) }
}

fn march(model: &Incompressible, start: Field, steps: usize) -> State {
    let mut march = March::start(model, settings(0.05, 2), start.values).expect("the start solves");
    for _ in 0..steps {
        march.advance(1e9).expect("the step converges");
    }
    march.state
}

/// `∂F/∂p·q` by a central difference that is exact for the quartic `F`, up to rounding.
#[test]
fn the_molecular_field_is_the_derivative_of_the_energy() {
    for mesh in meshes() {
        let conditions = |tag: &str| {
            let held = tag == "left" || tag == "inner";
            let data = [formula("1 + 0.3*x"), formula("0.5*y")];
            if held { Conditions::slip().with_polarity(data) } else { Conditions::slip() }
        };
        for form in FORMS {
            let parameters = Parameters { form, ..PARAMETERS };
            let model = Incompressible::new(&mesh, &Description::new(&mesh, parameters, conditions)).unwrap();
            // without a flow the traces are where the energy is least, and it changes with the polarity alone
            let rest = model.zero().into_field(VELOCITY);
            for seed in 0..3 {
                let (p, q) = (random(&model.polarity.space, seed), random(&model.polarity.space, seed + 50));
                let energy = |s: f64| {
                    let moved = p.values.iter().zip(&q.values).map(|(p, q)| p + s * q).collect();
                    model.free_energy(&Field::new(&model.polarity.space, moved), &rest, 0.0)
                };
                // (8[F(h) − F(−h)] − [F(2h) − F(−2h)]) / 12h has no error for degree four
                let h = 0.5;
                let difference = (8.0 * (energy(h) - energy(-h)) - (energy(2.0 * h) - energy(-2.0 * h))) / (12.0 * h);
                let l = model.molecular(&p, &rest, 0.0).unwrap();
                let product = PARAMETERS.elasticity * dot(&model.polarity.mass_times(&l.values), &q.values);
                close(product, difference, energy(2.0).abs(), 1e-12);
            }
        }
    }
}

#[test]
fn polarity_along_the_flow_is_carried_unchanged() {
    // with a = 1: (v·∇)v − W(v)v − D(v)v = (v·∇)v − (∇v)v = 0, so p = v needs no other term
    let mesh = square(3);
    let loops = loops(&mesh);
    let (velocity, space) = (continuous(&mesh, 2, 2), discontinuous(&mesh, 3, 2));
    let flow = |x: Point| Point::new(1.0 + x.y * x.y - x.x * x.y, 0.5 * x.x * x.x + x.y - 2.0);
    let v = project::interpolate_vector(&velocity, flow);
    let p = project::interpolate_vector(&space, flow);
    let advection = loops.triplets(
        &upwind::a_upw(&discontinuous(&mesh, 3, 1), &v, Faces::NONE),
        &discontinuous(&mesh, 3, 1),
        &discontinuous(&mesh, 3, 1),
    );
    let turning = loops.triplets(&polarity::turning_by_polarity(&space, &v, [1.0, 1.0], Density::One), &space, &space);
    let mut residual = vec![0.0; space.dof_count()];
    for (i, j, a) in turning {
        residual[i] -= a * p.values[j];
    }
    let n = space.n;
    for (i, j, a) in advection {
        for c in 0..2 {
            let component = |k: usize| (k / n * 2 + c) * n + k % n;
            residual[component(i)] += a * p.values[component(j)];
        }
    }
    let worst = residual.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
    assert!(worst < 1e-14, "{worst}");
}

#[test]
fn the_operator_of_a_step_is_the_sum_of_its_forms() {
    let mesh = disc();
    let parameters = Parameters { form: PolarityForm::Direct, ..PARAMETERS };
    let model = Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap();
    let space = &model.polarity.space;
    let (v, last, p, q) = (random(&model.momentum.velocity, 1), random(space, 2), random(space, 3), random(space, 4));
    let mut operator = model.polarity.empty_operator();
    let given = model.given(0.0);
    let at = At::new(&PARAMETERS, &last, &given).with_flow(&v.space, (&v).into());
    model.polarity.pass(&model.loops, 7.0, &at, &mut operator);
    let mut image = vec![0.0; p.values.len()];
    operator.times(&p.values, &mut image);
    let sparse: Matrix = operator.to_sparse();
    close(dot(&sparse.times(&p.values), &q.values), dot(&image, &q.values), dot(&image, &image).sqrt(), 1e-12);
    let m = &PARAMETERS;
    let direct = model.loops.sum(12, |x| {
        let (p, q, v) = (p.vector(&x.site), q.vector(&x.site), v.vector_gradient(&x.site));
        let (w, d) = ((v - v.transpose()) * 0.5, (v + v.transpose()) * 0.5);
        7.0 * m.peclet * p.dot(&q) + last.vector(&x.site).norm_squared() * p.dot(&q)
            - m.peclet * q.dot(&((w + d * m.alignment) * p))
    });
    let scalar = discontinuous(&mesh, 3, 1);
    let form = m.peclet * upwind::a_upw(&scalar, &v, Faces::NONE)
        + m.coherence.powi(2) * monolayer::form::swip::a_swip(&scalar, Faces::NONE, Density::One);
    let alike = model.loops.triplets(&form, &scalar, &scalar);
    let component = |f: &Field, c: usize| -> Vec<f64> {
        (0..scalar.dof_count()).map(|k| f.values[(k / space.n * 2 + c) * space.n + k % space.n]).collect()
    };
    let rest: f64 = (0..2).map(|c| apply(&alike, &component(&q, c), &component(&p, c))).sum();
    close(dot(&image, &q.values), direct + rest, direct.abs() + rest.abs(), 1e-11);
}

#[test]
fn without_elasticity_the_force_is_friction_traction_and_active_stress_alone() {
    let mesh = square(2);
    let parameters = Parameters { elasticity: 0.0, ..PARAMETERS };
    let model = Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap();
    let p = random(&model.polarity.space, 9);
    let w = random(&model.momentum.velocity, 10);
    let direct = model.loops.sum(10, |x| {
        let (p, w, g) = (p.vector(&x.site), w.vector(&x.site), w.vector_gradient(&x.site));
        let d = (g + g.transpose()) * 0.5;
        parameters.traction * p.dot(&w) + parameters.active_stress * p.dot(&(d * p))
    });
    let (rest, inputs) = (model.zero().into_field(VELOCITY), model.inputs(0.0).unwrap());
    close(dot(&model.force(&p, &rest, &inputs).flow, &w.values), direct, direct.abs().max(1.0), 1e-12);
    assert_eq!(model.free_energy(&p, &rest, 0.0), 0.0);
}

#[test]
fn closed_tissue_without_activity_dissipates_what_the_energy_law_says() {
    // dF/dt + C_F‖v‖² + 2‖D(v)‖² + ‖ℓ‖²/(Pe B) = 0, up to the error of c_h, which falls with h
    let budget = |n: usize| {
        let mesh = mesh(&format!("shape = \"square\"\nn = {n}"));
        let parameters = Parameters { traction: 0.0, active_stress: 0.0, coherence: 0.5, ..PARAMETERS };
        let model = Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap();
        let p = project::interpolate_vector(&model.polarity.space, |x| {
            let (a, b) = (std::f64::consts::PI * x.x, std::f64::consts::PI * x.y);
            Point::new(0.8 + 0.5 * a.cos() * b.cos(), 0.6 * a.cos() - 0.4 * (2.0 * b).cos())
        });
        let (v, pi) = model.flow(&p, 0.0).unwrap();
        let l = model.molecular(&p, &v, 0.0).unwrap();
        let state = State::incompressible(v, pi, p);
        // Pe ∂_t p = −(stationary residual), then dF/dt = B (L_h/B | ∂_t p)
        let rate: Vec<f64> = model.polarity_residual(&state, 0.0).iter().map(|r| -r / parameters.peclet).collect();
        let gain = parameters.elasticity * dot(&l.values, &rate);
        let viscous = model.loops.sum(4, |x| {
            let g = state[VELOCITY].vector_gradient(&x.site);
            2.0 * ((g + g.transpose()) * 0.5).norm_squared()
                + parameters.friction * state[VELOCITY].vector(&x.site).norm_squared()
        });
        let b = parameters.elasticity;
        let relaxation = b * dot(&model.polarity.mass_times(&l.values), &l.values) / parameters.peclet;
        ((gain + viscous + relaxation).abs() / relaxation, viscous / relaxation)
    };
    let ((coarse, _), (fine, flow)) = (budget(6), budget(12));
    assert!(flow > 1e-4, "the flow takes part: {flow}");
    assert!(fine < 2e-5 && fine < coarse / 8.0, "budget {coarse:.2e} at n = 6, {fine:.2e} at n = 12");
}

#[test]
fn slip_by_rotated_unknowns_has_no_normal_velocity_at_nodes() {
    for mesh in [disc(), mesh("shape = \"annulus\"\nradius = 2.0\ninner_radius = 1.0\nh = 0.6")] {
        let model = Incompressible::new(&mesh, &Description::new(&mesh, PARAMETERS, |_| Conditions::slip())).unwrap();
        let (v, _) = model.flow(&random(&model.polarity.space, 3), 0.0).unwrap();
        let space = &model.momentum.velocity;
        let positions = space.node_positions();
        let mut checked = 0;
        for face in mesh.faces.iter().filter(|f| f.plus.is_none()) {
            for local in monolayer::element::basis::face_nodes(2, face.minus.face) {
                let node = space.node(face.minus.cell, local);
                let value = Point::new(v.values[2 * node], v.values[2 * node + 1]);
                assert!(value.dot(&positions[node].normalize()).abs() <= 1e-14 * value.norm());
                checked += usize::from(value.norm() > 1e-3);
            }
        }
        assert!(checked > 10, "the tangential velocity is free");
    }
}

#[test]
fn a_polynomial_flow_is_reproduced() {
    // v = (y², x²)/…, Π = x − ½ with the force that it needs: exact in P2/P1
    let mesh = square(3);
    let parameters = Parameters { elasticity: 0.0, active_stress: 0.0, traction: 0.0, ..PARAMETERS };
    let flow = |_: &str| Conditions::flow([formula("y^2"), formula("x^2")]);
    let mut description = Description::new(&mesh, parameters, flow);
    // −div 2D(v) = −Δv = (−2, −2); friction 2
    description.sources.force = Some([formula("-2 + 2*y^2 + 1"), formula("-2 + 2*x^2")]);
    let model = Incompressible::new(&mesh, &description).unwrap();
    assert!(model.momentum.is_closed());
    let (v, pi) = model.flow(&model.zero().into_field(POLARITY), 0.0).unwrap();
    let error = model.loops.sum(6, |x| {
        let at = x.site.x;
        (v.vector(&x.site) - Point::new(at.y * at.y, at.x * at.x)).norm_squared()
            + (pi.scalar(&x.site) - (at.x - 0.5)).powi(2)
    });
    assert!(error.sqrt() < 1e-12, "{error}");
    let force = model.force(&model.zero().into_field(POLARITY), &v, &model.inputs(0.0).unwrap());
    let residuals = model.momentum.residual_norms(&force.flow, &v.values, &pi.values).unwrap();
    assert!(residuals.iter().all(|r| *r < 1e-10), "{residuals:?}");
}

#[test]
fn prescribed_flow_through_a_closed_boundary_is_refused() {
    let mesh = square(3);
    let condition = |tag: &str| Conditions::flow([formula(if tag == "left" { "1" } else { "0" }), formula("0")]);
    let model = Incompressible::new(&mesh, &Description::new(&mesh, PARAMETERS, condition)).unwrap();
    let error = model.flow(&model.zero().into_field(POLARITY), 0.0).unwrap_err();
    assert!(matches!(error, MomentumError::Flux { .. }), "{error}");
}

#[test]
fn tissue_that_nothing_holds_is_refused() {
    let mesh = disc();
    let parameters = Parameters { friction: 0.0, ..PARAMETERS };
    let error = Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap_err();
    assert!(error.to_string().contains("model.friction"), "{error}");
}

#[test]
fn straight_slip_walls_hold_tissue_without_friction() {
    let parameters = Parameters { friction: 0.0, ..PARAMETERS };
    let mesh = square(3);
    let model = Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap();
    let (v, _) = model.flow(&random(&model.polarity.space, 1), 0.0).unwrap();
    assert!(v.values.iter().all(|v| v.is_finite()));
    // two parallel walls leave the translation along them free
    let channel = |tag: &str| match tag {
        "left" | "right" => Conditions::open(),
        _ => Conditions::slip(),
    };
    assert!(matches!(
        Incompressible::new(&mesh, &Description::new(&mesh, parameters, channel)).unwrap_err(),
        MomentumError::Unheld { .. }
    ));
}

/// A copy of `mesh` with every point mapped; `reflect` turns the cells so that they stay counterclockwise.
fn mapped(mesh: &Mesh, map: impl Fn(Point) -> Point, reflect: bool) -> Mesh {
    let mut out = mesh.clone();
    out.vertices.iter_mut().for_each(|x| *x = map(*x));
    for curve in &mut out.curves {
        match curve {
            monolayer::mesh::Curve::Circle { centre, .. } => *centre = map(*centre),
        }
    }
    let boundary: Vec<_> = mesh
        .faces
        .iter()
        .filter(|f| f.plus.is_none())
        .map(|f| monolayer::mesh::BoundaryEdge {
            vertices: mesh.face_vertices(f),
            tag: f.tag.expect("boundary faces have tags"),
            curve: f.curve,
        })
        .collect();
    let cells = mesh.cells.iter().map(|&[a, b, c]| if reflect { [a, c, b] } else { [a, b, c] }).collect();
    let degree = mesh.curved.iter().flatten().map(|n| n.degree).max().unwrap_or(1);
    let mut out = Mesh::build(out.vertices, cells, &boundary, out.tags, out.curves).expect("a mapped mesh");
    out.bend(degree).expect("bends like the original");
    out
}

/// Solves on a mesh and on its image, from images of one start, and compares at the images of points.
fn compare(map: impl Fn(Point) -> Point + Copy, reflect: bool) {
    let mesh = mesh("shape = \"annulus\"\nradius = 2.0\ninner_radius = 1.0\nh = 0.7");
    let image = Arc::new(mapped(&mesh, map, reflect));
    let start = |x: Point| Point::new(0.7 + 0.3 * (x.x * x.y).sin(), 0.5 * (x.x - 0.4 * x.y).cos());
    let inverse = |y: Point| {
        // the maps of these tests are orthogonal: the inverse is the transpose
        Point::new(map(Point::x()).dot(&y), map(Point::y()).dot(&y))
    };
    let solve = |mesh: &Arc<Mesh>, start: &dyn Fn(Point) -> Point| {
        let model = Incompressible::new(mesh, &Description::new(mesh, PARAMETERS, |_| Conditions::slip())).unwrap();
        let p = project::interpolate_vector(&model.polarity.space, start);
        march(&model, p, 4)
    };
    let one = solve(&mesh, &start);
    let two = solve(&image, &|y| map(start(inverse(y))));
    let (here, there) = (loops(&mesh), monolayer::mesh::locate::Locator::new(&image));
    let mut size = 0.0_f64;
    for cell in 0..mesh.cells.len() {
        here.each_cell_point(cell, 2, &mut |x| {
            let (other, xi) = there.locate_near(&image, map(x.site.x), 1e-6).expect("the image of a point");
            let (v, p) = (one[VELOCITY].vector(&x.site), one[POLARITY].vector(&x.site));
            assert!((map(v) - two[VELOCITY].vector_at(other, xi)).norm() < 1e-8, "velocity at {:?}", x.site.x);
            assert!((map(p) - two[POLARITY].vector_at(other, xi)).norm() < 1e-8, "polarity at {:?}", x.site.x);
            assert!(
                (one[PRESSURE].scalar(&x.site) - two[PRESSURE].scalar_at(other, xi)).abs() < 1e-7,
                "pressure at {:?}",
                x.site.x
            );
            size = size.max(v.norm());
        });
    }
    assert!(size > 0.1, "something flows: {size}");
}

#[test]
fn a_rotated_scene_gives_the_rotated_solution() {
    compare(|x| turn(0.7, x), false);
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_solution() {
    compare(|x| Point::new(x.x, -x.y), true);
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let mesh = disc();
    let run = |threads: usize, kind: CouplingKind, form: PolarityForm| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let parameters = Parameters { form, ..PARAMETERS };
            let model =
                Incompressible::new(&mesh, &Description::new(&mesh, parameters, |_| Conditions::slip())).unwrap();
            let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(3);
            let mut start = Field::zero(&model.polarity.space);
            start.values.iter_mut().for_each(|v| *v = generator.random_range(-0.5..0.5));
            let mut settings = settings(0.05, 2);
            settings.coupling.kind = kind;
            let mut march = March::start(&model, settings, start.values).unwrap();
            for _ in 0..3 {
                march.advance(1e9).expect("the step converges");
            }
            let state = march.state;
            let energy = model.free_energy(&state[POLARITY], &state[VELOCITY], 0.0);
            let residuals = model.residuals(&state, 0.0).unwrap();
            (
                state[VELOCITY].values.clone(),
                state[PRESSURE].values.clone(),
                state[POLARITY].values.clone(),
                energy.to_bits(),
                residuals,
            )
        })
    };
    for kind in [CouplingKind::Anderson { depth: 5 }, CouplingKind::Newton] {
        for form in FORMS {
            assert_eq!(run(1, kind, form), run(2, kind, form));
            assert_eq!(run(1, kind, form), run(3, kind, form));
        }
    }
}

#[test]
fn no_polarity_and_no_activity_is_rest_exactly() {
    let mesh = square(3);
    let model = Incompressible::new(&mesh, &Description::new(&mesh, PARAMETERS, |_| Conditions::slip())).unwrap();
    let state = march(&model, model.zero().into_field(POLARITY), 2);
    assert!(
        state[VELOCITY].values.iter().chain(&state[PRESSURE].values).chain(&state[POLARITY].values).all(|v| *v == 0.0)
    );
}

#[test]
fn the_elastic_forms_vanish_for_uniform_polarity() {
    let mesh = disc();
    let loops = loops(&mesh);
    let space = discontinuous(&mesh, 3, 2);
    let p = project::interpolate_vector(&space, |_| Point::new(0.6, -0.8));
    assert!(elastic::energy_over_b(&loops, (&p, None), 0.3, Faces::NONE, |_| Point::zeros()).abs() < 1e-12);
    let velocity = continuous(&mesh, 2, 2);
    let worst = loops
        .vector(&elastic::ericksen(&velocity, &p, Density::One), &velocity)
        .iter()
        .fold(0.0_f64, |m, f| m.max(f.abs()));
    assert!(worst < 1e-13, "{worst}");
}
