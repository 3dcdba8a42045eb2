//! Delaunay triangulation of the outline, and points inside it: an advancing front lays them in layers.

use std::collections::VecDeque;

use spade::handles::{DirectedEdgeHandle, FixedVertexHandle};
use spade::{ConstrainedDelaunayTriangulation, Point2, PositionInTriangulation, Triangulation};

use super::outline::Border;
use super::size::Size;
use crate::mesh::Point;

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;
type Edge<'t> = DirectedEdgeHandle<'t, Point2<f64>, (), spade::CdtEdge<()>, ()>;
type Corners = [FixedVertexHandle; 3];

/// A triangle needs a point while its circumradius exceeds this multiple of the wanted edge length (1/√3 is ideal).
const LARGE: f64 = 0.78;

/// New points keep this multiple of the wanted length from other points, and `WALL` times it from the border.
const ROOM: f64 = 0.68;
const WALL: f64 = 0.45;

fn load(points: &[Point], edges: &[[usize; 2]]) -> Cdt {
    let positions = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    Cdt::bulk_load_cdt(positions, edges.to_vec()).expect("checked sizes give finite points")
}

fn point(p: Point2<f64>) -> Point {
    Point::new(p.x, p.y)
}

/// Cells (counterclockwise) of the constrained Delaunay triangulation inside the closed loops `edges`.
pub(super) fn triangulate(points: &[Point], edges: &[[usize; 2]]) -> Vec<[usize; 3]> {
    let cdt = load(points, edges);
    assert_eq!(cdt.num_vertices(), points.len(), "two points of the mesh coincide");
    inside(&cdt).into_iter().map(|corners| corners.map(|v| v.index())).collect()
}

/// The triangles with an odd number of loops around them.
fn inside(cdt: &Cdt) -> Vec<Corners> {
    let mut odd: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    odd[cdt.outer_face().fix().index()] = Some(false);
    let mut queue: VecDeque<_> = cdt.convex_hull().map(|e| (e.fix(), false)).collect();
    while let Some((edge, outside)) = queue.pop_front() {
        let across = cdt.directed_edge(edge).rev();
        let state = &mut odd[across.face().fix().index()];
        if state.is_none() {
            let parity = outside ^ across.is_constraint_edge();
            *state = Some(parity);
            queue.extend([(across.next().fix(), parity), (across.prev().fix(), parity)]);
        }
    }
    let kept = cdt.inner_faces().filter(|f| odd[f.fix().index()] == Some(true));
    kept.map(|f| f.vertices().map(|v| v.fix())).collect()
}

/// The points of the border and those laid inside.
pub(super) fn fill(border: &Border, size: &Size) -> Vec<Point> {
    let mut cdt = load(&border.points, &border.edges);
    let mut queue = VecDeque::from(inside(&cdt));
    // The front can stall where it only meets obtuse triangles; then their circumcentres restart it.
    for place in [from_front, at_circumcentre, from_front, at_circumcentre] {
        while let Some(corners) = queue.pop_front() {
            let Some(x) = open(&cdt, corners, size).and_then(|edge| place(edge, size)) else { continue };
            let Some(x) = settle(&cdt, corners, x, size) else { continue };
            let new = cdt.insert_with_hint(Point2::new(x.x, x.y), corners[0]).expect("a finite point");
            for edge in cdt.vertex(new).out_edges() {
                queue.push_back(corners_of(edge));
                let beyond = edge.next().rev();
                if !beyond.is_constraint_edge() {
                    queue.push_back(corners_of(beyond));
                }
            }
        }
        queue = VecDeque::from(inside(&cdt));
    }
    cdt.vertices().map(|v| point(v.position())).collect()
}

fn corners_of(edge: Edge<'_>) -> Corners {
    [edge, edge.next(), edge.prev()].map(|e| e.from().fix())
}

