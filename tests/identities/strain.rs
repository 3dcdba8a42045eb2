use crate::common::*;
use monolayer::form::{Faces, Integrator};
use monolayer::measure::Strain;
use monolayer::measure::strain::Tensor;
use monolayer::mesh::{Mesh, Point};
use monolayer::space::{Field, project};
use std::sync::Arc;

/// The flow `v(x)` in P3.
fn flow(mesh: &Arc<Mesh>, v: impl Fn(Point) -> Point) -> Field {
    project::interpolate_vector(&continuous(mesh, 3, 2), v)
}

/// The strain of `v`, with the values `inflow` where it comes in.
fn strain(mesh: &Arc<Mesh>, degree: usize, we: f64, v: &Field, inflow: impl Fn(Point) -> [f64; 3] + Sync) -> Tensor {
    let equation = Strain::new(mesh, degree, we, Faces::BOUNDARY).unwrap();
    equation.of(&Integrator::new(mesh), v, inflow).unwrap()
}

/// Root of the mean square of `ε − exact`.
fn error(mesh: &Arc<Mesh>, found: &Tensor, exact: impl Fn(Point) -> [f64; 3] + Sync) -> f64 {
    let square = loops(mesh).sum(8, |x| {
        let exact = exact(x.site.x);
        (0..3).map(|c| (found.components[c].scalar(&x.site) - exact[c]).powi(2)).sum()
    });
    (square / mesh.area()).sqrt()
}

#[test]
fn uniform_shear_strains_by_the_weissenberg_number_and_twice_its_square() {
    let (we, rate) = (1.7, 0.8);
    for mesh in meshes() {
        let v = flow(&mesh, |x| Point::new(rate * x.y, 0.0));
        let exact = [2.0 * (we * rate) * (we * rate), we * rate, 0.0];
        let found = strain(&mesh, 2, we, &v, |_| exact);
        assert!(error(&mesh, &found, |_| exact) < 1e-9, "{}", error(&mesh, &found, |_| exact));
        // eigenvalues of [[a, b], [b, 0]]
        let largest = 0.5 * exact[0] + (0.5 * exact[0]).hypot(exact[1]);
        close(found.largest().value, largest, largest, 1e-9);
        close(found.least_stretch().value, 1.0 + exact[0] - largest, 1.0, 1e-8);
    }
}

#[test]
fn uniform_extension_strains_more_than_it_compresses() {
    let (we, e) = (0.6, 0.5);
    let exact = [2.0 * e * we / (1.0 - 2.0 * e * we), 0.0, -2.0 * e * we / (1.0 + 2.0 * e * we)];
    for mesh in meshes() {
        let v = flow(&mesh, |x| Point::new(e * x.x, -e * x.y));
        let found = strain(&mesh, 1, we, &v, |_| exact);
        assert!(error(&mesh, &found, |_| exact) < 1e-9, "{}", error(&mesh, &found, |_| exact));
    }
}

#[test]
fn a_turned_flow_has_the_turned_strain() {
    // ε of v' = R v(Rᵀx) is R ε Rᵀ
    let (we, rate, angle) = (0.9, 1.1, 0.7);
    let mesh = square(3);
    let v = flow(&mesh, |x| turn(angle, Point::new(rate * turn(-angle, x).y, 0.0)));
    let exact = turned(angle, [2.0 * (we * rate) * (we * rate), we * rate, 0.0]);
    let found = strain(&mesh, 1, we, &v, |_| exact);
    assert!(error(&mesh, &found, |_| exact) < 1e-10);
}

/// `R ε Rᵀ`
fn turned(angle: f64, [a, b, c]: [f64; 3]) -> [f64; 3] {
    let (s, k) = angle.sin_cos();
    [
        k * k * a - 2.0 * s * k * b + s * s * c,
        s * k * (a - c) + (k * k - s * s) * b,
        s * s * a + 2.0 * s * k * b + k * k * c,
    ]
}

