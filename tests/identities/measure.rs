use crate::common::*;
use monolayer::measure::{Inlet, Line, Mirror, Overshoot, StreamFunction, cut};
use monolayer::mesh::Point;
use monolayer::mesh::locate::Locator;
use monolayer::space::project;

const STRIP: &str =
    "shape = \"strip-with-disc\"\nlength = [-4.0, 6.0]\nwidth = 6.0\nh = 1.0\nh_disc = 0.4\nsymmetric = true";

#[test]
fn the_stream_function_of_a_curl_is_found_again() {
    // v = (∂₂ψ, −∂₁ψ) with ψ = x² + xy − 2y + y³/3 in P3: exact on straight cells
    let mesh = square(3);
    let loops = loops(&mesh);
    let velocity = continuous(&mesh, 3, 2);
    let v = project::interpolate_vector(&velocity, |x| Point::new(x.x - 2.0 + x.y * x.y, -2.0 * x.x - x.y));
    let stream = StreamFunction::new(&loops, &velocity).unwrap();
    let psi = stream.of(&loops, &v).unwrap();
    let exact = project::interpolate_scalar(&stream.space, |x| x.x * x.x + x.x * x.y - 2.0 * x.y + x.y.powi(3) / 3.0);
    let shift = loops.sum(3, |x| exact.scalar(&x.site)) / mesh.area();
    let error = loops.sum(6, |x| (psi.scalar(&x.site) - exact.scalar(&x.site) + shift).powi(2)).sqrt();
    assert!(error < 1e-12, "{error}");
    assert!(loops.sum(3, |x| psi.scalar(&x.site)).abs() < 1e-12, "mean zero");
}

#[test]
fn asymmetry_vanishes_for_mirrored_fields_and_measures_others() {
    let mesh = mesh(STRIP);
    let (loops, locator) = (loops(&mesh), Locator::new(&mesh));
    let space = discontinuous(&mesh, 2, 2);
    let mirror = Mirror::new(&loops, &locator, 0.0, 4).unwrap();
    let even = project::interpolate_vector(&space, |x| Point::new(x.x + x.y * x.y, x.y * x.x));
    assert!(mirror.asymmetry(&loops, &even) < 1e-9);
    // c = (y, 0): c₁(x) − c₁(x') = 2y
    let odd = project::interpolate_vector(&space, |x| Point::new(x.y, 0.0));
    let exact = loops.sum(4, |x| 4.0 * x.site.x.y * x.site.x.y).sqrt();
    close(mirror.asymmetry(&loops, &odd), exact, exact, 1e-6);
}

#[test]
fn a_domain_without_mirror_image_is_refused() {
    let mesh = mesh("shape = \"disc\"\nh = 0.5\ncentre = [0.0, 0.3]");
    let error = Mirror::new(&loops(&mesh), &Locator::new(&mesh), 0.0, 2).unwrap_err();
    assert!(error.to_string().contains("asymmetry"), "{error}");
}

#[test]
fn the_overshoot_is_the_maximum_on_the_axis() {
    let mesh = mesh(STRIP);
    let locator = Locator::new(&mesh);
    let space = continuous(&mesh, 2, 2);
    // piecewise quadratic interpolation of 1 + 0.03 − 0.01 (x − 3)² is exact on straight cells
    let v = project::interpolate_vector(&space, |x| Point::new(1.03 - 0.01 * (x.x - 3.0).powi(2), 5.0));
    let found = Overshoot::of(&v, &mesh, &locator, (1.0, 6.0), (0.0, 1.0)).unwrap();
    close(found.percent, 3.0, 3.0, 1e-9);
    // of an inflow of 2 the same field is 48.5 percent short
    let short = Overshoot::of(&v, &mesh, &locator, (1.0, 6.0), (0.0, 2.0)).unwrap();
    close(short.percent, -48.5, 3.0, 1e-9);
    close(found.x1, 3.0, 1.0, 1e-3);
}

#[test]
fn the_inlet_is_where_the_axis_enters() {
    let mesh = mesh(STRIP);
    let inlet = Inlet::on(&mesh, 0.0).unwrap();
    assert_eq!((mesh.tags[inlet.tag].as_str(), inlet.x), ("inlet", Point::new(-4.0, 0.0)));
    let v = project::interpolate_vector(&continuous(&mesh, 2, 2), |x| Point::new(2.0 + x.y, 1.0));
    assert_eq!(inlet.value(&v, &mesh, &Locator::new(&mesh)), Some(2.0));
    assert!(Inlet::on(&mesh, 100.0).is_none());
}

#[test]
fn cuts_skip_the_obstacle_and_average_the_sides_of_faces() {
    let mesh = mesh(STRIP);
    let locator = Locator::new(&mesh);
    let line = Line { name: "axis".into(), from: Point::new(-4.0, 0.0), to: Point::new(6.0, 0.0), points: 101 };
    let samples = line.samples(&mesh, &locator);
    assert!(samples.iter().all(|s| s.x.norm() > 0.999));
    assert!(samples.len() > 70 && samples.len() < 90, "{}", samples.len());
    // on the symmetric mesh the axis consists of faces: a field that is the side's sign averages to zero
    let mut sign = random(&discontinuous(&mesh, 1, 1), 0);
    for cell in 0..mesh.cells.len() {
        for i in 0..3 {
            let dof = sign.space.dof(cell, 0, i);
            sign.values[dof] = mesh.centroid(cell).y.signum();
        }
    }
    for sample in samples.iter().filter(|s| s.x.x.abs() > 1.01) {
        assert!(cut::value(&sign, &sample.at, 0).abs() < 1e-14, "at {:?}", sample.x);
    }
    // many columns at once are the same bits
    let v = random(&continuous(&mesh, 3, 2), 1);
    let columns = cut::Columns::new(vec![(&v, 1), (&sign, 0), (&v, 0)]);
    let mut bases = cut::Bases::default();
    for sample in &samples {
        let mut read = Vec::new();
        columns.read(&sample.at, &mut bases, |value| read.push(value));
        let one = |field, c| cut::value(field, &sample.at, c);
        assert_eq!(read, [one(&v, 1), one(&sign, 0), one(&v, 0)]);
    }
}
