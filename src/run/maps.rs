//! Pictures of the fields of a state.

use std::collections::HashMap;

use super::RunError;
use super::stepper::Ground;
use crate::element::basis;
use crate::measure::OutputField;
use crate::measure::fields::{Fields, Part, STREAM_FUNCTION};
use crate::mesh::locate::Locator;
use crate::mesh::{Face, Mesh, Point};
use crate::model::immersed::flow::Method;
use crate::output::bodies::{Moment, overlay};
use crate::output::plot::PlotError;
use crate::output::plot::map::{Layer, Look, Map, Palette, Picture, Window};
use crate::scene::{ArrowsOf, MapRequest, Output, Quantity, Scene, SceneSource, StokesScene};
use crate::space::Field;

/// Straight pieces that a curved face is drawn with.
const PIECES: usize = 12;
/// Points across a window at which the domain is looked for.
const PROBES: usize = 60;

/// The texts of pictures that a scene determines.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Caption {
    /// Parameters of the model.
    pub parameters: String,
    /// Whether a steady state is searched for, whose pseudo-time tells nothing.
    steady: bool,
}

impl Caption {
    /// Those of a scene.
    pub fn of(scene: &Scene) -> Self {
        let p = &scene.parameters;
        let mut list = vec![("Pe", p.peclet), ("C_F", p.friction)];
        let mut unless = |name, value: f64, usual: f64| {
            if value != usual {
                list.push((name, value));
            }
        };
        unless("T_a", p.traction, p.friction);
        unless("S_a", p.active_stress, 0.0);
        if let Some(law) = p.density {
            unless("S_a'", law.active_stress_iso, 0.0);
            unless("c_0", law.penalty, f64::NAN);
            unless("γ", law.exponent, f64::NAN);
            unless("ρ_{min}", law.critical, 0.0);
        }
        list.extend([("B", p.elasticity), ("κ", p.coherence), ("a", p.alignment)]);
        let parameters: Vec<String> =
            list.iter().map(|(name, value)| format!("{name}\u{a0}=\u{a0}{}", short(*value, 4))).collect();
        Self { parameters: parameters.join(", "), steady: scene.steady.is_some() }
    }

    /// Those of a flow without a tissue.
    pub fn of_flow(scene: &StokesScene) -> Self {
        let mut parameters = format!("C_F\u{a0}=\u{a0}{}", short(scene.fluid.friction, 4));
        if let Some(Method::Penalty(penalty)) = scene.bodies.as_ref().map(|bodies| bodies.rigid.method) {
            parameters += &format!(", ε\u{a0}=\u{a0}{}", short(penalty.epsilon, 4));
        }
        Self { parameters, steady: false }
    }
}

/// A number rounded to so many significant digits, with a true minus sign.
fn short(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    crate::output::number(rounded).replace('-', "−")
}

/// A state of which pictures are drawn.
#[derive(Clone, Copy)]
pub struct Draft<'s> {
    /// What is drawn.
    pub fields: &'s dyn Fields,
    /// Where it is drawn.
    pub ground: &'s Ground,
    /// Their time.
    pub t: f64,
    /// Rigid bodies in the flow: they are drawn above the fields, which are not shown inside of them.
    pub bodies: Option<&'s Moment<'s>>,
}

impl<'s> Draft<'s> {
    /// Of fields without bodies.
    pub fn new(fields: &'s dyn Fields, ground: &'s Ground, t: f64) -> Self {
        Self { fields, ground, t, bodies: None }
    }

    /// With these bodies above them, if there are some.
    pub fn with_bodies(self, moment: &'s Moment<'s>) -> Self {
        Self { bodies: (!moment.solids.bodies.is_empty()).then_some(moment), ..self }
    }

    /// The picture that was asked for.
    ///
    /// # Errors
    /// A window that does not meet the domain; a pressure or a stream function that cannot be solved for.
    pub fn draw(&self, request: &MapRequest, caption: &Caption) -> Result<Picture, RunError> {
        self.with(request, caption, |map| map.draw())
    }

