#!/usr/bin/env python3
"""Draws docs/images/heat_exchanger.png: the lower half of examples/heat_exchanger.toml, cut open in the middle."""

import json
import sys
import tempfile
from pathlib import Path

import trabecula as lt

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent


def main():
    """Writes the picture."""
    given = tomllib.loads((ROOT / "examples" / "heat_exchanger.toml").read_text(encoding="utf-8"))
    half = {"point": [0, 0, 0], "normal": [0, 1, 0]}
    given["region"] = {"intersection": [given["region"], {"halfspace": half}]}
    given["skin"]["open"].append(half)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "half.json"
        path.write_text(json.dumps(given), encoding="utf-8")
        solid = lt.load(path).build()
    to_scale = {"projection": "orthographic", "scale_bar": True}
    mesh = solid.mesh(edge=0.25)
    mesh.render(ROOT / "docs" / "images" / "heat_exchanger.png", (900, 720), azimuth=90, elevation=-35, solid=solid, **to_scale)


if __name__ == "__main__":
    main()
