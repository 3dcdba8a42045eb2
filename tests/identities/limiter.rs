use std::sync::Arc;

use crate::common::*;
use monolayer::element::{MAX_DEGREE, basis, quadrature};
use monolayer::form::{Integrator, mass};
use monolayer::mesh::Mesh;
use monolayer::model::limiter::{Limiter, NegativeMean};
use monolayer::space::{Field, Space};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Random coefficients, moved in every cell such that the mean is a random power of ten between `least` and 5.
fn spiky(limiter: &Limiter, space: &Arc<Space>, least: f64, seed: u64) -> Field {
    let mut field = random(space, seed);
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let means = limiter.means(&field);
    for (cell, mean) in field.values.chunks_mut(space.n).zip(means) {
        let target = 10_f64.powf(generator.random_range(least.log10()..0.7));
        cell.iter_mut().for_each(|u| *u += target - mean);
    }
    field
}

fn setup(mesh: &Arc<Mesh>, degree: usize) -> (Integrator, Arc<Space>, Limiter) {
    let (loops, space) = (loops(mesh), discontinuous(mesh, degree, 1));
    let limiter = Limiter::new(&loops, &space);
    (loops, space, limiter)
}

/// Least value in every cell over all rules and all lattices.
fn least(loops: &Integrator, field: &Field) -> Vec<f64> {
    let mesh = &loops.mesh;
    let mut least = vec![f64::INFINITY; mesh.cells.len()];
    for (cell, least) in least.iter_mut().enumerate() {
        for degree in 1..=quadrature::MAX_TRIANGLE_DEGREE {
            loops.each_cell_point(cell, degree, &mut |x| *least = least.min(field.scalar(&x.site)));
        }
        // the loops raise the degree of a rule on curved cells: the lower ones are visited on the reference triangle
        let inside = (1..=quadrature::MAX_TRIANGLE_DEGREE).flat_map(|d| quadrature::triangle(d).points.iter().copied());
        let shares = (1..=quadrature::MAX_INTERVAL_DEGREE).flat_map(|d| quadrature::interval(d).points.iter());
        let along = shares.flat_map(|&s| (0..3).map(move |f| basis::face_point(f, s)));
        for xi in (1..=MAX_DEGREE).flat_map(basis::nodes).chain(inside).chain(along) {
            *least = least.min(field.scalar_at(cell, xi));
        }
    }
    for index in 0..mesh.faces.len() {
        for degree in 0..=quadrature::MAX_INTERVAL_DEGREE {
            loops.each_face_point(index, degree, &mut |s| {
                for site in std::iter::once(&s.minus).chain(&s.plus) {
                    least[site.cell] = least[site.cell].min(field.scalar(site));
                }
            });
        }
    }
    least
}

/// Means by quadrature, independent of the limiter's weights.
fn means(loops: &Integrator, field: &Field) -> Vec<f64> {
    let mean = |cell: usize| {
        let (mut sum, mut area) = (0.0, 0.0);
        loops.each_cell_point(cell, 8, &mut |x| {
            sum += x.weight * field.scalar(&x.site);
            area += x.weight;
        });
        sum / area
    };
    (0..loops.mesh.cells.len()).map(mean).collect()
}

#[test]
fn a_limited_field_is_nonnegative_wherever_it_is_evaluated_and_keeps_its_means() {
    for (m, mesh) in meshes().iter().enumerate() {
        for degree in [1, 2, 3, 5] {
            let (loops, space, limiter) = setup(mesh, degree);
            let u = spiky(&limiter, &space, 1e-8, 10 * m as u64 + degree as u64);
            let limited = limiter.limit(&u).unwrap();
            let count = mesh.cells.len();
            assert_eq!(limited.cells, limited.theta.iter().filter(|t| **t < 1.0).count());
            assert!(limited.cells > count / 3, "{} of {count}", limited.cells);
            let (before, after) = (least(&loops, &u), least(&loops, &limited.rho));
            let (kept, exact) = (means(&loops, &limited.rho), means(&loops, &u));
            for cell in 0..count {
                let (old, new) = (u.coefficients(cell, 0), limited.rho.coefficients(cell, 0));
                let (old, new): (Vec<f64>, Vec<f64>) = (old.collect(), new.collect());
                let largest = old.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
                assert!((kept[cell] - exact[cell]).abs() <= 2e-15 * largest, "degree {degree}, cell {cell}");
                assert!(after[cell] >= 0.0, "degree {degree}, cell {cell}: {:e}", after[cell]);
                if limited.theta[cell] < 1.0 {
                    assert!(before[cell] < 1e-12 * exact[cell], "cell {cell} was limited for nothing");
                    assert!(after[cell] <= 1e-12 * exact[cell], "cell {cell} was limited too much: {:e}", after[cell]);
                } else {
                    assert_eq!(old, new);
                }
            }
        }
    }
}

