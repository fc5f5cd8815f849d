//! The tree that every text of a design becomes first, and the cursor that reads it with a path at hand.

use std::collections::BTreeMap;

use super::error::DesignError;
use geometry::fault::{counted, nearest, number};

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
    /// Any number; NaN and infinities are told apart when they are used.
    Number(f64),
    /// Text.
    Text(String),
    /// A list.
    List(Vec<Node>),
    /// Keys and values; the key's own line beside each.
    Table(Vec<(String, Option<usize>, Node)>),
    /// Something a design has no use for (null, a date); named by the text.
    Other(String),
}

impl From<Value> for Node {
    fn from(value: Value) -> Node {
        Node { value, line: None }
    }
}

impl Node {
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

    /// Reads JSON.
    pub fn from_json(text: &str) -> Result<Node, DesignError> {
        super::json::read(text)
    }

    /// The line of every path in the tree.
    pub(super) fn lines(&self) -> Lines {
        let mut lines = Lines::default();
        self.collect("", &mut lines);
        lines
    }

    fn collect(&self, path: &str, lines: &mut Lines) {
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
pub struct Lines(BTreeMap<String, usize>);

impl Lines {
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

/// A node and the path that leads to it.
#[derive(Clone)]
pub(super) struct At<'a> {
    pub node: &'a Node,
    pub path: String,
    line: Option<usize>,
}

impl<'a> At<'a> {
    pub fn root(node: &'a Node) -> Self {
        At { node, path: String::new(), line: None }
    }

    fn below(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_string() } else { format!("{}.{key}", self.path) }
    }

    /// An error here.
    pub fn error(&self, message: impl Into<String>) -> DesignError {
        DesignError {
            line: self.line.or(self.node.line),
            found: Some(describe(self.node)),
            ..DesignError::new(&self.path, message)
        }
    }

    /// "expected X, found Y".
    pub fn expected(&self, what: &str) -> DesignError {
        let found = describe(self.node);
        self.error(format!("expected {what}, found {found}"))
    }

    fn unknown(&self, what: &str, word: &str, allowed: &[&str]) -> DesignError {
        let line = self.line.or(self.node.line);
        DesignError { line, ..DesignError::unknown(&self.path, what, word, allowed) }
    }

    /// The entries of a table with any keys.
    pub fn entries(&self, what: &str) -> Result<Vec<(&'a str, At<'a>)>, DesignError> {
        let Value::Table(entries) = &self.node.value else {
            return Err(self.expected(what));
        };
        Ok(entries.iter().map(|(k, line, node)| (k.as_str(), At { node, path: self.below(k), line: *line })).collect())
    }

    /// The entries of a table whose keys are all among `allowed`.
    pub fn fields(&self, what: &str, allowed: &[&str]) -> Result<Fields<'a>, DesignError> {
        let what = format!("{what} (a table with {})", allowed.join(", "));
        let entries = self.entries(&what)?;
        for (key, at) in &entries {
            if !allowed.contains(key) {
                return Err(at.unknown("key", key, allowed));
            }
        }
        Ok(Fields { at: self.clone(), entries })
    }

    /// The one kind named by a table with one key.
    pub fn kind(&self, what: &str, allowed: &[&str]) -> Result<(&'a str, At<'a>), DesignError> {
        let entries = self.entries(&format!("a {what} as a table named by its kind: {}", allowed.join(", ")))?;
        for (key, at) in &entries {
            if !allowed.contains(key) {
                return Err(at.unknown(what, key, allowed));
            }
        }
        let mut entries = entries.into_iter();
        match (entries.next(), entries.next()) {
            (Some(one), None) => Ok(one),
            (None, _) => Err(self.error(format!("a {what} is missing here; give one of {}", allowed.join(", ")))),
            (Some(a), Some(b)) => {
                Err(b.1.error(format!("two kinds of {what} at once, {} and {}; give exactly one", a.0, b.0)))
            }
        }
    }

