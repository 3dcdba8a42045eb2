//! From a key to its place in a TOML text, and back.

use std::ops::Range;

use super::path::join;
use toml_edit::{Document, Item, Key, TableLike, Value};

/// Line (from 1) of the byte `at`.
pub(super) fn line(text: &str, at: usize) -> usize {
    text.bytes().take(at).filter(|&byte| byte == b'\n').count() + 1
}

/// The key on the line of the byte `at`, if it has letters that no key may have without quotes.
pub(super) fn key_with_accents(text: &str, at: usize) -> Option<&str> {
    let start = text.get(..at)?.rfind('\n').map_or(0, |end| end + 1);
    let key = text[start..].lines().next()?.split('=').next()?.trim();
    (!key.is_ascii() && !key.contains(['"', '\'', '#', '[', ' '])).then_some(key)
}

/// Byte position of the dotted `key`, or of the innermost table around it that exists.
pub(super) fn position(document: &Document<&str>, key: &str) -> Option<usize> {
    let mut best = (0, None);
    walk(document.as_item(), &mut Vec::new(), &mut |path, span| {
        let rest = key.strip_prefix(&join(path));
        let around = rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
        // of equal paths the first wins: the key, not its value
        if around && path.len() > best.0 {
            best = (path.len(), Some(span.start));
        }
    });
    best.1
}

/// Path of the innermost key whose name or value covers the byte `at`; empty at the top.
pub(super) fn path_at(document: &Document<&str>, at: usize) -> Vec<String> {
    let mut best = Vec::new();
    walk(document.as_item(), &mut Vec::new(), &mut |path, span| {
        if span.contains(&at) && path.len() >= best.len() {
            best = path.to_vec();
        }
    });
    best
}

/// Path of the table or value that covers exactly `wanted`; empty if there is none.
pub(super) fn path_of(document: &Document<&str>, wanted: &Range<usize>) -> Vec<String> {
    let mut best = Vec::new();
    walk(document.as_item(), &mut Vec::new(), &mut |path, span| {
        if span == *wanted {
            best = path.to_vec();
        }
    });
    best
}

/// Calls `visit` with the path and the byte range of every key and of every value below `item`.
pub(super) fn walk(item: &Item, path: &mut Vec<String>, visit: &mut dyn FnMut(&[String], Range<usize>)) {
    if let (Some(span), false) = (item.span(), path.is_empty()) {
        visit(path, span);
    }
    match item {
        Item::Table(table) => walk_table(table, path, visit),
        Item::Value(value) => walk_value(value, path, visit),
        Item::ArrayOfTables(tables) => {
            for (at, table) in tables.iter().enumerate() {
                path.push(at.to_string());
                if let Some(span) = table.span() {
                    visit(path, span);
                }
                walk_table(table, path, visit);
                path.pop();
            }
        }
        Item::None => {}
    }
}

fn walk_table(table: &dyn TableLike, path: &mut Vec<String>, visit: &mut dyn FnMut(&[String], Range<usize>)) {
    for (name, item) in table.iter() {
        path.push(name.to_owned());
        if let Some(span) = table.key(name).and_then(Key::span) {
            visit(path, span);
        }
        walk(item, path, visit);
        path.pop();
    }
}

fn walk_value(value: &Value, path: &mut Vec<String>, visit: &mut dyn FnMut(&[String], Range<usize>)) {
    match value {
        Value::InlineTable(table) => walk_table(table, path, visit),
        Value::Array(array) => {
            for (at, element) in array.iter().enumerate() {
                path.push(at.to_string());
                if let Some(span) = element.span() {
                    visit(path, span);
                }
                walk_value(element, path, visit);
                path.pop();
            }
        }
        Value::String(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => {}
    }
}