    /// The smallest and the largest value that the picture would show.
    ///
    /// # Errors
    /// As [`Draft::draw`].
    pub fn extent(&self, request: &MapRequest, caption: &Caption) -> Result<[f64; 2], RunError> {
        let plain = MapRequest { arrows: None, streamlines: false, mesh: false, ..request.clone() };
        self.with(&plain, caption, |map| map.extent())
    }

    fn with<R>(
        &self,
        request: &MapRequest,
        caption: &Caption,
        then: impl FnOnce(&Map) -> Result<R, PlotError>,
    ) -> Result<R, RunError> {
        let loops = self.fields.loops();
        let mesh = &*loops.mesh;
        let kind = self.fields.kind();
        let Quantity::Of(shown) = request.of else { unreachable!("bodies alone are drawn without a field") };
        let field = self.field(shown.field)?;
        let scalar = |x: Point| self.at(x, |cell, xi| shown.at(&field, cell, xi));
        let arrows = match request.arrows {
            Some(ArrowsOf(vector)) => {
                let length = vector.length().expect("every vector has its length among its scalars");
                Some((self.field(vector)?, length.part.symbol.of(kind)))
            }
            None => None,
        };
        let vector =
            |x: Point| self.at(x, |cell, xi| arrows.as_ref().map(|(field, _)| field.vector_at(cell, xi))).flatten();
        let psi = match request.streamlines {
            true => Some(self.field(&STREAM_FUNCTION)?),
            false => None,
        };
        // bodies hide its lines inside of them
        let stream = |x: Point| self.anywhere(x, |cell, xi| psi.as_ref().map(|psi| psi.scalar_at(cell, xi))).flatten();
        let mut layers = Vec::new();
        if request.mesh {
            layers.push(Layer::Lines { lines: inner_edges(mesh), look: Look::Mesh });
        }
        layers.push(Layer::Lines { lines: outline(mesh), look: Look::Outline });
        if request.streamlines {
            layers.push(Layer::Contours { name: "Δψ".into(), of: &stream });
        }
        if let Some((_, name)) = &arrows {
            layers.push(Layer::Arrows { name: (*name).into(), of: &vector });
        }
        layers.extend(self.bodies.iter().flat_map(|moment| overlay(moment, true)));
        let failed = |error| failed(&request.name, error);
        let map = Map {
            title: self.title(shown.part, caption),
            subtitle: caption.parameters.clone(),
            name: shown.part.symbol.of(kind).into(),
            palette: if shown.part.signed { Palette::Diverging } else { Palette::Sequential },
            range: request.range,
            layers,
            ..Map::new(window(request, mesh).map_err(failed)?, &scalar)
        };
        then(&map).map_err(failed)
    }

    fn title(&self, shown: &Part, caption: &Caption) -> String {
        let when = match caption.steady {
            true => String::new(),
            false => format!(" at t = {}", short(self.t, 6)),
        };
        format!("{} {}{when}", shown.title, shown.symbol.of(self.fields.kind()))
    }

    fn field(&self, of: &OutputField) -> Result<Field, RunError> {
        let found = (of.find)(&self.ground.at(self.fields))?;
        Ok(found.expect("refused with the scene where there is none"))
    }

    /// What a function of cell and reference point has at a point of the domain that lies in no body.
    fn at<T>(&self, x: Point, value: impl FnOnce(usize, Point) -> T) -> Option<T> {
        let free = self.bodies.is_none_or(|moment| moment.body_at(x).is_none());
        if free { self.anywhere(x, value) } else { None }
    }

    fn anywhere<T>(&self, x: Point, value: impl FnOnce(usize, Point) -> T) -> Option<T> {
        self.ground.locator.locate(&self.ground.mesh, x).map(|(cell, xi)| value(cell, xi))
    }
}

/// An error of drawing, with the name of the map.
pub(super) fn failed(name: &str, error: PlotError) -> RunError {
    RunError::Map { origin: format!("map `{name}`"), error: Box::new(error) }
}

