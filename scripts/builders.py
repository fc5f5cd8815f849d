#!/usr/bin/env python3
"""Writes the Python builders of kinds, python/trabecula/region.py, from schema/design.json.

Keys, types, units, ranges, defaults and texts are declared once, in the core. What a signature adds to them is here: how values
that Python has other forms for are converted, by the type that the schema names.
"""

import json
import sys
import textwrap

from kinds import ROOT, SCHEMA, keys, limits, resolved, words

STAMP = "# Made by scripts/builders.py from schema/design.json; do not edit."

PATH = "str | os.PathLike[str]"

#: Module: the definition whose kinds it builds, its docstring.
FAMILIES = {
    "region": ("Region", "Regions: where the part may be. Lengths in mm."),
}


def annotation(schema):
    """The Python type of a value."""
    of = resolved(schema)
    for join in ("anyOf", "oneOf"):
        if join in of:
            return " | ".join(dict.fromkeys(annotation(s) for s in of[join]))
    if "const" in of or "enum" in of:
        return "str"
    kinds = {"number": "float", "integer": "int", "boolean": "bool", "string": "str", "object": "dict"}
    if of.get("type") == "array":
        return f"Sequence[{annotation(of['items'])}]"
    return kinds[of["type"]]


def literal(schema):
    """The annotation, with words as a Literal."""
    of = resolved(schema)
    known = words(of)
    return "Literal[" + ", ".join(f'"{w}"' for w in known) + "]" if known else annotation(of)


def sentence(name, schema, required):
    """A key in the docstring: meaning, unit, range, default."""
    notes = [schema.get("x-unit", ""), limits(schema)]
    if "default" in schema:
        notes.append(f"default {json.dumps(schema['default'])}")
    elif not required:
        notes.append("optional")
    notes = ", ".join(n for n in notes if n)
    return f"{name}: {schema['description']}" + (f" [{notes}]" if notes else "")


def arguments(table):
    """The keys of a table as arguments: name, schema, whether it is required, whether a keyword. Of alternatives none is."""
    out, keyword, several = [], False, len(table.get("oneOf", [])) > 1
    for name, schema, required, number in keys(table):
        keyword = keyword or schema.get("x-keyword", False)
        out.append((name, schema, required and not (number and several), keyword))
    return sorted(out, key=lambda k: (k[3], not k[2]))


def docstring(text, rows):
    """An indented docstring."""
    lines = textwrap.wrap(text, 120, initial_indent='    """', subsequent_indent="    ")
    if rows:
        lines.append("")
        for row in rows:
            lines += textwrap.wrap(row, 120, initial_indent="    ", subsequent_indent="        ")
        return [*lines, '    """']
    lines[-1] += '"""'
    return lines


def wrapped(head, items, tail, indent=""):
    """A call or signature, one item a line where it is long."""
    line = f"{indent}{head}{', '.join(items)}{tail}"
    if len(line) <= 128:
        return [line]
    return [f"{indent}{head}", *(f"{indent}    {item}{'' if item == '/' else ','}" for item in items), f"{indent}{tail}"]


def builder(name, schema):
    """The lines of one function."""
    of = resolved(schema["properties"][name])
    if of.get("type") == "array":
        least = of.get("minItems", 0)
        first = ["first: dict, "] if least == 2 else []
        listed = "[first, *others]" if first else "list(regions)"
        rest = "*others: dict" if first else "*regions: dict"
        text = docstring(schema["description"], [])
        return [f"def {name}({''.join(first)}{rest}) -> dict:", *text, f'    return {{"{name}": {listed}}}']
    signature, rows, given, starred = [], [], [], False
    for key, value, required, keyword in arguments(of):
        if keyword and not starred:
            signature.append("*")
            starred = True
        kind, form = (PATH, "os.fspath({0})") if key == "path" and required else (literal(value), "{0}")
        signature.append(f"{key}: {kind}" + ("" if required else " | None = None"))
        rows.append(sentence(key, value, required))
        given.append(f"{key}={form.format(key)}")
    head = wrapped(f"def {name}(", signature, ") -> dict:")
    text = docstring(schema["description"], rows)
    return [*head, *text, *wrapped(f'return {{"{name}": settings(', given, ")}", "    ")]


def module(definition, text):
    """The text of a module."""
    parts = []
    for choice in SCHEMA["$defs"][definition]["oneOf"]:
        (name,) = choice["properties"]
        parts.append((name, builder(name, choice)))
    body = "\n".join(line for _, lines in parts for line in lines)
    lines = [STAMP, f'"""{text}"""', "", "from __future__ import annotations", ""]
    lines += ["import os"] * ("os." in body) + ["from collections.abc import Sequence"]
    lines += ["from typing import Literal"] * ("Literal" in body) + ["", "from .given import settings", ""]
    lines += wrapped("__all__ = [", [f'"{name}"' for name in sorted(n for n, _ in parts)], "]")
    for _, function in parts:
        lines += ["", "", *function]
    return "\n".join(lines) + "\n"


def main():
    """Write the modules, or with --check say which are stale."""
    stale = []
    for name, (definition, text) in FAMILIES.items():
        path = ROOT / "python" / "trabecula" / f"{name}.py"
        made = module(definition, text)
        if "--check" in sys.argv[1:]:
            stale += [name] * (path.read_text(encoding="utf-8") != made)
        else:
            path.write_text(made, encoding="utf-8")
    if stale:
        sys.exit(f"stale: {', '.join(stale)}; renew with python scripts/builders.py")


if __name__ == "__main__":
    main()
