//! Numbers under keys that a list knows, beside those of a struct that refuses unknown ones.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::value::StrDeserializer;
use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor};
use serde::forward_to_deserialize_any;

/// A deserializer of a table that takes some numbers out of it.
pub struct Beside<'f, D> {
    pub inner: D,
    /// Their keys.
    pub keys: &'f [&'static str],
    pub found: &'f mut BTreeMap<String, f64>,
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Beside<'_, D> {
    type Error = D::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
        self.inner.deserialize_any(visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        let Self { inner, keys, found } = self;
        inner.deserialize_struct(name, fields, Outer { visitor, fields, keys, found })
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

struct Outer<'f, V> {
    visitor: V,
    fields: &'static [&'static str],
    keys: &'f [&'static str],
    found: &'f mut BTreeMap<String, f64>,
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Outer<'_, V> {
    type Value = V::Value;

    fn expecting(&self, out: &mut fmt::Formatter) -> fmt::Result {
        self.visitor.expecting(out)
    }

    fn visit_map<A: MapAccess<'de>>(self, inner: A) -> Result<V::Value, A::Error> {
        let Self { visitor, fields, keys, found } = self;
        visitor.visit_map(Filtered { inner, fields, keys, found })
    }
}

/// The keys of the struct alone.
struct Filtered<'f, A> {
    inner: A,
    fields: &'static [&'static str],
    keys: &'f [&'static str],
    found: &'f mut BTreeMap<String, f64>,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Filtered<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, A::Error> {
        let mut seed = Some(seed);
        loop {
            let key = Key { seed: &mut seed, fields: self.fields, keys: self.keys };
            match self.inner.next_key_seed(key)? {
                None => return Ok(None),
                Some(Ok(key)) => return Ok(Some(key)),
                Some(Err(name)) => {
                    let value = self.inner.next_value()?;
                    self.found.insert(name, value);
                }
            }
        }
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, A::Error> {
        self.inner.next_value_seed(seed)
    }
}

/// A key for the struct, or the name of a number beside it.
struct Key<'s, K> {
    seed: &'s mut Option<K>,
    fields: &'static [&'static str],
    keys: &'s [&'static str],
}

impl<'de, K: DeserializeSeed<'de>> DeserializeSeed<'de> for Key<'_, K> {
    type Value = Result<K::Value, String>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl<'de, K: DeserializeSeed<'de>> Visitor<'de> for Key<'_, K> {
    type Value = Result<K::Value, String>;

    fn expecting(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str("a key")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Self::Value, E> {
        if self.keys.contains(&name) {
            return Ok(Err(name.to_owned()));
        }
        if !self.fields.contains(&name) {
            let known: Vec<String> = self.fields.iter().chain(self.keys).map(|key| format!("`{key}`")).collect();
            return Err(E::custom(format!("unknown field `{name}`, expected one of {}", known.join(", "))));
        }
        let seed = self.seed.take().expect("a key is read once");
        let key: StrDeserializer<E> = name.into_deserializer();
        seed.deserialize(key).map(Ok)
    }
}
