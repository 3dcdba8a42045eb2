//! Rules on the values of `[mesh]`: those on each alone, and those that several generators share.

use super::keys::{Key, LENGTHS, Meaning, Value};
use super::size::Size;
use crate::mesh::MeshError;
use crate::schema::Range;

/// More cells than this are taken for a misprint in `h`.
pub(super) const MOST_CELLS: f64 = 5e6;

/// Edges below this share of the largest coordinate could have both ends in one point by rounding.
const FINEST: f64 = 1e-9;

pub(super) type Check = Result<(), MeshError>;

/// A refusal of `mesh.<key>`.
pub(super) fn bad(key: &str, value: impl ToString, rule: impl Into<String>, hint: impl Into<String>) -> MeshError {
    let (rule, hint) = (rule.into(), hint.into());
    MeshError::BadKey { key: format!("mesh.{key}"), value: value.to_string(), rule, hint }
}

/// Rules on single values, and on edges against coordinates.
pub(super) fn of_each(all: &[(&Key, Value)]) -> Check {
    for (key, value) in all {
        match (key.meaning, *value) {
            (Meaning::Length | Meaning::Edge, Value::Number(_)) => {
                let hint = "a length in units of the scene";
                within(key, *value, "it must be positive, between 1e-9 and 1e9", hint)?;
            }
            (Meaning::Growth, Value::Number(_)) => {
                let hint = "0.15 lets an edge grow by 15 percent of its distance from the disc";
                within(key, *value, "it must lie in 0.001 to 1", hint)?;
            }
            (Meaning::Within { rule, hint, .. }, _) => within(key, *value, rule, hint)?,
            (Meaning::Count, Value::Whole(0)) => {
                return Err(bad(key.name, 0, "it must be at least 1", "the square has 2 n² cells"));
            }
            (
                Meaning::Length
                | Meaning::Edge
                | Meaning::Growth
                | Meaning::Count
                | Meaning::Place
                | Meaning::Interval
                | Meaning::Free,
                Value::Flag(_) | Value::Whole(_) | Value::Number(_) | Value::Pair(_),
            ) => {}
        }
    }
    places(all)?;
    edges(all)
}

/// Edges are long against the rounding of coordinates.
fn edges(all: &[(&Key, Value)]) -> Check {
    let measured = |key: &Key| matches!(key.meaning, Meaning::Length | Meaning::Place | Meaning::Interval);
    let coordinates = all.iter().filter(|(key, _)| measured(key)).flat_map(|(_, value)| value.numbers());
    let largest = coordinates.fold(0.0, |m: f64, x| m.max(x.abs()));
    for (key, value) in all.iter().filter(|(key, _)| key.meaning == Meaning::Edge) {
        let rule = "it must exceed 1e-9 of the largest coordinate, or rounding makes vertices coincide";
        let hint = "choose it larger, or lengths smaller";
        let long = Range::at_least(FINEST * largest);
        if !value.numbers().into_iter().all(|x| long.has(x)) {
            return Err(bad(key.name, value, rule, hint));
        }
    }
    Ok(())
}

/// Coordinates, against whose rounding edges must be long.
fn places(all: &[(&Key, Value)]) -> Check {
    let pair = |(key, value): &(&Key, Value)| match (key.meaning, *value) {
        (Meaning::Place | Meaning::Interval, Value::Pair(pair)) => Some((key.name, pair, key.meaning)),
        (
            Meaning::Length
            | Meaning::Edge
            | Meaning::Growth
            | Meaning::Count
            | Meaning::Place
            | Meaning::Interval
            | Meaning::Within { .. }
            | Meaning::Free,
            Value::Flag(_) | Value::Whole(_) | Value::Number(_) | Value::Pair(_),
        ) => None,
    };
    let pairs: Vec<_> = all.iter().filter_map(pair).collect();
    for (key, pair, meaning) in &pairs {
        if !pair.iter().all(|x| meaning.range().has(*x)) {
            let rule = "both numbers must be finite, at most 1e9 in size";
            return Err(bad(key, format!("{pair:?}"), rule, "for example [-30.0, 50.0]"));
        }
    }
    for (key, [a, b], _) in pairs.into_iter().filter(|(.., meaning)| *meaning == Meaning::Interval) {
        if a >= b {
            let rule = "the first number must be smaller than the second";
            return Err(bad(key, format!("[{a:?}, {b:?}]"), rule, "for example [-30.0, 50.0]"));
        }
        let least = LENGTHS[0].max(FINEST * a.abs().max(b.abs()));
        if b - a < least {
            let rule =
                "the extent must be at least 1e-9, and 1e-9 of the coordinates, or rounding makes vertices coincide";
            let hint = "choose a unit of length in which the domain is near 1 across, and an origin in it";
            return Err(bad(key, format!("[{a:?}, {b:?}]"), rule, hint));
        }
    }
    Ok(())
}

/// Refuses a number outside the range of its key (and what is no number).
fn within(key: &Key, value: Value, rule: &str, hint: &str) -> Check {
    if value.numbers().into_iter().all(|x| key.meaning.range().has(x)) {
        return Ok(());
    }
    Err(bad(key.name, value, rule, hint))
}

/// The edge length `h` under `key` must not exceed the size called `name`.
pub(super) fn resolves(key: &str, h: f64, name: &str, size: f64) -> Check {
    if h > size {
        let rule = format!("it must not exceed {name} = {size:?}");
        return Err(bad(key, format!("{h:?}"), rule, format!("choose a smaller {key}")));
    }
    Ok(())
}

/// Edges on a disc are not longer than those far from it.
pub(super) fn finer_on_the_disc(h: f64, h_disc: f64) -> Check {
    if h_disc > h {
        let rule = format!("it must not exceed h = {h:?}");
        return Err(bad("h_disc", format!("{h_disc:?}"), rule, "h_disc refines near the disc"));
    }
    Ok(())
}

/// A gap between a disc and `side` that is narrower than one edge of the disc would be filled with flat cells.
pub(super) fn gap(radius: f64, h_disc: f64, gap: f64, side: &str) -> Check {
    if gap <= 0.0 {
        let rule = format!("the disc must not touch {side} (gap {gap:.4})");
        return Err(bad("radius", format!("{radius:?}"), rule, "shrink or move the disc"));
    }
    if gap < h_disc {
        let rule = format!("it must not exceed the gap {gap:.4} between the disc and {side}");
        return Err(bad("h_disc", format!("{h_disc:?}"), rule, "choose a smaller h_disc, or move the disc"));
    }
    Ok(())
}

/// What is symmetric has its centre on the axis.
pub(super) fn on_the_axis(symmetric: bool, [x, y]: [f64; 2]) -> Check {
    if symmetric && y != 0.0 {
        let rule = "a symmetric mesh needs its centre on x₂ = 0";
        return Err(bad("centre", format!("[{x:?}, {y:?}]"), rule, "set the second number to 0, or symmetric = false"));
    }
    Ok(())
}

/// A mesh with edges of this size, of so many cells, `far` of them if there were no discs, is not too large.
pub(super) fn not_too_many(size: &Size, count: f64, far: f64) -> Check {
    if count <= MOST_CELLS {
        return Ok(());
    }
    let rule = format!("it would give about {count:.1e} cells; at most 5 million are allowed");
    // Blame the size that makes the number.
    if size.h_disc < size.h && far < 0.5 * count {
        return Err(bad("h_disc", format!("{:?}", size.h_disc), rule, "choose a larger h_disc or grading"));
    }
    Err(bad("h", format!("{:?}", size.h), rule, "choose a larger h"))
}
