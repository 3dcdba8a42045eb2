//! The L² projection cell by cell: of formulas, of random starts, and of fields of other meshes.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::common::*;
use monolayer::element::quadrature::{self, MAX_TRIANGLE_DEGREE};
use monolayer::expression::Expression;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::limiter::Limiter;
use monolayer::model::start;
use monolayer::space::{Field, project};

fn formula(text: &str) -> Expression {
    Expression::parse(text, &[]).unwrap()
}

/// The unit square of 2n² equal cells.
fn even(n: usize) -> Arc<Mesh> {
    mesh(&format!("shape = \"square\"\nn = {n}"))
}

fn density(mesh: &Arc<Mesh>, degree: usize, text: &str) -> Field {
    let limiter = Limiter::new(&loops(mesh), &discontinuous(mesh, degree, 1));
    start::density(&limiter, &formula(text), 0.0).unwrap()
}

fn mass(field: &Field) -> f64 {
    loops(&field.space.mesh).sum(field.space.degree, |x| field.scalar(&x.site))
}

#[test]
fn all_points_lie_inside_of_the_cell() {
    for degree in 1..=MAX_TRIANGLE_DEGREE {
        for xi in &quadrature::triangle(degree).points {
            let least = xi.x.min(xi.y).min(1.0 - xi.x - xi.y);
            assert!(least > 1e-5, "degree {degree}: {xi:?}");
        }
    }
}

#[test]
fn the_error_is_orthogonal_to_the_space() {
    let f = |x: Point| Point::new((3.0 * x.x - x.y).sin(), (x.x * x.y).exp());
    for mesh in meshes() {
        for degree in 1..=5 {
            let space = discontinuous(&mesh, degree, 2);
            let u = project::project_vector(&space, &[], f);
            let test = random(&space, 3);
            let error = loops(&mesh).sum(20, |x| (u.vector(&x.site) - f(x.site.x)).dot(&test.vector(&x.site)));
            let size = loops(&mesh).sum(20, |x| f(x.site.x).norm() * test.vector(&x.site).norm());
            assert!(error.abs() < 1e-9 * size, "degree {degree}: {error:e} of {size}");
        }
    }
}

#[test]
fn polynomials_stay_what_they_are_and_constants_keep_their_bits() {
    for mesh in meshes() {
        let one = project::project_scalar(&discontinuous(&mesh, 3, 1), &[], |_| 0.1);
        assert!(one.values.iter().all(|&value| value == 0.1));
    }
    for degree in 1..=5 {
        let space = discontinuous(&square(3), degree, 1);
        let f = |x: Point| x.x.powi(degree as i32) - 2.0 * x.y + 0.3;
        let (u, wanted) = (project::project_scalar(&space, &[], f), project::interpolate_scalar(&space, f));
        u.values.iter().zip(&wanted.values).for_each(|(u, wanted)| close(*u, *wanted, 1.0, 1e-12));
    }
}

#[test]
fn a_jump_along_faces_belongs_to_the_cells_on_its_sides() {
    for degree in 1..=5 {
        for text in ["if(x>0.5,1,0)", "if(x>=0.5,1,0)", "heaviside(x-0.5)", "floor(2*x)", "(sign(x-1/2)+1)/2"] {
            let rho = density(&even(4), degree, text);
            for (cell, values) in rho.values.chunks(rho.space.n).enumerate() {
                let wanted = f64::from(u8::from(rho.space.mesh.centroid(cell).x > 0.5));
                assert!(values.iter().all(|&value| value == wanted), "degree {degree}, {text}: {values:?}");
            }
            close(mass(&rho), 0.5, 1.0, 1e-15);
        }
    }
}

/// Straight lines through cells are cut exactly; round ones to the bound given, relative to the size of what they
/// bound.
#[test]
fn jumps_and_kinks_inside_of_cells_keep_the_mass() {
    for (text, wanted, bound) in [
        ("if(x>0.3,1,0)", 0.7, 1e-14),
        ("if(x+2*y<1.1,2,0.5)", 0.5 + 1.5 * (0.1 * 0.5 + 0.5 * 0.5), 1e-14),
        ("if(x>0.3,if(y<0.45,1,0),0)", 0.7 * 0.45, 1e-14),
        ("heaviside(x-0.3)*heaviside(0.61-x)*(x<=y)", 0.5 * (0.7 * 0.7 - 0.39 * 0.39), 1e-14),
        ("if(if(x>0.37,y,1-y)>0.42,1,0)", 0.58, 1e-14),
        ("max(0,x-0.3)", 0.245, 1e-14),
        ("abs(x-y)", 1.0 / 3.0, 1e-14),
        ("floor(7*x)", 3.0, 1e-14),
        ("1+floor(5*x-3*y)-floor(5*x-3*y)", 1.0, 1e-14),
        ("if(sin(10*pi*x)>0,1,0)", 0.5, 1e-6),
        ("if(hypot(x-0.5,y-0.4)<0.3,1,0)", PI * 0.09, 1e-5),
        ("if((x-0.41)^2+(y-0.38)^2<0.0004,1,0)", PI * 4e-4, 1e-3),
        ("pi+atan2(y-0.5,0.37-x)", PI, 1e-8),
        ("exp(-((x-0.52)^2+(y-0.47)^2)/0.001)", PI * 1e-3, 1e-8),
        ("1+tanh((x-0.47)/0.01)", 1.06, 1e-7),
    ] {
        for mesh in [even(4), square(3)] {
            for degree in [1, 3] {
                let found = mass(&density(&mesh, degree, text));
                assert!((found / wanted - 1.0).abs() < bound, "{text}, degree {degree}: {found}, not {wanted}");
            }
        }
    }
}

