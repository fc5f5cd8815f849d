//! Kinds within data that is still written by serde and described by schemars.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Serialize, Serializer};

use crate::kind::{Defs, Key, Kind, Node, OneOrThree, OneOrTwo, Unit, Value};
use crate::region::{HalfSpaceKind, RegionKind};

macro_rules! bridge {
    ($($kind:ty),*) => {$(
        impl Serialize for $kind {
            fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                self.write().serialize(to)
            }
        }

        impl JsonSchema for $kind {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                stringify!($kind).into()
            }

            fn inline_schema() -> bool {
                true
            }

            fn json_schema(generator: &mut SchemaGenerator) -> Schema {
                let mut defs = Defs::default();
                let node = serde_json::to_value(<$kind as Kind>::schema(&Key::NONE, &mut defs));
                if let Ok(serde_json::Value::Object(defs)) = serde_json::to_value(defs.into_node()) {
                    generator.definitions_mut().extend(defs);
                }
                node.ok().and_then(|node| Schema::try_from(node).ok()).unwrap_or_default()
            }
        }
    )*};
}
bridge!(RegionKind, HalfSpaceKind, OneOrThree, OneOrTwo, Unit);

/// A JSON value as a tree.
pub(crate) fn node(value: &serde_json::Value) -> Node {
    use serde_json::Value as Json;
    match value {
        Json::Null => Value::Other("null".into()),
        Json::Bool(v) => Value::Bool(*v),
        Json::Number(v) => match v.as_i64() {
            Some(v) => Value::Whole(v),
            None => Value::Number(v.as_f64().unwrap_or(f64::NAN)),
        },
        Json::String(text) => Value::Text(text.clone()),
        Json::Array(items) => Value::List(items.iter().map(node).collect()),
        Json::Object(entries) => Value::Table(entries.iter().map(|(k, v)| (k.clone(), None, node(v))).collect()),
    }
    .into()
}

/// The schemas of kinds in `$defs`, their keys in the order of the declaration.
pub(crate) fn ordered(mut schema: Node) -> Node {
    let mut defs = Defs::default();
    RegionKind::schema(&Key::NONE, &mut defs);
    if let (Value::Table(entries), Value::Table(kinds)) = (&mut schema.value, defs.into_node().value)
        && let Some((_, _, Node { value: Value::Table(all), .. })) = entries.iter_mut().find(|e| e.0 == "$defs")
    {
        for (name, _, of) in all {
            if let Some((_, _, kind)) = kinds.iter().find(|k| k.0 == *name) {
                *of = kind.clone();
            }
        }
    }
    schema
}
