//! Formulas: values, derivatives, and what is refused.

use monolayer::expression::Expression;
use monolayer::mesh::Point;

fn parse(text: &str) -> Expression {
    Expression::parse(text, &[("peclet", 2.0), ("alignment", -0.5)]).unwrap()
}

fn at(text: &str, x: f64, y: f64, t: f64) -> f64 {
    parse(text).eval(Point::new(x, y), t)
}

fn refused(text: &str) -> String {
    Expression::parse(text, &[("peclet", 2.0), ("alignment", -0.5)]).unwrap_err().to_string()
}

#[test]
fn chained_comparisons_are_refused() {
    let error = Expression::parse("1 < x < 2", &[]).unwrap_err().to_string();
    assert!(error.contains("chained") && error.contains("(1 < x)*(x < 2)"), "{error}");
    let inside = Expression::parse("(1 < x)*(x < 2)", &[]).unwrap();
    assert_eq!([0.5, 1.5, 2.5].map(|x| inside.eval(Point::new(x, 0.0), 0.0)), [0.0, 1.0, 0.0]);
}

#[test]
fn values_follow_the_usual_precedence() {
    let cases = [
        ("1 - 2 - 3", -4.0),
        ("8/4/2", 1.0),
        ("2 + 3*4^2", 50.0),
        ("2^3^2", 512.0),
        ("-2^2", -4.0),
        ("2^-2", 0.25),
        ("2*-3", -6.0),
        ("-3*2 + 1", -5.0),
        ("1e-3*2.5E2", 0.25),
        (".5 + 1.", 1.5),
        ("peclet*alignment", -1.0),
        ("max(1, min(2, 3)) + 4", 6.0),
        ("if(1 < 2, if(0, 1, 5), 7)", 5.0),
        ("heaviside(0) + sign(0) + sign(-3)", 0.0),
        ("cos(PI) + sin(π) + cos(tau) + ln(e)", 1.0),
        ("atan2(1, 0)*2/pi", 1.0),
        ("hypot(3, 4)", 5.0),
        ("(1 <= 1) + (1 >= 2)", 1.0),
    ];
    for (text, value) in cases {
        approx::assert_abs_diff_eq!(at(text, 0.0, 0.0, 0.0), value, epsilon = 1e-14);
    }
    approx::assert_abs_diff_eq!(at("exp(-x^2)", 2.0, 0.0, 0.0), (-4.0_f64).exp(), epsilon = 1e-16);
    approx::assert_abs_diff_eq!(at("x + 10*y + 100*t", 1.0, 2.0, 3.0), 321.0);
}

#[test]
fn what_a_formula_depends_on() {
    assert!(parse("peclet + pi").is_constant());
    assert!(parse("0*alignment").is_zero());
    assert!(!parse("x").is_constant());
    assert!(parse("x*cos(t)").depends_on_time());
    assert!(!parse("x*y").depends_on_time());
    assert_eq!(parse("x * y").text(), "x * y");
    fn shared<T: Send + Sync + Clone>(_: &T) {}
    shared(&parse("x"));
}

#[test]
fn derivatives_agree_with_finite_differences() {
    let formulas = [
        "sin(x*y) + cos(t*x) - tan(0.3*y)",
        "exp(-x^2 - y^2)*t^3",
        "asin(x/3) + acos(y/3) + atan(x*t)",
        "sinh(x) + cosh(y)*tanh(t)",
        "ln(1 + x^2) + log10(2 + y) + sqrt(1 + t)",
        "x^y + y^x + 2^t",
        "x/(1 + y^2) - t/(x + 3)",
        "atan2(y, x) + hypot(x, y)",
        "abs(x - 2) + max(x, y^2) + min(x*y, t)",
        "if(x < y, x^2*t, y^3)",
        "-(x - 1)^3 + peclet*x*y*t",
        "floor(x) + heaviside(y) + sign(t)",
    ];
    let (x, y, t, h) = (0.7, 1.3, 0.4, 1e-5);
    for text in formulas {
        for (name, d) in [("x", [h, 0.0, 0.0]), ("y", [0.0, h, 0.0]), ("t", [0.0, 0.0, h])] {
            let exact = parse(text).diff(name).unwrap().eval(Point::new(x, y), t);
            let [dx, dy, dt] = d;
            let difference = (at(text, x + dx, y + dy, t + dt) - at(text, x - dx, y - dy, t - dt)) / (2.0 * h);
            assert!((exact - difference).abs() < 1e-8, "∂({text})/∂{name}: {exact} against {difference}");
        }
    }
}

#[test]
fn powers_of_zero_and_of_negative_numbers_have_derivatives() {
    let derivative = parse("x^2").diff("x").unwrap();
    assert_eq!(derivative.eval(Point::new(0.0, 0.0), 0.0), 0.0);
    assert_eq!(derivative.eval(Point::new(-3.0, 0.0), 0.0), -6.0);
    assert_eq!(derivative.diff("x").unwrap().eval(Point::new(7.0, 0.0), 0.0), 2.0);
    assert!(parse("x").diff("z").unwrap_err().to_string().contains("x, y, t"));
}

