"""Space groups, judged by two programs that have their own tables."""

from __future__ import annotations

import warnings

import gemmi
import numpy as np
import pytest
import spglib
import trabecula as lt


def as_set(operations) -> set:
    return {(tuple(np.ravel(r).tolist()), tuple(int(v) % 24 for v in t)) for r, t in operations}


def ours(symbol: str) -> set:
    return as_set((r, [v * 24 for v in t]) for r, t in lt.cell.group(symbol)["operations"])


def test_all_settings_are_those_of_spglib():
    for n in range(1, 531):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # spglib's own
            its = spglib.get_symmetry_from_database(n)
            kind = spglib.get_spacegroup_type(n)
        want = as_set(zip(its["rotations"], np.rint(its["translations"] * 24), strict=True))
        setting = f":{kind.choice}" if kind.choice else ""
        assert ours(f"{kind.number}{setting}") == want, kind
        assert lt.cell.group(kind.international_full.replace("_", "") + setting)["number"] == kind.number


def test_hall_symbols_of_gemmi_mean_the_same():
    for group in gemmi.spacegroup_table():
        want = as_set((np.array(o.rot) // o.DEN, np.array(o.tran)) for o in group.operations())
        if "(" in group.hall and "," in group.hall:
            with pytest.raises(lt.DesignError, match="twelfths"):
                ours(f"hall:{group.hall}")
        else:
            assert ours(f"hall:{group.hall}") == want, group.hall


def test_a_series_by_group_is_the_series_written_out():
    axes = np.eye(3, dtype=int).tolist()
    by_group = lt.cell.series([lt.cell.term([1, 0, 0])], group=221)
    written = lt.cell.series([lt.cell.term(h) for h in axes])
    for level in (0.3, 0.5):
        assert lt.iso(by_group, level, part="lower") == pytest.approx(lt.iso(written, level, part="lower"), abs=1e-12)
    # Twice the gyroid from another origin: each of its six waves as cosine with coefficient one.
    gyroid = lt.cell.series([lt.cell.term([1, 1, 0], component="im")], group="I4132")
    for level in (0.3, 0.5):
        want = 2 * lt.iso("gyroid", level, part="lower")
        assert lt.iso(gyroid, level, part="lower") == pytest.approx(want, abs=1e-9)
