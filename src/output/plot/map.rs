//! Maps: a scalar over a part of the plane as colours, with lines and arrows above it, as SVG and PNG.
//!
//! A map knows nothing of meshes and fields. It asks *samplers* for values: functions of a point that say nothing
//! ([`None`]) where there is nothing, so a field of a run, data on a grid or a formula are drawn alike:
//!
//! ```
//! use monolayer::mesh::Point;
//! use monolayer::output::plot::map::{Layer, Map, Palette, Window};
//!
//! let ring = |x: Point| (x.norm() > 1.0).then(|| x.norm());
//! let turn = |x: Point| Some(Point::new(-x.y, x.x));
//! let map = Map {
//!     title: "distance".into(),
//!     name: "r".into(),
//!     palette: Palette::Sequential,
//!     layers: vec![Layer::Arrows { name: "|v|".into(), of: &turn }],
//!     ..Map::new(Window::new([-2., -2.], [4., 2.])?, &ring)
//! };
//! # #[cfg(feature = "pictures")]
//! assert!(map.draw()?.svg().contains("<image"));
//! # Ok::<(), monolayer::output::plot::PlotError>(())
//! ```
//!
//! Each pixel has the colour of the value at its centre, and is white where there is none. In the SVG the pixels are
//! one embedded image, and all else is drawn as lines and text. Axes have the same scale in both directions.

#[cfg(feature = "pictures")]
pub(super) mod arrange;
#[cfg(feature = "pictures")]
mod arrows;
#[cfg(feature = "pictures")]
mod bodies;
#[cfg(feature = "pictures")]
mod contour;
#[cfg(feature = "pictures")]
mod palette;
#[cfg(feature = "pictures")]
mod pixels;

use std::path::{Path, PathBuf};

#[cfg(feature = "pictures")]
pub use contour::{contours, nice_levels};

use super::drawn::{self, Drawn};
use super::{PlotError, with_suffix, write_file};
use crate::mesh::Point;
use crate::shape::{Pose, Shape};

/// A scalar at a point; `None`, or a value that is not finite, where there is none.
pub type Scalar<'a> = &'a (dyn Fn(Point) -> Option<f64> + Sync);

/// A vector at a point; `None`, or a vector that is not finite, where there is none.
pub type Vector<'a> = &'a (dyn Fn(Point) -> Option<Point> + Sync);

/// Sides of a window differ by at most this factor.
pub const LONGEST: f64 = 25.0;

/// The part of the plane that a map shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    low: Point,
    high: Point,
}

impl Window {
    /// From the lower left to the upper right corner.
    ///
    /// # Errors
    /// [`PlotError::Window`] for corners that are not finite or not in this order, and for a side more than [`LONGEST`]
    /// times as long as the other.
    pub fn new(low: [f64; 2], high: [f64; 2]) -> Result<Self, PlotError> {
        let size = Point::from(high) - Point::from(low);
        let fits = size.min() > 0.0 && size.max() <= LONGEST * size.min() && size.max().is_finite();
        if fits {
            Ok(Self { low: low.into(), high: high.into() })
        } else {
            Err(PlotError::Window { low, high, limit: LONGEST })
        }
    }

    /// From the lower left to the upper right corner of axes that are drawn with scales of their own, so that the sides
    /// may differ by any factor; see [`Map::height`].
    ///
    /// # Errors
    /// [`PlotError::Window`] for corners that are not finite or not in this order.
    pub fn of_two_scales(low: [f64; 2], high: [f64; 2]) -> Result<Self, PlotError> {
        let size = Point::from(high) - Point::from(low);
        let fits = size.min() > 0.0 && size.max().is_finite();
        let window = Self { low: low.into(), high: high.into() };
        if fits { Ok(window) } else { Err(PlotError::Window { low, high, limit: f64::INFINITY }) }
    }

