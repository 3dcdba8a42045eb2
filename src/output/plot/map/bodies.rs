//! Rigid bodies, walls, and what joins bodies that touch.

use super::{Fill, Layer, Link, Palette, Placed};
use crate::mesh::Point;
use crate::output::plot::layout::Frame;
use crate::output::plot::legend::COLOURS;
use crate::output::plot::scene::{Anchor, INK, Paint, Rect, Rgb, Shape, Text, WHITE};
use crate::output::plot::text::{Font, Label};
use crate::shape::{Disc, Pose, Shape as BodyShape};

/// Of bodies that no value colours.
const NEUTRAL: Rgb = [0xc4, 0xc4, 0xc4];
/// Distance on paper by which an outline may miss a round shape.
const SAGITTA: f64 = 0.04;
/// Bodies that are smaller on paper have thinner outlines and no mark.
const SMALL: f64 = 5.0;
const EDGE: f64 = 1.2;
/// Sizes of names on bodies.
const NAME: [f64; 2] = [12.0, 24.0];
/// Where the mark of a body begins that has a name, as a share of its length.
const BESIDE_NAME: f64 = 0.75;
/// Widths of the line of a contact.
const WIDEST: f64 = 6.0;
const THINNEST: f64 = 0.6;
/// Of contacts that press.
const PRESSING: Rgb = [0xd0, 0x12, 0x12];
/// Length of a line's sample below a map.
pub(super) const KEY: f64 = 34.0;
/// Strokes of a wall: their distance and their extent along and across it.
const STROKES: f64 = 12.0;
const STROKE: (f64, f64) = (-6.0, 9.0);

type Xy = (f64, f64);

/// Smallest and largest value of the bodies in these layers.
pub(super) fn extent(layers: &[Layer]) -> Option<[f64; 2]> {
    let placed = layers.iter().flat_map(|layer| match layer {
        Layer::Bodies(placed) => placed.as_slice(),
        Layer::Lines { .. }
        | Layer::Contours { .. }
        | Layer::Arrows { .. }
        | Layer::Links { .. }
        | Layer::Walls { .. } => &[],
    });
    let values = placed.filter_map(|body| match body.fill {
        Fill::Value(value) => Some(value).filter(|value| value.is_finite()),
        Fill::Neutral | Fill::Number(_) => None,
    });
    values.map(|value| [value; 2]).reduce(|e, v| [e[0].min(v[0]), e[1].max(v[1])])
}

/// Where and how bodies are drawn.
pub(super) struct Paper<'p> {
    pub frame: &'p Frame,
    pub palette: Palette,
    pub range: [f64; 2],
    pub font: &'p Font,
}

