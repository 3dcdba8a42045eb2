//! Circles through boundary nodes, so that imported meshes have exact normals too.

use super::super::{Curve, Point};

/// Deviation from the circle that rounding in a file may cause, relative to the size of the boundary part.
const ON_CIRCLE: f64 = 1e-8;
/// Sagitta over chord below which a boundary part counts as straight.
const STRAIGHT: f64 = 1e-4;
/// Longest arc of one face. The corners of every triangle and rectangle lie on a circle too, but one of their sides spans
/// at least a right angle.
const WIDEST: f64 = 1.4;

/// The circle on which all `nodes` lie and that every face (given by its ends) follows by less than a right angle.
///
/// Three nodes lie on a circle always, so a fourth must confirm it.
pub fn through(nodes: &[Point], faces: &[[Point; 2]]) -> Option<Curve> {
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
