"""Curves through points against a common horizontal axis as SVG, in panels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

from .chart import FAINT, FONT, INK, label, ticks

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from ..base.given import Vector
    from ..laws import Law

__all__ = ["Curve", "Panel", "law_plots", "panels"]

WIDTH, HEIGHT, LEFT, RIGHT, ABOVE, BELOW = 460, 320, 64, 112, 34, 44
#: Distinct also to those who see fewer colours (after Okabe and Ito); dashes where there are more curves.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#28282c")
DASHES = ("", "6 3", "2 2", "8 3 2 3")
#: Height of a row of the legend and width of a letter in it, px.
ROW, LETTER = 16, 6.2


@dataclass
class Curve:
    """A line through points, or points alone where there are no positions of a line."""

    name: str
    #: Where it was found.
    x: Vector
    y: Vector
    #: Positions of a line, and the values there.
    along: Vector = ()
    values: Vector = ()


@dataclass
class Panel:
    """A plot of curves."""

    title: str
    across: str
    curves: Sequence[Curve]
    #: Whether the vertical axis is logarithmic.
    log: bool = False


def panels(of: Sequence[Panel], wide: int = 2) -> str:
    """The panels in rows of ``wide``."""
    columns, rows = min(wide, len(of)), math.ceil(len(of) / wide)
    longest = max((len(c.name) for panel in of for c in panel.curves), default=0)
    legend = max(RIGHT, math.ceil(34 + LETTER * longest))
    width = WIDTH - RIGHT + legend
    x, y = width * columns, HEIGHT * rows
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{x}" height="{y}" viewBox="0 0 {x} {y}" {FONT}>'
    parts = [head, f'<rect width="{x}" height="{y}" fill="white"/>']
    for i, panel in enumerate(of):
        parts += [
            f'<g transform="translate({width * (i % wide)} {HEIGHT * (i // wide)})" fill="{INK}">',
            *_drawn(panel, WIDTH - RIGHT),
            "</g>",
        ]
    return "\n".join([*parts, "</svg>\n"])


def _good(x: float, y: float, log: bool) -> bool:
    return math.isfinite(x) and math.isfinite(y) and (y > 0 or not log)


def _drawn(panel: Panel, right: int) -> Iterator[str]:
    """A panel whose plot ends at ``right``, where its legend begins."""
    pairs = [(x, y) for c in panel.curves for x, y in [*zip(c.x, c.y, strict=True), *zip(c.along, c.values, strict=True)]]
    pairs = [pair for pair in pairs if _good(*pair, panel.log)]
    yield label(LEFT, 20, panel.title, 'font-weight="bold"')
    if not pairs:
        yield label(LEFT, 60, "no numbers")
        return
    across = ticks(min(x for x, _ in pairs), max(x for x, _ in pairs))
    low, high = min(y for _, y in pairs), max(y for _, y in pairs)
    up = _decades(low, high) if panel.log else ticks(min(low, 0.0), high)
    scale = math.log10 if panel.log else float
    base = HEIGHT - BELOW
    step = min(ROW, (HEIGHT - ABOVE - 14) / max(len(panel.curves), 1))

    def px(x: float) -> float:
        return LEFT + (right - LEFT) * (x - across[0]) / (across[-1] - across[0])

    def py(y: float) -> float:
        return base - (base - ABOVE) * (scale(y) - scale(up[0])) / (scale(up[-1]) - scale(up[0]))

    for v in up:
        yield f'<path d="M{LEFT} {py(v):.2f}H{right}" stroke="{FAINT}"/>'
        yield label(LEFT - 6, py(v) + 4, f"{v:g}", 'text-anchor="end"')
    for v in across:
        yield f'<path d="M{px(v):.2f} {base}v5" stroke="{INK}"/>'
        yield label(px(v), base + 19, f"{v:g}", 'text-anchor="middle"')
    yield f'<path d="M{LEFT} {base}H{right}" stroke="{INK}"/>'
    yield label((LEFT + right) / 2, HEIGHT - 8, panel.across, 'text-anchor="middle"')
    for i, curve in enumerate(panel.curves):
        colour, dash = COLOURS[i % len(COLOURS)], DASHES[i // len(COLOURS) % len(DASHES)]
        line = [(x, y) for x, y in zip(curve.along, curve.values, strict=True) if _good(x, y, panel.log)]
        if line:
            path = "L".join(f"{px(x):.2f} {py(y):.2f}" for x, y in line)
            yield f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dash or "none"}"/>'
        for x, y in zip(curve.x, curve.y, strict=True):
            if _good(x, y, panel.log):
                words = escape(f"{curve.name}: {x:.4g}, {y:.5g}")
                yield f'<circle cx="{px(x):.2f}" cy="{py(y):.2f}" r="2.6" fill="{colour}"><title>{words}</title></circle>'
        row = ABOVE + 10 + step * i
        drawn = f'stroke="{colour}" stroke-width="2" stroke-dasharray="{dash or "none"}"'
        yield f'<path d="M{right + 10} {row - 4:.2f}h16" {drawn}/>'
        yield label(right + 30, row, curve.name, f'font-size="{min(11, round(step))}"')


def _decades(low: float, high: float) -> list[float]:
    """Powers of ten around the values, with 2 and 5 times them where there are few."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    if last - first > 2:
        return [10.0**i for i in range(first, last + 1)]
    marks = [k * 10.0**i for i in range(first, max(last, first + 1) + 1) for k in (1, 2, 5)]
    below, above = [m for m in marks if m <= low], [m for m in marks if m >= high]
    return [float(f"{m:.12g}") for m in marks if below[-1] <= m <= above[0]]


def law_plots(law: Law) -> str:
    """The plots of a law: each column with its interpolation, and powers of the fraction as lines of their own."""
    import numpy as np

    x = law.columns["fraction"]

    def curve(column: str, name: str) -> Curve:
        y = law.columns[column]
        known = x[np.isfinite(y)]
        if len(known) < 2:
            return Curve(name, x, y)
        along = np.linspace(known[0], known[-1], 121)
        return Curve(name, x, y, along, law.at(column, along))

    def power(column: str) -> list[Curve]:
        if column not in law.fits:
            return []
        fit = law.fits[column]
        along = np.linspace(x[0], x[-1], 121)
        name = f"{fit['coefficient']:.3g} φ^{fit['exponent']:.3g}"
        return [Curve(name, (), (), along, fit["coefficient"] * along ** fit["exponent"])]

    across = f"solid fraction φ of {law.cell} {law.part}"
    known = law.columns
    made = []
    if "E" in known:
        stiff = [curve("E", "E"), curve("G", "G"), curve("bulk", "bulk"), *power("E")]
        made += [Panel("Moduli over E of the solid", across, stiff, log=True)]
        made += [Panel("Zener's ratio 2 C44 / (C11 - C12)", across, [curve("zener", "zener")])]
    if "k" in known:
        made += [Panel("Conductivity over the solid's", across, [curve("k", "k"), *power("k")])]
    if "K" in known:
        made += [Panel("Permeability over wavelength²", across, [curve("K", "K")], log=True)]
    if "area" in known:
        made += [Panel("Area of the wall × wavelength / volume", across, [curve("area", "area")])]
    return panels(made)
