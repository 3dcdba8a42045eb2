//! Orders of the polarity outside of a fixed disc, with `∂p/∂n = 0` on it.

use std::sync::Arc;

use crate::common::*;
use monolayer::cut::{Class, Cover};
use monolayer::expression::Expression;
use monolayer::form::upwind::Carrier;
use monolayer::form::{CellPoint, mass};
use monolayer::mesh::{Mesh, Point};
use monolayer::model::passive::{Continuation, Covered};
use monolayer::model::polarity::Polarity;
use monolayer::model::terms::{At, POLARITY, Sum};
use monolayer::model::{Conditions, Parameters};
use monolayer::shape::{Disc, Pose, Shape};
use monolayer::space::project;

const CENTRE: [f64; 2] = [0.513, 0.478];
const RADIUS: f64 = 0.23;
const SPIN: f64 = 0.8;
const PARAMETERS: Parameters = Parameters {
    friction: 1.0,
    traction: 0.0,
    active_stress: 0.0,
    peclet: 1.5,
    coherence: 0.3,
    elasticity: 0.0,
    alignment: 1.0,
    ..Parameters::PLAIN
};

/// `c + A (y + R² y/|y|²)`, `y = x − x_c`: harmonic with `∂p/∂n = 0` on the disc.
fn formulas() -> [Expression; 2] {
    let ([a, b], r2) = (CENTRE, RADIUS * RADIUS);
    let factor = format!("(1 + {r2}/((x-{a})^2 + (y-{b})^2))");
    let texts = [format!("0.5 + 0.6*(x-{a})*{factor}"), format!("0.3 + (0.4*(y-{b}) + 0.2*(x-{a}))*{factor}")];
    texts.map(|text| Expression::parse(&text, &[]).unwrap())
}

fn mesh_of(n: usize) -> Arc<Mesh> {
    mesh(&format!("shape = \"square\"\nn = {n}\ndistortion = 0.15\nseed = 3"))
}

/// Errors over the tissue, in L² and of the gradient, and the largest coefficient in the continuation.
fn errors(n: usize, degree: usize) -> [f64; 3] {
    let mesh = mesh_of(n);
    let loops = loops(&mesh);
    let pose = Pose { position: Point::from(CENTRE), angle: 0.0 };
    let cover = Arc::new(Cover::new(&mesh, None, &[(Shape::from(Disc { radius: RADIUS }), pose)]));
    let covered = Covered::new(&loops, &cover, Continuation::default());
    let space = discontinuous(&mesh, degree, 2);
    let exact = formulas();
    let conditions = vec![Conditions::slip().with_polarity(exact.clone()); mesh.tags.len()];
    let tissue = &covered.tissue;
    let polarity = Polarity::around(tissue, &space, &conditions, &PARAMETERS, None, Some(&covered.passive)).unwrap();
    let flow = project::interpolate_vector(&continuous(&mesh, 2, 2), |x| {
        let y = x - Point::from(CENTRE);
        Point::new(-y.y, y.x) * SPIN
    });
    let at = |x: Point| {
        let [p, q] = exact.each_ref().map(|f| f.taylor(x, 0.0));
        let gradient = nalgebra::Matrix2::new(p.gradient()[0], p.gradient()[1], q.gradient()[0], q.gradient()[1]);
        (Point::new(p.value(), q.value()), gradient)
    };
    let source = |x: &CellPoint| {
        let (p, gradient) = at(x.site.x);
        let y = x.site.x - Point::from(CENTRE);
        let carried = gradient * Point::new(-y.y, y.x) * SPIN - Point::new(-p.y, p.x) * SPIN;
        carried * PARAMETERS.peclet + p * (p.norm_squared() - 1.0)
    };
    let source = tissue.vector(&mass::load(&space, degree + 4, source), &space);
    let mut p = project::interpolate_vector(&space, |_| Point::new(0.5, 0.3));
    for k in 0.. {
        let given = polarity.given(0.0);
        let here = At::new(&PARAMETERS, &p, &given).with_flow(&flow.space, Carrier::from(&flow));
        let mut r = tissue.vector(&Sum::of(&[POLARITY]).value(&here), &space);
        let well = polarity.molecular_functional(tissue, &p, None, 0.0);
        r.iter_mut().zip(&well).zip(&source).for_each(|((r, w), f)| *r = f - *r - w);
        let operator = polarity.tangent(tissue, 0.0, &here, &polarity.molecular_tangent(tissue, &p));
        let factors = polarity.precondition(&operator).unwrap();
        let mut step = vec![0.0; r.len()];
        polarity.solve(&operator, &factors, &r, &mut step, 1e-9).unwrap();
        p.values.iter_mut().zip(&step).for_each(|(p, s)| *p += s);
        if step.iter().fold(0.0_f64, |m, s| m.max(s.abs())) < 1e-8 {
            break;
        }
        assert!(k < 20, "Newton's method converges");
    }
    let value = tissue.sum(2 * degree + 4, |x| (p.vector(&x.site) - at(x.site.x).0).norm_squared());
    let slope = tissue.sum(2 * degree + 4, |x| (p.vector_gradient(&x.site) - at(x.site.x).1).norm_squared());
    let inner: Vec<usize> = (0..mesh.cells.len()).filter(|&c| matches!(cover.cell(c), Class::Inside(_))).collect();
    let largest = inner.iter().flat_map(|&c| p.coefficients(c, 0)).fold(0.0_f64, |m, v| m.max(v.abs()));
    [value.max(0.0).sqrt(), slope.max(0.0).sqrt(), largest]
}

fn table(degree: usize, sizes: &[usize]) -> Vec<[f64; 3]> {
    let rows: Vec<[f64; 3]> = sizes.iter().map(|&n| errors(n, degree)).collect();
    for (k, row) in rows.iter().enumerate() {
        let order = |c: usize| if k == 0 { f64::NAN } else { (rows[k - 1][c] / row[c]).log2() };
        println!(
            "P{degree} n {:3}: {:.3e} ({:.2})  {:.3e} ({:.2})  inside {:.2}",
            sizes[k],
            row[0],
            order(0),
            row[1],
            order(1),
            row[2]
        );
    }
    rows
}

fn check(degree: usize, sizes: [usize; 3]) {
    let rows = table(degree, &sizes);
    let steps = (sizes[2] as f64 / sizes[0] as f64).ln();
    let order = |c: usize| (rows[0][c] / rows[2][c]).ln() / steps;
    assert!(order(0) > degree as f64 + 0.6 && order(1) > degree as f64 - 0.4, "{} {}", order(0), order(1));
}

#[test]
fn the_polarity_around_a_disc_has_the_order_of_its_degree() {
    check(3, [8, 11, 16]);
}

#[test]
fn quartic_polarities_have_the_order_of_their_degree() {
    check(4, [8, 11, 16]);
}
