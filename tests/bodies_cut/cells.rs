use std::sync::Arc;

use monolayer::cut::{Class, Cover};
use monolayer::form::{Density, Faces, Integrator, mass, stokes, swip};
use monolayer::mesh::Point;
use monolayer::shape::{Capsule, Core, Disc, Figure, Polygon, Pose, Shape};
use monolayer::space::{Field, project};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common::*;
use crate::shapes::{shapes, through};

fn pose(random: &mut ChaCha8Rng, spread: f64) -> Pose {
    let position = Point::new(random.random_range(-spread..spread), random.random_range(-spread..spread));
    Pose { position: Point::new(0.5, 0.5) + position, angle: random.random_range(-4.0..4.0) }
}

#[test]
fn the_parts_inside_add_up_to_the_body() {
    let mesh = square(5);
    let loops = loops(&mesh);
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for k in 0..shapes(1.0).len() {
        for scale in [1e-3, 0.05, 0.4, 1.0] {
            for _ in 0..6 {
                let (shape, pose) = (shapes(scale)[k].clone(), pose(&mut random, 0.05));
                let cover = Arc::new(Cover::new(&mesh, None, &[(shape.clone(), pose)]));
                let inside = loops.inside(&cover, Some(0));
                let area = inside.sum(2, |_| 1.0);
                close(area, shape.area(), shape.area(), 1e-12);
                let moment = inside.sum(2, |x| (x.site.x - pose.position).norm_squared());
                close(moment, shape.second_moment(), shape.second_moment(), 1e-11);
                let outside = loops.outside(&cover).sum(2, |_| 1.0);
                close(outside, 1.0 - shape.area(), 1.0, 1e-13);
            }
        }
    }
}

#[test]
fn bodies_on_vertices_and_along_edges() {
    let mesh = mesh("shape = \"square\"\nn = 4");
    let loops = loops(&mesh);
    let square = |half: f64| {
        let corner = |x: f64, y: f64| Point::new(x * half, y * half);
        Shape::from(Polygon {
            vertices: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        })
    };
    let mut shapes = vec![];
    for half in [0.125, 0.25, 0.5, 0.25 - 1e-14, 0.25 + 1e-14] {
        shapes.push(square(half));
        shapes.push(Shape::from(Disc { radius: half }));
        shapes.push(Shape::from(Capsule { half_length: 0.5 * half, radius: 0.5 * half }));
    }
    for shape in shapes {
        for angle in [0.0, 0.25 * std::f64::consts::PI, 0.5 * std::f64::consts::PI, 1e-15] {
            for position in [Point::new(0.5, 0.5), Point::new(0.5 + 1e-15, 0.5)] {
                let cover = Arc::new(Cover::new(&mesh, None, &[(shape.clone(), Pose { position, angle })]));
                if shape.at(Pose { position, angle }).bounds()[1].sup(&Point::new(1.0, 1.0)).norm() > 1.42 {
                    continue;
                }
                let area = loops.inside(&cover, None).sum(4, |_| 1.0);
                close(area, shape.area(), shape.area(), 1e-12);
                close(loops.outside(&cover).sum(4, |_| 1.0), 1.0 - shape.area(), 1.0, 1e-12);
            }
        }
    }
    // a body larger than the mesh
    let cover = Arc::new(Cover::new(
        &mesh,
        None,
        &[(Shape::from(Disc { radius: 9.0 }), Pose { position: Point::zeros(), angle: 0.0 })],
    ));
    assert!((0..mesh.cells.len()).all(|c| cover.cell(c) == Class::Inside(0)));
    assert!((0..mesh.faces.len()).all(|f| cover.face(f) == Class::Inside(0)));
}

/// Three bodies that do not touch, one of them leaving the unit square.
fn three() -> Vec<(Shape, Pose)> {
    let of = |scale: f64, k: usize| shapes(scale)[k].clone();
    let place = |x: f64, y: f64, angle: f64| Pose { position: Point::new(x, y), angle };
    vec![
        (of(0.6, 1), place(0.3, 0.35, 0.4)),
        (of(0.5, 4), place(0.72, 0.62, -1.0)),
        (of(0.5, 6), place(0.15, 0.9, 2.0)),
    ]
}

