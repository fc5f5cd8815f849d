"""The design: what a file says, as frozen data, and how it becomes a solid."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Literal

from . import _core
from .base.files import extension, read_text, write_bytes, write_text
from .base.given import copied, named, settings, three
from .base.memory import IN_MEMORY, content, file_name
from .base.paths import files_in, in_memory_in, moved
from .errors import DesignError, warn_caller

if TYPE_CHECKING:
    from .base.given import Vector
    from .base.names import BeamName, CellName, Dangling, Fit, PartName, Side, Trim, Unit
    from .solid import Solid

__all__ = ["Beams", "Design", "Lattice", "load", "skin", "spartan"]


@named
@dataclass(frozen=True)
class Lattice:
    """A lattice: cell, map from position to phase, part, and level.

    ``cell`` and ``map`` and ``level`` come from the builders of those names; ``part`` is "sheet" (|f| ≤ t), "lower"
    (f ≤ t) or "upper" (f ≥ t).
    """

    cell: CellName | dict
    part: PartName
    map: dict
    level: dict

    def __post_init__(self) -> None:
        _keep(self)

    def to_dict(self) -> dict:
        """The lattice as plain data."""
        return copied({"cell": self.cell, "part": self.part, "map": self.map, "level": self.level})


@named
@dataclass(frozen=True)
class Beams:
    """A graph of beams: a unit cell (``beams.names()``) on a ``map``, or ``nodes`` and ``struts`` of your own.

    ``nodes`` is an array (n, 3), or (n, 4) with hub radii, mm, or the path of a table (csv) of id, x, y, z and perhaps r;
    ``struts`` an array (m, 2) of numbers of nodes, or the path of a table of pairs of ids. ``radius`` is a beam's at mid
    length and ``hub`` that of the balls in which beams meet (mm, numbers or grades); ``fraction``, instead of both, is the
    solid fraction of the cell (of the region for nodes and struts), from which the radius is solved for. ``profile`` is
    "cone", "cylinder", {"waist": mm} or {"lambda": v}; ``fillet`` "none", "auto", {"radius": mm} or one of {"tau": v},
    {"alpha": v}, {"beta": v}; ``trim`` "cut", "drop" or "snap"; ``dangling`` "keep" or "drop"; nodes within ``merge`` (mm)
    are one. ``pattern``, instead of a cell or nodes and struts, is a program of repeats: ``nodes``, ``struts`` (two nodes
    and for each step the number of repeats from the first to the second) and ``repeat``, up to three steps {count, by,
    rotate, scale, about}. ``path``, instead of these, is a file of another program (3mf, ltcx, csv, json, obj, vtu, vtk, inp,
    bdf, nas, txt), whose radii hold unless ``radius``, ``hub`` or ``fraction`` is given; ``unit`` is that of its lengths,
    unless it names one, and ``scale`` a factor on them.
    """

    cell: BeamName | None = None
    map: dict | None = None
    radius: float | dict | None = None
    hub: float | dict | None = None
    nodes: Any = None
    struts: Any = None
    profile: str | dict | None = None
    fillet: str | dict | None = None
    trim: Trim | None = None
    dangling: Dangling | None = None
    merge: float | None = None
    pattern: dict | None = None
    fraction: float | None = None
    path: str | os.PathLike[str] | None = None
    unit: Unit | None = None
    scale: float | None = None

    def __post_init__(self) -> None:
        _keep(self)

    def to_dict(self) -> dict:
        """The beams as plain data."""
        return settings(**{f.name: getattr(self, f.name) for f in fields(self)})


@named
def skin(thickness: float | dict, open: Side | dict | Iterable[Side | dict] | None = None) -> dict:
    """A skin: all of the region that is at most ``thickness`` (mm, a number or a grade) below its surface.

    ``open`` names what it leaves open: flat faces of the region, as sides of its bounds such as "-z" or by the planes of
    half-spaces (``region.halfspace``, or {point, normal}; the normal points out of the region), and all that lies in
    another region ({"region": …}).
    """
    made: dict = {"thickness": thickness}
    if open is not None:
        sides = [open] if isinstance(open, (str, Mapping)) else list(open)
        made["open"] = [s["halfspace"] if isinstance(s, Mapping) and "halfspace" in s else s for s in sides]
    return made


@named
@dataclass(frozen=True)
class Design:
    """A lattice part, as data.

    ``region`` comes from the builders of that name; ``lattice`` is {name: Lattice}, or one Lattice (named ``core``); several
    need a ``blend``, from the builders of that name, that says where each is. ``beams``, instead of a lattice, is
    {name: Beams}, or one Beams (named ``core``).
    ``skin`` comes from the builder of that name; ``keep`` is {name: region}, kept fully solid within the region.
    ``set`` is {name: region}: the surface within each is a set of volume meshes, to hold or to load.
    ``sweep`` is what varies in ``sweep``: {path of a key: values}, of no effect on this design.
    What is given is copied; names that are no text, and data that are too deep, are refused at once, all else that is wrong by
    ``build``, the last line that can raise.
    """

    region: dict
    lattice: Mapping[str, Lattice | dict] | Lattice | None = None
    units: str = "mm"
    schema: int = 1
    skin: dict | None = None
    keep: Mapping[str, dict] | None = None
    beams: Mapping[str, Beams | dict] | Beams | None = None
    blend: dict | None = None
    sweep: dict | None = None
    set: Mapping[str, dict] | None = None
    folder: str | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        _keep(self)

    def to_dict(self) -> dict:
        """The design as plain data: what stands in its file."""
        data = {"schema": self.schema, "units": self.units, "region": self.region}
        more = {"lattice": _by_name(self.lattice), "beams": _by_name(self.beams)}
        more |= {"blend": self.blend, "skin": self.skin, "keep": self.keep, "set": self.set}
        more |= {"sweep": self.sweep}
        return copied(data | {k: v for k, v in more.items() if v is not None})

    def __eq__(self, other: object) -> bool:
        """Whether both mean the same: defaults that are written out and mesh paths from another folder do not count."""
        return self._meaning() == other._meaning() if isinstance(other, Design) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._meaning())

    def __getstate__(self) -> dict:
        # What was read from a file is read again from the data.
        return {name: value for name, value in self.__dict__.items() if name != "_read"}

    def _meaning(self) -> str:
        data, folder = self.to_dict(), self.folder or os.getcwd()
        data = moved(data, lambda path: path if path.startswith(IN_MEMORY) else os.path.abspath(os.path.join(folder, path)))
        try:
            return _core.Design.from_data(data).to_json()
        except DesignError:
            return repr(data)

    def _checked(self) -> _core.Design:
        read, data = self.__dict__.get("_read", (None, None))
        now = self.to_dict()
        return read if read is not None and data == now else _core.Design.from_data(now)

    def to_toml(self) -> str:
        """The design as the text of a TOML file."""
        return self._checked().to_toml()

    def build(self) -> Solid:
        """The solid.

        Raises DesignError for anything wrong, and warns (DesignWarning) of possible mistakes, such as a fraction
        at which the network falls apart.
        """
        from .solid import Solid

        folder = self.folder or os.getcwd()
        made = Solid(self._checked().build(folder), folder, in_memory_in(self.to_dict()))
        for warning in made.warnings:
            warn_caller(warning["message"], warning["path"])
        return made

    def files(self) -> list[str]:
        """The files that the design reads, as absolute paths."""
        folder = self.folder or os.getcwd()
        return [os.path.join(folder, name) for name in files_in(self.to_dict()) if not name.startswith(IN_MEMORY)]

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the design as TOML, or as JSON if the name ends so. Relative paths of files are kept right; arrays, tables and
        meshes in memory are written next to it, under names made of their SHA-256.

        Raises DesignError for a design that cannot be built: nothing else is written.
        """
        kind = extension(path, ("toml", "json"))
        old, new = self.folder or os.getcwd(), os.path.dirname(os.path.realpath(os.fsdecode(path)))
        data = self.to_dict()
        data = moved(data, lambda path: path if path.startswith(IN_MEMORY) else _relative(os.path.join(old, path), new))
        checked = _core.Design.from_data(data)
        checked.build(new)
        for name in {name for name in files_in(data) if name.startswith(IN_MEMORY)}:
            write_bytes(os.path.join(new, file_name(name)), content(name))
        checked = _core.Design.from_data(moved(data, file_name))
        text = checked.to_toml() if kind == "toml" else json.dumps(json.loads(checked.to_json()), indent=2) + "\n"
        write_text(path, text)


