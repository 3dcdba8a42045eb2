//! Generated meshes: topology, area, tags, quality, symmetry, determinism, refinement, and refusals.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use monolayer::mesh::generate::{GENERATORS, MeshScene};
use monolayer::mesh::{Curve, Mesh, MeshError, Point};

const REFERENCE: &str = "shape = 'strip-with-disc'\nlength = [-30.0, 50.0]\nwidth = 10.0\nh = 1.0\nh_disc = 0.13\n";
const RACETRACK: &str =
    "shape = 'racetrack'\narm = 10.0\nturn_radius = 6.0\nwidth = 6.0\nh = 0.9\nh_disc = 0.2\ngrading = 0.3\n";
/// The same band without discs.
const EMPTY_TRACK: &str = "shape = 'racetrack'\ndiscs = 0\narm = 10.0\nturn_radius = 6.0\nwidth = 6.0\nh = 0.9\n";

/// Isotropic scenes of every unstructured shape with their number of holes and exact area.
fn isotropic() -> Vec<(String, isize, f64)> {
    let racetrack = 2.0 * 10.0 * 6.0 + PI * (81.0 - 9.0) - TAU;
    let shapes = [
        (REFERENCE.to_owned(), 1, 800.0 - PI),
        (REFERENCE.replace("10.0", "2.6"), 1, 80.0 * 2.6 - PI),
        (RACETRACK.to_owned(), 3, racetrack),
        (EMPTY_TRACK.to_owned(), 1, racetrack + TAU),
        ("shape = 'strip'\nlength = [-1.0, 4.0]\nwidth = 2.0\nh = 0.2\n".to_owned(), 0, 10.0),
        ("shape = 'disc'\nradius = 2.0\ncentre = [0.5, 0.0]\nh = 0.3\n".to_owned(), 0, 4.0 * PI),
        ("shape = 'annulus'\nradius = 2.0\ninner_radius = 0.5\nh = 0.2\n".to_owned(), 1, 3.75 * PI),
    ];
    let with = |(scene, holes, area): (String, isize, f64)| {
        [false, true].map(|s| (format!("{scene}symmetric = {s}\n"), holes, area))
    };
    shapes.into_iter().flat_map(with).collect()
}

