//! Pictures of bodies, and bodies above maps of fields.

use super::Moment;
use super::vtp::wall_line;
use crate::contact::Wall;
use crate::mesh::Point;
use crate::output::plot::PlotError;
use crate::output::plot::map::{Fill, Layer, Link, Map, Picture, Placed, Window};

/// Points of a round wall.
const POINTS: usize = 360;
/// Space around bodies and walls, over the longer side.
const MARGIN: f64 = 0.03;

/// What the colours of bodies tell. Bodies that never move are grey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Colour {
    /// `|V|`
    #[default]
    Speed,
    /// `|f|` of the force of all contacts together.
    Force,
    /// Which body it is; its name is written on it where there is room.
    Name,
}

/// How a picture of bodies looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Look {
    /// Title line; by default what is shown and the time.
    pub title: Option<String>,
    /// Line below it; may be empty.
    pub subtitle: String,
    /// Part of the plane that is shown; by default [`view`].
    pub window: Option<Window>,
    /// What colours tell.
    pub colour: Colour,
    /// Ends of the colour bar; by default 0 and the largest value.
    pub range: Option<[f64; 2]>,
    /// Whether lines between bodies that touch show the multipliers.
    pub contacts: bool,
}

impl Default for Look {
    fn default() -> Self {
        Self { title: None, subtitle: String::new(), window: None, colour: Colour::Speed, range: None, contacts: true }
    }
}

/// A window around all walls and bodies; around the unit square where there are none.
///
/// # Errors
/// [`PlotError::Window`] for positions that are not finite.
pub fn view(moment: &Moment) -> Result<Window, PlotError> {
    let placed = moment.solids.bodies.iter().zip(moment.poses);
    let corners = placed.flat_map(|(member, pose)| {
        let half = Point::repeat(member.shape.circumradius());
        [pose.position - half, pose.position + half]
    });
    let walls = moment.solids.walls.iter().flat_map(|wall| wall_line(wall, POINTS));
    let all: Vec<Point> = corners.chain(walls).collect();
    if all.is_empty() {
        return Window::new([0.0, 0.0], [1.0, 1.0]);
    }
    let (low, high) = all.iter().fold((all[0], all[0]), |(low, high), x| (low.inf(x), high.sup(x)));
    let margin = Point::repeat(MARGIN * (high - low).max());
    Window::around([low - margin, high + margin].into_iter())
}

/// Draws walls, bodies and contacts alone.
///
/// # Errors
/// [`PlotError::Window`] for positions that are not finite, [`PlotError::Font`].
pub fn picture(moment: &Moment, look: &Look) -> Result<Picture, PlotError> {
    let window = look.window.map_or_else(|| view(moment), Ok)?;
    let (name, what) = match look.colour {
        Colour::Speed => ("|V|", "bodies, speed |V|"),
        Colour::Force => ("|f|", "bodies, contact force |f|"),
        Colour::Name => ("", "bodies"),
    };
    let what = if moment.solids.bodies.is_empty() { "no bodies" } else { what };
    let largest = moving(moment).map(|k| value(moment, look.colour, k)).fold(0.0, f64::max);
    let range = look.range.unwrap_or([0.0, if largest > 0.0 { largest } else { 1.0 }]);
    let title = look.title.clone().unwrap_or_else(|| format!("{what} at t\u{a0}=\u{a0}{}", short(moment.time)));
    let mut layers = walls(moment);
    layers.push(Layer::Bodies(placed(moment, Some(look.colour))));
    if look.contacts {
        layers.push(links(moment));
    }
    let nothing = |_: Point| None;
    let subtitle = look.subtitle.clone();
    Map { title, subtitle, name: name.into(), range: Some(range), layers, ..Map::new(window, &nothing) }.draw_layers()
}

/// Layers for a map of fields: the walls that are not of its mesh, the bodies in grey, and if wanted the contacts.
pub fn overlay(moment: &Moment, contacts: bool) -> Vec<Layer<'static>> {
    let mut layers = walls(moment);
    layers.push(Layer::Bodies(placed(moment, None)));
    if contacts {
        layers.push(links(moment));
    }
    layers
}

fn walls(moment: &Moment) -> Vec<Layer<'static>> {
    let (mut lines, mut discs) = (Vec::new(), Vec::new());
    for wall in &moment.solids.walls {
        match *wall {
            Wall::Segment(_) | Wall::Hollow { .. } => lines.push(wall_line(wall, POINTS)),
            Wall::Disc { centre, radius } => discs.push((centre, radius)),
        }
    }
    if lines.is_empty() && discs.is_empty() { Vec::new() } else { vec![Layer::Walls { lines, discs }] }
}

/// Those that are not fixed.
fn moving(moment: &Moment) -> impl Iterator<Item = usize> {
    moment.solids.bodies.iter().enumerate().filter(|(_, member)| !member.fixed).map(|(k, _)| k)
}

/// What the colour of a body tells.
fn value(moment: &Moment, colour: Colour, body: usize) -> f64 {
    match colour {
        Colour::Speed => moment.twists[body].velocity.norm(),
        Colour::Force => moment.loads[body].force.norm(),
        Colour::Name => 0.0,
    }
}

fn placed(moment: &Moment, colour: Option<Colour>) -> Vec<Placed> {
    let one = |(k, member): (usize, &super::Member)| {
        let fill = match colour.filter(|_| !member.fixed) {
            None => Fill::Neutral,
            Some(colour @ (Colour::Speed | Colour::Force)) => Fill::Value(value(moment, colour, k)),
            Some(Colour::Name) => Fill::Number(k),
        };
        let named = colour == Some(Colour::Name);
        let name = if named { member.name.clone() } else { String::new() };
        Placed { shape: member.shape.clone(), pose: moment.poses[k], fill, mark: !member.fixed, name }
    };
    moment.solids.bodies.iter().enumerate().map(one).collect()
}

fn links(moment: &Moment) -> Layer<'static> {
    let link = |contact| {
        let [from, to] = moment.ends(contact);
        Link { from, to, value: contact.force }
    };
    Layer::Links { name: "λ".into(), links: moment.contacts.iter().map(link).collect() }
}

/// A number of six significant digits, with a true minus sign.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    crate::output::number(rounded).replace('-', "−")
}
