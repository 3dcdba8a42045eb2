//! Mass: kept where nothing passes the boundary, counted where something does; and never negative.

use std::sync::Arc;

use crate::common::*;
use monolayer::mesh::{BoundaryEdge, Mesh, Point};
use monolayer::model::compressible::Compressible;
use monolayer::model::fields::{DENSITY, POLARITY, VELOCITY};
use monolayer::model::{Conditions, Parameters, VelocityCondition};
use monolayer::time::{CouplingKind, March, MarchSettings};

const COUPLINGS: [CouplingKind; 3] =
    [CouplingKind::Newton, CouplingKind::Anderson { depth: 5 }, CouplingKind::FixedPoint];

/// Strongly driven tissue.
fn active() -> Parameters {
    Parameters { traction: 6.0, active_stress: 3.0, friction: 1.0, peclet: 0.5, ..PARAMETERS }
}

/// Steps that alternate in the ratio 2 and land on every multiple of 0.33, so that few of them are equal.
fn uneven(step: f64, order: usize, kind: CouplingKind) -> MarchSettings {
    MarchSettings { alternate: 2.0, ..settings(step, order, kind) }
}

fn mass(march: &March) -> f64 {
    march.model.mass(&march.state.carried())
}

/// Two squares of different size that share nothing.
fn two_parts() -> Arc<Mesh> {
    let (a, b) = (square(2), mesh("shape = \"square\"\nn = 3\nlength = [0.0, 1.5]\ndistortion = 0.1"));
    let (mut vertices, mut cells, mut boundary) = (Vec::new(), Vec::new(), Vec::new());
    for (part, by, tag) in [(&a, Point::zeros(), 0), (&b, Point::new(2.0, -0.3), 1)] {
        let first = vertices.len();
        vertices.extend(part.vertices.iter().map(|x| x + by));
        cells.extend(part.cells.iter().map(|cell| cell.map(|k| k + first)));
        let outer = part.faces.iter().filter(|face| face.plus.is_none());
        let edge = |face| BoundaryEdge { vertices: part.face_vertices(face).map(|k| k + first), tag, curve: None };
        boundary.extend(outer.map(edge));
    }
    let tags = ["a", "b"].map(str::to_owned).into();
    Arc::new(Mesh::build(vertices, cells, &boundary, tags, Vec::new()).expect("the parts lie apart"))
}

/// `∫ρ` over the part left of x = 1.5 and over the other one.
fn masses(model: &Compressible, march: &March) -> [f64; 2] {
    let mesh = &model.loops.mesh;
    let over = |left: bool| {
        let rho = &march.state[DENSITY];
        model.loops.sum(4, |x| if (mesh.centroid(x.site.cell).x < 1.5) == left { rho.scalar(&x.site) } else { 0.0 })
    };
    [over(true), over(false)]
}

#[test]
fn parts_that_share_nothing_keep_their_masses_apart() {
    let mesh = two_parts();
    for kind in COUPLINGS {
        for k in [1, 2] {
            let model = sheet(&mesh, active(), k, closed);
            let mut march = March::start(&model, uneven(0.02, 3, kind), smooth(&model)).unwrap();
            let start = masses(&model, &march);
            let (mut worst, mut fastest) = (0.0_f64, 0.0_f64);
            for _ in 0..100 {
                march.advance(next_landing(march.t)).unwrap();
                let now = masses(&model, &march);
                worst = now.iter().zip(start).fold(worst, |worst, (now, start)| worst.max((now / start - 1.0).abs()));
                fastest = fastest.max(largest(&march.state[VELOCITY].values));
            }
            assert!(fastest > 0.3, "{kind:?}: it moves: {fastest}");
            assert!(worst < 1e-13, "{kind:?}, k = {k}: the mass of a part changes by {worst:.1e}");
        }
    }
}

fn next_landing(t: f64) -> f64 {
    0.33 * ((t / 0.33 + 1e-9).floor() + 1.0)
}

