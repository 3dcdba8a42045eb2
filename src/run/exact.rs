//! Whether the exact fields of a scene can be a solution at all.

use std::collections::BTreeMap;

use super::RunError;
use crate::mesh::{Face, Mesh, Point};
use crate::model::manufactured::Volume;
use crate::model::{Conditions, Exact, Held};
use crate::scene::SceneSource;

/// `div v` may be this share of `|∂₁v₁| + |∂₂v₂|`.
const SOLENOIDAL: f64 = 1e-9;
/// `v·n` on slip may be this share of the largest speed: nodes lie on curves to rounding or to the digits of a file.
const THROUGH: f64 = 1e-6;

/// Exact fields where they are to be a solution.
pub struct Claim<'a> {
    /// Those that are claimed.
    pub exact: &'a Exact,
    /// The scene that has them.
    pub source: &'a SceneSource,
    /// What holds by tag.
    pub boundary: &'a BTreeMap<String, Conditions>,
    /// Last time.
    pub end: f64,
}

impl Claim<'_> {
    /// Refuses exact fields that no sources can make a solution; looks at one point of every cell and boundary face at
    /// the start, the middle and the end of the run.
    ///
    /// # Errors
    /// A field or a derivative that is not finite; a velocity that is not solenoidal in a flow of constant density,
    /// that runs through a slip boundary or along one that forbids it; a density below zero.
    pub fn check(&self, mesh: &Mesh) -> Result<(), RunError> {
        let exact = self.exact;
        let boundary: Vec<(Point, Point, &str)> =
            mesh.faces.iter().filter_map(|face| boundary_point(mesh, face)).collect();
        for t in [0.0, 0.5 * self.end, self.end] {
            let mut fastest = 0.0;
            for cell in 0..mesh.cells.len() {
                let x = mesh.map(cell).at(Point::new(0.3, 0.25)).0;
                self.check_finite(x, t)?;
                match exact.volume() {
                    Volume::Pressure(_) => self.check_solenoidal(x, t)?,
                    Volume::Density { .. } => self.check_density(x, t)?,
                }
                fastest = f64::max(fastest, velocity(exact, x, t).norm());
            }
            for &(x, n, tag) in &boundary {
                self.check_finite(x, t)?;
                self.check_boundary(tag, velocity(exact, x, t), n, THROUGH * fastest)
                    .map_err(|(what, hint)| self.wrong("exact.velocity", what + &at(x, t), hint))?;
            }
        }
        Ok(())
    }

    fn wrong(&self, key: &str, what: String, hint: &str) -> RunError {
        RunError::Start { file: self.source.place(key).to_string(), what: format!("`{key}` {what}"), hint: hint.into() }
    }

    fn check_finite(&self, x: Point, t: f64) -> Result<(), RunError> {
        let exact = self.exact;
        let volume = match exact.volume() {
            Volume::Pressure(_) => "exact.pressure",
            Volume::Density { .. } => "exact.density",
        };
        let vectors = ["exact.velocity", "exact.polarity"].into_iter().zip(exact.vectors());
        let vectors = vectors.flat_map(|(key, pair)| pair.iter().map(move |formula| (key, formula)));
        for (key, formula) in vectors.chain([(volume, exact.volume().formula())]) {
            if let Err(error) = formula.try_eval(x, t) {
                let message = error.to_string();
                let (what, _) = message.split_once("; hint: ").unwrap_or((&message, ""));
                // the key stands before it
                let what = what.rsplit_once(&format!("`{key}`: ")).map_or(what, |(_, what)| what);
                let hint = "exact fields must be finite on the whole domain, up to `time.end`";
                return Err(self.wrong(key, format!("= {what}"), hint));
            }
        }
        Ok(())
    }

    fn check_solenoidal(&self, x: Point, t: f64) -> Result<(), RunError> {
        let (value, scale) = (self.exact.divergence(x, t), self.exact.stretching(x, t));
        if value.abs() <= SOLENOIDAL * scale.max(1e-9) {
            return Ok(());
        }
        let what = format!("has div v = {value:.3e}{}, and must have none", at(x, t));
        Err(self.wrong("exact.velocity", what, "take the derivatives of a stream function, v = (∂ψ/∂y, −∂ψ/∂x)"))
    }

    fn check_density(&self, x: Point, t: f64) -> Result<(), RunError> {
        let density = self.exact.density(x, t);
        if density >= 0.0 {
            return Ok(());
        }
        let hint = "add a constant, or take a smaller amplitude";
        Err(self.wrong("exact.density", format!("is {density:.3e}{}, and must not be negative", at(x, t)), hint))
    }

    /// What is wrong with the velocity `v` where the normal is `n`, and a hint.
    fn check_boundary(&self, tag: &str, v: Point, n: Point, allowed: f64) -> Result<(), (String, &'static str)> {
        let tangent = Point::new(-n.y, n.x);
        let condition = &self.boundary[tag].velocity;
        let name = condition.name();
        match condition.holds() {
            Held::Normal if v.dot(&n).abs() > allowed => Err((
                format!("has v·n = {:.3e} on `{tag}`, which is \"{name}\" and lets nothing through,", v.dot(&n)),
                "let the stream function be constant there, or take velocity = \"dirichlet\" on this tag",
            )),
            Held::Tangent if v.dot(&tangent).abs() > allowed => Err((
                format!("has v·t = {:.3e} on `{tag}`, which is \"{name}\",", v.dot(&tangent)),
                "take velocity = \"dirichlet\" on this tag",
            )),
            Held::Normal | Held::Tangent | Held::Both | Held::Nothing => Ok(()),
        }
    }
}

fn velocity(exact: &Exact, x: Point, t: f64) -> Point {
    let [first, second] = exact.velocity();
    Point::new(first.eval(x, t), second.eval(x, t))
}

fn at(x: Point, t: f64) -> String {
    format!(" at x = {}, y = {}, t = {t}", x.x, x.y)
}

/// A point of a boundary face that lies on the exact boundary, the exact normal there, and the tag.
fn boundary_point<'a>(mesh: &'a Mesh, face: &Face) -> Option<(Point, Point, &'a str)> {
    let tag = face.tag?;
    let [a, b] = mesh.face_vertices(face).map(|v| mesh.vertices[v]);
    let chord = Point::new(b.y - a.y, a.x - b.x).normalize();
    let (x, n) = match face.curve {
        Some(curve) => (a, mesh.curves[curve].normal(a, chord)),
        None if mesh.curved[face.minus.cell].is_none() => ((a + b) / 2.0, chord),
        // curved by a file, with no curve that would be known exactly
        None => return None,
    };
    Some((x, n, &mesh.tags[tag]))
}
