use crate::common::*;
use crate::model::{PARAMETERS, formula};
use monolayer::element::basis;
use monolayer::form::Faces;
use monolayer::mesh::{Mesh, Point};
use monolayer::model::incompressible::Incompressible;
use monolayer::model::{Conditions, Description, VelocityCondition, start};

const STRIP: &str =
    "shape = \"strip-with-disc\"\nlength = [-4.0, 6.0]\nwidth = 6.0\nh = 1.0\nh_disc = 0.3\nsymmetric = true";

fn conditions(mesh: &Mesh) -> Vec<Conditions> {
    let open = Conditions::open().with_polarity([formula("1"), formula("0")]);
    mesh.tags.iter().map(|t| if t == "inlet" || t == "outlet" { open.clone() } else { Conditions::slip() }).collect()
}

#[test]
fn the_aligned_start_is_tangential_to_the_disc_and_symmetric() {
    let mesh = mesh(STRIP);
    let (loops, space) = (loops(&mesh), discontinuous(&mesh, 3, 2));
    let p = start::aligned(&loops, &space, &conditions(&mesh), 1.0).unwrap();
    let mut on_disc = 0;
    for face in mesh.faces.iter().filter(|f| f.tag.is_some_and(|t| mesh.tags[t] == "disc")) {
        for local in basis::face_nodes(3, face.minus.face) {
            let xi = basis::nodes(3)[local];
            let (x, value) = (mesh.map(face.minus.cell).at(xi).0, p.vector_at(face.minus.cell, xi));
            assert!(value.dot(&x.normalize()).abs() < 1e-13, "at {x:?}: {value:?}");
            on_disc += usize::from(value.norm() > 0.1);
        }
    }
    assert!(on_disc > 20);
    // it points downstream everywhere but near the disc, and is the unit vector at the inlet
    for cell in 0..mesh.cells.len() {
        let (x, value) = (mesh.centroid(cell), p.vector_at(cell, Point::new(1.0 / 3.0, 1.0 / 3.0)));
        assert!(x.norm() < 1.5 || (value.x > 0.5 && value.norm() < 1.3), "at {x:?}: {value:?}");
        if x.x < -3.5 {
            assert!((value - Point::x()).norm() < 0.1, "at {x:?}: {value:?}");
        }
    }
    let up_down = loops.sum_faces(Faces::BOUNDARY, 6, |s| p.vector(&s.minus).y);
    assert!(up_down.abs() < 1e-10, "{up_down}");
}

#[test]
fn random_starts_depend_on_the_seed_and_not_on_the_mesh() {
    let (coarse, fine) = (mesh("shape = \"disc\"\nh = 0.4"), mesh("shape = \"disc\"\nh = 0.2"));
    let at = |mesh: &std::sync::Arc<Mesh>, seed: u64| {
        let p = start::random(&discontinuous(mesh, 3, 2), seed, 0.1, 0.25).unwrap();
        let loops = loops(mesh);
        [loops.sum(6, |x| p.vector(&x.site).norm_squared()), loops.sum(6, |x| p.vector(&x.site).x)]
    };
    let (a, b, c) = (at(&coarse, 1), at(&fine, 1), at(&fine, 2));
    assert!((a[0] - b[0]).abs() < 0.15 * b[0] && (a[1] - b[1]).abs() < 0.1 * b[0].sqrt(), "{a:?} {b:?}");
    assert!((b[1] - c[1]).abs() > 1e-3, "{b:?} {c:?}");
    // linear interpolation halves the mean square of independent vectors of deviation 0.1
    let mean = b[0] / std::f64::consts::PI;
    assert!(mean > 0.2 * 0.01 && mean < 1.0 * 0.01, "{mean}");
}

#[test]
fn no_tangential_velocity_at_the_nodes_of_such_a_wall() {
    let mesh = mesh("shape = \"annulus\"\nradius = 2.0\ninner_radius = 1.0\nh = 0.5");
    let condition = |tag: &str| match tag {
        "outer" => Conditions::new(VelocityCondition::NoTangential),
        _ => Conditions::slip(),
    };
    let model = Incompressible::new(&mesh, &Description::new(&mesh, PARAMETERS, condition)).unwrap();
    assert!(!model.momentum.is_closed(), "the normal stress fixes the pressure");
    let (v, _) = model.flow(&random(&model.polarity.space, 5), 0.0).unwrap();
    let positions = model.momentum.velocity.node_positions();
    let mut moving = 0;
    for (node, x) in positions.iter().enumerate().filter(|(_, x)| x.norm() > 2.0 - 1e-9) {
        let value = Point::new(v.values[2 * node], v.values[2 * node + 1]);
        assert!(value.perp(&x.normalize()).abs() <= 1e-13 * value.norm());
        moving += usize::from(value.norm() > 1e-6);
    }
    assert!(moving > 10, "{moving}");
}

#[test]
fn exact_normals_point_out_of_the_tissue_along_the_radius() {
    for degree in [1, 2, 3] {
        let mesh = mesh(&format!("{STRIP}\ncurved = {degree}"));
        let loops = loops(&mesh);
        let mut worst = 0.0_f64;
        for (index, face) in mesh.faces.iter().enumerate() {
            if face.tag.is_some_and(|t| mesh.tags[t] == "disc") {
                loops.each_face_point(index, 4, &mut |s| {
                    assert!((s.exact_n + s.minus.x.normalize()).norm() < 1e-13, "into the disc");
                    worst = worst.max((s.exact_n - s.n).norm());
                });
            }
        }
        // the meshed normal approaches the exact one with the geometry's degree
        let bound = [0.2, 5e-3, 1e-3][degree - 1];
        assert!(worst < bound && worst > 0.0, "degree {degree}: {worst}");
    }
}
