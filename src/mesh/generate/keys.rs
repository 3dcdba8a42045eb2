//! The keys of `[mesh]`: what a generator says of each beside the field that it fills, and the values that are given.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Deserializer, Serialize};

use crate::schema::Range;

/// What is given under a key.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// `true` or `false`
    Flag(bool),
    /// A whole number, not negative.
    Whole(u64),
    /// Any other number.
    Number(f64),
    /// Two numbers.
    Pair([f64; 2]),
}

impl Value {
    /// The numbers that it consists of.
    pub(super) fn numbers(self) -> Vec<f64> {
        match self {
            Value::Flag(_) => Vec::new(),
            Value::Whole(value) => vec![value as f64],
            Value::Number(value) => vec![value],
            Value::Pair(value) => value.to_vec(),
        }
    }
}

/// As in a scene.
impl fmt::Display for Value {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Flag(value) => write!(out, "{value}"),
            Value::Whole(value) => write!(out, "{value}"),
            Value::Number(value) => write!(out, "{value:?}"),
            Value::Pair(value) => write!(out, "{value:?}"),
        }
    }
}

/// Which values a key takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ValueKind {
    /// `true` or `false`
    Flag,
    /// A whole number, not negative.
    Whole,
    /// Any number.
    Number,
    /// Two numbers.
    Pair,
}

impl ValueKind {
    /// Reads a value; a deserializer's own error tells its place.
    pub(super) fn read<'de, D: Deserializer<'de>>(self, from: D) -> Result<Value, D::Error> {
        match self {
            ValueKind::Flag => bool::deserialize(from).map(Value::Flag),
            ValueKind::Whole => u64::deserialize(from).map(Value::Whole),
            ValueKind::Number => f64::deserialize(from).map(Value::Number),
            ValueKind::Pair => <[f64; 2]>::deserialize(from).map(Value::Pair),
        }
    }

    /// Whether it takes this value.
    pub(super) fn takes(self, value: Value) -> bool {
        match value {
            Value::Flag(_) => self == ValueKind::Flag,
            Value::Whole(_) => matches!(self, ValueKind::Whole | ValueKind::Number),
            Value::Number(_) => self == ValueKind::Number,
            Value::Pair(_) => self == ValueKind::Pair,
        }
    }

    /// What it takes, in the words of a rule.
    pub(super) fn shown(self) -> &'static str {
        match self {
            ValueKind::Flag => "it must be true or false",
            ValueKind::Whole => "it must be a whole number, not negative",
            ValueKind::Number => "it must be a number",
            ValueKind::Pair => "it must be two numbers",
        }
    }
}

/// Smallest and largest length; beyond, points could coincide by rounding.
pub(super) const LENGTHS: [f64; 2] = [1e-9, 1e9];

/// What a value means, from which follow the rules on it alone and how it changes with the size of the cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Meaning {
    /// Cells in a row, at least one.
    Count,
    /// The length of edges.
    Edge,
    /// How fast the length of edges grows, per unit of distance.
    Growth,
    /// A size of the domain.
    Length,
    /// A point of the plane.
    Place,
    /// Where the domain begins and where it ends.
    Interval,
    /// A number between two others.
    Within {
        /// Both ends included.
        range: Range,
        /// What messages say of it.
        rule: &'static str,
        /// What they advise.
        hint: &'static str,
    },
    /// Any value of its type.
    Free,
}

impl Meaning {
    /// Isoparametric degrees of cells on circles.
    pub(super) const CURVED: Meaning = Meaning::Within {
        range: Range::within(1.0, 3.0),
        rule: "it must be 1, 2 or 3",
        hint: "3 is the default, 1 keeps straight cells",
    };

    /// The numbers that it may consist of.
    pub fn range(self) -> Range {
        match self {
            Meaning::Count => Range::SOME,
            Meaning::Edge | Meaning::Length => Range::within(LENGTHS[0], LENGTHS[1]),
            Meaning::Growth => Range::within(1e-3, 1.0),
            Meaning::Place | Meaning::Interval => Range::within(-LENGTHS[1], LENGTHS[1]),
            Meaning::Within { range, .. } => range,
            Meaning::Free => Range::ANY,
        }
    }

    /// What the number is, where it is not plain.
    pub(super) fn unit(self) -> Option<&'static str> {
        match self {
            Meaning::Edge | Meaning::Length | Meaning::Place | Meaning::Interval => Some("length"),
            Meaning::Count | Meaning::Growth | Meaning::Within { .. } | Meaning::Free => None,
        }
    }

    /// The value on cells that are longer by `ratio`, where it has to do with them.
    pub(super) fn coarser(self, value: Value, ratio: f64) -> Option<Value> {
        match (self, value) {
            (Meaning::Count, Value::Whole(n)) => Some(Value::Whole((n as f64 / ratio).round().max(1.0) as u64)),
            (Meaning::Edge | Meaning::Growth, Value::Number(x)) => Some(Value::Number(x * ratio)),
            (
                Meaning::Count
                | Meaning::Edge
                | Meaning::Growth
                | Meaning::Length
                | Meaning::Place
                | Meaning::Interval
                | Meaning::Within { .. }
                | Meaning::Free,
                Value::Flag(_) | Value::Whole(_) | Value::Number(_) | Value::Pair(_),
            ) => None,
        }
    }
}

/// A key of a generator.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// As in the scene file.
    pub name: &'static str,
    /// What it is, as its field says.
    pub about: &'static str,
    /// Which values it takes.
    pub kind: ValueKind,
    /// Whether it must be given.
    pub must: bool,
    /// A default that follows from other keys, in words.
    pub otherwise: Option<&'static str>,
    /// What its value means.
    pub meaning: Meaning,
}

