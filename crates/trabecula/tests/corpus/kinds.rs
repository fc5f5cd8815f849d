//! Every alternative that the schema of a design offers stands in some design of the corpus.

use std::collections::BTreeSet;

use serde_json::Value as Json;
use trabecula::design::schema;

use super::corpus;

/// Alternatives without a design, and why.
const EXEMPT: [(&str, &str); 4] = [
    ("Sigmoid: number", "a step of a constant is a constant"),
    ("Mesher: ftetwild", "a program of another package"),
    ("Unit: ", "each is a factor"),
    ("Side: ", "six sides of one kind"),
];

/// The schema with its references resolved, and the name of the definition.
fn resolved<'a>(root: &'a Json, of: &'a Json) -> (Option<&'a str>, &'a Json) {
    match of.get("$ref").and_then(Json::as_str).and_then(|r| r.rsplit('/').next()) {
        Some(name) => (Some(name), &root["$defs"][name]),
        None => (None, of),
    }
}

fn alternatives(of: &Json) -> impl Iterator<Item = &Json> {
    ["oneOf", "anyOf"].into_iter().filter_map(|key| of.get(key)?.as_array()).flatten()
}

fn texts<'a>(of: &'a Json, key: &str) -> impl Iterator<Item = &'a str> {
    of.get(key).and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str)
}

/// Whether data has the form of a schema: its type, constant, length and keys, and one of its alternatives.
fn fits(root: &Json, of: &Json, data: &Json) -> bool {
    let (_, of) = resolved(root, of);
    let is = |kind: &str| match kind {
        "object" => data.is_object(),
        "array" => data.is_array(),
        "string" => data.is_string(),
        "number" => data.is_number(),
        "integer" => data.is_i64() || data.is_u64(),
        "boolean" => data.is_boolean(),
        "null" => data.is_null(),
        _ => false,
    };
    let kinds = match of.get("type") {
        Some(Json::String(kind)) => is(kind),
        Some(Json::Array(kinds)) => kinds.iter().filter_map(Json::as_str).any(is),
        _ => true,
    };
    let constant = of.get("const").is_none_or(|c| c == data);
    let listed = of.get("enum").and_then(Json::as_array).is_none_or(|all| all.contains(data));
    let length = |key: &str| of.get(key).and_then(Json::as_u64);
    let count = data.as_array().map_or(0, Vec::len) as u64;
    let long = length("minItems").is_none_or(|n| count >= n) && length("maxItems").is_none_or(|n| count <= n);
    let needed = texts(of, "required").all(|key| data.get(key).is_some());
    let choice = alternatives(of).next().is_none() || alternatives(of).any(|a| fits(root, a, data));
    kinds && constant && listed && long && needed && choice
}

/// What an alternative is called: its constant, the keys that it needs, its definition or its type.
fn name(of: &Json) -> String {
    if let Some(text) = of.get("const").and_then(Json::as_str) {
        return text.to_string();
    }
    let needed: Vec<&str> = texts(of, "required").collect();
    let reference = of.get("$ref").and_then(Json::as_str).and_then(|r| r.rsplit('/').next());
    let kind = of.get("type").and_then(Json::as_str);
    if needed.is_empty() { reference.or(kind).unwrap_or("other").to_string() } else { needed.join(" and ") }
}

/// The alternatives below a schema, by definition and name.
fn offered(root: &Json, of: &Json, at: &str, met: &mut BTreeSet<String>, out: &mut BTreeSet<String>) {
    let (definition, of) = resolved(root, of);
    if definition.is_some_and(|name| !met.insert(name.to_string())) {
        return;
    }
    let at = definition.unwrap_or(at);
    // An optional key is also offered as null.
    for a in alternatives(of).filter(|a| a.get("type").is_none_or(|kind| kind != "null")) {
        out.insert(format!("{at}: {}", name(a)));
        offered(root, a, at, met, out);
    }
    for below in of.get("properties").and_then(Json::as_object).into_iter().flat_map(|p| p.values()) {
        offered(root, below, at, met, out);
    }
    for below in ["items", "additionalProperties"].iter().filter_map(|key| of.get(key)) {
        offered(root, below, at, met, out);
    }
}

/// The alternatives that data makes use of.
fn used(root: &Json, of: &Json, at: &str, data: &Json, out: &mut BTreeSet<String>) {
    let (definition, of) = resolved(root, of);
    let at = definition.unwrap_or(at);
    for a in alternatives(of).filter(|a| fits(root, a, data)) {
        out.insert(format!("{at}: {}", name(a)));
        used(root, a, at, data, out);
    }
    for value in data.as_array().into_iter().flatten() {
        if let Some(below) = of.get("items") {
            used(root, below, at, value, out);
        }
    }
    let Some(keys) = data.as_object() else { return };
    let properties = of.get("properties").and_then(Json::as_object);
    for (key, value) in keys {
        if let Some(below) = properties.and_then(|p| p.get(key)).or_else(|| of.get("additionalProperties")) {
            used(root, below, at, value, out);
        }
    }
    // A key that is left out has its default.
    for (_, below) in properties.into_iter().flatten().filter(|(key, _)| !keys.contains_key(*key)) {
        if let Some(value) = below.get("default").filter(|v| !v.is_null()) {
            used(root, below, at, value, out);
        }
    }
}

#[test]
fn every_kind_has_a_design() {
    let schema: Json = serde_json::from_str(&schema()).expect("JSON");
    let (mut wanted, mut found) = (BTreeSet::new(), BTreeSet::new());
    offered(&schema, &schema, "Design", &mut BTreeSet::new(), &mut wanted);
    for file in std::fs::read_dir(corpus().join("designs")).expect("a folder").flatten() {
        if file.path().extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(file.path()).expect("a design");
            let design: Json = toml::from_str(&text).expect("TOML");
            used(&schema, &schema, "Design", &design, &mut found);
        }
    }
    assert!(wanted.len() > 80, "only {} alternatives were found in the schema", wanted.len());
    let missing: Vec<&String> =
        wanted.difference(&found).filter(|kind| !EXEMPT.iter().any(|(exempt, _)| kind.starts_with(exempt))).collect();
    assert!(missing.is_empty(), "no design of corpus/designs has {missing:#?}");
}
