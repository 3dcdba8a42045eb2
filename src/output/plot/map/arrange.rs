//! Places a map on paper.

use super::arrows::Arrows;
use super::pixels::Pixels;
use super::{Layer, Link, Look, Map, Palette, Placed, Scalar, Vector, bodies, contour};
use crate::mesh::Point;
use crate::output::plot::axis::{self, Range, Tick};
use crate::output::plot::header::Header;
use crate::output::plot::layout::{EDGE, Frame, Sizes, TICK, WIDTH, draw_axes};
use crate::output::plot::scene::{Anchor, Group, INK, Image, Paint, Rect, Rgb, Scene, Shape, Text, WHITE};
use crate::output::plot::text::{Font, Label};
use crate::output::plot::{PNG_SCALE, PlotError};

/// Sizes of title and subtitle. A picture 8 cm wide has all its text in at least 7 points.
const HEADER_SIZES: [f64; 2] = [29.0, 26.0];
const SIZES: Sizes = Sizes { tick: 26.0, label: 28.0 };
const NOTE: f64 = 26.0;
/// Windows that are wider than this have the colour bar below, where it takes no width.
const WIDE: f64 = 1.6;
/// Greatest height of the axes.
const HIGHEST: f64 = 760.0;
/// Thickness of the colour bar, and what a vertical one takes with its numbers.
const BAR: f64 = 24.0;
const BAR_ROOM: f64 = 150.0;
/// Free space around the bar.
const GAP: f64 = 16.0;
/// Contour lines, about.
const CONTOURS: usize = 18;
/// Distance on paper by which a contour line may be simplified, far below its width.
const SIMPLER: f64 = 0.08;
const EDGE_GREY: Rgb = [0x88, 0x88, 0x88];

/// A map whose scalar was sampled.
pub(in crate::output::plot) struct Arranged<'m> {
    map: &'m Map<'m>,
    font: &'m Font,
    header: Header,
    frame: Frame,
    ticks: [Vec<Tick>; 2],
    wide: bool,
    /// None in a picture of layers alone.
    pixels: Option<Pixels>,
    /// Smallest and largest value that has a colour; none without values, and then there is no colour bar.
    extent: Option<[f64; 2]>,
    pub range: [f64; 2],
}

/// Something to read below the map: a drawing at a point, which takes so much width, and a text.
struct Note {
    key: Option<(Vec<Shape>, f64)>,
    text: String,
}

impl<'m> Arranged<'m> {
    /// Places the axes and samples the scalar.
    ///
    /// # Errors
    /// [`PlotError::Blank`] where the scalar has no value in the window.
    pub fn new(map: &'m Map<'m>, font: &'m Font) -> Result<Self, PlotError> {
        let (mut arranged, [width, height]) = Self::place_axes(map, font, true);
        let pixels = Pixels::sample(map.scalar, &map.name, &map.window, width, height)?;
        arranged.range = Palette::widen(map.range.unwrap_or(pixels.extent));
        arranged.extent = Some(pixels.extent);
        arranged.pixels = Some(pixels);
        Ok(arranged)
    }

    /// Places the axes for the layers alone.
    pub fn plain(map: &'m Map<'m>, font: &'m Font) -> Self {
        let extent = bodies::extent(&map.layers);
        let (mut arranged, _) = Self::place_axes(map, font, extent.is_some());
        arranged.range = Palette::widen(map.range.or(extent).unwrap_or([0.0, 1.0]));
        arranged.extent = extent;
        arranged
    }

    /// The axes, and their width and height in pixels of a PNG.
    fn place_axes(map: &'m Map<'m>, font: &'m Font, with_bar: bool) -> (Self, [usize; 2]) {
        let size = map.height.map_or(map.window.size(), |height| Point::new(1.0, height));
        let wide = size.x > WIDE * size.y;
        let right = WIDTH - if wide || !with_bar { EDGE + 14.0 } else { BAR_ROOM };
        let header = Header::new([&map.title, &map.subtitle], HEADER_SIZES, &[], font, WIDTH - 2.0 * EDGE);
        let [x, y] = [0, 1].map(|c| Range::exact(map.window.low()[c], map.window.high()[c]));
        // the room for the numbers at the ticks depends on their number, which depends on the height
        let height = |left: f64| ((right - left) * size.y / size.x).min(HIGHEST);
        let ticks_of = |height: f64| upright_ticks(&y, height);
        let left = SIZES.left(&ticks_of(height(110.0)), font).ceil();
        let width = (right - left).min(HIGHEST * size.x / size.y);
        let pixels = [width, width * size.y / size.x].map(|s| ((s * f64::from(PNG_SCALE)).round() as usize).max(1));
        let [width, height] = pixels.map(|n| n as f64 / f64::from(PNG_SCALE));
        let top = (header.height() + EDGE).ceil();
        let frame = Frame::new(Rect { x0: left, y0: top, x1: left + width, y1: top + height }, x, y);
        let ticks = [x.ticks(((width / 110.0) as usize).clamp(2, 7)), ticks_of(height)];
        (Self { map, font, header, frame, ticks, wide, pixels: None, extent: None, range: [0.0, 1.0] }, pixels)
    }

