"""Writes docs/generated/blend_by_normal_scores.md: how well blends of normal variables would hold the fraction.

Each cell's function is made a standard normal variable by its own distribution, g = Φ⁻¹(V(f)). The blend is solid where
Σ w g ≤ √(wᵀ C w) Φ⁻¹(Σ w p), with the correlations C of the place itself: the fraction is right wherever the g are jointly
normal.
"""

from pathlib import Path
from statistics import NormalDist

import numpy as np

OUT = Path(__file__).resolve().parent.parent / "docs" / "generated" / "blend_by_normal_scores.md"
TURN = 2 * np.pi
SAMPLES = 400_000
POINTS = 200_000
PLACES = 12
TO_NORMAL = np.array([NormalDist().inv_cdf((i + 0.5) / 20_000) for i in range(20_000)])


def primitive(u):
    return np.cos(u).sum(0)


def gyroid(u):
    (x, y, z) = u
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def iwp(u):
    (x, y, z), twice = np.cos(u), np.cos(2 * u).sum(0)
    return 2 * (x * y + y * z + z * x) - twice


CELLS = {"primitive": primitive, "gyroid": gyroid, "iwp": iwp}
PAIRS = [
    ("primitive", "gyroid", 4.0, 0.0),
    ("primitive", "gyroid", 4.1, 0.0),
    ("gyroid", "gyroid", 4.1, 0.0),
    ("gyroid", "gyroid", 4.0, 5.0),
    ("primitive", "iwp", 4.1, 0.0),
    ("iwp", "iwp", 4.1, 0.0),
]


def errors(first, second, length, degrees, rng):
    """The errors of fractions of 0.15 to 0.5 at shares of a quarter to three quarters, in windows at random places."""
    (c, s), found = (np.cos(np.radians(degrees)), np.sin(np.radians(degrees))), []
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    tables = [np.sort(CELLS[name](TURN * rng.random((3, SAMPLES)))) for name in (first, second)]
    for _ in range(PLACES):
        # A raised cosine, two of the larger cells wide at half its height.
        within = rng.random((3, POINTS))
        window = np.prod(1 - np.cos(TURN * within), axis=0)
        window /= window.sum()
        at = rng.uniform(-200, 200, (3, 1)) + 4 * length * within
        phases = (TURN * at / 4.0, TURN * (turn @ at) / length)
        values = [CELLS[name](u) for name, u in zip((first, second), phases, strict=True)]
        ranks = [np.searchsorted(t, v) / SAMPLES for t, v in zip(tables, values, strict=True)]
        g, h = (TO_NORMAL[np.clip((r * len(TO_NORMAL)).astype(int), 0, len(TO_NORMAL) - 1)] for r in ranks)
        correlation = (window * g * h).sum()
        for p in (0.15, 0.3, 0.5):
            level = NormalDist().inv_cdf(p)
            own = [(window * (v <= level)).sum() for v in (g, h)]
            for w in (0.25, 0.5, 0.75):
                spread = np.sqrt((1 - w) ** 2 + w**2 + 2 * w * (1 - w) * correlation)
                blend = (window * ((1 - w) * g + w * h <= spread * level)).sum()
                found.append(abs(blend - (1 - w) * own[0] - w * own[1]))
    return np.array(found)


def main():
    """Writes the table."""
    rng = np.random.default_rng(1)
    lines = ["| lattices | wavelengths, mm | turned by | mean error | largest |", "|---|---|---|---|---|"]
    for first, second, length, degrees in PAIRS:
        off = errors(first, second, length, degrees, rng)
        words = f"| {first}, {second} | 4, {length:g} | {degrees:g}° | {off.mean():.4f} | {off.max():.3f} |"
        lines.append(words)
    OUT.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
