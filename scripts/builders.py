#!/usr/bin/env python3
"""Writes the Python builders of kinds, python/trabecula/region.py and its like, and the words of a design as types,
python/trabecula/base/names.py, from schema/design.json.

Keys, types, units, ranges, defaults and texts are declared once, in the core. What a signature adds to them is here: how values
that Python has other forms for are converted, by the type that the schema names.
"""

import json
import re
import sys
import textwrap

from kinds import ROOT, SCHEMA, alternatives, keys, kinds, limits, resolved, types, words

STAMP = "# Made by scripts/builders.py from schema/design.json; do not edit."

PATH = "str | os.PathLike[str]"

#: Module: the definition whose kinds it builds, its docstring.
FAMILIES = {
    "region": ("Region", "Regions: where the part may be. Lengths in mm."),
    "grade": ("Grade", "Grades: numbers that vary in space, for a level's amount or a number of a phase map. Lengths in mm."),
    "map": ("Map", "Maps: position (mm) to phase (turns)."),
}


def annotation(schema):
    """The Python type of a value."""
    of = resolved(schema)
    if "type" not in of and "anyOf" in of:
        return " | ".join(dict.fromkeys(annotation(s) for s in of["anyOf"]))
    names = {"number": "float", "integer": "int", "boolean": "bool", "string": "str", "object": "dict"}
    items = several(annotation(of["items"])) if "items" in of else ""
    return " | ".join(names.get(kind, items) for kind in types(of))


def several(item):
    """The Python type of a list of values; numbers may stand in an array too."""
    return {
        "float": "Vector",
        "Vector": "Sequence[Vector] | NDArray",
        "float | dict": "Sequence[float | dict] | Vector",
    }.get(item, f"Sequence[{item}]")


def literal(schema):
    """The annotation, with words as a Literal."""
    of = resolved(schema)
    return choice(words(of)) if words(of) else annotation(of)


def choice(known):
    """The Python type of one of these words."""
    return "Literal[" + ", ".join(f'"{w}"' for w in known) + "]"


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
    out, keyword, several = {}, {}, len(alternatives(table)) > 1
    control = [part["keys"] for part in alternatives(table)] == [["points"], ["path"]]
    for name, schema, required, number in keys(table):
        if control and name == "path":
            continue
        keyword[number] = keyword.get(number, False) or schema.get("x-keyword", False)
        if control and name == "points":
            schema = CONTROL
        out.setdefault(name, (name, schema, required and not (number and several and not control), keyword[number]))
    return sorted(out.values(), key=lambda k: (k[3], not k[2]))


#: Control points, here or in a file, as one argument.
CONTROL = {
    "x-type": "Points",
    "description": "Points [x, y, z] in order, or the path of a table (csv) of them.",
    "x-unit": "mm",
}


#: Kinds whose file may be given as data in memory: their type, what makes a file of them, and how they are given.
IN_MEMORY = {
    "grid": ("ArrayLike", "memory.grid", "Or the numbers themselves, an array (nx, ny, nz), with origin and step."),
    "points": ("ArrayLike", "memory.cloud", "Or the rows themselves, an array (n, 4) or a data frame."),
    "mesh": ("MeshLike", "in_memory", "Or a mesh in memory: ours, of trimesh, pyvista or meshio, or (vertices, triangles)."),
}


def converted(name, schema, required, kind_of_table):
    """The Python type of an argument, and the item of the table that it becomes."""
    of = resolved(schema)
    optional = "" if required else " | None = None"
    kind = of.get("x-type")
    if kind == "Points":
        return f"Points{optional}", f"**control({name})"
    if kind == "Stops":
        return f"Stops{optional}", f"{name}=pairs({name})"
    if "propertyNames" in of:
        return f"Mapping[int, {annotation(of['additionalProperties'])}]{optional}", f"{name}={name}"
    if name == "path" and kind_of_table in IN_MEMORY:
        hint, maker, _ = IN_MEMORY[kind_of_table]
        return f"{PATH} | {hint}{optional}", f"path=memory.path_of(path, {maker})"
    if name == "path":
        form = "os.fspath(path)" if required else "None if path is None else os.fspath(path)"
        return f"{PATH}{optional}", f"path={form}"
    return f"{literal(schema)}{optional}", f"{name}={name}"


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
    of = resolved(schema)
    if of.get("type") == "array":
        least = of.get("minItems", 0)
        first = ["first: dict, "] if least == 2 else []
        listed = "[first, *others]" if first else "list(regions)"
        rest = "*others: dict" if first else "*regions: dict"
        text = docstring(schema["description"], [])
        return [f"def {name}({''.join(first)}{rest}) -> dict:", *text, f'    return {{"{name}": {listed}}}']
    if of.get("type") == "string":
        text = docstring(schema["description"], [])
        return [f"def {name}(text: str) -> dict:", *text, f'    return {{"{name}": text}}']
    signature, rows, given, starred = [], [], [], False
    for key, value, required, keyword in arguments(of):
        if keyword and not starred:
            signature.append("*")
            starred = True
        kind, item = converted(key, value, required, name)
        signature.append(f"{key}: {kind}")
        more = f" {IN_MEMORY[name][2]}" if key == "path" and name in IN_MEMORY else ""
        rows.append(sentence(key, value, required) + more)
        given.append(item)
    head = wrapped(f"def {name}(", signature, ") -> dict:")
    text = docstring(schema["description"], rows)
    call = f'    return {{"{name}": settings({", ".join(given)})}}'
    if len(call) <= 128:
        return [*head, *text, call]
    return [*head, *text, *wrapped("given = settings(", given, ")", "    "), f'    return {{"{name}": given}}']


