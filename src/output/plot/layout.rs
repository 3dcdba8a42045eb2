//! Places everything on the picture.

use super::axis::{Range, Tick};
use super::header::Header;
use super::legend::{Legend, Style};
use super::scene::{Anchor, GREY, GRID, Group, INK, Paint, Rect, Scene, Shape, Text};
use super::text::{Font, Label};
use super::{Line, Markers, Plot, Scale, Series, Slope, slope};

/// Width of a picture.
pub(super) const WIDTH: f64 = 840.0;
const AXES_HEIGHT: f64 = 430.0;
/// Free margin.
pub(super) const EDGE: f64 = 14.0;
/// Sizes of title and subtitle.
const HEADER_SIZES: [f64; 2] = [27.0, 20.0];
const SIZES: Sizes = Sizes { tick: 21.0, label: 24.0 };
/// Length of a tick.
pub(super) const TICK: f64 = 7.0;
/// Names beside points, and how far they stand from them.
const NAME_SIZE: f64 = 19.0;
const NAME_GAP: f64 = 10.0;
/// Where a name may stand: whether to the right, and how far above, in units of its size.
const NAME_PLACES: [(bool, f64); 6] =
    [(true, 0.7), (false, 0.7), (true, -0.7), (false, -0.7), (true, 0.0), (false, 0.0)];
/// Share of the vertical range added below the curves for reference slopes.
const SLOPE_ROOM: f64 = 0.12;
/// Lines through more points have markers on some of them only.
const MARKED: usize = 24;
/// Markers on a line are at least so far apart on paper, about their own size.
const APART: f64 = 14.0;
/// Points nearer than this on paper to the one before are not drawn.
const NEAR: f64 = 0.2;

/// Sizes of the texts at the axes.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    /// Of the numbers at the ticks.
    pub tick: f64,
    /// Of the names of the axes.
    pub label: f64,
}

impl Sizes {
    /// Room left of the axes for the name and numbers at these ticks.
    pub fn left(self, ticks: &[Tick], font: &Font) -> f64 {
        let widest = ticks.iter().filter_map(|t| t.label.as_deref()).map(|l| font.width(&Label::parse(l), self.tick));
        EDGE + 1.5 * self.label + widest.fold(0.0, f64::max) + TICK + 4.0
    }

    /// Room below the axes for numbers and name.
    pub fn below(self) -> f64 {
        TICK + 1.2 * self.tick + 1.5 * self.label
    }
}

/// The axes on paper.
pub(super) struct Frame {
    pub rect: Rect,
    x: Range,
    y: Range,
}

impl Frame {
    /// Axes of these ranges around an area.
    pub fn new(rect: Rect, x: Range, y: Range) -> Self {
        Self { rect, x, y }
    }

    /// Length on paper of one unit of the horizontal coordinate.
    pub fn unit_x(&self) -> f64 {
        self.rect.width() / (self.x.hi - self.x.lo)
    }

    /// Length on paper of one unit of the vertical coordinate.
    pub fn unit_y(&self) -> f64 {
        self.rect.height() / (self.y.hi - self.y.lo)
    }

    /// Horizontal position on paper.
    pub fn place_x(&self, x: f64) -> f64 {
        self.rect.x0 + self.x.share(x) * self.rect.width()
    }

    /// Vertical position on paper.
    pub fn place_y(&self, y: f64) -> f64 {
        self.rect.y1 - self.y.share(y) * self.rect.height()
    }
}

/// One curve on paper, broken where a point was left out.
pub(super) struct Curve {
    pieces: Vec<Vec<(f64, f64)>>,
    /// Least-squares slope of its coordinates, if it has one.
    pub order: Option<f64>,
    /// Mean vertical coordinate.
    pub level: f64,
}

impl Curve {
    /// Number of its segments and points that touch an area.
    pub fn crossings(&self, area: &Rect) -> usize {
        let segments =
            self.pieces.iter().flat_map(|p| p.windows(2)).filter(|s| area.part(s[0], s[1]).is_some()).count();
        segments + self.pieces.iter().flatten().filter(|p| area.contains(**p)).count()
    }

