//! The table `[mesh]` of a scene: a shape with the values of its keys, or a file.
//!
//! A table may have keys of another shape, or lack some, as keys are set one by one; [`MeshScene::build`] refuses both.

use std::fmt;
use std::sync::LazyLock;

use serde::de::{self, DeserializeSeed, Deserializer, EnumAccess, MapAccess, VariantAccess, Visitor};
use serde::ser::{SerializeMap, Serializer};
use serde::{Deserialize, Serialize};

use super::keys::{Filled, Key, Value, ValueKind, Values};
use super::rules::{self, Check, bad};
use super::{Domain, GENERATORS, Generator, Meaning, Scale, Track};
use crate::mesh::{Mesh, MeshError};

/// Keys that are of the table itself.
const OWN: [&str; 3] = ["shape", "file", "slits"];

/// Keys of shapes that mean something beside a file: the place of the disc for measures and cuts, and the degree of
/// curved cells.
pub(super) const BESIDE_FILE: [&str; 3] = ["radius", "centre", "curved"];

/// The table `[mesh]`.
#[derive(Debug, Clone, Default)]
pub struct MeshScene {
    /// Exactly one of `shape` and `file`.
    generator: Option<&'static Generator>,
    /// File of Gmsh (MSH 2.2, 4.0 or 4.1), relative to the scene's folder.
    pub file: Option<String>,
    /// `file`: boundary edges that lie on one another are walls without thickness, not nodes that were not merged
    /// (default false).
    pub slits: Option<bool>,
    values: Values,
}

impl PartialEq for MeshScene {
    fn eq(&self, other: &Self) -> bool {
        let Self { generator: _, file, slits, values } = self;
        (self.shape(), file, slits, values) == (other.shape(), &other.file, &other.slits, &other.values)
    }
}

impl MeshScene {
    /// A domain by the name of its shape, such as `"annulus"`, without values.
    ///
    /// # Panics
    /// A name that no generator has.
    pub fn of(shape: &str) -> Self {
        Self::named(shape).unwrap_or_else(|| panic!("no mesh generator has the name `{shape}`; there are {}", names()))
    }

    /// A domain by the name of its shape, if there is one of this name.
    pub fn named(shape: &str) -> Option<Self> {
        Generator::named(shape).map(|generator| Self { generator: Some(generator), ..Self::default() })
    }

