//! Colours, markers and the legend.

use super::scene::{Anchor, Group, INK, Paint, Rgb, Shape, Stroke, Text, WHITE};
use super::text::{Font, Label};
use super::{Line, Markers, Series, Symbol};
use std::f64::consts::TAU;

const SIZE: f64 = 21.0;
const LINE: f64 = 31.0;
const SAMPLE: f64 = 46.0;
const GAP: f64 = 9.0;
const RADIUS: f64 = 6.5;
const LINE_WIDTH: f64 = 2.4;

/// Widest and longest legend beside the axes; anything larger goes below them.
const WIDEST: f64 = 290.0;
const LONGEST: usize = 15;

// The colours of Okabe and Ito without yellow, which is too light for thin lines on white, then darker ones.
pub(super) const COLOURS: [Rgb; 12] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0x00, 0x00, 0x00],
    [0xe6, 0x9f, 0x00],
    [0x56, 0xb4, 0xe9],
    [0x88, 0x22, 0x55],
    [0x33, 0x22, 0x88],
    [0x99, 0x99, 0x33],
    [0x77, 0x77, 0x77],
    [0x66, 0x33, 0x00],
];

/// Symbols in the order in which curves take them, filled first and then open.
const SYMBOLS: [Symbol; 6] =
    [Symbol::Circle, Symbol::Square, Symbol::Triangle, Symbol::Diamond, Symbol::TriangleDown, Symbol::Star];

/// Appearance of a series; the first twelve differ in colour and in marker.
#[derive(Clone, Copy)]
pub(super) struct Style {
    number: usize,
    line: Line,
    markers: Markers,
}

impl Style {
    /// The style of the series at a position in the list.
    pub fn of(position: usize, series: &Series) -> Self {
        Self {
            number: series.colour.map_or(position, |colour| colour % COLOURS.len()),
            line: series.line,
            markers: series.markers,
        }
    }

    fn colour(self) -> Rgb {
        COLOURS[self.number % COLOURS.len()]
    }

    /// Line of the curve, if it has one.
    pub fn line(self) -> Option<Paint> {
        let dashed = match self.line {
            Line::Auto => self.number % COLOURS.len() >= 6,
            Line::Solid => false,
            Line::Dashed => true,
            Line::None => return None,
        };
        Some(Paint { fill: None, stroke: Some(Stroke { colour: self.colour(), width: LINE_WIDTH, dashed }) })
    }

    /// Which of the series that share a legend entry gives it its look: one with a solid line before one with dashes,
    /// and that before points on their own.
    fn rank(self) -> u8 {
        match self.line().and_then(|paint| paint.stroke) {
            Some(stroke) => {
                if stroke.dashed {
                    1
                } else {
                    2
                }
            }
            None => 0,
        }
    }

    /// Symbol, and whether it is open; curves beyond the twelfth pair the automatic ones with other colours.
    fn symbol(self) -> Option<(Symbol, bool)> {
        match self.markers {
            Markers::Auto => {
                let kind = self.number + self.number / COLOURS.len();
                Some((SYMBOLS[kind % 6], kind / 6 % 2 == 1))
            }
            Markers::None => None,
            Markers::Filled(symbol) => Some((symbol, false)),
            Markers::Open(symbol) | Markers::Named(symbol) => Some((symbol, true)),
        }
    }

    /// Marker, if the series has them.
    pub fn marker(self, centre: (f64, f64)) -> Option<Shape> {
        let (symbol, open) = self.symbol()?;
        let paint = if open { Paint::area(WHITE, self.colour(), 2.2) } else { Paint::area(self.colour(), WHITE, 1.0) };
        let radius = if open { RADIUS } else { RADIUS + 0.6 };
        let polygon = |corners: usize, turn: f64, inner: f64, size: f64| {
            let corner = |k: usize| {
                let angle = TAU * (k as f64 / corners as f64 + turn);
                let r = radius * size * if k.is_multiple_of(2) { 1.0 } else { inner };
                (centre.0 + r * angle.sin(), centre.1 - r * angle.cos())
            };
            Shape::Poly { points: (0..corners).map(corner).collect(), closed: true, paint }
        };
        Some(match symbol {
            Symbol::Circle => Shape::Circle { centre, radius, paint },
            Symbol::Square => polygon(4, 0.125, 1.0, 1.22),
            Symbol::Triangle => polygon(6, 0.0, 0.5, 1.35),
            Symbol::Diamond => polygon(4, 0.0, 1.0, 1.35),
            Symbol::TriangleDown => polygon(6, 0.5, 0.5, 1.35),
            Symbol::Star => polygon(10, 0.0, 0.45, 1.6),
        })
    }
}

/// Named curves in columns.
pub(super) struct Legend {
    entries: Vec<(Style, Label)>,
    column: f64,
    columns: usize,
    /// Whether it stands below the axes instead of to their right.
    pub below: bool,
}

impl Legend {
    /// Arranges the names in a picture of a given width.
    pub fn new(series: &[Series], font: &Font, room: f64) -> Self {
        let beside = |s: &Series| matches!(s.markers, Markers::Named(_));
        let named = series.iter().enumerate().filter(|(_, s)| !s.name.trim().is_empty() && !beside(s));
        let mut entries: Vec<(Style, Label)> = Vec::new();
        for (style, name) in named.map(|(i, s)| (Style::of(i, s), &s.name)) {
            match entries.iter_mut().find(|(other, label)| other.number == style.number && label.source == *name) {
                Some((shown, _)) if style.rank() > shown.rank() => *shown = style,
                Some(_) => {}
                None => entries.push((style, Label::parse(name))),
            }
        }
        let longest = entries.iter().map(|(_, label)| font.width(label, SIZE)).fold(0.0, f64::max);
        let column = (SAMPLE + GAP + longest).min(room);
        let below = column > WIDEST || entries.len() > LONGEST;
        let fitting = ((room + 2.0 * GAP) / (column + 2.0 * GAP)).floor().max(1.0) as usize;
        let columns = if below { fitting.min(entries.len().max(1)) } else { 1 };
        Self { entries, column, columns, below }
    }

    /// Width of one column, 0 without entries.
    pub fn width(&self) -> f64 {
        if self.entries.is_empty() { 0.0 } else { self.column }
    }

    /// Height of all rows.
    pub fn height(&self) -> f64 {
        self.entries.len().div_ceil(self.columns) as f64 * LINE
    }

    /// Draws the entries from the upper left corner `at`, row by row.
    pub fn draw(self, at: (f64, f64), font: &Font) -> Group {
        let mut group = Group::default();
        let (columns, column) = (self.columns, self.column);
        for (k, (style, label)) in self.entries.into_iter().enumerate() {
            let x = at.0 + (k % columns) as f64 * (column + 2.0 * GAP);
            let y = at.1 + ((k / columns) as f64 + 0.5) * LINE;
            let points = vec![(x, y), (x + SAMPLE, y)];
            group.shapes.extend(style.line().map(|paint| Shape::Poly { points, closed: false, paint }));
            group.shapes.extend(style.marker((x + SAMPLE / 2.0, y)));
            let size = font.fit(&label, SIZE, column - SAMPLE - GAP + 0.01);
            let baseline = (x + SAMPLE + GAP, y + 0.36 * size);
            group.shapes.push(Shape::Text(Text::new(label, baseline, size, Anchor::Start, INK)));
        }
        group
    }
}
