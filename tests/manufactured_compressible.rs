//! The sources that follow from exact fields with a density, against the equations with differences in place of
//! derivatives.

use std::f64::consts::PI;

use monolayer::expression::Expression;
use monolayer::mesh::Point;
use monolayer::model::manufactured::Volume;
use monolayer::model::{DensityLaw, Exact, Parameters};
use nalgebra::Matrix2;

struct Case {
    exact: Exact,
    velocity: fn(Point, f64) -> Point,
    density: fn(Point, f64) -> f64,
    polarity: fn(Point, f64) -> Point,
    /// Step of the differences.
    step: f64,
    tolerance: f64,
}

fn exact(velocity: [&str; 2], density: &str, polarity: [&str; 2]) -> Exact {
    let parse = |text: &str| Expression::parse(text, &[]).unwrap();
    Exact::compressible(velocity.map(parse), parse(density), polarity.map(parse)).unwrap()
}

/// Neither uniform nor solenoidal in any part.
fn waves() -> Case {
    Case {
        exact: exact(
            ["sin(pi*x + t)*cos(0.7*y)", "exp(-t)*cos(x*y) + x"],
            "1.3 + 0.6*sin(pi*x)*cos(2*y - t)",
            ["cos(pi*x)*sin(y + t^2)", "0.4 + t*sin(2*x - y)"],
        ),
        velocity: |x, t| Point::new((PI * x.x + t).sin() * (0.7 * x.y).cos(), (-t).exp() * (x.x * x.y).cos() + x.x),
        density: |x, t| 1.3 + 0.6 * (PI * x.x).sin() * (2.0 * x.y - t).cos(),
        polarity: |x, t| Point::new((PI * x.x).cos() * (x.y + t * t).sin(), 0.4 + t * (2.0 * x.x - x.y).sin()),
        step: 0.01,
        tolerance: 1e-7,
    }
}

/// With exponents 0, 1 and 2 the stress has at most degree 8 in each coordinate, up to which the differences below are
/// exact.
fn polynomials() -> Case {
    Case {
        exact: exact(["x^2 - 2*x*y*t + y", "x*y + y^2*t"], "2 + x*y*t - x/2", ["x*y - t", "t^2*y + x/2 - 1"]),
        velocity: |Point { data, .. }, t| {
            let [x, y] = data.0[0];
            Point::new(x * x - 2.0 * x * y * t + y, x * y + y * y * t)
        },
        density: |x, t| 2.0 + x.x * x.y * t - 0.5 * x.x,
        polarity: |x, t| Point::new(x.x * x.y - t, t * t * x.y + 0.5 * x.x - 1.0),
        step: 0.125,
        tolerance: 1e-11,
    }
}

const AXES: [Point; 2] = [Point::new(1.0, 0.0), Point::new(0.0, 1.0)];

/// First derivative along `along`, of order 8.
fn slope(f: &dyn Fn(Point) -> Point, x: Point, along: Point, h: f64) -> Point {
    let pair = |k: f64| f(x + k * h * along) - f(x - k * h * along);
    (pair(1.0) * 0.8 - pair(2.0) / 5.0 + pair(3.0) * (4.0 / 105.0) - pair(4.0) / 280.0) / h
}

impl Case {
    fn law(m: &Parameters) -> DensityLaw {
        m.density.expect("the test's parameters have one")
    }

    /// `(∇f)_ij = ∂_j f_i`
    fn gradient(&self, f: fn(Point, f64) -> Point, x: Point, t: f64) -> Matrix2<f64> {
        Matrix2::from_columns(&AXES.map(|e| slope(&|x| f(x, t), x, e, self.step)))
    }

    /// `div(ρ∇p)`, the flux differenced as a whole.
    fn diffusion(&self, x: Point, t: f64) -> Point {
        let flux = |x: Point, e: Point| (self.density)(x, t) * slope(&|x| (self.polarity)(x, t), x, e, self.step);
        AXES.iter().map(|&e| slope(&|x| flux(x, e), x, e, self.step)).sum()
    }

