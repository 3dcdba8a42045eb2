//! Sources of manufactured solutions against differences of plainly evaluated fields.

use std::f64::consts::PI;

use monolayer::expression::Expression;
use monolayer::mesh::Point;
use monolayer::model::{Exact, Parameters};

type Field = fn(Point, f64) -> Point;

/// The fields of a case, as formulas and, independently, as functions.
struct Case {
    exact: Exact,
    velocity: Field,
    pressure: fn(Point, f64) -> f64,
    polarity: Field,
    /// Width of the differences.
    step: f64,
    tolerance: f64,
}

fn exact(velocity: [&str; 2], pressure: &str, polarity: [&str; 2]) -> Exact {
    let parse = |text: &str| Expression::parse(text, &[]).unwrap();
    Exact::new(velocity.map(parse), parse(pressure), polarity.map(parse)).unwrap()
}

fn waves() -> Case {
    Case {
        exact: exact(
            ["ln(1+t)/ln(2)*sin(pi*x)*cos(pi*y)", "-ln(1+t)/ln(2)*cos(pi*x)*sin(pi*y)"],
            "atan(t*(x-1/2)*(y-1/2))",
            ["tan(pi*t/4)*(1-cos(2*pi*x))*cos(pi*y)", "4/pi*atan(t)*cos(pi*x)*(1-cos(2*pi*y))"],
        ),
        velocity: |x, t| {
            let ((s, c), (u, w)) = ((PI * x.x).sin_cos(), (PI * x.y).sin_cos());
            (1.0 + t).log2() * Point::new(s * w, -c * u)
        },
        pressure: |x, t| (t * (x.x - 0.5) * (x.y - 0.5)).atan(),
        polarity: |x, t| {
            let first = (0.25 * PI * t).tan() * (1.0 - (2.0 * PI * x.x).cos()) * (PI * x.y).cos();
            Point::new(first, 4.0 / PI * t.atan() * (PI * x.x).cos() * (1.0 - (2.0 * PI * x.y).cos()))
        },
        step: 0.01,
        tolerance: 1e-7,
    }
}

/// The stress has degree 8 in space, up to which the differences below are exact.
fn polynomials() -> Case {
    Case {
        exact: exact(
            ["x^2 - 2*x*y + 3*y^2*t", "y^2 - 2*x*y + x^3*t"],
            "x*y^2 - t*x + 3",
            ["x^2 - x*y*t + 1/2", "t^3*y^2 + x*y - y"],
        ),
        velocity: |Point { data, .. }, t| {
            let [x, y] = data.0[0];
            Point::new(x * x - 2.0 * x * y + 3.0 * y * y * t, y * y - 2.0 * x * y + x * x * x * t)
        },
        pressure: |x, t| x.x * x.y * x.y - t * x.x + 3.0,
        polarity: |x, t| Point::new(x.x * x.x - x.x * x.y * t + 0.5, t * t * t * x.y * x.y + x.x * x.y - x.y),
        step: 0.125,
        tolerance: 1e-11,
    }
}

/// First derivative along `along`, of order 8.
fn slope(f: &dyn Fn(Point) -> Point, x: Point, along: Point, h: f64) -> Point {
    let pair = |k: f64| f(x + k * h * along) - f(x - k * h * along);
    (pair(1.0) * 0.8 - pair(2.0) / 5.0 + pair(3.0) * (4.0 / 105.0) - pair(4.0) / 280.0) / h
}

/// Second derivative along `along`, of order 8.
fn bend(f: &dyn Fn(Point) -> Point, x: Point, along: Point, h: f64) -> Point {
    let pair = |k: f64| f(x + k * h * along) + f(x - k * h * along);
    let outer = pair(1.0) * 1.6 - pair(2.0) / 5.0 + pair(3.0) * (8.0 / 315.0) - pair(4.0) / 560.0;
    (outer - f(x) * (205.0 / 72.0)) / (h * h)
}

const AXES: [Point; 2] = [Point::new(1.0, 0.0), Point::new(0.0, 1.0)];

impl Case {
    fn laplacian(&self, x: Point, t: f64) -> Point {
        AXES.iter().map(|&e| bend(&|x| (self.polarity)(x, t), x, e, self.step)).sum()
    }

    /// `[∂_1f, ∂_2f]`
    fn slopes(&self, f: Field, x: Point, t: f64) -> [Point; 2] {
        AXES.map(|e| slope(&|x| f(x, t), x, e, self.step))
    }

    /// Row `i` of σ by the definition, with differences for every derivative.
    fn stress(&self, m: &Parameters, x: Point, t: f64, i: usize) -> Point {
        let (p, dv, dp) = ((self.polarity)(x, t), self.slopes(self.velocity, x, t), self.slopes(self.polarity, x, t));
        let kappa2 = m.coherence.powi(2);
        let l = m.elasticity * ((p.norm_squared() - 1.0) * p - kappa2 * self.laplacian(x, t));
        let entry = |j: usize| {
            let identity = if i == j { -(self.pressure)(x, t) } else { 0.0 };
            let elastic = 0.5 * (m.alignment + 1.0) * p[i] * l[j] + 0.5 * (m.alignment - 1.0) * l[i] * p[j];
            identity + dv[j][i] + dv[i][j] + elastic
                - kappa2 * m.elasticity * dp[i].dot(&dp[j])
                - m.active_stress * p[i] * p[j]
        };
        Point::new(entry(0), entry(1))
    }

