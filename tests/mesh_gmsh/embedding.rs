//! Folds, overlaps and cuts are refused wherever a mesh comes from; parts that are really apart are counted.

use monolayer::mesh::gmsh::{Reading, read_as};
use monolayer::mesh::{BoundaryEdge, Mesh, MeshError, Point, Slits};

use super::sample::{Form, Sample, VERSIONS};
use super::{complaint, hand, scratch};

/// A mesh of straight cells; every edge of one cell alone is tagged `wall`.
fn build(vertices: &[[f64; 2]], cells: &[[usize; 3]]) -> Result<Mesh, MeshError> {
    let mut count = std::collections::BTreeMap::<[usize; 2], usize>::new();
    for cell in cells {
        (0..3)
            .map(|k| [cell[k], cell[(k + 1) % 3]])
            .for_each(|[a, b]| *count.entry([a.min(b), a.max(b)]).or_default() += 1);
    }
    let outer = count.into_iter().filter(|(_, n)| *n == 1);
    let boundary: Vec<_> = outer.map(|(vertices, _)| BoundaryEdge { vertices, tag: 0, curve: None }).collect();
    let vertices = vertices.iter().copied().map(Point::from).collect();
    Mesh::build(vertices, cells.to_vec(), &boundary, vec!["wall".to_owned()], Vec::new())
}

/// Rectangles of `n` squares each, none of which shares a node with another one.
fn rectangles(places: &[([f64; 2], [f64; 2], usize)]) -> (Vec<[f64; 2]>, Vec<[usize; 3]>) {
    let (mut vertices, mut cells) = (Vec::new(), Vec::new());
    for &([x, y], [width, height], n) in places {
        let first = vertices.len();
        for k in 0..=n {
            let along = y + height * k as f64 / n as f64;
            vertices.extend([[x, along], [x + width, along]]);
        }
        for k in 0..n {
            let a = first + 2 * k;
            cells.extend([[a, a + 1, a + 3], [a, a + 3, a + 2]]);
        }
    }
    (vertices, cells)
}

fn refused(vertices: &[[f64; 2]], cells: &[[usize; 3]]) -> String {
    build(vertices, cells).expect_err("accepted").to_string()
}

const FOLDED: ([[f64; 2]; 5], [[usize; 3]; 4]) =
    ([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.5, 0.5]], [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]);

#[test]
fn a_fold_is_refused_with_its_face() {
    let text = refused(&FOLDED.0, &FOLDED.1);
    assert!(
        text.contains("folded at the edge from") && text.contains("(1.5000, 0.5000)") && text.contains("hint"),
        "{text}"
    );
    let mut sample = Sample::rectangle(1, 0.0);
    sample.nodes = FOLDED.0.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
    sample.triangles = FOLDED.1.iter().map(|cell| (1, cell.iter().map(|v| v + 1).collect())).collect();
    sample.lines = [[1, 2], [2, 3], [3, 4], [4, 1]].into_iter().zip(1..).map(|(ends, e)| (e, ends.to_vec())).collect();
    for version in VERSIONS {
        assert!(complaint(&sample.bytes(version, Form::Text)).contains("folded at the edge"), "{version:?}");
    }
    // all cells clockwise are one mesh seen from behind
    let mut flat = FOLDED.0;
    flat[4] = [0.5, 0.5];
    let turned = FOLDED.1.map(|[a, b, c]| [a, c, b]);
    assert_eq!(build(&flat, &turned).unwrap().area(), 1.0);
}

/// A node anywhere outside of its star folds the mesh, a node inside does not.
#[test]
fn every_place_of_a_node_is_a_mesh_or_a_fold() {
    for k in 0..400 {
        let x = [-0.975 + 0.15 * f64::from(k % 20), -0.985 + 0.15 * f64::from(k / 20)];
        let mut vertices = FOLDED.0;
        vertices[4] = x;
        let inside = x.iter().all(|c| (0.0..1.0).contains(c));
        assert_eq!(build(&vertices, &FOLDED.1).is_ok(), inside, "{x:?}");
    }
}

