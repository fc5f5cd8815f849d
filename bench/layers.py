"""Seconds of layers from the field against meshing and slicing the mesh by trimesh, in one run on one thread.

  python bench/layers.py [--size 100] [--cell 10] [--layer 0.05] [--tolerance 0.001 0.01] [--some 20]

Layers are made of a gyroid sheet (30 %) in a cube, written as binary CLI. The mesh has the grid spacing that `mesh`
uses by default; trimesh slices `--some` heights of it in one call, and its time is scaled to all of them, that of
meshing added. Pictures are of 7680 x 4320 pixels.
"""

import argparse
import os
import pathlib
import tempfile
import time

import trabecula as lt


def timed(work):
    """Wall seconds and the result."""
    start = time.perf_counter()
    made = work()
    return time.perf_counter() - start, made


def main():
    ask = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ask.add_argument("--size", type=float, default=100)
    ask.add_argument("--cell", type=float, default=10)
    ask.add_argument("--layer", type=float, default=0.05)
    ask.add_argument("--tolerance", type=float, nargs="*", default=[0.001, 0.01])
    ask.add_argument("--some", type=int, default=20)
    asked = ask.parse_args()
    core = lt.Lattice("gyroid", "sheet", lt.map.affine(asked.cell), lt.level.fraction(0.3))
    solid = lt.Design(region=lt.region.box(size=[asked.size] * 3), lattice=core).build()
    total = round(asked.size / asked.layer)
    mid = {"start": -0.5 * asked.some * asked.layer, "stop": 0.5 * asked.some * asked.layer}
    with tempfile.TemporaryDirectory() as scratch:
        out = pathlib.Path(scratch)
        ours = {}
        for tolerance in asked.tolerance:
            layers = solid.layers(asked.layer, tolerance, threads=1, **mid)
            seconds, report = timed(lambda made=layers: made.save(out / "a.cli", binary=True))
            ours[tolerance] = seconds / report.layers
            size = os.path.getsize(out / "a.cli") / report.layers
            print(
                f"layers, {tolerance:g} mm: {ours[tolerance]:.4f} s a layer, {total * ours[tolerance]:.0f} s for {total}; "
                f"{report.points / report.layers:.0f} points, {size / 1e6:.2f} MB a layer"
            )
        pixel = asked.size / 4320
        layers = solid.layers(asked.layer, 0.1 * pixel, threads=1, **mid)
        seconds, report = timed(lambda: layers.save(out / "a.zip", pixel=pixel, size=(7680, 4320)))
        print(f"pictures of 7680 x 4320: {report.layers / seconds:.2f} layers a second")
        try:
            import networkx  # noqa: F401
            import numpy as np
            import rtree  # noqa: F401
            import scipy  # noqa: F401
            import trimesh
        except ImportError:
            return print("trimesh, networkx, rtree or scipy is not installed")
        edge = solid.spacing()
        seconds, mesh = timed(lambda: solid.mesh(edge=edge, threads=1))
        print(f"mesh at {edge:g} mm: {seconds:.1f} s, {len(mesh.triangles)} triangles")
        theirs = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        heights = (np.arange(asked.some) + 0.5 - asked.some / 2) * asked.layer
        spent, cuts = timed(lambda: theirs.section_multiplane([0, 0, 0], [0, 0, 1], heights))
        closed, _ = timed(lambda: [cut.polygons_full for cut in cuts if cut is not None])
        each = (spent + closed) / asked.some
        print(f"trimesh: {spent / asked.some:.2f} s a section and {closed / asked.some:.2f} s for polygons")
        for tolerance, own in ours.items():
            print(f"mesh and trimesh / layers at {tolerance:g} mm: {(seconds + each * total) / (own * total):.1f}")


if __name__ == "__main__":
    main()
