"""A mesh to turn in a browser or a notebook: a page of its own, without a network."""

from __future__ import annotations

import base64
import json
import os
import zlib
from functools import cached_property
from html import escape
from importlib.resources import files

from ..base.files import extension, write_text
from ..base.given import number
from .camera import towards
from .drawn import NO_VALUE, WALL, Drawn, numbers, scale_of
from .nearest_vertex import nearest_vertices

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from ..mesh import Mesh
    from ..solid import Solid
    from .seen import Seen
    from .widget import Widget

    Progress = Callable[[int, int], Any]
    #: Numbers at points (n, 3) in mm.
    At = Callable[[NDArray], ArrayLike]

__all__ = ["View", "script", "style", "view"]

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


#: What of a view can be set and read, and its limits.
NAMES = ("section", "azimuth", "elevation", "zoom", "overhang", "color")
LIMITS = {"azimuth": (-1e6, 1e6), "elevation": (-90.0, 90.0), "zoom": (0.2, 200.0), "overhang": (0.0, 90.0)}
COLORS = ("faces", "overhang", "values")
#: The word for values that are computed of any mesh.
THICKNESS = "thickness"


def view(
    shape: Mesh | Solid,
    values: ArrayLike | At | str | None = None,
    label: str = "",
    edge: float | None = None,
    per_cell: float | None = None,
    **look: Any,
) -> View:
    """A mesh or a solid to turn in a notebook; see ``View``. A solid is meshed at a spacing as for ``Solid.mesh``, and has more
    words for ``values``, see ``Solid.view``.

    Raises TypeError for anything else, ValueError for values that are not one number for each vertex.
    """
    from .seen import Seen

    solid = None
    if isinstance(shape, Seen):
        solid, shape = shape, shape.mesh(edge=edge, per_cell=per_cell)
        if isinstance(values, str) and values != THICKNESS:
            values, label = _of_solid(solid, shape, values, label)
    elif edge is not None or per_cell is not None:
        raise ValueError("edge and per_cell are for a solid, which is meshed; this is a mesh")
    if not isinstance(shape, Drawn):
        raise TypeError(f"view takes a Mesh or a Solid, found {type(shape).__name__}")
    made = View(shape, values, label, **look)
    made._solid = solid
    return made


def _of_solid(solid: Seen, mesh: Mesh, show: str, label: str) -> tuple[At, str]:
    """What a solid shows as a number at points, and what it is. A ValueError for what is none."""
    from .shown import look

    given = look(solid, show)(mesh, (0.0, 0.0, 1.0))
    if not callable(given.get("color")):
        raise ValueError(f'values is "{show}", which is no number at points; `render` shows it')
    return given["color"], label or given["label"]


def checked(view: View, name: str, value: Any) -> Any:
    """What of a view is to be, in its normal form.

    Raises ValueError for what cannot be shown.
    """
    if name == "section":
        if not value:
            return ""
        (normal, offset) = view.mesh._plane(value, towards(view.azimuth, view.elevation), ends=True)
        side = sum(normal)
        return f"{'xyz'[[abs(v) for v in normal].index(1)]}{'<' if side > 0 else '>'}{side * offset:.7g}"
    if name == "color":
        known = COLORS if view.colored else COLORS[:2]
        if value not in known:
            raise ValueError(f"color is {value!r}; it must be one of {', '.join(known)}")
        return value
    low, high = LIMITS[name]
    found = number(name, value)
    if not low <= found <= high:
        raise ValueError(f"{name} is {found:g}; it must be from {low:g} to {high:g}")
    return found


def _part(name: str, words: str) -> property:
    def get(self: View) -> Any:
        return self.look[name]

    def put(self: View, value: Any) -> None:
        self.look[name] = checked(self, name, value)
        if self._widget is not None:
            setattr(self._widget, name, self.look[name])

    return property(get, put, doc=words)