#[test]
fn a_mesh_that_goes_round_twice_is_refused() {
    // about an inner vertex
    let ring =
        |k: usize| [(k as f64 * 1.3).cos() * (1.0 + 0.01 * k as f64), (k as f64 * 1.3).sin() * (1.0 + 0.01 * k as f64)];
    let n = 10;
    let vertices: Vec<[f64; 2]> = (0..n).map(ring).chain([[0.0, 0.0]]).collect();
    let cells: Vec<[usize; 3]> = (0..n).map(|k| [n, k, (k + 1) % n]).collect();
    let text = refused(&vertices, &cells);
    assert!(text.contains("angles of the cells around this vertex add up to 7"), "{text}");
    // a band around a hole, on itself or growing out of its own way
    for (growth, turns, good) in
        [(0.0, 0.9, true), (0.0, 1.25, false), (0.3, 1.25, false), (1.5, 1.25, true), (1.5, 2.5, true)]
    {
        let m = 60;
        let at = |k: usize, wide: f64| {
            let angle = std::f64::consts::TAU * turns * k as f64 / m as f64;
            let radius = 1.0 + wide + growth * angle / std::f64::consts::TAU;
            [radius * angle.cos(), radius * angle.sin()]
        };
        let vertices: Vec<[f64; 2]> = (0..=m).flat_map(|k| [at(k, 0.0), at(k, 1.0)]).collect();
        let cells: Vec<[usize; 3]> =
            (0..m).flat_map(|k| [[2 * k, 2 * k + 1, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 2]]).collect();
        let built = build(&vertices, &cells);
        assert_eq!(built.is_ok(), good, "growth {growth}, turns {turns}: {:?}", built.err().map(|e| e.to_string()));
        if let Err(error) = built {
            assert!(error.to_string().contains("overlaps itself at"), "{error}");
        }
    }
}

#[test]
fn parts_that_overlap_are_refused() {
    let unit = ([0.0, 0.0], [1.0, 1.0], 2);
    for (other, why) in [
        (([0.5, 0.3], [1.0, 1.0], 2), "across a corner"),
        (([0.4, 0.4], [0.1, 0.1], 1), "inside"),
        (([-1.0, -1.0], [5.0, 5.0], 1), "around"),
        (([0.5, 0.0], [1.0, 1.0], 2), "along common lines"),
        (([0.0, 0.0], [1.0, 1.0], 2), "the same again"),
        (([-0.5, 0.4], [2.0, 0.2], 1), "across"),
        (([1.0 - 1e-5, 0.0], [1.0, 1.0], 2), "by a little"),
        (([1.0 - 1e-5, 0.3], [1.0, 1.0], 2), "by a little, shifted"),
    ] {
        let (vertices, cells) = rectangles(&[unit, other]);
        let text = refused(&vertices, &cells);
        assert!(text.contains("overlaps itself at") && text.contains("BooleanDifference"), "{why}: {text}");
    }
}

