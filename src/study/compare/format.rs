//! Forms of tables that are known by name: which columns they have, and how these are meant.

use schemars::JsonSchema;
use serde::Deserialize;

/// A form of tables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Names as in a comparison made by hand.
    #[default]
    Table,
    /// Texts that PIVlab exports, one for each frame.
    #[serde(rename = "pivlab")]
    PivLab,
    /// Texts that OpenPIV saves, one for each frame.
    #[serde(rename = "openpiv")]
    OpenPiv,
    /// The table of spots that TrackMate exports.
    #[serde(rename = "trackmate")]
    TrackMate,
}

/// Which way the second coordinate of a table grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Up.
    Up,
    /// As in images.
    Down,
}

/// What a form has.
#[derive(Debug)]
pub(super) struct Form {
    pub x: &'static str,
    pub y: &'static str,
    /// `None` where each frame has a file of its own.
    pub t: Option<&'static str>,
    /// Names of the velocity's columns, or of that of the track which the velocity is found from.
    pub motion: Motion,
    pub y_is: Direction,
    /// Columns and their values in rows that were measured.
    pub keep: &'static [(&'static str, &'static [f64])],
    /// Files may come without names; the columns are then x, y, the motion and those of `keep`, in this order.
    pub in_order: bool,
}

/// What tells the velocity.
#[derive(Debug, Clone, Copy)]
pub(super) enum Motion {
    Velocity(&'static str, &'static str),
    Track(&'static str),
}

impl Format {
    pub(super) fn form(self) -> &'static Form {
        match self {
            Format::Table => &TABLE,
            Format::PivLab => &PIVLAB,
            Format::OpenPiv => &OPENPIV,
            Format::TrackMate => &TRACKMATE,
        }
    }
}

const TABLE: Form = Form {
    x: "x",
    y: "y",
    t: Some("t"),
    motion: Motion::Velocity("vx", "vy"),
    y_is: Direction::Up,
    keep: &[],
    in_order: false,
};

/// Of vectors that were filtered out and replaced by interpolation the type is 2 or more, of those under the mask 0.
const PIVLAB: Form = Form {
    x: "x",
    y: "y",
    t: None,
    motion: Motion::Velocity("u", "v"),
    y_is: Direction::Down,
    keep: &[("Vector type", &[1.0])],
    in_order: true,
};

const OPENPIV: Form = Form {
    x: "x",
    y: "y",
    t: None,
    motion: Motion::Velocity("u", "v"),
    y_is: Direction::Up,
    keep: &[("flags", &[0.0]), ("mask", &[0.0])],
    in_order: true,
};

const TRACKMATE: Form = Form {
    x: "POSITION_X",
    y: "POSITION_Y",
    t: Some("FRAME"),
    motion: Motion::Track("TRACK_ID"),
    y_is: Direction::Down,
    keep: &[],
    in_order: false,
};
