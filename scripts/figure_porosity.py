#!/usr/bin/env python3
"""Remakes Figure 1 of "Equations for SPARTAN Gyroids and Diamonds": the level t against the porosity p.

Solid is f <= t. The curve is the exact table of the cell; the polynomials are the one printed in the note (diamond,
order nine) and least-squares fits in odd powers of p - 1/2 (both cells). Below each, the error: the porosity that the
polynomial's t realises minus the porosity asked for.

    python scripts/figure_porosity.py        writes docs/images/porosity.svg and docs/generated/porosity.md
"""

from pathlib import Path

import numpy as np
import trabecula

ROOT = Path(__file__).resolve().parent.parent
PRINTED = [
    -1.40181203e03,
    6.31442849e03,
    -1.20734024e04,
    1.27714436e04,
    -8.16588099e03,
    3.23757850e03,
    -7.84778926e02,
    1.09747587e02,
    -1.01136257e01,
    1.39501223e00,
]
BLUE, RED, GREEN, GREY = "#1f5fa8", "#c0392b", "#2a7f4f", "#8a8a8a"


def exact(cell, porosity):
    """t at which f <= t leaves this porosity."""
    return trabecula.iso(cell, 1 - porosity, part="lower")


def realised(cell, levels):
    """The porosity of f <= t."""
    return 1 - trabecula.fraction(cell, levels, part="lower")


def odd_fit(cell):
    """Coefficients c1, c3 ... c9 of t = sum c_k (p - 1/2)^k, least squares on 0.02 <= p <= 0.98."""
    p = np.linspace(0.02, 0.98, 481)
    powers = (p - 0.5)[:, None] ** np.arange(1, 10, 2)
    return np.linalg.lstsq(powers, exact(cell, p), rcond=None)[0]


class Panel:
    """One set of axes in the picture."""

    def __init__(self, box, across, up, title, label):
        self.box, self.across, self.up = box, across, up
        x, y, w, h = box
        self.parts = [f'<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="none" stroke="{GREY}"/>']
        self.text(x + w / 2, y - 10, title, 14, "middle", "bold")
        self.parts.append(
            f'<text x="{x - 62}" y="{y + h / 2}" font-size="13" text-anchor="middle" '
            f'transform="rotate(-90 {x - 62} {y + h / 2})">{label}</text>'
        )

    def at(self, u, v):
        x, y, w, h = self.box
        return (
            x + w * (u - self.across[0]) / (self.across[1] - self.across[0]),
            y + h * (self.up[1] - v) / (self.up[1] - self.up[0]),
        )

    def text(self, x, y, words, size=12, anchor="middle", weight="normal", colour="#222"):
        self.parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" font-weight="{weight}" '
            f'fill="{colour}">{words}</text>'
        )

    def ticks(self, along, up, form, words):
        x, y, w, h = self.box
        for u in along:
            px, _ = self.at(u, self.up[0])
            self.parts.append(f'<path d="M{px:.1f} {y} V{y + h}" stroke="#e4e4e4"/>')
            self.text(px, y + h + 18, f"{u:g}")
        for v in up:
            _, py = self.at(self.across[0], v)
            self.parts.append(f'<path d="M{x} {py:.1f} H{x + w}" stroke="#e4e4e4"/>')
            self.text(x - 8, py + 4, form.format(v), anchor="end")
        if words:
            self.text(x + w / 2, y + h + 40, words, 13)

    def curve(self, u, v, colour, dash="", width=2.0):
        points = " ".join("{:.2f},{:.2f}".format(*self.at(*q)) for q in zip(u, v, strict=True))
        self.parts.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-dasharray="{dash}"/>'
        )

    def key(self, entries):
        x, y, w, _ = self.box
        for i, (words, colour, dash) in enumerate(entries):
            top = y + 20 + 20 * i
            self.parts.append(
                f'<path d="M{x + w - 178} {top - 4} h30" stroke="{colour}" stroke-width="2" stroke-dasharray="{dash}"/>'
            )
            self.text(x + w - 140, top, words, anchor="start")


