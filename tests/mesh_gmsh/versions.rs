//! Files as users have them: versions 2.2, 4.0 and 4.1, text and bytes of both orders, with and without groups.

use monolayer::mesh::Mesh;

use super::sample::{FORMS, Form, Sample, VERSIONS, Version};
use super::{complaint, decode, faces_with, scratch};

/// The mesh of a sample in every version and form, which must be one mesh, in its first.
fn everywhere(sample: &Sample) -> Mesh {
    let meshes: Vec<Mesh> = VERSIONS
        .iter()
        .flat_map(|&version| FORMS.map(|form| (version, form)))
        .map(|(version, form)| {
            decode(&sample.bytes(version, form)).unwrap_or_else(|error| panic!("{version:?} {form:?}: {error}"))
        })
        .collect();
    for mesh in &meshes[1..] {
        super::assert_same(&meshes[0], mesh);
    }
    meshes.into_iter().next().unwrap()
}

fn counts(mesh: &Mesh) -> Vec<(&str, usize)> {
    mesh.tags.iter().map(|tag| (tag.as_str(), faces_with(mesh, tag))).collect()
}

fn says(mesh: &Mesh, words: &[&str]) {
    let all = mesh.notes.join("\n");
    words.iter().for_each(|word| assert!(all.contains(word), "`{word}` is not in\n{all}"));
}

#[test]
fn every_version_and_encoding_is_read() {
    for degree in [1, 2, 3] {
        let mesh = everywhere(&Sample::rectangle(degree, 0.0));
        assert_eq!((mesh.cells.len(), mesh.vertices.len()), (4, 6), "degree {degree}");
        assert!((mesh.area() - 2.0).abs() < 1e-14);
        assert_eq!(counts(&mesh), [("in let", 1), ("outlet", 1), ("walls", 4)]);
        assert!(mesh.curved.iter().all(Option::is_none), "straight cells are affine");
        says(
            &mesh,
            &["not used of the file: 2 point elements", "1 line elements inside of the mesh are ignored: of no group"],
        );
        assert_eq!(mesh.notes.len(), 2);
    }
}

/// A parabola of height b over a side of length 1 adds 2b/3.
#[test]
fn cells_of_order_2_and_3_keep_their_bulge_in_every_version() {
    for degree in [2, 3] {
        let mesh = everywhere(&Sample::rectangle(degree, 0.1));
        assert_eq!(mesh.curved.iter().flatten().map(|nodes| nodes.degree).collect::<Vec<_>>(), [degree]);
        assert!((mesh.area() - (2.0 + 0.2 / 3.0)).abs() < 1e-14, "degree {degree}: {}", mesh.area());
    }
}

#[test]
fn nodes_with_parameters_are_read() {
    let mut sample = Sample::rectangle(2, 0.1);
    sample.parametric = true;
    super::assert_same(&everywhere(&sample), &everywhere(&Sample::rectangle(2, 0.1)));
}

#[test]
fn without_groups_the_whole_boundary_has_one_tag() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.groups.clear();
    sample.names.clear();
    let mesh = everywhere(&sample);
    assert_eq!(counts(&mesh), [("boundary", 6)]);
    says(
        &mesh,
        &[
            "all 6 boundary edges without a physical group have the tag `boundary`",
            "from (0.0000, 0.0000) to (1.0000, 0.0000)",
        ],
    );
    // files of meshio have no lines at all
    sample.lines.clear();
    assert_eq!(counts(&everywhere(&sample)), [("boundary", 6)]);
}

#[test]
fn a_group_of_the_surface_alone_is_enough() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.groups.retain(|(dim, _), _| *dim == 2);
    assert_eq!(counts(&everywhere(&sample)), [("boundary", 6)]);
}

#[test]
fn some_boundary_curves_may_lack_a_group() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.groups.remove(&(1, 2));
    let mesh = everywhere(&sample);
    assert_eq!(counts(&mesh), [("in let", 1), ("walls", 4), ("boundary", 1)]);
    says(
        &mesh,
        &["1 boundary edges without a physical group", "from (2.0000, 0.0000) to (2.0000, 1.0000)", "Physical Curve"],
    );
}

#[test]
fn a_curve_inside_is_ignored_with_its_name() {
    let mut sample = Sample::rectangle(2, 0.0);
    sample.groups.insert((1, 5), vec![4]);
    sample.names.push((1, 4, "middle"));
    let mesh = everywhere(&sample);
    assert_eq!(counts(&mesh), [("in let", 1), ("outlet", 1), ("walls", 4)]);
    says(&mesh, &["1 line elements inside of the mesh are ignored: of `middle`"]);
}