fn scene(text: &str) -> MeshScene {
    toml::from_str(text).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn mesh(text: &str) -> Mesh {
    scene(text).build().unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn bits(mesh: &Mesh) -> Vec<[u64; 2]> {
    mesh.vertices.iter().map(|x| [x.x.to_bits(), x.y.to_bits()]).collect()
}

/// Bits of positions, sorted.
type Corners = Vec<[u64; 2]>;

/// Positions of the corners of every cell and of every boundary face with its tag, as sets; `flip` mirrors them.
fn content(mesh: &Mesh, flip: bool) -> (BTreeSet<Corners>, BTreeSet<(Corners, usize)>) {
    let at = |v: usize| {
        let x = mesh.vertices[v];
        let y = if flip && x.y != 0.0 { -x.y } else { x.y };
        [x.x.to_bits(), y.to_bits()]
    };
    let sorted = |vertices: &[usize]| {
        let mut all: Vec<_> = vertices.iter().map(|&v| at(v)).collect();
        all.sort_unstable();
        all
    };
    let cells = mesh.cells.iter().map(|c| sorted(c)).collect();
    let faces = mesh.faces.iter().filter_map(|f| Some((sorted(&mesh.face_vertices(f)), f.tag?)));
    (cells, faces.collect())
}

fn assert_mirrored(mesh: &Mesh, name: &str) {
    assert!(content(mesh, false) == content(mesh, true), "{name}: not its own mirror image");
}

/// Vertices − faces + cells.
fn euler(mesh: &Mesh) -> isize {
    mesh.vertices.len() as isize - mesh.faces.len() as isize + mesh.cells.len() as isize
}

fn length(mesh: &Mesh, face: &monolayer::mesh::Face) -> f64 {
    let [a, b] = mesh.face_vertices(face).map(|v| mesh.vertices[v]);
    (b - a).norm()
}

#[test]
fn euler_characteristic_counts_the_holes() {
    for (text, holes, _) in isotropic() {
        assert_eq!(euler(&mesh(&text)), 1 - holes, "{text}");
    }
    assert_eq!(euler(&mesh("shape = 'square'\nn = 5\ndistortion = 0.3")), 1);
}

#[test]
fn area_is_that_of_the_domain() {
    for (text, _, exact) in isotropic() {
        let error = mesh(&text).area() / exact - 1.0;
        assert!(error.abs() < 2e-6, "{text}: relative error of the area {error:.2e}");
    }
}

#[test]
fn area_converges_with_the_degree_of_the_geometry() {
    for (degree, order) in [(1, 2.0), (2, 4.0), (3, 4.0)] {
        let errors = [0.4_f64, 0.2, 0.1].map(|h| {
            let area = mesh(&format!("shape = 'disc'\nh = {h}\ncurved = {degree}")).area();
            (h.ln(), (area / PI - 1.0).abs().ln())
        });
        let slope = (errors[0].1 - errors[2].1) / (errors[0].0 - errors[2].0);
        assert!((slope - order).abs() < 0.3, "degree {degree}: order {slope:.2}, expected {order}; {errors:?}");
    }
}

#[test]
fn tags_lie_where_they_belong() {
    let on = |value: f64, wanted: f64| (value - wanted).abs() < 1e-12;
    for symmetric in [false, true] {
        let strip = mesh(&format!("{REFERENCE}symmetric = {symmetric}"));
        for face in strip.faces.iter().filter(|f| f.plus.is_none()) {
            let ends = strip.face_vertices(face).map(|v| strip.vertices[v]);
            let right = |x: Point| match strip.tags[face.tag.expect("a tag")].as_str() {
                "inlet" => x.x == -30.0,
                "outlet" => x.x == 50.0,
                "walls" => x.y.abs() == 5.0,
                "disc" => on(x.norm(), 1.0),
                other => panic!("tag {other}"),
            };
            assert!(ends.into_iter().all(right), "{ends:?}");
        }
        for (name, exact) in [("inlet", 10.0), ("outlet", 10.0), ("walls", 160.0)] {
            let total: f64 = strip.faces.iter().filter(|f| f.tag == strip.tag(name)).map(|f| length(&strip, f)).sum();
            assert!((total - exact).abs() < 1e-10, "{name}: {total}");
        }
    }
    let track = mesh(RACETRACK);
    for face in track.faces.iter().filter(|f| f.plus.is_none()) {
        for x in track.face_vertices(face).map(|v| track.vertices[v]) {
            // distance from the segment between the centres of the half rings
            let reach = Point::new((x.x.abs() - 5.0).max(0.0), x.y).norm();
            let right = match track.tags[face.tag.expect("a tag")].as_str() {
                "outer" => on(reach, 9.0),
                "inner" => on(reach, 3.0),
                "disc" => on((Point::new(x.x, x.y.abs()) - Point::new(0.0, 6.0)).norm(), 1.0),
                other => panic!("tag {other}"),
            };
            assert!(right, "{x:?}");
        }
    }
    let names = |text: &str| mesh(text).tags;
    assert_eq!(names("shape = 'disc'\nh = 0.5"), ["wall"]);
    assert_eq!(names("shape = 'annulus'\nh = 0.3\ninner_radius = 0.4"), ["inner", "outer"]);
    assert_eq!(names("shape = 'strip'\nh = 0.5\nlength = [0.0, 1.0]\nwidth = 1.0"), ["inlet", "outlet", "walls"]);
}

#[test]
fn square_is_structured_and_tagged() {
    let square = mesh("shape = 'square'\nn = 4\nlength = [-1.0, 3.0]");
    assert_eq!((square.cells.len(), square.vertices.len()), (32, 25));
    assert!((0..32).all(|c| square.cell_area(c) == 0.5));
    for (name, axis, value) in [("left", 0, -1.0), ("right", 0, 3.0), ("bottom", 1, -1.0), ("top", 1, 3.0)] {
        let side: Vec<_> = square.faces.iter().filter(|f| f.tag == square.tag(name)).collect();
        assert_eq!(side.len(), 4, "{name}");
        let at =
            |f: &&monolayer::mesh::Face| square.face_vertices(f).iter().all(|&v| square.vertices[v][axis] == value);
        assert!(side.iter().all(at), "{name}");
    }
}

#[test]
fn distortion_is_seeded_and_stays_within_its_bound() {
    let plain = mesh("shape = 'square'\nn = 8");
    let one = mesh("shape = 'square'\nn = 8\ndistortion = 0.3\nseed = 1");
    let two = mesh("shape = 'square'\nn = 8\ndistortion = 0.3\nseed = 2");
    assert_ne!(bits(&one), bits(&two));
    assert_eq!(bits(&one), bits(&mesh("shape = 'square'\nn = 8\ndistortion = 0.3\nseed = 1")));
    let moved = plain.vertices.iter().zip(&one.vertices).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
    assert!(moved > 0.02 && moved <= 0.3 / 8.0, "{moved}");
    assert!((one.area() - 1.0).abs() < 1e-13);
}

#[test]
fn angles_are_wide_and_edges_follow_the_size() {
    for (text, ..) in isotropic() {
        let (mesh, scene) = (mesh(&text), scene(&text).defaults_filled());
        let quality = mesh.quality();
        assert!(quality.worst_angle_degrees.value > 28.0, "{text}{quality}");
        let turn = scene.get("turn_radius").unwrap_or(0.0);
        let [h, h_disc, grading] = ["h", "h_disc", "grading"].map(|key| scene.get::<f64>(key));
        let wanted = |x: Point| match (h, h_disc, grading) {
            (Some(h), Some(h_disc), Some(grading)) => {
                let distance = (Point::new(x.x, x.y.abs()) - Point::new(0.0, turn)).norm() - 1.0;
                h.min(h_disc + grading * distance.max(0.0))
            }
            (h, ..) => h.expect("a size"),
        };
        let ratio = |f: &monolayer::mesh::Face| {
            let [a, b] = mesh.face_vertices(f).map(|v| mesh.vertices[v]);
            (b - a).norm() / wanted((a + b) * 0.5)
        };
        let mean = mesh.faces.iter().map(ratio).sum::<f64>() / mesh.faces.len() as f64;
        assert!((mean - 1.0).abs() < 0.1, "{text}mean ratio {mean:.3}");
    }
}

#[test]
fn reference_scenes_have_the_number_of_cells_they_promise() {
    for (h, h_disc, grading, wanted) in [
        (1.9, 0.25, 0.28, 800.0),
        (1.33, 0.175, 0.2, 1650.0),
        (1.0, 0.13, 0.15, 3000.0),
        (0.7, 0.095, 0.11, 5800.0),
        (0.49, 0.064, 0.074, 12000.0),
    ] {
        let text = format!(
            "shape = 'strip-with-disc'\nlength = [-30, 50]\nwidth = 10\nh = {h}\nh_disc = {h_disc}\ngrading = {grading}"
        );
        let cells = mesh(&text).cells.len() as f64;
        assert!((cells / wanted - 1.0).abs() < 0.07, "{h}: {cells} cells, wanted about {wanted}");
    }
}

#[test]
fn symmetric_meshes_are_their_own_mirror_image() {
    for (text, ..) in isotropic().into_iter().filter(|(text, ..)| text.contains("symmetric = true")) {
        let mesh = mesh(&text);
        assert_mirrored(&mesh, &text);
        assert!(mesh.vertices.iter().filter(|x| x.y == 0.0).count() > 2, "{text}: no vertices on the axis");
    }
    let stretched = mesh(&format!("{REFERENCE}symmetric = true\nstretch = 6.0"));
    assert_mirrored(&stretched, "stretched");
}

#[test]
fn curved_cells_of_symmetric_meshes_are_mirrored_to_rounding() {
    let mesh = mesh(&format!("{RACETRACK}symmetric = true"));
    let half = mesh.cells.len() / 2;
    let mut curved = 0;
    for cell in 0..half {
        let (Some(upper), Some(lower)) = (&mesh.curved[cell], &mesh.curved[cell + half]) else {
            assert_eq!(mesh.curved[cell].is_some(), mesh.curved[cell + half].is_some());
            continue;
        };
        curved += 1;
        for x in &upper.positions {
            let image = Point::new(x.x, -x.y);
            let nearest = lower.positions.iter().map(|y| (y - image).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1e-13, "cell {cell}: {nearest:.1e}");
        }
    }
    assert!(curved > 50, "{curved} curved cells");
}

#[test]
fn same_scene_same_bits() {
    for (text, ..) in isotropic() {
        let (one, two) = (mesh(&text), mesh(&text));
        assert_eq!(bits(&one), bits(&two), "{text}");
        assert_eq!(one.cells, two.cells, "{text}");
    }
}

#[test]
fn curved_faces_lie_on_their_circles() {
    for (text, ..) in isotropic().into_iter().filter(|(text, ..)| !text.contains("'strip'")) {
        let mesh = mesh(&text);
        let mut count = 0;
        for face in &mesh.faces {
            let Some(curve) = face.curve else { continue };
            count += 1;
            let Curve::Circle { centre, radius } = mesh.curves[curve];
            for v in mesh.face_vertices(face) {
                let off = ((mesh.vertices[v] - centre).norm() - radius).abs();
                assert!(off < 4e-15 * radius.max(centre.norm()), "{text}: {off:.1e}");
            }
        }
        assert!(count >= 20 && mesh.quality().degree == 3, "{text}: {count} curved faces");
    }
}

#[test]
fn stretched_strips_are_valid_up_to_1000() {
    for (text, exact, stretch) in [
        ("shape='strip'\nlength=[0.0, 300.0]\nwidth=2.0\nh=0.2\nstretch=30.0", 600.0, 30.0),
        ("shape='strip'\nlength=[-1e3, 5e3]\nwidth=2.0\nh=0.2\nstretch=1000.0\nsymmetric=true", 12e3, 1000.0),
        ("shape='strip-with-disc'\nlength=[-300, 500]\nwidth=10\nh=1\nh_disc=0.2\nstretch=10", 8e3 - PI, 10.0),
        ("shape='strip-with-disc'\nlength=[-3e4, 5e4]\nwidth=10\nh=1\nh_disc=0.2\nstretch=1000", 8e5 - PI, 1000.0),
    ] {
        let mesh = mesh(text);
        let quality = mesh.quality();
        // Cells are counterclockwise, so that overlaps would show in the sum of the areas.
        assert!((mesh.area() / exact - 1.0).abs() < 1e-8, "{text}: {}", mesh.area());
        let reached = quality.worst_stretch.value / stretch;
        assert!((0.8..2.6).contains(&reached), "{text}: stretch {}", quality.worst_stretch);
        let scene = scene(text);
        let [x0, x1]: [f64; 2] = scene.get("length").expect("a length");
        let ends = mesh.vertices.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x.x), b.max(x.x)]);
        assert_eq!(ends, [x0, x1], "{text}");
    }
}

