#!/usr/bin/env python3
"""Writes python/trabecula/reports.py: a class for each report of the core, from its fields and their comments.

With --check nothing is written, and the exit status says whether the file is as it should be.
"""

import json
import sys
import textwrap
from pathlib import Path

from trabecula import _core

FILE = Path(__file__).parent.parent / "python" / "trabecula" / "reports.py"
HEAD = '''"""Reports: figures with their units, one class each. Made by scripts/report_classes.py; do not edit."""

from __future__ import annotations

from .base.record import Report

# ruff: noqa: RUF012  the parts of a class are declared by its base
'''
SIMPLE = {"number": "float", "integer": "int", "string": "str", "boolean": "bool", "null": "None"}


def kind(part):
    """The Python type of a schema, and the class of reports in it, and whether these are by name."""
    if "$ref" in part:
        name = part["$ref"].rsplit("/", 1)[-1]
        return ("float | list[float]", None, False) if name == "Varying" else (name, name, False)
    if "anyOf" in part:
        found = [kind(p) for p in part["anyOf"]]
        return " | ".join(f[0] for f in found), next((f[1] for f in found if f[1]), None), any(f[2] for f in found)
    if isinstance(part.get("type"), list):
        found = [kind(part | {"type": t}) for t in part["type"]]
        return " | ".join(f[0] for f in found), next((f[1] for f in found if f[1]), None), any(f[2] for f in found)
    if part["type"] == "array":
        inner, name, _ = kind(part["items"])
        return f"list[{inner}]", name, False
    if part["type"] == "object":
        inner, name, _ = kind(part["additionalProperties"])
        return f"dict[str, {inner}]", name, name is not None
    return SIMPLE[part["type"]], None, False


def doc(text, indent):
    """A docstring."""
    lines = textwrap.wrap(" ".join(text.split()), 128 - len(indent) - 6)
    return f'{indent}"""' + f"\n{indent}".join(lines) + '"""'


def fields(schema):
    """The properties of a struct, those of flattened ones too, and the names of the needed ones."""
    found, needed = dict(schema.get("properties", {})), set(schema.get("required", []))
    for join in ("anyOf", "allOf"):
        for part in schema.get(join, []):
            if "$ref" in part:
                part = DEFS[part["$ref"].rsplit("/", 1)[-1]]
            for key, value in part.get("properties", {}).items():
                found.setdefault(key, value)
    return found, needed


def written(name, schema):
    """One class."""
    lines = ["", "", f"class {name}(Report):", doc(schema["description"], "    ")]
    properties, needed = fields(schema)
    parts, by_name, body = {}, [], []
    for key, part in properties.items():
        typed, of, named = kind(part)
        if of:
            parts[key] = of
        if named:
            by_name.append(key)
        if key not in needed and not typed.endswith("None"):
            typed += " | None"
        body += [f"    {key}: {typed}", doc(part["description"], "    ")]
    if parts:
        lines += ["", "    _parts = {", *(f'        "{k}": "{v}",' for k, v in parts.items()), "    }"]
    if by_name:
        lines.append(f"    _by_name = frozenset({json.dumps(by_name)})")
    return [*lines, "", *body]


schema = json.loads(_core.report_schema())
DEFS = schema["$defs"]
hidden = {"Varying", "GraphReport", "PatternReport"}
names = sorted(n for n in DEFS if n not in hidden)
text = HEAD + f"\n__all__ = {json.dumps(names, indent=4)[:-2]},\n]\n"
for name in names:
    text += "\n".join(written(name, DEFS[name])) + "\n"
if "--check" in sys.argv:
    sys.exit(FILE.read_text(encoding="utf-8") != text)
FILE.write_text(text, encoding="utf-8")
print(f"{FILE.name}: {len(names)} classes")