def module(definition, text):
    """The text of a module."""
    parts = [(name, builder(name, schema)) for name, schema in kinds(SCHEMA["$defs"][definition])]
    body = "\n".join(line for _, lines in parts for line in lines)
    lines = [STAMP, f'"""{text}"""', "", "from __future__ import annotations", ""]
    used = ["import os"] * ("os." in body)
    generic = ", ".join(n for n in ("Mapping", "Sequence") if f"{n}[" in body)
    used += [f"from collections.abc import {generic}"] * bool(generic)
    used += ["from typing import Literal"] * ("Literal[" in body)
    given = ["named", *(n for n in ("control", "pairs", "settings") if f"{n}(" in body)]
    used_here = ["from .base import memory"] * ("memory." in body)
    mesh_here = ["from .mesh import in_memory"] * ("in_memory)" in body)
    lines += [*used, "", *used_here, f"from .base.given import {', '.join(sorted(given))}", *mesh_here, ""]
    hinted = [n for n in ("MeshLike", "Points", "Stops", "Vector") if re.search(rf"\b{n}\b", re.sub(r'"[^"]*"', "", body))]
    lines += ["TYPE_CHECKING = False  # as type checkers know it, without the import", "if TYPE_CHECKING:"]
    arrays = [n for n in ("ArrayLike", "NDArray") if n in body]
    lines += [f"    from numpy.typing import {', '.join(arrays)}", ""] * bool(arrays)
    lines += [f"    from .base.given import {', '.join(hinted)}", ""]
    lines += wrapped("__all__ = [", [f'"{name}"' for name in sorted(n for n, _ in parts)], "]")
    for _, function in parts:
        lines += ["", "", "@named", *function]
    return "\n".join(lines) + "\n"


#: Words of a design that are types of arguments: of each the definition, or the definition and the key.
WORDS = {
    "BeamName": ("Beams", "cell"),
    "CellName": ("Lattice", "cell"),
    "Component": ("Component",),
    "Dangling": ("Dangling",),
    "Fit": ("Fit",),
    "Of": ("Of",),
    "PartName": ("Part",),
    "Side": ("Side",),
    "TetName": ("TetCell", "name"),
    "Trim": ("Trim",),
    "Unit": ("Unit",),
}


def names():
    """The module of words as types."""
    lines = [STAMP, '"""Words of a design, as types."""', "", "from typing import Literal", ""]
    lines += [*wrapped("__all__ = [", [f'"{name}"' for name in WORDS], "]"), ""]
    for name, (definition, *key) in WORDS.items():
        of = SCHEMA["$defs"][definition]
        for part in key:
            of = of["properties"][part]
        lines += wrapped(f"{name} = Literal[", [f'"{w}"' for w in words(of) or resolved(of)["then"]["enum"]], "]")
    return "\n".join(lines) + "\n"


def main():
    """Write the modules, or with --check say which are stale."""
    stale = []
    modules = {name: module(*family) for name, family in FAMILIES.items()} | {"base/names": names()}
    for name, made in modules.items():
        path = ROOT / "python" / "trabecula" / f"{name}.py"
        if "--check" in sys.argv[1:]:
            stale += [name] * (path.read_text(encoding="utf-8") != made)
        else:
            path.write_text(made, encoding="utf-8")
    if stale:
        sys.exit(f"stale: {', '.join(stale)}; renew with python scripts/builders.py")


if __name__ == "__main__":
    main()
