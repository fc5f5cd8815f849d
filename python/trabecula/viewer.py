"""A mesh to turn in a browser or a notebook: a page of its own, without a network."""

from __future__ import annotations

import base64
import json
import os
import zlib
from functools import cached_property
from html import escape
from importlib.resources import files

from .files import extension, whole_file

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from numpy.typing import ArrayLike

    from .mesh import Mesh

    Progress = Callable[[int, int], Any]

__all__ = ["View", "script", "style"]

#: Triangles of a page above which a mesh is made lighter.
LIGHT = 150_000
#: Steps of positions and values: what 16 bits hold.
STEPS = 65535


def script() -> str:
    """The program of the viewer, JavaScript."""
    return files(__package__).joinpath("viewer.js").read_text(encoding="utf-8")


def style() -> str:
    """The style of the viewer, CSS."""
    return files(__package__).joinpath("viewer.css").read_text(encoding="utf-8")


class View:
    """A mesh to turn: by the pointer, fingers or arrow keys; with a section plane, and colours by the faces that the region
    cut, by the angle of overhang, or by ``values``, a number for each vertex that ``label`` names. A notebook shows it;
    ``save`` makes a page. Of a mesh of more than 150,000 triangles, without values, a lighter one is shown; while it is made
    ``progress(done, total)`` is called. Raises ValueError for values that are not one number for each vertex.
    """

    def __init__(self, mesh: Mesh, values: ArrayLike | None = None, label: str = "", progress: Progress | None = None):
        self.mesh = mesh
        self.label = label
        self.values = None if values is None else mesh._at_vertices("values", values)
        self._progress = progress

    @cached_property
    def _light(self) -> Mesh:
        """The mesh, made lighter if it is large, closed and has no values."""
        mesh = self.mesh
        if mesh.counts[1] <= LIGHT or self.values is not None or mesh.defects or mesh.self_intersections:
            return mesh
        return mesh.simplified(triangles=LIGHT, progress=self._progress)

    @cached_property
    def _span(self) -> tuple[float, float] | None:
        """The least and the greatest of the finite values."""
        import numpy as np

        if self.values is None:
            return None
        finite = self.values[np.isfinite(self.values)]
        return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)

    @cached_property
    def packed(self) -> str:
        """The mesh as text: base64 of a DEFLATE stream of a line of JSON (``vertices``, ``triangles``, ``min``, ``max`` in mm,
        ``span`` of values or null), then positions (3 × uint16 of the bounds each, little-endian), triangles (3 × uint32 each),
        whether each triangle is on the region's surface (uint8), and values (uint16 of the span) if there are any.
        """
        import numpy as np

        mesh = self._light
        low, high = (np.array(b) for b in mesh.bounds)
        extent = np.where(high > low, high - low, 1.0)
        places = np.rint((mesh.vertices - low) / extent * STEPS).astype("<u2")
        parts = [places.tobytes(), mesh.triangles.astype("<u4").tobytes(), mesh.cut.astype("u1").tobytes()]
        span = None
        if self.values is not None and self._span is not None:
            least, most = self._span
            span = [least, most if most > least else least + 1.0]
            share = (np.nan_to_num(self.values, nan=least) - span[0]) / (span[1] - span[0])
            parts.append(np.rint(share.clip(0, 1) * STEPS).astype("<u2").tobytes())
        head = {"vertices": mesh.counts[0], "triangles": mesh.counts[1], "min": list(low), "max": list(high), "span": span}
        return base64.b64encode(zlib.compress(json.dumps(head).encode() + b"\n" + b"".join(parts), 9)).decode()

    def figure(self, high: str = "62vh") -> str:
        """The figure for a page that has ``style()`` and ``script()``; ``high`` is its height in CSS."""
        still = base64.b64encode(self.mesh._png).decode()
        lines = "".join(
            f'<g data-part="{name}"><line stroke="{colour}" stroke-width="2"/><text text-anchor="middle" dy=".35em" '
            f'fill="currentColor">{name}</text></g>'
            for name, colour in (("x", "#d1483c"), ("y", "#3c9d4e"), ("z", "#3a72d8"))
        )
        label = escape(self.label or "value")
        chosen = ("0", "2")[self.values is not None]
        options = [("0", "region's faces"), ("1", "overhang"), *([("2", label)] if self.values is not None else [])]
        choices = "".join(f'<option value="{v}"{" selected" * (v == chosen)}>{word}</option>' for v, word in options)
        legend = ""
        if self._span is not None:
            legend = "{:.4g}<i></i>{:.4g}".format(*self._span)
        return f"""<figure class="viewer" style="--high: {escape(high)}">
<canvas tabindex="0" role="img"
 aria-label="The part in three dimensions; arrow keys turn it, plus and minus zoom, Home resets"></canvas>
<img alt="The part" src="data:image/png;base64,{still}">
<svg class="axes" viewBox="-35 -35 70 70" aria-hidden="true">{lines}</svg>
<div class="scale" aria-hidden="true"><span data-part="length"></span><i data-part="bar"></i></div>
<div class="tools">
<label>Section <select name="axis"><option value="">none</option><option>x</option><option>y</option><option>z</option></select>
</label>
<label><input name="share" data-part="share" type="range" min="0" max="1" step="0.002" value="0.5" disabled
 aria-label="Position of the section"><output data-part="at"></output></label>
<label><input name="flip" type="checkbox">other side</label>
<label>Colour <select name="colours">{choices}</select></label>
<label data-part="steep" hidden>below
<input name="steep" type="range" min="0" max="90" value="45" aria-label="Angle of overhang">
<output data-part="angle">45°</output></label>
<span class="legend" data-part="legend"{"" if legend else " hidden"}>{legend}</span>
</div>
<script type="application/octet-stream">{self.packed}</script>
</figure>"""

    def html(self, title: str = "Part") -> str:
        """A whole page with the figure; it needs no network."""
        return page(title, self.figure("calc(100vh - 46px)"))

    def save(self, path: str | os.PathLike[str], title: str = "Part") -> None:
        """Writes the page to an .html file.

        Raises OSError if it cannot be written, ValueError for another suffix.
        """
        write_page(path, self.html(title))

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{escape(self.html())}" style="width: 100%; height: 520px; border: 0" '
            'sandbox="allow-scripts" title="The part in three dimensions"></iframe>'
        )


def page(title: str, body: str, more: str = "") -> str:
    """A page of its own with the viewer's style and program."""
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>{style()}{more}</style>\n</head>\n<body>\n{body}\n<script>\n{script()}</script>\n</body>\n</html>\n"
    )


def write_page(path: str | os.PathLike[str], text: str) -> None:
    """Writes a page to an .html file."""
    extension(path, ("html",))
    with whole_file(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as out:
        out.write(text)
