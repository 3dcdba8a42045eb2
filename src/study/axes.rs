//! What varies in a sweep: lists, ranges, keys that vary together, seeds; and every combination of them.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, de};

use super::StudyError;
use super::source::{Values, below, refuse, value_text};
use crate::scene::{SceneSource, renamed};
use crate::schema::{Range, not_empty, one_of_keys};

/// Key of the scene that `seeds` sets.
pub const SEED: &str = "initial.polarity.random.seed";

/// More runs than anybody waits for: lists multiply.
const MOST: usize = 10_000;

/// The values of a key.
#[derive(Debug, Clone, PartialEq)]
pub enum AxisValues {
    List(Vec<toml::Value>),
    /// `[a, b, n]`: n values from a to b, equally far apart.
    Linear([toml::Value; 3]),
    /// `[a, b, n]`: n values from a to b, each the same multiple of the one before.
    Geometric([toml::Value; 3]),
}

/// `seeds = 5` or `seeds = [1, 2, 3]`.
#[derive(Debug, Clone, PartialEq)]
pub enum Seeds {
    /// 1 to n.
    Count(u64),
    List(Vec<u64>),
}

/// Values that go from run to run: of one key, or of several together.
#[derive(Debug, Clone)]
pub struct Axis {
    pub keys: Vec<String>,
    /// What is set, value by value.
    pub rows: Vec<Values>,
    /// Whether every value is a number.
    pub numeric: bool,
}

const RANGE: &str = "a sequence of values, { linspace = [a, b, n] } or { logspace = [a, b, n] }";

impl JsonSchema for AxisValues {
    fn schema_name() -> Cow<'static, str> {
        "AxisValues".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let range = |about: &str| {
            let (items, most) = (serde_json::json!({ "type": "number" }), 3);
            serde_json::json!({ "type": "array", "items": items, "minItems": 3, "maxItems": most, "description": about })
        };
        let ranges = [
            ("linspace".to_owned(), range("`[a, b, n]`: n from a to b, equally far apart.")),
            ("logspace".to_owned(), range("`[a, b, n]`: n from a to b, each the same multiple of the one before.")),
        ];
        let list = serde_json::json!({ "type": "array", "minItems": 1, "description": "These values." });
        json_schema!({ "oneOf": [list, one_of_keys(ranges.into_iter().collect())] })
    }
}

impl JsonSchema for Seeds {
    fn schema_name() -> Cow<'static, str> {
        "Seeds".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut count = generator.subschema_for::<u64>();
        Range::SOME.said()(&mut count);
        let mut list = generator.subschema_for::<Vec<u64>>();
        not_empty(&mut list);
        json_schema!({ "oneOf": [count, list] })
    }
}

impl<'de> Deserialize<'de> for AxisValues {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(AxisVisitor)
    }
}

/// By hand, because serde's untagged enums lose line and reason.
struct AxisVisitor;

impl<'de> de::Visitor<'de> for AxisVisitor {
    type Value = AxisValues;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(RANGE)
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, sequence: A) -> Result<AxisValues, A::Error> {
        Vec::deserialize(de::value::SeqAccessDeserializer::new(sequence)).map(AxisValues::List)
    }

    fn visit_map<A: de::MapAccess<'de>>(self, mut map: A) -> Result<AxisValues, A::Error> {
        let found = match map.next_key::<String>()?.as_deref() {
            Some("linspace") => AxisValues::Linear(map.next_value()?),
            Some("logspace") => AxisValues::Geometric(map.next_value()?),
            Some(other) => {
                let dots = "a key that has dots is quoted, as in \"model.beta\" = [0.1, 0.9]";
                return Err(de::Error::custom(format!("there is `{other}`, expected {RANGE}; {dots}")));
            }
            None => return Err(de::Error::custom(format!("an empty table, expected {RANGE}"))),
        };
        match map.next_key::<String>()? {
            None => Ok(found),
            Some(other) => Err(de::Error::custom(format!("`{other}` is one too many, expected {RANGE}"))),
        }
    }
}

impl<'de> Deserialize<'de> for Seeds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SeedsVisitor)
    }
}

/// By hand for the same reason.
struct SeedsVisitor;

impl<'de> de::Visitor<'de> for SeedsVisitor {
    type Value = Seeds;

    fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("the number of seeds or a list of them")
    }

    fn visit_i64<E: de::Error>(self, count: i64) -> Result<Seeds, E> {
        let count = u64::try_from(count).map_err(|_| E::custom("the number of seeds must not be negative"))?;
        Ok(Seeds::Count(count))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, sequence: A) -> Result<Seeds, A::Error> {
        Vec::deserialize(de::value::SeqAccessDeserializer::new(sequence)).map(Seeds::List)
    }
}

/// The keys of `vary`, then the tables of `together`, then the seeds.
///
/// # Errors
/// A list that is empty, a range that is none, lists of unequal lengths, a key that varies twice, too many
/// combinations.
pub(super) fn axes(
    source: &SceneSource,
    vary: &BTreeMap<String, AxisValues>,
    together: &[BTreeMap<String, AxisValues>],
    seeds: Option<&Seeds>,
) -> Result<Vec<Axis>, StudyError> {
    let mut axes: Vec<Axis> = Vec::new();
    for key in keys_in_order(source, vary) {
        let values = expand(source, &below("vary", &key), &vary[&key])?;
        axes.push(Axis::of(vec![key], vec![values]));
    }
    for (at, table) in together.iter().enumerate() {
        axes.push(joined(source, at, table)?);
    }
    if let Some(seeds) = seeds {
        let list: Vec<u64> = match seeds {
            Seeds::Count(count) if *count > MOST as u64 => {
                let (shown, rule) = (count.to_string(), format!("must be at most {MOST} seeds"));
                return Err(refuse(source, "seeds", shown, &rule, "such as seeds = 5"));
            }
            Seeds::Count(count) => (1..=*count).collect(),
            Seeds::List(list) => list.clone(),
        };
        if list.is_empty() || list.iter().any(|seed| i64::try_from(*seed).is_err()) {
            let (shown, rule) = (format!("{list:?}"), "must be one seed or more, each below 2⁶³");
            return Err(refuse(source, "seeds", shown, rule, "such as seeds = 5, or seeds = [1, 2, 3]"));
        }
        let values = list.into_iter().map(|seed| toml::Value::Integer(seed as i64)).collect();
        axes.push(Axis::of(vec![SEED.to_owned()], vec![values]));
    }
    let mut count = 1_usize;
    for (at, axis) in axes.iter().enumerate() {
        count = count.saturating_mul(axis.rows.len());
        let name = if axis.keys.len() > 1 { "together".to_owned() } else { below("vary", &axis.keys[0]) };
        if count > MOST {
            let rule = format!("with it there are {count} combinations, and at most {MOST} may be");
            return Err(refuse(source, &name, format!("{} values", axis.rows.len()), &rule, "shorten a list"));
        }
        // by the names that keys have today
        let now = |key: &String| renamed::path_now(key).0;
        let varies = |key: &String| axes[..at].iter().any(|other| other.keys.iter().any(|one| now(one) == now(key)));
        let twice = axis.keys.iter().find(|key| varies(key));
        if let Some(key) = twice {
            let hint = "take it out of one of `vary`, `together` and `seeds`";
            return Err(refuse(source, "together", format!("\"{key}\""), "the key varies already", hint));
        }
    }
    Ok(axes)
}

impl Axis {
    /// `values` holds the list of each key; all lists have one length.
    fn of(keys: Vec<String>, values: Vec<Vec<toml::Value>>) -> Self {
        let numeric = values.iter().flatten().all(|value| value.is_integer() || value.is_float());
        let row =
            |at: usize| keys.iter().zip(&values).map(|(key, list)| (key.clone(), value_text(&list[at]))).collect();
        let rows = (0..values[0].len()).map(row).collect();
        Self { keys, rows, numeric }
    }
}

/// An axis of several keys.
fn joined(source: &SceneSource, at: usize, table: &BTreeMap<String, AxisValues>) -> Result<Axis, StudyError> {
    let name = format!("together.{at}");
    if table.is_empty() {
        let hint = "such as { \"model.beta\" = [0.1, 0.9], \"model.alignment\" = [0, 1] }";
        return Err(refuse(source, "together", "{}".to_owned(), "an empty table varies nothing", hint));
    }
    let mut keys: Vec<String> = Vec::new();
    let mut lists: Vec<Vec<toml::Value>> = Vec::new();
    for (key, values) in table {
        let list = expand(source, &format!("{name}.{key}"), values)?;
        if let Some(first) = lists.first().filter(|first| first.len() != list.len()) {
            let rule = format!("must have as many values as `{}`, {}: they vary together", keys[0], first.len());
            let hint = "give lists of one length, or put the keys into `vary` for every combination";
            return Err(refuse(source, &format!("{name}.{key}"), format!("{} values", list.len()), &rule, hint));
        }
        keys.push(key.clone());
        lists.push(list);
    }
    Ok(Axis::of(keys, lists))
}