    /// Smallest and largest value that is shown, NaN without one.
    pub fn extent(&self) -> [f64; 2] {
        self.extent.unwrap_or([f64::NAN; 2])
    }

    /// Everything on paper.
    pub fn scene(self) -> Scene {
        let map = self.map;
        let image = self.pixels.as_ref().map(|pixels| pixels.image(map.palette, self.range, self.frame.rect));
        let below = image.map(|image| Group { name: Some(map.name.clone()), shapes: vec![Shape::Image(image)] });
        let mut groups: Vec<Group> = below.into_iter().collect();
        let mut notes: Vec<Note> = self.extent.map(|extent| self.told(extent)).into_iter().collect();
        for layer in &map.layers {
            let (group, told) = self.layer(layer);
            groups.push(group);
            notes.extend(told);
        }
        let names = [map.axes[0].as_str(), map.axes[1].as_str()];
        // a grid would cover the colours
        let [_, axes] = draw_axes(names, &self.frame, [&self.ticks[0], &self.ticks[1]], SIZES, self.font);
        groups.push(axes);
        let bottom = self.frame.rect.y1 + SIZES.below();
        let (bar, below) = match (self.extent, self.wide) {
            (None, _) => (None, bottom),
            (Some(_), true) => {
                let (bar, end) = self.bar_below(bottom);
                (Some(bar), end)
            }
            (Some(_), false) => (Some(self.bar_beside()), bottom),
        };
        groups.extend(bar);
        let (notes, end) = self.place(notes, below);
        groups.push(notes);
        let height = (end + EDGE).ceil();
        groups.insert(0, self.header.draw(EDGE, self.font));
        Scene { width: WIDTH, height, title: map.title.clone(), groups }
    }

    /// The values that are shown, and whether the bar has them all.
    fn told(&self, [low, high]: [f64; 2]) -> Note {
        let largest = low.abs().max(high.abs());
        let number = |v: f64| axis::significant(v, largest);
        let cut = low < self.range[0] || high > self.range[1];
        let note = if cut { " (clipped)" } else { "" };
        Note { key: None, text: format!("{} from {} to {}{note}", self.map.name, number(low), number(high)) }
    }

    fn layer(&self, layer: &Layer) -> (Group, Vec<Note>) {
        match layer {
            Layer::Lines { lines, look } => (self.lines(lines, *look), Vec::new()),
            Layer::Contours { name, of } => self.contours(name, *of),
            Layer::Arrows { name, of } => self.arrows(name, *of),
            Layer::Bodies(placed) => self.bodies(placed),
            Layer::Links { name, links } => self.links(name, links),
            Layer::Walls { lines, discs } => (self.walls(lines, discs), Vec::new()),
        }
    }

    fn lines(&self, lines: &[Vec<Point>], look: Look) -> Group {
        let paint = match look {
            Look::Outline => Paint::line(INK, 2.0),
            Look::Mesh => Paint::line(EDGE_GREY, 0.7),
        };
        let pieces = lines.iter().flat_map(|line| self.cut(line));
        let shapes = pieces.map(|points| Shape::Poly { points, closed: false, paint }).collect();
        Group { name: None, shapes }
    }

    fn contours(&self, name: &str, of: Scalar) -> (Group, Vec<Note>) {
        let rect = &self.frame.rect;
        let cells = [rect.width(), rect.height()].map(|side| side.ceil() as usize);
        let (lines, step) = contour::evenly_spaced(of, &self.map.window, cells, CONTOURS);
        let on_paper = |line: &Vec<Point>| simplify(&line.iter().map(|x| self.on_paper(*x)).collect::<Vec<_>>());
        let lines: Vec<_> = lines.iter().map(on_paper).collect();
        let with =
            |paint: Paint| lines.iter().map(move |points| Shape::Poly { points: points.clone(), closed: false, paint });
        let shapes = with(Paint::line(WHITE, 3.0)).chain(with(Paint::line(INK, 1.4))).collect();
        let key = Shape::line((0.0, 0.0), (34.0, 0.0), INK, 1.4);
        let note = match step {
            0.0 => Note { key: None, text: format!("{name}: constant") },
            step => Note { key: Some((vec![key], 34.0)), text: format!("{name} = {}", axis::round(step)) },
        };
        (Group { name: Some(name.to_owned()), shapes }, vec![note])
    }

