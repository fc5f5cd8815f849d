"""Two columns of a table against each other as SVG, a third as colour (numbers, or texts), and the designs that none beats."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

from ..pictures.chart import BELOW, FAINT, FONT, INK, LEFT, MARK, label, ticks
from .rows import unit_of_column

__all__ = ["front_of", "scatter", "without_place"]

WIDTH, HEIGHT, RIGHT, TOP = 720, 480, 110, 56
#: Colours from least to greatest, even in lightness (after viridis).
COLOURS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))
#: Colours of texts, which all can tell apart (M. Okabe, K. Ito, Color universal design, 2008), and that of what is left.
KINDS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#28282c", "#f0e442")
OTHERS = "#a0a0a8"
#: Letters that the legend has room for in a line.
ROOM = 14


def scatter(
    columns: Mapping[str, Sequence], x: str, y: str, colour: str | None = None, *, front: tuple[str, str] | None = None
) -> str:
    """The drawing. A ``colour`` of texts has a colour for each text. ``front`` says which of x and y is better, "min" or "max"
    each, and draws the Pareto front.

    Raises ValueError for columns that are not there or hold no numbers.
    """
    wanted = [x, y, *([colour] if colour else [])]
    for name in wanted:
        if name not in columns:
            numbers = [n for n, column in columns.items() if any(_is_number(v) for v in column)]
            raise ValueError(f'there is no column "{name}"; with numbers there are {", ".join(numbers) or "none"}')
    rows = _rows(columns, wanted)
    if not rows:
        raise ValueError(f"no design has numbers in all of {', '.join(wanted)}")
    across, up = (ticks(min(row[k] for row in rows), max(row[k] for row in rows)) for k in (0, 1))
    drawn = list(_drawn(rows, wanted, across, up, front, without_place(columns, *wanted)))
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 {WIDTH} {HEIGHT}" {FONT}>'
    return "\n".join([head, f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', *drawn, "</svg>\n"])


def without_place(columns: Mapping[str, Sequence], *wanted: str) -> str:
    """How many designs have no number in one of these columns and are left out, in words; nothing where none is."""
    count = len(columns[wanted[0]])
    out = count - len(_rows(columns, wanted))
    return f"{out} of {count} designs left out, which lack a number" if out else ""


def _rows(columns: Mapping[str, Sequence], wanted: Sequence[str]) -> list[tuple]:
    """The rows that have a place in a drawing of these columns; texts of the third one as they are, where it holds any."""
    rows = list(zip(*(columns[name] for name in wanted), strict=True))
    if any(isinstance(row[2], str) and row[2] for row in rows if len(row) > 2):
        rows = [(*row[:2], _category(row[2])) for row in rows]
        return [row for row in rows if all(map(_is_number, row[:2]))]
    return [row for row in rows if all(map(_is_number, row))]


def _category(value: Any) -> str:
    """A value of a column of texts, as text."""
    return "none" if value is None or value == "" else f"{value:g}" if _is_number(value) else str(value)


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


def _named(name: str, room: int = 1000) -> str:
    """The name of a column with its unit, as it stands at an axis; in as few letters as there is ``room`` for, of a path the
    last keys.
    """
    unit = unit_of_column(name)
    for end in ("_mm", "_mm2", "_mm3"):
        name = name.removesuffix(end) if unit else name
    words = f"{name} ({unit})" if unit else name
    while len(words) > room and "." in name:
        name = name.partition(".")[2]
        words = f"{name} ({unit})" if unit else name
    return words if len(words) <= room else words[: room - 1] + "…"


def _drawn(
    rows: list[tuple], names: list[str], across: list[float], up: list[float], front: tuple[str, str] | None, out: str
) -> Iterator[str]:
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
    yield label(LEFT + width / 2, base + 44, _named(names[0]), f'text-anchor="middle" fill="{INK}"')
    middle = TOP + height / 2
    yield label(-middle, 16, _named(names[1]), f'text-anchor="middle" transform="rotate(-90)" fill="{INK}"')
    said = [out] if out else []
    if front:
        best = [rows[i] for i in front_of([row[:2] for row in rows], front)]
        path = "L".join(f"{px(row[0]):.2f} {py(row[1]):.2f}" for row in best)
        yield f'<path d="M{path}" fill="none" stroke="{MARK}" stroke-width="1.5"/>'
        words = f"{len(best)} of {len(rows)} designs on the Pareto front: {names[0]} {front[0]}, {names[1]} {front[1]}"
        said.insert(0, words)
    for i, words in enumerate(said):
        yield label(LEFT, 24 + 18 * i, words)
    colour, legend = _key(names[2], [row[2] for row in rows]) if len(names) > 2 else (lambda _: "#c4814a", ())
    for row in rows:
        shown = (f"{value:.6g}" if _is_number(value) else value for value in row)
        words = ", ".join(f"{name} {value}" for name, value in zip(names, shown, strict=True))
        fill = colour(row[-1])
        yield f'<circle cx="{px(row[0]):.2f}" cy="{py(row[1]):.2f}" r="4" fill="{fill}"><title>{escape(words)}</title></circle>'
    yield from legend


def _key(name: str, values: list) -> tuple[Callable[[Any], str], Iterator[str]]:
    """The colour of each value of a column, and the legend: a bar for numbers, a dot for each of a few texts."""
    if not any(isinstance(value, str) for value in values):
        low, high = min(values), max(values)
        return lambda value: _colour((value - low) / ((high - low) or 1)), _bar(name, low, high)
    texts = list(dict.fromkeys(values))
    colours = dict(zip(texts, KINDS, strict=False))
    shown = [(text, colours[text]) for text in texts if text in colours]
    if len(texts) > len(KINDS):
        shown.append((f"{len(texts) - len(KINDS)} others", OTHERS))
    return lambda value: colours.get(value, OTHERS), _dots(name, shown)


def _dots(name: str, shown: list[tuple[str, str]]) -> Iterator[str]:
    """Dots in the colours of texts."""
    left, top, tall = WIDTH - RIGHT + 12, TOP + 20, 20
    yield label(left, TOP + 6, _named(name, ROOM))
    for i, (text, fill) in enumerate(shown):
        words = text if len(text) <= ROOM - 2 else text[: ROOM - 3] + "…"
        y = top + tall * i + 6
        yield f'<circle cx="{left + 6}" cy="{y}" r="4" fill="{fill}"><title>{escape(text)}</title></circle>'
        yield label(left + 16, y + 4, words)


def _bar(name: str, low: float, high: float) -> Iterator[str]:
    """A bar of the colours with their least and greatest value."""
    left, top, steps, tall = WIDTH - RIGHT + 24, TOP + 20, 40, 6
    yield label(left - 12, TOP + 6, _named(name, ROOM))
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
