//! Fields for ParaView and PyVista: VTK unstructured grids (`.vtu`).
//!
//! Every cell has its own nodes, so discontinuous fields stay discontinuous, and they are Lagrange triangles of the
//! field's degree, so nothing is lost to a subdivision. The arrays are 64-bit, zlib-compressed and base64-encoded
//! inside the XML, which keeps the file readable by any XML parser.

use std::io::{self, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use quick_xml::escape::escape;

use super::{OutputError, write_whole};
use crate::element::{MAX_DEGREE, basis};
use crate::mesh::{Mesh, Point};

/// VTK's numbers of the linear and the Lagrange triangle.
const TRIANGLE: u8 = 5;
const LAGRANGE_TRIANGLE: u8 = 69;
/// Bytes that are compressed at a time; VTK's own writer uses the same.
const BLOCK: usize = 32_768;

/// The nodes at which fields are written.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Degree of the cells.
    pub degree: usize,
    /// Node positions: cell after cell, in the order of [`basis::node_indices`].
    pub points: Vec<Point>,
    /// Number of cells.
    pub cells: usize,
}

impl Grid {
    /// The nodes of degree `degree` in every cell; curved cells are followed as far as that degree can.
    ///
    /// # Panics
    /// When the degree is not one of the crate's elements (1 to [`MAX_DEGREE`]).
    pub fn new(mesh: &Mesh, degree: usize) -> Self {
        assert!((1..=MAX_DEGREE).contains(&degree), "output of degree {degree}");
        let nodes = basis::nodes(degree);
        let in_cell = |cell| {
            let map = mesh.map(cell);
            nodes.iter().map(move |&xi| map.at(xi).0)
        };
        let cells = mesh.cells.len();
        Self { degree, points: (0..cells).flat_map(in_cell).collect(), cells }
    }

    /// Number of nodes of a cell.
    pub fn nodes_per_cell(&self) -> usize {
        basis::node_count(self.degree)
    }
}

/// Values of a scalar or vector at the nodes of a [`Grid`].
#[derive(Debug, Clone, Copy)]
pub struct Field<'a> {
    /// As ParaView shows it.
    pub name: &'a str,
    /// 1 or 2.
    pub components: usize,
    /// Cell after cell, node after node, component after component.
    pub values: &'a [f64],
}

/// Writes the fields at `time` (in the file as `TimeValue`), and the index of every cell as cell data `cell`.
///
/// # Errors
/// [`OutputError::NonFinite`] for the first value that is not a number or infinite, before anything is written;
/// [`OutputError::Io`].
///
/// # Panics
/// When the number of values does not fit the grid.
pub fn write_vtu(path: &Path, grid: &Grid, time: f64, fields: &[Field]) -> Result<(), OutputError> {
    assert!(time.is_finite(), "output at time {time}");
    let flat: Vec<f64> = grid.points.iter().flat_map(|x| [x.x, x.y]).collect();
    let positions = Field { name: "positions", components: 2, values: &flat };
    for field in fields.iter().chain([&positions]) {
        check(path, grid, field)?;
    }
    write_whole(path, |out| document(out, grid, time, &positions, fields))
}

/// Refuses wrong lengths and values that are not finite.
fn check(path: &Path, grid: &Grid, field: &Field) -> Result<(), OutputError> {
    let (name, width) = (field.name, field.components);
    assert!((1..=3).contains(&width), "field `{name}` has {width} components");
    assert_eq!(field.values.len(), grid.points.len() * width, "number of values of field `{name}`");
    match field.values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => {
            let (point, component) = (index / width, index % width);
            let (cell, node) = (point / grid.nodes_per_cell(), point % grid.nodes_per_cell());
            Err(OutputError::NonFinite {
                path: path.display().to_string(),
                field: name.to_owned(),
                cell,
                node,
                component,
                value: field.values[index],
                hint: "the computation has broken down: take smaller time steps or a finer mesh",
            })
        }
    }
}

fn document(out: &mut dyn Write, grid: &Grid, time: f64, positions: &Field, fields: &[Field]) -> io::Result<()> {
    let points = grid.points.len();
    let kind = if grid.degree == 1 { TRIANGLE } else { LAGRANGE_TRIANGLE };
    writeln!(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- {} -->", crate::names::MADE_BY)?;
    write!(out, r#"<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64""#)?;
    writeln!(out, r#" compressor="vtkZLibDataCompressor">"#)?;
    writeln!(out, "<UnstructuredGrid>\n<FieldData>")?;
    writeln!(
        out,
        r#"<DataArray type="Float64" Name="TimeValue" NumberOfTuples="1" format="ascii">{time}</DataArray>"#
    )?;
    writeln!(out, "</FieldData>")?;
    writeln!(out, r#"<Piece NumberOfPoints="{points}" NumberOfCells="{}">"#, grid.cells)?;
    writeln!(out, "<Points>")?;
    field_array(out, positions)?;
    writeln!(out, "</Points>\n<Cells>")?;
    integers(out, "connectivity", 0..points)?;
    integers(out, "offsets", (1..=grid.cells).map(|cell| cell * grid.nodes_per_cell()))?;
    array(out, "types", "UInt8", 1, &vec![kind; grid.cells])?;
    writeln!(out, "</Cells>\n<PointData>")?;
    fields.iter().try_for_each(|field| field_array(out, field))?;
    writeln!(out, "</PointData>\n<CellData>")?;
    integers(out, "cell", 0..grid.cells)?;
    writeln!(out, "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>")
}

/// Scalars as they are; vectors get a third component 0, for VTK knows only vectors of space, and symmetric tensors
/// (11, 12, 22) the order 11, 22, 33, 12, 23, 13.
pub(super) fn field_array(out: &mut dyn Write, field: &Field) -> io::Result<()> {
    let (bytes, components): (Vec<u8>, usize) = match field.components {
        1 => (field.values.iter().flat_map(|v| v.to_le_bytes()).collect(), 1),
        2 => {
            let padded = field.values.chunks_exact(2).flat_map(|v| [v[0], v[1], 0.0]);
            (padded.flat_map(f64::to_le_bytes).collect(), 3)
        }
        _ => {
            let padded = field.values.chunks_exact(3).flat_map(|v| [v[0], v[2], 0.0, v[1], 0.0, 0.0]);
            (padded.flat_map(f64::to_le_bytes).collect(), 6)
        }
    };
    array(out, field.name, "Float64", components, &bytes)
}

pub(super) fn integers(out: &mut dyn Write, name: &str, values: impl Iterator<Item = usize>) -> io::Result<()> {
    let bytes: Vec<u8> = values.flat_map(|value| (value as i64).to_le_bytes()).collect();
    array(out, name, "Int64", 1, &bytes)
}

/// One array: the head (number of blocks, size of a block, size of the last block if it is shorter, else 0, compressed
/// sizes) and the compressed blocks, each part in base64 by itself.
pub(super) fn array(out: &mut dyn Write, name: &str, kind: &str, components: usize, bytes: &[u8]) -> io::Result<()> {
    let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(compress).collect::<io::Result<_>>()?;
    let head = [blocks.len(), BLOCK, bytes.len() % BLOCK].into_iter().chain(blocks.iter().map(Vec::len));
    let head: Vec<u8> = head.flat_map(|value| (value as u64).to_le_bytes()).collect();
    let name = escape(name);
    write!(out, r#"<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="binary">"#)?;
    write!(out, "{}{}", BASE64.encode(head), BASE64.encode(blocks.concat()))?;
    writeln!(out, "</DataArray>")
}

fn compress(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes)?;
    encoder.finish()
}