impl Paper<'_> {
    /// The shapes of all bodies, and how many are out of view.
    pub fn bodies(&self, placed: &[Placed]) -> (Vec<Shape>, usize) {
        let (mut shapes, mut away) = (Vec::new(), 0);
        for body in placed {
            let before = shapes.len();
            self.body(body, &mut shapes);
            away += usize::from(shapes.len() == before);
        }
        (shapes, away)
    }

    /// A disc that is no body.
    pub fn disc(&self, centre: Point, radius: f64) -> Vec<Shape> {
        let (shape, pose) = (BodyShape::from(Disc { radius }), Pose { position: centre, angle: 0.0 });
        let mut shapes = Vec::new();
        self.body(&Placed { shape, pose, fill: Fill::Neutral, mark: false, name: String::new() }, &mut shapes);
        shapes
    }

    fn body(&self, body: &Placed, shapes: &mut Vec<Shape>) {
        let rect = &self.frame.rect;
        let centre = self.at(body.pose.position);
        let radius = body.shape.circumradius() * self.frame.unit_x();
        let around = Rect { x0: centre.0, y0: centre.1, x1: centre.0, y1: centre.1 }.grow(radius);
        // NaN is nowhere
        if !around.overlaps(rect) {
            return;
        }
        let fill = self.colour(body.fill);
        let width = if radius < SMALL { EDGE * radius / SMALL } else { EDGE };
        let whole = around.x0 >= rect.x0 && around.x1 <= rect.x1 && around.y0 >= rect.y0 && around.y1 <= rect.y1;
        if whole && body.shape.is_round() {
            shapes.push(Shape::Circle { centre, radius, paint: Paint::area(fill, INK, width) });
        } else {
            let turn = (std::f64::consts::PI * (0.5 * radius / SAGITTA).sqrt()).clamp(16.0, 20_000.0) as usize;
            let points: Vec<Xy> = body.shape.at(body.pose).outline(turn).into_iter().map(|x| self.at(x)).collect();
            self.polygon(points, whole, fill, width, shapes);
        }
        if body.mark && radius >= SMALL {
            let ink = contrast(fill);
            let reach = reach(&body.shape);
            let from = if body.name.is_empty() { 0.0 } else { BESIDE_NAME };
            let [from, tip] = [from, 1.0].map(|share| self.at(body.pose.to_space(Point::new(share * reach, 0.0))));
            if let Some((s, t)) = rect.part(from, tip) {
                let along = |share: f64| (from.0 + share * (tip.0 - from.0), from.1 + share * (tip.1 - from.1));
                shapes.push(Shape::line(along(s), along(t), ink, (0.12 * radius).clamp(1.0, 2.4)));
            }
        }
        self.name(body, centre, radius, fill, shapes);
    }

    /// A convex polygon, cut off at the edges of the window.
    fn polygon(&self, points: Vec<Xy>, whole: bool, fill: Rgb, width: f64, shapes: &mut Vec<Shape>) {
        if whole {
            return shapes.push(Shape::Poly { points, closed: true, paint: Paint::area(fill, INK, width) });
        }
        let rect = &self.frame.rect;
        let inside = clip(&points, rect);
        if inside.len() < 3 {
            return;
        }
        shapes.push(Shape::Poly { points: inside, closed: true, paint: Paint { fill: Some(fill), stroke: None } });
        // no outline along the edges of the window
        let mut pieces: Vec<Vec<Xy>> = Vec::new();
        for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
            let Some((s, t)) = rect.part(*a, *b) else { continue };
            let along = |share: f64| (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1));
            match pieces.last_mut() {
                Some(piece) if s == 0.0 && piece.last() == Some(a) => piece.push(if t == 1.0 { *b } else { along(t) }),
                Some(_) | None => pieces.push(vec![along(s), if t == 1.0 { *b } else { along(t) }]),
            }
        }
        let line = |points| Shape::Poly { points, closed: false, paint: Paint::line(INK, width) };
        shapes.extend(pieces.into_iter().map(line));
    }

    fn name(&self, body: &Placed, centre: Xy, radius: f64, fill: Rgb, shapes: &mut Vec<Shape>) {
        if body.name.is_empty() || !self.frame.rect.contains(centre) {
            return;
        }
        let label = Label::parse(&body.name);
        let room = 1.4 * body.shape.inradius() * radius / body.shape.circumradius();
        let size = self.font.fit(&label, NAME[1].min(0.6 * room), room);
        if size >= NAME[0] {
            let at = (centre.0, centre.1 + 0.36 * size);
            shapes.push(Shape::Text(Text::new(label, at, size, Anchor::Middle, contrast(fill))));
        }
    }

    fn at(&self, x: Point) -> Xy {
        (self.frame.place_x(x.x), self.frame.place_y(x.y))
    }

    fn colour(&self, fill: Fill) -> Rgb {
        match fill {
            Fill::Neutral => NEUTRAL,
            Fill::Value(value) => self.palette.colour(value, self.range),
            Fill::Number(number) => COLOURS[number % COLOURS.len()],
        }
    }
}

/// From the centre to the outline along the first axis.
fn reach(shape: &BodyShape) -> f64 {
    let (mut inside, mut outside) = (0.0, 2.0 * shape.circumradius());
    loop {
        let middle = 0.5 * (inside + outside);
        if middle <= inside || middle >= outside {
            return inside;
        }
        if shape.contains(Point::new(middle, 0.0)) { inside = middle } else { outside = middle }
    }
}

/// Dark on light colours, white on dark ones.
fn contrast([r, g, b]: Rgb) -> Rgb {
    let light = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
    if light > 110.0 { INK } else { WHITE }
}