#[test]
fn stretch_leaves_the_disc_isotropic() {
    let mesh = mesh(&format!("{REFERENCE}stretch = 100.0").replace("[-30.0, 50.0]", "[-3e3, 5e3]"));
    let mut near = 0;
    for cell in (0..mesh.cells.len()).filter(|&c| mesh.centroid(c).norm() < 3.0) {
        let [a, b, c] = mesh.corners(cell);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        assert!(longest * longest / (b - a).perp(&(c - a)) < 3.0);
        near += 1;
    }
    assert!(near > 500, "{near}");
}

#[test]
fn refinement_keeps_everything_and_doubles_the_boundary() {
    for (text, ..) in isotropic() {
        let coarse = mesh(&text);
        let fine = coarse.refined().expect("a refined mesh");
        assert_eq!(fine.cells.len(), 4 * coarse.cells.len());
        assert_eq!(fine.vertices.len(), coarse.vertices.len() + coarse.faces.len());
        assert_eq!(euler(&fine), euler(&coarse));
        let (before, after) = (coarse.quality(), fine.quality());
        assert_eq!(before.degree, after.degree);
        for ((name, few), (same, many)) in before.tags.iter().zip(&after.tags) {
            assert_eq!((name, 2 * few), (same, *many));
        }
        if text.contains("symmetric = true") {
            assert_mirrored(&fine, &text);
        }
        for face in &fine.faces {
            let Some(curve) = face.curve else { continue };
            let Curve::Circle { centre, radius } = fine.curves[curve];
            for v in fine.face_vertices(face) {
                assert!(((fine.vertices[v] - centre).norm() - radius).abs() < 1e-14 * (radius + centre.norm()));
            }
        }
    }
}

