use crate::common::*;
use monolayer::mesh::Point;
use monolayer::space::project;

#[test]
fn continuous_fields_agree_on_both_sides_of_every_face() {
    for mesh in meshes() {
        let loops = loops(&mesh);
        for degree in 1..=5 {
            let field = random(&continuous(&mesh, degree, 2), degree as u64);
            let mut faces = 0;
            for index in 0..mesh.faces.len() {
                loops.each_face_point(index, 2 * degree, &mut |s| {
                    if let Some(plus) = &s.plus {
                        assert!((s.minus.x - plus.x).norm() < 1e-13, "the sides see different points");
                        assert!((field.vector(&s.minus) - field.vector(plus)).norm() < 1e-11);
                        faces += 1;
                    }
                });
            }
            assert!(faces > 0);
        }
    }
}

#[test]
fn interpolation_reproduces_polynomials_and_their_gradients_on_straight_cells() {
    let mesh = square(3);
    let loops = loops(&mesh);
    for degree in 1..=5 {
        let q = degree as i32;
        let f = |x: Point| Point::new(x.x.powi(q) - x.y, x.y.powi(q - 1) * x.x + 2.0);
        for space in [continuous(&mesh, degree, 2), discontinuous(&mesh, degree, 2)] {
            let field = project::interpolate_vector(&space, f);
            let worst = loops.sum(4, |x| (field.vector(&x.site) - f(x.site.x)).norm_squared()).sqrt();
            assert!(worst < 1e-13, "degree {degree}: {worst}");
            let slope = loops.sum(4, |x| {
                let at = x.site.x;
                let d = field.vector_gradient(&x.site);
                (d.m11 - f64::from(q) * at.x.powi(q - 1)).powi(2) + (d.m12 + 1.0).powi(2)
            });
            assert!(slope.sqrt() < 1e-11, "degree {degree}: {slope}");
        }
    }
}

#[test]
fn the_integral_of_one_is_the_area_and_the_boundary_is_closed() {
    for mesh in meshes() {
        let loops = loops(&mesh);
        close(loops.sum(0, |_| 1.0), mesh.area(), mesh.area(), 1e-13);
        for c in 0..2 {
            let total = loops.sum_faces(monolayer::form::Faces::BOUNDARY, 0, |s| s.n[c]);
            assert!(total.abs() < 1e-12, "∫ n = {total}");
        }
        // divergence theorem with the position as field: ∫_∂Ω x·n = 2|Ω|
        let flux = loops.sum_faces(monolayer::form::Faces::BOUNDARY, 1, |s| s.minus.x.dot(&s.n));
        close(flux, 2.0 * mesh.area(), mesh.area(), 1e-12);
    }
}
