"""Histograms as SVG: text stays text, and every bar carries its numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape

__all__ = ["Chart", "label", "svg", "ticks"]

WIDTH, HEIGHT = 720, 380
#: Room to the left, right and below the axes, and above them for the titles and for each mark.
LEFT, RIGHT, BELOW, ABOVE, LINE = 76, 24, 56, 62, 17
INK, FAINT, BAR, MARK = "#28282c", "#dee0e4", "#c4814a", "#24548c"
FONT = 'font-family="system-ui, \'Segoe UI\', Helvetica, Arial, sans-serif" font-size="13"'


@dataclass
class Chart:
    """A histogram from 0 on."""

    #: What is shown, and its figures in one line.
    title: str
    facts: str
    #: What is on the two axes, with units.
    across: str
    up: str
    #: Ends of the bars, ascending, and the share of each bar (1 is all).
    edges: Sequence[float]
    share: Sequence[float]
    #: Positions on the horizontal axis that are marked, with their names.
    marks: Sequence[tuple[str, float]]
    #: What each share is compared with, drawn as a line across its bar; none where NaN.
    asked: Sequence[float] = ()


def svg(charts: Sequence[Chart]) -> str:
    """The histograms, one below the other."""
    height = HEIGHT * len(charts)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}" {FONT}>'
    parts = [head, f'<rect width="{WIDTH}" height="{height}" fill="white"/>']
    for i, chart in enumerate(charts):
        parts += [f'<g transform="translate(0 {i * HEIGHT})" fill="{INK}">', *_drawn(chart), "</g>"]
    return "\n".join([*parts, "</svg>\n"])


def _drawn(chart: Chart) -> Iterator[str]:
    marks = [m for m in chart.marks if math.isfinite(m[1])]
    top = ABOVE + LINE * len(marks)
    width, base = WIDTH - LEFT - RIGHT, HEIGHT - BELOW
    end = max(chart.edges) or 1.0
    rises = ticks(0, 100 * max(filter(math.isfinite, [*chart.share, *chart.asked])) or 1.0, 4)

    def x(v: float) -> float:
        return LEFT + width * min(max(v / end, 0), 1)

    def y(percent: float) -> float:
        return base - (base - top) * percent / rises[-1]

    yield label(LEFT, 24, chart.title, 'font-size="16" font-weight="bold"')
    yield label(LEFT, 44, chart.facts)
    for v in rises:
        yield f'<path d="M{LEFT} {y(v):.2f}h{width}" stroke="{FAINT}"/>'
        yield label(LEFT - 8, y(v) + 4, f"{v:g}", 'text-anchor="end"')
    bars = list(zip(chart.edges, chart.edges[1:], chart.share, strict=False))
    for low, high, share in bars:
        box = f'x="{x(low):.2f}" y="{y(100 * share):.2f}" width="{x(high) - x(low):.2f}" height="{base - y(100 * share):.2f}"'
        yield f'<rect {box} fill="{BAR}" stroke="white"><title>{low:.4g} to {high:.4g}: {100 * share:.3g} %</title></rect>'
    for (low, high, _), share in zip(bars, chart.asked, strict=False):
        if math.isfinite(share):
            yield f'<path d="M{x(low):.2f} {y(100 * share):.2f}H{x(high):.2f}" stroke="{MARK}" stroke-width="3"/>'
    yield f'<path d="M{LEFT} {base}h{width}" stroke="{INK}"/>'
    for v in (v for v in ticks(0, end, 8) if v <= end * (1 + 1e-9)):
        yield f'<path d="M{x(v):.2f} {base}v6" stroke="{INK}"/>'
        yield label(x(v), base + 21, f"{v:g}", 'text-anchor="middle"')
    yield label(LEFT + width / 2, base + 44, chart.across, 'text-anchor="middle"')
    middle = f"{(top + base) / 2:.2f}"
    yield label(-float(middle), 22, chart.up, 'text-anchor="middle" transform="rotate(-90)"')
    # Each name on a line of its own and over the lines of the others.
    rows = [(ABOVE + LINE * i, name, x(at)) for i, (name, at) in enumerate(marks)]
    for row, _, at in rows:
        yield f'<path d="M{at:.2f} {row - 10}V{base}" stroke="{MARK}" stroke-dasharray="4 3"/>'
    for row, name, at in rows:
        side, anchor = (-1, "end") if at > LEFT + 0.75 * width else (1, "start")
        about = side * 7 * len(name)
        yield f'<path d="M{at + 4 * side:.2f} {row - 12}h{about}v{LINE - 1}h{-about}z" fill="white"/>'
        yield label(at + 6 * side, row, name, f'text-anchor="{anchor}" fill="{MARK}"')


def label(x: float, y: float, words: str, style: str = "") -> str:
    """Words at a position."""
    return f'<text x="{x:.2f}" y="{y:.2f}"{" " * bool(style)}{style}>{escape(words)}</text>'


def ticks(low: float, high: float, about: int = 6) -> list[float]:
    """Marks of an axis that holds both numbers: multiples of 1, 2 or 5 times a power of ten, in at most ``about`` steps or two
    more. Equal numbers are held apart.
    """
    if low == high:
        low, high = low - (abs(low) or 1) / 2, high + (abs(high) or 1) / 2
    least = (high - low) / about
    unit = 10.0 ** math.floor(math.log10(least))
    step = next(k * unit for k in (1, 2, 5, 10) if k * unit >= least * (1 - 1e-9))
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [float(f"{i * step:.12g}") for i in range(first, last + 1)]
