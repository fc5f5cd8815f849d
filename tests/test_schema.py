"""The generated schema is current, is a schema, and agrees with the reader."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import trabecula as lt
from conftest import CUBE
from trabecula import _core

ROOT = Path(__file__).resolve().parent.parent


def test_current():
    """schema/design.json is what the core makes; renew it with TRABECULA_RENEW=1 cargo test -p trabecula schema."""
    committed = json.loads((ROOT / "schema" / "design.json").read_text())
    assert committed == json.loads(_core.schema())


@pytest.mark.parametrize("script", ["builders", "design_page"])
def test_what_is_made_from_the_schema_is_current(script):
    """The Python builders and the reference page; renew them by running the script."""
    made = subprocess.run(
        [sys.executable, ROOT / "scripts" / f"{script}.py", "--check"], check=False, capture_output=True, text=True
    )
    assert made.returncode == 0, made.stderr


@pytest.mark.parametrize("example", sorted((ROOT / "examples").glob("*.toml")), ids=lambda p: p.name)
def test_examples_are_valid(example):
    """What the reader accepts, the schema accepts."""
    jsonschema = pytest.importorskip("jsonschema")
    data = lt.load(example).to_dict()
    jsonschema.Draft202012Validator(json.loads(_core.schema())).validate(data)


@pytest.mark.parametrize(
    ("keys", "value"),
    [
        (["region", "box", "sise"], [1, 1, 1]),
        (["lattice", "core", "cell"], "gyriod"),
        (["lattice", "core", "part"], "both"),
        (["lattice", "core", "level", "iso"], 0.2),
        (["lattice", "core", "level", "fraction"], "much"),
        (["lattice", "core", "map", "affine", "wavelength"], [1, 2]),
        (["blend"], {}),
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(tmp_path, keys, value):
    """A slip in each place is caught by both."""
    jsonschema = pytest.importorskip("jsonschema")
    file = tmp_path / "a.toml"
    file.write_text(CUBE)
    data = lt.load(file).to_dict()
    place = data
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    assert not jsonschema.Draft202012Validator(json.loads(_core.schema())).is_valid(data)
    with pytest.raises(lt.DesignError):
        _core.Design.from_data(data)


@pytest.mark.parametrize(
    ("keys", "word"),
    [
        (["regoin"], "regoin"),
        (["region", "bocks"], "bocks"),
        (["region", "box", "sise"], "sise"),
        (["lattice", "core", "prat"], "prat"),
        (["lattice", "core", "cell", "seres"], "seres"),
        (["lattice", "core", "map", "afine"], "afine"),
        (["lattice", "core", "map", "affine", "wavelenght"], "wavelenght"),
        (["lattice", "core", "level", "fracton"], "fracton"),
        (["lattice", "core", "level", "fraction", "liner"], "liner"),
        (["lattice", "core", "level", "fraction", "linear", "alon"], "alon"),
        (["skin", "opne"], "opne"),
    ],
)
@pytest.mark.parametrize("draft", ["Draft202012Validator", "Draft7Validator"])
def test_the_schema_names_a_misspelt_key(keys, word, draft):
    """What an editor shows first is the key itself, whatever else is then missing; also where it knows draft 7 alone."""
    jsonschema = pytest.importorskip("jsonschema")
    data = {
        "schema": 1,
        "region": {"box": {"size": [8, 8, 8]}},
        "lattice": {
            "core": {"cell": "gyroid", "part": "sheet", "map": {"affine": {"wavelength": 4}}, "level": {"fraction": 0.3}}
        },
        "skin": {"thickness": 1},
    }
    place = data
    for key in keys[:-1]:
        if not isinstance(place.get(key), dict):
            place[key] = {}
        place = place[key]
    place[keys[-1]] = 3
    errors = getattr(jsonschema, draft)(json.loads(_core.schema())).iter_errors(data)
    assert f"'{word}' was unexpected" in jsonschema.exceptions.best_match(errors).message


def test_no_alternatives_hide_what_is_wrong():
    """Kinds are optional keys of one table, and values of several types have the keywords of all: no `oneOf` is left, and
    `anyOf` only where it offers words, tells lists of different lengths or what a design or a set of keys needs."""

    def walk(node):
        if isinstance(node, dict):
            assert "oneOf" not in node
            for choice in node.get("anyOf", []):
                assert not choice or {"enum", "$ref", "required", "minItems"} & set(choice), choice
            for below in node.values():
                walk(below)
        elif isinstance(node, list):
            for below in node:
                walk(below)

    walk(json.loads(_core.schema()))


def test_the_command_prints_the_schema(tmp_path):
    """What an installed package prints is the schema of the repository, without any file of it."""
    done = subprocess.run(
        [sys.executable, "-m", "trabecula", "schema"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout) == json.loads((ROOT / "schema" / "design.json").read_text())