def _keep(data: Any) -> None:
    """Copies what a frozen data class was given: it does not follow what becomes of that."""
    for name in (f.name for f in fields(data)):
        value = getattr(data, name)
        if not isinstance(value, (str, Lattice, Beams)):
            value = copied(value)
        if isinstance(value, dict):
            value = {k: replace(v) if isinstance(v, (Lattice, Beams)) else v for k, v in value.items()}
        object.__setattr__(data, name, replace(value) if isinstance(value, (Lattice, Beams)) else value)


def _by_name(given: Any) -> Any:
    """Lattices or beams as plain data by name."""
    made = {"core": given} if isinstance(given, (Lattice, Beams)) else given
    if isinstance(made, Mapping):
        made = {k: v.to_dict() if isinstance(v, (Lattice, Beams)) else v for k, v in made.items()}
    return made


def load(path: str | os.PathLike[str]) -> Design:
    """Reads a design file (TOML, or JSON if the name ends so).

    Raises DesignError, with the line, for anything that is not a design, and OSError for a file that cannot be read.
    """
    name = os.fsdecode(path)
    kind = extension(name, ("toml", "json"))
    return parsed(read_text(name), kind == "json", name, os.path.dirname(os.path.abspath(name)))


def parsed(text: str, is_json: bool, name: str, folder: str) -> Design:
    """The design of a text; ``name`` stands in messages, relative paths start from ``folder``."""
    try:
        read = _core.Design.from_text(text, is_json, name)
    except DesignError as error:
        if not error.path.startswith("sweep."):
            raise
        from .base.keys import plain_of
        from .base.varying import explained

        raise explained(error, plain_of(text, is_json), name) from None
    data: dict[str, Any] = json.loads(read.to_json())
    if "sweep" in data:
        from .base.varying import check_values

        check_values(data["sweep"], text, name)
    lattices = {k: Lattice(**v) for k, v in data["lattice"].items()} if "lattice" in data else None
    beams = {k: Beams(**v) for k, v in data["beams"].items()} if "beams" in data else None
    more = {key: data.get(key) for key in ("skin", "keep", "set", "blend", "sweep")}
    design = Design(data["region"], lattices, data["units"], data["schema"], beams=beams, folder=folder, **more)
    # With the lines of the text, as long as the data are those that were read.
    object.__setattr__(design, "_read", (read, design.to_dict()))
    return design