#[test]
fn refinement_brings_the_area_to_the_circle_with_order_four() {
    let coarse = mesh("shape = 'disc'\nh = 0.4");
    let error = |mesh: &Mesh| (mesh.area() / PI - 1.0).abs();
    let fine = coarse.refined().expect("a refined mesh");
    let ratio = error(&coarse) / error(&fine);
    assert!((13.0..19.0).contains(&ratio), "{ratio:.2}");
}

#[test]
fn quality_of_a_known_mesh() {
    let square = mesh("shape = 'square'\nn = 1\nlength = [0.0, 2.0]");
    let quality = square.quality();
    assert_eq!((quality.cells, quality.vertices, quality.faces, quality.boundary_faces), (2, 4, 5, 4));
    assert_eq!((quality.curved_cells, quality.degree, quality.area), (0, 1, 4.0));
    let diagonal = 8f64.sqrt();
    assert!((quality.h_min - diagonal).abs() < 1e-14 && (quality.h_max - diagonal).abs() < 1e-14);
    assert!((quality.worst_angle_degrees.value - 45.0).abs() < 1e-12);
    assert!((quality.worst_stretch.value - 2.0).abs() < 1e-14);
    let report = quality.to_string();
    for words in ["cells           2", "left", "area            4.0", "smallest angle  45.0000 (cell "] {
        assert!(report.contains(words), "{words} is not in\n{report}");
    }
}