    /// The same with a value under a key: a number, two, a whole number or a flag.
    #[must_use]
    pub fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.values.insert(key.to_owned(), value.into());
        self
    }

    /// The name of the shape.
    pub fn shape(&self) -> Option<&'static str> {
        self.generator.map(|generator| generator.name)
    }

    /// What is given under a key of the shape, or, once defaults are filled in, what holds.
    pub fn get<T: Filled>(&self, key: &str) -> Option<T> {
        self.values.get(key).and_then(|value| T::from_value(*value))
    }

    /// Centre of the disc (default the origin).
    pub fn centre(&self) -> [f64; 2] {
        self.get("centre").unwrap_or([0.0, 0.0])
    }

    /// Radius of the disc, or of the outer circle (default 1).
    pub fn radius(&self) -> f64 {
        self.get("radius").unwrap_or(1.0)
    }

    fn domain(&self) -> Option<Box<dyn Domain>> {
        self.generator.map(|generator| (generator.read)(&self.values))
    }

    /// The same scene with every default that applies to its shape written out; a scene that names a file stays as it
    /// is.
    pub fn defaults_filled(&self) -> MeshScene {
        let mut full = self.clone();
        if let (Some(generator), Some(domain)) = (self.generator, self.domain()) {
            for (key, value) in generator.keys.iter().zip(domain.values()).filter(|(key, _)| !key.must) {
                if let Some(value) = value {
                    full.values.entry(key.name.to_owned()).or_insert(value);
                }
            }
        }
        full
    }

    /// Generates the mesh. The same scene gives the same bits.
    ///
    /// # Errors
    /// [`MeshError::BadKey`] names the key that is missing, does not apply to the shape, or has a value of which no
    /// mesh can be made; the errors of [`Mesh::build`] and [`Mesh::bend`].
    pub fn build(&self) -> Result<Mesh, MeshError> {
        let Some(domain) = self.domain() else {
            let hint = format!("name one of {}", names());
            return Err(bad("shape", "(missing)", "a mesh is generated from its shape", hint));
        };
        self.check()?;
        domain.build()
    }

    /// Refuses what no mesh can be made of.
    fn check(&self) -> Check {
        let (Some(generator), Some(domain)) = (self.generator, self.domain()) else { return Ok(()) };
        self.check_keys(generator)?;
        let values = generator.keys.iter().zip(domain.values());
        let all: Vec<(&Key, Value)> = values.filter_map(|(key, value)| Some((key, value?))).collect();
        rules::of_each(&all)?;
        domain.check()
    }

    /// Refuses keys that do not apply to the shape, a shape without a key that it needs, and values of another type.
    fn check_keys(&self, generator: &Generator) -> Check {
        let foreign = |key: &str, value: String| {
            let (must, may): (Vec<&Key>, Vec<&Key>) = generator.keys.iter().partition(|key| key.must);
            let keys = must.iter().chain(&may).map(|key| key.name).collect::<Vec<_>>().join(", ");
            let rule = format!("the shape `{}` has no such key", generator.name);
            Err(bad(key, value, rule, format!("remove it; the keys are {keys}")))
        };
        if let Some(file) = &self.file {
            return foreign("file", format!("{file:?}"));
        }
        if let Some(slits) = self.slits {
            return foreign("slits", slits.to_string());
        }
        for name in self.names_in_order() {
            match (generator.key(name), self.values.get(name)) {
                (None, Some(value)) => return foreign(name, value.to_string()),
                (Some(key), None) if key.must => {
                    let rule = format!("the shape `{}` needs it", generator.name);
                    return Err(bad(name, "(missing)", rule, format!("add `{name} = …` to the table [mesh]")));
                }
                (Some(key), Some(value)) if !key.kind.takes(*value) => {
                    return Err(bad(name, value, key.kind.shown(), "give a value of this type"));
                }
                (Some(_) | None, None) | (Some(_), Some(_)) => {}
            }
        }
        Ok(())
    }

    /// A key of shapes that means nothing beside a file.
    pub fn wrong_beside_file(&self) -> Option<&str> {
        self.in_order().map(|(name, _)| name).find(|name| !BESIDE_FILE.contains(name))
    }

    /// Tags of the boundary; none of a file.
    pub fn tags(&self) -> &'static [&'static str] {
        self.domain().map_or(&[], |domain| domain.tags())
    }

    /// About how many cells the generated mesh will have; exact for `square`. `None` of a file, and of a shape of which
    /// no mesh can be made.
    pub fn expected(&self) -> Option<f64> {
        let domain = self.domain()?;
        self.check().ok()?;
        Some(domain.expected())
    }

    /// A mesh of up to so many cells is there within a second or two.
    pub fn quickly_built(&self) -> f64 {
        self.domain().map_or(2e5, |domain| domain.quickly_built())
    }

    /// The rectangle `[x_0, x_1] × [y_0, y_1]` about the generated domain; `None` of a file.
    pub fn bounds(&self) -> Option<[[f64; 2]; 2]> {
        self.domain().map(|domain| domain.bounds())
    }

    /// What edge lengths are measured by where the scene asks for an accuracy.
    pub fn scale(&self) -> Scale {
        self.domain().map_or(Scale::None, |domain| domain.scale())
    }

    /// The way around the domain: of a racetrack along its arms and turns, of a disc and of a ring around the centre.
    pub fn track(&self) -> Option<Track> {
        self.domain()?.track()
    }

    /// Whether the shape has such a key.
    pub fn has(&self, key: &str) -> bool {
        self.generator.is_some_and(|generator| generator.key(key).is_some())
    }

    /// The keys that say how long edges are, with their values for cells longer by `ratio` everywhere.
    pub fn longer_edges(&self, ratio: f64) -> Vec<(&'static Key, Value)> {
        let keys = self.generator.map_or(&[][..], |generator| generator.keys).iter();
        let new = |key: &'static Key| Some((key, key.meaning.coarser(*self.values.get(key.name)?, ratio)?));
        keys.filter_map(new).collect()
    }

    /// The same domain with cells longer by `ratio` and as fast a growth; `None` where so few cells cannot follow its
    /// shape.
    pub fn coarser(&self, ratio: f64) -> Option<MeshScene> {
        self.generator?;
        let mut coarse = self.clone();
        let edges = self.longer_edges(ratio).into_iter().filter(|(key, _)| key.meaning != Meaning::Growth);
        coarse.values.extend(edges.map(|(key, value)| (key.name.to_owned(), value)));
        coarse.check().is_ok().then_some(coarse)
    }

    /// Keys of all shapes in their order, then names that are given and are no key.
    fn names_in_order(&self) -> impl Iterator<Item = &str> {
        let others = self.values.keys().map(String::as_str).filter(|name| KEYS.iter().all(|key| key.name != *name));
        KEYS.iter().map(|key| key.name).chain(others)
    }

    /// What is given.
    fn in_order(&self) -> impl Iterator<Item = (&str, Value)> {
        self.names_in_order().filter_map(|name| Some((name, *self.values.get(name)?)))
    }
}