    /// `[ρ|p|² − (ρ−ρ_min)] p − κ² div(ρ∇p)`, which is `ℓ/B`.
    fn molecular(&self, m: &Parameters, x: Point, t: f64) -> Point {
        let (rho, p) = ((self.density)(x, t), (self.polarity)(x, t));
        (rho * p.norm_squared() - (rho - Self::law(m).critical)) * p - m.coherence.powi(2) * self.diffusion(x, t)
    }

    /// `ρσ` by the definition.
    fn stress(&self, m: &Parameters, x: Point, t: f64) -> Matrix2<f64> {
        let (law, rho, p) = (Self::law(m), (self.density)(x, t), (self.polarity)(x, t));
        let (dv, dp) = (self.gradient(self.velocity, x, t), self.gradient(self.polarity, x, t));
        let l = m.elasticity * self.molecular(m, x, t);
        let weight = m.coherence.powi(2) * m.elasticity * rho;
        let pressure =
            law.penalty * rho.powf(law.exponent + 1.0) - 0.5 * m.elasticity * law.critical * p.norm_squared();
        let isotropic = 2.0 * rho * dv.trace() - pressure - rho * law.active_stress_iso * p.norm_squared();
        isotropic * Matrix2::identity()
            + rho * (dv + dv.transpose())
            + 0.5 * (m.alignment + 1.0) * p * l.transpose()
            + 0.5 * (m.alignment - 1.0) * l * p.transpose()
            - weight * dp.transpose() * dp
            - rho * m.active_stress * p * p.transpose()
    }

    /// `f_v`, with `div(ρσᵀ)_i = ∂_j (ρσ)_ji`.
    fn force(&self, m: &Parameters, x: Point, t: f64) -> Point {
        let row = |i: usize| slope(&|x| self.stress(m, x, t).row(i).transpose(), x, AXES[i], self.step);
        m.friction * (self.velocity)(x, t) - m.traction * (self.polarity)(x, t) - row(0) - row(1)
    }

    fn density_source(&self, x: Point, t: f64) -> f64 {
        let rate = slope(&|s| Point::new((self.density)(x, s.x), 0.0), Point::new(t, 0.0), AXES[0], self.step).x;
        let flux = |x: Point| (self.density)(x, t) * (self.velocity)(x, t);
        rate + slope(&flux, x, AXES[0], self.step).x + slope(&flux, x, AXES[1], self.step).y
    }

    fn polarity_source(&self, m: &Parameters, x: Point, t: f64) -> Point {
        let (rho, p, v) = ((self.density)(x, t), (self.polarity)(x, t), (self.velocity)(x, t));
        let (dv, dp) = (self.gradient(self.velocity, x, t), self.gradient(self.polarity, x, t));
        let rate = slope(&|s| (self.polarity)(x, s.x), Point::new(t, 0.0), AXES[0], self.step);
        let (stretch, spin) = (0.5 * (dv + dv.transpose()), 0.5 * (dv - dv.transpose()));
        let objective = rate + dp * v - spin * p - m.alignment * stretch * p;
        m.peclet * rho * objective + self.molecular(m, x, t)
    }
}

/// Numbers in [0, 1) that repeat from run to run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Parameters of size one; now and then without elasticity, active stress, penalty or critical density.
    fn parameters(&mut self, round: usize, exponent: f64) -> Parameters {
        let mut unless = |off: bool, scale: f64| if off { 0.0 } else { scale * (0.2 + self.next()) };
        Parameters {
            friction: unless(false, 1.0),
            traction: unless(false, 1.0),
            active_stress: unless(round % 4 == 3, -1.4),
            peclet: unless(false, 1.0),
            coherence: unless(false, 0.8),
            elasticity: unless(round % 3 == 2, 1.0),
            alignment: unless(false, 1.0) - 0.6,
            density: Some(DensityLaw {
                penalty: unless(round % 5 == 4, 1.0),
                exponent,
                critical: unless(round % 4 == 1, 0.5),
                active_stress_iso: unless(round % 7 == 6, 1.2),
            }),
            ..Parameters::PLAIN
        }
    }
}