#[test]
fn polynomials_are_exact_on_straight_cells() {
    let mesh = square(4);
    let loops = loops(&mesh);
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for k in 0..shapes(1.0).len() {
        for scale in [0.03, 0.3, 1.0] {
            let (shape, pose) = (shapes(scale)[k].clone(), pose(&mut random, 0.04));
            let cover = Arc::new(Cover::new(&mesh, None, &[(shape.clone(), pose)]));
            let (inside, outside) = (loops.inside(&cover, Some(0)), loops.outside(&cover));
            let boundary = shape.at(pose).boundary();
            for degree in [0, 1, 2, 3, 5, 8, 12, 17, 23, 30] {
                // powers of an affine function, which is at most 1 in the square
                let direction: f64 = random.random_range(-3.0..3.0);
                let n = Point::new(direction.cos(), direction.sin()) / 1.5;
                let f = |x: Point| (n.dot(&(x - Point::new(0.5, 0.5))) + 0.5).powi(degree);
                let primitive = |x: Point| {
                    let u = n.dot(&(x - Point::new(0.5, 0.5))) + 0.5;
                    n * (u.powi(degree + 1) / (degree as f64 + 1.0) / n.norm_squared())
                };
                let exact = through(&boundary, primitive);
                close(inside.sum(degree as usize, |x| f(x.site.x)), exact, shape.area(), 1e-12);
                let whole = loops.sum(degree as usize, |x| f(x.site.x));
                close(outside.sum(degree as usize, |x| f(x.site.x)), whole - exact, 1.0, 1e-13);
            }
            // the rule inside is positive, at points of the body
            for &cell in cover.touched() {
                inside.each_cell_point(cell, 6, &mut |x| {
                    let distance = shape.at(pose).signed_distance(x.site.x).0;
                    assert!(x.weight > 0.0 && distance < 1e-13, "{shape:?}: weight {:e}, {distance:e}", x.weight);
                });
            }
        }
    }
}

#[test]
fn tiny_cuts_are_as_exact_as_others() {
    // a disc that reaches into the square by a depth d covers r² acos(1 − d/r) − (r − d) √(2rd − d²) of it, about (4/3)
    // d √(2rd)
    let mesh = mesh("shape = \"square\"\nn = 4");
    let loops = loops(&mesh);
    let r: f64 = 0.1;
    for depth in [1e-2, 1e-4, 1e-6, 1e-8, 1e-9] {
        for position in [Point::new(0.4, -r + depth), Point::new(0.45, 1.0 + r - depth), Point::new(-r + depth, 0.6)] {
            let pose = Pose { position, angle: 0.3 };
            let cover = Arc::new(Cover::new(&mesh, None, &[(Shape::from(Disc { radius: r }), pose)]));
            let area = loops.inside(&cover, Some(0)).sum(4, |_| 1.0);
            // 2r² (θ − sin θ cos θ)/2 with 1 − cos θ = d/r, by its series
            let theta = 2.0 * (0.5 * depth / r).sqrt().asin();
            let series = [20.0, 42.0, 72.0, 110.0, 156.0_f64];
            let t = 2.0 * theta;
            let exact = 0.5 * r * r * t.powi(3) / 6.0 * series.iter().rev().fold(1.0, |s, c| 1.0 - t * t / c * s);
            // the position is rounded, which moves the depth
            close(area, exact, exact, 1e-10 + 1e-15 / depth);
        }
    }
}

/// `∫ ∇·(g w) = Σ ∫ [g w]·n` over a part of the mesh on whose inner boundary g vanishes, w a discontinuous field.
fn divergence_theorem(part: &Integrator, w: &Field, g: &(dyn Fn(Point) -> (f64, Point) + Sync), degree: usize) -> f64 {
    let volume = part.sum(degree + w.space.degree, |x| {
        let (value, slope) = g(x.site.x);
        value * w.vector_gradient(&x.site).trace() + slope.dot(&w.vector(&x.site))
    });
    let faces = part.sum_faces(Faces::INTERIOR | Faces::BOUNDARY, degree + w.space.degree, |s| {
        let outer = s.plus.as_ref().map_or(Point::zeros(), |plus| w.vector(plus));
        g(s.minus.x).0 * (w.vector(&s.minus) - outer).dot(&s.n)
    });
    (volume - faces).abs()
}