    pub fn text(&self, what: &str) -> Result<&'a str, DesignError> {
        match &self.node.value {
            Value::Text(s) => Ok(s),
            _ => Err(self.expected(what)),
        }
    }

    /// One of the words.
    pub fn word<T: Copy>(&self, what: &str, words: &[(&str, T)]) -> Result<T, DesignError> {
        self.word_or(what, words, &[])
    }

    /// One of the words; `meant` are words that others use, each with the one to use here.
    pub fn word_or<T: Copy>(
        &self,
        what: &str,
        words: &[(&str, T)],
        meant: &[(&str, &'static str)],
    ) -> Result<T, DesignError> {
        let names: Vec<&str> = words.iter().map(|w| w.0).collect();
        let word = self.text(&format!("one of {}", names.join(", ")))?;
        if let Some(hit) = words.iter().find(|w| w.0 == word) {
            return Ok(hit.1);
        }
        let near = nearest(word, meant.iter().map(|m| m.0));
        let near = near.and_then(|n| meant.iter().find(|m| m.0 == n));
        Err(match (near, nearest(word, names.iter().copied())) {
            (Some((_, right)), None) => DesignError {
                line: self.line.or(self.node.line),
                ..DesignError::unknown_but(&self.path, what, word, &names, Some(*right))
            },
            _ => self.unknown(what, word, &names),
        })
    }

    pub fn number(&self) -> Result<f64, DesignError> {
        match &self.node.value {
            Value::Number(v) => Ok(*v),
            Value::Table(t) if t.first().is_some_and(|e| GRADES.contains(&e.0.as_str())) => {
                let of_map = [".map.affine.", ".map.spartan."];
                Err(self.error(match of_map.iter().any(|m| self.path.contains(m)) {
                    true => {
                        "this map is the same everywhere; map.phase takes a wavelength and an orientation that vary"
                    }
                    false => "this number cannot vary in space; give one number",
                }))
            }
            _ => Err(self.expected("a number")),
        }
    }

    pub fn truth(&self) -> Result<bool, DesignError> {
        match &self.node.value {
            Value::Bool(b) => Ok(*b),
            _ => Err(self.expected("true or false")),
        }
    }

    pub fn list(&self, what: &str) -> Result<Vec<At<'a>>, DesignError> {
        let Value::List(items) = &self.node.value else {
            return Err(self.expected(what));
        };
        let item = |(i, node): (usize, &'a Node)| At { node, path: format!("{}[{i}]", self.path), line: node.line };
        Ok(items.iter().enumerate().map(item).collect())
    }

    pub fn numbers<const N: usize>(&self, what: &str) -> Result<[f64; N], DesignError> {
        let items = self.list(what)?;
        if items.len() != N {
            let found = counted(items.len(), "value");
            return Err(self.error(format!("expected {what}, found {found}")));
        }
        let mut out = [0.0; N];
        for (o, item) in out.iter_mut().zip(&items) {
            *o = item.number()?;
        }
        Ok(out)
    }

    pub fn is_list(&self) -> bool {
        matches!(self.node.value, Value::List(_))
    }

    pub fn is_number(&self) -> bool {
        matches!(self.node.value, Value::Number(_))
    }

    pub fn is_text(&self) -> bool {
        matches!(self.node.value, Value::Text(_))
    }
}

/// The kinds of grade in this version.
pub(super) const GRADES: [&str; 11] =
    ["linear", "depth", "radial", "formula", "grid", "points", "field", "sigmoid", "region", "distance", "rbf"];

/// A table whose keys are known to be allowed.
pub(super) struct Fields<'a> {
    pub at: At<'a>,
    entries: Vec<(&'a str, At<'a>)>,
}

impl<'a> Fields<'a> {
    pub fn get(&self, key: &str) -> Option<&At<'a>> {
        self.entries.iter().find(|e| e.0 == key).map(|e| &e.1)
    }

    pub fn need(&self, key: &str, meaning: &str) -> Result<&At<'a>, DesignError> {
        self.get(key)
            .ok_or_else(|| DesignError { found: None, ..self.at.error(format!("\"{key}\" is missing: {meaning}")) })
    }

    pub fn read<T>(
        &self,
        key: &str,
        default: T,
        read: impl FnOnce(&At<'a>) -> Result<T, DesignError>,
    ) -> Result<T, DesignError> {
        self.get(key).map_or(Ok(default), read)
    }
}

/// What a node is, in a few words.
fn describe(node: &Node) -> String {
    match &node.value {
        Value::Bool(b) => b.to_string(),
        Value::Number(v) => number(*v),
        Value::Text(s) if s.chars().count() <= 60 => format!("\"{s}\""),
        Value::Text(s) => format!("\"{}…\"", s.chars().take(57).collect::<String>()),
        Value::List(items) => format!("a list of {}", items.len()),
        Value::Table(t) if t.is_empty() => "an empty table".into(),
        Value::Table(t) => format!("a table with {}", t.iter().map(|e| e.0.as_str()).collect::<Vec<_>>().join(", ")),
        Value::Other(s) => s.clone(),
    }
}