/// The window that was asked for, or one around the domain.
fn window(request: &MapRequest, mesh: &Mesh) -> Result<Window, PlotError> {
    match request.window {
        Some([low, high]) => Window::new(low, high),
        None => Window::around(outline(mesh).into_iter().flatten()),
    }
}

/// Refuses windows that show nothing of the domain, before anything is solved; `key` is that of the list.
///
/// # Errors
/// The first such window.
pub(super) fn check_windows(
    requests: &[MapRequest],
    key: &str,
    scene: &SceneSource,
    (mesh, locator): (&Mesh, &Locator),
) -> Result<(), RunError> {
    for (at, request) in requests.iter().enumerate().filter(|(_, request)| request.of != Quantity::Bodies) {
        let origin = || scene.place(&format!("{key}.{at}.window")).to_string();
        let window =
            window(request, mesh).map_err(|error| RunError::Map { origin: origin(), error: Box::new(error) })?;
        let probes = (0..PROBES * PROBES).map(|k| {
            let share = |i: usize| (i as f64 + 0.5) / PROBES as f64;
            window.at(share(k % PROBES), share(k / PROBES))
        });
        let meets = mesh.vertices.iter().any(|x| window.contains(*x))
            || probes.into_iter().any(|x| locator.locate(mesh, x).is_some());
        if !meets {
            let error = Box::new(PlotError::Blank { name: request.name.clone() });
            return Err(RunError::Map { origin: origin(), error });
        }
    }
    Ok(())
}

/// As [`check_windows`], of all outputs.
///
/// # Errors
/// The first such window.
pub(super) fn check_all_windows(outputs: &[Output], scene: &SceneSource, mesh: &Mesh) -> Result<(), RunError> {
    if outputs.iter().all(|output| output.what.maps().is_empty()) {
        return Ok(());
    }
    let locator = Locator::new(mesh);
    outputs.iter().enumerate().try_for_each(|(at, output)| {
        check_windows(output.what.maps(), &format!("output.{at}.maps"), scene, (mesh, &locator))
    })
}

/// The faces between two cells.
fn inner_edges(mesh: &Mesh) -> Vec<Vec<Point>> {
    mesh.faces.iter().filter(|face| face.plus.is_some()).map(|face| edge(mesh, face)).collect()
}

/// The boundary, each closed curve of it as one line, so that its corners are drawn whole.
fn outline(mesh: &Mesh) -> Vec<Vec<Point>> {
    let boundary: Vec<&Face> = mesh.faces.iter().filter(|face| face.plus.is_none()).collect();
    let mut from: HashMap<usize, Vec<usize>> = HashMap::new();
    // the last one is taken first
    for (k, face) in boundary.iter().enumerate().rev() {
        from.entry(mesh.face_vertices(face)[0]).or_default().push(k);
    }
    let mut used = vec![false; boundary.len()];
    let mut lines = Vec::new();
    for first in 0..boundary.len() {
        let (mut line, mut next) = (Vec::new(), Some(first).filter(|&k| !used[k]));
        while let Some(k) = next {
            used[k] = true;
            // each piece begins where the last one ended
            line.extend(edge(mesh, boundary[k]).into_iter().skip(usize::from(!line.is_empty())));
            let end = mesh.face_vertices(boundary[k])[1];
            next = from.get(&end).and_then(|all| all.iter().rev().copied().find(|&k| !used[k]));
        }
        if !line.is_empty() {
            lines.push(line);
        }
    }
    lines
}

/// A face as a polyline, from the first of its vertices to the second.
fn edge(mesh: &Mesh, face: &Face) -> Vec<Point> {
    let side = face.minus;
    let pieces = if mesh.curved[side.cell].is_some() { PIECES } else { 1 };
    let map = mesh.map(side.cell);
    (0..=pieces).map(|k| map.at(basis::face_point(side.face, k as f64 / pieces as f64)).0).collect()
}