/// A polynomial that vanishes on the boundary of an ellipse or polygon, and its gradient.
fn vanishing(shape: &Shape, pose: Pose, x: Point) -> (f64, Point) {
    let y = pose.to_body(x);
    let (value, slope) = match shape.figure() {
        Figure::Around { core: Core::Point, radius: r } => (y.norm_squared() / (r * r) - 1.0, y * (2.0 / (r * r))),
        Figure::Ellipse { semi_axes: [a, b] } => {
            ((y.x / a).powi(2) + (y.y / b).powi(2) - 1.0, Point::new(2.0 * y.x / (a * a), 2.0 * y.y / (b * b)))
        }
        Figure::Around { core: Core::Polygon(vertices), radius: 0.0 } => {
            let n = vertices.len();
            let lines: Vec<(f64, Point)> = (0..n)
                .map(|k| {
                    let (p, q) = (vertices[k], vertices[(k + 1) % n]);
                    let normal = Point::new((q - p).y, (p - q).x);
                    (normal.dot(&(y - p)), normal)
                })
                .collect();
            let value = lines.iter().map(|l| l.0).product();
            let rest = |k: usize| (0..n).filter(|&m| m != k).map(|m| lines[m].0).product::<f64>();
            (value, (0..n).map(|k| lines[k].1 * rest(k)).sum())
        }
        Figure::Around { .. } => unreachable!("no polynomial vanishes on the boundary of a thickened shape alone"),
    };
    (value, monolayer::shape::turned(slope, pose.angle))
}

#[test]
fn cells_and_faces_obey_the_divergence_theorem() {
    let mut random_poses = ChaCha8Rng::seed_from_u64(5);
    let straight = square(4);
    let bent = mesh("shape = \"disc\"\nh = 0.4\ncurved = 3");
    let chosen = [0, 1, 2, 6, 7];
    for (mesh, tolerance) in [(&straight, 1e-13), (&bent, 1e-13)] {
        let loops = loops(mesh);
        let w = random(&discontinuous(mesh, 3, 2), 8);
        for scale in [0.05, 0.5, 1.5] {
            let mut worst = 0.0_f64;
            let all = shapes(scale);
            for k in chosen {
                for _ in 0..4 {
                    // near the boundary, so that curved cells are cut and bodies leave the domain
                    let (shape, mut pose) = (all[k].clone(), pose(&mut random_poses, 0.3));
                    pose.position += Point::new(0.25, 0.25);
                    let cover = Arc::new(Cover::new(mesh, None, &[(shape.clone(), pose)]));
                    let g = |x: Point| vanishing(&shape, pose, x);
                    let (degree, count) = match shape.figure() {
                        Figure::Around { core: Core::Polygon(vertices), .. } => (vertices.len(), vertices.len()),
                        Figure::Around { .. } | Figure::Ellipse { .. } => (2, 2),
                    };
                    let size = mesh.vertices.iter().map(|x| g(*x).0.abs()).fold(0.0, f64::max) * count as f64;
                    // g on a curved cell is a polynomial of that degree times the geometry's
                    let degree = if mesh.curved.iter().any(Option::is_some) { 3 * degree } else { degree };
                    let inner = g(pose.position).0.abs() * shape.circumradius();
                    for (part, size) in [(loops.inside(&cover, Some(0)), inner), (loops.outside(&cover), size)] {
                        worst = worst.max(divergence_theorem(&part, &w, &g, degree) / size);
                    }
                }
            }
            println!("divergence theorem on {} cells, bodies of scale {scale}: {worst:.1e}", mesh.cells.len());
            // of small bodies the coordinates themselves are rounded
            assert!(worst < tolerance / scale, "{worst:e}");
        }
    }
}

