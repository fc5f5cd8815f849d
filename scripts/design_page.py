#!/usr/bin/env python3
"""Writes the tables of docs/reference/design-file.md, below its mark, from schema/design.json."""

import json
import sys

from kinds import ROOT, SCHEMA, alternatives, keys, limits, resolved, words

PAGE = ROOT / "docs" / "reference" / "design-file.md"
MARK = "<!-- Below: made by scripts/design_page.py from schema/design.json; do not edit. -->\n"


def anchor(name):
    """A link to the section of a definition."""
    return f"[{name}](#{name.lower()})"


def form(schema):
    """What a value is."""
    if "$ref" in schema:
        return anchor(schema["$ref"].rsplit("/", 1)[-1])
    for join in ("anyOf", "oneOf", "allOf"):
        if join in schema:
            return " or ".join(dict.fromkeys(form(s) for s in schema[join] if s.get("type") != "null"))
    if "const" in schema or "enum" in schema:
        return ", ".join(f"`{v}`" for v in schema.get("enum", [schema.get("const")]))
    if schema.get("type") == "array":
        count = str(schema["minItems"]) + " × " if schema.get("minItems") == schema.get("maxItems", 0) else "list of "
        return count + form(schema["items"]) if "items" in schema else "list"
    if isinstance(schema.get("additionalProperties"), dict):
        return f"names, each {form(schema['additionalProperties'])}"
    kind = schema.get("type", "anything")
    return kind if isinstance(kind, str) else " or ".join(w for w in kind if w != "null")


def cell(text):
    """Text as a table cell."""
    return " ".join(str(text).split()).replace("|", "\\|")


def row(name, schema, required, number, several):
    """A key."""
    needed = "yes" if required else ""
    if number and several:
        needed = f"yes ({number})" if required else f"({number})"
    if "default" in schema:
        needed = f"`{json.dumps(schema['default'])}`"
    unit = " ".join(w for w in (schema.get("x-unit", ""), limits(schema)) if w)
    return f"| `{name}` | {form(schema)} | {cell(unit)} | {needed} | {cell(schema.get('description', ''))} |"


def section(name, of):
    """A definition: its keys, its kinds, or its words."""
    lines = [f'<a id="{name.lower()}"></a>', "", f"### {name}", "", cell(of.get("description", "")).replace("\\|", "|"), ""]
    tables = [p for p in of.get("oneOf", []) if "properties" in p]
    if "properties" in of or alternatives(of):
        several = len(alternatives(of)) > 1
        if several:
            lines += ["Of the keys with a number, those of one number are given.", ""]
        lines += ["| key | is | unit, range | needed or default | |", "|---|---|---|---|---|"]
        return [*lines, *(row(*key, several) for key in keys(of)), ""]
    if tables or words(of):
        lines += ["| kind | is | |", "|---|---|---|"]
        for part in of["oneOf"]:
            if "properties" in part:
                ((key, value),) = part["properties"].items()
                lines.append(f"| `{key}` | {form(value)} | {cell(part.get('description', ''))} |")
            else:
                known = ", ".join(f'`"{w}"`' for w in part.get("enum", [part.get("const")]))
                lines.append(f"| {known} | | {cell(part.get('description', ''))} |")
        return [*lines, ""]
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
