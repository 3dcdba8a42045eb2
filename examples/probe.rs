use monolayer::measure::Overshoot;
use monolayer::mesh::Point;
use monolayer::mesh::generate::MeshScene;
use monolayer::model::incompressible::*;
use monolayer::model::momentum::SlipTreatment;
use monolayer::model::*;
use monolayer::space::project;
use monolayer::time::*;
use std::sync::Arc;
fn main() {
    let scene: MeshScene = toml::from_str(&std::fs::read_to_string(std::env::args().nth(1).unwrap()).unwrap()).unwrap();
    let t0 = std::time::Instant::now();
    let mesh = Arc::new(scene.build().unwrap());
    println!("{} {:?}", mesh.quality(), t0.elapsed());
    let e = |s: f64| Expression::constant(s);
    let cond = |tag: &str| match tag {
        "inlet" => Conditions {
            velocity: VelocityCondition::Dirichlet([e(1.), e(0.)]),
            polarity: PolarityCondition::Dirichlet([e(1.), e(0.)]),
        },
        "outlet" => Conditions {
            velocity: VelocityCondition::Traction([e(0.), e(0.)]),
            polarity: PolarityCondition::Dirichlet([e(1.), e(0.)]),
        },
        _ => Conditions { velocity: VelocityCondition::Slip, polarity: PolarityCondition::Neumann },
    };
    let d = Description {
        parameters: Parameters {
            friction: 3.0,
            traction: 3.0,
            active_stress: 0.0,
            peclet: 2.0,
            coherence: 0.1,
            elasticity: 0.4,
            slip: 1.0,
        },
        degrees: Degrees { velocity: 2, pressure: 1, polarity: 3 },
        conditions: mesh.tags.iter().map(|t| cond(t)).collect(),
        sources: Sources::default(),
        slip: SlipTreatment::Rotated,
    };
    let t0 = std::time::Instant::now();
    let model = Incompressible::new(&mesh, &d).unwrap();
    println!("setup {:?}", t0.elapsed());
    let dt: f64 = std::env::args().nth(2).unwrap().parse().unwrap();
    let n: usize = std::env::args().nth(3).unwrap().parse().unwrap();
    let depth: usize = std::env::args().nth(4).unwrap().parse().unwrap();
    let p = project::interpolate_vector(&model.polarity.space, |x| {
        let r = x.norm().max(1.0);
        let c = x.x / r;
        let f = (-(r - 1.0)).exp();
        let t = Point::new(1.0 - f * c * c, -f * c * x.y / r);
        t / t.norm().max(0.05)
    });
    let settings = MarchSettings {
        order: 2,
        control: ControlSettings::new(dt, 1e-6),
        coupling: CouplingSettings {
            tolerance: 1e-8,
            max_iterations: 100,
            accept: 1e-4,
            diverged: 1e4,
            kind: if depth == 0 { CouplingKind::FixedPoint } else { CouplingKind::Anderson { depth } },
        },
    };
    let mut march = March::start(&model, settings, p).unwrap();
    let locator = monolayer::mesh::locate::Locator::new(&mesh);
    let t0 = std::time::Instant::now();
    for k in 0..n {
        let r = march.advance(1e9).unwrap();
        if k % 10 == 9 || k < 3 {
            let res = march.residuals().unwrap();
            let en = march.energy();
            let ov = Overshoot::of(&march.state.v, &mesh, &locator, (1.0, 50.0), 0.0).unwrap();
            let op = Overshoot::of(&march.state.p, &mesh, &locator, (1.0, 50.0), 0.0).unwrap();
            println!(
                "{} t={:.3} its={} lin={} rate={:.2} res={:.2e} {:?} F={:.5} dF={:.2e} ov={:.4}@{:.3} op={:.3}@{:.3} [{:.3}s/it]",
                r.step,
                r.t,
                r.iterations,
                march.counts.polarity_linear_iterations,
                r.rate,
                res.total(),
                res,
                en.0,
                en.1,
                ov.percent,
                ov.x1,
                op.percent,
                op.x1,
                t0.elapsed().as_secs_f64() / march.counts.nonlinear_iterations as f64
            );
        }
    }
    for k in 0..60 {
        let x = 1.0005 + k as f64 * 0.02;
        let at = monolayer::measure::cut::both_sides(&mesh, &locator, Point::new(x, 0.0), Point::x());
        if at.is_empty() {
            continue;
        }
        println!(
            "{x:.3} v {:.5} p {:.4} {:.4}  n={}",
            monolayer::measure::cut::value(&march.state.v, &at, 0),
            monolayer::measure::cut::value(&march.state.p, &at, 0),
            monolayer::measure::cut::value(&march.state.p, &at, 1),
            at.len()
        );
    }
    println!("{:#?} {:?}", march.phases.seconds(), march.counts);
}