#[test]
fn a_curve_in_two_groups_takes_the_first() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.groups.insert((1, 1), vec![3, 2]);
    sample.groups.insert((1, 4), vec![-1, 3]);
    let mesh = everywhere(&sample);
    assert_eq!(counts(&mesh), [("in let", 1), ("outlet", 1), ("walls", 4)]);
    says(
        &mesh,
        &[
            "2 boundary edges are in two physical curves, `walls` and `outlet`: they have the tag `walls`",
            "`in let` and `walls`",
        ],
    );
}

#[test]
fn surfaces_without_a_group_are_left_out_where_others_have_one() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.groups.remove(&(2, 2));
    let mesh = everywhere(&sample);
    assert_eq!((mesh.cells.len(), mesh.area()), (2, 1.0));
    assert_eq!(counts(&mesh), [("in let", 1), ("walls", 2), ("boundary", 1)]);
    says(
        &mesh,
        &[
            "2 triangles of surfaces without a physical group are left out (surface 2)",
            "3 line elements that are no side",
        ],
    );
    says(&mesh, &["2 nodes that no triangle uses"]);
}

#[test]
fn a_triangle_in_two_groups_is_taken_once() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.groups.insert((2, 1), vec![9, 8]);
    let mesh = decode(&sample.bytes(Version::Two, Form::Text)).unwrap();
    assert_eq!(mesh.cells.len(), 4);
    says(&mesh, &["2 triangles that are listed twice are taken once"]);
    assert_eq!(everywhere(&sample).cells.len(), 4);
}

#[test]
fn other_sections_are_named() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.extra = [
        "$Periodic\n1\n1 2 4\n0\n1\n1 2\n$EndPeriodic\n",
        "$Comments\nby \
         hand\n$EndComments\n$NodeData\n1\n\"u\"\n0\n3\n0\n1\n0\n$EndNodeData\n$ElementData\n0\n$EndElementData\n",
    ];
    let mesh = everywhere(&sample);
    says(&mesh, &["not used of the file: $ElementData, $NodeData, $Periodic, 2 point elements"]);
    assert_eq!(mesh.area(), 2.0);
}

/// Two partitions: the pieces of surfaces and curves have numbers and groups of their own.
#[test]
fn a_partitioned_mesh_is_read_as_one() {
    let mut sample = Sample::rectangle(1, 0.0);
    let pieces = "$PartitionedEntities\n2\n0\n0 5 2 0\n\
        11 1 1 1 1 0 0 0 1 0 0 1 3 0\n12 1 2 1 2 0 0 0 1 0 0 1 2 0\n13 1 3 1 2 0 0 0 1 0 0 1 3 0\n\
        14 1 4 1 1 0 0 0 1 0 0 1 1 0\n\
        15 2 1 2 1 2 0 0 0 1 0 0 0 0\n\
        11 2 1 1 1 0 0 0 1 1 0 1 9 0\n12 2 2 1 2 0 0 0 1 1 0 1 9 0\n$EndPartitionedEntities\n";
    sample.lines.iter_mut().for_each(|(entity, _)| *entity += 10);
    sample.triangles.iter_mut().for_each(|(entity, _)| *entity += 10);
    sample.extra[0] = pieces;
    for version in [Version::Four, Version::FourOne] {
        let mesh = decode(&sample.bytes(version, Form::Text)).unwrap();
        assert_eq!(counts(&mesh), [("in let", 1), ("outlet", 1), ("walls", 4)]);
        says(&mesh, &["not used of the file: $PartitionedEntities"]);
    }
}

#[test]
fn any_plane_z_will_do_and_a_tilted_one_is_refused() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.nodes.iter_mut().for_each(|x| x[2] = 7.5);
    assert_eq!(everywhere(&sample).area(), 2.0);
    sample.nodes[3][2] = 8.0;
    for version in VERSIONS {
        let text = complaint(&sample.bytes(version, Form::Text));
        let words = ["three-dimensional", "z = 7.5 at node 1", "z = 8.0 at node 4", "plane z = 0"];
        words.iter().for_each(|word| assert!(text.contains(word), "`{word}` is not in {text}"));
    }
}