/// The values of a list or a range.
fn expand(source: &SceneSource, at: &str, values: &AxisValues) -> Result<Vec<toml::Value>, StudyError> {
    let (range, geometric) = match values {
        AxisValues::List(list) if list.is_empty() => {
            let hint = "list its values, as in \"model.beta\" = [0.05, 0.5]";
            return Err(refuse(source, at, "[]".to_owned(), "the list is empty: there is nothing to run", hint));
        }
        AxisValues::List(list) => return Ok(list.clone()),
        AxisValues::Linear(range) => (range, false),
        AxisValues::Geometric(range) => (range, true),
    };
    let shown = || toml::Value::Array(range.to_vec()).to_string();
    let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|i| i as f64));
    let ends = number(&range[0]).zip(number(&range[1])).filter(|(a, b)| a.is_finite() && b.is_finite());
    let count = range[2].as_integer().and_then(|n| usize::try_from(n).ok()).filter(|n| (2..=MOST).contains(n));
    let (Some((a, b)), Some(n)) = (ends, count) else {
        let rule = format!("must be first value, last value, and how many (2 to {MOST})");
        return Err(refuse(source, at, shown(), &rule, "such as { linspace = [0.0, 1.0, 11] }"));
    };
    if geometric && (a == 0.0 || b == 0.0 || (a > 0.0) != (b > 0.0)) {
        let rule = "both ends of `logspace` must have one sign and not be 0";
        return Err(refuse(
            source,
            at,
            shown(),
            rule,
            "a and b are the end values, as in { logspace = [0.1, 10.0, 5] }",
        ));
    }
    let inner = |k: usize| {
        let share = k as f64 / (n - 1) as f64;
        rounded(if geometric { a * (b / a).powf(share) } else { a + (b - a) * share })
    };
    let list: Vec<f64> = (0..n)
        .map(|k| {
            if k == 0 {
                a
            } else if k == n - 1 {
                b
            } else {
                inner(k)
            }
        })
        .collect();
    let whole = range[0].is_integer() && range[1].is_integer() && list.iter().all(|x| x.fract() == 0.0);
    let value = |x: f64| if whole { toml::Value::Integer(x as i64) } else { toml::Value::Float(x) };
    Ok(list.into_iter().map(value).collect())
}

/// To twelve digits: 0.3 instead of 0.30000000000000004.
fn rounded(x: f64) -> f64 {
    format!("{x:.11e}").parse().unwrap_or(x)
}

/// Keys of `vary` in the order of the file.
fn keys_in_order(source: &SceneSource, vary: &BTreeMap<String, AxisValues>) -> Vec<String> {
    let table = source.value("vary").and_then(toml_edit::Item::as_table_like);
    let keys: Vec<String> =
        table.map(|table| table.iter().map(|(key, _)| key.to_owned()).collect()).unwrap_or_default();
    debug_assert_eq!(keys.len(), vary.len(), "the table was read from this text");
    keys
}

/// Every combination, the last axis fastest: what is set, and the combination before it along axis `warm`.
pub(super) fn combinations(axes: &[Axis], warm: Option<usize>) -> Vec<(Values, Option<usize>)> {
    if axes.is_empty() {
        return Vec::new();
    }
    let strides: Vec<usize> =
        (0..axes.len()).map(|k| axes[k + 1..].iter().map(|axis| axis.rows.len()).product()).collect();
    let count = strides[0] * axes[0].rows.len();
    let place = |at: usize, k: usize| at / strides[k] % axes[k].rows.len();
    (0..count)
        .map(|at| {
            let set = (0..axes.len()).flat_map(|k| axes[k].rows[place(at, k)].iter().cloned()).collect();
            (set, warm.filter(|&k| place(at, k) > 0).map(|k| at - strides[k]))
        })
        .collect()
}