    fn arrows(&self, name: &str, of: Vector) -> (Group, Vec<Note>) {
        let arrows = Arrows::sample(of, &self.map.window, &self.frame);
        let note = match arrows.key((0.0, 0.0)) {
            Some((value, length, shape)) => {
                Note { key: Some((vec![shape], length)), text: format!("{name} = {}", axis::round(value)) }
            }
            None => Note { key: None, text: format!("{name} = 0 everywhere") },
        };
        (Group { name: Some(name.to_owned()), shapes: arrows.shapes() }, vec![note])
    }

    fn bodies(&self, placed: &[Placed]) -> (Group, Vec<Note>) {
        let (shapes, away) = self.paper().bodies(placed);
        let note = match away {
            0 => None,
            1 => Some("1 body is out of view".to_owned()),
            more => Some(format!("{more} bodies are out of view")),
        };
        let notes = note.into_iter().map(|text| Note { key: None, text }).collect();
        (Group { name: Some("bodies".to_owned()), shapes }, notes)
    }

    fn links(&self, name: &str, links: &[Link]) -> (Group, Vec<Note>) {
        let cut = |line: &[Point]| self.cut(line);
        let (shapes, keys) = bodies::links(links, cut, self.frame.unit_x());
        let note = |(sample, value): (Vec<Shape>, f64)| {
            let text = format!("{name} = {}", axis::significant(value, value.abs()));
            Note { key: Some((sample, bodies::KEY)), text }
        };
        (Group { name: Some(name.to_owned()), shapes }, keys.into_iter().map(note).collect())
    }

    fn walls(&self, lines: &[Vec<Point>], discs: &[(Point, f64)]) -> Group {
        let pieces = lines.iter().flat_map(|line| self.cut(line));
        let mut shapes = bodies::walls(pieces, &self.frame.rect);
        shapes.extend(discs.iter().flat_map(|&(centre, radius)| self.paper().disc(centre, radius)));
        Group { name: Some("walls".to_owned()), shapes }
    }

