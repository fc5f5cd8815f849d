//! JSON Schemas (draft 2020-12) of kinds.
//!
//! In addition to the standard's words: `x-unit`, the unit of a number; `x-type`, the name of a type that is written out in place;
//! `x-keyword`, where the keyword arguments of the Python builder begin.

use super::{Key, Kind, Node, Table, Value};

/// The types that have names, in the order in which they are first met.
#[derive(Default)]
pub(crate) struct Defs(Vec<(String, Node)>);

impl Defs {
    /// A reference to the schema of `T`, which is made when it is first asked for.
    pub fn named(&mut self, name: &str, make: impl FnOnce(&mut Defs) -> Node) -> Node {
        if !self.0.iter().any(|d| d.0 == name) {
            let place = self.0.len();
            self.0.push((name.to_string(), Value::Table(Vec::new()).into()));
            self.0[place].1 = make(self);
        }
        Node::table([("$ref", format!("#/$defs/{name}").as_str().into())])
    }

    /// The value of `$defs`.
    pub fn into_node(self) -> Node {
        Value::Table(self.0.into_iter().map(|(name, node)| (name, None, node)).collect()).into()
    }
}

/// A table whose keys are being collected.
#[derive(Default)]
pub(crate) struct Open {
    properties: Vec<(String, Option<usize>, Node)>,
    required: Vec<Node>,
    choices: Vec<Node>,
}

impl Open {
    /// The keys of `T`.
    pub fn of<T: Table>(defs: &mut Defs) -> Open {
        let mut out = Open::default();
        T::open(defs, &mut out);
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

    /// Adds alternatives, of which one holds.
    pub fn choices(&mut self, choices: Vec<Node>) {
        self.choices.extend(choices);
    }

    fn node(self) -> Node {
        let mut node = Node::table([("type", "object".into())]);
        if !self.properties.is_empty() {
            node = node.with("properties", Value::Table(self.properties).into());
        }
        if !self.required.is_empty() {
            node = node.with("required", self.required.into());
        }
        if !self.choices.is_empty() {
            node = node.with("oneOf", exclusive(self.choices).into());
        }
        node
    }

    /// One of several alternatives.
    pub fn part(self, doc: &str, own: &str) -> Node {
        self.node().described(if doc.is_empty() { own } else { doc })
    }

    /// The table on its own: it has no other keys.
    pub fn closed(self, doc: &str) -> Node {
        let closed = if self.choices.is_empty() { "additionalProperties" } else { "unevaluatedProperties" };
        self.node().described(doc).with(closed, false.into())
    }
}

impl Node {
    /// A schema with a description, if there is one to give.
    pub(crate) fn described(self, doc: &str) -> Node {
        if doc.is_empty() { self } else { self.with("description", doc.into()) }
    }
}

/// The alternatives, of which one without required keys is fulfilled only if no other is.
fn exclusive(mut choices: Vec<Node>) -> Vec<Node> {
    let required = |c: &Node| c.entries().find(|e| e.0 == "required").map(|e| e.1.clone());
    let others: Vec<Node> = choices.iter().filter_map(required).map(|keys| Node::table([("required", keys)])).collect();
    for free in choices.iter_mut().filter(|c| required(c).is_none()) {
        let any = Node::table([("anyOf", others.clone().into())]);
        *free = std::mem::replace(free, Value::Table(Vec::new()).into()).with("not", any);
    }
    choices
}

/// One word of a choice.
pub(crate) fn word_schema(key: &Key) -> Node {
    Node::table([("const", key.name.into())]).described(key.doc)
}

/// One table of a choice.
pub(crate) fn named_schema<T: Kind>(key: Key, defs: &mut Defs) -> Node {
    let doc = if key.doc.is_empty() { T::DOC } else { key.doc };
    let part = named_part::<T>(Key { doc: "", ..key }, defs);
    part.described(doc).with("additionalProperties", false.into())
}

/// One key of a choice, in a table with other keys.
pub(crate) fn named_part<T: Kind>(key: Key, defs: &mut Defs) -> Node {
    let mut open = Open::default();
    open.property::<T>(Key { required: true, ..key }, None, defs);
    open.node()
}

/// One of several kinds.
pub(crate) fn choice_schema(doc: &str, choices: Vec<Node>) -> Node {
    Node::table([("oneOf", choices.into())]).described(doc)
}

/// A value of one of several types.
pub(crate) fn any_schema(doc: &str, choices: Vec<Node>) -> Node {
    Node::table([("anyOf", choices.into())]).described(doc)
}
