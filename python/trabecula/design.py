"""The design: what a file says, as frozen data, and its road to a solid."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from . import _core
from .errors import DesignError, DesignWarning
from .given import copied
from .input import read_text
from .output import extension, whole_file

if TYPE_CHECKING:
    from .solid import Solid

__all__ = ["Design", "Lattice", "load", "skin"]


@dataclass(frozen=True)
class Lattice:
    """A cell seen through a map, cut by a part at a level.

    ``cell`` and ``map`` and ``level`` come from the builders of those names; ``part`` is "sheet" (|f| ≤ t), "lower"
    (f ≤ t) or "upper" (f ≥ t).
    """

    cell: str | dict
    part: str
    map: dict
    level: dict

    def to_dict(self) -> dict:
        """The lattice as plain data."""
        return {"cell": self.cell, "part": self.part, "map": self.map, "level": self.level}


def skin(thickness: float | dict, open: Iterable[str | dict] | None = None) -> dict:
    """A skin: all of the region that is at most ``thickness`` (mm, a number or a grade) below its surface.

    ``open`` names flat faces of the region that it leaves open: sides of its bounds such as "-z", or the planes of
    half-spaces (``region.halfspace``, or {point, normal}; the normal points out of the region).
    """
    made: dict = {"thickness": thickness}
    if open is not None:
        sides = [open] if isinstance(open, (str, Mapping)) else list(open)
        made["open"] = [s["halfspace"] if isinstance(s, Mapping) and "halfspace" in s else s for s in sides]
    return made


@dataclass(frozen=True)
class Design:
    """A lattice part, as data.

    ``region`` comes from the builders of that name; ``lattice`` is {name: Lattice}, or one Lattice (named ``core``).
    ``skin`` comes from the builder of that name; ``keep`` is {name: region}, kept fully solid as far as the region goes.
    Nothing is checked before ``build``, the last line that can raise.
    """

    region: dict
    lattice: Mapping[str, Lattice | dict] | Lattice
    units: str = "mm"
    schema: int = 1
    skin: dict | None = None
    keep: Mapping[str, dict] | None = None
    folder: str | None = field(default=None, compare=False, repr=False)
    _read: _core.Design | None = field(default=None, init=False, compare=False, repr=False)

    def to_dict(self) -> dict:
        """The design as plain data: what stands in its file."""
        lattices = {"core": self.lattice} if isinstance(self.lattice, Lattice) else self.lattice
        if isinstance(lattices, Mapping):
            lattices = {k: v.to_dict() if isinstance(v, Lattice) else v for k, v in lattices.items()}
        data = {"schema": self.schema, "units": self.units, "region": self.region, "lattice": lattices}
        more = {"skin": self.skin, "keep": self.keep}
        return copied(data | {k: v for k, v in more.items() if v is not None})

    def __eq__(self, other: object) -> bool:
        """Whether both mean the same: defaults that are written out and mesh paths from another folder do not count."""
        return self._meaning() == other._meaning() if isinstance(other, Design) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._meaning())

    def _meaning(self) -> str:
        data, folder = self.to_dict(), self.folder or os.getcwd()
        data = _moved_all(data, lambda path: os.path.abspath(os.path.join(folder, path)))
        try:
            return _core.Design.from_data(data).to_json()
        except DesignError:
            return repr(data)

    def _checked(self) -> _core.Design:
        return self._read or _core.Design.from_data(self.to_dict())

    def to_toml(self) -> str:
        """The design as the text of a TOML file."""
        return self._checked().to_toml()

    def build(self) -> Solid:
        """The solid.

        Raises DesignError for anything wrong, and warns (DesignWarning) of what may not be meant, such as a fraction
        at which the network falls apart.
        """
        from .solid import Solid

        made = Solid(self._checked().build(self.folder or os.getcwd()))
        for warning in made.warnings:
            warnings.warn(f"{warning['path']}: {warning['message']}", DesignWarning, stacklevel=2)
        return made

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the design as TOML, or as JSON if the name ends so. Relative mesh paths are kept right.

        Raises DesignError for a design that cannot be built: nothing else is written.
        """
        kind = extension(path, ("toml", "json"))
        old, new = self.folder or os.getcwd(), os.path.dirname(os.path.realpath(os.fsdecode(path)))
        data = self.to_dict()
        data = _moved_all(data, lambda path: _relative(os.path.join(old, path), new))
        checked = _core.Design.from_data(data)
        checked.build(new)
        text = checked.to_toml() if kind == "toml" else json.dumps(json.loads(checked.to_json()), indent=2) + "\n"
        with whole_file(path) as temporary, open(temporary, "w", encoding="utf-8", newline="\n") as out:
            out.write(text)


def load(path: str | os.PathLike[str]) -> Design:
    """Reads a design file (TOML, or JSON if the name ends so).

    Raises DesignError, with the line, for anything that is not a design, and OSError for a file that cannot be read.
    """
    name = os.fsdecode(path)
    kind = extension(name, ("toml", "json"))
    read = _core.Design.from_text(read_text(name), kind == "json", name)
    data: dict[str, Any] = json.loads(read.to_json())
    lattices = {k: Lattice(**v) for k, v in data["lattice"].items()}
    folder = os.path.dirname(os.path.abspath(name))
    design = Design(data["region"], lattices, data["units"], data["schema"], data.get("skin"), data.get("keep"), folder=folder)
    object.__setattr__(design, "_read", read)
    return design


def _moved_all(data: dict, turn: Callable[[str], str]) -> dict:
    """The design with every relative mesh path turned, those of tetrahedra too."""
    data["region"] = _moved(data["region"], turn)
    if isinstance(data.get("keep"), dict):
        data["keep"] = {name: _moved(zone, turn) for name, zone in data["keep"].items()}
    for lattice in data["lattice"].values() if isinstance(data["lattice"], dict) else ():
        map_ = lattice.get("map") if isinstance(lattice, dict) else None
        tets = map_.get("tets") if isinstance(map_, dict) else None
        if isinstance(tets, dict) and isinstance(tets.get("path"), str) and not os.path.isabs(tets["path"]):
            tets["path"] = turn(tets["path"])
    return data


def _moved(region: Any, turn: Callable[[str], str]) -> Any:
    """The region with every relative mesh path turned."""
    if isinstance(region, list):
        return [_moved(r, turn) for r in region]
    if not isinstance(region, dict):
        return region
    mesh = region.get("mesh")
    if isinstance(mesh, dict) and isinstance(mesh.get("path"), str) and not os.path.isabs(mesh["path"]):
        return {**region, "mesh": {**mesh, "path": turn(mesh["path"])}}
    return {k: _moved(v, turn) for k, v in region.items()}


def _relative(path: str, folder: str) -> str:
    try:
        turned = os.path.relpath(path, folder)
    except ValueError:  # another drive
        turned = os.path.abspath(path)
    return turned.replace(os.sep, "/")