    /// Its height on paper at a horizontal position, if it passes there.
    pub fn height_at(&self, x: f64) -> Option<f64> {
        let mut segments = self.pieces.iter().flat_map(|p| p.windows(2));
        let hit = segments.find(|s| s[0].0.min(s[1].0) <= x && x <= s[0].0.max(s[1].0) && s[0].0 != s[1].0)?;
        let (a, b) = (hit[0], hit[1]);
        Some(a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0))
    }

    /// Its point nearest to a horizontal position, or the origin of the paper if it has no point.
    pub fn nearest_end(&self, x: f64) -> (f64, f64) {
        let points = self.pieces.iter().flatten();
        points.min_by(|a, b| (a.0 - x).abs().total_cmp(&(b.0 - x).abs())).copied().unwrap_or_default()
    }
}

// Coordinates of one series that the axes can show.
struct Shown {
    pieces: Vec<Vec<(f64, f64)>>,
    omitted: usize,
}

impl Shown {
    fn new(series: &Series, x: Scale, y: Scale) -> Self {
        let mut shown = Self { pieces: vec![Vec::new()], omitted: 0 };
        for &(px, py) in &series.points {
            match (x.coordinate(px), y.coordinate(py), shown.pieces.last_mut()) {
                (Some(cx), Some(cy), Some(piece)) => piece.push((cx, cy)),
                (Some(_) | None, Some(_) | None, _) => {
                    shown.omitted += 1;
                    shown.pieces.push(Vec::new());
                }
            }
        }
        shown.pieces.retain(|piece| !piece.is_empty());
        if series.line == Line::None {
            shown.pieces = shown.pieces.concat().into_iter().map(|point| vec![point]).collect();
        }
        shown
    }

    fn curve(&self, frame: &Frame) -> Curve {
        let place = |p: &(f64, f64)| (frame.place_x(p.0), frame.place_y(p.1));
        let on_paper = |piece: &Vec<(f64, f64)>| {
            let (last, rest) = piece.split_last().expect("empty pieces were dropped");
            let mut kept = thin(rest.iter().map(place), NEAR);
            kept.push(place(last));
            kept
        };
        let points: Vec<_> = self.pieces.iter().flatten().copied().collect();
        let count = points.len().max(1) as f64;
        let mean_x = points.iter().map(|p| p.0 / count).sum::<f64>();
        let level = points.iter().map(|p| p.1 / count).sum::<f64>();
        let spread = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum::<f64>();
        let product = points.iter().map(|p| (p.0 - mean_x) * (p.1 - level)).sum::<f64>();
        let order = Some(product / spread).filter(|p| p.is_finite());
        Curve { pieces: self.pieces.iter().map(on_paper).collect(), order, level }
    }
}

/// Places everything.
pub(super) fn arrange(plot: &Plot, font: &Font) -> Scene {
    let shown: Vec<Shown> = plot.series.iter().map(|s| Shown::new(s, plot.x.scale, plot.y.scale)).collect();
    let (slopes, notes) = select_slopes(plot, &shown);
    let header = Header::new([&plot.title, &plot.subtitle], HEADER_SIZES, &notes, font, WIDTH - 2.0 * EDGE);
    let legend = Legend::new(&plot.series, font, WIDTH - 2.0 * EDGE);
    let coordinates = || shown.iter().flat_map(|s| s.pieces.iter().flatten());
    let x = Range::around(plot.x.scale, coordinates().map(|p| p.0));
    let mut y = Range::around(plot.y.scale, coordinates().map(|p| p.1));
    if !slopes.is_empty() {
        y.extend_below(SLOPE_ROOM);
    }
    let (x_ticks, y_ticks) = (x.ticks(6), y.ticks(7));
    let left = SIZES.left(&y_ticks, font);
    let beside = if legend.below { 0.0 } else { legend.width() + EDGE };
    let rect = Rect {
        x0: left,
        y0: header.height() + EDGE,
        x1: WIDTH - EDGE - 8.0 - beside,
        y1: header.height() + EDGE + AXES_HEIGHT.max(if legend.below { 0.0 } else { legend.height() }),
    };
    let frame = Frame { rect, x, y };
    let curves: Vec<Curve> = shown.iter().map(|s| s.curve(&frame)).collect();
    let bottom = rect.y1 + SIZES.below();
    let corner = if legend.below { (EDGE, bottom + EDGE / 2.0) } else { (rect.x1 + EDGE + 4.0, rect.y0) };
    let height = (bottom + EDGE + if legend.below { legend.height() } else { 0.0 }).ceil();

    let mut groups = vec![header.draw(EDGE, font)];
    groups.extend(draw_axes([&plot.x.label, &plot.y.label], &frame, [&x_ticks, &y_ticks], SIZES, font));
    groups.push(slope::draw(&slopes, &curves, &frame, font));
    groups.extend(curves.iter().zip(&plot.series).enumerate().map(|(i, (c, s))| draw_curve(i, c, s)));
    groups.extend(curves.iter().zip(&plot.series).filter_map(|(c, s)| name_points(c, s, &curves, &rect, font)));
    groups.push(legend.draw(corner, font));
    Scene { width: WIDTH, height, title: plot.title.clone(), groups }
}

