"""Writes docs/generated/blend_cost.md: the processor time of blends against that of their lattices."""

import time
import warnings
from pathlib import Path

import trabecula as lt

OUT = Path(__file__).resolve().parent.parent / "docs" / "generated" / "blend_cost.md"
EDGE = 0.2
RUNS = 7
BOX = lt.region.box(size=[48, 24, 24])


def lattice(cell, part, wavelength=4.0, level=None):
    return lt.Lattice(cell, part, lt.map.affine(wavelength=wavelength), level or lt.level.fraction(0.3))


GRADED = lt.level.fraction(lt.grade.formula("0.3 + 0.003*y"))
BLENDS = {
    "networks, locked": [lattice("primitive", "upper"), lattice("gyroid", "upper")],
    "networks, drifting": [lattice("primitive", "upper"), lattice("gyroid", "upper", 4.1)],
    "sheet to network, locked": [lattice("gyroid", "sheet"), lattice("gyroid", "lower")],
    "sheets, drifting": [lattice("primitive", "sheet"), lattice("neovius", "sheet", 5.0)],
    "graded, drifting": [lattice("primitive", "upper", level=GRADED), lattice("gyroid", "upper", 4.1, GRADED)],
    "three networks, drifting": [
        lattice("primitive", "upper"),
        lattice("gyroid", "upper", 4.1),
        lattice("diamond", "upper", 4.3),
    ],
}
#: Share of the part in which more than one lattice counts: all of it, a transition of three cells, nothing.
WIDTHS = {"all": 48.0, "a quarter": 12.0}


def spent(designs):
    """Processor time (s) of building and meshing each on one thread: the least of rounds, as machines change their pace."""
    least = [float("inf")] * len(designs)
    for _ in range(RUNS):
        for i, design in enumerate(designs):
            start = time.process_time()
            design.build().mesh(edge=EDGE, threads=1)
            least[i] = min(least[i], time.process_time() - start)
    return least


def blended(lattices, width):
    names = "abc"[: len(lattices)]
    if len(names) == 2:
        weight = lt.grade.linear(along=[1, 0, 0], stops={-width / 2: 0, width / 2: 1})
        blend = lt.blend.between(*names, weight)
    else:
        half = width / 2
        rise = f"max(0, min(1, x/{half} + 1)) * max(0, min(1, 1 - x/{half}))"
        blend = lt.blend.of(
            {
                "a": lt.grade.formula(f"max(0, min(1, -x/{half}))"),
                "b": lt.grade.formula(rise),
                "c": lt.grade.formula(f"max(0, min(1, x/{half}))"),
            }
        )
    return lt.Design(region=BOX, lattice=dict(zip(names, lattices, strict=True)), blend=blend)


def main():
    warnings.simplefilter("ignore", lt.DesignWarning)
    rows = []
    for name, lattices in BLENDS.items():
        alone = [lt.Design(region=BOX, lattice={"a": one}) for one in lattices]
        times = spent(alone + [blended(lattices, width) for width in WIDTHS.values()])
        alone, found = times[: len(alone)], [t / sum(times[: len(alone)]) for t in times[len(alone) :]]
        rows.append(f"| {name} | {' + '.join(f'{t:.2f}' for t in alone)} | {' | '.join(f'{r:.2f}' for r in found)} |")
        print(rows[-1], flush=True)
    text = [
        "# What blends cost",
        "",
        "Written by `scripts/blend_cost.py`: a bar of 48 × 24 × 24 mm, cells of 4 to 5 mm, an edge of 0.2 mm, one thread,",
        "processor time of building and meshing. The ratio is that of the blend to the sum of its lattices, each filling the",
        "bar alone; the share is that of the bar in which more than one lattice counts.",
        "",
        "| blend | alone, s | " + " | ".join(f"ratio, {w}" for w in WIDTHS) + " |",
        "|---|---|---|---|",
        *rows,
    ]
    OUT.write_text("\n".join(text) + "\n", encoding="utf-8", newline="\n")
    print(OUT)


if __name__ == "__main__":
    main()