#[test]
fn defaults_filled_names_what_applies_and_changes_nothing() {
    let full = scene(REFERENCE).defaults_filled();
    let numbers = ["radius", "grading", "stretch", "distortion", "inner_radius", "arm"].map(|key| full.get(key));
    assert_eq!(numbers, [Some(1.0), Some(0.15), Some(1.0), None, None, None]);
    assert_eq!(["curved", "n", "seed"].map(|key| full.get::<usize>(key)), [Some(3), None, None]);
    assert_eq!((full.get("centre"), full.get("symmetric")), (Some([0.0; 2]), Some(false)));
    for (text, ..) in isotropic() {
        let full = scene(&text).defaults_filled();
        assert_eq!(full, full.defaults_filled(), "{text}");
        let written = toml::to_string(&full).expect("TOML");
        assert_eq!(bits(&mesh(&written)), bits(&mesh(&text)), "{text}");
    }
    let file = scene("file = 'a.msh'");
    assert_eq!(file, file.defaults_filled());
}

#[test]
fn every_generator_is_in_the_docs_and_agrees_with_the_others_on_its_keys() {
    let docs = include_str!("../../docs/scene.md");
    let row = |name: &str| docs.contains(&format!("| `{name}` |"));
    for generator in &GENERATORS {
        assert!(row(generator.name), "docs/scene.md has no row of the shape {}", generator.name);
        for key in generator.keys {
            let (shape, name) = (generator.name, key.name);
            assert!(row(name), "docs/scene.md has no row of the key {name} of {shape}");
            assert!(!key.about.is_empty(), "{shape}: {name} says nothing of itself");
            let same = GENERATORS.iter().filter_map(|other| other.key(name)).all(|other| other.kind == key.kind);
            assert!(same, "{name} of {shape} takes other values elsewhere");
        }
    }
}

