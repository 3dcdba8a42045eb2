//! The shapes of a picture, independent of the file format. Units: SVG user units, y downwards.

use super::text::Label;

/// Colour as red, green, blue.
pub(super) type Rgb = [u8; 3];

/// Black of frame and text.
pub(super) const INK: Rgb = [0x22, 0x22, 0x22];
/// Grey of secondary text and reference slopes.
pub(super) const GREY: Rgb = [0x55, 0x55, 0x55];
/// Light grey of the grid.
pub(super) const GRID: Rgb = [0xdd, 0xdd, 0xdd];
/// Paper.
pub(super) const WHITE: Rgb = [0xff, 0xff, 0xff];

/// Dash lengths (on, off).
pub(super) const DASH: [f64; 2] = [9.0, 5.0];

/// A whole picture on white.
pub(super) struct Scene {
    pub width: f64,
    pub height: f64,
    pub title: String,
    pub groups: Vec<Group>,
}

/// Shapes drawn in order; the name says in the SVG what they belong to.
#[derive(Default)]
pub(super) struct Group {
    pub name: Option<String>,
    pub shapes: Vec<Shape>,
}

/// One thing to draw.
pub(super) enum Shape {
    Poly { points: Vec<(f64, f64)>, closed: bool, paint: Paint },
    Circle { centre: (f64, f64), radius: f64, paint: Paint },
    Text(Text),
    Image(Image),
}

/// Pixels, row by row from the upper left corner, spread evenly over `rect`.
pub(super) struct Image {
    pub rect: Rect,
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<Rgb>,
}

/// How a shape is filled and outlined.
#[derive(Clone, Copy, Default)]
pub(super) struct Paint {
    pub fill: Option<Rgb>,
    pub stroke: Option<Stroke>,
}

/// Outline.
#[derive(Clone, Copy)]
pub(super) struct Stroke {
    pub colour: Rgb,
    pub width: f64,
    pub dashed: bool,
}

/// Which point of the text lies at its position.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// One line of text; `at` is on its baseline.
pub(super) struct Text {
    pub label: Label,
    pub at: (f64, f64),
    pub size: f64,
    pub anchor: Anchor,
    pub upwards: bool,
    pub colour: Rgb,
}

impl Text {
    /// Makes horizontal text.
    pub fn new(label: Label, at: (f64, f64), size: f64, anchor: Anchor, colour: Rgb) -> Self {
        Self { label, at, size, anchor, upwards: false, colour }
    }
}

impl Paint {
    /// Outline only.
    pub fn line(colour: Rgb, width: f64) -> Self {
        Self { fill: None, stroke: Some(Stroke { colour, width, dashed: false }) }
    }

    /// Fill and solid outline.
    pub fn area(fill: Rgb, colour: Rgb, width: f64) -> Self {
        Self { fill: Some(fill), ..Self::line(colour, width) }
    }
}

impl Shape {
    /// Straight solid line.
    pub fn line(from: (f64, f64), to: (f64, f64), colour: Rgb, width: f64) -> Self {
        Self::Poly { points: vec![from, to], closed: false, paint: Paint::line(colour, width) }
    }
}

/// Rectangle; `y1` is its lower edge on paper.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rect {
    pub x0: f64,
    pub y0: f64,
    pub x1: f64,
    pub y1: f64,
}

impl Rect {
    pub fn width(&self) -> f64 {
        self.x1 - self.x0
    }

    pub fn height(&self) -> f64 {
        self.y1 - self.y0
    }

    pub fn grow(&self, by: f64) -> Self {
        Self { x0: self.x0 - by, y0: self.y0 - by, x1: self.x1 + by, y1: self.y1 + by }
    }

    pub fn contains(&self, (x, y): (f64, f64)) -> bool {
        (self.x0..=self.x1).contains(&x) && (self.y0..=self.y1).contains(&y)
    }

    /// The part of the segment from a to b that lies between all four edges, as shares of its length.
    pub fn part(&self, a: (f64, f64), b: (f64, f64)) -> Option<(f64, f64)> {
        let mut part = (0.0f64, 1.0f64);
        for (from, to, lo, hi) in [(a.0, b.0, self.x0, self.x1), (a.1, b.1, self.y0, self.y1)] {
            let step = to - from;
            if step == 0.0 {
                if from < lo || from > hi {
                    return None;
                }
                continue;
            }
            let (s, t) = ((lo - from) / step, (hi - from) / step);
            part = (part.0.max(s.min(t)), part.1.min(s.max(t)));
        }
        (part.0 <= part.1).then_some(part)
    }

    pub fn overlaps(&self, other: &Self) -> bool {
        self.x0 < other.x1 && other.x0 < self.x1 && self.y0 < other.y1 && other.y0 < self.y1
    }
}
