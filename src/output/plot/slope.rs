//! Reference slopes: where a triangle fits beside the curves.

use super::Slope;
use super::layout::{Curve, Frame};
use super::scene::{Anchor, GREY, Group, INK, Paint, Rect, Shape, Text};
use super::text::{Font, Label};

const SIZE: f64 = 20.0;
/// Width of a triangle, and its largest height, as shares of the axes.
const WIDTH: f64 = 0.15;
const HEIGHT: f64 = 0.28;
/// Free space around a triangle; more than the radius of a marker.
const CLEAR: f64 = 12.0;
/// Places tried across and down the axes.
const PLACES: (usize, usize) = (40, 60);
/// A curve belongs to a slope if its own order differs by at most this much.
const ALIKE: f64 = 0.35;

/// Places and draws the slopes one after the other; `order` of each must be finite.
pub(super) fn draw(slopes: &[Slope], curves: &[Curve], frame: &Frame, font: &Font) -> Group {
    let mut group = Group::default();
    let mut taken: Vec<Rect> = Vec::new();
    for slope in slopes {
        let label = Label::parse(&format!("{}", (slope.order * 100.0).round() / 100.0).replace('-', "−"));
        let triangle = Triangle::new(slope.order, font.width(&label, SIZE), frame);
        let target = matching_curve(slope.order, curves);
        let Some(place) = best_place(&triangle, target, curves, &taken, frame) else { continue };
        taken.push(triangle.area(place));
        group.shapes.extend(triangle.draw(place, label));
    }
    group
}

// The lowest curve of about this order, or else the one with the nearest order.
fn matching_curve(order: f64, curves: &[Curve]) -> Option<&Curve> {
    let rated = curves.iter().filter_map(|c| c.order.map(|own| (c, (own - order).abs())));
    let key = |(curve, off): &(&Curve, f64)| if *off <= ALIKE { (0.0f64, curve.level) } else { (1.0, *off) };
    let best = rated.min_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    best.map(|(curve, _)| curve)
}

// Right-angled triangle; all lengths on paper.
struct Triangle {
    width: f64,
    height: f64,
    falls: bool,
    text: f64,
}

impl Triangle {
    fn new(order: f64, text: f64, frame: &Frame) -> Self {
        let rise = order.abs() * frame.unit_y() / frame.unit_x();
        let (width, highest) = (WIDTH * frame.rect.width(), HEIGHT * frame.rect.height());
        let (width, height) = if rise * width > highest { (highest / rise, highest) } else { (width, rise * width) };
        Self { width, height, falls: order < 0.0, text: text + 6.0 }
    }

    // Everything drawn, if the left end of the base is at `place`.
    fn area(&self, (x, y): (f64, f64)) -> Rect {
        let (left, right) = if self.falls { (self.text, 0.0) } else { (0.0, self.text) };
        let middle = y - self.height / 2.0;
        let (top, bottom) = ((y - self.height).min(middle - SIZE / 2.0), y.max(middle + SIZE / 2.0));
        Rect { x0: x - left, y0: top, x1: x + self.width + right, y1: bottom }
    }

    fn draw(&self, (x, y): (f64, f64), label: Label) -> [Shape; 2] {
        let upright = if self.falls { x } else { x + self.width };
        let points = vec![(x, y), (x + self.width, y), (upright, y - self.height)];
        let (anchor, shift) = if self.falls { (Anchor::End, -6.0) } else { (Anchor::Start, 6.0) };
        let at = (upright + shift, y - self.height / 2.0 + 0.36 * SIZE);
        let mut paint = Paint::line(GREY, 1.6);
        paint.fill = Some([0xf2, 0xf2, 0xf2]);
        [Shape::Poly { points, closed: true, paint }, Shape::Text(Text::new(label, at, SIZE, anchor, INK))]
    }
}

fn best_place(
    triangle: &Triangle,
    target: Option<&Curve>,
    curves: &[Curve],
    taken: &[Rect],
    frame: &Frame,
) -> Option<(f64, f64)> {
    let inside = frame.rect.grow(-CLEAR);
    let size = triangle.area((0.0, 0.0));
    let (free_x, free_y) = (inside.width() - size.width(), inside.height() - size.height());
    let (nx, ny) = PLACES;
    let places = (0..=nx).flat_map(|i| (0..=ny).map(move |j| (i as f64 / nx as f64, j as f64 / ny as f64)));
    let places = places.map(|(u, v)| (inside.x0 - size.x0 + u * free_x, inside.y0 - size.y0 + v * free_y));
    let cost = |place: (f64, f64)| {
        let area = triangle.area(place);
        let padded = area.grow(CLEAR);
        let covered = curves.iter().map(|c| c.crossings(&padded)).sum::<usize>();
        let piled = taken.iter().filter(|t| t.overlaps(&padded)).count();
        1e5 * (covered + 3 * piled) as f64 + distance(&area, target, frame)
    };
    places.map(|place| (cost(place), place)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place)| place)
}

// How far the triangle is from its curve, above counted double, and a little for being away from its middle.
fn distance(area: &Rect, target: Option<&Curve>, frame: &Frame) -> f64 {
    let (x, y) = ((area.x0 + area.x1) / 2.0, (area.y0 + area.y1) / 2.0);
    let Some(height) = target.and_then(|curve| curve.height_at(x)) else {
        let corner = target.map_or((frame.rect.x1, frame.rect.y1), |curve| curve.nearest_end(x));
        return (x - corner.0).abs() + (y - corner.1).abs();
    };
    let middle = (frame.rect.x0 + frame.rect.x1) / 2.0;
    let below = y - height;
    0.1 * (x - middle).abs() + if below >= 0.0 { below } else { -2.0 * below }
}
