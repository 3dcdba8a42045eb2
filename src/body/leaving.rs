//! Bodies that leave the mesh: where they may, which are left, and what is told of those that have gone.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::mesh::{Mesh, Point};

/// What rigid bodies meet at a part of the mesh's boundary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Passage {
    /// They pass through it; one of which nothing is left inside is taken out, and the run goes on.
    Leave,
    /// They stay inside, as behind a `[[wall]]` with this tag.
    Wall,
}

/// The parts of a mesh's boundary through which bodies leave.
#[derive(Debug, Clone, Default)]
pub struct Exits {
    /// The ends of every face of the boundary, and the number of its tag.
    sides: Vec<([Point; 2], usize)>,
    /// Names of the tags, and whether bodies leave there.
    tags: Vec<(String, bool)>,
}

impl Exits {
    /// `open` are the tags through which bodies leave.
    pub fn new(mesh: &Mesh, open: &[String]) -> Self {
        let ends = |face| mesh.face_vertices(face).map(|vertex| mesh.vertices[vertex]);
        Self {
            sides: mesh.faces.iter().filter_map(|face| Some((ends(face), face.tag?))).collect(),
            tags: mesh.tags.iter().map(|tag| (tag.clone(), open.contains(tag))).collect(),
        }
    }

    /// The part of the boundary that is nearest to a point, and whether bodies leave there. Where two parts meet, the
    /// one through which they leave.
    pub fn beside(&self, x: Point) -> Option<(&str, bool)> {
        let away: Vec<f64> = self.sides.iter().map(|(ends, _)| distance(x, *ends)).collect();
        let nearest = away.iter().copied().fold(f64::INFINITY, f64::min);
        let beside = self.sides.iter().zip(away).filter(|(_, away)| *away <= nearest * (1.0 + 1e-9));
        let tags = beside.map(|((_, tag), _)| &self.tags[*tag]);
        let (tag, open) = tags.reduce(|first, other| if other.1 && !first.1 { other } else { first })?;
        Some((tag.as_str(), *open))
    }
}

/// From a point to a segment.
fn distance(x: Point, [a, b]: [Point; 2]) -> f64 {
    let along = b - a;
    let share = ((x - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (x - a - share * along).norm()
}

/// A body that has left.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Departure {
    /// Its name.
    pub body: String,
    /// The end of the step in which it left.
    pub time: f64,
    /// Of its centre, at that time.
    pub position: [f64; 2],
    /// The tag of the boundary next to it.
    pub through: String,
}

impl std::fmt::Display for Departure {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { body, time, position: [x, y], through } = self;
        write!(out, "the body `{body}` has left through `{through}` by t = {time:.6}, at ({x:.4}, {y:.4})")
    }
}

/// Those of a list of bodies that are left, by their old numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remaining {
    /// Ascending.
    kept: Vec<usize>,
}

impl Remaining {
    /// All of `count` bodies but those that have gone.
    pub fn all_but(count: usize, gone: &[usize]) -> Self {
        Self { kept: (0..count).filter(|body| !gone.contains(body)).collect() }
    }

    /// Those of a list that have one of these names.
    pub fn named(bodies: &[super::Body], names: &[String]) -> Self {
        Self { kept: (0..bodies.len()).filter(|body| names.contains(&bodies[*body].name)).collect() }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.kept.len()
    }

    /// The old number of a body.
    pub fn old(&self, number: usize) -> usize {
        self.kept[number]
    }

    /// The number of a body among those that are left; `None` of one that has gone.
    pub fn number(&self, old: usize) -> Option<usize> {
        self.kept.binary_search(&old).ok()
    }

    /// Their entries of a list with one for each body; an empty list stays empty.
    pub fn of<T: Clone>(&self, list: &[T]) -> Vec<T> {
        if list.is_empty() { Vec::new() } else { self.kept.iter().map(|old| list[*old].clone()).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::MeshScene;

    #[test]
    fn remaining_bodies_have_numbers_of_their_own() {
        let remaining = Remaining::all_but(4, &[1]);
        assert_eq!(remaining.of(&["a", "b", "c", "d"]), ["a", "c", "d"]);
        assert!(remaining.of::<f64>(&[]).is_empty());
        assert_eq!([0, 1, 2, 3].map(|old| remaining.number(old)), [Some(0), None, Some(1), Some(2)]);
        assert_eq!(([0, 1, 2].map(|number| remaining.old(number)), remaining.count()), ([0, 2, 3], 3));
    }

    #[test]
    fn the_nearest_side_is_where_a_body_leaves() {
        let mesh = MeshScene::of("square").with("n", 2).build().unwrap();
        let exits = Exits::new(&mesh, &["right".to_owned()]);
        let beside = [(1.3, 0.4, "right", true), (0.4, -0.2, "bottom", false), (-0.1, 0.7, "left", false)];
        for (x, y, side, open) in beside {
            assert_eq!(exits.beside(Point::new(x, y)), Some((side, open)));
        }
        // beyond the corner of two sides
        assert_eq!(exits.beside(Point::new(1.2, 1.1)), Some(("right", true)));
    }
}
