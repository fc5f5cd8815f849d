//! The schema of a value of one of several JSON types, without alternatives: a number or a table, a word or a table.
//!
//! Most keywords of JSON Schema hold for one type alone (`minimum` for numbers, `items` for lists, `properties` for tables), so those
//! of several schemas can stand side by side if their types differ, and a validator names what is wrong with the value that is there.
//! `enum` and `const` hold for every type; they are put under a condition.

use super::schema_defs::{Defs, reference};
use super::{Node, Value};

/// The JSON types that a schema allows.
fn types(schema: &Node) -> Vec<&str> {
    match schema.get("type").map(|t| &t.value) {
        Some(Value::Text(name)) => vec![name.as_str()],
        Some(Value::List(names)) => names.iter().filter_map(Node::as_text).collect(),
        _ if schema.get("enum").is_some() => vec!["string"],
        _ => Vec::new(),
    }
}

/// The same schema, and those in it, with the keywords side by side of every `anyOf` whose types differ.
pub(super) fn one_of_types(schema: &Node, defs: &Defs) -> Node {
    let inner = |node: &Node| one_of_types(node, defs);
    match &schema.value {
        Value::List(items) => items.iter().map(inner).collect::<Vec<Node>>().into(),
        Value::Table(entries) => {
            let table = entries.iter().map(|(key, _, node)| (key.clone(), None, inner(node))).collect();
            let table: Node = Value::Table(table).into();
            let Some(Value::List(choices)) = table.get("anyOf").map(|n| &n.value) else { return table };
            // Of a definition the keys stand here; those within them are references again.
            let choices = joined(choices.iter().map(|choice| resolved(choice, defs)).collect());
            let all: Vec<&str> = choices.iter().flat_map(types).collect();
            let differ = all.iter().enumerate().all(|(i, t)| !all[..i].contains(t))
                && choices.iter().all(|c| !types(c).is_empty());
            if !differ {
                return table;
            }
            // The condition of a table with sets of keys would hold for other values too; of words `merged` sees to that.
            let others = all.iter().any(|t| !["object", "string"].contains(t));
            let one =
                if others { merged(&choices.iter().map(of_tables).collect::<Vec<Node>>()) } else { merged(&choices) };
            table.entries().filter(|e| e.0 != "anyOf").fold(one, |one, (key, node)| one.with(key, node.clone()))
        }
        _ => schema.clone(),
    }
}

/// The same choices, with tables of one key of several as one of them.
fn joined(choices: Vec<Node>) -> Vec<Node> {
    let mut out: Vec<Node> = Vec::new();
    for choice in choices {
        let other = out.iter_mut().find(|o| keys_of_one(o).is_some());
        match (other, keys_of_one(&choice)) {
            (Some(other), Some(more)) if types(&choice) == ["object"] => {
                let keys = keys_of_one(other).unwrap_or_default().into_iter().chain(more);
                let one = || Node::from(Value::Whole(1));
                let properties = Value::Table(keys.map(|(key, node)| (key, None, node)).collect()).into();
                let tables =
                    other.entries().filter(|e| e.0 != "required").map(|(k, n)| (k.to_string(), None, n.clone()));
                let table: Node = Value::Table(tables.collect()).into();
                *other = table.with("properties", properties).with("minProperties", one()).with("maxProperties", one());
            }
            _ => out.push(choice),
        }
    }
    out
}

/// The keys of a table that has exactly one of them; `None` of any other.
fn keys_of_one(schema: &Node) -> Option<Vec<(String, Node)>> {
    let properties: Vec<(String, Node)> =
        schema.get("properties")?.entries().map(|(key, node)| (key.to_string(), node.clone())).collect();
    let required = schema.get("required").is_some() && properties.len() == 1;
    (types(schema).contains(&"object") && (required || schema.get("maxProperties").is_some())).then_some(properties)
}

/// A schema whose condition, if it has one, holds for tables alone.
fn of_tables(schema: &Node) -> Node {
    let (condition, rest) = parted(schema);
    match schema.get("if") {
        Some(_) => rest.with("if", Node::table([("type", "object".into())])).with("then", condition),
        None => rest,
    }
}

/// The condition of a schema, and what else it has.
fn parted(schema: &Node) -> (Node, Node) {
    let anything: Node = Value::Table(Vec::new()).into();
    schema.entries().fold((anything.clone(), anything), |(condition, rest), (key, node)| {
        match ["if", "then", "else"].contains(&key) {
            true => (condition.with(key, node.clone()), rest),
            false => (condition, rest.with(key, node.clone())),
        }
    })
}

/// A reference as what it refers to, with its name.
fn resolved(schema: &Node, defs: &Defs) -> Node {
    match defs.resolve(schema) {
        Some((name, of)) => one_of_types(of, defs).with("x-kind", name.into()),
        None => schema.clone(),
    }
}

/// One schema of several whose types differ. Descriptions, each of one type, are left out.
pub(super) fn merged(choices: &[Node]) -> Node {
    let names = choices.iter().flat_map(types).map(Node::from).collect::<Vec<_>>();
    let (listed, others): (Vec<&Node>, Vec<&Node>) = choices.iter().partition(|c| c.get("enum").is_some());
    let own = others.iter().flat_map(|c| c.entries()).filter(|e| !["type", "description"].contains(&e.0));
    let out = own.fold(Node::table([("type", names.into())]), |out, (key, node)| out.with(key, node.clone()));
    listed.into_iter().fold(out, with_words)
}

/// Adds the words that text may be. Editors offer the words in an `anyOf` but look into no `then`, which alone refuses others with
/// a list of these; hence the second choice of `anyOf`, which allows anything.
fn with_words(schema: Node, words: &Node) -> Node {
    let anything: Node = Value::Table(Vec::new()).into();
    let words = match words.get("x-kind").and_then(Node::as_text) {
        Some(name) => reference(name),
        None => words
            .entries()
            .filter(|e| ["enum", "x-taplo"].contains(&e.0))
            .fold(anything.clone(), |out, (key, node)| out.with(key, node.clone())),
    };
    let conditional = schema.get("if").is_some();
    let (condition, rest) = parted(&schema);
    let schema = rest
        .with("anyOf", vec![words.clone(), anything.clone()].into())
        .with("if", Node::table([("type", "string".into())]))
        .with("then", words);
    if conditional { schema.with("else", condition) } else { schema }
}
