#!/usr/bin/env python3
"""Writes docs/generated/{design,command,python}.md from the schema, the help pages and the docstrings."""

import contextlib
import inspect
import json
import subprocess
import sys
from pathlib import Path

import trabecula

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "generated"
STAMP = "<!-- Made by scripts/design_reference.py; do not edit. -->"
COMMANDS = ["new", "check", "mesh", "simplify", "voxels", "tets", "slice", "measure", "cells", "render"]


def kind(schema):
    """A property's type in words."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[-1]
        return f"[{name}](#{name.lower()})"
    for join in ("anyOf", "oneOf", "allOf"):
        if join in schema:
            return " or ".join(dict.fromkeys(kind(s) for s in schema[join] if s.get("type") != "null"))
    if "const" in schema or "enum" in schema:
        return ", ".join(f"`{v}`" for v in schema.get("enum", [schema.get("const")]))
    if schema.get("type") == "array":
        return f"list of {kind(schema['items'])}" if "items" in schema else "list"
    words = schema.get("type", "anything")
    return words if isinstance(words, str) else " or ".join(w for w in words if w != "null")


def one_line(text):
    """Text as a table cell."""
    return " ".join(str(text).split()).replace("|", "\\|")


def properties(schema, needed="yes", about=""):
    """Rows for the keys of an object. Of alternatives, words and other tables too, one is needed."""
    rows = []
    for key, value in schema.get("properties", {}).items():
        word = needed if key in schema.get("required", []) else ""
        if "default" in value:
            word = f"`{one_line(json.dumps(value['default']))}`"
        rows.append(f"| `{key}` | {kind(value)} | {word} | {one_line(value.get('description', about))} |")
    for join in ("anyOf", "oneOf"):
        for part in schema.get(join, []):
            said = part.get("description", "")
            rows += properties(part, "one of", said)
            if "properties" not in part and part.get("type") != "null":
                words = [f'"{w}"' for w in part.get("enum", [part["const"]] if "const" in part else [])]
                rows.append(
                    f"| {' '.join(f'`{w}`' for w in words)} | {'' if words else kind(part)} | one of | {one_line(said)} |"
                )
    return rows


def design(schema):
    """The schema as tables."""
    lines = [
        STAMP,
        "# Design file: every key",
        "",
        "Needed: `yes`; `one of` those that say so; or the default, where the schema knows it.",
        "",
    ]
    for name, part in {"design": schema, **schema.get("$defs", schema.get("definitions", {}))}.items():
        lines += [f"## {name}", "", part.get("description", ""), ""]
        rows = properties(part)
        lines += ["| key | is | needed | |", "|---|---|---|---|", *rows, ""] if rows else [kind(part), ""]
    return "\n".join(lines)


def command():
    """The help pages."""
    lines = [STAMP, "# The command: its help", ""]
    for name in ["", *COMMANDS]:
        words = [sys.executable, "-m", "trabecula", *name.split(), "--help"]
        text = subprocess.run(words, check=True, capture_output=True, text=True).stdout.rstrip()
        lines += [f"## trabecula {name}".rstrip(), "", "```text", text, "```", ""]
    return "\n".join(lines)


def python():
    """Names, signatures and docstrings."""
    lines = [STAMP, "# Python: every name", ""]
    for name in sorted(trabecula.__all__):
        thing = getattr(trabecula, name)
        members = [(name, thing)]
        if inspect.ismodule(thing) or inspect.isclass(thing):
            public = sorted(k for k in getattr(thing, "__all__", vars(thing)) if not k.startswith("_"))
            owned = [(k, getattr(thing, k)) for k in public]
            owned = [(k, m) for k, m in owned if callable(m) or hasattr(m, "__get__")]
            keep = inspect.isclass(thing)
            members += [(f"{name}.{k}", m) for k, m in owned if keep or getattr(m, "__module__", "") == thing.__name__]
        for label, member in members:
            with contextlib.suppress(TypeError, ValueError):
                label += str(inspect.signature(member)) if callable(member) else ""
            lines += [f"### `{label}`", "", inspect.getdoc(member) or "", ""]
    return "\n".join(lines)


def main():
    """Write the pages."""
    OUT.mkdir(parents=True, exist_ok=True)
    schema = json.loads((ROOT / "schema" / "design.json").read_text(encoding="utf-8"))
    for name, text in (("design", design(schema)), ("command", command()), ("python", python())):
        (OUT / f"{name}.md").write_text(text.rstrip() + "\n", encoding="utf-8")
        print(OUT / f"{name}.md")


if __name__ == "__main__":
    main()
