//! Rows of the docs' tables of keys.

use serde_json::Value;

use super::Range;

/// `| key | meaning | values | default |` for each key of a table, those of tables in it with dots.
pub fn rows(schema: &Value) -> Vec<String> {
    let mut rows = Vec::new();
    below(schema, "", None, &mut rows);
    rows
}

fn below(schema: &Value, around: &str, kinds: Option<&str>, rows: &mut Vec<String>) {
    for key in keys(schema) {
        let Some(one) = schema.get("properties").and_then(|properties| properties.get(key)) else { continue };
        let path = format!("{around}{key}");
        let kinds = text(one, "x-kinds").or(kinds);
        if one.get("properties").is_some() && one.get("x-values").is_none() {
            below(one, &format!("{path}."), kinds, rows);
            continue;
        }
        let required = schema.get("required").and_then(Value::as_array).into_iter().flatten();
        let must = required.into_iter().any(|other| other == key);
        rows.push(row(&path, one, must, kinds));
    }
}

/// The row of a key.
pub fn row(key: &str, schema: &Value, must: bool, kinds: Option<&str>) -> String {
    let of_one = kinds.filter(|kinds| !kinds.contains(' ')).map(|kind| format!("{kind}: ")).unwrap_or_default();
    let mut about = about(schema) + &of_choices(schema);
    if !of_one.is_empty() {
        about = of_one + &lowered(&about);
    }
    let given = schema.get("default").map(shown).or_else(|| text(schema, "x-default").map(str::to_owned));
    let default = if must { "–".to_owned() } else { given.unwrap_or_else(|| "none".to_owned()) };
    let cells = [format!("`{key}`"), about, values(schema), default];
    format!("| {} |", cells.map(|cell| cell.replace('|', "\\|")).join(" | "))
}

/// What a key means, in a line.
fn about(schema: &Value) -> String {
    let about = text(schema, "description").unwrap_or_default();
    about.lines().map(str::trim).collect::<Vec<_>>().join(" ").trim_end_matches('.').to_owned()
}

/// What its choices mean, where they say it and no other words stand for them.
fn of_choices(schema: &Value) -> String {
    let choices = schema.get("oneOf").and_then(Value::as_array).filter(|_| schema.get("x-values").is_none());
    let said = |one: &Value| {
        let about = about(one);
        let name = one.get("const").filter(|_| !about.is_empty())?;
        Some(format!("{}: {}", shown(name), lowered(&about)))
    };
    let said: Option<Vec<String>> = choices.and_then(|choices| choices.iter().map(said).collect());
    said.filter(|said| !said.is_empty()).map_or_else(String::new, |said| format!(". {}", said.join("; ")))
}

/// `| choice | meaning |` for each value that a key may have.
pub fn choices(schema: &Value) -> Vec<String> {
    let all = ["oneOf", "anyOf"].into_iter().filter_map(|key| schema.get(key)?.as_array()).flatten();
    let several = |one: &Value| one.get("oneOf").is_some_and(Value::is_array);
    all.flat_map(|one| if several(one) { choices(one) } else { of_choice(one) }).collect()
}

fn of_choice(one: &Value) -> Vec<String> {
    let about = |schema: &Value| about(schema).replace('|', "\\|");
    let Some(keys) = one.get("properties").and_then(Value::as_object) else {
        let kinds = text(one, "x-kinds").filter(|kinds| !kinds.contains(' '));
        let note = kinds.map(|kind| format!(" ({kind})")).unwrap_or_default();
        return vec![format!("| {} | {}{note} |", kinds_of_values(one), about(one))];
    };
    let row = |(name, value): (&String, &Value)| {
        let inner: Vec<&str> = self::keys(value);
        let shown = match (inner.is_empty(), text(value, "type")) {
            (false, _) => format!("{{ {} }}", inner.join(", ")),
            (true, Some("array")) => "[…, …]".to_owned(),
            (true, Some("string")) => "\"…\"".to_owned(),
            (true, _) => "…".to_owned(),
        };
        let about = if text(one, "description").is_some() { about(one) } else { about(value) };
        format!("| `{{ {name} = {shown} }}` | {about} |")
    };
    keys.iter().map(row).collect()
}

