//! Line plots as SVG and PNG: convergence (log-log) with reference slopes, residual and energy curves, branch diagrams.
//!
//! Both files are drawn from one list of shapes, so they show the same picture. Text is measured and, in the
//! PNG, filled with the embedded DejaVu Sans, so no font has to be installed.
//!
//! Every text understands a little markup: Unicode scripts (`L²`, `10⁻³`, `vₕ`), `_x` and `^x` with one letter,
//! digit or ∞ that ends the word (`Δ_h p`), and `_{…}`, `^{…}`. Anything else, such as `my_name`, is drawn as it is.

#[cfg(feature = "pictures")]
mod axis;
#[cfg(feature = "pictures")]
mod drawn;
#[cfg(not(feature = "pictures"))]
#[path = "plot/undrawn.rs"]
mod drawn;
pub mod grid;
#[cfg(feature = "pictures")]
mod header;
#[cfg(feature = "pictures")]
mod layout;
#[cfg(feature = "pictures")]
mod legend;
pub mod map;
#[cfg(feature = "pictures")]
mod raster;
#[cfg(feature = "pictures")]
mod scene;
#[cfg(feature = "pictures")]
mod slope;
#[cfg(feature = "pictures")]
mod svg;
#[cfg(feature = "pictures")]
mod text;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::{OutputError, mark};
use crate::names::absent;

/// What has to be built for pictures, and what it does.
pub(crate) const FEATURE: &str = "pictures";
pub(crate) const DOES: &str = "draws maps and plots";

/// Pixels of the PNG per unit of the SVG.
pub const PNG_SCALE: u32 = 2;

/// What one picture shows.
///
/// The picture is 840 units wide; its height follows from the text and the legend. Points that an axis cannot show
/// (not finite, or not positive on a [`Scale::Log`] axis) break the line, and the subtitle says how many there were.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plot {
    /// Title line; wrapped when too long; may be empty.
    pub title: String,
    /// Small line below the title, for the parameters; wrapped when too long; may be empty.
    pub subtitle: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves and points, drawn (later ones above earlier ones) and listed in this order; 12 colours and markers,
    /// further curves reuse the colours.
    pub series: Vec<Series>,
    /// Reference slopes; drawn only if both axes are [`Scale::Log`], otherwise the subtitle says they were left out.
    pub slopes: Vec<Slope>,
}

/// One axis: what it measures, and how values are placed on it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// Name of the quantity, with its unit if it has one.
    pub label: String,
    /// Placement of the values.
    pub scale: Scale,
}

/// Placement of values on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Position proportional to the value.
    #[default]
    Linear,
    /// Position proportional to log₁₀ of the value; shows positive values only.
    Log,
}

/// One curve: markers joined by straight lines; or points on their own.
///
/// In a branch diagram, the stable and the unstable parts of a branch are two series of one name and one colour, with a
/// solid and with a dashed line; folds, pitchforks and Hopf points are series without a line. A name without points
/// only stands in the legend, and can say there what dashes mean.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Name in the legend. Series of the same name and colour share an entry, which shows a solid line if one of them
    /// has it; without a name there is no entry.
    pub name: String,
    /// Points (x, y) in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
    /// What joins the points.
    pub line: Line,
    /// What stands at the points.
    pub markers: Markers,
    /// Number of the colour, modulo 12; by default the position in the list of series.
    pub colour: Option<usize>,
}

/// Line that joins the points of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Line {
    /// Solid with the first six colours, dashed with the other six.
    #[default]
    Auto,
    /// Through all points.
    Solid,
    /// Through all points, with gaps.
    Dashed,
    /// None: every point has its marker, and no points are joined.
    None,
}

/// Markers at the points of a series; on a line through many or close points, at some of them only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Markers {
    /// One of twelve, which goes with the colour.
    #[default]
    Auto,
    /// A line alone.
    None,
    /// Of the series' colour.
    Filled(Symbol),
    /// An outline of the series' colour.
    Open(Symbol),
    /// Open, with the name of the series beside each instead of in the legend: a time on a curve.
    Named(Symbol),
}

/// Shape of a marker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symbol {
    /// Round.
    Circle,
    /// With four corners, on a side.
    Square,
    /// Pointing up.
    Triangle,
    /// With four corners, on one of them.
    Diamond,
    /// Pointing down.
    TriangleDown,
    /// With five points.
    Star,
}

/// Reference slope: a small triangle whose hypotenuse is y = c xᵖ, with p written beside it.
///
/// It is put near the lowest curve whose own order is about p, where it covers no curve if such a place exists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slope {
    /// Order p; a p that is not finite is left out, and the subtitle says so.
    pub order: f64,
}