/// An edge of the triangle, if the triangle still exists and is too large.
fn open<'t>(cdt: &'t Cdt, [a, b, c]: Corners, size: &Size) -> Option<Edge<'t>> {
    let edge = cdt.get_edge_from_neighbors(a, b)?;
    (edge.next().to().fix() == c && large(edge, size)).then_some(edge)
}

/// Circumcentre relative to the first corner, of the triangle left of `edge`.
fn circumcentre(edge: Edge<'_>) -> (Point, Point) {
    let [a, b, c] = [edge.from(), edge.to(), edge.next().to()].map(|v| point(v.position()));
    let (u, v) = (b - a, c - a);
    let (p, q) = (u.norm_squared(), v.norm_squared());
    (a, Point::new(v.y * p - u.y * q, u.x * q - v.x * p) / (2.0 * u.perp(&v)))
}

fn large(edge: Edge<'_>, size: &Size) -> bool {
    let corners = [edge.from(), edge.to(), edge.next().to()].map(|v| point(v.position()));
    let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
    circumcentre(edge).1.norm() > LARGE * size.at(centroid)
}

/// The tip of an almost equilateral triangle on an edge of the front, if this triangle has such an edge.
fn from_front(edge: Edge<'_>, size: &Size) -> Option<Point> {
    let (a, toward) = circumcentre(edge);
    let centre = a + toward;
    let mut best: Option<(f64, Point)> = None;
    for side in [edge, edge.next(), edge.prev()] {
        if !side.is_constraint_edge() && large(side.rev(), size) {
            continue;
        }
        let (p, q) = (point(side.from().position()), point(side.to().position()));
        let (middle, along) = ((p + q) * 0.5, q - p);
        let length = along.norm();
        let up = Point::new(-along.y, along.x) / length;
        let limit = (centre - middle).dot(&up);
        if limit <= 0.0 || best.is_some_and(|(shortest, _)| shortest <= length) {
            continue;
        }
        let wanted = size.at(middle + up * (0.866 * length)).max(0.71 * length);
        let height = (wanted * wanted - 0.25 * length * length).sqrt();
        best = Some((length, middle + up * height.min(limit)));
    }
    best.map(|(_, x)| x)
}

fn at_circumcentre(edge: Edge<'_>, _: &Size) -> Option<Point> {
    let (a, toward) = circumcentre(edge);
    Some(a + toward)
}

/// `x` if it lies inside the domain with enough room about it.
fn settle(cdt: &Cdt, corners: Corners, x: Point, size: &Size) -> Option<Point> {
    let here = corners.map(|v| point(cdt.vertex(v).position()));
    let centroid = (here[0] + here[1] + here[2]) / 3.0;
    let target = Point2::new(x.x, x.y);
    let contains = (0..3).all(|k| (here[(k + 1) % 3] - here[k]).perp(&(x - here[k])) >= 0.0);
    if !contains && cdt.intersects_constraint(Point2::new(centroid.x, centroid.y), target) {
        return None;
    }
    let around: Vec<Edge<'_>> = match cdt.locate_with_hint(target, corners[0]) {
        PositionInTriangulation::OnFace(face) => cdt.face(face).adjacent_edges().to_vec(),
        PositionInTriangulation::OnEdge(edge) => {
            let edge = cdt.directed_edge(edge);
            [edge, edge.rev()].into_iter().flat_map(|e| [e, e.next(), e.prev()]).collect()
        }
        PositionInTriangulation::OnVertex(_)
        | PositionInTriangulation::OutsideOfConvexHull(_)
        | PositionInTriangulation::NoTriangulation => return None,
    };
    let h = size.at(x);
    let free = around.iter().all(|edge| {
        let (p, q) = (point(edge.from().position()), point(edge.to().position()));
        let near_wall = edge.is_constraint_edge() && (q - p).perp(&(x - p)).abs() < WALL * h * (q - p).norm();
        (x - p).norm() >= ROOM * h && !near_wall
    });
    free.then_some(x)
}