@named
def spartan(
    name: Literal["diamond", "gyroid"],
    wavelength: float | Vector = (4, 4, 4),
    rotate: Vector = (0, 0, 0),
    porosity: float | dict = 0.7,
    region: dict | None = None,
    fit: Fit = "table",
) -> Design:
    """The seven variables of "Equations for SPARTAN Gyroids and Diamonds" in one call.

    Positions are scaled to phases and rotated there (``map.spartan``); solid is f ≤ t. The note's gyroid is the mirror
    image of the usual one, so ``"gyroid"`` here is the cell ``gyroid_mirrored``. The porosity is met exactly, by the
    cell's own distribution; ``fit="spartan"`` uses the note's polynomial for the diamond (porosity within 0.0031), and a
    fit of ours in the same form for the gyroid, for which the note gives none. ``region`` is a box of 4 × 4 × 4
    wavelengths about the origin unless given.
    """
    from . import level, map

    cells: dict[str, CellName] = {"diamond": "diamond", "gyroid": "gyroid_mirrored", "gyroid_mirrored": "gyroid_mirrored"}
    if name not in cells:
        raise ValueError(f'spartan: the note has "gyroid" and "diamond", found {name!r}')
    waves = three("wavelength", wavelength)
    lattice = Lattice(
        cell=cells[name],
        part="lower",
        map=map.spartan(wavelength=waves, rotate=rotate),
        level=level.porosity(porosity, fit=fit),
    )
    box = {"box": {"size": [4 * w for w in waves]}} if region is None else region
    return Design(region=box, lattice={name: lattice})


def _relative(path: str, folder: str) -> str:
    try:
        turned = os.path.relpath(path, folder)
    except ValueError:  # another drive
        turned = os.path.abspath(path)
    return turned.replace(os.sep, "/")
