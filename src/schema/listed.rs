//! Things that files name and that stand in a list, such as measures: read by their names, as serde reads an enum, so
//! that the messages are those of every other choice.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{EnumAccess, VariantAccess, Visitor};
use serde::{Deserialize, Deserializer, de};

/// One of a list.
pub trait Listed: Sized {
    /// What it is, for readers of values that are no names.
    const WHAT: &'static str;

    /// The names of all, for messages of what there is.
    fn names() -> &'static [&'static str];

    /// The one of this name.
    fn named(name: &str) -> Option<Self>;
}

/// Reads a name.
///
/// # Errors
/// A value that is no name, or a name that is not in the list.
pub fn read<'de, T: Listed, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    deserializer.deserialize_enum(T::WHAT, T::names(), OneOfAll(PhantomData))
}

struct OneOfAll<T>(PhantomData<T>);

impl<'de, T: Listed> Visitor<'de> for OneOfAll<T> {
    type Value = T;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "enum {}", T::WHAT)
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<T, A::Error> {
        let (Name(found), variant) = data.variant()?;
        variant.unit_variant()?;
        Ok(found)
    }
}

/// One of a list by its name alone.
struct Name<T>(T);

impl<'de, T: Listed> Deserialize<'de> for Name<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_identifier(OneOfNames(PhantomData)).map(Name)
    }
}

struct OneOfNames<T>(PhantomData<T>);

impl<T: Listed> Visitor<'_> for OneOfNames<T> {
    type Value = T;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("variant identifier")
    }

    fn visit_str<E: de::Error>(self, name: &str) -> Result<T, E> {
        T::named(name).ok_or_else(|| E::unknown_variant(name, T::names()))
    }
}
