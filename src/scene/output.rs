//! `[[output]]`: what is written, and when.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, de};

use super::maps::{MapRequest, MapTable};
use crate::measure::OutputField;
use crate::measure::fields::{IN_CUTS, Tool};
use crate::measure::list::{ALL, Asked};
use crate::mesh::Point;
use crate::schema::{self, FLOWS, Range, TISSUE, WITH_BODIES};
use crate::scheme::Schedule;

/// The six axes of the strip, lengths in disc radii.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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

/// Most points of a cut.
pub const MOST_POINTS: usize = 10_000_000;
/// Fewest points of a circle.
pub const LEAST_ON_A_CIRCLE: usize = 3;
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
    Fields(Vec<&'static OutputField>),
    /// Columns of the history.
    Measures(Vec<Asked>),
    /// Tables along lines and circles.
    Cuts {
        /// Where they lie.
        cuts: Vec<Cut>,
        /// The fields in their columns; those that there are of [`IN_CUTS`] where the scene names none.
        columns: Option<Vec<&'static OutputField>>,
    },
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
    pub fn measures(&self) -> &[Asked] {
        match self {
            What::Measures(measures) => measures,
            What::Fields(_) | What::Cuts { .. } | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => &[],
        }
    }

    /// The cuts that it names.
    pub fn cuts(&self) -> &[Cut] {
        match self {
            What::Cuts { cuts, .. } => cuts,
            What::Fields(_) | What::Measures(_) | What::Maps(_) | What::Bodies { .. } | What::Checkpoint => &[],
        }
    }

    /// The maps that it names.
    pub fn maps(&self) -> &[MapRequest] {
        match self {
            What::Maps(maps) => maps,
            What::Fields(_) | What::Measures(_) | What::Cuts { .. } | What::Bodies { .. } | What::Checkpoint => &[],
        }
    }

    /// The fields that it names, itself or by a quantity.
    pub fn fields(&self) -> Vec<&'static OutputField> {
        match self {
            What::Fields(fields) => fields.clone(),
            What::Cuts { columns, .. } => columns.clone().unwrap_or_default(),
            What::Maps(maps) => {
                let named = |map: &MapRequest| map.of.field().into_iter().chain(map.arrows.map(|arrows| arrows.0));
                maps.iter().flat_map(named).collect()
            }
            What::Measures(_) | What::Bodies { .. } | What::Checkpoint => Vec::new(),
        }
    }

    /// Whether it takes a field that something has to be made for.
    pub fn takes(&self, tool: Tool) -> bool {
        let streamlines = self.maps().iter().any(|map| map.streamlines);
        let named = self.fields().iter().any(|field| field.tool == Some(tool));
        let in_cuts = matches!(self, What::Cuts { columns: None, .. }) && IN_CUTS.iter().any(|f| f.tool == Some(tool));
        named || in_cuts || (streamlines && tool == Tool::StreamFunction)
    }
}

