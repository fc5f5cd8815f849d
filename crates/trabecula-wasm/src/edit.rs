//! Values of a design's text changed in place: comments, order and spelling of all else stay.

use serde::Deserialize;
use serde_json::Value as Json;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Key, Table, Value};

/// A change of a value.
#[derive(Debug, Deserialize)]
pub struct Change {
    /// The keys that lead to it.
    path: Vec<String>,
    /// What is to stand there; null takes it away.
    value: Json,
    /// Whether a table with a heading of its own is preferred to one in braces.
    #[serde(default)]
    heading: bool,
}

/// The text with these changes, one after another; tables on the way are made. An error if it is no TOML, or if something that is no
/// table is on the way.
pub fn edit(text: &str, changes: &[Change]) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| e.to_string())?;
    for change in changes {
        let Some((last, way)) = change.path.split_last() else { continue };
        let mut at = document.as_item_mut();
        if change.value.is_null() {
            let found = way.iter().try_fold(at, |item, key| item.get_mut(key.as_str()));
            if let Some(table) = found.and_then(Item::as_table_like_mut) {
                table.remove(last);
            }
            continue;
        }
        for key in way {
            at = step(at, key)?;
        }
        put(at, last, change)?;
    }
    Ok(document.to_string())
}

fn no_table(key: &str) -> String {
    format!("{key} is in the way: what holds it is no table")
}

/// The item under a key, made a table if there is none.
fn step<'a>(at: &'a mut Item, key: &str) -> Result<&'a mut Item, String> {
    let dotted = at.as_table().is_some_and(Table::is_dotted);
    let inline = at.is_inline_table();
    let table = at.as_table_like_mut().ok_or_else(|| no_table(key))?;
    if !table.contains_key(key) {
        let made = if inline {
            Item::Value(Value::InlineTable(InlineTable::new()))
        } else {
            let mut new = Table::new();
            new.set_implicit(true);
            new.set_dotted(dotted);
            Item::Table(new)
        };
        table.insert(key, made);
    }
    table.get_mut(key).ok_or_else(|| no_table(key))
}

/// Puts a value under the last key, with the space and the comment that the old one had.
fn put(at: &mut Item, key: &str, change: &Change) -> Result<(), String> {
    let plain = at.as_table().is_some_and(|t| !t.is_dotted());
    let table = at.as_table_like_mut().ok_or_else(|| no_table(key))?;
    if let (true, true, Json::Object(entries)) = (change.heading, plain, &change.value) {
        let mut new = Table::new();
        for (name, value) in entries {
            new.insert(name, Item::Value(of_json(value)));
        }
        table.insert(key, Item::Table(new));
        return Ok(());
    }
    let mut new = of_json(&change.value);
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *new.decor_mut() = old.decor().clone();
    }
    match table.get_mut(key) {
        Some(item) => *item = Item::Value(new),
        None => drop(table.insert(key, Item::Value(new))),
    }
    Ok(())
}

fn of_json(value: &Json) -> Value {
    match value {
        Json::Bool(b) => Value::from(*b),
        Json::String(s) => Value::from(s.as_str()),
        Json::Number(n) => n.as_i64().map_or_else(|| Value::from(n.as_f64().unwrap_or(0.0)), Value::from),
        Json::Array(items) => Value::Array(items.iter().map(of_json).collect::<Array>()),
        Json::Object(entries) => {
            Value::InlineTable(entries.iter().map(|(k, v)| (Key::new(k), of_json(v))).collect::<InlineTable>())
        }
        Json::Null => Value::from(""),
    }
}
