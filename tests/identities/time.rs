use monolayer::scheme::bdf;
use monolayer::scheme::control::{Control, ControlSettings};
use monolayer::scheme::schedule::{Schedule, trim};

#[test]
fn bdf_weights_obey_their_order_conditions_on_unequal_steps() {
    // Σ d_i (t_i − t_0)^m is 0 for m = 0, 1 for m = 1, 0 for m = 2 … b
    let all = [1.7, 1.45, 1.4, 0.8, 0.55, 0.1, -0.9];
    for order in 1..=bdf::MAX_ORDER {
        let times = &all[..=order];
        let weights = bdf::derivative_weights(times);
        for m in 0..=order as i32 {
            let sum: f64 = weights.iter().zip(times).map(|(d, t)| d * (t - times[0]).powi(m)).sum();
            let scale: f64 = weights.iter().zip(times).map(|(d, t)| (d * (t - times[0]).powi(m)).abs()).sum();
            let expected = f64::from(u8::from(m == 1));
            assert!((sum - expected).abs() <= 1e-13 * scale.max(1.0), "order {order}, power {m}: {sum}");
        }
        let high = order as i32 + 1;
        let defect: f64 = weights.iter().zip(times).map(|(d, t)| d * (t - times[0]).powi(high)).sum();
        assert!(defect.abs() > 1e-6, "order {order} would be exact for power {high}");
    }
}

#[test]
fn equal_steps_give_the_classical_coefficients() {
    let weights = bdf::derivative_weights(&[0.3, 0.2, 0.1]);
    for (found, exact) in weights.iter().zip([15.0, -20.0, 5.0]) {
        assert!((found - exact).abs() < 1e-11, "{found} for {exact}");
    }
}

#[test]
fn the_step_grows_by_a_quarter_after_fifty_good_steps_and_never_above_the_first() {
    let settings = ControlSettings::new(0.1).down_to(0.02);
    let mut control = Control::new(&settings);
    control.halve(&settings);
    assert_eq!(control.step, 0.05);
    // ⌈50 Δt₀/Δt⌉ = 100
    for _ in 0..99 {
        control.accept(&settings, 1.0);
    }
    assert_eq!(control.step, 0.05);
    control.accept(&settings, 1.0);
    assert!((control.step - 0.0625).abs() < 1e-15);
    for _ in 0..10_000 {
        control.accept(&settings, 1.0);
    }
    assert_eq!(control.step, 0.1);
    control.step = 0.05;
    for _ in 0..10_000 {
        control.accept(&settings, 0.5);
    }
    assert_eq!(control.step, 0.05, "slow steps do not count");
    control.halve(&settings);
    control.halve(&settings);
    assert_eq!(control.step, 0.02, "never below the minimum");
}

#[test]
fn schedules_land_on_their_times_without_slivers() {
    let schedule = Schedule::Time(0.5);
    assert_eq!(schedule.next_time(0.0), Some(0.5));
    assert_eq!(schedule.next_time(0.5), Some(1.0));
    assert!((schedule.next_time(0.5 - 1e-14).unwrap() - 1.0).abs() < 1e-12, "rounding does not repeat an output");
    // a time that is close to a landing, in units of the interval, still lands on it
    assert_eq!(Schedule::Time(10.0).next_time(9.9999), Some(10.0));
    let (mut t, mut steps, mut smallest) = (0.0, Vec::new(), f64::INFINITY);
    while t < 2.0 - 1e-12 {
        let before = t;
        let landing = schedule.next_time(t).unwrap();
        let dt = trim(t, 0.3, landing);
        t += dt;
        smallest = f64::min(smallest, dt);
        steps.push(schedule.is_due(before, t, 0));
    }
    assert_eq!(steps, [false, true].repeat(4));
    assert!(smallest > 0.24, "{smallest}");
    assert!(Schedule::Steps(3).is_due(0.0, 0.1, 6) && !Schedule::Steps(3).is_due(0.0, 0.1, 7));
}
