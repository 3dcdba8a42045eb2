//! `[[output]]`: what is written, and when.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, de};

use super::maps::{MapRequest, MapTable};
use crate::measure::Measure;
use crate::measure::list::ALL;
use crate::mesh::Point;
use crate::scheme::Schedule;

/// Fields that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    /// `v`
    Velocity,
    /// `Π`, in a compressible sheet `ρΠ`, which follows from density and polarity.
    Pressure,
    /// `ρ`, of a compressible sheet.
    Density,
    /// `p`
    Polarity,
    /// `L_h`
    MolecularField,
    /// `ψ` of [B.54]
    StreamFunction,
    /// `v − (T_a/C_F) e_1`
    TissueVelocity,
    /// `κ²Δ_h p`
    PolarityLaplacian,
    /// `ε`, the elastic strain carried by the flow [12.3].
    ElasticStrain,
}

/// The six axes of the strip, lengths in disc radii.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Axis {
    /// `x_2 = 0`
    #[serde(rename = "axis-1")]
    Axis1,
    /// `x_2 = +1.66`
    #[serde(rename = "axis-2a")]
    Axis2a,
    /// `x_2 = −1.66`
    #[serde(rename = "axis-2b")]
    Axis2b,
    /// `x_1 = 0`
    #[serde(rename = "axis-3")]
    Axis3,
    /// `x_1 = +1.66`
    #[serde(rename = "axis-4")]
    Axis4,
    /// `x_1 = −1.66`
    #[serde(rename = "axis-5")]
    Axis5,
}

/// A straight line parallel to a coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AxisLine {
    /// `x_2` is this.
    Horizontal(f64),
    /// `x_1` is this.
    Vertical(f64),
}

impl Axis {
    /// Where the axis lies, in disc radii about the disc's centre.
    pub fn line(self) -> AxisLine {
        match self {
            Axis::Axis1 => AxisLine::Horizontal(0.0),
            Axis::Axis2a => AxisLine::Horizontal(1.66),
            Axis::Axis2b => AxisLine::Horizontal(-1.66),
            Axis::Axis3 => AxisLine::Vertical(0.0),
            Axis::Axis4 => AxisLine::Vertical(1.66),
            Axis::Axis5 => AxisLine::Vertical(-1.66),
        }
    }

    /// As in the scene file, and the name of the table that is written.
    pub fn name(self) -> &'static str {
        match self {
            Axis::Axis1 => "axis-1",
            Axis::Axis2a => "axis-2a",
            Axis::Axis2b => "axis-2b",
            Axis::Axis3 => "axis-3",
            Axis::Axis4 => "axis-4",
            Axis::Axis5 => "axis-5",
        }
    }
}

impl Field {
    /// In the order in which files have them: what is asked for most comes first, the only tensor last.
    pub const ALL: [Field; 9] = [
        Field::Velocity,
        Field::Pressure,
        Field::Density,
        Field::Polarity,
        Field::MolecularField,
        Field::StreamFunction,
        Field::TissueVelocity,
        Field::PolarityLaplacian,
        Field::ElasticStrain,
    ];

    /// Each once, in the order of [`Field::ALL`].
    pub fn in_order(fields: &[Field]) -> Vec<Field> {
        Self::ALL.into_iter().filter(|field| fields.contains(field)).collect()
    }

    /// As in the scene file.
    pub fn name(self) -> &'static str {
        match self {
            Field::Velocity => "velocity",
            Field::Pressure => "pressure",
            Field::Density => "density",
            Field::Polarity => "polarity",
            Field::MolecularField => "molecular_field",
            Field::StreamFunction => "stream_function",
            Field::TissueVelocity => "tissue_velocity",
            Field::PolarityLaplacian => "polarity_laplacian",
            Field::ElasticStrain => "elastic_strain",
        }
    }
}

/// Points of a cut along an axis.
pub const AXIS_POINTS: usize = 1001;

/// A section through the fields.
#[derive(Debug, Clone, PartialEq)]
pub enum Cut {
    /// One of those that the thesis has.
    Axis(Axis),
    /// `points` equidistant points from `from` to `to`, both included.
    Line {
        /// Name of its table.
        name: String,
        /// First point.
        from: Point,
        /// Last point.
        to: Point,
        /// Number of points, both ends included.
        points: usize,
    },
    /// `points` points at equal angles, counterclockwise from the one to the right of the centre.
    Circle {
        /// Name of its table.
        name: String,
        /// Its middle.
        centre: Point,
        /// Distance of its points from the middle.
        radius: f64,
        /// Number of points.
        points: usize,
    },
}