#[test]
fn the_means_are_those_of_the_cells_as_meshed() {
    for mesh in meshes() {
        for degree in 1..=5 {
            let (loops, space, limiter) = setup(&mesh, degree);
            let u = random(&space, degree as u64);
            for (found, exact) in limiter.means(&u).into_iter().zip(means(&loops, &u)) {
                assert!((found - exact).abs() < 1e-14, "degree {degree}: {found} for {exact}");
            }
        }
    }
}

#[test]
fn a_field_that_is_positive_enough_keeps_its_bits() {
    for mesh in meshes() {
        for degree in 1..=3 {
            let (_, space, limiter) = setup(&mesh, degree);
            let mut u = random(&space, 5);
            u.values.iter_mut().for_each(|u| *u = 1.5 + 0.4 * *u);
            let limited = limiter.limit(&u).unwrap();
            assert_eq!((limited.cells, &limited.rho.values), (0, &u.values));
            assert!(limited.theta.iter().all(|t| *t == 1.0));
            let zero = Field::zero(&space);
            let limited = limiter.limit(&zero).unwrap();
            assert_eq!((limited.cells, limited.rho.values), (0, zero.values));
        }
    }
}

#[test]
fn the_derivative_agrees_with_central_differences() {
    const H: f64 = 1e-6;
    for mesh in [square(3), disc()] {
        for degree in 1..=3 {
            let (_, space, limiter) = setup(&mesh, degree);
            let n = space.n;
            let u = spiky(&limiter, &space, 1e-2, 40 + degree as u64);
            let limited = limiter.limit(&u).unwrap();
            let derivatives: Vec<_> =
                (0..mesh.cells.len()).map(|cell| limiter.derivative(&limited, &u, cell)).collect();
            let (mut active, mut idle) = (0, 0);
            for j in 0..n {
                let shifted = |h: f64| {
                    let mut v = u.clone();
                    v.values.chunks_mut(n).for_each(|cell| cell[j] += h);
                    limiter.limit(&v).unwrap()
                };
                let (plus, minus) = (shifted(H), shifted(-H));
                for (cell, derivative) in derivatives.iter().enumerate() {
                    let side = |l: &monolayer::model::limiter::Limited| (l.theta[cell] < 1.0, l.lowest[cell]);
                    if side(&plus) != side(&limited) || side(&minus) != side(&limited) {
                        continue; // a kink between the two
                    }
                    *(if limited.theta[cell] < 1.0 { &mut active } else { &mut idle }) += 1;
                    for i in 0..n {
                        let k = cell * n + i;
                        let slope = (plus.rho.values[k] - minus.rho.values[k]) / (2.0 * H);
                        let found = derivative[(i, j)];
                        assert!((slope - found).abs() < 1e-8, "degree {degree}, cell {cell}: {found} for {slope}");
                    }
                }
            }
            let all = n * mesh.cells.len();
            assert!(
                active + idle > all * 9 / 10 && active > all / 4 && idle > all / 20,
                "{active} and {idle} of {all}"
            );
            let identities = derivatives.iter().zip(&limited.theta).filter(|(_, theta)| **theta == 1.0);
            assert!(identities.map(|(d, _)| d).all(|d| *d == DMatrix::identity(n, n)));
        }
    }
}

/// The L² projection of a function on a discontinuous space.
fn project(loops: &Integrator, space: &Arc<Space>, f: impl Fn(monolayer::mesh::Point) -> f64 + Sync) -> Field {
    let blocks = loops.cell_blocks(&mass::mass(space), space, space);
    let load = loops.vector(&mass::scalar_load(space, 14, |x| f(x.site.x)), space);
    let n = space.n;
    let solve = |(block, load): (&[f64], &[f64])| {
        let matrix = DMatrix::from_row_slice(n, n, block);
        let solved = matrix.cholesky().expect("a mass matrix").solve(&DVector::from_column_slice(load));
        solved.iter().copied().collect::<Vec<f64>>()
    };
    Field::new(space, blocks.chunks(n * n).zip(load.chunks(n)).flat_map(solve).collect())
}

