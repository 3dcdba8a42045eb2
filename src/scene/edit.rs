//! Putting one value into a TOML document.

use toml_edit::{Array, InlineTable, Item, Table, TableLike, Value};

/// Why a value cannot be put there.
pub(super) struct Refusal {
    pub rule: String,
    pub hint: String,
}

fn refuse<T>(rule: String, hint: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal { rule, hint: hint.into() })
}

/// Sets the value at `keys` below `root`, or removes it if `text` is empty. Tables on the way are made. `false` if
/// there was nothing to remove.
pub(super) fn set(root: &mut Item, keys: &[&str], text: &str) -> Result<bool, Refusal> {
    let value = if text.is_empty() { None } else { Some(parse(text)?) };
    let lists = lists(root);
    in_item(root, keys, value).map_err(|refusal| match refusal.rule.starts_with(NO_LIST) {
        true => Refusal { hint: format!("{}; {lists}", refusal.hint), ..refusal },
        false => refusal,
    })
}

/// How a rule begins that is about a list that is not there.
const NO_LIST: &str = "there is no list";
/// Keys of files that are lists of tables.
const LISTS: [&str; 7] = ["body", "bodies", "wall", "output", "case", "setting", "variant"];

/// Whether the keys after `key` name an element of it. A number may be the tag of a boundary, too.
fn is_list(key: &str, rest: &[&str]) -> bool {
    LISTS.contains(&key) || key != "boundary" && rest.first().is_some_and(|next| next.parse::<usize>().is_ok())
}

/// The lists of tables that a file has, in a sentence.
fn lists(root: &Item) -> String {
    let tables = root.as_table().into_iter().flat_map(|table| table.iter());
    let found: Vec<String> = tables
        .filter_map(|(name, item)| {
            let count = match item {
                Item::ArrayOfTables(tables) => tables.len(),
                Item::Value(Value::Array(array)) if array.iter().any(Value::is_inline_table) => array.len(),
                Item::Value(_) | Item::Table(_) | Item::None => return None,
            };
            Some(format!("`{name}` (elements 0 to {})", count.saturating_sub(1)))
        })
        .collect();
    if found.is_empty() {
        "this file has no lists of tables".to_owned()
    } else {
        format!("the lists of this file are {}", found.join(", "))
    }
}

/// The list that a first whole element makes.
fn first_of(keys: &[&str], value: &Value) -> Option<Array> {
    (keys == ["0"] && value.is_inline_table()).then(|| Array::from_iter([value.clone()]))
}

/// A TOML value; bare words and formulas are strings.
fn parse(text: &str) -> Result<Value, Refusal> {
    match text.parse::<Value>() {
        Ok(mut value) => {
            value.decor_mut().clear();
            Ok(value)
        }
        // what starts like TOML was meant to be TOML
        Err(error) if text.starts_with(['[', '{', '"', '\'']) => {
            let rule = format!("not a TOML value: {}", error.message().replace('\n', ", "));
            refuse(rule, "quote it for the shell, as in --set 'mesh.length=[-30.0, 50.0]'")
        }
        Err(_) => Ok(Value::from(text)),
    }
}

fn in_item(item: &mut Item, keys: &[&str], value: Option<Value>) -> Result<bool, Refusal> {
    match item {
        Item::Table(table) => in_table(table, keys, value, || Item::Table(Table::new())),
        Item::Value(inner) => in_value(inner, keys, value),
        Item::ArrayOfTables(tables) => {
            let (at, rest) = index(keys, tables.len(), value.is_none())?;
            if let (true, Some(Value::InlineTable(whole))) = (at == tables.len(), &value) {
                tables.push(whole.clone().into_table());
                return Ok(true);
            }
            match tables.get_mut(at) {
                Some(table) if !rest.is_empty() => in_table(table, rest, value, || Item::Table(Table::new())),
                Some(_) if value.is_none() => {
                    tables.remove(at);
                    Ok(true)
                }
                Some(_) | None => refuse("a whole table cannot be set".to_owned(), "set its keys one by one"),
            }
        }
        Item::None => refuse("there is nothing here".to_owned(), "set the table around it"),
    }
}

/// `below` makes a table for a key that is missing on the way.
fn in_table(
    table: &mut dyn TableLike,
    keys: &[&str],
    value: Option<Value>,
    below: impl Fn() -> Item,
) -> Result<bool, Refusal> {
    let Some((key, rest)) = keys.split_first() else {
        return refuse("this is a whole table".to_owned(), "set its keys one by one");
    };
    match (rest.is_empty(), value) {
        (true, None) => Ok(table.remove(key).is_some()),
        (true, Some(value)) => {
            table.insert(key, Item::Value(value));
            Ok(true)
        }
        (false, value) => {
            if let (None, Some(value)) = (table.get(key), &value) {
                if let Some(list) = first_of(rest, value) {
                    table.insert(key, Item::Value(Value::Array(list)));
                    return Ok(true);
                }
                if is_list(key, rest) {
                    let hint = format!("give it as a whole, in brackets, as in '{key}=[…]'");
                    return refuse(format!("{NO_LIST} `{key}`, and so no element `{}` of it", rest[0]), hint);
                }
                table.insert(key, below());
            }
            table.get_mut(key).map_or(Ok(false), |next| in_item(next, rest, value))
        }
    }
}

fn in_value(inner: &mut Value, keys: &[&str], value: Option<Value>) -> Result<bool, Refusal> {
    match inner {
        Value::InlineTable(table) => {
            in_table(table, keys, value, || Item::Value(Value::InlineTable(InlineTable::new())))
        }
        Value::Array(array) => in_array(array, keys, value),
        Value::String(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => {
            let shown = inner.to_string();
            let rule = format!("the value around it is {}, which has no key `{}`", shown.trim(), keys.join("."));
            refuse(rule, "set the value around it as a whole, as in 'boundary.inlet.velocity={ dirichlet = [1, 0] }'")
        }
    }
}

fn in_array(array: &mut Array, keys: &[&str], value: Option<Value>) -> Result<bool, Refusal> {
    let (at, rest) = index(keys, array.len(), value.is_none())?;
    match (array.get_mut(at), value) {
        (Some(element), value) if !rest.is_empty() => in_value(element, rest, value),
        (Some(element), Some(value)) => {
            *element = value;
            Ok(true)
        }
        (Some(_), None) => {
            array.remove(at);
            Ok(true)
        }
        (None, Some(value)) if rest.is_empty() => {
            array.push(value);
            Ok(true)
        }
        (None, _) => refuse("there is no such element".to_owned(), "append whole elements only"),
    }
}

/// First key as the index into a list of `length`; one past the end appends.
fn index<'a>(keys: &'a [&'a str], length: usize, remove: bool) -> Result<(usize, &'a [&'a str]), Refusal> {
    let Some((key, rest)) = keys.split_first() else {
        return refuse("this is a whole list".to_owned(), "name an element, counted from 0");
    };
    let last = if remove || !rest.is_empty() { length } else { length + 1 };
    match key.parse::<usize>() {
        Ok(at) if at < last => Ok((at, rest)),
        Ok(_) | Err(_) => refuse(
            format!("`{key}` is no element of a list of {length}"),
            match length {
                0 => "the list is empty: give it as a whole, in brackets".to_owned(),
                _ => format!(
                    "elements are counted from 0, so that the last one is {}; a whole one is appended at {length}",
                    length - 1
                ),
            },
        ),
    }
}