/// Names of all shapes.
fn names() -> String {
    GENERATORS.iter().map(|generator| generator.name).collect::<Vec<_>>().join(", ")
}

/// Keys that are sizes of domains.
pub fn lengths() -> Vec<&'static str> {
    let of_domain = |key: &&&Key| matches!(key.meaning, Meaning::Length | Meaning::Interval);
    KEYS.iter().filter(of_domain).map(|key| key.name).collect()
}

/// Keys of all shapes, in an order that is that of every shape.
pub(super) static KEYS: LazyLock<Vec<&'static Key>> = LazyLock::new(|| {
    let mut lists: Vec<&[Key]> = GENERATORS.iter().map(|generator| generator.keys).collect();
    let mut merged: Vec<&Key> = Vec::new();
    loop {
        lists.retain(|keys| !keys.is_empty());
        // a key is next once no list has others before it
        let first = |key: &Key| lists.iter().all(|keys| keys[1..].iter().all(|other| other.name != key.name));
        let heads = || lists.iter().map(|keys| &keys[0]);
        let Some(next) = heads().find(|key| first(key)).or_else(|| heads().next()) else { return merged };
        if merged.iter().all(|key| key.name != next.name) {
            merged.push(next);
        }
        for keys in lists.iter_mut().filter(|keys| keys[0].name == next.name) {
            *keys = &keys[1..];
        }
    }
});

impl Serialize for MeshScene {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        if let Some(shape) = self.shape() {
            map.serialize_entry("shape", shape)?;
        }
        if let Some(file) = &self.file {
            map.serialize_entry("file", file)?;
        }
        if let Some(slits) = self.slits {
            map.serialize_entry("slits", &slits)?;
        }
        for (name, value) in self.in_order() {
            map.serialize_entry(name, &value)?;
        }
        map.end()
    }
}

impl<'de> Deserialize<'de> for MeshScene {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("MeshScene", &OWN, Table)
    }
}

/// Reads the table; every value by the type of its key, so that an error has the place of the value.
struct Table;

impl<'de> Visitor<'de> for Table {
    type Value = MeshScene;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("struct MeshScene")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<MeshScene, A::Error> {
        let mut scene = MeshScene::default();
        while let Some(name) = map.next_key_seed(Name)? {
            match name {
                Given::Shape => scene.generator = Some(map.next_value_seed(Shape)?),
                Given::File => scene.file = Some(map.next_value()?),
                Given::Slits => scene.slits = Some(map.next_value()?),
                Given::Key(key) => {
                    let value = map.next_value_seed(Typed(key.kind))?;
                    scene.values.insert(key.name.to_owned(), value);
                }
            }
        }
        Ok(scene)
    }
}

/// A key of the table.
enum Given {
    Shape,
    File,
    Slits,
    Key(&'static Key),
}

/// Reads a key.
struct Name;

impl<'de> DeserializeSeed<'de> for Name {
    type Value = Given;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Given, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for Name {
    type Value = Given;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("field identifier")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<Given, E> {
        match name {
            "shape" => Ok(Given::Shape),
            "file" => Ok(Given::File),
            "slits" => Ok(Given::Slits),
            _ => KEYS.iter().find(|key| key.name == name).map(|key| Given::Key(key)).ok_or_else(|| {
                let known: Vec<&str> = OWN.into_iter().chain(KEYS.iter().map(|key| key.name)).collect();
                E::custom(format!("unknown field `{name}`, expected one of {}", quoted(&known)))
            }),
        }
    }
}

/// Reads the value of a key.
struct Typed(ValueKind);

impl<'de> DeserializeSeed<'de> for Typed {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        self.0.read(deserializer)
    }
}

/// Reads the name of a shape, as serde reads that of a variant.
struct Shape;

impl<'de> DeserializeSeed<'de> for Shape {
    type Value = &'static Generator;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_enum("Shape", &[], self)
    }
}

impl<'de> Visitor<'de> for Shape {
    type Value = &'static Generator;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("enum Shape")
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Self::Value, A::Error> {
        let (generator, variant) = data.variant_seed(ShapeName)?;
        variant.unit_variant()?;
        Ok(generator)
    }
}

/// Reads the name itself.
struct ShapeName;

impl<'de> DeserializeSeed<'de> for ShapeName {
    type Value = &'static Generator;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for ShapeName {
    type Value = &'static Generator;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("variant identifier")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<Self::Value, E> {
        Generator::named(name).ok_or_else(|| {
            let known: Vec<&str> = GENERATORS.iter().map(|generator| generator.name).collect();
            E::custom(format!("unknown variant `{name}`, expected one of {}", quoted(&known)))
        })
    }
}

/// Names as serde lists them.
fn quoted(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
