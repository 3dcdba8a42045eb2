//! The conditions as a scene names them: their rows of the docs and their schema.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::Value;

use crate::expression::{Formula, VectorFormula};
use crate::schema;

/// A name that a condition may have.
#[derive(Debug, Clone, Copy)]
pub struct Named {
    /// As a scene writes it.
    pub name: &'static str,
    /// What it says where it stands alone, `"name"`; none where it cannot.
    pub alone: Option<&'static str>,
    /// What it is given, `{ name = … }`, and what it says then; none where it takes nothing.
    pub given: Option<(Form, &'static str)>,
}

/// What a condition is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// `f`
    Formula,
    /// `F = [f, g]`
    Pair,
}

impl Form {
    /// As the docs have it.
    fn symbol(self) -> &'static str {
        match self {
            Form::Formula => "f",
            Form::Pair => "F",
        }
    }

    fn schema(self, generator: &mut SchemaGenerator) -> Schema {
        match self {
            Form::Formula => Formula::json_schema(generator),
            Form::Pair => VectorFormula::json_schema(generator),
        }
    }
}

/// The conditions on the velocity.
pub const VELOCITY: [Named; 5] = [
    Named {
        name: "dirichlet",
        alone: Some("`v` is that of `[exact]`, which must be there"),
        given: Some((Form::Pair, "`v = F`")),
    },
    Named { name: "traction", alone: Some("`n·σ = 0`"), given: Some((Form::Pair, "`n·σ = F`")) },
    Named {
        name: "slip",
        alone: Some("a slip wall: `v·n = 0`, no tangential stress (no-slip is `{ dirichlet = [0, 0] }`)"),
        given: None,
    },
    Named {
        name: "friction",
        alone: None,
        given: Some((
            Form::Formula,
            "a wall that resists: `v·n = 0`, `(n·σ)·t = −f v·t`; its slip length is `1/f`; `f` ≥ 0, without `t`",
        )),
    },
    Named { name: "no-tangential", alone: Some("`v·t = 0`, no normal stress"), given: None },
];

/// The conditions on the polarity.
pub const POLARITY: [Named; 2] = [
    Named {
        name: "dirichlet",
        alone: Some("`p` is that of `[exact]`, weakly"),
        given: Some((Form::Pair, "`p = F`, weakly")),
    },
    Named { name: "neumann", alone: Some("`∂p/∂n = 0`"), given: None },
];

/// The schema of a condition on the velocity.
pub fn velocity_schema(generator: &mut SchemaGenerator) -> Schema {
    schema_of(&VELOCITY, generator)
}

/// The schema of a condition on the polarity.
pub fn polarity_schema(generator: &mut SchemaGenerator) -> Schema {
    schema_of(&POLARITY, generator)
}

fn schema_of(all: &[Named], generator: &mut SchemaGenerator) -> Schema {
    let mut choices: Vec<Value> = all.iter().filter_map(|one| Some(schema::choice(one.name, one.alone?))).collect();
    let value = |one: &Named| {
        let (form, says) = one.given?;
        let mut value = form.schema(generator);
        value.insert("description".to_owned(), says.into());
        Some((one.name.to_owned(), value.to_value()))
    };
    choices.push(schema::one_of_keys(all.iter().filter_map(value).collect()));
    schemars::json_schema!({ "oneOf": choices })
}

/// `| key | value | condition |` for every condition of a list, as the docs have it.
pub fn rows(key: &str, all: &[Named]) -> Vec<String> {
    let values = |one: &Named| {
        let given = one.given.map(|(form, says)| (format!("{{ {} = {} }}", one.name, form.symbol()), says));
        let alone = one.alone.map(|says| (format!("\"{}\"", one.name), says));
        [given, alone]
    };
    let all = all.iter().flat_map(values).flatten();
    all.map(|(value, says)| format!("| `{key}` | `{value}` | {says} |")).collect()
}
