//! The definitions of a JSON Schema, which its references name.

use super::{Node, Value};

/// The types that have names, in the order in which they are first met.
#[derive(Default)]
pub(crate) struct Defs(pub(super) Vec<(String, Node)>);

impl Defs {
    /// A reference to the schema of `T`, which is made when it is first asked for.
    pub fn named(&mut self, name: &str, make: impl FnOnce(&mut Defs) -> Node) -> Node {
        if !self.0.iter().any(|d| d.0 == name) {
            let place = self.0.len();
            self.0.push((name.to_string(), Value::Table(Vec::new()).into()));
            self.0[place].1 = make(self);
        }
        reference(name)
    }

    /// The definition that a reference names, with its name.
    pub(super) fn resolve<'a>(&'a self, reference: &'a Node) -> Option<(&'a str, &'a Node)> {
        let name = reference.get("$ref")?.as_text()?.rsplit('/').next()?;
        self.0.iter().find(|d| d.0 == name).map(|d| (name, &d.1))
    }
}

/// A reference to a definition.
pub(super) fn reference(name: &str) -> Node {
    Node::table([("$ref", format!("#/$defs/{name}").as_str().into())])
}