#[track_caller]
fn assert_near(what: &str, found: Point, wanted: Point, tolerance: f64) {
    assert!((found - wanted).norm() <= tolerance * (1.0 + wanted.norm()), "{what}: {found:?} against {wanted:?}");
}

#[track_caller]
fn assert_close(what: &str, found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance * (1.0 + wanted.abs()), "{what}: {found} against {wanted}");
}

fn check(case: &Case, exponents: &[f64]) {
    let mut random = Random(5);
    for round in 0..30 {
        let m = random.parameters(round, exponents[round % exponents.len()]);
        let (x, t) = (Point::new(random.next(), random.next()), 0.1 + 0.8 * random.next());
        let n = Point::from(<[f64; 2]>::from((6.3 * random.next()).sin_cos()));
        let exact = &case.exact;
        let near = |what: &str, found, wanted| assert_near(what, found, wanted, case.tolerance);
        let (force, source) = (exact.force(&m, x, t), exact.polarity_source(&m, x, t));
        near("f_v", force, case.force(&m, x, t));
        near("f_p", source, case.polarity_source(&m, x, t));
        assert_close("f_ρ", exact.density_source(&m, x, t), case.density_source(x, t), case.tolerance);
        near("n·ρσ", exact.traction(&m, x, t, n), case.stress(&m, x, t).transpose() * n);
        near("∂p/∂n", exact.polarity_slope(x, t, n), case.gradient(case.polarity, x, t) * n);
        let at = exact.at(x, t);
        near("v", at.velocity, (case.velocity)(x, t));
        near("p", at.polarity, (case.polarity)(x, t));
        near("div(ρ∇p)", at.polarity_laplacian, case.diffusion(x, t));
        assert_close("ρ", at.volume, (case.density)(x, t), 1e-14);
        assert_eq!(at.volume, exact.density(x, t));
        let all = exact.sources(&m, x, t);
        assert_eq!((all.force, all.density, all.polarity), (force, exact.density_source(&m, x, t), source));
        let frozen = exact.at_time(t);
        assert_near("f_v at t", frozen.force(&m, x, -5.0), force, 1e-14);
        assert_near("f_p at t", frozen.polarity_source(&m, x, -5.0), source, 1e-14);
        assert_close("f_ρ at t", frozen.density_source(&m, x, -5.0), all.density, 1e-14);
    }
}

#[test]
fn sources_of_waves_agree_with_differences() {
    check(&waves(), &[1.0, 0.0, 0.7, 2.0, 3.5]);
}

#[test]
fn sources_of_polynomials_are_those_of_exact_differences() {
    check(&polynomials(), &[1.0, 0.0, 2.0]);
}

/// A uniform sheet that is squeezed: `v = −s x`, `ρ = e^(2st)`, `p = e_1`. Nothing but the divergence acts:
/// `f_ρ = 0`, `ρσ_11 = −c_0ρ^(γ+1) + ½Bρ_min − 6sρ + ½(a+1)ℓ_1 + ½(a−1)ℓ_1 − ρ(S_a + S_a')` with `ℓ_1 = Bρ_min`.
#[test]
fn a_sheet_that_is_squeezed_by_hand() {
    let (s, t) = (0.5_f64, 0.3);
    let exact = exact(["-0.5*x", "-0.5*y"], "exp(t)", ["1", "0"]);
    let law = DensityLaw { penalty: 2.0, exponent: 1.5, critical: 0.25, active_stress_iso: 0.75 };
    let m = Parameters {
        friction: 2.0,
        traction: 3.0,
        active_stress: 0.5,
        peclet: 4.0,
        coherence: 0.1,
        elasticity: 8.0,
        alignment: 0.25,
        density: Some(law),
        ..Parameters::PLAIN
    };
    let (x, rho) = (Point::new(0.2, 0.7), (2.0 * s * t).exp());
    assert_close("f_ρ", exact.density_source(&m, x, t), 0.0, 1e-15);
    // p□ = −a D p = a s e_1
    assert_near("f_p", exact.polarity_source(&m, x, t), Point::new(4.0 * rho * 0.25 * s + 0.25, 0.0), 1e-15);
    assert_near("f_v", exact.force(&m, x, t), Point::new(-2.0 * s * x.x - 3.0, -2.0 * s * x.y), 1e-15);
    let pressure = 2.0 * rho.powf(2.5) - 0.5 * 8.0 * 0.25;
    let common = -pressure - 6.0 * s * rho - 0.75 * rho;
    let first = Point::new(common + 0.25 * 8.0 * 0.25 - 0.5 * rho, 0.0);
    assert_near("ρσ_1j", exact.traction(&m, x, t, AXES[0]), first, 1e-14);
    assert_near("ρσ_2j", exact.traction(&m, x, t, AXES[1]), Point::new(0.0, common), 1e-14);
}