#[test]
fn keys_of_one_shape_come_in_its_own_order() {
    for generator in &GENERATORS {
        let full = MeshScene::of(generator.name).defaults_filled();
        let written: toml::Table = toml::to_string(&full).expect("TOML").parse().expect("a table");
        let given = generator.keys.iter().map(|key| key.name).filter(|key| written.contains_key(*key));
        let text = toml::to_string(&full).expect("TOML");
        let lines: Vec<&str> = text.lines().skip(1).filter_map(|line| line.split(" = ").next()).collect();
        assert_eq!(lines, given.collect::<Vec<_>>(), "{}", generator.name);
    }
}

#[test]
fn an_l_is_a_square_without_a_quarter() {
    for h in [0.4, 0.2, 0.05] {
        let l = mesh(&format!("shape = 'l-shape'\nlength = [-1.0, 1.0]\nh = {h}"));
        assert!((l.area() - 3.0).abs() < 1e-12, "h = {h}: {}", l.area());
        assert_eq!((l.tags.as_slice(), euler(&l)), (&["wall".to_owned()][..], 1));
        assert!(l.vertices.contains(&Point::zeros()), "h = {h}: no vertex in the corner");
        assert!(!l.vertices.iter().any(|x| x.x > 0.0 && x.y > 0.0), "h = {h}: the quarter is there");
        let walls: f64 = l.faces.iter().filter(|face| face.tag.is_some()).map(|face| length(&l, face)).sum();
        assert!((walls - 8.0).abs() < 1e-12, "h = {h}: {walls}");
        let quality = l.quality();
        assert!(quality.worst_angle_degrees.value > 28.0, "h = {h}: {quality}");
    }
    let unit = scene("shape = 'l-shape'\nh = 0.05");
    let (cells, expected) = (unit.build().expect("a mesh").cells.len() as f64, unit.expected().expect("a number"));
    assert!((cells / expected - 1.0).abs() < 0.1, "{cells} cells, expected {expected}");
    assert_eq!(unit.bounds(), Some([[0.0, 1.0]; 2]));
}