#[test]
fn unknown_names_come_with_those_that_exist() {
    let message = refused("1 - pecle*y");
    for part in ["`1 - pecle*y`", "`pecle`", "did you mean `peclet`?", "x, y, t, peclet, alignment, pi"] {
        assert!(message.contains(part), "{message}");
    }
    let message = refused("sine(x)");
    assert!(message.contains("functions") && message.contains("did you mean `sin`?"), "{message}");
    assert!(refused("z").contains("variables that exist are"));
}

#[test]
fn wrong_syntax_is_placed() {
    let cases = [
        ("", "character 1"),
        ("1 +", "character 4, expected a number, a name or `(`, found the end"),
        ("2x", "a product is written with `*`"),
        ("x y", "character 3"),
        ("2**3", "a power is written with `^`"),
        ("(1 + x", "expected `)`, found the end"),
        ("1)", "expected an operator or the end, found `)`"),
        ("1..2", "`1..2` is no number"),
        ("x ; y", "`;` has no meaning"),
        ("min(1)", "`min` takes 2 argument(s), here it has 1"),
        ("sin()", "character 5"),
        ("if(1, 2)", "`if` takes 3 argument(s)"),
        ("é", "`é`"),
        ("x §", "`§` has no meaning"),
    ];
    for (text, part) in cases {
        let message = refused(text);
        assert!(message.contains(part), "{text}: {message}");
    }
    assert!(refused(&"(".repeat(5000)).contains("nested"));
    assert!(refused(&"x+".repeat(50_000)).contains("longer"));
}

#[test]
fn values_that_are_not_finite_are_refused() {
    for text in ["1/0", "sqrt(-1)", "ln(0*alignment)", "min(1, sqrt(-1))", "max(sqrt(-1), 1)", "sqrt(-1) < 1"] {
        let message = refused(text);
        assert!(message.contains("must be finite"), "{text}: {message}");
    }
    let root = parse("sqrt(x)");
    assert!(root.eval(Point::new(-1.0, 0.0), 0.0).is_nan());
    let message = root.try_eval(Point::new(-1.0, 0.5), 2.0).unwrap_err().to_string();
    assert!(message.contains("`sqrt(x)` is NaN at x = -1, y = 0.5, t = 2"), "{message}");
    assert_eq!(root.try_eval(Point::new(4.0, 0.0), 0.0), Ok(2.0));
}

#[test]
fn a_formula_tells_from_when_on_it_is_constant() {
    let place = [[-3.0, 5.0], [0.0, 1.0]];
    let from = |text: &str| parse(text).constant_from(place);
    let next = |x: f64| Some(x.next_up());
    for (text, expected) in [
        ("x*y", Some(0.0)),
        ("if(t < 1, 0, 1)", Some(1.0)),
        ("if(t <= 1, 0, x)", next(1.0)),
        ("if(1 > t, sin(t), y)", Some(1.0)),
        ("if(t >= 2, 1, t/2)", Some(2.0)),
        ("min(t, 3)", Some(3.0)),
        ("max(0, 1 - t/4)", Some(4.0)),
        ("0.5*min(max(t - 1, 0), 2)", Some(3.0)),
        ("1 - heaviside(4 - t)*x", next(4.0)),
        ("sign(t - 2)", next(2.0)),
        ("t*(t < 7) + 7*(t >= 7)", Some(7.0)),
        ("if(x < t, 1, 0)", next(5.0)),
        ("if(t < x + 10, 1, y)", Some(15.0)),
        ("min(t^2, 9)", Some(3.0)),
        ("abs(min(t, 2) - 5)^3", Some(2.0)),
        ("sin(t)", None),
        ("1/(1 + t)", None),
        ("floor(t)", None),
        ("x*cos(2*t)", None),
        ("if(sin(t) > 0, 1, 0)", None),
        ("t - t", None),
        ("min(t/1e40, 1)", None),
    ] {
        // rounding may make a formula constant a last bit before its symbols are
        let same = match (from(text), expected) {
            (Some(found), Some(expected)) => (found - expected).abs() <= 2.0 * f64::EPSILON * expected.abs(),
            (found, expected) => found == expected,
        };
        assert!(same, "{text}: {:?}, not {expected:?}", from(text));
    }
    // to the last bit from then on
    for text in ["1 - exp(-t)", "tanh(2*t)", "exp(-t)*sin(t)", "1 + exp(-t)*cos(x*t)"] {
        let formula = parse(text);
        let t = formula.constant_from(place).unwrap_or_else(|| panic!("{text}"));
        assert!(t > 9.0 && t < 750.0, "{text}: {t}");
        let value = |t: f64| formula.eval(Point::new(0.7, 0.2), t).abs();
        assert!([1.1, 2.0, 10.0].iter().all(|k| value(k * t) == value(t)), "{text}");
    }
    // the derivative that manufactured sources take is at rest with the formula
    assert_eq!(parse("min(t, 3)").diff("t").unwrap().constant_from(place), Some(3.0));
}
