//! VTK files hold what was given, bit for bit, and are never half written.

mod hand;

use std::io::Read;
use std::path::Path;

use base64::Engine;
use monolayer::element::basis;
use monolayer::mesh::Point;
use monolayer::output::OutputError;
use monolayer::output::pvd::{Entry, Series};
use monolayer::output::vtk::{Field, Grid, write_vtu};
use vtkio::model::{Attribute, CellType, DataSet, IOBuffer, UnstructuredGridPiece, Vtk};

fn parse(path: &Path) -> UnstructuredGridPiece {
    let DataSet::UnstructuredGrid { pieces, .. } = Vtk::import(path).unwrap().data else { panic!("other data set") };
    let [piece] = <[_; 1]>::try_from(pieces).unwrap();
    piece.into_loaded_piece_data(None).unwrap()
}

fn floats(buffer: &IOBuffer) -> Vec<f64> {
    let IOBuffer::F64(values) = buffer else { panic!("{:?}", buffer.scalar_type()) };
    values.clone()
}

fn array<'a>(attributes: &'a [Attribute], wanted: &str) -> (usize, &'a IOBuffer) {
    let found = attributes.iter().find_map(|attribute| match attribute {
        Attribute::DataArray(array) if array.name == wanted => Some((array.num_comp(), &array.data)),
        Attribute::DataArray(_) | Attribute::Field { .. } => None,
    });
    found.unwrap_or_else(|| panic!("no array {wanted}"))
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|v| v.to_bits()).collect()
}

fn padded(flat: &[f64]) -> Vec<f64> {
    flat.chunks(2).flat_map(|v| [v[0], v[1], 0.0]).collect()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_holds_grid_and_fields_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    for degree in 1..=5 {
        let grid = Grid::new(&hand::disc(3, 7, degree.min(3)), degree);
        let count = grid.points.len();
        let awkward = [0.0, -0.0, 5e-324, f64::MAX, -1.0 / 3.0, f64::MIN_POSITIVE];
        let scalar: Vec<f64> =
            (0..count).map(|k| awkward[k % 6] * if k > 40 { k as f64 * 1e-5 } else { 1.0 }).collect();
        let vector: Vec<f64> = (0..2 * count).map(|k| (k as f64).sin() * 10_f64.powi(k as i32 % 600 - 300)).collect();
        let fields = [
            Field { name: "scalar", components: 1, values: &scalar },
            Field { name: "velocity", components: 2, values: &vector },
        ];
        let path = folder.path().join("fields.vtu");
        write_vtu(&path, &grid, 0.1 + 0.2, &fields).unwrap();

        let piece = parse(&path);
        let flat: Vec<f64> = grid.points.iter().flat_map(|x| [x.x, x.y]).collect();
        assert_eq!(bits(&floats(&piece.points)), bits(&padded(&flat)));
        let kind = if degree == 1 { CellType::Triangle } else { CellType::LagrangeTriangle };
        assert_eq!(piece.cells.types, vec![kind; grid.cells]);
        let (connectivity, offsets) = piece.cells.cell_verts.into_xml();
        assert_eq!(connectivity, (0..count as u64).collect::<Vec<_>>());
        let n = basis::node_count(degree) as u64;
        assert_eq!(offsets, (1..=grid.cells as u64).map(|cell| cell * n).collect::<Vec<_>>());
        let (width, values) = array(&piece.data.point, "scalar");
        assert_eq!((width, bits(&floats(values))), (1, bits(&scalar)));
        let (width, values) = array(&piece.data.point, "velocity");
        assert_eq!((width, bits(&floats(values))), (3, bits(&padded(&vector))));
        let (_, IOBuffer::I64(cells)) = array(&piece.data.cell, "cell") else { panic!("not 64-bit") };
        assert_eq!(*cells, (0..grid.cells as i64).collect::<Vec<_>>());
        let text = std::fs::read_to_string(&path).unwrap();
        let time = r#"Name="TimeValue" NumberOfTuples="1" format="ascii">0.30000000000000004</DataArray>"#;
        assert!(text.contains(time), "{}", &text[..600]);
        assert_eq!(names(folder.path()), ["fields.vtu"]);
    }
}