/// Scene, key that is blamed, words of the rule.
const WRONG: &[(&str, &str, &str)] = &[
    ("n = 3", "shape", "generated from its shape"),
    ("shape='square'", "n", "needs it"),
    ("shape='square'\nn=0", "n", "at least 1"),
    ("shape='square'\nn=1600", "n", "5 million"),
    ("shape='square'\nn=4\ndistortion=0.31", "distortion", "0 to 0.3"),
    ("shape='square'\nn=4\ndistortion=-0.1", "distortion", "0 to 0.3"),
    ("shape='square'\nn=4\nlength=[1.0, 1.0]", "length", "smaller than the second"),
    ("shape='square'\nn=4\nlength=[nan, 1.0]", "length", "finite"),
    ("shape='square'\nn=4\nh=0.1", "h", "no such key"),
    ("shape='square'\nn=4\nfile='a.msh'", "file", "no such key"),
    ("shape='strip'\nwidth=1.0\nh=0.1", "length", "needs it"),
    ("shape='strip'\nlength=[0.0, 1.0]\nh=0.1", "width", "needs it"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=1.0", "h", "needs it"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=1.0\nh=0.1\nradius=1.0", "radius", "no such key"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=1.0\nh=0.1\ncurved=2", "curved", "no such key"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=-1.0\nh=0.1", "width", "positive"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=inf\nh=0.1", "width", "positive"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=1.0\nh=nan", "h", "positive"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=1.0\nh=0.0", "h", "positive"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=1.0\nh=0.0003", "h", "5 million"),
    ("shape='strip'\nlength=[0.0, 9.0]\nwidth=1.0\nh=2.0", "h", "width = 1.0"),
    ("shape='strip'\nlength=[0.0, 1.0]\nwidth=9.0\nh=2.0", "h", "length 1.0"),
    ("shape='strip'\nlength=[0.0, 9.0]\nwidth=1.0\nh=0.6\nsymmetric=true", "h", "half the width"),
    ("shape='strip'\nlength=[0.0, 1e9]\nwidth=1.0\nh=0.5", "h", "coincide"),
    ("shape='strip'\nlength=[0.0, 9.0]\nwidth=1.0\nh=0.1\nstretch=0.5", "stretch", "1 to 1000"),
    ("shape='strip'\nlength=[0.0, 9.0]\nwidth=1.0\nh=0.1\nstretch=1001.0", "stretch", "1 to 1000"),
    ("shape='strip'\nlength=[0.0, 9.0]\nwidth=1.0\nh=0.1\nstretch=100.0", "stretch", "must fit into the length"),
    ("shape='disc'\nh=2.0", "h", "radius = 1.0"),
    ("shape='disc'\nh=0.2\ncurved=4", "curved", "1, 2 or 3"),
    ("shape='disc'\nh=0.2\ncurved=0", "curved", "1, 2 or 3"),
    ("shape='disc'\nh=0.2\ncentre=[0.0, 1.0]\nsymmetric=true", "centre", "x₂ = 0"),
    ("shape='disc'\nh=0.2\ncentre=[inf, 1.0]", "centre", "finite"),
    ("shape='annulus'\nh=0.1", "inner_radius", "needs it"),
    ("shape='annulus'\nh=0.1\ninner_radius=1.0", "inner_radius", "smaller than radius"),
    ("shape='annulus'\nh=0.1\ninner_radius=0.95", "h", "radius - inner_radius"),
    ("shape='annulus'\nh=0.1\ninner_radius=0.05", "h", "inner_radius = 0.05"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=1.9\nh=0.5", "radius", "touch the upper wall"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=4\nh=0.5\ncentre=[0,-1.5]", "radius", "touch the lower wall"),
    ("shape='strip-with-disc'\nlength=[-1,9]\nwidth=4\nh=0.5", "radius", "touch the inlet"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=4\nh=0.5\ncentre=[20,0]", "radius", "touch the outlet"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=2.2\nh=0.5\nh_disc=0.2", "h_disc", "gap 0.1000"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=9\nh=2.0", "h_disc", "radius = 1.0"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=9\nh=0.5\nh_disc=0.6", "h_disc", "exceed h = 0.5"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=9\nh=0.5\nh_disc=1e-5\ngrading=0.01", "h_disc", "5 million"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=9\nh=0.5\ngrading=0.0", "grading", "0.001 to 1"),
    ("shape='strip-with-disc'\nlength=[-9,9]\nwidth=9\nh=0.5\ngrading=nan", "grading", "0.001 to 1"),
    ("shape='racetrack'\narm=5\nturn_radius=2\nwidth=4\nh=0.5", "turn_radius", "no hole"),
    ("shape='racetrack'\narm=1\nturn_radius=5\nwidth=4\nh=0.5", "arm", "straight part"),
    ("shape='racetrack'\narm=5\nturn_radius=5\nwidth=2\nh=0.5", "radius", "touch the band's walls"),
    ("shape='racetrack'\narm=5\nturn_radius=2.1\nwidth=4\nh=0.5", "h", "turn_radius - width/2"),
    ("shape='racetrack'\narm=5\nturn_radius=5\nwidth=4\nh=0.5\nstretch=2.0", "stretch", "no such key"),
    ("shape='racetrack'\narm=5\nturn_radius=5\nwidth=4\nh=0.5\ndiscs=3", "discs", "0, 1 or 2"),
    (
        "shape='racetrack'\narm=5\nturn_radius=5\nwidth=4\nh=0.5\ndiscs=1\nsymmetric=true",
        "discs",
        "both arms or in none",
    ),
    ("shape='racetrack'\narm=5\nturn_radius=5\nwidth=4\nh=0.5\ndiscs=0\nradius=0.5", "radius", "discs = 0"),
    ("shape='racetrack'\narm=5\nturn_radius=5\nwidth=4\nh=0.5\ndiscs=0\nh_disc=0.1", "h_disc", "discs = 0"),
    ("shape='racetrack'\narm=0.3\nturn_radius=5\nwidth=4\nh=0.5\ndiscs=0", "h", "arm = 0.3"),
    ("shape='disc'\nh=0.5\ndiscs=1", "discs", "no such key"),
    ("shape='l-shape'\nlength=[0.0, 1.0]", "h", "needs it"),
    ("shape='l-shape'\nh=0.6", "h", "half the length = 0.5"),
    ("shape='l-shape'\nh=0.0005", "h", "5 million"),
    ("shape='l-shape'\nh=0.1\nwidth=0.5", "width", "no such key"),
];

