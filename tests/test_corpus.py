"""The numbers of corpus/, through Python and through the command."""

import json
import os
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import trabecula
from conftest import in_process

if sys.version_info >= (3, 11):
    import tomllib
else:
    tomllib = pytest.importorskip("tomli")

CORPUS = Path(__file__).resolve().parent.parent / "corpus"
CELLS = tomllib.loads((CORPUS / "cells.toml").read_text(encoding="utf-8"))
SOLIDS = tomllib.loads((CORPUS / "solids.toml").read_text(encoding="utf-8"))
TOLERANCE = CELLS["tolerance"]
PARTS = ("sheet", "lower", "upper")
# Samples per smallest wavelength, where a row does not name another number.
PER_CELL = 32


def command(*words):
    """What `trabecula ... --json` prints."""
    return json.loads(in_process(*words, "--json"))


@pytest.fixture(scope="module")
def listed():
    """`trabecula cells --json` by name."""
    return {cell["name"]: cell for cell in command("cells")}


cells = pytest.mark.parametrize(("name", "row"), CELLS["cells"].items(), ids=list(CELLS["cells"]))


def test_corpus_has_every_named_cell(listed):
    assert set(listed) == set(CELLS["cells"])


@cells
def test_range(name, row, listed):
    assert listed[name]["range"] == pytest.approx(row["range"], abs=TOLERANCE["range"])


@cells
def test_fraction_at_levels(name, row):
    t, fraction = np.array(row["lower_at"]).T
    assert np.abs(trabecula.fraction(name, t, part="lower") - fraction).max() < TOLERANCE["fraction"]
    assert np.abs(trabecula.fraction(name, t, part="upper") - (1 - fraction)).max() < TOLERANCE["fraction"]


@cells
def test_level_realises_its_fraction(name, row):
    """The reference's fraction at our level is the one asked for: levels differ by the error over dV/dt."""
    for part in PARTS:
        if f"iso_{part}" not in row:
            continue
        asked, t = np.array(row[f"iso_{part}"]).T
        step = 1e-3
        below, at, above = trabecula.fraction(name, t + np.array([[-step], [0.0], [step]]), part=part)
        assert np.abs(at - asked).max() < TOLERANCE["fraction"], part
        error = (trabecula.iso(name, asked, part=part) - t) * (above - below) / (2 * step)
        assert np.abs(error).max() < TOLERANCE["fraction"], part


@cells
def test_fraction_and_level_are_inverse(name, row):
    asked = np.array([0.02, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.98])
    for part in PARTS:
        back = trabecula.fraction(name, trabecula.iso(name, asked, part=part), part=part)
        assert np.abs(back - asked).max() < TOLERANCE["fraction"], part


@cells
def test_limits_of_connectivity(name, row, listed):
    for part in ("lower", "upper"):
        least, tolerance = row[f"connected_{part}"]
        assert listed[name]["connected_fraction"][part][0][0] == pytest.approx(least, abs=tolerance), part


def agree(found, row):
    """Compares a measure report with its row."""
    assert found["closed"]
    for key, expected in row.items():
        if isinstance(expected, list):
            value, tolerance = expected
            assert found[key] == pytest.approx(value, rel=tolerance, abs=tolerance), key
        elif key not in ("why", "per_cell"):
            assert found[key] == expected, key


solids = pytest.mark.parametrize(("name", "row"), SOLIDS.items(), ids=list(SOLIDS))


def test_every_design_has_a_row():
    assert {path.stem for path in (CORPUS / "designs").glob("*.toml")} == set(SOLIDS)


@pytest.fixture(autouse=True)
def readers(request):
    """Files from CAD systems need an extra."""
    name = request.node.callspec.params.get("name", "") if hasattr(request.node, "callspec") else ""
    if name.startswith("step_"):
        pytest.importorskip("OCP")


# The core's tests and the command below take every row; a mesh that stays in memory needs a few, all in `make campaign`.
few = list(SOLIDS.items())[:: 1 if "TRABECULA_CAMPAIGN" in os.environ else 8]


@pytest.mark.parametrize(("name", "row"), few, ids=[name for name, _ in few])
def test_solid_by_python(name, row):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", trabecula.DesignWarning)
        solid = trabecula.load(CORPUS / "designs" / f"{name}.toml").build()
        agree(solid.mesh(per_cell=row.get("per_cell", PER_CELL), islands="keep").measure(), row)


@solids
def test_solid_by_the_command_and_a_file(name, row, tmp_path):
    """The same measures of the STL as it is read back, after rounding to single precision."""
    design = CORPUS / "designs" / f"{name}.toml"
    spacing = ("--per-cell", row.get("per_cell", PER_CELL))
    command("mesh", design, "-o", tmp_path / "out.stl", *spacing, "--islands", "keep")
    # The region tells the lattice's area from the cut, and takes its time.
    region = ["--region", design] if {"area_lattice", "area_cut"} & set(row) else []
    agree(command("measure", tmp_path / "out.stl", *region), row)