/// The bytes of a compressed array by the description of VTK's format: number of blocks, size of a block, size of the
/// last one if it is shorter and otherwise 0, compressed sizes. (vtkio takes the 0 for an empty last block.)
fn uncompressed(text: &str, name: &str) -> Vec<u8> {
    let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).unwrap();
    let (_, content) = rest.split_once('>').unwrap();
    let content = content.split_once('<').unwrap().0;
    let blocks = u64::from_le_bytes(decoded(&content[..12])[..8].try_into().unwrap()) as usize;
    let head_length = (8 * (3 + blocks)).div_ceil(3) * 4;
    let head: Vec<usize> = decoded(&content[..head_length])
        .chunks_exact(8)
        .map(|bytes| u64::from_le_bytes(bytes.try_into().unwrap()) as usize)
        .collect();
    let (mut packed, mut out) = (&decoded(&content[head_length..])[..], Vec::new());
    for (block, &size) in head[3..].iter().enumerate() {
        let (this, next) = packed.split_at(size);
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(this).read_to_end(&mut bytes).unwrap();
        let last = block + 1 == blocks && head[2] > 0;
        assert_eq!(bytes.len(), if last { head[2] } else { head[1] });
        out.extend(bytes);
        packed = next;
    }
    assert!(packed.is_empty());
    out
}

fn decoded(text: &str) -> Vec<u8> {
    base64::engine::general_purpose::STANDARD.decode(text).unwrap()
}

#[test]
fn arrays_of_several_blocks_are_whole() {
    // 2 n² cells of 6 nodes of 8 bytes: for n = 32 the scalar has 3 blocks of 32 KiB exactly, for n = 33 a part is
    // left.
    let folder = tempfile::tempdir().unwrap();
    for (n, rest) in [(32, 0), (33, 6240)] {
        let grid = Grid::new(&hand::square(n, [1.0; 2]), 2);
        assert_eq!(grid.points.len() * 8 % 32_768, rest);
        let values: Vec<f64> = (0..grid.points.len()).map(|k| (k as f64).sqrt()).collect();
        let path = folder.path().join("fields.vtu");
        write_vtu(&path, &grid, 0.0, &[Field { name: "u", components: 1, values: &values }]).unwrap();
        let bytes = uncompressed(&std::fs::read_to_string(&path).unwrap(), "u");
        assert_eq!(bytes, values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
        if rest > 0 {
            assert_eq!(bits(&floats(array(&parse(&path).data.point, "u").1)), bits(&values));
        }
    }
}

#[test]
fn nodes_are_those_of_the_cell_map_and_belong_to_one_cell_each() {
    let mesh = hand::disc(2, 6, 3);
    for degree in 1..=5 {
        let grid = Grid::new(&mesh, degree);
        let n = grid.nodes_per_cell();
        assert_eq!((grid.cells, grid.points.len()), (mesh.cells.len(), mesh.cells.len() * n));
        for (cell, points) in grid.points.chunks(n).enumerate() {
            for (x, xi) in points.iter().zip(basis::nodes(degree)) {
                assert_eq!(*x, mesh.map(cell).at(xi).0);
            }
        }
    }
    // The arc's nodes of the cubic geometry lie on the circle, where a straight cell would leave them inside.
    let grid = Grid::new(&mesh, 3);
    let on_circle = grid.points.iter().filter(|x| ((*x - Point::new(0.3, -0.2)).norm() - 1.5).abs() < 1e-14).count();
    assert_eq!(on_circle, 6 * 4 + 6, "four nodes per arc, and one vertex in each cell that only touches the circle");
}

#[test]
fn values_that_are_not_finite_are_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields.vtu");
    let grid = Grid::new(&hand::square(2, [1.0; 2]), 2);
    let good = vec![1.0; grid.points.len()];
    write_vtu(&path, &grid, 0.0, &[Field { name: "u", components: 1, values: &good }]).unwrap();
    let before = std::fs::read(&path).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut values = vec![0.0; 2 * grid.points.len()];
        values[2 * (3 * 6 + 4) + 1] = bad;
        let fields = [
            Field { name: "u", components: 1, values: &good },
            Field { name: "polarity", components: 2, values: &values },
        ];
        let error = write_vtu(&path, &grid, 1.0, &fields).unwrap_err();
        let text = error.to_string();
        let OutputError::NonFinite { field, cell, node, component, .. } = error else { panic!("{text}") };
        assert_eq!((field.as_str(), cell, node, component), ("polarity", 3, 4, 1));
        assert!(text.contains("fields.vtu: field `polarity`") && text.contains("cell 3 at node 4"), "{text}");
    }
    assert_eq!(std::fs::read(&path).unwrap(), before);
    assert_eq!(names(folder.path()), ["fields.vtu"]);
    let mut broken = grid.clone();
    broken.points[7].y = f64::NAN;
    let error = write_vtu(&path, &broken, 0.0, &[]).unwrap_err();
    assert!(
        matches!(error, OutputError::NonFinite { ref field, cell: 1, node: 1, .. } if field == "positions"),
        "{error}"
    );
}

