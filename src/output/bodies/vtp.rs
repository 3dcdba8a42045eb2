//! Bodies, contacts and walls as VTK polydata (`.vtp`), with arrays as in the `.vtu` files.

use std::io::{self, Write};
use std::path::Path;

use super::Moment;
use crate::contact::{Contact, Partner, Wall};
use crate::mesh::Point;
use crate::output::vtk::{Field, field_array, integers};
use crate::output::{OutputError, write_whole};
use crate::shape::{Disc, Shape};

/// Points of an outline on a whole turn: a disc is nowhere further than 3·10⁻⁴ of its radius from its polygon.
const POINTS: usize = 128;

/// The kind of all cells of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cells {
    Lines,
    Polygons,
}

/// What a file holds: cells with their own points, and a number or two for each cell.
struct PolyData<'a> {
    time: Option<f64>,
    kind: Cells,
    cells: Vec<Vec<Point>>,
    whole: Vec<(&'a str, Vec<usize>)>,
    data: Vec<(&'a str, usize, Vec<f64>)>,
}

/// Writes a polygon for each body (straight sides exactly, round ones with 128 points on a turn), with the cell data
/// `body` (its number, from 0), `position`, `angle`, `velocity`, `spin`, and `contact_force` and `contact_torque` of
/// all its contacts.
///
/// # Errors
/// [`OutputError::NonFiniteBody`] for a number that is not finite, before anything is written; [`OutputError::Io`] for
/// a file that cannot be written.
pub fn write_bodies(path: &Path, moment: &Moment) -> Result<(), OutputError> {
    moment.check(path)?;
    let Moment { poses, twists, loads, .. } = moment;
    let pairs = |all: Vec<Point>| all.into_iter().flat_map(|x| [x.x, x.y]).collect::<Vec<f64>>();
    let data = vec![
        ("position", 2, pairs(poses.iter().map(|pose| pose.position).collect())),
        ("angle", 1, poses.iter().map(|pose| pose.angle).collect()),
        ("velocity", 2, pairs(twists.iter().map(|twist| twist.velocity).collect())),
        ("spin", 1, twists.iter().map(|twist| twist.spin).collect()),
        ("contact_force", 2, pairs(loads.iter().map(|load| load.force).collect())),
        ("contact_torque", 1, loads.iter().map(|load| load.torque).collect()),
    ];
    let cells = (0..poses.len()).map(|body| moment.outline(body, POINTS)).collect();
    let whole = vec![("body", (0..poses.len()).collect())];
    PolyData { time: Some(moment.time), kind: Cells::Polygons, cells, whole, data }.write(path)
}

/// Writes a line for each contact, from the body's centre to its partner's, or to the nearest point of the wall, with
/// the cell data `body` and `partner` (the number of a body, or after the bodies that of a wall), `multiplier`
/// (positive repels, negative holds), `friction` (along n^⊥ on the partner), `gap`, `gamma` and `normal`.
///
/// # Errors
/// [`OutputError::NonFiniteBody`] for a number that is not finite, before anything is written; [`OutputError::Io`] for
/// a file that cannot be written.
pub fn write_contacts(path: &Path, moment: &Moment) -> Result<(), OutputError> {
    moment.check(path)?;
    let contacts = moment.contacts;
    let numbers = |of: fn(&Contact) -> f64| contacts.iter().map(of).collect::<Vec<f64>>();
    let partner = |contact: &Contact| match contact.partner {
        Partner::Body(other) => other,
        Partner::Wall(wall) => moment.solids.bodies.len() + wall,
    };
    let whole = vec![
        ("body", contacts.iter().map(|contact| contact.body).collect()),
        ("partner", contacts.iter().map(partner).collect()),
    ];
    let data = vec![
        ("multiplier", 1, numbers(|contact| contact.force)),
        ("friction", 1, numbers(|contact| contact.friction)),
        ("gap", 1, numbers(|contact| contact.gap)),
        ("gamma", 1, numbers(|contact| contact.gamma)),
        ("normal", 2, contacts.iter().flat_map(|contact| [contact.normal.x, contact.normal.y]).collect()),
    ];
    let cells = contacts.iter().map(|contact| moment.ends(contact).to_vec()).collect();
    PolyData { time: Some(moment.time), kind: Cells::Lines, cells, whole, data }.write(path)
}

/// Writes a line for each wall, round ones with 128 points, with the cell data `wall` (its number, from 0).
///
/// # Errors
/// [`OutputError::Io`] for a file that cannot be written.
pub fn write_walls(path: &Path, walls: &[Wall]) -> Result<(), OutputError> {
    let cells = walls.iter().map(|wall| wall_line(wall, POINTS)).collect();
    let whole = vec![("wall", (0..walls.len()).collect())];
    PolyData { time: None, kind: Cells::Lines, cells, whole, data: Vec::new() }.write(path)
}

/// A wall as a polyline.
pub(crate) fn wall_line(wall: &Wall, points: usize) -> Vec<Point> {
    match *wall {
        Wall::Segment(ends) => ends.to_vec(),
        Wall::Disc { centre, radius } | Wall::Hollow { centre, radius } => {
            let round = Shape::from(Disc { radius }).outline(points);
            round.iter().chain(round.first()).map(|x| centre + x).collect()
        }
    }
}

impl PolyData<'_> {
    fn write(&self, path: &Path) -> Result<(), OutputError> {
        write_whole(path, |out| self.document(out))
    }

    fn document(&self, out: &mut dyn Write) -> io::Result<()> {
        let (points, cells) = (self.cells.iter().map(Vec::len).sum::<usize>(), self.cells.len());
        let (lines, polygons) = match self.kind {
            Cells::Lines => (cells, 0),
            Cells::Polygons => (0, cells),
        };
        writeln!(out, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- {} -->", crate::names::MADE_BY)?;
        write!(out, r#"<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64""#)?;
        writeln!(out, r#" compressor="vtkZLibDataCompressor">"#)?;
        writeln!(out, "<PolyData>")?;
        if let Some(time) = self.time {
            write!(out, "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" ")?;
            writeln!(out, "format=\"ascii\">{time}</DataArray>\n</FieldData>")?;
        }
        write!(
            out,
            r#"<Piece NumberOfPoints="{points}" NumberOfVerts="0" NumberOfLines="{lines}" NumberOfStrips="0" "#
        )?;
        writeln!(out, r#"NumberOfPolys="{polygons}">"#)?;
        writeln!(out, "<Points>")?;
        let positions: Vec<f64> = self.cells.iter().flatten().flat_map(|x| [x.x, x.y]).collect();
        field_array(out, &Field { name: "positions", components: 2, values: &positions })?;
        writeln!(out, "</Points>")?;
        let element = match self.kind {
            Cells::Lines => "Lines",
            Cells::Polygons => "Polys",
        };
        writeln!(out, "<{element}>")?;
        integers(out, "connectivity", 0..points)?;
        let mut end = 0;
        let ends = self.cells.iter().map(|cell| {
            end += cell.len();
            end
        });
        integers(out, "offsets", ends)?;
        writeln!(out, "</{element}>\n<CellData>")?;
        for (name, values) in &self.whole {
            integers(out, name, values.iter().copied())?;
        }
        for (name, components, values) in &self.data {
            field_array(out, &Field { name, components: *components, values })?;
        }
        writeln!(out, "</CellData>\n</Piece>\n</PolyData>\n</VTKFile>")
    }
}
