"""The kinds of a design as schema/design.json declares them: what the builders and the reference page are made from."""

import json
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCHEMA = json.loads((ROOT / "schema" / "design.json").read_text(encoding="utf-8"))


def resolved(schema):
    """The definition that a reference names, or the schema itself."""
    return SCHEMA["$defs"][schema["$ref"].rsplit("/", 1)[-1]] if "$ref" in schema else schema


def types(schema):
    """The JSON types that a value may have."""
    kinds = schema.get("type", "string" if "enum" in schema else "anything")
    return [kinds] if isinstance(kinds, str) else kinds


def words(schema):
    """The words that a value may be, if it can be nothing else."""
    return resolved(schema).get("enum", [])


def listed(schema):
    """The words that a value may be, perhaps beside other values: each with its meaning."""
    of = schema if "enum" in schema else resolved(schema.get("then", {}))
    return list(zip(of["enum"], of["x-taplo"]["docs"]["enumValues"], strict=True)) if "x-taplo" in of else []


def kinds(schema):
    """The kinds of a choice: name and schema of each."""
    return list(schema["properties"].items()) if schema.get("maxProperties") == 1 else []


def limits(schema):
    """The allowed numbers in words."""
    of = resolved(schema)
    while "array" in types(of) and "number" not in types(of):
        of = resolved(of["items"])
    names = {"exclusiveMinimum": "above", "minimum": "from", "exclusiveMaximum": "below", "maximum": "to"}
    return " ".join(f"{word} {of[key]:g}" for key, word in names.items() if key in of)


def alternatives(table):
    """The sets of keys of which one is given: of each its ``keys`` and those ``required``."""
    return table.get("x-alternatives", [])


def keys(table):
    """The keys of a table and of its alternatives: name, schema, whether it must be given, number of the alternative."""
    properties, needed = table.get("properties", {}), table.get("required", [])
    several = {name for part in alternatives(table) for name in part["keys"]}
    parts = [{"keys": [name for name in properties if name not in several], "required": needed}, *alternatives(table)]
    for number, part in enumerate(parts):
        for name in part["keys"]:
            yield name, properties[name], name in part["required"], number