def picture(fits):
    """The figure as SVG text, and for each curve (cell, name, errors at P)."""
    p = np.linspace(0.005, 0.995, 199)
    panels, rows = [], []
    for column, cell in enumerate(("gyroid", "diamond")):
        left = 90 + 440 * column
        true = exact(cell, p)
        curves = [("odd fit of ours", np.polyval, GREEN, "7 4", fits[cell])]
        if cell == "diamond":
            curves.insert(0, ("printed, order nine", np.polyval, RED, "2 3", PRINTED))
        top = Panel((left, 40, 330, 270), (0, 1), (-1.6, 1.6), cell, "t")
        top.ticks((0, 0.25, 0.5, 0.75, 1), (-1.5, -1, -0.5, 0, 0.5, 1, 1.5), "{:g}", "")
        top.curve(p, true, BLUE, width=3)
        low = Panel((left, 360, 330, 180), (0, 1), (-0.004, 0.004), "", "realised − asked")
        low.ticks((0, 0.25, 0.5, 0.75, 1), (-0.004, -0.002, 0, 0.002, 0.004), "{:g}", "porosity p")
        entries = [("exact table", BLUE, "")]
        for name, evaluate, colour, dash, coefficients in curves:
            levels = evaluate(coefficients, p)
            error = realised(cell, levels) - p
            rows.append((cell, name, p, error))
            top.curve(p, levels, colour, dash)
            low.curve(p, np.clip(error, -0.004, 0.004), colour, dash)
            entries.append((name, colour, dash))
        top.key(entries)
        panels += [top, low]
    body = "\n".join(line for panel in panels for line in panel.parts)
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 890 600" width="890" height="600" '
        'font-family="Helvetica, Arial, sans-serif">\n<rect width="890" height="600" fill="#fff"/>\n'
        f"{body}\n</svg>\n"
    ), rows


def plain(odd):
    """Coefficients of p^9 ... p^0 of an odd polynomial in p - 1/2."""
    out = np.poly1d([0.0])
    for k, c in zip(range(1, 10, 2), odd, strict=True):
        out = out + c * np.poly1d([1, -0.5]) ** k
    return out.coeffs


def page(odd, rows):
    """The generated page."""
    lines = [
        "<!-- Made by scripts/figure_porosity.py; do not edit. -->",
        "# The level against the porosity",
        "",
        "![t against porosity for gyroid and diamond, with the errors of polynomials](../images/porosity.svg)",
        "",
        'Figure 1 of "Equations for SPARTAN Gyroids and Diamonds", remade: solid is f ≤ t. The blue line is the exact',
        "table; below, the porosity realised by a polynomial's t minus the porosity asked for.",
        "[Errata](../concepts/errata.md).",
        "",
        "| cell | polynomial | largest error, 0.005 ≤ p ≤ 0.995 | rms | largest, 0.05 ≤ p ≤ 0.95 |",
        "|---|---|---|---|---|",
    ]
    for cell, name, p, error in rows:
        inner = (p >= 0.05) & (p <= 0.95)
        rms = np.sqrt(np.mean(error**2))
        lines.append(f"| {cell} | {name} | {np.abs(error).max():.5f} | {rms:.5f} | {np.abs(error[inner]).max():.5f} |")
    lines += ["", "The fits, t = Σ cₖ (p − ½)ᵏ for odd k, least squares on 0.02 ≤ p ≤ 0.98:", ""]
    lines += ["| cell | c₁ | c₃ | c₅ | c₇ | c₉ |", "|---|---|---|---|---|---|"]
    lines += [f"| {cell} | " + " | ".join(f"{c:.6g}" for c in odd[cell]) + " |" for cell in odd]
    lines += ["", "The gyroid's in the note's form, p⁹ … p⁰:", ""]
    lines += ["`" + ", ".join(f"{c:.9g}" for c in plain(odd["gyroid"])) + "`", ""]
    return "\n".join(lines)


def main():
    """Write the figure and the page."""
    odd = {cell: odd_fit(cell) for cell in ("gyroid", "diamond")}
    svg, rows = picture({cell: plain(c) for cell, c in odd.items()})
    for path, text in (("docs/images/porosity.svg", svg), ("docs/generated/porosity.md", page(odd, rows))):
        target = ROOT / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text, encoding="utf-8")
        print(target)


if __name__ == "__main__":
    main()
