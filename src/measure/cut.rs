//! Sections along straight lines and circles.

use std::ops::Deref;

use crate::element::MAX_DEGREE;
use crate::element::basis;
use crate::mesh::locate::{Locator, invert};
use crate::mesh::{Mesh, Point};
use crate::space::Field;

/// A straight section with equidistant points, both ends included.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Name of its table.
    pub name: String,
    /// First point.
    pub from: Point,
    /// Last point.
    pub to: Point,
    /// Number of points, both ends included.
    pub points: usize,
}

/// A point of a section and the cells that meet there.
#[derive(Debug, Clone)]
pub struct Sample {
    /// Distance from the beginning of a line, angle on a circle.
    pub s: f64,
    /// Where it was taken.
    pub x: Point,
    /// Reference positions in the one cell, or in the cells on both sides of the line where it runs along faces.
    pub at: Sides,
}

/// None, one or two cells, and where a point lies in each; kept without memory of its own.
#[derive(Debug, Clone, Copy, Default)]
pub struct Sides {
    places: [(usize, Point); 2],
    count: usize,
}

impl Sides {
    fn one(place: (usize, Point)) -> Self {
        [place].into_iter().collect()
    }
}

impl FromIterator<(usize, Point)> for Sides {
    /// The first two.
    fn from_iter<T: IntoIterator<Item = (usize, Point)>>(places: T) -> Self {
        let mut sides = Self::default();
        for place in places.into_iter().take(2) {
            sides.places[sides.count] = place;
            sides.count += 1;
        }
        sides
    }
}

impl Deref for Sides {
    type Target = [(usize, Point)];

    fn deref(&self) -> &Self::Target {
        &self.places[..self.count]
    }
}

impl Line {
    /// The points of the section that lie in the mesh; those in an obstacle are left out.
    pub fn samples(&self, mesh: &Mesh, locator: &Locator) -> Vec<Sample> {
        (0..self.points).filter_map(|k| self.sample(k, mesh, locator)).collect()
    }

    /// The point of that number; `None` where it lies in an obstacle.
    pub fn sample(&self, k: usize, mesh: &Mesh, locator: &Locator) -> Option<Sample> {
        let length = (self.to - self.from).norm();
        let share = k as f64 / (self.points - 1).max(1) as f64;
        let x = self.from + (self.to - self.from) * share;
        let at = both_sides(mesh, locator, x, self.to - self.from);
        (!at.is_empty()).then_some(Sample { s: share * length, x, at })
    }
}

/// A section along a circle: points at the angles `2πk/points`, counterclockwise from the one to the right of the
/// centre.
#[derive(Debug, Clone, PartialEq)]
pub struct Circle {
    /// Name of its table.
    pub name: String,
    /// Its middle.
    pub centre: Point,
    /// Distance of its points from the middle.
    pub radius: f64,
    /// Number of points.
    pub points: usize,
}

/// Barycentric coordinates down to this much below zero count as inside, so that a circle may lie on a bent boundary.
const NEAR: f64 = 1e-3;

impl Circle {
    /// The points of the section that lie in the mesh.
    pub fn samples(&self, mesh: &Mesh, locator: &Locator) -> Vec<Sample> {
        (0..self.points).filter_map(|k| self.sample(k, mesh, locator)).collect()
    }

    /// The point of that number; `None` where it lies outside.
    pub fn sample(&self, k: usize, mesh: &Mesh, locator: &Locator) -> Option<Sample> {
        let angle = std::f64::consts::TAU * k as f64 / self.points as f64;
        let out = Point::new(angle.cos(), angle.sin());
        let x = self.centre + out * self.radius;
        let mut at = both_sides(mesh, locator, x, Point::new(-out.y, out.x));
        if at.is_empty() {
            at = locator.locate_near(mesh, x, NEAR).map(Sides::one).unwrap_or_default();
        }
        (!at.is_empty()).then_some(Sample { s: angle, x, at })
    }
}

/// A section of either form.
#[derive(Debug, Clone, PartialEq)]
pub enum Section {
    /// A straight one.
    Line(Line),
    /// A round one.
    Circle(Circle),
}

