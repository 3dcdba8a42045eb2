//! The keys of a struct, as serde has them.

use std::fmt;

use serde::de::{DeserializeOwned, Deserializer, Error, Visitor};
use serde::forward_to_deserialize_any;

/// The keys that a struct is read from, in the order of its fields; none of what is no struct.
pub fn fields<T: DeserializeOwned>() -> &'static [&'static str] {
    let mut found: &'static [&'static str] = &[];
    // it ends where the keys are told
    let _ = T::deserialize(Probe(&mut found));
    found
}

/// Asked for a struct, it notes the keys and gives up.
struct Probe<'f>(&'f mut &'static [&'static str]);

#[derive(Debug)]
struct Noted;

impl fmt::Display for Noted {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the keys are noted")
    }
}

impl std::error::Error for Noted {}

impl Error for Noted {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self
    }
}

impl<'de> Deserializer<'de> for Probe<'_> {
    type Error = Noted;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        _visitor: V,
    ) -> Result<V::Value, Noted> {
        *self.0 = fields;
        Err(Noted)
    }

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Noted> {
        Err(Noted)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::fields;

    #[test]
    fn keys_of_structs_alone() {
        #[derive(serde::Deserialize)]
        #[expect(dead_code, reason = "only its keys are asked for")]
        struct Table {
            later: f64,
            first: f64,
        }
        assert_eq!(fields::<Table>(), ["later", "first"]);
        assert!(fields::<f64>().is_empty() && fields::<Vec<Table>>().is_empty());
    }
}