/// Why a plot could not be made.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// What draws is not in this build.
    #[error("no picture: {}; hint: build with `--features pictures`", absent(FEATURE, DOES))]
    Off,
    /// The embedded font could not be read.
    #[error("embedded font: {reason}, must be a readable TrueType font; hint: check the `dejavu` dependency")]
    Font {
        /// What the font reader said.
        reason: String,
    },
    /// The picture is too large for a pixel image.
    #[error("picture of {width} x {height} pixels: must be at most {limit} pixels high; hint: shorten texts or legend")]
    Canvas {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Largest height allowed.
        limit: u32,
    },
    /// The pixels could not be encoded.
    #[error("PNG encoding: {reason}, must succeed; hint: write the SVG only")]
    Encode {
        /// What the encoder said.
        reason: String,
    },
    /// The part of the plane that a map shows cannot be drawn.
    #[error(
        "map window [{}, {}] to [{}, {}]: must be finite, increasing, and at most {limit} times as long as wide; hint: \
         give the lower left and the upper right corner",
        low[0], low[1], high[0], high[1]
    )]
    Window {
        /// Lower left corner.
        low: [f64; 2],
        /// Upper right corner.
        high: [f64; 2],
        /// Largest ratio of the sides.
        limit: f64,
    },
    /// A file that is not ours to replace.
    #[error(transparent)]
    Foreign(Box<OutputError>),
    /// A map has nothing to show.
    #[error("`{name}` has no value in the window of the map; hint: choose a window that meets the domain")]
    Blank {
        /// Name of the quantity.
        name: String,
    },
    /// A file could not be written.
    #[error("plot file {path}: {source}, must be writable; hint: create the folder and check its permissions")]
    Write {
        /// File concerned.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
}

impl Axis {
    /// Makes a linear axis.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Linear }
    }

    /// Makes a logarithmic axis.
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), scale: Scale::Log }
    }
}

impl Series {
    /// Makes a curve with the look that goes with its position in the list.
    pub fn new(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, ..Self::default() }
    }
}

impl Plot {
    /// Draws the picture as an SVG document.
    ///
    /// # Errors
    /// [`PlotError::Font`] if the embedded font cannot be read, [`PlotError::Off`] in a build without pictures.
    pub fn svg(&self) -> Result<String, PlotError> {
        Ok(drawn::plot(self)?.svg())
    }

    /// Draws the picture as the bytes of a PNG file, [`PNG_SCALE`] times as large as the SVG, on white.
    ///
    /// # Errors
    /// [`PlotError::Font`] if the embedded font cannot be read, [`PlotError::Canvas`] if texts or legend make the
    /// picture too high, [`PlotError::Encode`] if the encoder fails, [`PlotError::Off`] in a build without pictures.
    pub fn png(&self) -> Result<Vec<u8>, PlotError> {
        drawn::plot(self)?.png()
    }

    /// Writes `<path>.svg` and `<path>.png`; nothing is written if one of them cannot be drawn.
    ///
    /// The endings are appended, so a dot in the name stays. The folder must exist.
    ///
    /// # Errors
    /// [`PlotError::Font`], [`PlotError::Canvas`] or [`PlotError::Encode`] if it cannot be drawn, [`PlotError::Write`]
    /// if a file cannot be written, and [`PlotError::Foreign`] if it is there and not one of this program.
    pub fn write(&self, path_without_extension: &Path) -> Result<(), PlotError> {
        let drawn = drawn::plot(self)?;
        let png = drawn.png()?;
        write_file(path_without_extension, ".svg", drawn.svg().as_bytes())?;
        write_file(path_without_extension, ".png", &png)
    }
}

/// The outcome of writing a picture that nobody asked for, beside tables that say the same: a build without pictures
/// leaves it out.
///
/// # Errors
/// Those of the picture, but for [`PlotError::Off`].
pub(crate) fn if_drawn(written: Result<(), PlotError>) -> Result<(), PlotError> {
    match written {
        Err(PlotError::Off) => Ok(()),
        other => other,
    }
}

fn with_suffix(stem: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(stem);
    name.push(suffix);
    PathBuf::from(name)
}

fn write_file(stem: &Path, ending: &str, bytes: &[u8]) -> Result<(), PlotError> {
    let path = with_suffix(stem, ending);
    mark::check(&path).map_err(|error| PlotError::Foreign(Box::new(error)))?;
    // as everything: at any moment the old picture or the new one
    let part = with_suffix(&path, ".part");
    let written = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, &path));
    written.map_err(|source| PlotError::Write { path, source })
}