#[test]
fn a_racetrack_has_as_many_discs_as_are_asked_for() {
    let band = 2.0 * 10.0 * 6.0 + PI * (81.0 - 9.0);
    for (discs, tags) in
        [(0, &["outer", "inner"][..]), (1, &["outer", "inner", "disc"]), (2, &["outer", "inner", "disc"])]
    {
        let text = if discs == 0 { EMPTY_TRACK.to_owned() } else { format!("{RACETRACK}discs = {discs}") };
        let mesh = mesh(&text);
        assert_eq!(mesh.tags, tags, "{text}");
        // circles of cubic edges are off by their sixth order
        let exact = band - discs as f64 * PI;
        assert!((mesh.area() - exact).abs() < 1e-5 * exact, "{text}: {} and {exact}", mesh.area());
        let on_disc = |f: &&monolayer::mesh::Face| f.tag.is_some() && f.tag == mesh.tag("disc");
        let ends = mesh.faces.iter().filter(on_disc).flat_map(|f| mesh.face_vertices(f));
        let heights: Vec<f64> = ends.map(|v| mesh.vertices[v].y).collect();
        assert_eq!(heights.iter().any(|y| *y > 0.0), discs > 0);
        assert_eq!(heights.iter().any(|y| *y < 0.0), discs > 1);
    }
    let full = mesh(&format!("{RACETRACK}discs = 2"));
    assert_eq!(bits(&full), bits(&mesh(RACETRACK)), "two discs are the default");
}

#[test]
fn the_way_around_a_racetrack_follows_arms_and_turns() {
    let track = scene(EMPTY_TRACK).track().expect("a racetrack has a way around");
    let half = 0.5_f64.sqrt();
    for (x, along) in [
        ([0.0, 6.0], [-1.0, 0.0]),
        ([-4.9, 5.0], [-1.0, 0.0]),
        ([4.0, -7.0], [1.0, 0.0]),
        ([12.0, 0.0], [0.0, 1.0]),
        ([-9.0, 0.0], [0.0, -1.0]),
        ([5.0 + 6.0 * half, 6.0 * half], [-half, half]),
        ([0.0, 0.0], [0.0, 0.0]),
    ] {
        assert!((track.tangent(Point::from(x)) - Point::from(along)).norm() < 1e-15, "{x:?}");
    }
    assert!(scene(REFERENCE).track().is_none());
    let ring = scene("shape = 'annulus'\ninner_radius = 0.5\nradius = 2.0\ncentre = [1.0, 0.0]\nh = 0.3").track();
    assert_eq!(ring.expect("a ring has a way around").tangent(Point::new(2.0, 0.0)), Point::new(0.0, 1.0));
}

#[test]
fn wrong_scenes_are_refused_with_key_value_rule_and_hint() {
    for (text, wanted, words) in WRONG {
        match scene(text).build() {
            Err(MeshError::BadKey { key, value, rule, hint }) => {
                assert_eq!(key, format!("mesh.{wanted}"), "{text}: {rule}");
                assert!(rule.contains(words), "{text}: {rule}");
                assert!(!value.is_empty() && hint.len() > 8, "{text}: {value}, {hint}");
            }
            Err(other) => panic!("{text}: {other}"),
            Ok(_) => panic!("{text}: was accepted"),
        }
    }
}
