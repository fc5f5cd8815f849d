#!/usr/bin/env python3
"""Writes the tables of docs/reference/design-file.md, below its mark, from schema/design.json."""

import json
import sys

from kinds import ROOT, SCHEMA, alternatives, keys, kinds, limits, listed, resolved, types

PAGE = ROOT / "docs" / "reference" / "design-file.md"
MARK = "<!-- Below: made by scripts/design_page.py from schema/design.json; do not edit. -->\n"


def anchor(name):
    """A link to the section of a definition."""
    return f"[{name}](#{name.lower()})"


def form(schema):
    """What a value is."""
    if "$ref" in schema:
        return anchor(schema["$ref"].rsplit("/", 1)[-1])
    if "items" not in schema and "anyOf" in schema and "then" not in schema:
        return " or ".join(dict.fromkeys(form(s) for s in schema["anyOf"]))
    return " or ".join(dict.fromkeys(form_of(kind, schema) for kind in types(schema)))


def form_of(kind, schema):
    """What a value of a JSON type is."""
    if kind == "string" and ("enum" in schema or (len(types(schema)) > 1 and "then" in schema)):
        words = schema if "enum" in schema else schema["then"]
        return form(words) if "$ref" in words else ", ".join(f"`{v}`" for v in words["enum"])
    if kind == "array":
        count = str(schema["minItems"]) + " × " if schema.get("minItems") == schema.get("maxItems", 0) else "list of "
        return count + form(schema["items"]) if "items" in schema else "list"
    if kind == "object" and "x-kind" in schema:
        return anchor(schema["x-kind"])
    if kind == "object" and isinstance(schema.get("additionalProperties"), dict):
        return f"names, each {form(schema['additionalProperties'])}"
    return kind


def cell(text):
    """Text as a table cell."""
    return " ".join(str(text).split()).replace("|", "\\|")


def row(name, schema, needed, numbers):
    """A key; ``numbers`` are those of the alternatives that have it, ``needed`` of those that need it (0 is the table)."""
    alone = [n for n in numbers if n not in needed]
    told = [f"yes ({', '.join(map(str, needed))})" if numbers else "yes"] if needed else []
    told += [f"({', '.join(map(str, alone))})"] if alone else []
    told = f"`{json.dumps(schema['default'])}`" if "default" in schema else ", ".join(told)
    unit = " ".join(w for w in (schema.get("x-unit", ""), limits(schema)) if w)
    return f"| `{name}` | {form(schema)} | {cell(unit)} | {told} | {cell(schema.get('description', ''))} |"


def rows(of):
    """The keys of a table, each once."""
    found = {}
    for name, schema, required, number in keys(of):
        _, needed, numbers = found.setdefault(name, (schema, [], []))
        needed += [number] * required
        numbers += [number] * bool(number)
    return [row(name, schema, needed, numbers) for name, (schema, needed, numbers) in found.items()]


def section(name, of):
    """A definition: its keys, its kinds, or its words."""
    lines = [f'<a id="{name.lower()}"></a>', "", f"### {name}", "", cell(of.get("description", "")).replace("\\|", "|"), ""]
    if kinds(of) or listed(of):
        lines += ["| kind | is | |", "|---|---|---|"]
        lines += [f'| `"{word}"` | | {cell(meaning)} |' for word, meaning in listed(of)]
        lines += [f"| `{key}` | {form(value)} | {cell(value.get('description', ''))} |" for key, value in kinds(of)]
        return [*lines, ""]
    if "properties" in of:
        if alternatives(of):
            lines += ["Of the keys with a number, those of one number are given.", ""]
        lines += ["| key | is | unit, range | needed or default | |", "|---|---|---|---|---|"]
        return [*lines, *rows(of), ""]
    return [*lines, form(of) + ".", ""]


def tables():
    """All definitions."""
    lines = ['<a id="every-key"></a>', "", "## Every key", ""]
    for name, of in {"Design": SCHEMA, **SCHEMA["$defs"]}.items():
        lines += section(name, resolved(of))
    return "\n".join(lines).rstrip() + "\n"


def main():
    """Write the page, or with --check say whether it is stale."""
    head, mark, _ = PAGE.read_text(encoding="utf-8").partition(MARK)
    text = head + (mark or MARK) + "\n" + tables()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(text, encoding="utf-8")
    elif PAGE.read_text(encoding="utf-8") != text:
        sys.exit("docs/reference/design-file.md is stale; renew it with python scripts/design_page.py")


if __name__ == "__main__":
    main()
