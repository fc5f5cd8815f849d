"""Reports: typed, never changing, mappings, plain data; their keys are those of the JSON of the command."""

import copy
import json
import pickle

import pytest
import trabecula as lt
from conftest import CUBE
from test_cli import run
from trabecula.design import parsed


def test_attributes_keys_and_plain_data(cube):
    """Three views of one thing."""
    report = lt.load(cube).build().report()
    core = report.lattices["core"]
    assert isinstance(report, lt.reports.DesignReport) and isinstance(core, lt.reports.LatticeReport)
    assert core.fraction == core["fraction"] == report["lattices"]["core"]["fraction"] == 0.3
    assert report.to_dict()["region"]["volume"] == report.region.volume == 512
    assert json.loads(json.dumps(report.to_dict())) == report == pickle.loads(pickle.dumps(report)) == copy.deepcopy(report)
    assert "distortion" not in core and core.distortion is None
    with pytest.raises(TypeError, match="never changes"):
        core.fraction = 0.4
    with pytest.raises(AttributeError, match="has no colour"):
        _ = core.colour


def test_the_command_prints_the_same(tmp_path, cube):
    """`--json` has the keys and numbers of the report, its words are the report's."""
    solid = lt.load(cube).build()
    error = solid.volume_error()
    reported = json.loads(run("check", cube, "--json", cwd=tmp_path).stdout)
    assert reported == solid.report().to_dict() | {"volume_error": error}
    words = run("check", cube, cwd=tmp_path).stdout
    assert words.startswith(f"{solid.report()}\n") and f"{error:.1g}" in words.splitlines()[-1]
    measured = json.loads(run("measure", cube, "--edge", "0.5", "--json", cwd=tmp_path).stdout)
    made = solid.measure(edge=0.5)
    assert {key: measured[key] for key in made} == made
    # The same sums in another order.
    held = solid.mesh(edge=0.5).measure()
    assert made.euler == held.euler and abs(made.volume / held.volume - 1) < 1e-12


@pytest.mark.parametrize("name", lt.reports.__all__)
def test_every_field_is_documented(name):
    """A class and each of its fields have a text; a length, area or volume names its unit."""
    import ast
    import inspect

    (tree,) = ast.parse(inspect.getsource(getattr(lt.reports, name))).body
    fields = [node for node in tree.body if isinstance(node, ast.AnnAssign)]
    texts = [node.value.value for node in tree.body if isinstance(node, ast.Expr)]
    assert fields and len(texts) == len(fields) + 1 and all(text.endswith(".") for text in texts)


@pytest.mark.parametrize(
    ("region", "core", "beams"),
    [
        ("min = [1, -2, -2]\nmax = [9, 2, 2]", "nodes = [[0, 0, 0], [10, 0, 0]]\nstruts = [[0, 1]]", 1),
        ("min = [-1, 1, 1]\nmax = [1, 5, 5]", 'cell = "octet"\nmap.affine.wavelength = 12', 1),
    ],
)
def test_beams_without_a_hub_in_the_region_are_reported(region, core, beams):
    """All cross it; there was no least length, which no text could give."""
    text = f"schema = 1\n[region.box]\n{region}\n[beams.core]\n{core}\nradius = 0.7"
    solid = parsed(text, False, "test", ".").build()
    found = solid.report().beams["core"]
    assert (found.hubs, found.beams) == (0, beams)
    assert f"0 hubs, {beams} beam" in str(solid.report()) and "in all" in str(solid.report())
    assert found.pieces == solid.mesh(edge=0.2, islands="keep").pieces


def test_figures_of_all_parts_of_a_design(tmp_path):
    """Beams and a blend are reports with names of their own."""
    (tmp_path / "a.toml").write_text(
        CUBE
        + '[beams.b]\ncell = "bcc"\nmap.affine.wavelength = 4\nradius = 0.4\n'
        + "[blend]\nbetween = ['core', 'b']\nweight = { linear = { along = [0, 0, 1], stops = [[-4, 0], [4, 1]] } }\n"
    )
    solid = lt.load(tmp_path / "a.toml").build()
    report = solid.report()
    assert isinstance(report.beams["b"], lt.reports.BeamsReport) and isinstance(report.blend, lt.reports.BlendReport)
    assert report.beams["b"].hubs > 0 and report.beams["b"].repeats is None
    (transition,) = solid.transitions()
    assert isinstance(transition, lt.reports.TransitionReport) and transition.between == ["core", "b"]
    assert str(transition).startswith("transition core to b: ")