    fn force(&self, m: &Parameters, x: Point, t: f64) -> Point {
        let row = |i: usize| slope(&|x| self.stress(m, x, t, i), x, AXES[i], self.step);
        m.friction * (self.velocity)(x, t) - m.traction * (self.polarity)(x, t) - row(0) - row(1)
    }

    fn polarity_source(&self, m: &Parameters, x: Point, t: f64) -> Point {
        let (p, v) = ((self.polarity)(x, t), (self.velocity)(x, t));
        let ([v_x, v_y], [p_x, p_y]) = (self.slopes(self.velocity, x, t), self.slopes(self.polarity, x, t));
        let rate = slope(&|s| (self.polarity)(x, s.x), Point::new(t, 0.0), AXES[0], self.step);
        let gradient = nalgebra::Matrix2::from_columns(&[v_x, v_y]);
        let (stretch, spin) = (0.5 * (gradient + gradient.transpose()), 0.5 * (gradient - gradient.transpose()));
        let objective = rate + v.x * p_x + v.y * p_y - spin * p - m.alignment * stretch * p;
        m.peclet * objective + (p.norm_squared() - 1.0) * p - m.coherence.powi(2) * self.laplacian(x, t)
    }
}

/// Numbers in [0, 1) that repeat from run to run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Parameters of size one; every third has no elasticity, every fourth no active stress.
    fn parameters(&mut self, round: usize) -> Parameters {
        Parameters {
            friction: 2.0 * self.next(),
            traction: 2.0 * self.next(),
            active_stress: if round % 4 == 3 { 0.0 } else { 3.0 * self.next() - 1.5 },
            peclet: 0.2 + self.next(),
            coherence: 0.2 + self.next(),
            elasticity: if round % 3 == 2 { 0.0 } else { 0.2 + self.next() },
            alignment: 2.0 * self.next() - 1.0,
            ..Parameters::PLAIN
        }
    }
}

fn assert_near(what: &str, found: Point, wanted: Point, tolerance: f64) {
    assert!((found - wanted).norm() <= tolerance * (1.0 + wanted.norm()), "{what}: {found:?} against {wanted:?}");
}

fn check(case: &Case) {
    let mut random = Random(11);
    for round in 0..24 {
        let m = random.parameters(round);
        let (x, t) = (Point::new(random.next(), random.next()), 0.1 + 0.8 * random.next());
        let n = Point::from(<[f64; 2]>::from((6.3 * random.next()).sin_cos()));
        let exact = &case.exact;
        let near = |what: &str, found, wanted| assert_near(what, found, wanted, case.tolerance);
        let (force, source) = (exact.force(&m, x, t), exact.polarity_source(&m, x, t));
        near("f_v", force, case.force(&m, x, t));
        near("f_p", source, case.polarity_source(&m, x, t));
        let traction = n.x * case.stress(&m, x, t, 0) + n.y * case.stress(&m, x, t, 1);
        near("n·σ", exact.traction(&m, x, t, n), traction);
        near("∂p/∂n", exact.polarity_slope(x, t, n), slope(&|x| (case.polarity)(x, t), x, n, case.step));
        let at = exact.at(x, t);
        near("v", at.velocity, (case.velocity)(x, t));
        near("p", at.polarity, (case.polarity)(x, t));
        near("Δp", at.polarity_laplacian, case.laplacian(x, t));
        assert!((at.volume - (case.pressure)(x, t)).abs() < 1e-14);
        assert!(exact.divergence(x, t).abs() < 1e-13);
        let both = exact.sources(&m, x, t);
        assert_eq!((both.force, both.polarity), (force, source));
        let frozen = exact.at_time(t);
        assert_near("f_v at t", frozen.force(&m, x, -5.0), force, 1e-14);
        assert_near("f_p at t", frozen.polarity_source(&m, x, -5.0), source, 1e-14);
    }
}

#[test]
fn sources_of_waves_agree_with_differences() {
    check(&waves());
}

#[test]
fn sources_of_polynomials_are_those_of_exact_differences() {
    check(&polynomials());
}

/// In `v = (y, 0)` with `p = e_1`: `W(v)p = −½e_2`, `D(v)p = ½e_2`, `ℓ = 0`.
#[test]
fn shear_of_a_uniform_polarity_by_hand() {
    let exact = exact(["y", "0"], "x", ["1", "0"]);
    let m = Parameters {
        friction: 2.0,
        traction: 3.0,
        active_stress: 0.5,
        peclet: 4.0,
        coherence: 0.1,
        elasticity: 1.0,
        alignment: 0.25,
        ..Parameters::PLAIN
    };
    let (x, t) = (Point::new(0.2, 0.7), 0.3);
    assert_near("f_p", exact.polarity_source(&m, x, t), Point::new(0.0, 4.0 * 0.5 * (1.0 - 0.25)), 1e-15);
    assert_near("f_v", exact.force(&m, x, t), Point::new(1.0 + 2.0 * 0.7 - 3.0, 0.0), 1e-15);
    assert_near("σ_1j", exact.traction(&m, x, t, AXES[0]), Point::new(-0.2 - 0.5, 1.0), 1e-15);
}

#[test]
fn a_field_that_is_not_solenoidal_shows() {
    let leaking = exact(["x*y", "x - y"], "0", ["1", "0"]);
    approx::assert_abs_diff_eq!(leaking.divergence(Point::new(0.3, 0.75), 0.1), -0.25, epsilon = 1e-15);
}
