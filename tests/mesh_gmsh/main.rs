//! Gmsh files: what Gmsh wrote is read, what is written is read back, and what is wrong is named.

mod embedding;
#[path = "../hand/mod.rs"]
mod hand;
mod sample;
mod scenes;
mod versions;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use monolayer::mesh::gmsh::{Encoding, read, write};
use monolayer::mesh::{BoundaryEdge, Curve, Mesh, MeshError, Point};

const ENCODINGS: [Encoding; 2] = [Encoding::Ascii, Encoding::Binary];

fn fixture(name: &str) -> Mesh {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).unwrap()
}

fn scratch(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

fn encode(mesh: &Mesh, encoding: Encoding) -> Vec<u8> {
    let (_folder, path) = scratch("mesh.msh");
    write(mesh, &path, encoding).unwrap();
    std::fs::read(path).unwrap()
}

fn decode(bytes: &[u8]) -> Result<Mesh, MeshError> {
    let (_folder, path) = scratch("mesh.msh");
    std::fs::write(&path, bytes).unwrap();
    read(&path)
}

/// The text of the error, which must name the file.
fn complaint(bytes: &[u8]) -> String {
    match decode(bytes) {
        Err(error @ MeshError::File { .. }) => {
            let text = error.to_string();
            assert!(text.contains("mesh.msh: ") && text.contains("; hint: "), "{text}");
            text
        }
        Err(error) => panic!("not an error of the file: {error}"),
        Ok(_) => panic!("accepted"),
    }
}

fn faces_with(mesh: &Mesh, tag: &str) -> usize {
    let tag = mesh.tag(tag).unwrap_or_else(|| panic!("no tag {tag}"));
    mesh.faces.iter().filter(|face| face.tag == Some(tag)).count()
}

fn circles(mesh: &Mesh) -> Vec<(Point, f64)> {
    mesh.curves.iter().map(|&Curve::Circle { centre, radius }| (centre, radius)).collect()
}

/// The only circle of the mesh, to rounding.
fn assert_circle(mesh: &Mesh, centre: Point, radius: f64) {
    let [(c, r)] = circles(mesh)[..] else { panic!("{:?}", mesh.curves) };
    assert!((c - centre).norm() < 1e-13 * (1.0 + centre.norm()) && (r - radius).abs() < 1e-13 * radius, "{c} {r}");
}

/// Equality of everything but the circles, which a reader finds to rounding only.
fn assert_same(a: &Mesh, b: &Mesh) {
    assert_eq!((&a.vertices, &a.cells, &a.tags), (&b.vertices, &b.cells, &b.tags));
    for (f, g) in a.faces.iter().zip(&b.faces) {
        assert_eq!((f.minus, f.plus, f.tag, f.curve.is_some()), (g.minus, g.plus, g.tag, g.curve.is_some()));
    }
    for (m, n) in a.curved.iter().zip(&b.curved) {
        let Some((m, n)) = m.as_ref().zip(n.as_ref()) else {
            assert!(m.is_none() && n.is_none());
            continue;
        };
        // The corners of a read cell are the vertices; those that `bend` computes may differ from them by rounding.
        assert!((0..3).all(|k| (m.positions[k] - n.positions[k]).norm() < 1e-15));
        assert_eq!((m.degree, &m.positions[3..]), (n.degree, &n.positions[3..]));
    }
}

#[test]
fn reads_order_1_ascii_from_gmsh() {
    let mesh = fixture("square-with-disc-order1.msh");
    assert_eq!((mesh.cells.len(), mesh.vertices.len()), (292, 173), "the centre of the circle is no vertex");
    assert_eq!(mesh.tags, ["disc wall", "inlet", "outlet", "14"]);
    assert_eq!(mesh.tags.iter().map(|tag| faces_with(&mesh, tag)).collect::<Vec<_>>(), [12, 9, 9, 24]);
    assert!((mesh.area() - (12.0 - 12.0 * 0.5 * 0.25 * 30_f64.to_radians().sin())).abs() < 1e-12);
    assert!(mesh.curved.iter().all(Option::is_none));
    assert_circle(&mesh, Point::new(0.1, -0.2), 0.5);
    let wall = mesh.tag("disc wall");
    assert!(mesh.faces.iter().all(|face| face.curve.is_some() == (face.tag.is_some() && face.tag == wall)));
}

#[test]
fn reads_order_2_binary_from_gmsh() {
    let mesh = fixture("square-with-disc-order2-binary.msh");
    assert_eq!((mesh.cells.len(), mesh.vertices.len()), (292, 173));
    assert_eq!(mesh.curved.iter().flatten().map(|nodes| nodes.degree).collect::<Vec<_>>(), [2; 12]);
    // A parabola over a chord covers two thirds of chord times sagitta.
    let half = 15_f64.to_radians();
    let segment = 2.0 / 3.0 * (2.0 * 0.5 * half.sin()) * 0.5 * (1.0 - half.cos());
    assert!((mesh.area() - (11.25 - 12.0 * segment)).abs() < 1e-12);
    assert_circle(&mesh, Point::new(0.1, -0.2), 0.5);
}

#[test]
fn reads_order_3_binary_with_parametric_nodes_from_gmsh() {
    let mesh = fixture("disc-order3-binary.msh");
    assert_eq!((mesh.cells.len(), faces_with(&mesh, "wall")), (117, 23));
    assert_eq!(mesh.curved.iter().flatten().map(|nodes| nodes.degree).collect::<Vec<_>>(), [3; 23]);
    assert!((mesh.area() - std::f64::consts::PI * 2.25).abs() < 2e-5);
    assert_circle(&mesh, Point::new(3.0, 1.0), 1.5);
}

#[test]
fn an_imported_linear_mesh_can_be_bent() {
    let mut mesh = fixture("square-with-disc-order1.msh");
    mesh.bend(2).unwrap();
    assert_eq!(mesh.curved.iter().flatten().count(), 12);
    assert!((mesh.area() - fixture("square-with-disc-order2-binary.msh").area()).abs() < 1e-12);
}

#[test]
fn what_is_written_is_read_back_bit_for_bit() {
    let fixtures = ["square-with-disc-order1.msh", "square-with-disc-order2-binary.msh", "disc-order3-binary.msh"];
    let by_hand = [hand::square(3, [1.0, 1e-3]), hand::disc(3, 9, 1), hand::disc(2, 8, 2), hand::disc(3, 7, 3)];
    for mesh in fixtures.map(fixture).into_iter().chain(by_hand) {
        let [ascii, binary] = ENCODINGS.map(|encoding| decode(&encode(&mesh, encoding)).unwrap());
        assert_same(&mesh, &ascii);
        assert_same(&mesh, &binary);
        assert_eq!(ascii.curves, binary.curves);
        let close =
            circles(&mesh).iter().zip(circles(&ascii)).all(|(a, b)| (a.0 - b.0).norm() + (a.1 - b.1).abs() < 1e-13);
        assert!(close && mesh.curves.len() == ascii.curves.len(), "{:?} {:?}", mesh.curves, ascii.curves);
    }
}

#[test]
fn cells_of_degree_2_and_3_in_one_mesh_keep_their_shape() {
    let mut mesh = hand::disc(2, 8, 2);
    let cubic = hand::disc(2, 8, 3);
    let cell = mesh.faces.iter().find(|face| face.tag.is_some()).unwrap().minus.cell;
    mesh.curved[cell] = cubic.curved[cell].clone();
    let back = decode(&encode(&mesh, Encoding::Ascii)).unwrap();
    assert!(back.curved.iter().flatten().all(|nodes| nodes.degree == 3));
    for cell in 0..mesh.cells.len() {
        for xi in [Point::new(0.5, 0.5), Point::new(0.1, 0.7), Point::new(0.0, 0.3)] {
            assert!((mesh.map(cell).at(xi).0 - back.map(cell).at(xi).0).norm() < 1e-14);
        }
    }
}

#[test]
fn every_truncation_is_refused_and_names_the_section() {
    for (mesh, encoding) in [(hand::disc(1, 5, 2), Encoding::Ascii), (hand::disc(1, 5, 2), Encoding::Binary)] {
        let whole = encode(&mesh, encoding);
        decode(&whole).unwrap();
        let find = |text: &str| whole.windows(text.len()).position(|w| w == text.as_bytes()).unwrap();
        let mut cut_off = 0;
        for section in ["MeshFormat", "PhysicalNames", "Entities", "Nodes", "Elements"] {
            let inside = find(&format!("${section}\n")) + section.len() + 2;
            let end = find(&format!("$End{section}"));
            for length in inside..end + section.len() + 3 {
                let text = complaint(&whole[..length]);
                assert!(text.contains(&format!("section ${section} is cut off")), "{length}: {text}");
                cut_off += 1;
            }
            let without_rest = end + section.len() + 5;
            if section != "Elements" {
                let next = if matches!(section, "Nodes") { "$Elements" } else { "$Nodes" };
                let text = complaint(&whole[..without_rest]);
                assert!(text.contains(&format!("there is no section {next}")), "{text}");
            }
        }
        assert!(cut_off > 1000);
    }
}

#[test]
fn a_missing_file_is_named() {
    let text = read(Path::new("no/such/place.msh")).unwrap_err().to_string();
    assert!(text.contains("no/such/place.msh") && text.contains("cannot be read"), "{text}");
    let (_folder, path) = scratch("no-folder/mesh.msh");
    let text = write(&hand::square(1, [1.0; 2]), &path, Encoding::Ascii).unwrap_err().to_string();
    assert!(text.contains("no-folder/mesh.msh") && text.contains("cannot be written"), "{text}");
}

/// A file put together from its parts.
#[derive(Clone)]
struct Parts {
    format: &'static str,
    /// Group and name of physical curves.
    names: Vec<(i32, &'static str)>,
    /// Curve and its groups.
    curves: Vec<(i32, Vec<i32>)>,
    nodes: Vec<(usize, [f64; 3])>,
    /// Dimension, entity, type, nodes.
    elements: Vec<(i32, i32, i32, Vec<usize>)>,
    extra: &'static str,
}

impl Parts {
    /// The unit square of two triangles, an edge per side, nodes with gaps in their numbers, an unused node outside of
    /// the plane, one triangle clockwise; sides 1 to 4 counterclockwise from the bottom.
    fn square() -> Self {
        let nodes = vec![
            (70, [0.0, 0.0, 0.0]),
            (5, [9.0, 9.0, 9.0]),
            (3, [1.0, 0.0, 0.0]),
            (900, [1.0, 1.0, 0.0]),
            (4, [0.0, 1.0, 0.0]),
        ];
        let sides = [[70, 3], [3, 900], [900, 4], [4, 70]];
        let lines = sides.iter().zip(1..).map(|(ends, side)| (1, side, 1, ends.to_vec()));
        let triangles = [(2, 1, 2, vec![70, 3, 900]), (2, 1, 2, vec![70, 4, 900])];
        Self {
            format: "4.1 0 8",
            names: vec![(8, "right side"), (7, "ends")],
            curves: vec![(1, vec![7]), (2, vec![8]), (3, vec![-7]), (4, vec![33])],
            nodes,
            elements: lines.chain(triangles).collect(),
            extra: "",
        }
    }

    fn text(&self) -> String {
        let mut out = format!("$MeshFormat\n{}\n$EndMeshFormat\n", self.format);
        writeln!(out, "$PhysicalNames\n{}", self.names.len()).unwrap();
        self.names.iter().for_each(|(group, name)| writeln!(out, "1 {group} \"{name}\"").unwrap());
        writeln!(out, "$EndPhysicalNames\n$Entities\n0 {} 1 0", self.curves.len()).unwrap();
        for (curve, groups) in &self.curves {
            let groups: String = groups.iter().map(|g| format!(" {g}")).collect();
            writeln!(out, "{curve} 0 0 0 1 1 0 {}{groups} 0", groups.split_whitespace().count()).unwrap();
        }
        writeln!(out, "1 0 0 0 1 1 0 0 0\n$EndEntities\n$Nodes\n1 {0} 1 1000\n2 1 0 {0}", self.nodes.len()).unwrap();
        self.nodes.iter().for_each(|(number, _)| writeln!(out, "{number}").unwrap());
        self.nodes.iter().for_each(|(_, [x, y, z])| writeln!(out, "{x} {y} {z}").unwrap());
        writeln!(out, "$EndNodes\n{}$Elements\n{1} {1} 1 1000", self.extra, self.elements.len()).unwrap();
        for (index, (dimension, entity, kind, nodes)) in self.elements.iter().enumerate() {
            let nodes: String = nodes.iter().map(|n| format!(" {n}")).collect();
            writeln!(out, "{dimension} {entity} {kind} 1\n{}{nodes}", 10 * index + 500).unwrap();
        }
        out + "$EndElements\n"
    }

    /// What is said about these parts after a change.
    fn refused(&self, change: impl FnOnce(&mut Self)) -> String {
        let mut parts = self.clone();
        change(&mut parts);
        complaint(parts.text().as_bytes())
    }
}

#[test]
fn gaps_unused_nodes_unnamed_groups_and_clockwise_triangles_are_understood() {
    let mut parts = Parts::square();
    parts.extra = "$Periodic\n0\n$EndPeriodic\n$NodeData\nanything at all\n$EndNodeData\n";
    let mesh = decode(parts.text().replace('\n', "\r\n").as_bytes()).unwrap();
    assert_eq!(mesh.vertices, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Point::from));
    assert_eq!((mesh.cells.clone(), mesh.area()), (vec![[0, 1, 2], [0, 2, 3]], 1.0));
    assert_eq!(mesh.tags, ["ends", "right side", "33"]);
    assert_eq!(mesh.tags.iter().map(|t| faces_with(&mesh, t)).collect::<Vec<_>>(), [2, 1, 1]);
    let right = mesh.faces.iter().find(|f| f.tag == Some(1)).unwrap();
    assert_eq!(mesh.face_vertices(right), [1, 2]);
}

#[test]
fn groups_of_the_same_name_become_one_tag() {
    let mut parts = Parts::square();
    parts.names = vec![(7, "all"), (8, "all"), (33, "all")];
    let mesh = decode(parts.text().as_bytes()).unwrap();
    assert_eq!((mesh.tags.clone(), faces_with(&mesh, "all")), (vec!["all".to_owned()], 4));
}

#[test]
fn what_cannot_be_used_is_refused_with_its_reason() {
    let parts = Parts::square();
    let says = |text: String, words: &[&str]| words.iter().for_each(|w| assert!(text.contains(w), "{w} in {text}"));
    says(parts.refused(|p| p.format = "3 0 8"), &["version 3", "msh41"]);
    says(parts.refused(|p| p.format = "5.0 0 8"), &["version 5", "2.2, 4.0 and 4.1"]);
    says(parts.refused(|p| p.format = "4.1 0 4"), &["$MeshFormat", "data size 4"]);
    says(parts.refused(|p| p.elements.truncate(4)), &["no triangles", "physical group"]);
    says(parts.refused(|p| p.elements.push((2, 1, 3, vec![70, 3, 900, 4]))), &["quadrangles", "Recombine"]);
    says(parts.refused(|p| p.elements.push((3, 1, 4, vec![70, 3, 900, 4]))), &["volume"]);
    says(parts.refused(|p| p.elements.push((2, 1, 23, vec![70; 15]))), &["type 23"]);
    says(parts.refused(|p| p.elements[4].3[1] = 41), &["element 540 names node 41"]);
    says(parts.refused(|p| p.nodes[2].1[2] = 1e-6), &["z = 1e-6 at node 3", "plane z = 0"]);
    says(parts.refused(|p| p.nodes[1].0 = 70), &["node 70 is listed twice"]);
    says(parts.refused(|p| p.nodes[2].1[0] = f64::NAN), &["$Nodes", "not finite"]);
    says(parts.refused(|p| p.nodes[2].1 = [0.5, 0.5, 0.0]), &["inverted or flat"]);
    says(complaint(b"Point(1) = {0, 0, 0};\n"), &["`Point(1) = {0, 0, 0};`", ".geo"]);
    says(complaint(parts.text().replace("1 0 0\n", "1 o 0\n").as_bytes()), &["$Nodes", "expected a number, found `o`"]);
    says(complaint(parts.text().replace("$Nodes\n1 5", "$Nodes\n2 5").as_bytes()), &["$Nodes", "$EndNodes"]);
    let mut odd = encode(&hand::square(1, [1.0; 2]), Encoding::Binary);
    let one = odd.windows(4).position(|w| w == 1_i32.to_le_bytes()).unwrap();
    odd[one] = 2;
    says(complaint(&odd), &["order of bytes", "[2, 0, 0, 0]"]);
}

#[test]
fn rounding_in_z_is_accepted() {
    let mut parts = Parts::square();
    parts.nodes[2].1[2] = 1e-12;
    assert_eq!(decode(parts.text().as_bytes()).unwrap().area(), 1.0);
}

/// One cell of degree `degree`, all of its sides in group 7; `place` gives the node with barycentric indices
/// `[i, j, k]`.
fn one_cell(degree: usize, place: impl Fn([usize; 3]) -> Point) -> Parts {
    let indices = monolayer::element::basis::node_indices(degree);
    let mut parts = Parts::square();
    let xyz = |x: Point| [x.x, x.y, 0.0];
    parts.nodes = indices.iter().enumerate().map(|(k, &index)| (k + 1, xyz(place(index)))).collect();
    parts.curves = vec![(1, vec![7])];
    let side = |f| {
        let nodes = monolayer::element::basis::face_nodes(degree, f);
        let ordered = [nodes[0], nodes[degree]].into_iter().chain(nodes[1..degree].iter().copied());
        (1, 1, [1, 8, 26][degree - 1], ordered.map(|n| n + 1).collect::<Vec<_>>())
    };
    parts.elements = (0..3).map(side).collect();
    parts.elements.push((2, 1, [2, 9, 21][degree - 1], (1..=indices.len()).collect()));
    parts
}

#[test]
fn clockwise_curved_triangles_are_turned_with_their_nodes() {
    // A map of degree 2 that turns orientation, so that nodes of both degrees lie on its image.
    let map = |x: f64, y: f64| Point::new(y + 0.1 * x * y, x + 0.2 * x * x - 0.15 * x * y + 0.05 * y * y);
    for degree in [2, 3] {
        let q = degree as f64;
        let mesh = decode(one_cell(degree, |[_, j, k]| map(j as f64 / q, k as f64 / q)).text().as_bytes()).unwrap();
        for (x, y) in [(0.2, 0.3), (0.7, 0.3), (0.0, 0.1), (1.0 / 3.0, 1.0 / 3.0)] {
            assert!((mesh.map(0).at(Point::new(y, x)).0 - map(x, y)).norm() < 1e-15, "degree {degree}");
        }
    }
}

#[test]
fn straight_cells_of_high_order_become_affine() {
    for degree in [2, 3] {
        let q = degree as f64;
        let skew = |[_, j, k]: [usize; 3]| Point::new(0.1 + j as f64 / q * 0.7, (k as f64 + 0.3 * j as f64) / q);
        let mesh = decode(one_cell(degree, skew).text().as_bytes()).unwrap();
        assert!(mesh.curved[0].is_none() && mesh.curves.is_empty());
    }
}

#[test]
fn a_cell_that_is_bent_inside_out_is_refused() {
    let fold =
        |[_, j, k]: [usize; 3]| Point::new(j as f64 / 2.0, k as f64 / 2.0 + 0.7 * (j == 1 && k == 0) as u8 as f64);
    let text = complaint(one_cell(2, fold).text().as_bytes());
    assert!(text.contains("cell 0") && text.contains("inverted or flat"), "{text}");
}

/// A fan around `centre` through `ring`, all outer edges tagged `wall`.
fn fan(centre: Point, ring: &[Point], curve: Option<Curve>) -> Mesh {
    let n = ring.len();
    let vertices = std::iter::once(centre).chain(ring.iter().copied()).collect();
    let pair = |k: usize| [1 + k, 1 + (k + 1) % n];
    let cells = (0..n).map(|k| [0, pair(k)[0], pair(k)[1]]).collect();
    let edge = |k| BoundaryEdge { vertices: pair(k), tag: 0, curve: curve.map(|_| 0) };
    let boundary: Vec<_> = (0..n).map(edge).collect();
    Mesh::build(vertices, cells, &boundary, vec!["wall".to_owned()], curve.into_iter().collect()).unwrap()
}

fn regular(n: usize) -> Vec<Point> {
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
    (0..n).map(|k| Point::new(angle(k).cos(), angle(k).sin())).collect()
}

#[test]
fn polygons_are_not_mistaken_for_circles() {
    for n in [3, 4, 5, 6, 12] {
        let back = decode(&encode(&fan(Point::zeros(), &regular(n), None), Encoding::Ascii)).unwrap();
        assert!(back.curves.is_empty(), "{n}: {:?}", back.curves);
    }
    for n in [3, 4] {
        // As one curve of the geometry a triangle or a square is still no circle, six sides are.
        let circle = Curve::Circle { centre: Point::zeros(), radius: 1.0 };
        assert!(
            decode(&encode(&fan(Point::zeros(), &regular(n), Some(circle)), Encoding::Ascii))
                .unwrap()
                .curves
                .is_empty()
        );
        assert_circle(
            &decode(&encode(&fan(Point::zeros(), &regular(6), Some(circle)), Encoding::Ascii)).unwrap(),
            Point::zeros(),
            1.0,
        );
    }
}

#[test]
fn an_ellipse_is_no_circle() {
    let circle = Curve::Circle { centre: Point::zeros(), radius: 1.0 };
    let flattened: Vec<_> = regular(24).into_iter().map(|x| Point::new(x.x, x.y * (1.0 - 1e-6))).collect();
    assert!(
        decode(&encode(&fan(Point::zeros(), &flattened, Some(circle)), Encoding::Ascii)).unwrap().curves.is_empty()
    );
}

#[test]
fn an_arc_beside_a_straight_side_of_the_same_tag_is_found() {
    // Upper half disc: the arc is one curve of the geometry, the diameter another, both in group 7.
    let mesh = fan(Point::new(0.0, 0.2), &regular(16)[..=8], None);
    let mut parts = Parts::square();
    parts.curves = vec![(1, vec![7]), (2, vec![7])];
    parts.nodes = mesh.vertices.iter().enumerate().map(|(k, x)| (k + 1, [x.x, x.y, 0.0])).collect();
    let arc = (2..10).map(|k| (1, 1, 1, vec![k, k + 1]));
    let triangles = mesh.cells.iter().map(|c| (2, 1, 2, c.map(|v| v + 1).to_vec()));
    parts.elements = arc.chain([(1, 2, 1, vec![10, 2])]).chain(triangles).collect();
    let back = decode(parts.text().as_bytes()).unwrap();
    assert_circle(&back, Point::zeros(), 1.0);
    let (round, flat): (Vec<_>, Vec<_>) =
        back.faces.iter().filter(|f| f.tag.is_some()).partition(|f| f.curve.is_some());
    assert_eq!((round.len(), flat.len()), (8, 1));
    assert!(back.face_vertices(flat[0]).iter().all(|&v| back.vertices[v].y.abs() < 1e-15));
}