#[test]
fn names_are_escaped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields.vtu");
    let grid = Grid::new(&hand::square(1, [1.0; 2]), 1);
    let values = vec![2.5; grid.points.len()];
    write_vtu(&path, &grid, 0.0, &[Field { name: "a < b & \"c\"", components: 1, values: &values }]).unwrap();
    assert_eq!(floats(array(&parse(&path).data.point, "a < b & \"c\"").1), values);
}

#[test]
fn a_folder_that_does_not_exist_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing/fields.vtu");
    let grid = Grid::new(&hand::square(1, [1.0; 2]), 1);
    let text = write_vtu(&path, &grid, 0.0, &[]).unwrap_err().to_string();
    assert!(text.contains("missing/fields.vtu") && text.contains("hint: the folder does not exist"), "{text}");
    assert!(Series::create(&folder.path().join("missing/fields.pvd")).is_err());
}

#[test]
fn a_failing_writer_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    std::fs::write(&path, "old").unwrap();
    let result = monolayer::output::write_whole(&path, |out| {
        out.write_all(b"half of the new")?;
        Err(std::io::Error::other("the disk is on fire"))
    });
    assert!(result.unwrap_err().to_string().contains("the disk is on fire"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(names(folder.path()), ["table.csv"]);
    monolayer::output::write_whole(&path, |out| out.write_all(b"new")).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
}

fn entry(time: f64, file: &str) -> Entry {
    Entry { time, part: 0, file: file.to_owned() }
}

/// What another reader finds in the index at this moment.
fn on_disk(path: &Path) -> Vec<Entry> {
    let copy = path.with_extension("copy");
    std::fs::copy(path, &copy).unwrap();
    Series::resume(&copy, f64::INFINITY).unwrap().entries().to_vec()
}

#[test]
fn a_series_can_be_read_at_any_moment() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields.pvd");
    let mut series = Series::create(&path).unwrap();
    assert_eq!(on_disk(&path), []);
    let mut expected = Vec::new();
    for k in 0..5 {
        let (time, file) = (0.1 * f64::from(k), format!("fields/{k} <&>.vtu"));
        series.append(time, &file).unwrap();
        expected.push(entry(time, &file));
        assert_eq!(on_disk(&path), expected);
    }
    assert_eq!(series.entries(), expected);
    let text = std::fs::read_to_string(&path).unwrap();
    let line = r#"<DataSet timestep="0.30000000000000004" group="" part="0" file="fields/3 &lt;&amp;&gt;.vtu"/>"#;
    assert!(text.contains(line), "{text}");
}

#[test]
fn a_resumed_series_drops_what_comes_after() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields.pvd");
    let mut series = Series::create(&path).unwrap();
    [0.0, 0.5, 1.0, 1.5].iter().for_each(|&time| series.append(time, &format!("{time}.vtu")).unwrap());
    let mut resumed = Series::resume(&path, 1.0).unwrap();
    let kept = [entry(0.0, "0.vtu"), entry(0.5, "0.5.vtu"), entry(1.0, "1.vtu")];
    assert_eq!((resumed.entries(), on_disk(&path)), (&kept[..], kept.to_vec()));
    resumed.append(1.25, "1.25.vtu").unwrap();
    resumed.append(1.3, "1.25.vtu").unwrap();
    assert_eq!(on_disk(&path)[3..], [entry(1.3, "1.25.vtu")], "a file that is written again is listed once");
    let fresh = folder.path().join("other.pvd");
    assert_eq!(Series::resume(&fresh, 3.0).unwrap().entries(), []);
    assert!(fresh.exists());
}

#[test]
fn a_file_that_is_no_index_is_refused_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("fields.pvd");
    Series::create(&path).unwrap().append(1.0, "a.vtu").unwrap();
    let whole = std::fs::read_to_string(&path).unwrap();
    let half = &whole[..whole.find("</Collection>").unwrap()];
    let cases = [
        (half.to_owned(), "no complete <Collection>"),
        (whole.replace("timestep=\"1\"", "timestep=\"soon\""), "`soon` is not a number"),
        (whole.replace("file=", "fill="), "no attribute `file`"),
        (whole.replace("/>", "//Collection>"), "at byte"),
        (String::new(), "no complete <Collection>"),
    ];
    for (text, says) in cases {
        std::fs::write(&path, &text).unwrap();
        let error = Series::resume(&path, 5.0).unwrap_err();
        assert!(matches!(error, OutputError::Malformed { .. }) && error.to_string().contains(says), "{error}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
}