/// The measures that outputs name, each once and in the order of their columns.
pub fn measured(outputs: &[Output]) -> Vec<Asked> {
    let mut found: Vec<Asked> = Vec::new();
    for measure in ALL {
        let of_this = |asked: &&Asked| asked.measure == *measure;
        for asked in outputs.iter().flat_map(|output| output.what.measures()).filter(of_this) {
            if !found.contains(asked) {
                found.push(asked.clone());
            }
        }
    }
    found
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>, transform = one_each)]
pub struct OutputTable {
    /// Fields for ParaView.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::not_empty, extend("x-kinds" = FLOWS, "x-values" = "list of [fields](#fields)"))]
    pub fields: Option<Vec<&'static OutputField>>,
    /// Numbers of each step, or of the last state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::not_empty, extend("x-values" = "list of [measures](#measures)"))]
    pub measures: Option<Vec<Asked>>,
    /// Beside `measures`: their errors are [estimated](#estimates) at the end; not with `mesh.file`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = TISSUE, "default" = false))]
    pub estimate: Option<bool>,
    /// Sections through the fields.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::not_empty, extend("x-kinds" = FLOWS))]
    #[schemars(extend("x-values" = "list of `axis-1`, `-2a`, `-2b`, `-3`, `-4`, `-5`, lines, circles"))]
    pub cuts: Option<Vec<CutTable>>,
    /// Beside `cuts`: the fields in the columns of their tables.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::not_empty, extend("x-kinds" = FLOWS, "x-values" = "list of [fields](#fields)"))]
    #[schemars(extend("x-default" = "the usual ones [there](#fields)"))]
    pub columns: Option<Vec<&'static OutputField>>,
    /// Pictures, see [maps](#maps).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::not_empty, extend("x-values" = "list of quantities and of tables"))]
    pub maps: Option<Vec<MapTable>>,
    /// Polydata and a table of the rigid bodies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::only_true, extend("x-kinds" = WITH_BODIES))]
    pub bodies: Option<bool>,
    /// Beside `bodies`: a table of their contacts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-kinds" = WITH_BODIES, "default" = false))]
    pub contacts: Option<bool>,
    /// The exact state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = schema::only_true)]
    pub checkpoint: Option<bool>,
    /// How often; measures without it stand in `summary.json`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-values" = "`{ time = T }`, T > 0, or `{ steps = N }`, N ≥ 1", "x-default" = "at the end"))]
    pub every: Option<EveryTable>,
}

/// What an output writes is exactly one of these.
fn one_each(schema: &mut schemars::Schema) {
    let one = ["fields", "measures", "cuts", "maps", "bodies", "checkpoint"];
    schema.insert("oneOf".to_owned(), one.map(|key| serde_json::json!({ "required": [key] })).into());
    let beside = serde_json::json!({ "estimate": ["measures"], "columns": ["cuts"], "contacts": ["bodies"] });
    schema.insert("dependentRequired".to_owned(), beside);
}

/// `every = { time = … }` or `every = { steps = … }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>, extend("minProperties" = 1, "maxProperties" = 1))]
pub struct EveryTable {
    /// Between two outputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "time"))]
    pub time: Option<f64>,
    /// Steps between two outputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::SOME.said())]
    pub steps: Option<usize>,
}

/// An element of `cuts`: the name of an axis, a line or a circle.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CutTable {
    /// One of those that have a name.
    Axis(Axis),
    /// A line or a circle.
    Section(SectionTable),
}

/// `{ name = "…", from = [x, y], to = [x, y], points = 200 }` or
/// `{ name = "…", centre = [x, y], radius = r, points = 360 }`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = schema::in_order::<Self>, transform = schema::centre_or_center, transform = line_or_circle)]
pub struct SectionTable {
    /// Name of the file, which no other cut has.
    #[schemars(transform = schema::file_name)]
    pub name: String,
    /// First point of a line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<[f64; 2]>,
    /// Its last point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<[f64; 2]>,
    /// Centre of a circle; also spelled `center`.
    #[serde(default, alias = "center", skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 2]>,
    /// Its radius.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = Range::POSITIVE.said(), extend("x-unit" = "length"))]
    pub radius: Option<f64>,
    /// Number of points: both ends of a line included, or at equal angles on a circle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(transform = SectionTable::POINTS.said())]
    #[schemars(extend("x-default" = "200; of a circle 360", "x-rule" = "of a circle at least 3"))]
    pub points: Option<usize>,
}

/// A section has the ends of a line, or centre and radius of a circle.
fn line_or_circle(schema: &mut schemars::Schema) {
    let circle = |centre: &str| {
        let points = serde_json::json!({ "minimum": LEAST_ON_A_CIRCLE });
        serde_json::json!({ "required": [centre, "radius"], "properties": { "points": points } })
    };
    let line = serde_json::json!({ "required": ["from", "to"] });
    let forms = [line, circle("centre"), circle("center")];
    schema.insert("oneOf".to_owned(), forms.into());
}

impl SectionTable {
    /// Points of a line.
    pub const POINTS: Range = Range::within(2.0, MOST_POINTS as f64);

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
