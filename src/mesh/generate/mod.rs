//! Meshes that a scene describes by shape and local size.
//!
//! A generator is one file and one row of [`GENERATORS`]. The file has a struct whose fields are the keys, with what
//! they mean, their defaults and their ranges, and a `Domain` that tells what is made of them.

mod annulus;
mod disc;
mod front;
mod keys;
mod l_shape;
mod mirror;
mod outline;
mod racetrack;
mod relax;
mod rules;
mod schema;
mod size;
mod square;
mod square_with_circle;
mod stretch;
mod strip;
mod strip_with_disc;
mod table;
mod track;
mod triangulated;

use keys::{Keyed, Values, Written};
use rules::Check;

use super::{Mesh, MeshError};

pub use keys::{Filled, Key, Meaning, Value, ValueKind};
pub use schema::{key_rows, shape_rows};
pub use table::{MeshScene, lengths};
pub use track::Track;

/// Every generator.
pub static GENERATORS: [Generator; 8] = [
    Generator::of::<square::Square>(),
    Generator::of::<square_with_circle::SquareWithCircle>(),
    Generator::of::<strip::Strip>(),
    Generator::of::<strip_with_disc::StripWithDisc>(),
    Generator::of::<disc::Disc>(),
    Generator::of::<annulus::Annulus>(),
    Generator::of::<racetrack::Racetrack>(),
    Generator::of::<l_shape::LShape>(),
];

/// A kind of domain that can be meshed.
#[derive(Debug)]
pub struct Generator {
    /// As in `mesh.shape`.
    pub name: &'static str,
    /// What its domains are.
    pub about: &'static str,
    /// What a scene may say about the shape.
    pub keys: &'static [Key],
    /// The domain of these values, with defaults for those that are missing.
    read: fn(&Values) -> Box<dyn Domain>,
}

impl Generator {
    const fn of<D: Named + Domain + Keyed + 'static>() -> Self {
        Self { name: D::NAME, about: D::ABOUT, keys: D::KEYS, read: read::<D> }
    }

    /// The generator of this name.
    pub fn named(name: &str) -> Option<&'static Generator> {
        GENERATORS.iter().find(|generator| generator.name == name)
    }

    /// The key of this name, if the generator has it.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// Whether one can go around in its domains.
    pub fn has_track(&self) -> bool {
        (self.read)(&Values::new()).track().is_some()
    }
}

fn read<D: Domain + Keyed + 'static>(given: &Values) -> Box<dyn Domain> {
    let mut domain = D::read(given);
    domain.complete();
    Box::new(domain)
}

/// What the edge lengths of a domain are measured by where the scene asks for an accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// There is no usual value.
    None,
    /// Cells in a row.
    Count,
    /// The width of a channel.
    Across(f64),
    /// The radius of a disc, or the width of a ring.
    Inside(f64),
}

/// The name of a generator.
trait Named {
    /// As in `mesh.shape`.
    const NAME: &'static str;
}

/// A domain whose keys have been read; where some that it needs are missing, these are zero.
trait Domain: Written {
    /// Fills in defaults of optional fields.
    fn complete(&mut self) {}

    /// Names of the parts of the boundary, in the order of their numbers.
    fn tags(&self) -> &'static [&'static str];

    /// The rules that several keys are part of, after those on each alone.
    fn check(&self) -> Check;

    /// The mesh, once the rules are kept.
    fn build(&self) -> Result<Mesh, MeshError>;

    /// About how many cells the mesh will have.
    fn expected(&self) -> f64;

    /// A mesh of up to so many cells is there within a second or two.
    fn quickly_built(&self) -> f64 {
        2e4
    }

    /// The rectangle `[x_0, x_1] × [y_0, y_1]` about the domain.
    fn bounds(&self) -> [[f64; 2]; 2];

    /// What edge lengths are measured by.
    fn scale(&self) -> Scale;

    /// The way around, if there is one.
    fn track(&self) -> Option<Track> {
        None
    }
}

/// The square about a circle.
fn about(centre: [f64; 2], radius: f64) -> [[f64; 2]; 2] {
    centre.map(|x| [x - radius, x + radius])
}
