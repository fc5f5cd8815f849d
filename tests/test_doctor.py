"""What the program says of its own installation."""

import json

import trabecula as lt
from conftest import in_process
from trabecula.command.doctor import extras, state, words


def test_it_names_the_version_and_every_extra_with_what_is_missing():
    found = json.loads(in_process("doctor", "--json"))
    assert found["version"] == lt.__version__ and found["processors"] >= 1 and found["free_disk"] > 0
    assert set(found["extras"]) == {"cad", "dicom", "fe", "notebook", "scale", "tets"} == set(extras())
    assert "meshio" in found["extras"]["fe"] and "test" not in found["extras"]


def test_a_missing_package_comes_with_its_cure():
    found = state()
    found["extras"] = {"fe": {"meshio": None, "h5py": "3.9"}}
    assert words(found)[-1] == "extra      fe: h5py 3.9; missing: meshio (pip install 'trabecula[fe]')"


def test_the_lines_are_for_people():
    lines = in_process("doctor").splitlines()
    assert lines[0].startswith(f"trabecula  {lt.__version__} (") and len(lines) == 5 + len(extras())