#[test]
fn a_closed_sheet_keeps_its_mass_over_a_thousand_steps() {
    for kind in [CouplingKind::Newton, CouplingKind::Anderson { depth: 5 }] {
        let model = sheet(&square(2), active(), 1, closed);
        let mut march = March::start(&model, uneven(0.02, 3, kind), smooth(&model)).unwrap();
        let (start, first) = (mass(&march), march.state[POLARITY].values.clone());
        let (mut worst, mut fastest, mut lowest) = (0.0_f64, 0.0_f64, f64::INFINITY);
        for _ in 0..1000 {
            march.advance(next_landing(march.t)).unwrap();
            worst = worst.max((mass(&march) / start - 1.0).abs());
            fastest = fastest.max(largest(&march.state[VELOCITY].values));
            lowest = lowest.min(least(&model, &march.state[DENSITY]));
        }
        let moved = largest(&minus(&march.state[POLARITY].values, &first));
        println!("{kind:?}: mass {worst:.1e}, speed {fastest:.2}, density ≥ {lowest:.2e}, {:?}", march.counts);
        assert!(fastest > 0.3 && moved > 0.1, "{kind:?}: it moves: {fastest}, {moved}");
        assert!(worst < 1e-13, "{kind:?}: the mass changes by {worst:.1e}");
        assert!((march.mass_counted() / start - 1.0).abs() < 1e-13, "{kind:?}: nothing was gained");
        assert!(lowest >= 0.0, "{kind:?}: {lowest:.1e}");
    }
}

/// What the march counts is what there is, after every one of `steps` steps.
#[track_caller]
fn counts(model: &Compressible, settings: MarchSettings, y: Vec<f64>, steps: usize) -> usize {
    let mut march = March::start(model, settings, y).unwrap();
    let start = mass(&march);
    let (mut most, mut worst, mut lowest) = (0.0_f64, 0.0_f64, f64::INFINITY);
    for _ in 0..steps {
        march.advance(next_landing(march.t)).unwrap();
        let now = mass(&march);
        most = most.max((now / start - 1.0).abs());
        worst = worst.max((march.mass_counted() / now - 1.0).abs());
        lowest = lowest.min(least(model, &march.state[DENSITY]));
    }
    let kind = settings.coupling.kind;
    println!("{kind:?}: mass counted to {worst:.1e}, changed by {most:.2}, least {lowest:.1e}, {:?}", march.counts);
    assert!(most > 0.02, "{kind:?}: something came and went: {most}");
    assert!(worst < 1e-12, "{kind:?}: what is counted is off by {worst:.1e}");
    assert!(lowest >= 0.0, "{kind:?}: {lowest:.1e}");
    march.counts.limited
}

#[test]
fn what_comes_and_goes_is_counted() {
    for kind in COUPLINGS {
        let orders: &[usize] = if kind == CouplingKind::FixedPoint { &[2] } else { &[1, 2, 3] };
        for &order in orders {
            let model = sheet(&square(2), PARAMETERS, 1, channel);
            counts(&model, uneven(0.03, order, kind), smooth(&model), 60);
        }
    }
}

#[test]
fn sources_are_counted() {
    let mesh = square(2);
    let mut description = describe(&mesh, PARAMETERS, 1, closed);
    description.sources.density = Some(formula("0.5*cos(2*t)*(1 + x)"));
    let model = Compressible::new(&mesh, &description).unwrap();
    counts(&model, uneven(0.03, 3, CouplingKind::Newton), smooth(&model), 60);
}

/// Hardly anything enters on the left, and the edge of the tissue leaves on the right.
fn edge(tag: &str) -> Conditions {
    let mut condition = channel(tag);
    if let VelocityCondition::Dirichlet(v) = &mut condition.velocity {
        *v = pair("1", "0");
        condition.density = Some(formula("1e-6"));
    }
    condition
}

#[test]
fn limited_cells_at_the_outlet_are_counted() {
    for kind in COUPLINGS {
        let model = sheet(&square(3), PARAMETERS, 1, edge);
        let start = carried(&model, |x| 1.0 + 1e-3 * x.y, |x| monolayer::mesh::Point::new(0.5, 0.2 * x.x));
        let limited = counts(&model, uneven(0.05, 2, kind), start, 60);
        assert!(limited > 20, "the limiter is at work: {limited}");
    }
}