/// Two rectangles whose nodes were not merged: one mesh to the eye, two to the flow. At any place, turned and at any
/// scale.
#[test]
fn a_cut_through_the_mesh_is_refused_and_may_be_kept() {
    for (scale, angle, shift) in [(1.0, 0.0, 0.0), (1e-9, 0.3, 1.0), (1e9, 2.0, -3.0), (1.0, 1.0, 1e3)] {
        for n in [1, 2, 5] {
            let (mut vertices, cells) = rectangles(&[([0.0, 0.0], [1.0, 1.0], 2), ([1.0, 0.0], [1.0, 1.0], n)]);
            for [x, y] in &mut vertices {
                let (s, c) = f64::sin_cos(angle);
                (*x, *y) = (scale * (c * *x - s * *y + shift), scale * (s * *x + c * *y));
            }
            let text = refused(&vertices, &cells);
            let words =
                ["cut through", "tags `wall` and `wall`", "connected parts: 2", "Coherence", "mesh.slits = true"];
            words.iter().for_each(|word| assert!(text.contains(word), "{word}, n = {n}: {text}"));
        }
    }
    let mut sample = Sample::rectangle(1, 0.0);
    // the second square gets nodes of its own on the common side
    sample.nodes.extend([[1.0, 0.0, 0.0], [1.0, 1.0, 1e-12]]);
    let renumber = |nodes: &mut Vec<usize>| {
        nodes.iter_mut().for_each(|n| *n = [*n, 7, 8][usize::from(*n == 2) + 2 * usize::from(*n == 5)])
    };
    sample.triangles[2..].iter_mut().for_each(|(_, nodes)| renumber(nodes));
    [1, 3].into_iter().for_each(|line: usize| renumber(&mut sample.lines[line].1));
    for version in VERSIONS {
        let bytes = sample.bytes(version, Form::Little);
        let text = complaint(&bytes);
        assert!(
            text.contains("1 pairs of boundary edges") && text.contains("tags `boundary` and `boundary`"),
            "{text}"
        );
        let (_folder, path) = scratch("cut.msh");
        std::fs::write(&path, bytes).unwrap();
        let mesh = read_as(&path, Reading { curved: None, slits: Slits::Kept }).unwrap();
        let quality = mesh.quality();
        assert_eq!((quality.parts, quality.coincident_vertices, quality.area), (2, 2, 2.0));
        assert_eq!(quality.coincident_at.map(|x| x[0]), Some(1.0));
    }
}

/// Nodes that were meant to be one lie a little apart: a note with the place, at any scale; none where parts are well
/// apart, or where one part comes near itself.
#[test]
fn parts_that_nearly_touch_are_told() {
    for scale in [1e-6, 1.0, 1e6] {
        for (gap, near) in [(1e-5, true), (1e-3, true), (4e-3, true), (0.1, false), (1.0, false)] {
            let (mut vertices, cells) = rectangles(&[([0.0, 0.0], [1.0, 1.0], 2), ([1.0 + gap, 0.0], [1.0, 1.0], 2)]);
            vertices.iter_mut().flatten().for_each(|x| *x *= scale);
            let mesh = build(&vertices, &cells).unwrap();
            let found = mesh.near_miss();
            assert_eq!(found.is_some(), near, "gap {gap}: {found:?}");
            if let Some(found) = found {
                assert!((found.distance / (scale * gap) - 1.0).abs() < 1e-6, "{found:?}");
                assert!((found.at.x / scale - 1.0).abs() < 0.01 && found.length == 0.5 * scale, "{found:?}");
                let notes = monolayer::run::domain::mesh_remarks(&mesh).join("\n");
                assert!(notes.contains("nearly touch") && notes.contains("Coherence"), "{notes}");
            }
        }
    }
    // a sharp corner of one part
    let wedge = [[0.0, 0.0], [1.0, 0.001], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, -0.001]];
    let cells = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [0, 5, 6]];
    assert_eq!(build(&wedge, &cells).unwrap().near_miss(), None);
}

/// The upper half of the middle line of a square is not joined.
#[test]
fn a_seam_inside_of_a_part_is_told() {
    for (gap, near) in [(1e-6, true), (1e-4, true), (1e-3, true), (0.1, false)] {
        let (left, right) = (0.5 - 0.5 * gap, 0.5 + 0.5 * gap);
        let vertices = [
            [0.0, 0.0],
            [0.5, 0.0],
            [1.0, 0.0],
            [0.0, 0.5],
            [0.5, 0.5],
            [1.0, 0.5],
            [0.0, 1.0],
            [left, 1.0],
            [right, 1.0],
            [1.0, 1.0],
            [left, 0.75],
            [right, 0.75],
        ];
        let upper = [[3, 4, 10], [3, 10, 6], [6, 10, 7], [4, 5, 11], [5, 9, 11], [11, 9, 8]];
        let lower = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]];
        let mesh = build(&vertices, &[&upper[..], &lower[..]].concat()).unwrap();
        assert_eq!(mesh.near_miss().is_some(), near, "gap {gap}");
    }
}

