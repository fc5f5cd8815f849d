"""The kinds of a design as schema/design.json declares them: what the builders and the reference page are made from."""

import json
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCHEMA = json.loads((ROOT / "schema" / "design.json").read_text(encoding="utf-8"))


def resolved(schema):
    """The definition that a reference names, or the schema itself."""
    return SCHEMA["$defs"][schema["$ref"].rsplit("/", 1)[-1]] if "$ref" in schema else schema


def words(schema):
    """The words that a value may be, if it can be nothing else."""
    of = resolved(schema)
    parts = of.get("oneOf", [])
    if parts and all("const" in p for p in parts):
        return [p["const"] for p in parts]
    return of.get("enum", [])


def limits(schema):
    """The allowed numbers in words."""
    of = resolved(schema)
    while of.get("type") == "array":
        of = resolved(of["items"])
    while "anyOf" in of:
        of = resolved(of["anyOf"][0])
    names = {"exclusiveMinimum": "above", "minimum": "from", "exclusiveMaximum": "below", "maximum": "to"}
    return " ".join(f"{word} {of[key]:g}" for key, word in names.items() if key in of)


def alternatives(table):
    """The sets of keys of which one is given."""
    parts = table.get("oneOf", []) + table.get("anyOf", []) if table.get("type") == "object" else []
    return [part for part in parts if "properties" in part]


def keys(table):
    """The keys of a table and of its alternatives: name, schema, whether it must be given, number of the alternative."""
    for number, part in enumerate([table, *alternatives(table)]):
        for name, schema in part.get("properties", {}).items():
            yield name, schema, name in part.get("required", []), number