/// Strain of the shear flow `(f(y), 0)` of tissue that is not strained at `x = −1`, all of it turned: with the time
/// `τ = (x+1)/f` since then, `ε_12 = We f' (1 − e^{−τ/We})` and `ε_11 = 2 We² f'² (1 − (1 + τ/We) e^{−τ/We})`.
fn entering(we: f64, angle: f64) -> (impl Fn(Point) -> Point, impl Fn(Point) -> [f64; 3] + Sync) {
    let speed = |y: f64| 2.0 + (2.0 * y).sin();
    let v = move |x: Point| turn(angle, Point::new(speed(turn(-angle, x).y), 0.0));
    let exact = move |x: Point| {
        let x = turn(-angle, x);
        let (f, slope) = (speed(x.y), 2.0 * (2.0 * x.y).cos());
        let age = (x.x + 1.0) / f / we;
        let decay = (-age).exp();
        let first = 2.0 * we * we * slope * slope * (1.0 - (1.0 + age) * decay);
        turned(angle, [first, we * slope * (1.0 - decay), 0.0])
    };
    (v, exact)
}

#[test]
fn strain_converges_with_the_order_of_its_degree_plus_one() {
    for (degree, least) in [(1, 1.75), (2, 2.6)] {
        let (v, exact) = entering(0.5, 0.4);
        let mut errors = Vec::new();
        for n in [4, 8, 16] {
            let mesh = mesh(&format!("shape = 'square'\nn = {n}\ndistortion = 0.15\nseed = 3"));
            let found = strain(&mesh, degree, 0.5, &flow(&mesh, &v), &exact);
            errors.push(error(&mesh, &found, &exact));
        }
        let order = (errors[0] / errors[2]).log2() / 2.0;
        println!("degree {degree}: {errors:?}, order {order:.2}");
        assert!(order > least && errors[2] < 2e-3, "degree {degree}: {errors:?}, order {order}");
    }
}

#[test]
fn a_strain_that_relaxes_at_once_is_the_rate_of_strain() {
    let mesh = square(4);
    let v = flow(&mesh, |x| Point::new(x.y * x.y + x.x, x.x * x.x - x.y));
    let error_of = |we: f64| {
        let rate = |x: Point| [1.0, x.x + x.y, -1.0].map(|d| 2.0 * we * d);
        error(&mesh, &strain(&mesh, 1, we, &v, rate), rate) / we
    };
    // what is left is of the order We²
    let (coarse, fine) = (error_of(1e-2), error_of(1e-3));
    assert!(fine < 2e-2 && fine < 0.15 * coarse, "{coarse} and {fine}");
}

#[test]
fn an_unbounded_strain_is_told() {
    let mesh = mesh("shape = 'square'\nlength = [-1.0, 1.0]\nn = 6");
    let (loops, e) = (loops(&mesh), 0.5);
    let v = flow(&mesh, |x| Point::new(e * x.x, -e * x.y));
    for (we, bounded) in [(0.9, true), (1.1, false)] {
        let equation = Strain::new(&mesh, 1, we, Faces::BOUNDARY).unwrap();
        let growth = equation.growth(&loops, &v).expect("the flow rests at the origin");
        close(growth.value, 2.0 * we * e, 1.0, 1e-9);
        assert!(growth.x.norm() < 0.8 && (growth.value < 1.0) == bounded);
    }
    // where it is stretched on its way only, it has time for so much and no more
    let past = flow(&mesh, |x| Point::new(10.0 + e * x.x, -e * x.y));
    assert!(Strain::new(&mesh, 1, 2.0, Faces::BOUNDARY).unwrap().growth(&loops, &past).is_none());
    // the constant solution of uniform extension is no strain beyond the bound: I + ε is negative
    let exact = [2.0 * e * 1.1 / (1.0 - 2.0 * e * 1.1), 0.0, -2.0 * e * 1.1 / (1.0 + 2.0 * e * 1.1)];
    assert!(strain(&mesh, 1, 1.1, &v, |_| exact).least_stretch().value < 0.0);
}
