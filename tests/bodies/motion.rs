//! Orders of the motion in time.

use monolayer::body::motion::Motion;
use monolayer::mesh::Point;
use monolayer::shape::{Pose, Twist};

/// `x' = (−y, x)`, `θ' = cos t`, from (1, 0), on steps that vary; the largest error at t = 2.
fn error(order: usize, steps: usize) -> f64 {
    let start = Pose { position: Point::new(1.0, 0.0), angle: 0.0 };
    let mut motion = Motion::new(vec![start], order);
    let mut t: f64 = 0.0;
    for k in 0..steps {
        let dt = 2.0 / steps as f64 * if k % 2 == 0 { 1.3 } else { 0.7 };
        let x = motion.poses[0].position;
        let now = [Twist { velocity: Point::new(-x.y, x.x), spin: t.cos() }];
        let by = motion.predicted(dt, &now);
        motion.advance(dt, &now, &by);
        t += dt;
    }
    let end = motion.poses[0];
    let exact = Point::new(t.cos(), t.sin());
    (end.position - exact).norm().max((end.angle - t.sin()).abs())
}

#[test]
fn motions_have_their_order_on_steps_that_vary() {
    for order in [1, 2] {
        let errors = [40, 80, 160].map(|steps| error(order, steps));
        let slope = (errors[0] / errors[2]).log2() / 2.0;
        assert!((slope - order as f64).abs() < 0.25, "order {order}: {errors:?}");
    }
}

#[test]
fn a_step_of_size_zero_moves_nothing() {
    let pose = Pose { position: Point::new(0.3, 0.4), angle: 1.0 };
    let mut motion = Motion::new(vec![pose], 2);
    let now = [Twist { velocity: Point::new(1.0, 2.0), spin: 3.0 }];
    for dt in [0.0, 0.1, 0.0] {
        let by = motion.predicted(dt, &now);
        let before = motion.poses.clone();
        motion.advance(dt, &now, &by);
        assert_eq!(motion.poses == before, dt == 0.0);
    }
}