/// Values under their keys.
pub(super) type Values = BTreeMap<String, Value>;

/// A field that a key fills.
pub trait Filled: Sized {
    /// Which values fill it.
    const KIND: ValueKind;

    /// From what is given; `None` where that is of another kind.
    fn from_value(value: Value) -> Option<Self>;

    /// As it would be given; `None` where the key does not apply.
    fn value(&self) -> Option<Value>;
}

impl Filled for bool {
    const KIND: ValueKind = ValueKind::Flag;

    fn from_value(value: Value) -> Option<Self> {
        if let Value::Flag(value) = value { Some(value) } else { None }
    }

    fn value(&self) -> Option<Value> {
        Some(Value::Flag(*self))
    }
}

impl Filled for u64 {
    const KIND: ValueKind = ValueKind::Whole;

    fn from_value(value: Value) -> Option<Self> {
        if let Value::Whole(value) = value { Some(value) } else { None }
    }

    fn value(&self) -> Option<Value> {
        Some(Value::Whole(*self))
    }
}

impl Filled for usize {
    const KIND: ValueKind = ValueKind::Whole;

    fn from_value(value: Value) -> Option<Self> {
        u64::from_value(value).and_then(|value| usize::try_from(value).ok())
    }

    fn value(&self) -> Option<Value> {
        Some(Value::Whole(*self as u64))
    }
}

impl Filled for f64 {
    const KIND: ValueKind = ValueKind::Number;

    fn from_value(value: Value) -> Option<Self> {
        match value {
            Value::Number(value) => Some(value),
            Value::Whole(value) => Some(value as f64),
            Value::Flag(_) | Value::Pair(_) => None,
        }
    }

    fn value(&self) -> Option<Value> {
        Some(Value::Number(*self))
    }
}

impl Filled for [f64; 2] {
    const KIND: ValueKind = ValueKind::Pair;

    fn from_value(value: Value) -> Option<Self> {
        if let Value::Pair(value) = value { Some(value) } else { None }
    }

    fn value(&self) -> Option<Value> {
        Some(Value::Pair(*self))
    }
}

impl<T: Filled> Filled for Option<T> {
    const KIND: ValueKind = T::KIND;

    fn from_value(value: Value) -> Option<Self> {
        T::from_value(value).map(Some)
    }

    fn value(&self) -> Option<Value> {
        self.as_ref().and_then(Filled::value)
    }
}

macro_rules! from_filled {
    ($($type:ty),*) => {
        $(impl From<$type> for Value {
            fn from(value: $type) -> Self {
                value.value().expect("a value that is there")
            }
        })*
    };
}

from_filled!(bool, u64, usize, f64, [f64; 2]);

/// A number as a program writes it, `with("n", 20)`; below zero it is not a whole number of anything.
impl From<i32> for Value {
    fn from(value: i32) -> Self {
        u64::try_from(value).map_or(Value::Number(f64::from(value)), Value::Whole)
    }
}

/// The keys of a generator, read and written as the fields of its struct.
pub(super) trait Keyed {
    /// What the domain is.
    const ABOUT: &'static str;
    const KEYS: &'static [Key];

    /// What is given, and defaults; a key that must be given and is not stays at zero, for the check to refuse.
    fn read(given: &Values) -> Self;
}

/// Writes back what has been read.
pub trait Written {
    /// Of every key in the order of the fields.
    fn values(&self) -> Vec<Option<Value>>;
}

/// Declares the struct of a generator: `key: type => meaning;` must be given, `key: type = default => meaning;` may be.
/// A default may use the fields above it; then it is also told in words, `= default, "words" =>`.
macro_rules! keyed {
    (
        $(#[doc = $about:literal])+
        $name:ident { $(
            $(#[doc = $doc:literal])+
            $key:ident: $type:ty $(= $default:expr $(, $words:literal)?)? => $meaning:expr;
        )+ }
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone)]
        pub(super) struct $name {
            $($(#[doc = $doc])+ pub $key: $type,)+
        }

        impl $crate::mesh::generate::keys::Keyed for $name {
            const ABOUT: &'static str = concat!($($about),+).trim_ascii();
            const KEYS: &'static [$crate::mesh::generate::keys::Key] = &[$($crate::mesh::generate::keys::Key {
                name: stringify!($key),
                about: concat!($($doc),+).trim_ascii(),
                kind: <$type as $crate::mesh::generate::keys::Filled>::KIND,
                must: $crate::mesh::generate::keys::keyed!(@must $($default)?),
                otherwise: $crate::mesh::generate::keys::keyed!(@words $($($words)?)?),
                meaning: $meaning,
            }),+];

            fn read(given: &$crate::mesh::generate::keys::Values) -> Self {
                $(let $key: $type = given
                    .get(stringify!($key))
                    .and_then(|value| $crate::mesh::generate::keys::Filled::from_value(*value))
                    .unwrap_or_else(|| $crate::mesh::generate::keys::keyed!(@default $($default)?));)+
                Self { $($key),+ }
            }
        }

        impl $crate::mesh::generate::keys::Written for $name {
            fn values(&self) -> Vec<Option<$crate::mesh::generate::keys::Value>> {
                vec![$($crate::mesh::generate::keys::Filled::value(&self.$key)),+]
            }
        }
    };
    (@words) => { None };
    (@words $words:literal) => { Some($words) };
    (@must) => { true };
    (@must $default:expr) => { false };
    (@default) => { Default::default() };
    (@default $default:expr) => { $default };
}

pub(super) use keyed;