#[test]
fn limiting_keeps_the_order_of_a_function_that_touches_zero() {
    let f = |x: monolayer::mesh::Point| (3.0 * (x.x - 0.4) + 1.5 * (x.y - 0.3)).sin().powi(2);
    for degree in 1..=3 {
        let runs = [6, 12, 24].map(|n| {
            let mesh = square(n);
            let (loops, space, limiter) = setup(&mesh, degree);
            let u = project(&loops, &space, f);
            let limited = limiter.limit(&u).unwrap();
            assert!(limited.cells > n / 2, "{} cells limited", limited.cells);
            let error = |field: &Field| loops.sum(14, |x| (field.scalar(&x.site) - f(x.site.x)).powi(2)).sqrt();
            (error(&u), error(&limited.rho))
        });
        let rate = (runs[0].1 / runs[2].1).log2() / 2.0;
        println!("degree {degree}: {runs:?}, order {rate:.2}");
        assert!(rate > degree as f64 + 0.8, "degree {degree}: order {rate:.2} of {runs:?}");
        assert!(runs[2].1 < 4.0 * runs[2].0, "{runs:?}");
    }
}

#[test]
fn a_mean_below_zero_or_not_finite_is_an_error_that_names_the_first_cell() {
    for mesh in [square(3), disc()] {
        for degree in 1..=3 {
            let (_, space, limiter) = setup(&mesh, degree);
            for bad in [-1e-3, f64::NAN, f64::INFINITY] {
                let mut u = Field::new(&space, vec![1.0; space.dof_count()]);
                for cell in [5, 11] {
                    u.values[cell * space.n..(cell + 1) * space.n].fill(bad);
                }
                let NegativeMean { cell, x, y, mean } = limiter.limit(&u).unwrap_err();
                let centre = mesh.centroid(5);
                assert_eq!((cell, x, y), (5, centre.x, centre.y));
                assert!(if bad.is_finite() { (mean - bad).abs() < 1e-15 } else { !mean.is_finite() }, "{mean}");
                // one bad coefficient among good ones
                let mut u = Field::new(&space, vec![1.0; space.dof_count()]);
                u.values[7 * space.n] = bad;
                assert_eq!(limiter.limit(&u).err().map(|e| e.cell), (!bad.is_finite()).then_some(7));
            }
        }
    }
}

#[test]
fn a_cell_with_mean_zero_becomes_zero() {
    let mesh = square(3);
    for degree in 1..=3 {
        let (_, space, limiter) = setup(&mesh, degree);
        // weights of two nodes of cell 4, the last ones because those of the vertices vanish for degree 2
        let weight = |i: usize| {
            let mut unit = Field::zero(&space);
            unit.values[4 * space.n + i] = 1.0;
            limiter.means(&unit)[4]
        };
        let (a, b) = (space.n - 1, space.n - 2);
        for scale in [1.0, 1e-290, 1e-312] {
            let mut u = Field::new(&space, vec![1.0; space.dof_count()]);
            let cell = &mut u.values[4 * space.n..5 * space.n];
            cell.fill(0.0);
            (cell[a], cell[b]) = (scale * weight(b), -scale * weight(a));
            if limiter.means(&u)[4] < 0.0 {
                u.values[4 * space.n + a] *= 1.0 + 1e-10;
            }
            let limited = limiter.limit(&u).unwrap();
            let cell = &limited.rho.values[4 * space.n..5 * space.n];
            assert!(limited.cells == 1 && limited.theta[4] < 1e-8);
            assert!(cell.iter().all(|u| *u >= 0.0 && *u < 1e-8 * scale), "{cell:?}");
            if scale == 1.0 {
                assert_eq!((limiter.means(&u)[4], limited.theta[4]), (0.0, 0.0));
                assert!(cell.iter().all(|u| u.to_bits() == 0));
            }
            assert!(limiter.derivative(&limited, &u, 4).iter().all(|d| d.is_finite()));
        }
    }
}

#[test]
fn threads_do_not_change_the_bits() {
    let mesh = square(8);
    let (_, space, limiter) = setup(&mesh, 3);
    let u = spiky(&limiter, &space, 1e-4, 77);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Limiter::new(&loops(&mesh), &space).limit(&u).unwrap())
    };
    let (one, three) = (with(1), with(3));
    assert!(one.cells > 0);
    assert_eq!((&one.rho.values, &one.theta, &one.lowest), (&three.rho.values, &three.theta, &three.lowest));
}
