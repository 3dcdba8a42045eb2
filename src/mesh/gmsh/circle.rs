//! Circles through boundary nodes, so that imported meshes have exact normals too.

use std::collections::BTreeMap;

use super::super::{Curve, Point};
use super::boundary::BoundaryLine;
use super::groups;

/// Deviation from the circle that rounding in a file may cause, relative to the size of the boundary part.
const ON_CIRCLE: f64 = 1e-8;
/// Sagitta over chord below which a boundary part counts as straight.
const STRAIGHT: f64 = 1e-4;
/// Longest arc of one face. The corners of every triangle and rectangle lie on a circle too, but one of their sides
/// spans at least a right angle.
const WIDEST: f64 = 1.4;
/// Longest face, over the radius, of a circle of which the file has neither the curve nor inner nodes: 21 faces or
/// more.
const NARROW: f64 = 0.3;

/// The circles that boundary parts follow, and the circle of every line.
///
/// Tried first is a whole connected part of a group, for Gmsh draws a circle as several arcs; then each arc by itself.
pub fn of_lines(lines: &[BoundaryLine]) -> (Vec<Curve>, Vec<Option<usize>>) {
    let edges: Vec<_> = lines.iter().map(|l| l.vertices).collect();
    let whole = groups(&edges, |i, j| lines[i].group == lines[j].group);
    let arcs = groups(&edges, |i, j| lines[i].group == lines[j].group && lines[i].entity == lines[j].entity);
    let mut curves = Vec::new();
    let mut curve_of = vec![None; lines.len()];
    for labels in [whole, arcs] {
        let mut parts = BTreeMap::<usize, Vec<usize>>::new();
        (0..lines.len()).for_each(|line| parts.entry(labels[line]).or_default().push(line));
        for part in parts.into_values() {
            if curve_of[part[0]].is_none()
                && let Some(curve) = of_part(part.iter().map(|&line| &lines[line]))
            {
                part.iter().for_each(|&line| curve_of[line] = Some(curves.len()));
                curves.push(curve);
            }
        }
    }
    (curves, curve_of)
}

/// The circle of a connected part of the boundary. Each curve of the geometry in it must have an inner node: the
/// straight sides of a regular polygon, one edge each, are no circle although their ends lie on one.
fn of_part<'a>(lines: impl Iterator<Item = &'a BoundaryLine>) -> Option<Curve> {
    let mut nodes = BTreeMap::new();
    let mut faces = Vec::new();
    let mut per_entity = BTreeMap::<i32, usize>::new();
    let mut longest_unknown: f64 = 0.0;
    for line in lines {
        let ends = [line.positions[0], line.positions[1]];
        nodes.extend(line.vertices.into_iter().zip(ends));
        match line.entity {
            Some(entity) => *per_entity.entry(entity).or_default() += line.positions.len() - 1,
            None if line.positions.len() == 2 => longest_unknown = longest_unknown.max((ends[1] - ends[0]).norm()),
            None => {}
        }
        faces.push((ends, &line.positions[2..]));
    }
    let inner = faces.iter().flat_map(|(_, inner)| inner.iter().copied());
    let all: Vec<Point> = nodes.into_values().chain(inner).collect();
    let ends: Vec<[Point; 2]> = faces.iter().map(|(ends, _)| *ends).collect();
    if per_entity.values().any(|&pieces| pieces < 2) {
        return None;
    }
    through(&all, &ends).filter(|Curve::Circle { radius, .. }| longest_unknown <= NARROW * radius)
}

/// The circle on which all `nodes` lie and that every face (given by its ends) follows by less than a right angle.
///
/// Three nodes lie on a circle always, so a fourth must confirm it.
fn through(nodes: &[Point], faces: &[[Point; 2]]) -> Option<Curve> {
    if nodes.len() < 4 {
        return None;
    }
    let (centre, radius, extent) = circumcircle(nodes)?;
    let off = |x: &Point| ((x - centre).norm() - radius).abs();
    let spans = |[a, b]: &[Point; 2]| (a - centre).perp(&(b - centre)).atan2((a - centre).dot(&(b - centre))).abs();
    let fits = nodes.iter().all(|x| off(x) <= ON_CIRCLE * radius.min(extent));
    (fits && faces.iter().all(|face| spans(face) < WIDEST)).then_some(Curve::Circle { centre, radius })
}

/// Centre and radius of the circle through three nodes that lie far apart, and the largest distance of a node from the
/// first.
fn circumcircle(nodes: &[Point]) -> Option<(Point, f64, f64)> {
    let a = *nodes.first()?;
    let farthest =
        |measure: &dyn Fn(&Point) -> f64| nodes.iter().copied().max_by(|p, q| measure(p).total_cmp(&measure(q)));
    let b = farthest(&|p| (p - a).norm())?;
    let c = farthest(&|p| (p - a).perp(&(b - a)).abs())?;
    let (u, w) = (b - a, c - a);
    let (extent, twice_area) = (u.norm(), u.perp(&w));
    if twice_area.abs() <= STRAIGHT * extent * extent {
        return None;
    }
    let (uu, ww) = (u.norm_squared(), w.norm_squared());
    let from_a = Point::new(w.y * uu - u.y * ww, u.x * ww - w.x * uu) / (2.0 * twice_area);
    Some((a + from_a, from_a.norm(), extent))
}