#[test]
fn a_missing_section_is_named() {
    let whole = String::from_utf8(Sample::rectangle(1, 0.0).bytes(Version::Two, Form::Text)).unwrap();
    for section in ["MeshFormat", "Nodes", "Elements"] {
        let (begin, end) = (format!("${section}\n"), format!("$End{section}\n"));
        let (a, b) = (whole.find(&begin).unwrap(), whole.find(&end).unwrap() + end.len());
        let text = complaint([&whole[..a], &whole[b..]].concat().as_bytes());
        let named = if section == "MeshFormat" { "comes before $MeshFormat" } else { "there is no section $" };
        assert!(text.contains(named) && text.contains(section), "{section}: {text}");
    }
}

/// What is no mesh of Gmsh is called by its name, and how it becomes one is said.
#[test]
fn files_of_other_programs_are_named() {
    let cases = [
        ("a.geo", "Point(1) = {0, 0, 0};\n", "a geometry of Gmsh", "-2 -o file.msh"),
        ("a.GEO", "Point(1) = {0, 0, 0};\n", "a geometry of Gmsh", "-2 -o file.msh"),
        ("a.su2", "NDIME= 2\n", "SU2", "gmsh "),
        ("a.vtk", "# vtk DataFile Version 2.0\n", "VTK", "meshio"),
        ("a.vtu", "<?xml version=\"1.0\"?>\n", "VTK", "meshio convert"),
        ("a.inp", "*NODE\n", "Abaqus", "gmsh "),
        ("a.unv", "    -1\n", "I-deas", "gmsh "),
        ("a.med", "HDF", "SALOME", "gmsh "),
        ("a.stl", "solid x\n", "facets", "outline"),
        ("a.mesh", "MeshVersionFormatted 2\n", "Medit", "gmsh "),
        ("a.msh.gz", "\u{1f}", "compressed", "unpack"),
        ("fluent.msh", "(0 \"made by a program\")\n(2 2)\n", "Fluent", "meshio"),
        ("freefem.msh", "4 2 4\n0 0 1\n", "FreeFEM", "meshio"),
        ("empty.msh", "", "the file is empty", "again"),
        ("old.msh", "$NOD\n1\n1 0 0 0\n$ENDNOD\n", "format version 1", "msh41"),
    ];
    for (name, content, what, hint) in cases {
        let (_folder, path) = scratch(name);
        std::fs::write(&path, content).unwrap();
        let text = monolayer::mesh::gmsh::read(&path).unwrap_err().to_string();
        assert!(text.contains(what) && text.contains(hint) && text.contains(name), "{name}: {text}");
    }
    let (_folder, path) = scratch("UPPER.MSH");
    std::fs::write(&path, Sample::rectangle(1, 0.0).bytes(Version::Two, Form::Text)).unwrap();
    assert_eq!(monolayer::mesh::gmsh::read(&path).unwrap().area(), 2.0);
    assert!(monolayer::mesh::gmsh::is_mesh_file(&path));
}

/// Without lines in the file a fine polygon on a circle is that circle, a coarse one is not.
#[test]
fn circles_are_found_without_lines_if_their_edges_are_short() {
    for (n, found) in [(6, 0), (12, 0), (24, 1), (60, 1)] {
        let mut sample = Sample::rectangle(1, 0.0);
        sample.lines.clear();
        let angle = |k: usize| std::f64::consts::TAU * k as f64 / n as f64;
        sample.nodes = (0..n).map(|k| [angle(k).cos(), angle(k).sin(), 0.0]).chain([[0.0; 3]]).collect();
        sample.triangles = (0..n).map(|k| (1, vec![k + 1, (k + 1) % n + 1, n + 1])).collect();
        assert_eq!(everywhere(&sample).curves.len(), found, "{n} edges");
    }
}

#[test]
fn names_with_spaces_dots_and_backslashes_come_back_and_quotes_are_refused() {
    let mut sample = Sample::rectangle(1, 0.0);
    sample.names = vec![(1, 1, " my wall "), (1, 2, "a.b\\c"), (1, 3, "ü [x] = 'y'")];
    let mesh = everywhere(&sample);
    assert_eq!(mesh.tags, [" my wall ", "a.b\\c", "ü [x] = 'y'"]);
    super::ENCODINGS.iter().for_each(|&e| assert_eq!(decode(&super::encode(&mesh, e)).unwrap().tags, mesh.tags));
    for name in ["a\"b", "two\nlines", ""] {
        let mut mesh = mesh.clone();
        mesh.tags[0] = name.to_owned();
        let (_folder, path) = scratch("out.msh");
        let text = monolayer::mesh::gmsh::write(&mesh, &path, super::Encoding::Ascii).unwrap_err().to_string();
        assert!(text.contains("cannot be written") && text.contains(&format!("{name:?}")), "{text}");
        assert!(!path.exists());
    }
}
