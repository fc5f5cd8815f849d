//! The JSON Schema of a design, generated from the data.

use schemars::{Schema, SchemaGenerator, json_schema};

use super::Design;
use super::bridge;
use crate::cell::catalogue;
use crate::cell::tet::tet_catalogue;

/// The JSON Schema of a design (draft 2020-12), as text.
pub fn schema() -> String {
    let mut v = schemars::schema_for!(Design).to_value();
    v["title"] = "A Trabecula design".into();
    serde_json::to_string_pretty(&bridge::ordered(bridge::node(&v))).unwrap_or_default() + "\n"
}

/// A space group's number or symbol.
pub(super) fn group(_: &mut SchemaGenerator) -> Schema {
    json_schema!({ "type": ["string", "integer"] })
}

/// The names of the ready tetrahedral cells.
pub(super) fn tet_cell_name(_: &mut SchemaGenerator) -> Schema {
    let names: Vec<&str> = tet_catalogue().iter().map(|n| n.name).collect();
    json_schema!({ "type": "string", "enum": names })
}

/// The struts of a pattern.
pub(super) fn pattern_struts(_: &mut SchemaGenerator) -> Schema {
    json_schema!({
        "type": "array",
        "items": { "type": "array", "items": { "type": "integer" }, "minItems": 2, "maxItems": 5 },
    })
}

/// The names of the ready cells of beams.
pub(super) fn beam_cell(_: &mut SchemaGenerator) -> Schema {
    let names: Vec<&str> = beams::graph::catalogue().iter().map(|u| u.name).collect();
    json_schema!({ "type": "string", "enum": names })
}

/// The names of the ready cells.
pub(super) fn cell_name(_: &mut SchemaGenerator) -> Schema {
    let names: Vec<&str> = catalogue().iter().map(|n| n.name).collect();
    json_schema!({ "type": "string", "enum": names })
}
