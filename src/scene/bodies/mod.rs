//! Rigid bodies, walls and contact of a scene, checked.

pub(crate) mod place;
pub(crate) mod tables;

use std::collections::BTreeMap;

use super::error::SceneError;
use super::source::SceneSource;
use crate::body::Body;
use crate::body::leaving::Exits;
use crate::contact::in_flow::FlowCoupling;
use crate::contact::{Law, Method, Partner, Settings, Wall};
use crate::mesh::locate::Locator;
use crate::mesh::{Mesh, Point};
use crate::model::immersed::flow;
use crate::names;

/// The bodies of a scene and what they meet.
#[derive(Debug, Clone, PartialEq)]
pub struct Bodies {
    /// Those of `[[body]]`, then those of `[[bodies]]`.
    pub bodies: Vec<Body>,
    /// Walls that need no mesh.
    pub walls: Vec<Wall>,
    /// Boundary tags that are walls, and the keys that make them such, see [`Bodies::walls_on`].
    pub wall_tags: Vec<(String, String)>,
    /// Boundary tags through which bodies leave, see [`Bodies::exits`].
    pub open_tags: Vec<String>,
    /// `None` where nothing can touch.
    pub contact: Option<ContactSettings>,
    /// How a flow carries them; without a meaning for particles.
    pub rigid: flow::Settings,
}

/// How contact is resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSettings {
    /// How bodies part again.
    pub law: Law,
    /// `η`: `D + Δt G·V ≥ η`.
    pub margin: f64,
    /// μ of Coulomb's friction.
    pub friction: f64,
    /// e
    pub restitution: f64,
    /// Whether it acts on the flow; without a meaning for particles.
    pub flow: FlowCoupling,
    /// What a gap may miss, relative to the smaller body.
    pub tolerance: f64,
    /// How the quadratic programme is solved.
    pub solver: Method,
}

impl ContactSettings {
    /// As the solver takes them.
    pub fn settings(&self) -> Settings {
        let Self { law, margin, friction, restitution, flow: _, tolerance, solver } = *self;
        Settings { law, margin, tolerance, friction, restitution, method: solver, ..Settings::default() }
    }
}

impl Bodies {
    /// All walls, those of boundary tags on a mesh last.
    pub fn walls_on(&self, mesh: &Mesh) -> Vec<Wall> {
        let of_tags = self.wall_tags.iter().flat_map(|(_, tag)| segments(mesh, tag));
        self.walls.iter().copied().chain(of_tags).collect()
    }

    /// Where bodies leave a mesh.
    pub fn exits(&self, mesh: &Mesh) -> Exits {
        Exits::new(mesh, &self.open_tags)
    }
}

impl Bodies {
    /// Whether walls name tags of a mesh, and every body has its place in it.
    ///
    /// # Errors
    /// An unknown tag; a wall that the boundary makes and that is curved; a body that is larger than the domain, or wholly outside of it; one that overlaps a wall of the
    /// boundary.
    pub fn check_mesh(&self, source: &SceneSource, mesh: &Mesh) -> Result<(), SceneError> {
        let error = |key: &str, value: String, rule: String, hint: &str| {
            let (place, key) = (source.place(key), key.to_owned());
            Err(SceneError::Value { place, key, value, rule, hint: hint.to_owned() })
        };
        for (key, tag) in &self.wall_tags {
            if mesh.tag(tag).is_none() {
                let known: Vec<&str> = mesh.tags.iter().map(String::as_str).collect();
                let rule = format!("names no part of the mesh's boundary{}", names::did_you_mean(tag, &known));
                let hint = format!("the mesh's tags are {}", known.join(", "));
                return error(key, format!("\"{tag}\""), rule, &hint);
            }
            if key.starts_with("boundary.") && is_curved(mesh, tag) {
                let rule = "this part of the boundary is curved, and contact knows straight walls of a mesh alone";
                let hint = "put a [[wall]] there, `disc` or `hollow`, or set `mesh.curved = 1`";
                return error(key, "\"wall\"".to_owned(), rule.to_owned(), hint);
            }
        }
        let extent = Extent::of(mesh);
        for body in &self.bodies {
            if let Some((rule, hint)) = extent.refuses(body) {
                return error(&body.key, format!("`{}`", body.name), rule, hint);
            }
        }
        let of_tags: Vec<(&str, Wall)> = self
            .wall_tags
            .iter()
            .flat_map(|(key, tag)| segments(mesh, tag).into_iter().map(move |wall| (wall_of(key), wall)))
            .collect();
        let walls: Vec<Wall> = of_tags.iter().map(|(_, wall)| *wall).collect();
        let Some((i, wall, depth)) = place::first_in_wall(&self.bodies, &walls, &|_| false) else {
            return self.check_margin(source, &walls, &of_tags);
        };
        let (wall, body) = (of_tags[wall].0, &self.bodies[i]);
        let rule = format!("overlaps the wall `{wall}`, a part of the boundary, by {depth:.3e}");
        let at = format!("{} (`{}`)", shown(body.start.position), body.name);
        error(&body.key, at, rule, "move the body away from it, or take the wall off")
    }

    /// Whether the walls of the boundary leave room for the margin.
    fn check_margin(&self, source: &SceneSource, walls: &[Wall], of_tags: &[(&str, Wall)]) -> Result<(), SceneError> {
        let margin = self.contact.map_or(0.0, |contact| contact.margin);
        let Some((at, Partner::Wall(wall), gap)) = place::first_crowded(&self.bodies, walls, margin) else {
            return Ok(());
        };
        let partner = format!("the wall `{}`", of_tags[wall].0);
        let (rule, hint) = place::crowded_rule(&self.bodies[at].name, &partner, gap);
        let (key, value) = ("contact.margin".to_owned(), margin.to_string());
        Err(SceneError::Value { place: source.place(&key), key, value, rule, hint })
    }
}

