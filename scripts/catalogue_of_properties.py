#!/usr/bin/env python3
"""Writes docs/generated/properties.json, what all cells do by their fraction, and catalogue.md with plots of it.

Usage: python scripts/catalogue_of_properties.py [--n 64] [--cells NAME ...] [--parts PART ...] [--again] [--flow] [--page]

Cells that stand in the data at this n or a finer one are kept, unless --again; --flow adds the permeability, which takes most
of the time: without it that of the data stays, at the n it was found with. --page makes the page of what is there.
"""

import argparse
import itertools
import json
import math
from pathlib import Path

import numpy as np
import trabecula as lt
from trabecula import _core
from trabecula.laws import monotone
from trabecula.pictures.curves import Curve, Panel, panels

ROOT = Path(__file__).resolve().parent.parent
DATA = ROOT / "docs" / "generated" / "properties.json"
PAGE = ROOT / "docs" / "generated" / "catalogue.md"
PICTURES = ROOT / "docs" / "images"
FRACTIONS = (0.05, 0.6, 12)
#: The kinds of cells: parts of named ones, cells of beams, tetrahedral ones, each with the part that it is meant for.
PARTS = ("sheet", "lower", "upper", "beams", "tetrahedra")
#: What is found without --flow, and of tetrahedral cells in any case: flow through them takes hours.
SOLID = ("stiffness", "conductivity", "area")
FLOW = tuple(lt.laws.PROPERTIES["permeability"])
#: Plots: column, title, and whether it is logarithmic.
SHOWN = (
    ("E", "Young's modulus along the axes, over the solid's", True),
    ("zener", "Zener's ratio 2 C44 / (C11 - C12)", True),
    ("k", "Conductivity over the solid's", False),
    ("K", "Permeability over wavelength²", True),
    ("area", "Area of the wall × wavelength / volume", False),
)


#: The named cells but one of the two gyroids, which are mirror images.
CELLS = [cell.name for cell in _core.cells() if cell.name != "gyroid_mirrored"]
BEAMS = lt.beams.names()
NAMES = dict.fromkeys(PARTS, CELLS) | {"beams": BEAMS, "tetrahedra": lt.cell.tet_names()}


def kind(law):
    """Of which of the kinds a law is."""
    return "tetrahedra" if law.get("tet") else law["part"]


def order(law):
    """Where a law stands: named cells first, then cells of beams, then tetrahedral ones."""
    part = kind(law)
    return PARTS.index(part) - 2 if part in PARTS[3:] else 0, NAMES[part].index(law["cell"]), PARTS.index(part)


def with_flow_of(old, law):
    """A law without flow, with that of the data at the same fractions."""
    if old is None or "K" not in old["columns"] or old["columns"]["fraction"] != law["columns"]["fraction"]:
        return law
    columns = law["columns"] | {name: old["columns"][name] for name in FLOW}
    about_flow = [(note, [m for m in note["messages"] if m.startswith("permeability:")]) for note in old["notes"]]
    notes = {note["fraction"]: list(note["messages"]) for note in law["notes"]}
    for note, messages in about_flow:
        if messages:
            notes.setdefault(note["fraction"], []).extend(messages)
    notes = [{"fraction": f, "messages": messages} for f, messages in sorted(notes.items())]
    return law | {"columns": columns, "notes": notes, "n_flow": old.get("n_flow", old["n"])}


def compute(n, cells, parts, again, flow):
    """Adds laws to the data."""
    kept = json.loads(DATA.read_text(encoding="utf-8")) if DATA.exists() else {"laws": []}
    laws = {(law["cell"], kind(law)): law for law in kept["laws"]}
    for cell in cells:
        for part in (part for part in parts if cell in NAMES[part]):
            if not again and laws.get((cell, part), {"n": 0})["n"] >= n:
                continue
            tet = part == "tetrahedra"
            more = {"tet": True} if tet else {}
            if tet or not flow:
                more["properties"] = SOLID
            law = lt.law(cell, None if tet else part, *FRACTIONS, n=n, **more).to_dict()
            law["columns"] = {k: [v and float(f"{v:.6g}") for v in column] for k, column in law["columns"].items()}
            law["fits"] = {k: {name: float(f"{v:.6g}") for name, v in fit.items()} for k, fit in law["fits"].items()}
            law["notes"] = [{**note, "fraction": float(f"{note['fraction']:.6g}")} for note in law["notes"]]
            laws[cell, part] = law if tet or flow else with_flow_of(laws.get((cell, part)), law)
            rows = ",\n".join(json.dumps(it) for it in sorted(laws.values(), key=order))
            DATA.write_text(f'{{"laws": [\n{rows}\n]}}\n', encoding="utf-8")
            print(f"{cell} {part}: done", flush=True)


