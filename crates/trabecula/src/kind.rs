//! Kinds: what can stand in a design, each declared once.
//!
//! A kind is a struct or an enum with `#[derive(Kind)]`. Its doc comments, types, units, limits and defaults are the only
//! declaration: from them come the reader, which names path and line, the writer, the checks of ranges, and the JSON Schema,
//! from which the Python builders and the reference page are made. CONTRIBUTING.md says how to add one.

mod error;
mod json;
mod node;
mod node_cursor;
mod schema;
mod schema_defs;
mod schema_types;
mod values;

pub use error::{DesignError, Warning};
pub use kind_derive::Kind;
pub use node::{LineNumbers, Node, Value};
pub(crate) use node_cursor::{Fields, NodeCursor};
pub(crate) use schema::{OpenTable, any_schema, choice_schema};
pub(crate) use schema_defs::Defs;
pub use values::{OneOrThree, OneOrTwo, Unit};

pub use geometry::fault::Fault;
use geometry::fault::number;

/// Anything that can stand in a design.
pub(crate) trait Kind: Sized {
    /// Its doc comment.
    const DOC: &'static str = "";

    /// A noun phrase for "expected …".
    fn expected() -> String;

    /// How well a value fits by its type: 0 not at all, 1 by type, 2 by its number of items too.
    fn fits(node: &Node) -> u8;

    /// Reads it. Keys, words and types are checked; ranges by `check`.
    fn read(at: &NodeCursor) -> Result<Self, DesignError>;

    /// Writes it; keys that have their defaults are left out.
    fn write(&self) -> Node;

    /// Checks the declared ranges: those of `key`, under which it stands, and those of its own keys.
    fn check(&self, key: &Key) -> Result<(), Fault>;

    /// Its JSON Schema, as the value of `key`; types with names go to `defs`.
    fn schema(key: &Key, defs: &mut Defs) -> Node;

    /// Checks the ranges of its own keys.
    fn valid(&self) -> Result<(), Fault> {
        self.check(&Key::NONE)
    }
}

/// A kind that is a table of known keys, so that these can stand in the table of another.
pub(crate) trait Table: Kind {
    /// Its keys.
    fn keys() -> Vec<Key>;

    /// Reads it from a table that may have other keys.
    fn from_fields(fields: &Fields) -> Result<Self, DesignError>;

    /// Adds its keys and values to a table.
    fn put(&self, out: &mut Vec<(String, Option<usize>, Node)>);

    /// Adds its keys to the schema of a table.
    fn open(defs: &mut Defs, out: &mut OpenTable);
}

/// A key: what is declared of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Key {
    pub name: &'static str,
    pub doc: &'static str,
    pub unit: &'static str,
    /// Numbers are greater than this.
    pub above: f64,
    /// Numbers are less than this.
    pub below: f64,
    /// The least number allowed.
    pub min: f64,
    /// The greatest number allowed.
    pub max: f64,
    /// The least number of items of a list or map.
    pub least: usize,
    pub required: bool,
    /// Whether this and later keys are keyword arguments in Python.
    pub keyword: bool,
    /// Words that others use for it.
    pub hints: &'static [&'static str],
}

/// One of several kinds: a word, or the key of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Choice {
    pub key: Key,
    pub word: bool,
}

impl Key {
    /// A key of which nothing is known.
    pub const NONE: Key = Key {
        name: "",
        doc: "",
        unit: "",
        above: f64::NEG_INFINITY,
        below: f64::INFINITY,
        min: f64::NEG_INFINITY,
        max: f64::INFINITY,
        least: 0,
        required: false,
        keyword: false,
        hints: &[],
    };

    /// The first sentence of its doc comment, with the unit, for messages.
    pub fn meaning(&self) -> String {
        let end = self.doc.find(". ").unwrap_or(self.doc.len());
        let mut letters = self.doc[..end].trim_end_matches('.').chars();
        let first = letters.next().map(|c| c.to_lowercase().to_string()).unwrap_or_default();
        let unit = if self.unit.is_empty() { String::new() } else { format!(", {}", self.unit) };
        format!("{first}{}{unit}", letters.as_str())
    }