impl Cut {
    /// How many points it has.
    pub fn points(&self) -> usize {
        match self {
            Cut::Axis(_) => AXIS_POINTS,
            Cut::Line { points, .. } | Cut::Circle { points, .. } => *points,
        }
    }

    /// Name of the table that is written.
    pub fn name(&self) -> &str {
        match self {
            Cut::Axis(axis) => axis.name(),
            Cut::Line { name, .. } | Cut::Circle { name, .. } => name,
        }
    }
}

/// What one `[[output]]` writes.
#[derive(Debug, Clone, PartialEq)]
pub enum What {
    /// Whole fields, for ParaView.
    Fields(Vec<Field>),
    /// Columns of the history.
    Measures(Vec<&'static Measure>),
    /// Tables along lines and circles.
    Cuts(Vec<Cut>),
    /// Pictures.
    Maps(Vec<MapRequest>),
    /// Polydata and a table of the bodies; and a table of their contacts.
    Bodies {
        /// Whether contacts are written, too.
        contacts: bool,
    },
    /// All that a restart needs.
    Checkpoint,
}

impl What {
    /// The measures that it names.
    pub fn measures(&self) -> &[&'static Measure] {
        match self {
            What::Measures(measures) => measures,
            What::Fields(_) | What::Cuts(_) | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => &[],
        }
    }
}

/// The measures that outputs name, in the order of their columns.
pub fn measured(outputs: &[Output]) -> Vec<&'static Measure> {
    let named = |measure: &&'static Measure| outputs.iter().any(|output| output.what.measures().contains(measure));
    ALL.iter().copied().filter(named).collect()
}

/// A checked `[[output]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// What is written.
    pub what: What,
    /// When.
    pub schedule: Schedule,
    /// Whether the errors of the measures are estimated at the end.
    pub estimate: bool,
}

/// `[[output]]` as the file has it: exactly one of `fields`, `measures`, `cuts`, `maps`, `bodies`, `checkpoint`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputTable {
    /// Fields to write whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fields: Option<Vec<Field>>,
    /// Measures to take.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measures: Option<Vec<&'static Measure>>,
    /// Beside `measures`: their discretisation errors are estimated at the end (default false).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimate: Option<bool>,
    /// Lines and circles along which fields are written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cuts: Option<Vec<CutTable>>,
    /// Pictures to draw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maps: Option<Vec<MapTable>>,
    /// Rigid bodies: `true`, or left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bodies: Option<bool>,
    /// Beside `bodies`: a table of the contacts (default false).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contacts: Option<bool>,
    /// All that a restart needs: `true`, or left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<bool>,
    /// Absent: only at the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<EveryTable>,
}

/// `every = { time = … }` or `every = { steps = … }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EveryTable {
    /// After this much time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// After so many steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<usize>,
}

/// An element of `cuts`: the name of an axis, a line or a circle.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum CutTable {
    /// One of those that have a name.
    Axis(Axis),
    /// A line or a circle.
    Section(SectionTable),
}

/// `{ name = "…", from = [x, y], to = [x, y], points = 200 }` or
/// `{ name = "…", centre = [x, y], radius = r, points = 360 }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SectionTable {
    /// Name of the file that is written.
    pub name: String,
    /// Ends of a line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<[f64; 2]>,
    /// Last point of a line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<[f64; 2]>,
    /// Centre of a circle.
    #[serde(default, alias = "center", skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 2]>,
    /// Its radius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Number of points, both ends of a line included (default 200; 360 of a circle).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<usize>,
}

impl SectionTable {
    /// Whether it has a key of circles.
    pub fn is_circle(&self) -> bool {
        self.centre.is_some() || self.radius.is_some()
    }
}

impl<'de> Deserialize<'de> for CutTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CutVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct CutVisitor;

impl<'de> de::Visitor<'de> for CutVisitor {
    type Value = CutTable;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the name of an axis, { name, from = [x, y], to = [x, y], points } or { name, centre = [x, y], radius, points }")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<CutTable, E> {
        Axis::deserialize(de::value::StrDeserializer::new(name)).map(CutTable::Axis)
    }

    fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<CutTable, A::Error> {
        let mut section = SectionTable::deserialize(de::value::MapAccessDeserializer::new(map))?;
        let points = if section.is_circle() { 360 } else { 200 };
        section.points.get_or_insert(points);
        Ok(CutTable::Section(section))
    }
}
