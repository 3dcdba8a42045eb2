//! Which numbers a key takes.

use std::fmt;

use schemars::Schema;
use serde_json::{Number, Value};

/// The numbers between two ends; what is not finite is in no range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    low: f64,
    high: f64,
    /// Whether the ends do not belong to it.
    open: [bool; 2],
}

impl Range {
    /// Any finite number.
    pub const ANY: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY, open: [true; 2] };
    /// Above 0.
    pub const POSITIVE: Self = Self::more_than(0.0);
    /// From 0 on.
    pub const NOT_NEGATIVE: Self = Self::at_least(0.0);
    /// What is counted and must be there.
    pub const SOME: Self = Self::at_least(1.0);

    /// Above `low`.
    pub const fn more_than(low: f64) -> Self {
        Self { low, high: f64::INFINITY, open: [true; 2] }
    }

    /// From `low` on.
    pub const fn at_least(low: f64) -> Self {
        Self { low, high: f64::INFINITY, open: [false, true] }
    }

    /// From `low` to `high`, both included.
    pub const fn within(low: f64, high: f64) -> Self {
        Self { low, high, open: [false; 2] }
    }

    /// From `low`, which is not included, to `high`, which is.
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, high, open: [true, false] }
    }

    /// From `low`, which is included, to `high`, which is not.
    pub const fn below(low: f64, high: f64) -> Self {
        Self { low, high, open: [false, true] }
    }

    /// Between `low` and `high`, both left out.
    pub const fn inside(low: f64, high: f64) -> Self {
        Self { low, high, open: [true; 2] }
    }

    /// Whether a number is in it.
    pub fn has(&self, x: f64) -> bool {
        let above = if self.open[0] { x > self.low } else { x >= self.low };
        let below = if self.open[1] { x < self.high } else { x <= self.high };
        x.is_finite() && above && below
    }

    /// Whether a whole number is in it.
    pub fn has_count(&self, n: usize) -> bool {
        self.has(n as f64)
    }

    /// The range that a schema tells.
    pub(super) fn told(schema: &Value) -> Self {
        let bound = |key: &str| schema.get(key).and_then(Value::as_f64);
        let (low, high) = (bound("minimum"), bound("maximum"));
        Self {
            low: low.or_else(|| bound("exclusiveMinimum")).unwrap_or(f64::NEG_INFINITY),
            high: high.or_else(|| bound("exclusiveMaximum")).unwrap_or(f64::INFINITY),
            open: [low.is_none(), high.is_none()],
        }
    }

    fn write(&self, map: &mut serde_json::Map<String, Value>) {
        for key in ["minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"] {
            map.remove(key);
        }
        let mut put = |bound: f64, key: &str| {
            if bound.is_finite() {
                map.insert(key.to_owned(), number(bound));
            }
        };
        put(self.low, if self.open[0] { "exclusiveMinimum" } else { "minimum" });
        put(self.high, if self.open[1] { "exclusiveMaximum" } else { "maximum" });
    }
}

/// Whole where it can be.
fn number(x: f64) -> Value {
    if x.fract() == 0.0 && x.abs() < 1e15 {
        return Value::from(x as i64);
    }
    Number::from_f64(x).map_or(Value::Null, Value::Number)
}

impl Range {
    /// A transform that writes the range beside the type of a number, or of the numbers of a list.
    pub fn said(self) -> impl FnMut(&mut Schema) {
        move |schema| {
            if let Some(map) = schema.as_object_mut() {
                self.write_in(map);
            }
        }
    }

    fn write_in(self, map: &mut serde_json::Map<String, Value>) {
        let of_numbers = |one: &Value| one == "number" || one == "integer";
        let is_number = match map.get("type") {
            Some(Value::Array(types)) => types.iter().any(of_numbers),
            Some(one) => of_numbers(one),
            None => false,
        };
        if is_number {
            self.write(map);
        }
        if let Some(items) = map.get_mut("items").and_then(Value::as_object_mut) {
            self.write_in(items);
        }
        for one in map.get_mut("anyOf").and_then(Value::as_array_mut).into_iter().flatten() {
            if let Some(one) = one.as_object_mut() {
                self.write_in(one);
            }
        }
    }
}

/// `> 0`, `≥ 1`, `0 to 0.3`, `0 ≤ … < 1`; nothing of any number.
impl fmt::Display for Range {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |x: f64| {
            let short = match (x.fract() == 0.0, x.abs() < 1e5) {
                (true, true) => format!("{x}"),
                (_, true) => format!("{x:?}"),
                (_, false) => format!("{x:e}"),
            };
            short.replace('-', if x < 0.0 { "−" } else { "-" })
        };
        let (low, high) = (shown(self.low), shown(self.high));
        match (self.low.is_finite(), self.high.is_finite(), self.open) {
            (false, false, _) => Ok(()),
            (true, false, [true, _]) => write!(out, "> {low}"),
            (true, false, [false, _]) => write!(out, "≥ {low}"),
            (false, true, [_, true]) => write!(out, "< {high}"),
            (false, true, [_, false]) => write!(out, "≤ {high}"),
            (true, true, [false, false]) => write!(out, "{low} to {high}"),
            (true, true, [true, true]) => write!(out, "> {low}, < {high}"),
            (true, true, [true, false]) => write!(out, "> {low}, ≤ {high}"),
            (true, true, [false, true]) => write!(out, "≥ {low}, < {high}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Range;

    #[test]
    fn ends_belong_to_a_range_or_not() {
        let range = Range::below(0.0, 1.0);
        assert!(range.has(0.0) && range.has(0.5) && !range.has(1.0) && !range.has(-1e-300));
        assert!(Range::above(0.0, 1.0).has(1.0) && !Range::above(0.0, 1.0).has(0.0));
        assert!(Range::ANY.has(-1e300) && !Range::ANY.has(f64::INFINITY) && !Range::ANY.has(f64::NAN));
        assert!(!Range::POSITIVE.has(0.0) && !Range::POSITIVE.has(f64::INFINITY));
        assert!(Range::SOME.has_count(1) && !Range::SOME.has_count(0));
    }

    #[test]
    fn a_schema_tells_the_range_that_was_written_into_it() {
        let all = [
            Range::ANY,
            Range::POSITIVE,
            Range::NOT_NEGATIVE,
            Range::within(1e-16, 0.01),
            Range::above(0.0, 1.0),
            Range::below(0.0, 1.0),
            Range::inside(0.0, 1.0),
        ];
        for range in all {
            let mut map = serde_json::json!({ "type": "number", "minimum": 5 }).as_object().unwrap().clone();
            range.write_in(&mut map);
            assert_eq!(Range::told(&map.into()), range);
        }
        assert_eq!(Range::within(1e-16, 0.01).to_string(), "1e-16 to 0.01");
        assert_eq!(Range::within(-1.0, 1.0).to_string(), "−1 to 1");
        assert_eq!(Range::within(2.0, 1e7).to_string(), "2 to 1e7");
    }
}
