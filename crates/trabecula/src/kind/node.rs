//! The tree that every text of a design becomes first and that is written as text again.

use std::collections::BTreeMap;

use serde::ser::{Serialize, SerializeMap, Serializer};

use super::error::DesignError;
use geometry::fault::{Fault, number};

/// A value with the line it stands on.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// The value.
    pub value: Value,
    /// Its line in the file, counted from one; `None` where there is no file.
    pub line: Option<usize>,
}

/// A value of a design, whatever it was written in.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// true or false.
    Bool(bool),
    /// Any number; NaN and infinities are refused when they are used.
    Number(f64),
    /// A whole number, as it is written; one that is read is a `Number`.
    Whole(i64),
    /// Text.
    Text(String),
    /// A list.
    List(Vec<Node>),
    /// Keys and values; with the line of each key.
    Table(Vec<(String, Option<usize>, Node)>),
    /// Something a design has no use for (null, a date); named by the text.
    Other(String),
}

impl From<Value> for Node {
    fn from(value: Value) -> Node {
        Node { value, line: None }
    }
}

impl From<&str> for Node {
    fn from(text: &str) -> Node {
        Value::Text(text.into()).into()
    }
}

impl From<f64> for Node {
    fn from(v: f64) -> Node {
        Value::Number(v).into()
    }
}

impl From<bool> for Node {
    fn from(v: bool) -> Node {
        Value::Bool(v).into()
    }
}

impl From<Vec<Node>> for Node {
    fn from(items: Vec<Node>) -> Node {
        Value::List(items).into()
    }
}

impl Serialize for Node {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match &self.value {
            Value::Bool(v) => to.serialize_bool(*v),
            Value::Number(v) => to.serialize_f64(*v),
            Value::Whole(v) => to.serialize_i64(*v),
            Value::Text(text) | Value::Other(text) => to.serialize_str(text),
            Value::List(items) => to.collect_seq(items),
            Value::Table(entries) => {
                let mut table = to.serialize_map(Some(entries.len()))?;
                for (key, _, node) in entries {
                    table.serialize_entry(key, node)?;
                }
                table.end()
            }
        }
    }
}

impl Node {
    /// A table of these keys and values.
    pub fn table<const N: usize>(entries: [(&str, Node); N]) -> Node {
        Value::Table(entries.into_iter().map(|(key, node)| (key.to_string(), None, node)).collect()).into()
    }

    /// The keys and values of a table; none of other nodes.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&str, &Node)> {
        let entries = if let Value::Table(entries) = &self.value { entries.as_slice() } else { &[] };
        entries.iter().map(|(key, _, node)| (key.as_str(), node))
    }

    /// The value of a key of a table.
    pub(crate) fn get(&self, key: &str) -> Option<&Node> {
        self.entries().find(|e| e.0 == key).map(|e| e.1)
    }

    /// The text, if it is one.
    pub(crate) fn as_text(&self) -> Option<&str> {
        if let Value::Text(text) = &self.value { Some(text) } else { None }
    }

    /// The same table with one more key, placed last; other nodes are left as they are.
    pub fn with(mut self, key: &str, node: Node) -> Node {
        if let Value::Table(entries) = &mut self.value {
            entries.retain(|e| e.0 != key);
            entries.push((key.to_string(), None, node));
        }
        self
    }

    /// Puts a value at a path, such as `region.box.size[0]`; tables on the way are made where they are missing.
    ///
    /// # Errors
    /// Anything but a table or list on the way; an index past the end of a list.
    pub(crate) fn put(&mut self, path: &str, value: Node) -> Result<(), Fault> {
        let mut here = self;
        for step in path.replace('[', ".[").split('.') {
            here = here.below(step)?;
        }
        *here = value;
        Ok(())
    }

    /// What stands under a key, or at an index such as `[0]`; a missing key is made, with an empty table.
    fn below(&mut self, step: &str) -> Result<&mut Node, Fault> {
        let index = step.strip_prefix('[').and_then(|s| s.strip_suffix(']')).map(|s| s.parse::<usize>());
        let refused = |what: &str, this: &Node| {
            Err(Fault::new("", format!("\"{step}\" needs a {what} above it, found {}", describe(this))))
        };
        match (&self.value, &index) {
            (Value::Table(_), None) | (Value::List(_), Some(Ok(_))) => {}
            (_, None) => return refused("table", self),
            _ => return refused("list", self),
        }
        match (&mut self.value, index) {
            (Value::List(items), Some(Ok(i))) if i < items.len() => Ok(&mut items[i]),
            (Value::Table(entries), _) => {
                let at = entries.iter().position(|e| e.0 == step).unwrap_or_else(|| {
                    entries.push((step.to_string(), None, Value::Table(Vec::new()).into()));
                    entries.len() - 1
                });
                Ok(&mut entries[at].2)
            }
            _ => Err(Fault::new("", format!("there is no item {step} in the list"))),
        }
    }

    /// Reads TOML.
    pub fn from_toml(text: &str) -> Result<Node, DesignError> {
        let starts: Vec<usize> = std::iter::once(0)
            .chain(text.bytes().enumerate().filter(|&(_, b)| b == b'\n').map(|(i, _)| i + 1))
            .collect();
        let line = |at: usize| starts.partition_point(|&s| s <= at);
        match toml::de::DeTable::parse(text) {
            Ok(table) => Ok(toml_table(table.get_ref(), &line, 1)),
            Err(e) => Err(DesignError {
                line: e.span().map(|s| line(s.start)),
                ..DesignError::new("", format!("not readable as TOML: {}", e.message().replace('\n', "; ")))
            }),
        }
    }

    /// The line of every path in the tree.
    pub fn lines(&self) -> LineNumbers {
        let mut lines = LineNumbers::default();
        self.collect("", &mut lines);
        lines
    }

    fn collect(&self, path: &str, lines: &mut LineNumbers) {
        match &self.value {
            Value::List(items) => {
                for (i, item) in items.iter().enumerate() {
                    let path = format!("{path}[{i}]");
                    lines.put(&path, item.line);
                    item.collect(&path, lines);
                }
            }
            Value::Table(entries) => {
                for (key, line, item) in entries {
                    let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                    lines.put(&path, *line);
                    item.collect(&path, lines);
                }
            }
            _ => {}
        }
    }
}

