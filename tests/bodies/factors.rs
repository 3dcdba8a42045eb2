//! Moves, and the factors that they leave.

use monolayer::form::Linear;
use monolayer::mesh::Point;
use monolayer::model::immersed::flow::{Flow, Method};
use monolayer::shape::Twist;

use crate::common::{disc, flow_of, penalty, pushed, square, usual, walls};

fn start(place: Point, method: Method) -> Flow {
    let body = pushed(disc(0.12, place), [1.0, -2.0], 0.1);
    flow_of(&square(16), &walls(["0", "0"]), vec![body], method).expect("a flow")
}

#[test]
fn a_moved_body_is_where_a_new_one_would_be() {
    let place = Point::new(0.4, 0.6);
    let mut flow = start(place, penalty(1e-8));
    for k in 1..=6 {
        let by = [Twist { velocity: Point::new(0.021, -0.017), spin: 0.05 }];
        flow.advance(1.0, &by, &by).expect("a move");
        let share = flow.momentum.bodies().expect("a body").share;
        assert!(share < 0.98, "step {k}: {share}");
        let moved = flow.solve(&Linear::zero()).expect("a solution");
        let fresh = start(flow.motion.poses[0].position, penalty(1e-8)).solve(&Linear::zero()).expect("a solution");
        let apart = (moved.twists[0].velocity - fresh.twists[0].velocity).norm();
        assert!(apart < 1e-11 * fresh.twists[0].velocity.norm(), "step {k}: {apart}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let run = |method| {
        let mut flow = start(Point::new(0.45, 0.55), method);
        for _ in 0..2 {
            let now = flow.solve(&Linear::zero()).expect("a solution").twists;
            let by = flow.predicted(0.5, &now).expect("a prediction");
            flow.advance(0.5, &now, &by).expect("a move");
        }
        let carried = flow.solve(&Linear::zero()).expect("a solution");
        carried.v.iter().chain(&carried.pi).map(|v| v.to_bits()).collect::<Vec<u64>>()
    };
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    for method in [usual(), penalty(1e-8)] {
        assert!(pool(1).install(|| run(method)) == pool(3).install(|| run(method)), "bits differ");
    }
}

/// Springs between the points of a grid, each point held a little.
#[test]
fn factors_renewed_in_part_are_those_of_a_whole_factorisation() {
    use monolayer::solve::dissection::{Group, dissect};
    use monolayer::solve::multifrontal::Multifrontal;
    use monolayer::solve::symbolic::{Element, Symbolic};
    use std::sync::Arc;
    const N: usize = 20;
    let springs: Vec<[usize; 2]> = (0..N * N)
        .flat_map(|p| [(p % N + 1 < N).then_some([p, p + 1]), (p / N + 1 < N).then_some([p, p + N])])
        .flatten()
        .collect();
    let point = |p: usize| Group { unknowns: vec![p as u32], position: [(p % N) as f64, (p / N) as f64] };
    let groups: Vec<Group> = (0..N * N).map(point).collect();
    let mut adjacency = vec![Vec::new(); N * N];
    for [a, b] in &springs {
        adjacency[*a].push(*b as u32);
        adjacency[*b].push(*a as u32);
    }
    let tree = dissect(&groups, &adjacency, &[], &[], 8);
    let fill = |stiffness: &[f64], e: usize, out: &mut Element| {
        out.rows = springs[e].map(|p| p as u32).to_vec();
        out.columns.clone_from(&out.rows);
        out.values = vec![stiffness[e] + 0.01, -stiffness[e], -1.1 * stiffness[e], stiffness[e] + 0.02];
    };
    let mut stiffness: Vec<f64> = (0..springs.len()).map(|e| 1.0 + (e % 7) as f64).collect();
    let pattern = |e: usize, out: &mut Element| fill(&stiffness, e, out);
    let symbolic = Arc::new(Symbolic::new("springs", N * N, &tree, springs.len(), pattern).expect("a structure"));
    let mut kept = Multifrontal::<f64>::keeping(symbolic.clone(), |e, out| fill(&stiffness, e, out)).expect("factors");
    let right: Vec<f64> = (0..N * N).map(|p| (p as f64).sin()).collect();
    for changed in [vec![3], vec![100, 101, 140], vec![], vec![springs.len() - 1]] {
        changed.iter().for_each(|&e: &usize| stiffness[e] *= 1e6);
        let share = kept.refactor_changed(|e, out| fill(&stiffness, e, out), &changed).expect("factors");
        assert!(if changed.is_empty() { share == 0.0 } else { share > 0.0 && share < 0.9 }, "{changed:?}: {share}");
        let whole = Multifrontal::<f64>::new(symbolic.clone(), |e, out| fill(&stiffness, e, out)).expect("factors");
        let (mut x, mut y) = (right.clone(), right.clone());
        kept.solve_in_place(&mut x);
        whole.solve_in_place(&mut y);
        assert_eq!(x, y, "{changed:?}");
    }
}