#[test]
fn a_projected_density_is_not_negative_and_keeps_its_means() {
    let mesh = even(4);
    let limiter = Limiter::new(&loops(&mesh), &discontinuous(&mesh, 2, 1));
    let text = "max(0, x-0.3)";
    let (limited, free) = (
        density(&mesh, 2, text),
        project::project(limiter.space(), &formula(text).breaks(0.0), |x: Point| Ok::<_, ()>([(x.x - 0.3).max(0.0)])),
    );
    let free = free.unwrap();
    assert!(limiter.smallest(&free) < -1e-4 && limiter.smallest(&limited) >= 0.0);
    for (a, b) in limiter.means(&free).into_iter().zip(limiter.means(&limited)) {
        close(a, b, 1.0, 1e-15);
    }
}

/// No node lies where it is negative.
#[test]
fn a_density_that_is_negative_between_the_nodes_is_refused() {
    let mesh = even(4);
    let limiter = Limiter::new(&loops(&mesh), &discontinuous(&mesh, 1, 1));
    for text in ["1-1.5*sin(4*pi*x)^2*sin(4*pi*y)^2", "if((x-0.1)^2+(y-0.04)^2<0.0004,-1,1)"] {
        let refused = start::density(&limiter, &formula(text), 0.0).unwrap_err().to_string();
        assert!(refused.contains("must not be negative"), "{refused}");
    }
    let refused = start::density(&limiter, &formula("1/(x-0.1)^2/(x>0.08)/(x<0.12)"), 0.0).unwrap_err().to_string();
    assert!(refused.contains("must be finite"), "{refused}");
}

#[test]
fn random_starts_have_one_integral_on_all_meshes() {
    let integral = |mesh: &Arc<Mesh>| {
        let p = start::random(&discontinuous(mesh, 1, 2), 4, 0.1, 0.17).unwrap();
        [0, 1].map(|c| loops(mesh).sum(3, |x| p.vector(&x.site)[c]))
    };
    let (a, b, c) = (integral(&even(2)), integral(&even(7)), integral(&square(3)));
    for k in 0..2 {
        close(a[k], b[k], 0.01, 1e-11);
        close(a[k], c[k], 0.01, 1e-11);
    }
}

#[test]
fn fields_of_other_meshes_keep_their_integrals() {
    for (from, to) in [(even(3), square(3)), (square(3), even(7)), (even(8), even(2))] {
        for degrees in [(1, 1), (2, 1), (1, 3)] {
            let field = random(&discontinuous(&from, degrees.0, 1), 5);
            let found = project::transfer(&discontinuous(&to, degrees.1, 1), &field).unwrap();
            close(mass(&found), mass(&field), 1.0, 1e-13);
        }
        let f = |x: Point| Point::new(x.x * x.x - x.y, 2.0 * x.x * x.y + 1.0);
        let field = project::interpolate_vector(&discontinuous(&from, 2, 2), f);
        let space = discontinuous(&to, 3, 2);
        let found = project::transfer(&space, &field).unwrap();
        let wanted = project::interpolate_vector(&space, f);
        found.values.iter().zip(&wanted.values).for_each(|(a, b)| close(*a, *b, 1.0, 1e-12));
    }
}

#[test]
fn on_the_same_mesh_nothing_is_lost() {
    for mesh in meshes() {
        let field = random(&discontinuous(&mesh, 2, 2), 8);
        assert_eq!(project::transfer(&field.space, &field).unwrap().values, field.values);
        let finer = project::transfer(&discontinuous(&mesh, 4, 2), &field).unwrap();
        let back = project::transfer(&field.space, &finer).unwrap();
        back.values.iter().zip(&field.values).for_each(|(a, b)| close(*a, *b, 1.0, 1e-12));
        let coarser = project::transfer(&discontinuous(&mesh, 1, 2), &field).unwrap();
        let sum = |u: &Field| loops(&mesh).sum(4, |x| u.vector(&x.site).x);
        close(sum(&coarser), sum(&field), 1.0, 1e-13);
    }
}

/// Two meshes of a disc differ at its rim; what the cells there lose is small.
#[test]
fn transfers_between_curved_meshes_nearly_keep_the_integral() {
    let (coarse, fine) = (mesh("shape = \"disc\"\nh = 0.3"), mesh("shape = \"disc\"\nh = 0.2"));
    let f = |x: Point| 1.2 + (2.0 * x.x - x.y).sin();
    for (from, to) in [(&coarse, &fine), (&fine, &coarse)] {
        let field = project::project_scalar(&discontinuous(from, 1, 1), &[], f);
        let found = project::transfer(&discontinuous(to, 1, 1), &field).unwrap();
        close(mass(&found), mass(&field), mass(&field), 2e-4);
    }
    let far = mesh("shape = \"disc\"\nradius = 2.0\nh = 0.5");
    let field = project::project_scalar(&discontinuous(&fine, 1, 1), &[], f);
    assert!(project::transfer(&discontinuous(&far, 1, 1), &field).is_err());
}
