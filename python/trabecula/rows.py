"""One row of a sweep: a design is built, measured, and what is asked for besides is made of it."""

from __future__ import annotations

import hashlib
import os
import time
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from . import _core
from .design import Design
from .errors import DesignWarning
from .solid import Solid

__all__ = ["PROPERTIES", "UNITS", "Job", "named", "row_of"]

#: Units of the columns of figures; those of parameters are the design's: mm and degrees.
UNITS = {"wall_mm": "mm", "pore_mm": "mm", "volume_mm3": "mm³", "area_mm2": "mm²", "seconds": "s"} | {
    **{f"permeability{i + 1}{j + 1}_mm2": "mm²" for i in range(3) for j in range(i, 3)},
    "hydraulic_diameter_mm": "mm",
}


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

    def to_dict(self) -> dict[str, Any]:
        """As plain data, the folder of the design included."""
        data = {key: getattr(self, key) for key in ("edge", "per_cell", "meshes", "pictures", "properties", "threads")}
        return data | {"design": self.design.to_dict(), "folder": self.design.folder or os.getcwd()}

    @staticmethod
    def of(data: Mapping[str, Any]) -> Job:
        """From plain data."""
        settings = {key: value for key, value in data.items() if key not in ("design", "folder")}
        return Job(Design(**data["design"], folder=data["folder"]), **settings)


def row_of(job: Job, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
    """The row of the design with these values; with a message under ``error`` if there is none."""
    start = time.perf_counter()
    row: dict[str, Any] = {"design": number, **values}
    try:
        row |= _figures(job, number, values)
        row["error"] = None
    except (ValueError, OverflowError, MemoryError, OSError, ArithmeticError) as error:
        row["error"] = " ".join(str(error).split()) or type(error).__name__
    row["seconds"] = round(time.perf_counter() - start, 3)
    row["version"] = _core.__version__
    return row


def _figures(job: Job, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
    core = _varied(job.design, values)
    folder = job.design.folder or os.getcwd()
    figures: dict[str, Any] = {"sha256": hashlib.sha256(core.to_toml().encode()).hexdigest()}
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", DesignWarning)
        solid = Solid(core.build(folder), folder)
        said = [w["message"] for w in solid.warnings]
        figures |= _asked(solid)
        resolution = {"edge": job.edge, "per_cell": job.per_cell}
        if job.meshes or job.pictures:
            mesh = solid.mesh(**resolution, threads=job.threads)
            measured = mesh.measure()
            for pattern, write in ((job.meshes, mesh.write), (job.pictures, mesh.render)):
                if pattern:
                    write(named(pattern, number))
        else:
            measured = solid.measure(**resolution, threads=job.threads)
        figures |= {"fraction": measured.solid_fraction, "volume_mm3": measured.volume, "area_mm2": measured.area}
        figures |= {"pieces": measured.pieces}
        for name, settings in job.properties.items():
            figures |= PROPERTIES[name](solid, settings)
    said += [str(w.message) for w in heard if isinstance(w.message, DesignWarning)]
    figures["warnings"] = " | ".join(dict.fromkeys(said))
    return figures


def _varied(design: Design, values: Mapping[str, Any]) -> _core.Design:
    """The design with these values. Where that is none, a lattice or the like that only a path names is said to be missing."""
    try:
        return design._checked().varied(list(values.items()))
    except ValueError:
        given = design.to_dict()
        for path in values:
            table, _, rest = path.partition(".")
            name, below, _ = rest.partition(".")
            there = list(given.get(table) or ()) if table in ("lattice", "beams", "keep", "set") else [name]
            if below and name not in there:
                has = f"the design has {', '.join(f'{table}.{it}' for it in there)}" if there else f"the design has no {table}"
                raise ValueError(f"{path}: there is no {table}.{name}; {has}") from None
        raise


def _asked(solid: Solid) -> dict[str, Any]:
    """Fraction asked for, least wall and pore of each lattice; under its name if there are several."""
    lattices = solid.report().lattices
    made: dict[str, Any] = {}
    for name, it in lattices.items():
        before = f"{name}." if len(lattices) > 1 else ""
        figures = {"fraction_asked": it.fraction, "wall_mm": it.thickness, "pore_mm": it.pore}
        # Of a range the least, which decides whether it can be made; a fraction that varies is no one number.
        least = {key: min(v) if isinstance(v, list | tuple) and v else v for key, v in figures.items()}
        if isinstance(it.fraction, list | tuple):
            least["fraction_asked"] = None
        made |= {before + key: v for key, v in least.items()}
    return made


def named(pattern: str, number: int) -> str:
    """The file name of a design: ``{design}`` in the pattern is its number, in six digits."""
    return pattern.replace("{design}", f"{number:06d}")


def _stiffness(solid: Solid, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The 21 constants, Young's moduli, Zener's ratio and the relative error."""
    found = solid.stiffness(**settings)
    made = {f"C{i + 1}{j + 1}": found.C[i][j] for i in range(6) for j in range(i, 6)}
    made |= {f"E{i + 1}": None if found.E is None else found.E[i] for i in range(3)}
    return made | {"zener": found.zener, "C_error": found.error}


def _conductivity(solid: Solid, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The six entries and their relative error."""
    found = solid.conductivity(**settings)
    return {f"k{i + 1}{j + 1}": found.k[i][j] for i in range(3) for j in range(i, 3)} | {"k_error": found.error}


def _permeability(solid: Solid, settings: Mapping[str, Any]) -> dict[str, Any]:
    """The six entries in mm², their relative error, hydraulic diameter and tortuosity."""
    found = solid.permeability(**settings)
    made = {f"permeability{i + 1}{j + 1}_mm2": found.k[i][j] for i in range(3) for j in range(i, 3)}
    made |= {"permeability_error": found.error, "hydraulic_diameter_mm": found.hydraulic_diameter}
    return made | {"tortuosity": found.tortuosity}


#: Properties that can be asked for: functions of a solid and their settings, to columns.
PROPERTIES: dict[str, Any] = {
    "conductivity": _conductivity,
    "permeability": _permeability,
    "stiffness": _stiffness,
}