    /// Around all of these points with a little margin; higher or wider where one side would be too short.
    ///
    /// # Errors
    /// [`PlotError::Window`] for no points, one point or points that are not finite.
    pub fn around(points: impl Iterator<Item = Point>) -> Result<Self, PlotError> {
        let none = (Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY));
        let (low, high) = points.fold(none, |(low, high), x| (low.inf(&x), high.sup(&x)));
        let middle = (low + high) / 2.0;
        let longest = (high - low).max();
        let half = (high - low).map(|side| 0.5 * side.max(longest / (0.9 * LONGEST)) + 0.01 * longest);
        Self::new((middle - half).into(), (middle + half).into())
    }

    /// Lower left corner.
    pub fn low(&self) -> Point {
        self.low
    }

    /// Upper right corner.
    pub fn high(&self) -> Point {
        self.high
    }

    /// Width and height.
    pub fn size(&self) -> Point {
        self.high - self.low
    }

    /// The point at these shares of the way from left to right and from bottom to top.
    pub fn at(&self, across: f64, up: f64) -> Point {
        self.low + self.size().component_mul(&Point::new(across, up))
    }

    /// Whether it contains the point, its edges included.
    pub fn contains(&self, x: Point) -> bool {
        let (a, b) = (x - self.low, self.high - x);
        a.min() >= 0.0 && b.min() >= 0.0
    }
}

/// What one map shows.
#[derive(Clone)]
pub struct Map<'a> {
    /// Title line; wrapped when too long; may be empty.
    pub title: String,
    /// Line below the title, for the parameters; wrapped when too long; may be empty.
    pub subtitle: String,
    /// Names of the horizontal and the vertical axis.
    pub axes: [String; 2],
    /// Part of the plane that is shown.
    pub window: Window,
    /// Height of the axes on paper over their width; without it both axes have one scale.
    pub height: Option<f64>,
    /// Name of the scalar, as a formula.
    pub name: String,
    /// The scalar.
    pub scalar: Scalar<'a>,
    /// Colours of its values.
    pub palette: Palette,
    /// Values at the ends of the colour bar, low < high; those beyond get the colour of the end. By default the
    /// smallest and the largest value that are shown.
    pub range: Option<[f64; 2]>,
    /// Drawn above the colours, in this order.
    pub layers: Vec<Layer<'a>>,
}

/// Something that is drawn above the colours.
#[derive(Clone)]
pub enum Layer<'a> {
    /// Polylines, cut off at the edges of the window.
    Lines {
        /// Their points.
        lines: Vec<Vec<Point>>,
        /// How they are drawn.
        look: Look,
    },
    /// Contour lines of a scalar at evenly spaced levels, which lie half a spacing beside its multiples; the spacing is
    /// told below the map.
    Contours {
        /// Name of the spacing, such as `Δψ`.
        name: String,
        /// The scalar, continuous where it has values.
        of: Scalar<'a>,
    },
    /// Arrows on a regular grid, their middles at the grid's points and their lengths proportional to the vector's; one
    /// of a round length is told below the map.
    Arrows {
        /// Name of the vector's length, such as `|v|`.
        name: String,
        /// The vector.
        of: Vector<'a>,
    },
    /// Rigid bodies, cut off at the edges of the window.
    Bodies(Vec<Placed>),
    /// Straight lines as wide as the size of their values, full ones for values above zero and hollow ones below; the
    /// largest values are told below the map.
    Links {
        /// Name of the values, such as `λ`.
        name: String,
        /// Those of value zero are left out.
        links: Vec<Link>,
    },
    /// Polylines that are hatched on their right, and grey discs.
    Walls {
        /// Their points.
        lines: Vec<Vec<Point>>,
        /// Centre and radius.
        discs: Vec<(Point, f64)>,
    },
}

/// Look of polylines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Dark: the boundary of a domain.
    Outline,
    /// Thin and grey: the edges of a mesh.
    Mesh,
}

/// A body where it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed {
    /// Its outline in its own frame.
    pub shape: Shape,
    /// Its place.
    pub pose: Pose,
    /// Its colour.
    pub fill: Fill,
    /// Whether a line from its centre along its first axis shows its angle.
    pub mark: bool,
    /// Written on it where there is room; may be empty.
    pub name: String,
}

/// Colour of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fill {
    /// A grey that stands for no value.
    Neutral,
    /// The colour of a value in the map's palette.
    Value(f64),
    /// One of twelve that differ, modulo 12.
    Number(usize),
}

/// A line between two points, as wide as its value is large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// One end.
    pub from: Point,
    /// The other end.
    pub to: Point,
    /// Such as the force of a contact; its sign decides between a full and a hollow line.
    pub value: f64,
}

/// Which colours stand for the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Palette {
    /// For values of one sign: from dark to light (viridis), evenly spaced to the eye, and in grey as well.
    #[default]
    Sequential,
    /// For values of both signs: blue below zero, a light grey at zero, red above, equally strong on both sides.
    Diverging,
}