impl Section {
    /// Name of its table.
    pub fn name(&self) -> &str {
        match self {
            Self::Line(line) => &line.name,
            Self::Circle(circle) => &circle.name,
        }
    }

    /// Points inside of the mesh and outside.
    pub fn points(&self) -> usize {
        match self {
            Self::Line(line) => line.points,
            Self::Circle(circle) => circle.points,
        }
    }

    /// What [`Sample::s`] is called in tables.
    pub fn abscissa(&self) -> &'static str {
        match self {
            Self::Line(_) => "s",
            Self::Circle(_) => "theta",
        }
    }

    /// The point of that number, if it lies in the mesh.
    pub fn sample(&self, k: usize, mesh: &Mesh, locator: &Locator) -> Option<Sample> {
        match self {
            Self::Line(line) => line.sample(k, mesh, locator),
            Self::Circle(circle) => circle.sample(k, mesh, locator),
        }
    }
}

/// The sides of a line are looked for at this share of the longest edge of a cell there: far beyond rounding, far
/// below the cells' heights.
const ASIDE: f64 = 1e-7;

/// The cells left and right of a line through `x`, and where `x` itself lies in them: a discontinuous field has two
/// values where the line runs along faces, and neither is the better one.
pub fn both_sides(mesh: &Mesh, locator: &Locator, x: Point, direction: Point) -> Sides {
    let Some((here, at)) = locator.locate(mesh, x) else { return Sides::default() };
    let [a, b, c] = mesh.corners(here);
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let aside = Point::new(-direction.y, direction.x).normalize() * (ASIDE * longest);
    let beside = |x| locator.locate(mesh, x).map(|(cell, _)| cell);
    let [left, right] = [beside(x + aside), beside(x - aside)];
    let cells = left.into_iter().chain(right.filter(|_| right != left));
    let inside: Sides = cells.filter_map(|cell| Some((cell, invert(mesh, cell, x)?))).collect();
    if inside.is_empty() { Sides::one((here, at)) } else { inside }
}

/// Mean over the sides of component `c`.
pub fn value(field: &Field, at: &[(usize, Point)], c: usize) -> f64 {
    at.iter().map(|&(cell, xi)| field.component_at(cell, xi, c)).sum::<f64>() / at.len() as f64
}

/// Components of fields that are read at many points: each basis is evaluated once at a point, whatever reads it.
#[derive(Debug)]
pub struct Columns<'f> {
    columns: Vec<(&'f Field, usize)>,
    /// Whether a field has this degree.
    degrees: [bool; MAX_DEGREE + 1],
}

/// Values of the bases of every degree on both sides of a point: room that is used again at the next one.
#[derive(Debug, Default)]
pub struct Bases([[Vec<f64>; MAX_DEGREE + 1]; 2]);

impl<'f> Columns<'f> {
    /// Fields and the numbers of their components, in the order of the columns.
    pub fn new(columns: Vec<(&'f Field, usize)>) -> Self {
        let mut degrees = [false; MAX_DEGREE + 1];
        columns.iter().for_each(|(field, _)| degrees[field.space.degree] = true);
        Self { columns, degrees }
    }

    /// Calls `each` with [`value`] of every column.
    pub fn read(&self, at: &[(usize, Point)], Bases(bases): &mut Bases, mut each: impl FnMut(f64)) {
        for (bases, &(_, xi)) in bases.iter_mut().zip(at) {
            for (degree, basis) in bases.iter_mut().enumerate().filter(|(degree, _)| self.degrees[*degree]) {
                basis.clear();
                basis.extend(basis::values(degree, xi));
            }
        }
        for &(field, c) in &self.columns {
            let sides = at.iter().zip(bases.iter());
            let on = |(&(cell, _), bases): (&(usize, Point), &[Vec<f64>; MAX_DEGREE + 1])| {
                field.component_by(cell, &bases[field.space.degree], c)
            };
            each(sides.map(on).sum::<f64>() / at.len() as f64);
        }
    }
}