/// Where each path of a design stands in its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineNumbers(BTreeMap<String, usize>);

impl LineNumbers {
    fn put(&mut self, path: &str, line: Option<usize>) {
        if let Some(line) = line {
            self.0.insert(path.to_string(), line);
        }
    }

    /// The line of `path`, or of the nearest table above it that stands in the file.
    pub fn line(&self, path: &str) -> Option<usize> {
        let mut path = path;
        loop {
            if let Some(&line) = self.0.get(path) {
                return Some(line);
            }
            path = &path[..path.rfind(['.', '['])?];
        }
    }
}

fn toml_table(table: &toml::de::DeTable<'_>, line: &dyn Fn(usize) -> usize, at: usize) -> Node {
    let mut entries: Vec<_> = table
        .iter()
        .map(|(k, v)| {
            let l = line(k.span().start);
            (k.span().start, (k.get_ref().to_string(), Some(l), toml_value(v, line)))
        })
        .collect();
    entries.sort_by_key(|e| e.0); // in the order of the file, so that the first mistake is reported first
    Node { value: Value::Table(entries.into_iter().map(|e| e.1).collect()), line: Some(at) }
}

fn toml_value(v: &toml::Spanned<toml::de::DeValue<'_>>, line: &dyn Fn(usize) -> usize) -> Node {
    use toml::de::DeValue;
    let at = line(v.span().start);
    let value = match v.get_ref() {
        DeValue::String(s) => Value::Text(s.to_string()),
        DeValue::Integer(i) => {
            i64::from_str_radix(i.as_str(), i.radix()).map_or(Value::Other(i.to_string()), |i| Value::Number(i as f64))
        }
        DeValue::Float(f) => f.as_str().replace('_', "").parse().map_or(Value::Other(f.to_string()), Value::Number),
        DeValue::Boolean(b) => Value::Bool(*b),
        DeValue::Datetime(d) => Value::Other(format!("the date {d}")),
        DeValue::Array(items) => Value::List(items.iter().map(|i| toml_value(i, line)).collect()),
        DeValue::Table(t) => return toml_table(t, line, at),
    };
    Node { value, line: Some(at) }
}

/// A node in a few words, for messages.
pub(super) fn describe(node: &Node) -> String {
    match &node.value {
        Value::Bool(b) => b.to_string(),
        Value::Number(v) => number(*v),
        Value::Whole(v) => v.to_string(),
        Value::Text(s) if s.chars().count() <= 60 => format!("\"{s}\""),
        Value::Text(s) => format!("\"{}…\"", s.chars().take(57).collect::<String>()),
        Value::List(items) => format!("a list of {}", items.len()),
        Value::Table(t) if t.is_empty() => "an empty table".into(),
        Value::Table(t) => format!("a table with {}", t.iter().map(|e| e.0.as_str()).collect::<Vec<_>>().join(", ")),
        Value::Other(s) => s.clone(),
    }
}