/// A map that was drawn.
pub struct Picture {
    pub(super) drawn: Drawn,
    pub(super) extent: [f64; 2],
    pub(super) range: [f64; 2],
}

impl<'a> Map<'a> {
    /// A map without texts and layers, with axes `x₁` and `x₂`.
    pub fn new(window: Window, scalar: Scalar<'a>) -> Self {
        Self {
            title: String::new(),
            subtitle: String::new(),
            axes: ["x₁".to_owned(), "x₂".to_owned()],
            window,
            height: None,
            name: String::new(),
            scalar,
            palette: Palette::Sequential,
            range: None,
            layers: Vec::new(),
        }
    }

    /// Smallest and largest value that the map would show.
    ///
    /// # Errors
    /// [`PlotError::Font`] if the embedded font cannot be read; [`PlotError::Blank`] where the scalar has no value in
    /// the window.
    pub fn extent(&self) -> Result<[f64; 2], PlotError> {
        drawn::extent(self)
    }

    /// Samples the scalar and places everything.
    ///
    /// # Errors
    /// [`PlotError::Font`] if the embedded font cannot be read; [`PlotError::Blank`] where the scalar has no value in
    /// the window; [`PlotError::Off`] in a build without pictures.
    pub fn draw(&self) -> Result<Picture, PlotError> {
        drawn::map(self)
    }

    /// Places the layers on white: the scalar counts for nothing, and the colour bar shows the values of the bodies;
    /// without such values there is none.
    ///
    /// # Errors
    /// [`PlotError::Font`] if the embedded font cannot be read; [`PlotError::Off`] in a build without pictures.
    pub fn draw_layers(&self) -> Result<Picture, PlotError> {
        drawn::layers(self)
    }
}

impl Picture {
    /// Smallest and largest value that is shown; NaN where a picture without a scalar shows none.
    pub fn extent(&self) -> [f64; 2] {
        self.extent
    }

    /// Values at the ends of the colour bar.
    pub fn range(&self) -> [f64; 2] {
        self.range
    }

    /// The SVG document, 840 units wide.
    pub fn svg(&self) -> String {
        self.drawn.svg()
    }

    /// The bytes of a PNG file, [`PNG_SCALE`](super::PNG_SCALE) times as large as the SVG, on white.
    ///
    /// # Errors
    /// [`PlotError::Canvas`] if the picture is too high, [`PlotError::Encode`] if the encoder fails.
    pub fn png(&self) -> Result<Vec<u8>, PlotError> {
        self.drawn.png()
    }

    /// Writes `<path>.svg` and `<path>.png`; nothing is written if the latter cannot be drawn. The endings are
    /// appended, the folder must exist.
    ///
    /// # Errors
    /// [`PlotError::Canvas`] or [`PlotError::Encode`] if there can be no PNG, [`PlotError::Write`] if a file cannot be
    /// written, [`PlotError::Foreign`] if it would replace one that is not ours.
    pub fn write(&self, path_without_extension: &Path) -> Result<(), PlotError> {
        let png = self.png()?;
        write_file(path_without_extension, ".svg", self.svg().as_bytes())?;
        write_file(path_without_extension, ".png", &png)
    }

    /// As [`Picture::write`], but never replaces another picture: where one has this name, `-2`, `-3`, … is appended.
    /// Returns the path that was taken, without ending.
    ///
    /// # Errors
    /// [`PlotError::Canvas`] or [`PlotError::Encode`] if there can be no PNG, [`PlotError::Write`] if a file cannot be
    /// written.
    pub fn write_new(&self, path_without_extension: &Path) -> Result<PathBuf, PlotError> {
        let (svg, png) = (self.svg(), self.png()?);
        let files = [(".svg", svg.as_bytes()), (".png", &png)];
        let numbered = |number: usize| with_suffix(path_without_extension, &format!("-{number}"));
        let free_or_same = |path: &PathBuf| {
            files.iter().all(|(ending, bytes)| {
                let file = with_suffix(path, ending);
                // what cannot be read is somebody else's
                !file.exists() || std::fs::read(&file).is_ok_and(|there| there == *bytes)
            })
        };
        let names = std::iter::once(path_without_extension.to_owned()).chain((2..).map(numbered));
        let path = names.into_iter().find(free_or_same).expect("numbers do not end");
        files.iter().try_for_each(|(ending, bytes)| write_file(&path, ending, bytes))?;
        Ok(path)
    }
}