#[test]
fn forms_hold_on_parts() {
    // b(w,1) = −∫ div w, face_load and viscosity through the matrices, with bodies of every kind at once
    let mesh = square(5);
    let whole = loops(&mesh);
    let bodies = three();
    let cover = Arc::new(Cover::new(&mesh, None, &bodies));
    let (velocity, pressure) = (continuous(&mesh, 3, 2), continuous(&mesh, 2, 1));
    let field = |x: Point| Point::new(x.x.powi(3) - 2.0 * x.x * x.y, x.y * x.y * x.x + 0.5 * x.x);
    let w = project::interpolate_vector(&velocity, field);
    let one = vec![1.0; pressure.dof_count()];
    let flux = |part: &Integrator| {
        let b = part.triplets(&stokes::divergence(&velocity, &pressure), &pressure, &velocity);
        -apply(&b, &w.values, &one)
    };
    let ends = |part: &Integrator| {
        dot(&part.vector(&mass::face_load(&velocity, Faces::BOUNDARY, 0, |s| s.n), &velocity), &w.values)
    };
    // bodies 0 and 1 lie inside the square; the outside loses what passes through them and through the part of 2 in the
    // square
    for body in [0, 1] {
        let inside = whole.inside(&cover, Some(body));
        let through_it = through(&bodies[body].0.at(bodies[body].1).boundary(), field);
        close(flux(&inside), through_it, 1.0, 1e-13);
        close(ends(&inside), 0.0, 1.0, 1e-15);
    }
    let parts = [0, 1, 2].map(|k| whole.inside(&cover, Some(k)));
    let (outside, inside) = (whole.outside(&cover), whole.inside(&cover, None));
    close(flux(&outside) + parts.iter().map(flux).sum::<f64>(), flux(&whole), 1.0, 1e-13);
    close(ends(&outside) + ends(&parts[2]), ends(&whole), 1.0, 1e-13);
    assert!(ends(&parts[2]).abs() > 1e-3, "body 2 leaves the square");
    let form = || stokes::viscosity(&velocity);
    let energy = |part: &Integrator| apply(&part.triplets(&form(), &velocity, &velocity), &w.values, &w.values);
    close(energy(&outside) + energy(&inside), energy(&whole), energy(&whole), 1e-13);
    close(energy(&inside), parts.iter().map(energy).sum(), energy(&whole), 1e-13);
    // faces: the swip form of a discontinuous space
    let space = discontinuous(&mesh, 2, 1);
    let phi = random(&space, 9);
    let jumps = |part: &Integrator| {
        let form = swip::a_swip(&space, Faces::BOUNDARY, Density::One);
        apply(&part.triplets(&form, &space, &space), &phi.values, &phi.values)
    };
    close(jumps(&outside) + jumps(&inside), jumps(&whole), jumps(&whole), 1e-12);
    // blocks of some cells alone
    let size = velocity.cell_dof_count().pow(2);
    let all = outside.cell_blocks(&form(), &velocity, &velocity);
    let some = outside.blocks_of(&form(), (&velocity, &velocity), cover.touched());
    for (block, &cell) in some.iter().zip(cover.touched()) {
        assert_eq!(block, &all[cell * size..(cell + 1) * size]);
    }
    assert!(
        (0..mesh.cells.len()).all(|c| outside.visits(c) || all[c * size..(c + 1) * size].iter().all(|v| *v == 0.0))
    );
}

