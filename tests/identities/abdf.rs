use monolayer::scheme::abdf::{Formula, MAX_ORDER, STABILITY_MARGIN, THETA};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// `t_n, …, t_{n−b}` on equal steps.
fn equal(order: usize) -> Vec<f64> {
    (0..=order).map(|i| 1.0 - 0.1 * i as f64).collect()
}

/// The same, every step up to `ratio` times longer or shorter than the one before.
fn uneven(order: usize, ratio: f64, generator: &mut ChaCha8Rng) -> Vec<f64> {
    let mut times = vec![generator.random_range(-1.0..1.0)];
    let mut dt = generator.random_range(0.01..1.0);
    for i in 0..order {
        times.push(times[i] - dt);
        dt *= ratio.powf(generator.random_range(-1.0..1.0));
    }
    times
}

/// What is missing in the formula for `y = ((t − t_n)/Δt)^m`, relative to its terms.
fn defect(formula: &Formula, times: &[f64], m: i32) -> f64 {
    let dt = times[0] - times[1];
    let y = |i: usize| ((times[i] - times[0]) / dt).powi(m);
    let f = |i: usize| if m == 0 { 0.0 } else { f64::from(m) * ((times[i] - times[0]) / dt).powi(m - 1) / dt };
    let past = formula.alpha.iter().enumerate().map(|(i, a)| a * y(i + 1));
    let terms: Vec<f64> = past.chain([dt * formula.beta[0] * f(0), dt * formula.beta[1] * f(1), -y(0)]).collect();
    terms.iter().sum::<f64>() / terms.iter().map(|t| t.abs()).fold(1.0, f64::max)
}

#[test]
fn a_formula_is_exact_for_polynomials_of_its_order_on_any_steps() {
    let mut generator = ChaCha8Rng::seed_from_u64(1);
    for order in 1..=MAX_ORDER {
        for round in 0..50 {
            let times = if round == 0 { equal(order) } else { uneven(order, 4.0, &mut generator) };
            for theta in [THETA, 0.0, -1.0, 0.3] {
                let formula = Formula::new(&times, theta);
                assert_eq!((formula.order, formula.alpha.len()), (order, order));
                for m in 0..=order as i32 {
                    let missing = defect(&formula, &times, m);
                    assert!(missing.abs() < 1e-12, "order {order}, θ = {theta}, power {m}: {missing:e} on {times:?}");
                }
            }
            assert!(defect(&Formula::new(&times, THETA), &times, order as i32 + 1).abs() > 1e-6);
        }
    }
}

#[test]
fn theta_zero_is_the_implicit_bdf() {
    let times = [1.0, 0.8, 0.55, 0.1];
    let weights = monolayer::scheme::bdf::derivative_weights(&times);
    let formula = Formula::new(&times, 0.0);
    assert_eq!(formula.beta[1], 0.0);
    for (a, d) in formula.alpha.iter().zip(&weights[1..]) {
        assert!((a + d / weights[0]).abs() < 1e-14);
    }
}

/// Error at t = 2 of `y' = −2 (y − sin t) + cos t`, from exact starting values, on `n` steps that alternate.
fn error(order: usize, n: usize, ratio: f64) -> f64 {
    let short = 4.0 / (n as f64 * (1.0 + ratio));
    let mut times: Vec<f64> = vec![0.0];
    for i in 0..n {
        times.push(times[i] + if i % 2 == 0 { short } else { ratio * short });
    }
    let exact = |t: f64| t.sin() + (-2.0 * t).exp();
    let source = |t: f64| 2.0 * t.sin() + t.cos();
    let mut y: Vec<f64> = times[..order].iter().map(|&t| exact(t)).collect();
    for i in order..=n {
        let levels: Vec<f64> = times[i - order..=i].iter().rev().copied().collect();
        let formula = Formula::new(&levels, THETA);
        let (dt, [implicit, explicit]) = (levels[0] - levels[1], formula.beta);
        let past: f64 = formula.alpha.iter().enumerate().map(|(k, a)| a * y[i - 1 - k]).sum();
        let f = source(levels[1]) - 2.0 * y[i - 1];
        y.push((past + dt * (implicit * source(levels[0]) + explicit * f)) / (1.0 + 2.0 * dt * implicit));
    }
    (y[n] - exact(times[n])).abs()
}

