"""Writes docs/generated/tets_fit.md: how tetrahedral meshes of regions fit them, and the volume of lattices over them.

python scripts/tets_fit.py [MESH ...]

Sizes are a fifteenth and an eighth of the longest side. The parts are those of the repository and mesh files that are given,
such as fandisk.obj.
"""

import sys
import time
import warnings
from pathlib import Path

import trabecula as lt

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "generated" / "tets_fit.md"
#: Tetrahedra along the longest side, steps along a cell, and the solid fraction.
ACROSS, PER_CELL, FRACTION = (15, 8), 12, 0.3
COLUMNS = ["part", "tetrahedra", "volume", "part to mesh", "mesh to part", "angles", "pieces", "lost", "s"]
COLUMNS += ["lattice", "its volume", "its pieces"]

R = lt.region


def regions():
    """(name, region), of the repository."""
    along = [1, 2, 3]
    drilled = ((8, 8, 2.5), (52, 8, 2.5), (8, 32, 2.5), (30, 20, 8))
    holes = [R.cylinder(base=[x, y, -1], radius=r, height=8) for x, y, r in drilled]
    plate = R.box(min=[0, 0, 0], max=[60, 40, 6])
    # Three directions normal to each other, and how far the planes are from the origin in their lengths.
    planes = ((along, 1.0), ([2, -1, 0], 2.0), ([3, 6, -5], 0.5))
    sides = [(scaled(n, s), scaled(n, s * far)) for n, far in planes for s in (1, -1)]
    return {
        "plate with holes": R.difference(plate, *holes),
        "turned box": R.intersection(R.sphere(radius=20), *(R.halfspace(point=p, normal=n) for n, p in sides)),
        "slanted cylinder": R.cylinder(base=[0, 0, 0], axis=along, radius=4, height=10),
        "slanted tube": R.difference(
            R.cylinder(base=[0, 0, 0], axis=along, radius=5, height=12),
            R.cylinder(base=[-1, -2, -3], axis=along, radius=3.5, height=30),
        ),
        "shell, thickness a twentieth of its radius": R.difference(R.sphere(radius=10), R.sphere(radius=9.5)),
        "hip stem": R.mesh(path=str(ROOT / "examples" / "parts" / "hip_stem.stl")),
    }


def scaled(vector, by):
    """A vector times a number."""
    return [by * v for v in vector]


def longest(region):
    """Of the sides of the region's bounds, mm."""
    gyroid = lt.Lattice(cell="gyroid", part="sheet", map=lt.map.affine(wavelength=1), level=lt.level.fraction(0.3))
    low, high = lt.Design(region=region, lattice={"a": gyroid}).build().report()["region"]["bounds"]
    return max(b - a for a, b in zip(low, high, strict=True))


def row(name, region, across):
    """One of the table, and what it loses."""
    size = longest(region) / across
    core = lt.Lattice(cell=lt.cell.tet("diamond"), part="lower", map=lt.map.tets(size=size), level=lt.level.fraction(FRACTION))
    design = lt.Design(region=region, lattice={"a": core})
    start = time.process_time()
    report = lt.TetMesh.of(design).report()
    seconds = time.process_time() - start
    quality, fit = report["quality"], report["fit"]
    angles = quality["dihedral"]
    solid = design.build()
    told = solid.report()["lattices"]["a"]["tets"]
    mesh = solid.mesh(per_cell=PER_CELL)
    cells = [
        name,
        f"{quality['tets']:,}".replace(",", " "),
        f"{100 * (quality['volume'] / report['region_volume'] - 1):+.2f} %",
        f"{fit['from_part']['p99'] / size:.3f}, {fit['from_part']['max'] / size:.3f}",
        f"{fit['to_part']['p99'] / size:.3f}, {fit['to_part']['max'] / size:.3f}",
        f"{angles['min']:.1f}° to {angles['max']:.1f}°",
        str(quality["pieces"]),
        str(len(fit["lost"])),
        f"{seconds:.1f}",
        told["method"],
        f"{100 * (mesh.volume / (FRACTION * report['region_volume']) - 1):+.3f} %",
        str(mesh.pieces),
    ]
    return f"| {' | '.join(cells)} |", f"- {name}, {across}: {told['method_reason']}" if told["method_reason"] else None


def main():
    """Write the page."""
    warnings.simplefilter("ignore", lt.DesignWarning)
    given = {Path(p).stem: R.mesh(path=str(Path(p).resolve())) for p in sys.argv[1:]}
    about = (
        "# Fit of tetrahedral meshes",
        "",
        "Written by `scripts/tets_fit.py`, with `map.tets.size` a fifteenth and an eighth of the longest side of the part.",
        "Volume of the flat tetrahedra against the region's; distances from the part to the mesh and back, 99th percentile and",
        "greatest, in sizes; dihedral angles; features listed as lost; processor seconds for the mesh and its fit. Then",
        f"a lattice of `diamond` at a fraction of {FRACTION} over it, in {PER_CELL} steps along a cell: how it is meshed, its",
        f"volume against {FRACTION} of the region's, its pieces. See [tetrahedral meshes](../concepts/tets.md).",
    )
    lines, reasons = list(about), []
    for across in ACROSS:
        lines += ["", f"## {across} tetrahedra along the longest side", ""]
        lines += [f"| {' | '.join(COLUMNS)} |", f"|{'---|' * len(COLUMNS)}"]
        for name, region in (regions() | given).items():
            line, reason = row(name, region, across)
            print(line, flush=True)
            lines.append(line)
            reasons += [reason] if reason else []
    lines += ["", "Why lattices are meshed on a grid:", "", *reasons] if reasons else []
    OUT.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    print(OUT)


if __name__ == "__main__":
    main()
