use monolayer::form::{Integrator, mass};
use monolayer::measure::errors::ErrorField::{Density, Polarity, Velocity};
use monolayer::measure::errors::{History, Norm, errors};
use monolayer::mesh::Point;
use monolayer::run::Setup;
use monolayer::scene::{Scene, SceneSource};
use monolayer::time::March;
use nalgebra::{DMatrix, DVector};

#[test]
#[ignore]
fn diag() {
    for degree in [1usize, 2, 3, 4, 6, 12] {
        let text = std::fs::read_to_string("studies/mms/squeezed-square.toml").unwrap();
        let source = SceneSource::parse(&text, std::path::Path::new("x")).unwrap();
        let scene = Scene::check(source).unwrap();
        let setup = Setup::new(&scene).unwrap();
        let space = setup.model.volume().clone();
        let loops = Integrator::new(&space.mesh);
        let f = |x: Point| ((2.0 * std::f64::consts::PI * (x.x + x.y)).cos() + 2.0) / 3.0;
        let load = loops.vector(&mass::scalar_load(&space, degree - 1, |x| f(x.site.x)), &space);
        let blocks = loops.cell_blocks(&mass::mass(&space), &space, &space);
        let mut values = Vec::new();
        for (b, l) in blocks.chunks(9).zip(load.chunks(3)) {
            let m = DMatrix::from_row_slice(3, 3, b);
            values.extend(m.lu().solve(&DVector::from_column_slice(l)).unwrap().iter().copied());
        }
        let p = setup.initial(&scene).unwrap().values;
        let mut march = March::start(&*setup.model, scene.march(), [values, p].concat()).unwrap();
        let mut history = History::default();
        while march.t < scene.time.end * (1.0 - 1e-12) {
            let dt = march.advance(scene.time.end).unwrap().dt;
            history.add(&errors(&*setup.model, scene.sources.exact.as_ref().unwrap(), &march.state, march.t), dt);
        }
        let e = [Velocity, Density, Polarity].map(|field| history.error(field, Norm::Square));
        println!("rule {degree}: {e:?} limited {}", march.counts.limited);
    }
}
