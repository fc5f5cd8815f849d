//! The JSON Schema of a design, from its declarations.

use super::Design;
use crate::kind::{Defs, Key, Kind, Node, Value};

/// The JSON Schema of a design (draft 2020-12), as text.
pub fn schema() -> String {
    let mut defs = Defs::default();
    Design::schema(&Key::NONE, &mut defs);
    let Value::Table(all) = defs.into_node().value else { return String::new() };
    let (design, rest): (Vec<_>, Vec<_>) = all.into_iter().partition(|d| d.0 == "Design");
    let [(_, _, design)] = &design[..] else { return String::new() };
    let needed = |key: &str| Node::table([("required", vec![Node::from(key)].into())]);
    let schema = Node::table([
        ("$schema", "https://json-schema.org/draft/2020-12/schema".into()),
        ("title", "A Trabecula design".into()),
    ]);
    let schema = design.entries().fold(schema, |schema, (key, node)| schema.with(key, node.clone()));
    let schema =
        schema.with("anyOf", vec![needed("lattice"), needed("beams")].into()).with("$defs", Value::Table(rest).into());
    serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
}