    fn paper(&self) -> bodies::Paper<'_> {
        bodies::Paper { frame: &self.frame, palette: self.map.palette, range: self.range, font: self.font }
    }

    fn on_paper(&self, x: Point) -> (f64, f64) {
        (self.frame.place_x(x.x), self.frame.place_y(x.y))
    }

    /// The parts of a polyline that lie in the window, on paper.
    fn cut(&self, line: &[Point]) -> Vec<Vec<(f64, f64)>> {
        let rect = &self.frame.rect;
        let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
        let points: Vec<_> = line.iter().map(|x| self.on_paper(*x)).collect();
        for pair in points.windows(2) {
            let Some((s, t)) = rect.part(pair[0], pair[1]) else { continue };
            let at =
                |share: f64| (pair[0].0 + share * (pair[1].0 - pair[0].0), pair[0].1 + share * (pair[1].1 - pair[0].1));
            match pieces.last_mut() {
                Some(piece) if s == 0.0 && piece.last() == Some(&pair[0]) => piece.push(at(t)),
                Some(_) | None => pieces.push(vec![at(s), at(t)]),
            }
        }
        pieces
    }

    /// A colour bar below the axes, and its lower end with the numbers.
    fn bar_below(&self, top: f64) -> (Group, f64) {
        let rect = Rect { x0: self.frame.rect.x0, y0: top + 4.0, x1: self.frame.rect.x1, y1: top + 4.0 + BAR };
        let mut group = self.bar(rect, |image, i, _| (i as f64 + 0.5) / image.width as f64);
        let scale = Range::exact(self.range[0], self.range[1]);
        let mut free_from = f64::NEG_INFINITY;
        for tick in scale.ticks(7) {
            let x = rect.x0 + scale.share(tick.at) * rect.width();
            group.shapes.push(Shape::line((x, rect.y1), (x, rect.y1 + TICK), INK, 1.3));
            let Some(label) = tick.label.as_deref().map(Label::parse) else { continue };
            let half = self.font.width(&label, SIZES.tick) / 2.0;
            if x - half > free_from && x + half < WIDTH {
                let at = (x, rect.y1 + TICK + 1.0 * SIZES.tick);
                group.shapes.push(Shape::Text(Text::new(label, at, SIZES.tick, Anchor::Middle, INK)));
                free_from = x + half + 8.0;
            }
        }
        (group, rect.y1 + TICK + 1.3 * SIZES.tick)
    }

    /// A colour bar to the right of the axes.
    fn bar_beside(&self) -> Group {
        let axes = &self.frame.rect;
        let rect = Rect { x0: axes.x1 + GAP, y0: axes.y0, x1: axes.x1 + GAP + BAR, y1: axes.y1 };
        let mut group = self.bar(rect, |image, _, j| 1.0 - (j as f64 + 0.5) / image.height as f64);
        let scale = Range::exact(self.range[0], self.range[1]);
        let room = WIDTH - rect.x1 - TICK - 4.0 - 2.0;
        for tick in scale.ticks(((rect.height() / 60.0) as usize).clamp(2, 7)) {
            let y = rect.y1 - scale.share(tick.at) * rect.height();
            group.shapes.push(Shape::line((rect.x1, y), (rect.x1 + TICK, y), INK, 1.3));
            let Some(label) = tick.label.as_deref().map(Label::parse) else { continue };
            let size = self.font.fit(&label, SIZES.tick, room);
            let at = (rect.x1 + TICK + 4.0, y + 0.36 * size);
            group.shapes.push(Shape::Text(Text::new(label, at, size, Anchor::Start, INK)));
        }
        group
    }

    /// The colours of the bar, of the share of the way along it at each pixel, and its frame.
    fn bar(&self, rect: Rect, share: impl Fn(&Image, usize, usize) -> f64) -> Group {
        let [width, height] = [rect.width(), rect.height()].map(|s| (s * f64::from(PNG_SCALE)).round() as usize);
        let mut image = Image { rect, width, height, pixels: Vec::new() };
        let [low, high] = self.range;
        let colour =
            |(j, i): (usize, usize)| self.map.palette.colour(low + share(&image, i, j) * (high - low), self.range);
        image.pixels = (0..height).flat_map(|j| (0..width).map(move |i| (j, i))).map(colour).collect();
        let corners = vec![(rect.x0, rect.y0), (rect.x1, rect.y0), (rect.x1, rect.y1), (rect.x0, rect.y1)];
        let edge = Shape::Poly { points: corners, closed: true, paint: Paint::line(INK, 1.3) };
        Group { name: Some("colours".to_owned()), shapes: vec![Shape::Image(image), edge] }
    }

    /// The notes side by side, on as many lines as they need, and where the last line ends.
    fn place(&self, notes: Vec<Note>, top: f64) -> (Group, f64) {
        let mut group = Group::default();
        let (left, right) = (EDGE, WIDTH - EDGE);
        let (mut x, mut y) = (left, top + 1.1 * NOTE);
        for note in notes {
            let label = Label::parse(&note.text);
            let before = note.key.as_ref().map_or(0.0, |(_, width)| width + 10.0);
            let size = self.font.fit(&label, NOTE, right - left - before);
            let width = before + self.font.width(&label, size);
            if x > left && x + width > right {
                (x, y) = (left, y + 1.35 * NOTE);
            }
            if let Some((shapes, _)) = note.key {
                group.shapes.extend(shapes.into_iter().map(|shape| moved(shape, (x, y - 0.34 * NOTE))));
            }
            group.shapes.push(Shape::Text(Text::new(label, (x + before, y), size, Anchor::Start, INK)));
            x += width + 36.0;
        }
        (group, y + 0.3 * NOTE)
    }
}

/// Ticks of a vertical axis: three or more, if their numbers have room.
fn upright_ticks(range: &Range, height: f64) -> Vec<Tick> {
    let (few, many) = (((height / 90.0) as usize).clamp(2, 6), ((height / 32.0) as usize).max(2));
    let labelled = |ticks: &Vec<Tick>| ticks.iter().filter(|tick| tick.label.is_some()).count();
    (few..=many).map(|most| range.ticks(most)).find(|ticks| labelled(ticks) > 2).unwrap_or_else(|| range.ticks(few))
}

fn moved(shape: Shape, by: (f64, f64)) -> Shape {
    match shape {
        Shape::Poly { points, closed, paint } => {
            Shape::Poly { points: points.iter().map(|p| (p.0 + by.0, p.1 + by.1)).collect(), closed, paint }
        }
        other @ (Shape::Circle { .. } | Shape::Text(_) | Shape::Image(_)) => other,
    }
}

/// Leaves out points that lie within [`SIMPLER`] of the line through those that are kept.
fn simplify(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let Some(last) = points.len().checked_sub(1) else { return Vec::new() };
    let mut keep = vec![false; points.len()];
    (keep[0], keep[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let (a, b) = (points[from], points[to]);
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let length = dx.hypot(dy);
        let far = |k: &usize| {
            let (x, y) = (points[*k].0 - a.0, points[*k].1 - a.1);
            if length > 0.0 { (x * dy - y * dx).abs() / length } else { x.hypot(y) }
        };
        let farthest = (from + 1..to).max_by(|p, q| far(p).total_cmp(&far(q)));
        if let Some(k) = farthest.filter(|k| far(k) > SIMPLER) {
            keep[k] = true;
            open.extend([(from, k), (k, to)]);
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}