/// The part of a convex polygon inside of a rectangle.
fn clip(points: &[Xy], rect: &Rect) -> Vec<Xy> {
    let sides: [Box<dyn Fn(Xy) -> f64>; 4] = [
        Box::new(|p| p.0 - rect.x0),
        Box::new(|p| rect.x1 - p.0),
        Box::new(|p| p.1 - rect.y0),
        Box::new(|p| rect.y1 - p.1),
    ];
    sides.iter().fold(points.to_vec(), |points, side| {
        let mut kept = Vec::with_capacity(points.len() + 1);
        for (&a, &b) in points.iter().zip(points.iter().cycle().skip(1)) {
            let (from, to) = (side(a), side(b));
            if from >= 0.0 {
                kept.push(a);
            }
            if (from >= 0.0) != (to >= 0.0) {
                let share = from / (from - to);
                kept.push((a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1)));
            }
        }
        kept
    })
}

/// The lines of contacts, and for each sign a sample of its widest line with its value; `unit` is a length 1 on paper.
/// Lines between bodies that are small on paper are thin.
pub(super) fn links(
    links: &[Link],
    cut: impl Fn(&[Point]) -> Vec<Vec<Xy>>,
    unit: f64,
) -> (Vec<Shape>, Vec<(Vec<Shape>, f64)>) {
    let largest = links.iter().map(|link| link.value.abs()).fold(0.0, f64::max);
    let mut lengths: Vec<f64> = links.iter().map(|link| unit * (link.to - link.from).norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let widest = lengths.get(lengths.len() / 2).map_or(WIDEST, |median| (0.25 * median).clamp(1.5, WIDEST));
    let width = |value: f64| (widest * value.abs() / largest).max(THINNEST);
    let drawn = links.iter().filter(|link| link.value != 0.0);
    let shapes = drawn.flat_map(|link| {
        let pieces = cut(&[link.from, link.to]);
        pieces.into_iter().flat_map(|points| link_shapes(points, link.value > 0.0, width(link.value)))
    });
    let most = links.iter().map(|link| link.value).fold(0.0, f64::max);
    let least = links.iter().map(|link| link.value).fold(0.0, f64::min);
    let keys = [most, least].into_iter().filter(|value| *value != 0.0);
    let sample = |value: f64| (link_shapes(vec![(0.0, 0.0), (KEY, 0.0)], value > 0.0, width(value)), value);
    (shapes.collect(), keys.map(sample).collect())
}

fn link_shapes(points: Vec<Xy>, presses: bool, width: f64) -> Vec<Shape> {
    let line = |points, colour, width| Shape::Poly { points, closed: false, paint: Paint::line(colour, width) };
    if presses {
        vec![line(points, PRESSING, width)]
    } else {
        vec![line(points.clone(), INK, width + 2.0), line(points, WHITE, width)]
    }
}

/// Walls with short strokes on their right.
pub(super) fn walls(pieces: impl Iterator<Item = Vec<Xy>>, rect: &Rect) -> Vec<Shape> {
    let mut shapes = Vec::new();
    for points in pieces {
        // distance along the wall of the next stroke
        let mut next = 0.5 * STROKES;
        let mut passed = 0.0;
        for pair in points.windows(2) {
            let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
            let length = dx.hypot(dy);
            while length > 0.0 && next <= passed + length {
                let (ux, uy) = (dx / length, dy / length);
                let foot = (pair[0].0 + ux * (next - passed), pair[0].1 + uy * (next - passed));
                // on paper y points downwards, so that the right is (−uy, ux)
                let tip = (foot.0 + STROKE.0 * ux - STROKE.1 * uy, foot.1 + STROKE.0 * uy + STROKE.1 * ux);
                if let Some((s, t)) = rect.part(foot, tip) {
                    let along = |share: f64| (foot.0 + share * (tip.0 - foot.0), foot.1 + share * (tip.1 - foot.1));
                    shapes.push(Shape::line(along(s), along(t), INK, 1.0));
                }
                next += STROKES;
            }
            passed += length;
        }
        shapes.push(Shape::Poly { points, closed: false, paint: Paint::line(INK, 2.6) });
    }
    shapes
}
