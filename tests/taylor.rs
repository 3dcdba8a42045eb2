//! Taylor series of formulas against their symbolic derivatives.

use monolayer::expression::Expression;
use monolayer::mesh::Point;

fn parse(text: &str) -> Expression {
    Expression::parse(text, &[]).unwrap()
}

/// Numbers in [0, 1) that repeat from run to run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

const PARTIALS: [&str; 10] = ["", "x", "y", "xx", "xy", "yy", "xxx", "xxy", "xyy", "yyy"];

/// The ten partials by repeated symbolic differentiation.
fn symbolic(f: &Expression) -> [Expression; 10] {
    PARTIALS.map(|name| name.chars().fold(f.clone(), |f, by| f.diff(&by.to_string()).unwrap()))
}

fn partials(f: &Expression, x: Point, t: f64) -> [f64; 10] {
    let series = f.taylor(x, t);
    let (g, [xx, xy, yy], [xxx, xxy, xyy, yyy]) = (series.gradient(), series.second(), series.third());
    [series.value(), g.x, g.y, xx, xy, yy, xxx, xxy, xyy, yyy]
}

fn check(text: &str, x: Point, t: f64) {
    let f = parse(text);
    let found = partials(&f, x, t);
    assert_eq!(found[0].to_bits(), f.eval(x, t).to_bits(), "value of {text} at {x:?}");
    let wanted = symbolic(&f).map(|d| d.eval(x, t));
    let scale = wanted.iter().fold(1e-3_f64, |m, d| m.max(d.abs()));
    for ((name, found), wanted) in PARTIALS.iter().zip(found).zip(wanted) {
        // cancelling parts of a formula lose digits with respect to the largest derivative, not to their own sum
        assert!(
            (found - wanted).abs() <= 1e-10 * (wanted.abs() + 1e-3 * scale),
            "∂{name} {text} at {x:?}: {found}, {wanted}"
        );
    }
}

#[test]
fn partials_agree_with_symbolic_derivatives() {
    let formulas = [
        "sin(x*y + t)",
        "cos(2*x - y^2)",
        "tan(0.4*x*y)",
        "asin(0.3*x - 0.2*y)",
        "acos(0.2*x*y - 0.3)",
        "atan(t*(x - 0.5)*(y - 0.5))",
        "sinh(x - 2*y)",
        "cosh(x*y)",
        "tanh(x + y^2)",
        "exp(-x^2 - y^2)",
        "ln(1 + x + y*x)",
        "log(2 + sin(x)*y)",
        "log10(2 + x^2 + y)",
        "sqrt(1 + x*y)",
        "x*y*(x - 3*y) - (2 - x)*4 + (y - 1)",
        "(1 + x*y)/(2 + x - 0.3*y^2)",
        "3/(1 + x + 2*y)",
        "(x*y + x)/7",
        "(x + 2*y)^1 + (x*y)^2 + (x - y)^3",
        "(x - 4)^5 + (y - 3)^-2",
        "(x*y + 0.5)^0.5 + (x + y)^-1.3",
        "(x + y)^20 / 1e6",
        "(x + 0.3)^y",
        "2^(x*y) + t^x",
        "(x + t)^(y - 2*x)",
        "atan2(y - 0.3, x - 0.8)",
        "atan2(x*y, -2)",
        "hypot(x, y)",
        "hypot(x - y, 0.7)*hypot(3, x)",
        "abs(x - y) * x",
        "sign(x - 0.5)*y^2 + floor(3*x)*x*y + heaviside(y - x)*x",
        "min(x^2, y*x) + max(x, y^3)",
        "min(x, 0.7)*y + max(0.8, y)*x",
        "if(x < y, x^2*t*y, sin(y))*x",
        "(x <= y)*x + (x > 0.5)*y*x + (y >= x)",
        "-(x - 1)^3*sin(t)",
        "tan(pi*t/4)*(1-cos(2*pi*x))*cos(pi*y)",
        "4/pi*atan(t)*cos(pi*x)*(1-cos(2*pi*y))",
        "sin(cos(x*exp(y)))/(1 + tanh(x*y)^2)",
        "7",
        "x",
        "t",
    ];
    let mut random = Random(7);
    for text in formulas {
        for _ in 0..8 {
            let x = Point::new(0.1 + 1.3 * random.next(), 0.1 + 1.3 * random.next());
            check(text, x, 0.1 + 0.8 * random.next());
        }
    }
}