// The slopes that can be drawn, and what the subtitle must say was left out.
fn select_slopes(plot: &Plot, shown: &[Shown]) -> (Vec<Slope>, Vec<String>) {
    let mut notes = Vec::new();
    let omitted: usize = shown.iter().map(|s| s.omitted).sum();
    if omitted > 0 {
        let logs = [plot.x.scale, plot.y.scale].contains(&Scale::Log);
        let why = if logs { "not finite, or not positive on a log axis" } else { "not finite" };
        notes.push(format!("{omitted} point{} left out ({why})", if omitted == 1 { "" } else { "s" }));
    }
    if shown.iter().all(|s| s.pieces.is_empty()) {
        notes.push("no data to show".to_owned());
    }
    let both_log = plot.x.scale == Scale::Log && plot.y.scale == Scale::Log;
    let slopes: Vec<Slope> = plot.slopes.iter().filter(|s| both_log && s.order.is_finite()).copied().collect();
    let dropped = plot.slopes.len() - slopes.len();
    if dropped > 0 {
        let why = if both_log { "order not finite" } else { "axes not both logarithmic" };
        notes.push(format!("{dropped} reference slope{} left out ({why})", if dropped == 1 { "" } else { "s" }));
    }
    (slopes, notes)
}

/// Grid, and frame with ticks, numbers and names.
pub(super) fn draw_axes(
    names: [&str; 2],
    frame: &Frame,
    [x_ticks, y_ticks]: [&[Tick]; 2],
    sizes: Sizes,
    font: &Font,
) -> [Group; 2] {
    let Rect { x0, y0, x1, y1 } = frame.rect;
    let (mut grid, mut axes) = (Group::default(), Group::default());
    let mut free_from = f64::NEG_INFINITY;
    for tick in x_ticks {
        let x = frame.place_x(tick.at);
        let length = if tick.label.is_some() { TICK } else { TICK / 2.0 };
        axes.shapes.push(Shape::line((x, y1), (x, y1 + length), INK, 1.3));
        let Some(label) = tick.label.as_deref().map(Label::parse) else { continue };
        grid.shapes.push(Shape::line((x, y0), (x, y1), GRID, 1.0));
        let half = font.width(&label, sizes.tick) / 2.0;
        if x - half > free_from && x + half < WIDTH {
            let at = (x, y1 + TICK + 1.1 * sizes.tick);
            axes.shapes.push(Shape::Text(Text::new(label, at, sizes.tick, Anchor::Middle, INK)));
            free_from = x + half + 8.0;
        }
    }
    for tick in y_ticks {
        let y = frame.place_y(tick.at);
        let length = if tick.label.is_some() { TICK } else { TICK / 2.0 };
        axes.shapes.push(Shape::line((x0 - length, y), (x0, y), INK, 1.3));
        let Some(label) = tick.label.as_deref().map(Label::parse) else { continue };
        grid.shapes.push(Shape::line((x0, y), (x1, y), GRID, 1.0));
        let at = (x0 - TICK - 4.0, y + 0.36 * sizes.tick);
        axes.shapes.push(Shape::Text(Text::new(label, at, sizes.tick, Anchor::End, INK)));
    }
    let points = vec![(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
    axes.shapes.push(Shape::Poly { points, closed: true, paint: Paint::line(GREY, 1.6) });
    axes.shapes.extend(name_axes(names, &frame.rect, sizes, font));
    [grid, axes]
}

fn name_axes(names: [&str; 2], rect: &Rect, sizes: Sizes, font: &Font) -> [Shape; 2] {
    let (x, y) = (Label::parse(names[0]), Label::parse(names[1]));
    let middle = ((rect.x0 + rect.x1) / 2.0, (rect.y0 + rect.y1) / 2.0);
    let x_size = font.fit(&x, sizes.label, rect.width());
    let y_size = font.fit(&y, sizes.label, rect.height());
    let below = (middle.0, rect.y1 + TICK + 1.2 * sizes.tick + 1.15 * sizes.label);
    let mut y_text = Text::new(y, (EDGE + 0.8 * sizes.label, middle.1), y_size, Anchor::Middle, INK);
    y_text.upwards = true;
    [Shape::Text(Text::new(x, below, x_size, Anchor::Middle, INK)), Shape::Text(y_text)]
}

fn draw_curve(position: usize, curve: &Curve, series: &Series) -> Group {
    let style = Style::of(position, series);
    let mut group = Group { name: Some(series.name.clone()), shapes: Vec::new() };
    let mut marked: Vec<_> = curve.pieces.iter().flatten().copied().collect();
    if let Some(paint) = style.line() {
        let pieces = curve.pieces.iter().filter(|piece| piece.len() > 1);
        group.shapes.extend(pieces.map(|piece| Shape::Poly { points: piece.clone(), closed: false, paint }));
        let every = if marked.len() > MARKED { marked.len().div_ceil(MARKED / 2) } else { 1 };
        // Curves sampled at the same times would otherwise have their markers above each other.
        let first = position * 5 * every / 12 % every;
        marked = thin(marked.into_iter().skip(first).step_by(every), APART);
    }
    group.shapes.extend(marked.into_iter().filter_map(|p| style.marker(p)));
    group
}

/// The name of a series beside its points, where it covers the least of all curves.
fn name_points(curve: &Curve, series: &Series, curves: &[Curve], frame: &Rect, font: &Font) -> Option<Group> {
    if !matches!(series.markers, Markers::Named(_)) {
        return None;
    }
    let mut group = Group::default();
    let width = font.width(&Label::parse(&series.name), NAME_SIZE);
    for &(x, y) in curve.pieces.iter().flatten() {
        let place = |(right, up): (bool, f64)| {
            let x0 = if right { x + NAME_GAP } else { x - NAME_GAP - width };
            let middle = y - up * NAME_SIZE;
            Rect { x0, y0: middle - 0.5 * NAME_SIZE, x1: x0 + width, y1: middle + 0.5 * NAME_SIZE }
        };
        let inside = |area: &Rect| area.x0 > frame.x0 && area.x1 < frame.x1 && area.y0 > frame.y0 && area.y1 < frame.y1;
        let covered = |area: &Rect| curves.iter().map(|other| other.crossings(area)).sum::<usize>();
        let places = NAME_PLACES.map(place);
        // the first of equally good ones
        let best = places.iter().min_by_key(|area| (!inside(area), covered(area))).expect("there are places");
        let at = (best.x0, best.y1 - 0.14 * NAME_SIZE);
        group.shapes.push(Shape::Text(Text::new(Label::parse(&series.name), at, NAME_SIZE, Anchor::Start, INK)));
    }
    Some(group)
}

/// Points that are not nearer than `least` to the one kept before.
fn thin(points: impl Iterator<Item = (f64, f64)>, least: f64) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for p in points {
        if kept.last().is_none_or(|q| (p.0 - q.0).hypot(p.1 - q.1) > least) {
            kept.push(p);
        }
    }
    kept
}
