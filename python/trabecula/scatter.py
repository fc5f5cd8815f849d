"""Two columns of a table against each other as SVG, a third as colour, and the designs that none beats in both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any

from .chart import BELOW, FAINT, FONT, INK, LEFT, MARK, label, ticks

__all__ = ["front_of", "scatter"]

WIDTH, HEIGHT, RIGHT, TOP = 720, 480, 110, 40
#: Colours from least to greatest, even in lightness (after viridis).
COLOURS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))


def scatter(
    columns: Mapping[str, Sequence], x: str, y: str, colour: str | None = None, front: tuple[str, str] | None = None
) -> str:
    """The drawing. ``front`` says which of x and y is better, "min" or "max" each, and draws the Pareto front.

    Raises ValueError for columns that are not there or hold no numbers.
    """
    wanted = [x, y, *([colour] if colour else [])]
    for name in wanted:
        if name not in columns:
            numbers = [n for n, column in columns.items() if any(_is_number(v) for v in column)]
            raise ValueError(f'there is no column "{name}"; with numbers there are {", ".join(numbers) or "none"}')
    rows = [row for row in zip(*(columns[name] for name in wanted), strict=True) if all(map(_is_number, row))]
    if not rows:
        raise ValueError(f"no design has numbers in all of {', '.join(wanted)}")
    across, up = (ticks(min(row[k] for row in rows), max(row[k] for row in rows)) for k in (0, 1))
    drawn = list(_drawn(rows, wanted, across, up, front))
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" {FONT}>'
    return "\n".join([head, f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', *drawn, "</svg>\n"])


def front_of(points: Sequence[tuple[float, float]], better: tuple[str, str]) -> list[int]:
    """Indices of the points that none is at least as good as in both and better than in one, by x; of equal ones the first."""
    signs = [1 if way == "min" else -1 for way in better]
    order = sorted(range(len(points)), key=lambda i: (signs[0] * points[i][0], signs[1] * points[i][1], i))
    kept, best = [], math.inf
    for i in order:
        value = signs[1] * points[i][1]
        if value < best:
            best = value
            kept.append(i)
    return sorted(kept, key=lambda i: points[i][0])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _drawn(rows: list, names: list[str], across: list[float], up: list[float], front: tuple[str, str] | None) -> Iterator[str]:
    width, height = WIDTH - LEFT - RIGHT, HEIGHT - TOP - BELOW
    base = TOP + height

    def px(v: float) -> float:
        return LEFT + width * (v - across[0]) / (across[-1] - across[0])

    def py(v: float) -> float:
        return base - height * (v - up[0]) / (up[-1] - up[0])

    for v in up:
        yield f'<path d="M{LEFT} {py(v):.2f}h{width}" stroke="{FAINT}"/>'
        yield label(LEFT - 8, py(v) + 4, f"{v:g}", f'text-anchor="end" fill="{INK}"')
    for v in across:
        yield f'<path d="M{px(v):.2f} {TOP}V{base + 6}" stroke="{FAINT}"/>'
        yield label(px(v), base + 21, f"{v:g}", f'text-anchor="middle" fill="{INK}"')
    yield label(LEFT + width / 2, base + 44, names[0], f'text-anchor="middle" fill="{INK}"')
    middle = TOP + height / 2
    yield label(-middle, 16, names[1], f'text-anchor="middle" transform="rotate(-90)" fill="{INK}"')
    shades = [row[2] for row in rows] if len(names) > 2 else []
    low, high = (min(shades), max(shades)) if shades else (0.0, 1.0)
    if front:
        best = [rows[i] for i in front_of([row[:2] for row in rows], front)]
        path = "L".join(f"{px(row[0]):.2f} {py(row[1]):.2f}" for row in best)
        yield f'<path d="M{path}" fill="none" stroke="{MARK}" stroke-width="1.5"/>'
        yield label(
            LEFT, 24, f"{len(best)} of {len(rows)} designs on the Pareto front: {names[0]} {front[0]}, {names[1]} {front[1]}"
        )
    for row in rows:
        fill = _colour((row[2] - low) / ((high - low) or 1)) if shades else "#c4814a"
        words = ", ".join(f"{name} {value:.6g}" for name, value in zip(names, row, strict=True))
        yield f'<circle cx="{px(row[0]):.2f}" cy="{py(row[1]):.2f}" r="4" fill="{fill}"><title>{escape(words)}</title></circle>'
    if shades:
        yield from _legend(names[2], low, high)


def _legend(name: str, low: float, high: float) -> Iterator[str]:
    """A bar of the colours with their least and greatest value."""
    left, top, steps, tall = WIDTH - RIGHT + 24, TOP + 20, 40, 6
    yield label(left, TOP + 6, name if len(name) <= 13 else name[:12] + "…")
    for i in range(steps):
        yield f'<rect x="{left}" y="{top + tall * i}" width="16" height="{tall + 0.5}" fill="{_colour(1 - i / (steps - 1))}"/>'
    yield label(left + 22, top + 10, f"{high:.4g}")
    yield label(left + 22, top + steps * tall, f"{low:.4g}")


def _colour(u: float) -> str:
    """The colour at ``u`` from 0 to 1."""
    place = min(max(u, 0.0), 1.0) * (len(COLOURS) - 1)
    i = min(int(place), len(COLOURS) - 2)
    mixed = (round(a + (b - a) * (place - i)) for a, b in zip(COLOURS[i], COLOURS[i + 1], strict=True))
    return "#" + "".join(f"{v:02x}" for v in mixed)
