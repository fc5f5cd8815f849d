//! Every alternative that the schema of a design offers stands in some design of the corpus.

use std::collections::BTreeSet;

use serde_json::Value as Json;
use trabecula::design::schema;

use super::corpus;

/// Alternatives without a design, and why.
const EXEMPT: [(&str, &str); 8] = [
    ("Ends: open", "as capped, but for files, which are not closed then"),
    ("Series: string", "a space group, as by its number"),
    ("TetCell: integer", "a space group, as by its symbol"),
    ("Sigmoid: number", "a step of a constant is a constant"),
    ("Mesher: ftetwild", "a program of another package"),
    ("Unit: ", "each is a factor"),
    ("Side: ", "six sides of one kind"),
    ("Axis: ", "three axes of one kind"),
];

/// The schema with its references resolved, and the name of the definition.
fn resolved<'a>(root: &'a Json, of: &'a Json) -> (Option<&'a str>, &'a Json) {
    match of.get("$ref").and_then(Json::as_str).and_then(|r| r.rsplit('/').next()) {
        Some(name) => (Some(name), &root["$defs"][name]),
        None => (None, of),
    }
}

fn texts<'a>(of: &'a Json, key: &str) -> impl Iterator<Item = &'a str> {
    of.get(key).and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_str)
}

/// The JSON types that a schema allows.
fn types(of: &Json) -> Vec<&str> {
    of["type"].as_str().into_iter().chain(texts(of, "type")).collect()
}

fn is(data: &Json, kind: &str) -> bool {
    match kind {
        "object" => data.is_object(),
        "array" => data.is_array(),
        "string" => data.is_string(),
        "number" => data.is_number(),
        "integer" => data.is_i64() || data.is_u64(),
        "boolean" => data.is_boolean(),
        _ => false,
    }
}

/// One of several: what it is called, and whether data makes use of it.
type Alternative<'a> = (String, Box<dyn Fn(&Json) -> bool + 'a>);

/// The alternatives that a schema offers: its words with meanings, its kinds, its sets of keys, its types.
fn alternatives(of: &Json) -> Vec<Alternative<'_>> {
    let mut out: Vec<Alternative> = Vec::new();
    for listed in [of, &of["then"]].into_iter().filter(|s| s.get("x-taplo").is_some()) {
        out.extend(
            texts(listed, "enum").map(|word| -> Alternative { (word.into(), Box::new(move |data| data == word)) }),
        );
    }
    let kinds = of.get("maxProperties").and_then(|_| of["properties"].as_object());
    for key in kinds.filter(|_| of.get("x-kind").is_none()).into_iter().flat_map(|kinds| kinds.keys()) {
        out.push((key.clone(), Box::new(move |data| data.get(key).is_some())));
    }
    for set in of["x-alternatives"].as_array().into_iter().flatten() {
        let needed: Vec<&str> = texts(set, "required").collect();
        let name = if needed.is_empty() { "object".to_string() } else { needed.join(" and ") };
        out.push((name, Box::new(move |data| needed.iter().all(|key| data.get(*key).is_some()))));
    }
    let several = types(of);
    for kind in several.iter().copied().filter(|_| several.len() > 1) {
        let definition = of["x-kind"].as_str().filter(|_| kind == "object");
        out.push((definition.unwrap_or(kind).into(), Box::new(move |data| is(data, kind))));
    }
    out
}

/// The alternatives below a schema, by definition and name.
fn offered(root: &Json, of: &Json, at: &str, met: &mut BTreeSet<String>, out: &mut BTreeSet<String>) {
    let (definition, of) = resolved(root, of);
    if definition.is_some_and(|name| !met.insert(name.to_string())) {
        return;
    }
    let at = definition.unwrap_or(at);
    out.extend(alternatives(of).into_iter().map(|a| format!("{at}: {}", a.0)));
    if let Some(table) = written_out(of) {
        offered(root, &table, at, met, out);
    } else {
        of["properties"].as_object().into_iter().flatten().for_each(|(_, below)| offered(root, below, at, met, out));
    }
    for below in ["items", "additionalProperties", "then"].iter().filter_map(|key| of.get(key)) {
        offered(root, below, at, met, out);
    }
}

/// The definition whose keys stand in a schema.
fn written_out(of: &Json) -> Option<Json> {
    of["x-kind"].as_str().map(|name| serde_json::json!({ "$ref": format!("#/$defs/{name}") }))
}

/// The alternatives that data makes use of.
fn used(root: &Json, of: &Json, at: &str, data: &Json, out: &mut BTreeSet<String>) {
    let (definition, of) = resolved(root, of);
    let at = definition.unwrap_or(at);
    out.extend(alternatives(of).into_iter().filter(|a| (a.1)(data)).map(|a| format!("{at}: {}", a.0)));
    for value in data.as_array().into_iter().flatten() {
        if let Some(below) = of.get("items") {
            used(root, below, at, value, out);
        }
    }
    if let (Some(words), Some(_)) = (of["then"].get("$ref"), data.as_str()) {
        used(root, &of["then"], words.as_str().unwrap_or_default(), data, out);
    }
    let Some(keys) = data.as_object() else { return };
    if let Some(table) = written_out(of) {
        return used(root, &table, at, data, out);
    }
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
