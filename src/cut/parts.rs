//! What bodies cut, and the rules on its parts.

use std::sync::{Arc, Mutex};

use super::{MeshPart, curved, face, rule};
use crate::element::basis;
use crate::element::quadrature;
use crate::element::tables::Tables;
use crate::mesh::Mesh;
use crate::shape::outline::Piece;

/// A quadrature rule on a part of a cell: reference points with the bases there, and weights in the measure of the
/// reference triangle.
#[derive(Debug)]
pub(crate) struct CutRule {
    pub tables: Tables,
    pub weights: Vec<f64>,
}

/// A quadrature rule on a part of a face: weights that add up to the part's share of the parameter, the bases at the
/// points on both sides.
#[derive(Debug)]
pub(crate) struct CutFaceRule {
    pub minus: Tables,
    pub plus: Option<Tables>,
    pub weights: Vec<f64>,
}

/// Rules by part and degree, made when they are first asked for.
#[derive(Debug)]
struct Cache<R>(Mutex<Vec<Known<R>>>);

/// A rule with the part and degree that it is for.
type Known<R> = ((MeshPart, usize), Arc<R>);

impl<R> Cache<R> {
    fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    fn get(&self, part: MeshPart, degree: usize, make: impl FnOnce() -> R) -> Arc<R> {
        let mut rules = self.0.lock().expect("no rule panics");
        if let Some((_, rule)) = rules.iter().find(|(key, _)| *key == (part, degree)) {
            return rule.clone();
        }
        let rule = Arc::new(make());
        rules.push(((part, degree), rule.clone()));
        rule
    }
}

/// What bodies cut: its parts by body, and rules.
#[derive(Debug)]
pub(super) struct Cut<P, R> {
    pub parts: Vec<(usize, P)>,
    rules: Cache<R>,
}

/// The part of a cell inside a body.
#[derive(Debug)]
pub(super) enum Region {
    /// Of a straight cell: the boundary in the reference triangle.
    Straight(Vec<Piece>),
    /// Of a curved cell.
    Curved(Vec<curved::Side>),
}

pub(super) type CutCell = Cut<Region, CutRule>;
/// The parts are shares of the face, from first to last.
pub(super) type CutFace = Cut<[f64; 2], CutFaceRule>;

impl<P, R> Cut<P, R> {
    pub fn new(parts: Vec<(usize, P)>) -> Self {
        Self { parts, rules: Cache::new() }
    }
}

impl CutCell {
    /// The rule on a part, exact for polynomials of degree `degree` in reference coordinates.
    pub fn rule(&self, (mesh, cell): (&Mesh, usize), part: MeshPart, degree: usize) -> Arc<CutRule> {
        self.rules.get(part, degree, || {
            let (mut points, mut weights) = (Vec::new(), Vec::new());
            let sign = match part {
                MeshPart::Outside => {
                    let whole = quadrature::triangle(degree);
                    points.extend_from_slice(&whole.points);
                    weights.extend_from_slice(&whole.weights);
                    -1.0
                }
                MeshPart::Inside(_) => 1.0,
            };
            for (body, region) in &self.parts {
                if matches!(part, MeshPart::Inside(Some(asked)) if asked != *body) {
                    continue;
                }
                let rule = match region {
                    Region::Straight(boundary) => rule::fan(boundary, degree),
                    Region::Curved(sides) => curved::fan(mesh, cell, sides, degree),
                };
                points.extend(rule.points);
                weights.extend(rule.weights.iter().map(|w| sign * w));
            }
            CutRule { tables: Tables::new(points), weights }
        })
    }
}

impl CutFace {
    pub fn rule(&self, part: MeshPart, degree: usize, sides: (usize, Option<usize>)) -> Arc<CutFaceRule> {
        self.rules.get(part, degree, || {
            let gauss = quadrature::interval(degree);
            let (mut shares, mut weights) = (Vec::new(), Vec::new());
            for [from, to] in self.intervals(part) {
                shares.extend(gauss.points.iter().map(|s| from + s * (to - from)));
                weights.extend(gauss.weights.iter().map(|w| w * (to - from)));
            }
            let minus = Tables::new(shares.iter().map(|&s| basis::face_point(sides.0, s)).collect());
            let plus = sides.1.map(|f| Tables::new(shares.iter().map(|&s| basis::face_point(f, 1.0 - s)).collect()));
            CutFaceRule { minus, plus, weights }
        })
    }

    /// Whether the face has such a part.
    pub fn has(&self, part: MeshPart) -> bool {
        !self.intervals(part).is_empty()
    }

    fn intervals(&self, part: MeshPart) -> Vec<[f64; 2]> {
        let inside = |asked: Option<usize>| {
            self.parts.iter().filter(move |(body, _)| asked.is_none_or(|b| b == *body)).map(|(_, span)| *span)
        };
        match part {
            MeshPart::Inside(asked) => inside(asked).collect(),
            MeshPart::Outside => {
                let mut at = 0.0;
                let mut gaps = Vec::new();
                for [from, to] in inside(None).chain([[1.0, 1.0]]) {
                    if from - at > face::NOTHING {
                        gaps.push([at, from]);
                    }
                    at = to.max(at);
                }
                gaps
            }
        }
    }
}