class View:
    """A mesh to turn: by the pointer, fingers or arrow keys; with a section plane, and colours by the faces that the region
    cut, by the angle of overhang, or by ``values``: a number for each vertex that ``label`` names, a function of points (n, 3)
    in mm that gives such numbers, or ``"thickness"`` for the local thickness of walls. A notebook shows it, with anywidget
    (extra ``notebook``) as a widget; ``save`` makes a page or a picture. Of a mesh of more than 150,000 triangles a lighter one
    is shown, whose vertices have the values of the nearest ones of the mesh; while it is made ``progress(done, total)`` is
    called. ``section``, ``azimuth``, ``elevation``, ``zoom``, ``overhang`` and ``color`` are how it is seen at first; in a
    widget what is set is shown at once, and what the user turns can be read. Triangles with a corner that has no finite
    value are grey.

    Raises ValueError for values that are not one number for each vertex or of which none is finite, and for a look that
    cannot be.
    """

    def __init__(
        self,
        mesh: Mesh,
        values: ArrayLike | At | str | None = None,
        label: str = "",
        progress: Progress | None = None,
        **look: Any,
    ):
        self.mesh = mesh
        self._computed = isinstance(values, str)
        if isinstance(values, str) and values != THICKNESS:
            words = f'numbers, one for each vertex, a function of points, or "{THICKNESS}"'
            raise ValueError(f'values is "{values}"; it must be {words}')
        self.label = label or (WALL if self._computed else "")
        self._at: At | None = values if callable(values) else None
        self._values: NDArray[np.float64] | None = None
        if not (values is None or isinstance(values, str) or callable(values)):
            self._values = numbers("values", values, (mesh.counts[0], "vertex"))
            scale_of("values", self._values)
        self._solid: Solid | None = None
        self._progress = progress
        self._widget: Widget | None = None
        self.look: dict[str, Any] = {
            "section": "",
            "azimuth": 30.0,
            "elevation": 25.0,
            "zoom": 1.0,
            "overhang": 45.0,
            "color": "values" if self.colored else "faces",
        }
        for name in look:
            if name not in NAMES:
                raise TypeError(f"a view has no {name!r}; it has {', '.join(NAMES)}")
        # The side that a section keeps depends on the camera.
        for name in sorted(look, key=lambda name: name == "section"):
            setattr(self, name, look[name])

    section = _part("section", 'What is kept: ``"z<4"``, ``"z>4"``, mm, or by ``"z=4"`` what is farther from the eye.')
    azimuth = _part("azimuth", "Degrees about +z from which it is seen.")
    elevation = _part("elevation", "Degrees above the xy plane from which it is seen.")
    zoom = _part("zoom", "How many times larger than the whole part in the picture.")
    overhang = _part("overhang", "Degrees to the horizontal below which faces are coloured as overhanging.")
    color = _part("color", '``"faces"``, ``"overhang"``, or ``"values"`` where there are some.')

    @property
    def colored(self) -> bool:
        """Whether it has values."""
        return self._computed or self._at is not None or self._values is not None

    @property
    def widget(self) -> Widget:
        """The widget, made when it is first asked for; its traits are what a view has.

        Raises ImportError without anywidget.
        """
        if self._widget is None:
            try:
                from .widget import Widget
            except ImportError:
                raise ImportError("anywidget is not installed: pip install 'trabecula[notebook]'", name="anywidget") from None
            self._widget = Widget(self)
        return self._widget

    @cached_property
    def values(self) -> NDArray | None:
        """The values at the vertices of the mesh that is shown, None without."""
        shown = self._light
        if self._at is not None:
            return numbers("values", self._at(shown.vertices), (shown.counts[0], "vertex"))
        if self._computed:
            return shown.thickness_at_vertices(progress=self._progress)
        return self._values if self._values is None or shown is self.mesh else self._values[nearest_vertices(self.mesh, shown)]

    @cached_property
    def _light(self) -> Mesh:
        """The mesh, made lighter if it is large and sound."""
        mesh = self.mesh
        if mesh.counts[1] <= LIGHT or mesh.defects or mesh.self_intersections:
            return mesh
        return mesh.simplified(triangles=LIGHT, progress=self._progress)

    @cached_property
    def _span(self) -> tuple[float, float] | None:
        """The ends of the scale of values."""
        return None if self.values is None else scale_of("values", self.values)

    @cached_property
    def _missing(self) -> NDArray[np.bool_] | None:
        """Which vertices have no finite value; None where all have."""
        import numpy as np

        missing = None if self.values is None else ~np.isfinite(self.values)
        return missing if missing is not None and missing.any() else None

    @cached_property
    def stream(self) -> bytes:
        """The mesh as bytes: a DEFLATE stream of a line of JSON (``vertices``, ``triangles``, ``min``, ``max`` in mm,
        ``span`` of values or null, whether some are ``missing``), then positions (3 × uint16 of the bounds each,
        little-endian), triangles (3 × uint32 each), whether each triangle is on the region's surface (uint8), values (uint16
        of the span) if there are any, and whether each vertex has none (uint8) if some are missing.
        """
        import numpy as np

        mesh = self._light
        low, high = (np.array(b) for b in mesh.bounds)
        extent = np.where(high > low, high - low, 1.0)
        places = np.rint((mesh.vertices - low) / extent * STEPS).astype("<u2")
        parts = [places.tobytes(), mesh.triangles.astype("<u4").tobytes(), mesh.cut.astype("u1").tobytes()]
        span = self._span
        if self.values is not None and span is not None:
            share = (np.where(np.isfinite(self.values), self.values, span[0]) - span[0]) / (span[1] - span[0])
            parts.append(np.rint(share.clip(0, 1) * STEPS).astype("<u2").tobytes())
        if self._missing is not None:
            parts.append(self._missing.astype("u1").tobytes())
        head = {"vertices": mesh.counts[0], "triangles": mesh.counts[1], "min": list(low), "max": list(high), "span": span}
        head["missing"] = self._missing is not None
        return zlib.compress(json.dumps(head).encode() + b"\n" + b"".join(parts), 9)

    @cached_property
    def packed(self) -> str:
        """``stream`` as text, base64."""
        return base64.b64encode(self.stream).decode()

    def figure(self, high: str = "62vh") -> str:
        """The figure for a page that has ``style()`` and ``script()``, with the mesh; ``high`` is its height in CSS."""
        look = escape(json.dumps(self.look))
        mesh = f'<script type="application/octet-stream" data-look="{look}">{self.packed}</script>'
        return self.markup(high).replace("</figure>", f"{mesh}\n</figure>")

    def markup(self, high: str) -> str:
        """The figure without the mesh."""
        still = base64.b64encode(self.mesh._png).decode()
        lines = "".join(
            f'<g data-part="{name}"><line stroke="{colour}" stroke-width="2"/><text text-anchor="middle" dy=".35em" '
            f'fill="currentColor">{name}</text></g>'
            for name, colour in (("x", "#d1483c"), ("y", "#3c9d4e"), ("z", "#3a72d8"))
        )
        label = escape(self.label or "value")
        words = ("region's faces", "overhang", label)[: len(COLORS) if self.colored else 2]
        chosen = COLORS.index(self.color)
        choices = "".join(f'<option value="{v}"{" selected" * (v == chosen)}>{word}</option>' for v, word in enumerate(words))
        legend = ""
        if self._span is not None:
            legend = "{:.4g}<i></i>{:.4g}".format(*self._span) + (f" ({NO_VALUE})" if self._missing is not None else "")
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
</figure>"""

    def html(self, title: str = "Part") -> str:
        """A whole page with the figure; it needs no network."""
        return page(title, self.figure("calc(100vh - 46px)"))

    def save(self, path: str | os.PathLike[str], title: str = "Part", size: tuple[int, int] = (1600, 1200)) -> None:
        """Writes the page to an .html file; or a picture of the whole mesh to a .png or .svg file, ``size`` pixels large,
        with the section, the colours and from the side that are seen now; the view of a solid is shaded by the normals of its
        field.

        Raises OSError if it cannot be written, ValueError for another suffix.
        """
        kind = extension(path, ("html", "png", "svg"))
        if kind == "html":
            write_page(path, self.html(title))
            return
        colors: dict[str, Any] = {}
        if self.color == "values":
            colors = {"color": self._shown(), "label": self.label}
        elif self.color == "overhang":
            colors = {"color": "overhang", "span": (0.0, self.overhang or 1e-3)}
        cut = self.section or None
        self.mesh.render(path, size, self.azimuth, self.elevation, section=cut, solid=self._solid, **colors)

    def _shown(self) -> Any:
        """Its values, as ``Mesh.png`` takes them."""
        if self._computed:
            return THICKNESS
        return self._values if self._at is None else self._at

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> Any:
        # Where no widget is known, such as on a site that shows notebooks, the still picture stands for it.
        if not has_widgets():
            return None
        bundle = self.widget._repr_mimebundle_(include=include, exclude=exclude)
        data, meta = bundle if isinstance(bundle, tuple) else (bundle or {}, {})
        return {"image/png": base64.b64encode(self.mesh._png).decode(), **data}, meta

    def _repr_html_(self) -> str | None:
        if has_widgets():
            return None
        return (
            f'<iframe srcdoc="{escape(self.html())}" style="width: 100%; height: 520px; border: 0" '
            'sandbox="allow-scripts" title="The part in three dimensions"></iframe>'
        )


def has_widgets() -> bool:
    """Whether a notebook's widgets can be made."""
    try:
        import anywidget  # noqa: F401
    except ImportError:
        return False
    return True


def page(title: str, body: str, more: str = "") -> str:
    """A page of its own with the viewer's style and program."""
    return (
        f'<!doctype html>\n<html lang="en" class="page">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>{style()}{more}</style>\n</head>\n<body>\n{body}\n<script>\n{script()}viewAll();\n</script>\n</body>\n</html>\n"
    )


def write_page(path: str | os.PathLike[str], text: str) -> None:
    """Writes a page to an .html file."""
    extension(path, ("html",))
    write_text(path, text)