/// With `ρ = 1` and `c_0 = ρ_min = S_a' = 0` the incompressible sheet remains, here with `div v = 0` and `Π = 0`.
#[test]
fn the_incompressible_sheet_is_a_limit() {
    let parse = |text: &str| Expression::parse(text, &[]).unwrap();
    let (v, p) = (["sin(x)*cos(y)*t", "-cos(x)*sin(y)*t"], ["cos(x - t)*y", "sin(x*y)"]);
    let (uniform, solenoidal) = (exact(v, "1", p), Exact::new(v.map(parse), parse("0"), p.map(parse)).unwrap());
    let mut random = Random(3);
    for round in 0..6 {
        let mut m = random.parameters(round, 1.0);
        let none = DensityLaw { penalty: 0.0, exponent: 1.0, critical: 0.0, active_stress_iso: 0.0 };
        let (x, t) = (Point::new(random.next(), random.next()), random.next());
        m.density = Some(none);
        let squeezed = uniform.sources(&m, x, t);
        m.density = None;
        let wanted = solenoidal.sources(&m, x, t);
        assert_near("f_v", squeezed.force, wanted.force, 1e-14);
        assert_near("f_p", squeezed.polarity, wanted.polarity, 1e-14);
        assert_close("f_ρ", squeezed.density, 0.0, 1e-14);
        assert_eq!((wanted.density, solenoidal.density(x, t)), (0.0, 1.0));
    }
}

/// Where tissue ends, `ρ^(γ+1)` has no second derivative; without a penalty not even a negative density matters.
#[test]
fn powers_at_the_edge_of_the_tissue() {
    let exact = exact(["0", "0"], "x", ["1", "0"]);
    let law = DensityLaw { penalty: 2.0, exponent: 0.5, critical: 0.0, active_stress_iso: 0.0 };
    let mut m = Random(1).parameters(2, 0.5);
    m.density = Some(law);
    let edge = exact.force(&m, Point::zeros(), 0.0);
    assert_near("f_v", edge, Point::new(m.active_stress - m.traction, 0.0), 1e-14);
    m.density = Some(DensityLaw { penalty: 0.0, ..law });
    assert!(exact.force(&m, Point::new(-1.0, 0.0), 0.0).x.is_finite());
}

#[test]
fn time_in_the_density_alone_counts() {
    let steady = exact(["x", "y"], "2 + x", ["1", "y"]);
    assert!(!steady.formulas().any(Expression::depends_on_time));
    let moving = exact(["x", "y"], "2 + x*t", ["1", "y"]);
    assert!(moving.formulas().any(Expression::depends_on_time));
    assert!(!moving.at_time(0.5).formulas().any(Expression::depends_on_time));
    let Volume::Density { value, rate } = moving.volume() else { panic!("the sheet has a density") };
    assert_eq!((value.eval(AXES[0], 3.0), rate.eval(AXES[0], 3.0)), (5.0, 1.0));
}