/// A crack inside of one part: four squares about a point, of which two do not share the nodes between them.
#[test]
fn a_slit_inside_of_a_part_is_refused() {
    let vertices = [
        [-1.0, -1.0],
        [0.0, -1.0],
        [1.0, -1.0],
        [-1.0, 0.0],
        [0.0, 0.0],
        [1.0, 0.0],
        [-1.0, 1.0],
        [0.0, 1.0],
        [1.0, 1.0],
        [1.0, 0.0],
    ];
    let cells = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [3, 4, 7], [3, 7, 6], [4, 9, 8], [4, 8, 7]];
    let text = refused(&vertices, &cells);
    assert!(text.contains("1 pairs of boundary edges") && text.contains("connected parts: 1"), "{text}");
}

#[test]
fn parts_that_touch_in_a_point_or_not_at_all() {
    let two = |x: f64, y: f64| {
        let (vertices, cells) = rectangles(&[([0.0, 0.0], [1.0, 1.0], 2), ([x, y], [1.0, 1.0], 3)]);
        build(&vertices, &cells).unwrap()
    };
    for ([x, y], coincident) in
        [([3.0, 0.0], 0), ([1.0, 1.0], 1), ([1.0 + 1e-8, 1.0], 1), ([1.01, 0.0], 0), ([1.0, 1.01], 0)]
    {
        let mesh = two(x, y);
        let quality = mesh.quality();
        assert_eq!((quality.parts, quality.coincident_vertices), (2, coincident), "{x} {y}");
        let parts = mesh.parts();
        assert_eq!(parts.of_cell, [[0; 4].as_slice(), &[1; 6]].concat());
        assert!(quality.to_string().contains("parts           2"));
    }
    let (vertices, mut cells) = rectangles(&[([0.0, 0.0], [1.0, 1.0], 1), ([1.0, 1.0], [1.0, 1.0], 1)]);
    cells.iter_mut().flatten().filter(|v| **v == 4).for_each(|v| *v = 3);
    let text = refused(&vertices, &cells);
    assert!(text.contains("touches itself in the single vertex (1.0000, 1.0000)"), "{text}");
}

/// Whatever passes has a positive Jacobian wherever one looks, and hardly anything else is refused.
#[test]
fn curved_cells_are_refused_if_and_only_if_they_fold() {
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut seen = [0; 2];
    for k in 0..400 {
        let degree = 2 + k % 2;
        let mut mesh = build(&[[0.0, 0.0], [1.0, 0.0], [0.2, 0.9]], &[[0, 1, 2]]).unwrap();
        let mut nodes = monolayer::mesh::geometry::straight_nodes(degree, mesh.corners(0));
        nodes.positions[3..].iter_mut().for_each(|x| *x += Point::new(random(), random()) * (0.6 / degree as f64));
        mesh.curved[0] = Some(Box::new(nodes));
        let fine = 120;
        let points =
            (0..=fine).flat_map(|i| (0..=fine - i).map(move |j| Point::new(i as f64, j as f64) / f64::from(fine)));
        let least = points.map(|xi| mesh.map(0).at(xi).1.determinant()).fold(f64::INFINITY, f64::min) / 0.9;
        let passes = mesh.check_curved().is_ok();
        seen[usize::from(passes)] += 1;
        assert!(if passes { least > 0.0 } else { least < 0.03 }, "cell {k}: least Jacobian {least}, passes: {passes}");
    }
    assert!(seen[0] > 30 && seen[1] > 30, "{seen:?}");
}

#[test]
fn meshes_that_are_sound_pass() {
    for mut mesh in [hand::square(7, [1.0, 1e-3]), hand::disc(3, 24, 1), hand::disc(3, 24, 3)] {
        mesh.check_embedding(Slits::Refused).unwrap();
        assert_eq!((mesh.coincident.len(), mesh.parts().count), (0, 1));
        mesh.refined().unwrap();
    }
}
