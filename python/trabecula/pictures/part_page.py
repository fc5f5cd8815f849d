"""A report of a part as one page: what it is, measured, and the part to turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

from .. import _core
from ..base.terminal import figure
from ..base.texts import UNITS
from .viewer import View, page

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..solid import Solid
    from ..thickness import Thickness

__all__ = ["part_page"]

STYLE = """
main { max-width: 1080px; margin: 0 auto; padding: 1.2em; }
h1 { font-size: 1.6em; margin: .2em 0 .1em; } h2 { font-size: 1.15em; margin: 1.8em 0 .5em; }
p.under { margin: 0 0 1em; color: var(--faint); }
ul.verdict { list-style: none; display: flex; flex-wrap: wrap; gap: .5em; padding: 0; margin: 1em 0; }
ul.verdict li { border: 1px solid var(--line); border-radius: 99px; padding: .1em .9em; font-size: 13px; }
ul.verdict .good::before { content: "✓ "; color: #2c9a52; font-weight: 700; }
ul.verdict .bad::before { content: "✗ "; color: #d1483c; font-weight: 700; }
table { border-collapse: collapse; width: 100%; }
td, th { text-align: left; padding: .28em .6em; border-bottom: 1px solid var(--line); }
td:nth-child(2) { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
td:nth-child(3) { color: var(--faint); }
pre { background: var(--field); padding: .9em; border-radius: 6px; overflow-x: auto; font-size: 13px; line-height: 1.45; }
.warn { border-left: 4px solid #e0a030; padding: .1em .9em; margin: .5em 0; } .warn code { color: var(--faint); }
.charts svg { max-width: 100%; height: auto; border-radius: 6px; }
@media print { main { max-width: none; } pre { white-space: pre-wrap; } }
"""


def part_page(
    solid: Solid,
    mesh: Mesh,
    design: str,
    title: str = "Part",
    thickness: Thickness | None = None,
    warnings: Sequence[Mapping[str, str]] = (),
    progress: Callable[[int, int], Any] | None = None,
) -> str:
    """The page, HTML with nothing outside: the mesh of the solid in a viewer, its verdicts (closed, in one piece, …), its
    figures with units, histograms of wall thickness and pore size, warnings ({path, message}), what ``Solid.report``
    says, and the text of the design. ``progress(done, total)`` is called while a lighter mesh is made for the viewer.
    """
    body = [
        f"<main>\n<h1>{escape(title)}</h1>",
        f'<p class="under">{_extent(solid)} · {mesh.counts[1]:,} triangles · trabecula {escape(_core.__version__)}</p>',
        View(mesh, progress=progress).figure(),
        f'<ul class="verdict">{"".join(_verdicts(mesh))}</ul>',
    ]
    body += [_warning(w) for w in warnings]
    rows = "".join(
        f"<tr><td>{escape(a)}</td><td>{escape(b)}</td><td>{escape(c)}</td></tr>" for a, b, c in _rows(mesh, thickness)
    )
    body.append(f"<h2>Figures of the mesh</h2>\n<table>{rows}</table>")
    if thickness is not None:
        body.append(f'<h2>Walls and pores</h2>\n<div class="charts">{thickness.svg()}</div>')
    body.append(f"<h2>Figures of the design</h2>\n<pre>{escape(str(solid.report()))}</pre>")
    body.append(f"<h2>Design</h2>\n<pre>{escape(design.strip())}</pre>\n</main>")
    return page(title, "\n".join(body), STYLE)


def _extent(solid: Solid) -> str:
    low, high = solid.bounds
    return " × ".join(f"{b - a:.4g}" for a, b in zip(low, high, strict=True)) + " mm"


def _verdicts(mesh: Mesh) -> Iterator[str]:
    pieces, crossings = mesh.pieces, mesh.self_intersections
    for good, yes, no in (
        (mesh.closed, "closed", "not closed"),
        (not mesh.defects, "manifold", "; ".join(mesh.defects)),
        (crossings == 0, "no self-intersections", f"{crossings} self-intersections"),
        (pieces == 1, "in one piece", f"{pieces} pieces"),
        (mesh.cavities == 0, "no closed voids", f"{mesh.cavities} closed voids"),
    ):
        yield f'<li class="{"good" if good else "bad"}">{escape(yes if good else no)}</li>'


def _rows(mesh: Mesh, thickness: Thickness | None) -> Iterator[tuple[str, str, str]]:
    """Name, value with its unit, meaning."""
    it = mesh.measure()
    surface = it.specific_surface
    for name, value, unit, meaning in (
        ("volume", it.volume, "mm³", "of the solid"),
        ("solid fraction", it.solid_fraction, "", "volume over that of the region"),
        ("porosity", it.porosity, "", "one minus the solid fraction"),
        ("area", it.area, "mm²", "of the whole surface"),
        ("area of the lattice", it.area_lattice, "mm²", "without faces on the region's surface"),
        ("area of the region's faces", it.area_cut, "mm²", "where the region cuts the lattice"),
        ("specific surface", surface.lattice_of_region, "1/mm", "the lattice's area over the volume of the region"),
        (
            "hydraulic diameter",
            it.hydraulic_diameter,
            UNITS["hydraulic_diameter"].strip(),
            "4 × volume of the pores over their area",
        ),
        ("Euler number", it.euler, "", "of the surface; 2 − 2 × handles for one component"),
    ):
        if value is not None:
            yield name, f"{figure(value) if isinstance(value, float) else value} {unit}".strip(), meaning
    if thickness is not None:
        for name, spread in (("wall thickness", thickness.wall), ("pore size", thickness.pore)):
            if spread is not None:
                yield (
                    name,
                    f"{spread.mean:.4g} ± {spread.sd:.2g} mm",
                    "largest ball that fits in and covers a point: mean, deviation",
                )


def _warning(it: Mapping[str, Any]) -> str:
    path = f"<code>{escape(it['path'])}</code> " if it.get("path") else ""
    return f'<div class="warn"><p>{path}{escape(it["message"])}</p></div>'