#[test]
fn curved_cells_are_cut_along_their_curves() {
    // a disc inside the mesh, cutting its curved cells, has its area; one that leaves it has that of the lens, with the
    // order of the mesh's geometry
    let mut errors = Vec::new();
    for h in [0.5, 0.25, 0.125] {
        let mesh = mesh(&format!("shape = \"disc\"\nh = {h}\ncurved = 2"));
        let loops = loops(&mesh);
        let near = 0.9 * (1.0 - 0.2 * h * h);
        for (radius, x) in [(0.3, near - 0.3), (0.02, near - 0.02), (0.07, 0.5)] {
            let pose = Pose { position: Point::new(x * 0.6, x * 0.8), angle: 0.0 };
            let cover = Arc::new(Cover::new(&mesh, None, &[(Shape::from(Disc { radius }), pose)]));
            let area = std::f64::consts::PI * radius * radius;
            close(loops.inside(&cover, Some(0)).sum(2, |_| 1.0), area, area, 1e-11);
            close(loops.outside(&cover).sum(2, |_| 1.0), mesh.area() - area, 1.0, 1e-12);
        }
        // discs of radius 1 and r at the distance d of their centres
        let (r, d): (f64, f64) = (0.4, 0.93);
        let pose = Pose { position: Point::new(0.0, -d), angle: 0.0 };
        let cover = Arc::new(Cover::new(&mesh, None, &[(Shape::from(Disc { radius: r }), pose)]));
        let half = |a: f64, b: f64| {
            let c = (d * d + a * a - b * b) / (2.0 * d * a);
            a * a * (c.acos() - c * (1.0 - c * c).sqrt())
        };
        errors.push((loops.inside(&cover, None).sum(2, |_| 1.0) - half(1.0, r) - half(r, 1.0)).abs());
    }
    let order = (errors[0] / errors[2]).log2() / 2.0;
    println!("area of a lens on bent meshes of degree 2: {errors:?}, order {order:.2}");
    assert!(order > 3.0 && errors[2] < 1e-5, "{errors:?}");
}

#[test]
fn moved_bodies_change_the_cells_they_meet() {
    let mesh = square(6);
    let loops = loops(&mesh);
    let bodies = three();
    let before = Arc::new(Cover::new(&mesh, None, &bodies));
    let mut poses: Vec<Pose> = bodies.iter().map(|b| b.1).collect();
    let (same, none) = before.moved(&poses);
    assert!(none.is_empty() && same.touched() == before.touched());
    poses[1].position += Point::new(-0.03, 0.01);
    poses[1].angle += 0.1;
    let (after, changed) = before.moved(&poses);
    let after = Arc::new(after);
    let placed: Vec<(Shape, Pose)> = bodies.iter().zip(&poses).map(|(b, p)| (b.0.clone(), *p)).collect();
    let fresh = Arc::new(Cover::new(&mesh, None, &placed));
    let moments = |cover: &Arc<Cover>, cell: usize| {
        let mut bits = Vec::new();
        for part in [loops.outside(cover), loops.inside(cover, None), loops.inside(cover, Some(1))] {
            part.each_cell_point(cell, 4, &mut |x| bits.push((x.weight.to_bits(), x.site.x.x.to_bits())));
        }
        bits
    };
    for cell in 0..mesh.cells.len() {
        assert_eq!(after.cell(cell) == Class::Outside, fresh.cell(cell) == Class::Outside);
        assert_eq!(after.bodies_of_cell(cell), fresh.bodies_of_cell(cell));
        assert_eq!(moments(&after, cell), moments(&fresh, cell), "cell {cell}");
        assert_eq!(changed.contains(&cell), moments(&after, cell) != moments(&before, cell), "cell {cell}");
    }
    assert!(
        !changed.is_empty()
            && changed.iter().all(|&c| [&before, &after].iter().any(|x| x.bodies_of_cell(c).contains(&1)))
    );
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let mesh = mesh("shape = \"disc\"\nh = 0.2\ncurved = 3");
    let bodies = [(Shape::from(Disc { radius: 0.35 }), Pose { position: Point::new(0.6, 0.3), angle: 0.0 })];
    let space = discontinuous(&mesh, 2, 1);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let cover = Arc::new(Cover::new(&mesh, None, &bodies));
            let outside = loops(&mesh).outside(&cover);
            let form = swip::a_swip(&space, Faces::BOUNDARY, Density::One);
            let all = outside.triplets(&form, &space, &space);
            all.into_iter().map(|(i, j, v)| (i, j, v.to_bits())).collect::<Vec<_>>()
        })
    };
    let one = with(1);
    assert!(one == with(2) && one == with(7));
}