    /// The numbers that it allows, in words; `None` if any finite one is.
    pub fn allowed(&self) -> Option<String> {
        let above = self.above.is_finite().then(|| format!("greater than {}", number(self.above)));
        let min = self.min.is_finite().then(|| format!("at least {}", number(self.min)));
        let below = self.below.is_finite().then(|| format!("less than {}", number(self.below)));
        let max = self.max.is_finite().then(|| format!("at most {}", number(self.max)));
        match (above.or(min), below.or(max)) {
            (Some(low), Some(high)) => Some(format!("{low} and {high}")),
            (low, high) => low.or(high),
        }
    }

    /// Refuses a number that is not finite or outside the limits.
    pub fn admit(&self, v: f64) -> Result<(), Fault> {
        self.admit_at(v, "")
    }

    /// The same of a number at a `position`, such as " at position 3".
    pub fn admit_at(&self, v: f64, position: &str) -> Result<(), Fault> {
        let inside = v > self.above && v < self.below && v >= self.min && v <= self.max;
        if v.is_finite() && inside {
            return Ok(());
        }
        let name = if self.name.is_empty() { "the number" } else { self.name };
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        let finite = if v.is_finite() { None } else { Some("finite".to_string()) };
        let allowed = finite.into_iter().chain(self.allowed()).collect::<Vec<_>>().join(" and ");
        let share = (self.above, self.below) == (0.0, 1.0) && (2.0..=100.0).contains(&v);
        let hint =
            if share { format!(" (for {} per cent write {})", number(v), number(v / 100.0)) } else { String::new() };
        let message = format!("{name} is {}{unit}{position}; it must be {allowed}{hint}", number(v));
        Err(Fault::new("", message).found(number(v)))
    }
}

/// "a ball (a table with radius, center)".
pub(crate) fn expected_table(noun: &str, keys: &[Key]) -> String {
    format!("{noun} (a table with {})", keys.iter().map(|k| k.name).collect::<Vec<_>>().join(", "))
}

/// "a region as a table named by its kind: box, sphere", "one of re, im", or both.
pub(crate) fn expected_choice(noun: &str, choices: &[Choice]) -> String {
    let names =
        |word: bool| choices.iter().filter(|c| c.word == word).map(|c| c.key.name).collect::<Vec<_>>().join(", ");
    match (names(true), names(false)) {
        (words, kinds) if kinds.is_empty() => format!("one of {words}"),
        (words, kinds) if words.is_empty() => format!("a {noun} as a table named by its kind: {kinds}"),
        (words, kinds) => format!("one of {words}, or a table with one of {kinds}"),
    }
}

/// How well a value fits a choice.
pub(crate) fn fits_choice(node: &Node, choices: &[Choice]) -> u8 {
    let of = |word: bool| choices.iter().filter(move |c| c.word == word).map(|c| c.key.name);
    match &node.value {
        Value::Text(_) => u8::from(of(true).next().is_some()),
        Value::Table(_) if of(false).next().is_some() => fits_table(node, of(false)),
        _ => 0,
    }
}

/// How well a value fits a table of some keys: better with one of them.
pub(crate) fn fits_table<'a>(node: &Node, mut keys: impl Iterator<Item = &'a str>) -> u8 {
    let Value::Table(entries) = &node.value else { return 0 };
    1 + u8::from(keys.any(|k| entries.iter().any(|(key, ..)| key == k)))
}

/// The keys of all of `sets`, each once.
pub(crate) fn union_of_keys(sets: Vec<Vec<Key>>) -> Vec<Key> {
    let mut keys: Vec<Key> = Vec::new();
    for key in sets.into_iter().flatten() {
        if !keys.iter().any(|k| k.name == key.name) {
            keys.push(key);
        }
    }
    keys
}