#[test]
fn powers_of_zero_and_of_negative_numbers_have_series() {
    for x in [Point::new(0.0, 0.0), Point::new(-1.5, 0.4), Point::new(-2.0, -3.0), Point::new(0.0, -1.0)] {
        for text in ["x^2", "x^3*y", "(x*y)^1", "x^4 - y^5", "y*x^3"] {
            check(text, x, 0.3);
        }
    }
    check("(x + 0.2)^-3 + (y - 5)^-1", Point::new(-1.0, -2.0), 0.0);
    assert!(parse("x^0.5").taylor(Point::new(-1.0, 0.0), 0.0).value().is_nan());
}

#[test]
fn series_survive_infinite_derivatives() {
    let steep = parse("sqrt(x)").taylor(Point::new(0.0, 0.3), 0.0);
    assert_eq!((steep.value(), steep.gradient()), (0.0, Point::new(f64::INFINITY, 0.0)));
    let flat = parse("x^1.5").taylor(Point::new(0.0, 0.3), 0.0);
    assert_eq!((flat.gradient(), flat.second()), (Point::zeros(), [f64::INFINITY, 0.0, 0.0]));
    // the derivative of √t in time, which is infinite here, must not enter
    check("sqrt(t)*x*y + x", Point::new(0.2, 0.3), 0.0);
    assert_eq!(parse("abs(x)").taylor(Point::zeros(), 0.0).gradient(), Point::zeros());
    let nan = parse("min(sqrt(x), y) + (sqrt(x) < 1)").taylor(Point::new(-1.0, 0.0), 0.0);
    assert!(nan.value().is_nan());
}

#[test]
fn derivatives_are_series_of_one_degree_less() {
    let (x, t) = (Point::new(0.37, 0.82), 0.6);
    let f = parse("exp(x*y)*sin(x - 2*y)");
    let series = f.taylor(x, t);
    let all = symbolic(&f).map(|d| d.eval(x, t));
    let [_, dx, dy, xx, xy, yy, xxx, xxy, xyy, yyy] = all;
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-11 * (1.0 + b.abs()), "{a} against {b}");
    let (by_x, by_y, laplacian) = (series.dx(), series.dy(), series.laplacian());
    for (a, b) in [(by_x.value(), dx), (by_x.gradient().x, xx), (by_x.gradient().y, xy)] {
        near(a, b);
    }
    for (a, b) in by_x.second().into_iter().zip([xxx, xxy, xyy]) {
        near(a, b);
    }
    for (a, b) in [(by_y.value(), dy), (by_y.gradient().x, xy), (by_y.gradient().y, yy)] {
        near(a, b);
    }
    for (a, b) in by_y.second().into_iter().zip([xxy, xyy, yyy]) {
        near(a, b);
    }
    near(laplacian.value(), xx + yy);
    near(laplacian.gradient().x, xxx + xyy);
    near(laplacian.gradient().y, xxy + yyy);
}

#[test]
fn a_formula_at_a_time_has_the_same_value() {
    let mut random = Random(3);
    for text in ["tan(pi*t/4)*(1-cos(2*pi*x))*cos(pi*y)", "if(t < 0.5, x, y)*t + x^t", "min(t, 0.5)*x - t^2"] {
        for _ in 0..5 {
            let (x, t) = (Point::new(random.next(), random.next()), random.next());
            let f = parse(text);
            let frozen = f.at_time(t);
            assert!(!frozen.depends_on_time());
            assert_eq!(frozen.eval(x, 17.0).to_bits(), f.eval(x, t).to_bits(), "{text}");
            assert_eq!(frozen.taylor(x, 17.0), f.taylor(x, t), "{text}");
        }
    }
}

#[test]
fn the_longest_formula_fits_the_stack_of_a_worker() {
    let f = parse(&format!("x{}", "+y".repeat(4999)));
    let work = move || f.taylor(Point::new(1.0, 1.0), 0.0).gradient();
    // two MiB is what worker threads get
    let worker = std::thread::Builder::new().stack_size(2 << 20).spawn(work).unwrap();
    assert_eq!(worker.join().unwrap(), Point::new(1.0, 4999.0));
}