#[test]
fn the_order_is_seen_on_alternating_steps() {
    for order in 1..=MAX_ORDER {
        for ratio in [1.0, 1.3, 2.0] {
            let errors: Vec<f64> = [40, 80, 160, 320].map(|n| error(order, n, ratio)).to_vec();
            let seen = (errors[1] / errors[3]).log2() / 2.0;
            println!("order {order}, ratio {ratio}: {errors:?}, observed {seen:.2}");
            assert!((seen - order as f64).abs() < 0.15, "order {order}, ratio {ratio}: {seen:.2} from {errors:?}");
        }
    }
}

#[test]
fn all_coefficients_are_positive_at_theta_star_on_equal_steps_up_to_order_three() {
    for order in 1..=MAX_ORDER {
        let formula = Formula::new(&equal(order), THETA);
        assert!(formula.is_positive() && formula.beta[1] > 0.0, "{formula:?}");
        assert!(formula.alpha.iter().all(|&a| a > 1e-3), "{formula:?}");
        assert!((formula.alpha.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        let (low, high) = Formula::admissible(&equal(order)).unwrap();
        assert!(low < THETA && THETA < high);
    }
    assert_eq!(Formula::admissible(&equal(MAX_ORDER + 1)), None, "or a higher order could be offered");
}

#[test]
fn the_admissible_interval_holds_exactly_the_thetas_with_nonnegative_coefficients() {
    let mut generator = ChaCha8Rng::seed_from_u64(2);
    let mut empty = [0; MAX_ORDER + 1];
    for round in 0..3000 {
        let order = 1 + round % MAX_ORDER;
        let times = uneven(order, 5.0, &mut generator);
        let interval = Formula::admissible(&times);
        empty[order] += usize::from(interval.is_none());
        let (low, high) = interval.unwrap_or((f64::INFINITY, f64::NEG_INFINITY));
        // a step's worth on both sides of the ends, where the sign is not a matter of rounding, and anywhere
        let ends = [low, high].map(|end| [end - 1e-6, end + 1e-6]).concat();
        let anywhere = (0..100).map(|_| generator.random_range(-3.0..0.9));
        for theta in ends.into_iter().chain(anywhere).filter(|t| t.is_finite()) {
            let inside = low <= theta && theta <= high;
            assert_eq!(Formula::new(&times, theta).is_positive(), inside, "θ = {theta}, [{low}, {high}], {times:?}");
        }
    }
    assert_eq!(empty[..3], [0, 0, 0], "orders 1 and 2 are always admissible");
    assert!((20..500).contains(&empty[3]), "order 3 is mostly, not in {} of 1000", empty[3]);
}

/// Largest modulus of a root of `ζ^b = Σ α̃_i ζ^{b−i} + z (β̃_0 ζ^b + β̃_1 ζ^{b−1})`.
fn radius(formula: &Formula, z: f64) -> f64 {
    let b = formula.order;
    let mut companion = DMatrix::zeros(b, b);
    for (i, a) in formula.alpha.iter().enumerate() {
        let explicit = if i == 0 { z * formula.beta[1] } else { 0.0 };
        companion[(0, i)] = (a + explicit) / (1.0 - z * formula.beta[0]);
        if i > 0 {
            companion[(i, i - 1)] = 1.0;
        }
    }
    companion.complex_eigenvalues().iter().map(|e| e.norm()).fold(0.0, f64::max)
}

#[test]
fn the_stability_bound_is_where_a_root_leaves_the_unit_disc() {
    assert_eq!(Formula::new(&equal(1), THETA).stable_until(), f64::NEG_INFINITY);
    for (order, expected) in [(2, -80.0), (3, -4.4)] {
        let formula = Formula::new(&equal(order), THETA);
        let bound = formula.stable_until();
        assert!((bound - expected).abs() < 0.01 * -expected, "{bound}");
        for share in [1e-6, 0.01, 0.1, 0.5, 0.9, 0.999] {
            assert!(radius(&formula, share * bound) < 1.0, "order {order}, z = {}", share * bound);
        }
        let (mut stable, mut unstable) = (bound, 2.0 * bound);
        assert!(radius(&formula, unstable) > 1.0);
        while stable - unstable > 1e-9 {
            let middle = 0.5 * (stable + unstable);
            *(if radius(&formula, middle) > 1.0 { &mut unstable } else { &mut stable }) = middle;
        }
        // sharp for order 2
        let slack = [0.0, 0.0, 1e-6, 0.007][order];
        assert!(stable >= (1.0 + slack) * bound - 1e-6, "order {order}: {stable}, bound {bound}");
    }
    for order in 1..=MAX_ORDER {
        let implicit = Formula::new(&equal(order), 0.0);
        assert_eq!(implicit.stable_until(), f64::NEG_INFINITY);
        for z in [-1e-3, -1.0, -10.0, -1e6] {
            assert!(radius(&implicit, z) < 1.0);
        }
    }
    // and the limit of the roots that the bound comes from
    for (order, limit) in [(1, 0.35), (2, 1.05), (3, 1.925)] {
        assert!((radius(&Formula::new(&equal(order), THETA), -1e9) - limit).abs() < 1e-6);
    }
}

#[test]
fn no_sequence_of_steps_within_the_bound_grows() {
    let mut generator = ChaCha8Rng::seed_from_u64(3);
    let mut lowered = 0;
    for order in 1..=MAX_ORDER {
        let mut times = vec![0.0];
        let mut y = vec![1.0_f64];
        let mut dt = 1.0;
        for n in 0..2000 {
            dt = f64::clamp(dt * 5_f64.powf(generator.random_range(-1.0..1.0)), 1e-3, 1e3);
            let levels: Vec<f64> = [times[n] + dt].into_iter().chain(times.iter().rev().take(order).copied()).collect();
            let formula = Formula::choose(&levels, order, 0.0, false);
            lowered += usize::from(formula.order < order && n + 1 >= order);
            // the worst z that is allowed
            let z = formula.stable_until().max(-1e4);
            let past: f64 = formula.alpha.iter().zip(y.iter().rev()).map(|(a, y)| a * y).sum();
            let next = (past + z * formula.beta[1] * y[n]) / (1.0 - z * formula.beta[0]);
            let before = y.iter().rev().take(formula.order).fold(0.0_f64, |m, y| m.max(y.abs()));
            assert!(
                next.abs() <= before * (1.0 + 1e-12),
                "order {order}, step {n}: {next} after {before}, {formula:?}"
            );
            times.push(levels[0]);
            y.push(next);
        }
    }
    assert!(lowered > 50, "the sequence should have steps that order 3 cannot take: {lowered}");
}

#[test]
fn the_choice_is_stable_and_nonnegative_unless_stiffness_forbids_it() {
    let mut generator = ChaCha8Rng::seed_from_u64(4);
    let (mut implicit, mut moved, mut kept) = (0, 0, 0);
    for _ in 0..3000 {
        let order = generator.random_range(1..=MAX_ORDER);
        let times = uneven(generator.random_range(1..=order), 5.0, &mut generator);
        let stiffness = 10_f64.powf(generator.random_range(-2.0..4.0));
        let formula = Formula::choose(&times, order, stiffness, false);
        assert!(formula.stable_until() <= -STABILITY_MARGIN * stiffness);
        assert!(formula.order <= order.min(times.len() - 1));
        let calm = Formula::choose(&times, order, 0.0, false);
        assert!(calm.is_positive(), "{calm:?} on {times:?}");
        assert_eq!(formula.order, calm.order, "stiffness does not lower the order");
        if calm.order < times.len() - 1 {
            assert_eq!(Formula::admissible(&times[..=calm.order + 1]), None, "the order was lowered for nothing");
        }
        let (low, high) = Formula::admissible(&times[..=calm.order]).unwrap();
        if (low..=high).contains(&THETA) {
            assert_eq!(calm.theta, THETA);
            kept += 1;
        } else {
            assert!(low <= calm.theta && calm.theta <= high);
            // no admissible θ is nearer by more than the inset
            let end = if THETA < low { low } else { high };
            assert!((calm.theta - end).abs() <= 0.01 + 1e-12);
            moved += 1;
        }
        if formula != calm {
            assert_eq!((formula.theta, formula.beta[1]), (0.0, 0.0));
            assert!(calm.stable_until() > -STABILITY_MARGIN * stiffness);
            implicit += 1;
        }
        let forced = Formula::choose(&times, order, 0.0, true);
        assert_eq!(forced, Formula::new(&times, 0.0));
    }
    assert!(implicit > 100 && moved > 100 && kept > 100, "{implicit} {moved} {kept}");
}

/// Upwind rates on a ring of cells: `y_i' = Σ_j a_ij y_j`, columns of sum zero, off-diagonal entries nonnegative.
fn transport(n: usize, generator: &mut ChaCha8Rng) -> DMatrix<f64> {
    let mut a = DMatrix::zeros(n, n);
    for i in 0..n {
        let speed: f64 = generator.random_range(-1.0..2.0);
        let (from, to) = if speed > 0.0 { (i, (i + 1) % n) } else { ((i + 1) % n, i) };
        a[(to, from)] += speed.abs();
        a[(from, from)] -= speed.abs();
    }
    a
}

/// Least value over 500 steps with `Δt max|a_ii|` at most `share` times the limit of every step, relative to the
/// start's largest.
fn least(order: usize, share: f64, seed: u64) -> f64 {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let a = transport(40, &mut generator);
    let rate = a.diagonal().amax();
    // mostly empty: nothing hides a negative coefficient
    let start = DVector::from_fn(40, |_, _| f64::max(0.0, generator.random_range(-2.0..1.0)));
    let (mut times, mut y) = (vec![0.0], vec![start]);
    let total = y[0].sum();
    let mut least = f64::INFINITY;
    // the first step must not smooth the start away before the others are as long
    let mut dt = 4.0 * share / rate;
    for n in 0..500 {
        dt *= generator.random_range(0.85..1.25);
        let (levels, formula) = loop {
            let levels: Vec<f64> = [times[n] + dt].into_iter().chain(times.iter().rev().take(order).copied()).collect();
            let formula = Formula::choose(&levels, order, 0.0, false);
            if dt * rate <= share * formula.positive_until() {
                break (levels, formula);
            }
            dt *= 0.9;
        };
        let matrix = DMatrix::identity(40, 40) - dt * formula.beta[0] * &a;
        let mut right = dt * formula.beta[1] * (&a * &y[n]);
        for (weight, past) in formula.alpha.iter().zip(y.iter().rev()) {
            right += *weight * past;
        }
        let next = matrix.lu().solve(&right).unwrap();
        assert!(share > 1.0 || (next.sum() - total).abs() < 1e-10 * total, "the total is kept");
        least = least.min(next.min() / y[0].max());
        if least < -1e6 {
            break;
        }
        times.push(levels[0]);
        y.push(next);
    }
    least
}

#[test]
fn upwind_transport_stays_nonnegative_up_to_the_limit_of_the_explicit_part_and_not_far_beyond() {
    for order in 1..=MAX_ORDER {
        for seed in 0..3 {
            let within = least(order, 1.0, seed);
            assert!(within >= -1e-14, "order {order}, seed {seed}: {within:e}");
            let beyond = least(order, 8.0, seed);
            println!("order {order}: within {within:e}, beyond {beyond:e}");
            assert!(beyond < -1e-3, "order {order}, seed {seed}: {beyond:e} would pass for nonnegative");
        }
    }
}