/// How large a mesh is, for bodies that are to lie in it.
struct Extent<'m> {
    mesh: &'m Mesh,
    locator: Locator,
    /// Sides of the rectangle about it.
    sides: Point,
    area: f64,
}

impl<'m> Extent<'m> {
    fn of(mesh: &'m Mesh) -> Self {
        let (low, high) =
            mesh.vertices.iter().fold((mesh.vertices[0], mesh.vertices[0]), |(a, b), x| (a.inf(x), b.sup(x)));
        let area = (0..mesh.cells.len()).map(|cell| mesh.cell_area(cell)).sum::<f64>();
        Self { mesh, locator: Locator::new(mesh), sides: high - low, area }
    }

    /// Why a body has no place in the mesh, and what to do.
    fn refuses(&self, body: &Body) -> Option<(String, &'static str)> {
        let Self { mesh, locator, sides, area } = self;
        let outline = place::outline(&body.shape, &body.start);
        let (a, b) = outline.iter().fold((outline[0], outline[0]), |(a, b), x| (a.inf(x), b.sup(x)));
        let size = b - a;
        if size.x >= sides.x || size.y >= sides.y || body.shape.area() >= *area {
            let rule = format!(
                "the body, {} by {}, is larger than the domain, {} by {}",
                short(size.x),
                short(size.y),
                short(sides.x),
                short(sides.y)
            );
            return Some((rule, "take a smaller body, or a larger mesh"));
        }
        if !outline.iter().any(|x| locator.locate(mesh, *x).is_some()) {
            let rule = format!("the body at {} lies wholly outside of the mesh", shown(body.start.position));
            return Some((rule, "move it, so that some part of it lies in the domain: bodies leave, but do not enter"));
        }
        let (cell, _) = locator.locate(mesh, body.start.position)?;
        let (thin, cell) = (body.shape.inradius(), (2.0 * mesh.cell_area(cell)).sqrt());
        (thin < FINEST * cell).then(|| {
            let rule = format!(
                "half of the body's thickness, {thin:.1e}, is {:.1e} of the cell where it lies: below {FINEST:e} \
                 nothing is left of it",
                thin / cell
            );
            (rule, "take a larger body, or much smaller cells")
        })
    }
}

/// Half thickness of the thinnest body that a mesh can hold, relative to a cell.
const FINEST: f64 = 1e-7;

/// A length with four digits.
fn short(length: f64) -> String {
    if (1e-3..1e6).contains(&length) { format!("{length:.4}") } else { format!("{length:.3e}") }
}

fn shown(x: Point) -> String {
    format!("[{}, {}]", x.x, x.y)
}

/// A wall's table, from the key that makes it a part of the boundary.
fn wall_of(key: &str) -> &str {
    if key.starts_with("wall.") { key.trim_end_matches(".tag") } else { key.trim_end_matches(".bodies") }
}

/// Whether a part of the boundary has a face that is not straight.
fn is_curved(mesh: &Mesh, tag: &str) -> bool {
    let Some(tag) = mesh.tag(tag) else { return false };
    let middles = [Point::new(0.5, 0.5), Point::new(0.0, 0.5), Point::new(0.5, 0.0)];
    mesh.faces.iter().filter(|face| face.tag == Some(tag)).any(|face| {
        let [a, b] = mesh.face_vertices(face).map(|vertex| mesh.vertices[vertex]);
        let (middle, _) = mesh.map(face.minus.cell).at(middles[face.minus.face]);
        (middle - 0.5 * (a + b)).norm() > 1e-9 * (b - a).norm()
    })
}

/// The boundary faces of a tag as walls with the mesh on their left; straight runs of faces make one wall.
fn segments(mesh: &Mesh, tag: &str) -> Vec<Wall> {
    let Some(tag) = mesh.tag(tag) else { return Vec::new() };
    let next: BTreeMap<usize, usize> = mesh
        .faces
        .iter()
        .filter(|face| face.tag == Some(tag))
        .map(|face| {
            let cell = mesh.cells[face.minus.cell];
            (cell[(face.minus.face + 1) % 3], cell[(face.minus.face + 2) % 3])
        })
        .collect();
    let ends: std::collections::BTreeSet<usize> = next.values().copied().collect();
    let straight =
        |a: Point, b: Point, c: Point| (b - a).perp(&(c - b)).abs() <= 1e-9 * (b - a).norm() * (c - b).norm();
    let mut left = next.clone();
    let mut walls = Vec::new();
    // chains that have a first face, then closed ones
    let firsts: Vec<usize> = next.keys().copied().filter(|v| !ends.contains(v)).chain(next.keys().copied()).collect();
    for first in firsts {
        let mut at = first;
        let mut run: Option<[Point; 2]> = None;
        while let Some(to) = left.remove(&at) {
            let [a, b] = [mesh.vertices[at], mesh.vertices[to]];
            run = match run {
                Some([start, end]) if straight(start, end, b) => Some([start, b]),
                Some(done) => {
                    walls.push(Wall::Segment(done));
                    Some([a, b])
                }
                None => Some([a, b]),
            };
            at = to;
        }
        walls.extend(run.map(Wall::Segment));
    }
    walls
}
