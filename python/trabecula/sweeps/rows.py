"""One row of a sweep: a design is built, measured, and what is asked for besides is made of it."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from .. import _core
from ..base.keys import listless, missing, unit_of
from ..base.memory import InMemory
from ..base.paths import in_memory_in, moved
from ..design import Design
from ..errors import DesignWarning
from ..solid import Solid

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from ..reports import ConductivityReport, PermeabilityReport, StiffnessReport

__all__ = [
    "LAST",
    "PROPERTIES",
    "TEXTS",
    "Job",
    "check_paths",
    "columns_of_job",
    "digest_of",
    "is_made",
    "named",
    "row_of",
    "unit_of_column",
]

#: Units of the columns of figures; those of parameters are the design's: mm and degrees.
UNITS = {"wall_mm": "mm", "pore_mm": "mm", "volume_mm3": "mm³", "area_mm2": "mm²", "seconds": "s"} | {
    **{f"permeability{i + 1}{j + 1}_mm2": "mm²" for i in range(3) for j in range(i, 3)},
    "hydraulic_diameter_mm": "mm",
}
#: Columns of each lattice, and those that are measured.
ASKED, MEASURED = ("fraction_asked", "wall_mm", "pore_mm"), ("solid_fraction", "volume_mm3", "area_mm2", "pieces")
#: Columns that come last, in this order.
LAST = ("warnings", "error", "seconds", "sha256", "version")
#: What a design or a property of it may end in: its row has the message.
FAULTS = (ValueError, OverflowError, MemoryError, OSError, ArithmeticError)
#: Columns of text.
TEXTS = ("warnings", "error", "sha256", "version")


@dataclass(frozen=True)
class Job:
    """What is made of each design: the same for all rows of a sweep, and plain data but for the design."""

    design: Design
    edge: float | None = None
    per_cell: float | None = None
    meshes: str | None = None
    pictures: str | None = None
    properties: dict[str, dict[str, Any]] = field(default_factory=dict)
    threads: int | None = None
    #: The folder to which the files of the design were sent, and their names there by those that the design has for them.
    sent: tuple[str, dict[str, str]] | None = None

    def to_dict(self) -> dict[str, Any]:
        """As plain data, the folder of the design and its data in memory included."""
        data = {key: getattr(self, key) for key in ("edge", "per_cell", "meshes", "pictures", "properties", "threads")}
        design = self.design.to_dict()
        memory = {name: base64.b64encode(name.content).decode() for name in in_memory_in(design)}
        return data | {"design": design, "folder": self.design.folder or os.getcwd()} | ({"memory": memory} if memory else {})

    @staticmethod
    def of(data: Mapping[str, Any]) -> Job:
        """From plain data."""
        settings = {key: value for key, value in data.items() if key not in ("design", "folder", "memory")}
        memory = {
            name: InMemory.of(base64.b64decode(content), name.rpartition(".")[2])
            for name, content in data.get("memory", {}).items()
        }
        design = moved(data["design"], lambda name: memory.get(name, name))
        return Job(Design(**design, folder=data["folder"]), **settings)


def row_of(job: Job, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
    """The row of the design with these values; under ``error`` why there is none, or which property it has not."""
    start = time.perf_counter()
    row: dict[str, Any] = {"design": number, **values}
    try:
        row |= _figures(job, number, values)
    except FAULTS as error:
        row["error"] = _words(error)
    if job.sent:
        row |= {name: _at_home(job, row[name]) for name in ("warnings", "error") if row.get(name)}
    row["seconds"] = round(time.perf_counter() - start, 3)
    row["version"] = _core.__version__
    return row


def _words(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _at_home(job: Job, text: str) -> str:
    """A text in which files have the names that the design has for them, wherever they were read."""
    folder, places = job.sent or ("", {})
    for name, place in sorted(places.items(), key=lambda pair: -len(pair[1])):
        home = os.path.join(job.design.folder or "", name)
        text = text.replace(os.path.join(folder, place), home).replace(place, name)
    return text


def _figures(job: Job, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
    core = _varied(job.design, values)
    folder = job.design.folder or os.getcwd()
    figures: dict[str, Any] = {"sha256": _digest(core)}
    if job.sent:
        folder, places = job.sent
        core = _core.Design.from_data(moved(json.loads(core.to_json()), lambda name: places.get(name, name)))
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", DesignWarning)
        solid = Solid(core.build(folder), folder)
        said: list[str] = [_located(w) for w in solid.warnings]
        reported: list[str] = []
        failed: list[str] = []
        figures |= _asked(solid)
        if job.meshes or job.pictures:
            mesh = solid.mesh(job.edge, job.per_cell, threads=job.threads)
            measured = mesh.measure()
            for pattern, write in ((job.meshes, mesh.write), (job.pictures, lambda path: mesh.render(path, solid=solid))):
                if pattern:
                    write(named(pattern, number))
        else:
            measured = solid.measure(job.edge, job.per_cell, threads=job.threads)
        whole = (measured.solid_fraction, measured.volume, measured.area, measured.pieces)
        figures |= dict(zip(MEASURED, whole, strict=True))
        for name, settings in job.properties.items():
            try:
                found = getattr(solid, name)(threads=job.threads, **settings)
            except FAULTS as error:  # what else was found of the design stays
                failed.append(f"{name}: {_words(error)}")
                figures |= dict.fromkeys(PROPERTIES[name].columns)
                continue
            figures |= dict(zip(PROPERTIES[name].columns, PROPERTIES[name].figures(found), strict=True))
            reported += [f"{name}: {_located(warning)}" for warning in found.warnings]
    said += [*(str(w.message) for w in heard if isinstance(w.message, DesignWarning)), *reported]
    figures["warnings"] = " | ".join(dict.fromkeys(said))
    figures["error"] = " | ".join(failed) or None
    return figures


def _digest(core: _core.Design) -> str:
    return hashlib.sha256(core.to_toml().encode()).hexdigest()


def digest_of(design: Design, values: Mapping[str, Any]) -> str:
    """The SHA-256 of the text of the design with these values, as its row has it."""
    return _digest(_varied(design, values))


def _located(warning: Mapping[str, str]) -> str:
    """What a warning says, with the path that it is of."""
    return str(DesignWarning(warning["message"], warning["path"]))


def is_made(row: Mapping[str, Any]) -> bool:
    """Whether there is a solid of this row, of which a property may be missing."""
    return row.get("volume_mm3") is not None


def _varied(design: Design, values: Mapping[str, Any]) -> _core.Design:
    """The design with these values. Where that is none, a path that leads nowhere is said to."""
    try:
        return design._checked().varied(list(values.items()))
    except ValueError:
        check_paths(design, values)
        raise


def check_paths(design: Design, paths: Iterable[str]) -> None:
    """Refuses paths that are those of no key of the design."""
    data = design.to_dict()
    for path in paths:
        if why := missing(path, data) or listless(path, data):
            raise ValueError(f"{path}: {why}")


def _asked(solid: Solid) -> dict[str, Any]:
    """Fraction asked for, least wall and pore of each lattice; under its name if there are several."""
    lattices = solid.report().lattices
    made: dict[str, Any] = {}
    for name, it in lattices.items():
        before = f"{name}." if len(lattices) > 1 else ""
        figures = dict(zip(ASKED, (it.fraction, it.thickness, it.pore), strict=True))
        # Of a range the least, which decides whether it can be made; a fraction that varies is no one number.
        least = {key: min(v) if isinstance(v, list | tuple) and v else v for key, v in figures.items()}
        if isinstance(it.fraction, list | tuple):
            least["fraction_asked"] = None
        made |= {before + key: v for key, v in least.items()}
    return made


def named(pattern: str, number: int) -> str:
    """The file name of a design: ``{design}`` in the pattern is its number, in six digits."""
    return pattern.replace("{design}", f"{number:06d}")


def _upper(size: int) -> list[tuple[int, int]]:
    """The entries of a symmetric matrix: those of its upper triangle, row by row."""
    return [(i, j) for i in range(size) for j in range(i, size)]


def _entries(name: str, size: int, end: str = "") -> tuple[str, ...]:
    return tuple(f"{name}{i + 1}{j + 1}{end}" for i, j in _upper(size))


@dataclass(frozen=True)
class Property:
    """What can be computed of a solid besides: its columns, and their figures of a report. Errors are relative ones."""

    columns: tuple[str, ...]
    figures: Callable[[Any], Iterable[float | None]]


def _stiffness(found: StiffnessReport) -> Iterator[float | None]:
    yield from (found.C[i][j] for i, j in _upper(6))
    yield found.error
    for three in (found.E, found.E_error, found.G, found.G_error):
        yield from three or (None,) * 3
    yield found.zener


def _conductivity(found: ConductivityReport) -> Iterator[float | None]:
    yield from (found.k[i][j] for i, j in _upper(3))
    yield found.error
    yield from found.axis_errors


def _permeability(found: PermeabilityReport) -> Iterator[float | None]:
    yield from (found.k[i][j] for i, j in _upper(3))
    yield found.error
    yield from found.axis_errors
    yield from (found.hydraulic_diameter, found.tortuosity)


AXES, PLANES = ("1", "2", "3"), ("23", "13", "12")
MODULI = tuple(f"{name}{of}{end}" for name, each in (("E", AXES), ("G", PLANES)) for end in ("", "_error") for of in each)

#: Properties that can be asked for; each is a function of solids by this name.
PROPERTIES: dict[str, Property] = {
    "conductivity": Property((*_entries("k", 3), "k_error", *(f"k{a}{a}_error" for a in AXES)), _conductivity),
    "permeability": Property(
        (
            *_entries("permeability", 3, "_mm2"),
            "permeability_error",
            *(f"permeability{a}{a}_error" for a in AXES),
            "hydraulic_diameter_mm",
            "tortuosity",
        ),
        _permeability,
    ),
    "stiffness": Property((*_entries("C", 6), "C_error", *MODULI, "zener"), _stiffness),
}


def columns_of_job(job: Job, paths: Iterable[str]) -> list[str]:
    """The columns that rows of designs without an error have."""
    lattices = list(job.design.to_dict().get("lattice") or ())
    before = [f"{name}." for name in lattices] if len(lattices) > 1 else [""] * len(lattices)
    found = [column for name in job.properties for column in PROPERTIES[name].columns]
    asked = [start + column for start in before for column in ASKED]
    return ["design", *paths, *asked, *MEASURED, *found, *LAST]


def unit_of_column(name: str) -> str:
    """The unit of a column: that of a figure, or of the key of a design that varies."""
    return next((unit for end, unit in UNITS.items() if name == end or name.endswith(f".{end}")), "") or unit_of(name)