/// With a small first letter, where this is not a symbol.
fn lowered(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next();
    match (first, letters.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() => first.to_lowercase().chain(letters).collect(),
        (_, _) => text.to_owned(),
    }
}

fn text<'s>(schema: &'s Value, key: &str) -> Option<&'s str> {
    schema.get(key).and_then(Value::as_str)
}

/// The keys of a table in their order; those that are only another spelling are left out.
fn keys(schema: &Value) -> Vec<&str> {
    let ordered = schema.get("x-order").and_then(Value::as_array);
    match ordered {
        Some(list) => list.iter().filter_map(Value::as_str).filter(|key| *key != "center").collect(),
        None => {
            schema.get("properties").and_then(Value::as_object).into_iter().flatten().map(|(k, _)| k.as_str()).collect()
        }
    }
}

/// Which values a key takes, in words.
fn values(schema: &Value) -> String {
    let rule = text(schema, "x-rule").map(|rule| format!(", {rule}")).unwrap_or_default();
    format!("{}{rule}", kinds_of_values(schema))
}

fn kinds_of_values(schema: &Value) -> String {
    if let Some(words) = text(schema, "x-values") {
        return words.to_owned();
    }
    if let Some(only) = schema.get("const") {
        return shown(only);
    }
    if let Some(choices) = schema.get("enum").and_then(Value::as_array) {
        return choices.iter().map(shown).collect::<Vec<_>>().join(", ");
    }
    for key in ["oneOf", "anyOf"] {
        if let Some(choices) = schema.get(key).and_then(Value::as_array).filter(|_| schema.get("type").is_none()) {
            return choices.iter().map(kinds_of_values).collect::<Vec<_>>().join(", ");
        }
    }
    let unit = text(schema, "x-unit");
    let range = Range::told(schema).to_string();
    let number = |plain: &str| match (unit, range.as_str()) {
        (None, "") => plain.to_owned(),
        (None, range) => range.to_owned(),
        (Some(unit), range) => format!("{unit} {range}").trim().to_owned(),
    };
    match text(schema, "type") {
        Some("boolean") => "`true`, `false`".to_owned(),
        Some("integer") => number("whole number"),
        Some("number") => number("any number"),
        Some("string") => "text".to_owned(),
        Some("array") => list(schema),
        Some("object") => "table".to_owned(),
        Some(_) | None => "any value".to_owned(),
    }
}

fn list(schema: &Value) -> String {
    let Some(items) = schema.get("items") else { return "list".to_owned() };
    let of = kinds_of_values(items);
    let two = schema.get("maxItems").and_then(Value::as_u64) == Some(2);
    match (two, of.as_str()) {
        (true, "any number") => "two numbers".to_owned(),
        (true, "two numbers") => "two points".to_owned(),
        (true, "formula") => "pair of formulas".to_owned(),
        (true, of) => format!("two numbers {of}"),
        (false, "two numbers") => "list of points".to_owned(),
        (false, of) => format!("list of {of}"),
    }
}

/// As TOML has it.
fn shown(value: &Value) -> String {
    match value {
        Value::Number(number) => {
            let x = number.as_f64().unwrap_or(f64::NAN);
            let short = if x.fract() == 0.0 && x.abs() < 1e4 { format!("{x}") } else { number.to_string() };
            short.strip_suffix(".0").unwrap_or(&short).to_owned()
        }
        Value::Array(list) => {
            let inner = list.iter().map(|one| shown(one).replace('`', "")).collect::<Vec<_>>().join(", ");
            format!("`[{inner}]`")
        }
        Value::String(_) | Value::Bool(_) => format!("`{value}`"),
        Value::Null | Value::Object(_) => "none".to_owned(),
    }
}
