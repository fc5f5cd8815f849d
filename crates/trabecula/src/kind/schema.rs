//! JSON Schemas (draft 2020-12) of kinds.
//!
//! Validators and editors say one clear thing where each keyword stands for one value, so there is no `oneOf`: a table of kinds
//! has an optional key for each kind and exactly one of them; `if` decides which of several sets of keys is meant; and a
//! value of one of several JSON types has the keywords of all (`one_of_types`). Editors that know draft 7 alone read the same.
//!
//! In addition to the standard's words: `x-unit`, the unit of a number; `x-type`, the name of a type that is written out in place;
//! `x-keyword`, where the keyword arguments of the Python builder begin; `x-alternatives`, the sets of keys of which one is given;
//! `x-kind`, the definition whose keys a table written out in place has; `x-taplo`, the meaning of each word of `enum`, as Taplo
//! shows it.

use super::schema_defs::Defs;
use super::schema_types::{merged, one_of_types};
use super::{Choice, Key, Kind, Node, Table, Value};

impl Defs {
    /// The value of `$defs`.
    pub fn into_node(self) -> Node {
        let all = self.0.iter().map(|(name, node)| (name.clone(), None, one_of_types(node, &self)));
        Value::Table(all.collect()).into()
    }
}

/// A table whose keys are being collected.
#[derive(Default)]
pub(crate) struct OpenTable {
    doc: &'static str,
    properties: Vec<(String, Option<usize>, Node)>,
    required: Vec<Node>,
    choices: Vec<OpenTable>,
}

impl OpenTable {
    /// The keys of `T`.
    pub fn of<T: Table>(defs: &mut Defs) -> OpenTable {
        let mut out = OpenTable { doc: T::DOC, ..OpenTable::default() };
        T::open(defs, &mut out);
        out
    }

    /// The one key of a kind in a choice.
    pub fn named<T: Kind>(key: Key, defs: &mut Defs) -> OpenTable {
        let doc = if key.doc.is_empty() { T::DOC } else { key.doc };
        let mut out = OpenTable { doc, ..OpenTable::default() };
        out.property::<T>(Key { doc, required: true, ..key }, None, defs);
        out
    }

    /// Adds a key.
    pub fn property<T: Kind>(&mut self, key: Key, default: Option<Node>, defs: &mut Defs) {
        let mut node = T::schema(&key, defs).described(key.doc);
        if !key.unit.is_empty() {
            node = node.with("x-unit", key.unit.into());
        }
        if key.keyword {
            node = node.with("x-keyword", true.into());
        }
        if let Some(default) = default {
            node = node.with("default", default);
        }
        if key.required {
            self.required.push(key.name.into());
        }
        self.properties.push((key.name.to_string(), None, node));
    }

    /// Adds sets of keys, of which one is given.
    pub fn choices(&mut self, choices: Vec<OpenTable>) {
        self.choices.extend(choices);
    }

    /// The same with another description, if there is one to give.
    pub fn described(self, doc: &'static str) -> OpenTable {
        if doc.is_empty() { self } else { OpenTable { doc, ..self } }
    }

    /// The table: it has no other keys.
    pub fn closed(mut self) -> Node {
        for choice in &mut self.choices {
            let new = |p: &&(String, _, _)| !self.properties.iter().any(|own| own.0 == p.0);
            let added: Vec<_> = choice.properties.iter().filter(new).cloned().collect();
            self.properties.extend(added);
        }
        let conditions = match &self.choices[..] {
            [] => None,
            [one] => {
                self.required.extend(one.required.iter().cloned());
                None
            }
            [first, others @ ..] => Some(self.told_apart(first, others)),
        };
        // A validator names the first of what is wrong, which is an unknown key rather than the one that it should have been.
        let mut node =
            Node::table([("type", "object".into())]).described(self.doc).with("additionalProperties", false.into());
        if !self.properties.is_empty() {
            let properties = self.properties.clone();
            node = node.with("properties", Value::Table(properties).into());
        }
        if !self.required.is_empty() {
            node = node.with("required", self.required.clone().into());
        }
        let Some(conditions) = conditions else { return node };
        let alternatives: Vec<Node> = self.choices.iter().map(OpenTable::alternative).collect();
        let node = node.with("x-alternatives", alternatives.into());
        conditions.entries().fold(node, |node, (key, of)| node.with(key, of.clone()))
    }

    fn keys(&self) -> impl Iterator<Item = &str> {
        self.properties.iter().map(|p| p.0.as_str())
    }

    /// Its keys, as one of several sets.
    fn alternative(&self) -> Node {
        let keys = self.keys().map(Node::from).collect::<Vec<_>>();
        Node::table([("keys", keys.into()), ("required", self.required.clone().into())]).described(self.doc)
    }

    /// The set of which a needed key is given is the one that is meant; if there is none, the first.
    fn told_apart(&self, first: &OpenTable, others: &[OpenTable]) -> Node {
        others.iter().rev().fold(self.only(first), |rest, other| {
            let given = |key: &Node| Node::table([("required", vec![key.clone()].into())]);
            let mut given: Vec<Node> = other.required.iter().map(given).collect();
            let given = if given.len() == 1 { given.remove(0) } else { Node::table([("anyOf", given.into())]) };
            Node::table([("if", given), ("then", self.only(other)), ("else", rest)])
        })
    }

    /// What holds where one set is meant: its needed keys are there, and those of others are not.
    fn only(&self, meant: &OpenTable) -> Node {
        let foreign =
            |key: &&str| !meant.keys().any(|k| k == *key) && self.choices.iter().any(|c| c.keys().any(|k| k == *key));
        let foreign = self.keys().filter(foreign).map(|key| (key.to_string(), None, false.into())).collect();
        // It is a table anyway; jsonschema's `best_match` takes an error for less relevant where the type is not said.
        let node = Node::table([("type", "object".into()), ("properties", Value::Table(foreign).into())]);
        if meant.required.is_empty() { node } else { node.with("required", meant.required.clone().into()) }
    }
}

impl Node {
    /// A schema with a description, if there is one to give.
    pub(crate) fn described(self, doc: &str) -> Node {
        if doc.is_empty() { self } else { self.with("description", doc.into()) }
    }
}

/// Words, each with its meaning.
fn words_schema(words: &[Key]) -> Node {
    let meanings: Vec<Node> = words.iter().map(|w| w.doc.into()).collect();
    let docs = Node::table([("docs", Node::table([("enumValues", meanings.into())]))]);
    Node::table([("enum", words.iter().map(|w| w.name.into()).collect::<Vec<Node>>().into()), ("x-taplo", docs)])
}

/// One of several kinds: a word, or a table with one of the keys of `tables`.
pub(crate) fn choice_schema(doc: &str, choices: &[Choice], tables: Vec<OpenTable>) -> Node {
    let words: Vec<Key> = choices.iter().filter(|c| c.word).map(|c| c.key).collect();
    if tables.is_empty() {
        return words_schema(&words).with("type", "string".into()).described(doc);
    }
    let kinds = tables.into_iter().flat_map(|t| t.properties).collect();
    let table = Node::table([("type", "object".into()), ("additionalProperties", false.into())])
        .with("properties", Value::Table(kinds).into())
        .with("minProperties", Value::Whole(1).into())
        .with("maxProperties", Value::Whole(1).into());
    if words.is_empty() { table.described(doc) } else { merged(&[words_schema(&words), table]).described(doc) }
}

/// A value of one of several types.
pub(crate) fn any_schema(doc: &str, choices: Vec<Node>) -> Node {
    Node::table([("anyOf", choices.into())]).described(doc)
}
