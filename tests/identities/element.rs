use monolayer::element::{MAX_DEGREE, basis, quadrature};
use nalgebra::Vector2;

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

#[test]
fn triangle_rules_are_exact_for_their_degree() {
    for degree in 1..=quadrature::MAX_TRIANGLE_DEGREE {
        let rule = quadrature::triangle(degree);
        assert!(rule.weights.iter().all(|w| *w > 0.0), "degree {degree} has a negative weight");
        for a in 0..=degree {
            for b in 0..=degree - a {
                // ∫ ξᵃ ηᵇ = a! b! / (a+b+2)!
                let exact = factorial(a) * factorial(b) / factorial(a + b + 2);
                let found: f64 = rule
                    .points
                    .iter()
                    .zip(&rule.weights)
                    .map(|(x, w)| w * x.x.powi(a as i32) * x.y.powi(b as i32))
                    .sum();
                assert!((found - exact).abs() < 3e-15, "degree {degree}, ξ^{a} η^{b}: {found} for {exact}");
            }
        }
    }
}

#[test]
fn interval_rules_are_exact_for_their_degree() {
    for degree in 1..=quadrature::MAX_INTERVAL_DEGREE {
        let rule = quadrature::interval(degree);
        for a in 0..=degree {
            let found: f64 = rule.points.iter().zip(&rule.weights).map(|(s, w)| w * s.powi(a as i32)).sum();
            assert!((found - 1.0 / (a as f64 + 1.0)).abs() < 3e-15, "degree {degree}, s^{a}: {found}");
        }
    }
}

#[test]
fn bases_are_a_partition_of_unity_and_nodal() {
    for degree in 1..=MAX_DEGREE {
        for (k, node) in basis::nodes(degree).into_iter().enumerate() {
            let (values, _) = basis::evaluate(degree, node);
            for (i, value) in values.iter().enumerate() {
                assert!((value - f64::from(u8::from(i == k))).abs() < 1e-12, "φ_{i} at node {k} is {value}");
            }
        }
        for x in [Vector2::new(0.2, 0.3), Vector2::new(0.9, 0.05), Vector2::new(-0.1, 0.4)] {
            let (values, slopes) = basis::evaluate(degree, x);
            assert!((values.iter().sum::<f64>() - 1.0).abs() < 1e-13);
            assert!(slopes.iter().sum::<Vector2<f64>>().norm() < 1e-12);
        }
    }
}

#[test]
fn gradients_are_the_derivatives_of_the_values() {
    let (x, h) = (Vector2::new(0.27, 0.41), 1e-6);
    for degree in 1..=MAX_DEGREE {
        let (_, slopes) = basis::evaluate(degree, x);
        for c in 0..2 {
            let mut step = Vector2::zeros();
            step[c] = h;
            let (ahead, behind) = (basis::evaluate(degree, x + step).0, basis::evaluate(degree, x - step).0);
            for ((a, b), slope) in ahead.iter().zip(&behind).zip(&slopes) {
                assert!(((a - b) / (2.0 * h) - slope[c]).abs() < 1e-7);
            }
        }
    }
}

#[test]
fn face_nodes_lie_on_their_face_in_its_direction() {
    let corners = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0)];
    for degree in 1..=MAX_DEGREE {
        let nodes = basis::nodes(degree);
        for face in 0..3 {
            let (a, b) = (corners[(face + 1) % 3], corners[(face + 2) % 3]);
            for (k, &node) in basis::face_nodes(degree, face).iter().enumerate() {
                let expected = a + (b - a) * (k as f64 / degree as f64);
                assert!((nodes[node] - expected).norm() < 1e-14);
            }
        }
    }
}