def page():
    """The page and its plots."""
    laws = json.loads(DATA.read_text(encoding="utf-8"))["laws"]
    for part in (part for part in PARTS if any(kind(law) == part for law in laws)):
        plots = []
        for column, title, log in SHOWN:
            curves = []
            for law in (law for law in laws if kind(law) == part and column in law["columns"]):
                x = np.array(law["columns"]["fraction"])
                y = np.array([math.nan if v is None else v for v in law["columns"][column]])
                known = np.isfinite(y) & (y > 0)
                along = np.linspace(x[known][0], x[known][-1], 81) if known.sum() > 1 else []
                values = monotone(x[known], y[known], along) if len(along) else []
                curves.append(Curve(law["cell"], x[known], y[known], along, values))
            if curves:
                plots.append(Panel(title, f"solid fraction, {part}", curves, log))
        (PICTURES / f"properties_{part}.svg").write_text(panels(plots), encoding="utf-8")
    PAGE.write_text("\n".join(lines(laws)) + "\n", encoding="utf-8")
    print(PAGE)


def percent(share):
    """A share in two digits."""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.2g} %"


def doubted(law):
    """(property, fraction) of the figures whose notes say that they may be off by more than their error."""
    signs = ("more than the error says", "off by more than", "links may pass")
    return {
        (message.partition(":")[0], note["fraction"])
        for note in law["notes"]
        for message in note["messages"]
        if any(words in message for words in signs)
    }


def steps(law):
    """The voxels along the cell, and the nodes for flow if these are others."""
    return f"{law['n']}, K {law['n_flow']}" if law.get("n_flow", law["n"]) != law["n"] else str(law["n"])


def row(law, i, doubts):
    """The texts of the figures of a law at one of its fractions."""
    fraction = law["columns"]["fraction"][i]
    yield f"{fraction:.2f}"
    for name, of in (("E", "stiffness"), ("zener", None), ("k", "conductivity"), ("K", "permeability"), ("area", None)):
        value = law["columns"][name][i] if name in law["columns"] else None
        none = value is None or (value == 0 and name == "K")
        yield "–" if none else f"{value:.4g}"
        if of:
            yield "–" if none else ("> " if (of, fraction) in doubts else "") + percent(law["columns"][f"{name}_error"][i])


def lines(laws):
    """The page's text."""
    yield "<!-- Made by scripts/catalogue_of_properties.py; do not edit. -->"
    yield "# What the cells do"
    yield ""
    yield (
        "Effective figures of the periodic cell by its solid fraction, for a solid of Poisson's ratio 0.3: limits of three "
        "grids, by [`trabecula law`](../guide/what-the-cell-does.md). All numbers, with the error of each, stand in "
        "[properties.json](properties.json). A dash is a cell that falls apart or, of K, a pore that does not go through "
        "or was not computed: flow takes most of the time, and is of as many nodes along the cell as stand after K. "
        "Tetrahedral cells stand in the equal tetrahedra of a body-centred cubic lattice, and λ is the edge of a regular one "
        "of the same volume; their permeability is left out. Where `>` stands before an error, the thinnest wall is less than "
        "three voxels across (of K two steps), or the grids differ too much: the figures, most often too high, are off by more "
        "than that."
    )
    for part in (part for part in PARTS if any(kind(law) == part for law in laws)):
        yield from ("", f"## {part}", "", f"![Properties by fraction](../images/properties_{part}.svg)", "")
        yield "| cell | n | fraction | E | error of E | Zener | k | error of k | K / λ² | error of K | area λ / V |"
        yield "|" + "---|" * 11
        for law in (law for law in laws if kind(law) == part):
            doubts = doubted(law)
            for i in range(len(law["columns"]["fraction"])):
                yield "| " + " | ".join([f"`{law['cell']}`", steps(law), *row(law, i, doubts)]) + " |"


def main():
    """Compute what is asked for, and the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--n", type=int, default=64)
    parser.add_argument("--cells", nargs="+", default=list(dict.fromkeys(itertools.chain(*NAMES.values()))))
    parser.add_argument("--parts", nargs="+", default=PARTS, choices=PARTS)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--flow", action="store_true")
    parser.add_argument("--page", action="store_true")
    args = parser.parse_args()
    if not args.page:
        compute(args.n, args.cells, args.parts, args.again, args.flow)
    page()


if __name__ == "__main__":
    main()
