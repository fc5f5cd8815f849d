"""Series of DICOM, as medical and industrial scanners write them: through pydicom, in the extra ``dicom``."""

from __future__ import annotations

import glob
import os
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, NamedTuple

from . import children

if TYPE_CHECKING:
    import pydicom
    from numpy.typing import NDArray

__all__ = ["read"]

#: Bytes of memory that reading takes at most: of the interpreter with its packages, and for each byte of the files, which may
#: be compressed.
BASE, PER_BYTE = 2e9, 200.0

#: How far numbers of one stack may differ; angle (radians) between its directions and the axes at most, which moves a corner of
#: 512 pixels by half of one; and by what share distances of pictures may differ from most.
ALONG, TILT, EVEN = 1e-3, 1e-3, 1e-2

#: What makes stored values those of the scanner.
RESCALE = ("RescaleSlope", "RescaleIntercept")


def read(path: str | os.PathLike[str], limit: float | None = None) -> tuple[list[int], list[float], list[float], NDArray]:
    """The shape (nx, ny, nz), the middle of the first voxel and the steps (mm, in the axes of DICOM: to the patient's left,
    back and head), and the values, x fastest: in Hounsfield units or what else the files' slope and intercept give.

    ``path`` is a file, a folder, or has a * in its last part. Pictures stand in the order of their positions. Read in a process
    of its own, of at most ``limit`` seconds (20 and 1 for each MB, unless given) and of bounded memory. Raises ValueError for
    what is no series of parallel pictures at equal distances along the axes. Source: DICOM PS3.3, C.7.6.2 and C.7.6.16.
    """
    name = os.fsdecode(path)
    files = sorted(os.path.abspath(f) for f in matching(name))
    if not files:
        there = "*" in os.path.basename(name) or os.path.exists(name)
        raise ValueError(f"{name}: no pictures (png, tif) and no DICOM files" if there else f"{name} does not exist")
    if find_spec("pydicom") is None:
        raise ValueError(
            f"{name}: DICOM is read by pydicom, which is not installed: pip install 'trabecula[dicom]' "
            "(png and tif need nothing more)"
        )
    size = sum(map(os.path.getsize, files))
    seconds = 20 + 1e-6 * size if limit is None else limit
    with tempfile.TemporaryDirectory(prefix="trabecula-") as folder:
        # More names than a command line takes.
        names = os.path.join(folder, "names")
        with open(names, "w", encoding="utf-8", errors="surrogateescape") as out:
            out.write("\0".join(files))
        memory = BASE + PER_BYTE * size
        shape, origin, step, values = children.arrays("dicom", [names], name, "pydicom", memory, seconds)
    return shape.tolist(), origin.tolist(), step.tolist(), values


def matching(path: str) -> list[str]:
    """The files of a folder, those that match the * of a path, or the file itself."""
    if os.path.isdir(path):
        path = os.path.join(path, "*")
    folder, last = os.path.split(path)
    return [
        f
        for f in glob.glob(os.path.join(glob.escape(folder), last.replace("[", "[[]").replace("?", "[?]")))
        if os.path.isfile(f)
    ]


class Refused(ValueError):
    """What cannot be used, in words."""


class Picture(NamedTuple):
    """One picture of a file: its number there, position (mm), directions of rows and columns, and distances of pixels (mm)."""

    file: str
    number: int
    position: NDArray
    along: NDArray
    spacing: NDArray


def child(names: str, made: str, memory: str) -> None:
    """Reads files within ``memory`` bytes and writes their arrays; what is wrong with them is the last line of the words."""
    children.bound(float(memory))
    import numpy as np

    with open(names, encoding="utf-8", errors="surrogateescape") as lines:
        files = lines.read().split("\0")
    try:
        arrays = grid(series(files))
    except MemoryError:
        sys.exit(f"it takes more than {float(memory) / 1e9:.1f} GB of memory")
    except Refused as error:
        sys.exit(str(error))
    except Exception as error:
        sys.exit(
            f"pydicom does not read it ({type(error).__name__}); is it damaged, or compressed in a way that needs a plug-in?"
        )
    np.savez(made, *arrays)


def series(files: list[str]) -> list[Picture]:
    """The pictures of the one series that the files hold."""
    import pydicom
    from pydicom.errors import InvalidDicomError

    of: dict[str, list[Picture]] = {}
    for file in files:
        try:
            data = pydicom.dcmread(file, stop_before_pixels=True)
        except InvalidDicomError:
            continue
        if "Rows" in data:
            of.setdefault(str(data.get("SeriesInstanceUID", "")), []).extend(pictures(file, data))
    if not of:
        raise Refused("no pictures (png, tif, DICOM)")
    if len(of) > 1:
        counts = ", ".join(str(len(held)) for held in of.values())
        raise Refused(f"it holds {len(of)} series, of {counts} pictures; name the files of one, with a * in the last part")
    return next(iter(of.values()))


def number(data: pydicom.Dataset, group: str, key: str, frame: int) -> Any:
    """What stands under a key: in the group of a frame, in the group that all frames share, or in the file; None if nowhere."""
    frames = data.get("PerFrameFunctionalGroupsSequence") or []
    for held in (frames[frame : frame + 1], data.get("SharedFunctionalGroupsSequence") or []):
        inner = held[0].get(group) if len(held) else None
        if inner and inner[0].get(key) is not None:
            return inner[0].get(key)
    return data.get(key)


def pictures(file: str, data: pydicom.Dataset) -> list[Picture]:
    """The pictures of a file: of several frames, each has its own place."""
    import numpy as np

    def numbers(group: str, key: str, frame: int) -> NDArray:
        of = number(data, group, key, frame)
        if of is None:
            raise Refused(f"{os.path.basename(file)} has no {key}, so that its place is unknown; convert the pictures to tif")
        return np.array(of, dtype=float)

    out = []
    for frame in range(int(data.get("NumberOfFrames") or 1)):
        position = numbers("PlanePositionSequence", "ImagePositionPatient", frame)
        along = numbers("PlaneOrientationSequence", "ImageOrientationPatient", frame)
        between = numbers("PixelMeasuresSequence", "PixelSpacing", frame)
        if position.shape != (3,) or along.shape != (6,) or between.shape != (2,) or not (between > 0).all():
            raise Refused(f"the position, orientation or pixel spacing of {os.path.basename(file)} is damaged")
        # The first number is the distance of rows, which lie along the column's direction.
        out.append(Picture(file, frame, position, along.reshape(2, 3), between[::-1]))
    return out


def grid(held: list[Picture]) -> tuple[NDArray, ...]:
    """Shape, origin, steps and values of pictures."""
    import numpy as np

    first = held[0]
    for p in held:
        if not (np.allclose(p.along, first.along, atol=ALONG) and np.allclose(p.spacing, first.spacing, rtol=ALONG)):
            names = os.path.basename(p.file), os.path.basename(first.file)
            raise Refused(f"{names[0]} is turned, or has other pixels, than {names[1]}; name the files of one stack")
    # Along rows, along columns, and from picture to picture.
    directions = np.array([*first.along, np.cross(*first.along)])
    axes = np.abs(directions).argmax(axis=1)
    along = directions[range(3), axes]
    if sorted(axes) != [0, 1, 2] or np.abs(along).min() < np.cos(TILT):
        tilt = np.degrees(np.arccos(min(1.0, np.abs(along).min())))
        raise Refused(f"its pictures are tilted {tilt:.1f} degrees to the axes; resample the series along them")
    held = sorted(held, key=lambda p: float(p.position @ directions[2]))
    steps = np.array([*first.spacing, distance(held, directions[2])])
    values = np.stack(list(layers(held)))
    counts = np.array(values.shape[::-1])
    # The pictures are indexed [picture, row, column]; wanted is [z, y, x], each rising.
    back = np.flatnonzero(along < 0)
    origin = held[0].position + (directions[back] * (steps * (counts - 1))[back, None]).sum(axis=0)
    order = np.argsort(axes)
    values = np.flip(values, tuple(2 - back)).transpose(2 - order[::-1])
    return counts[order], origin, steps[order], np.ascontiguousarray(values).reshape(-1)


def distance(held: list[Picture], across: NDArray) -> float:
    """The distance of pictures, which stand in the order of their positions; of one picture its thickness is unknown: that of
    its pixels.
    """
    import numpy as np

    if len(held) == 1:
        return float(held[0].spacing[0])
    gaps = np.diff([float(p.position @ across) for p in held])
    mean = float(np.median(gaps))
    odd = int(np.abs(gaps - mean).argmax())
    if not abs(gaps[odd] - mean) <= EVEN * mean:
        names = os.path.basename(held[odd].file), os.path.basename(held[odd + 1].file)
        raise Refused(
            f"its pictures are not equally far apart: {mean:g} mm mostly, {gaps[odd]:g} mm between {names[0]} and {names[1]}; "
            "is one missing or there twice?"
        )
    return float(np.mean(gaps))


def layers(held: list[Picture]) -> Iterator[NDArray]:
    """The values of pictures, in their order."""
    import numpy as np
    import pydicom
    from pydicom.pixels import pixel_array

    file, data = None, pydicom.Dataset()
    for p in held:
        if p.file != file:  # pictures of one file follow each other
            file, data = p.file, pydicom.dcmread(p.file, stop_before_pixels=True)
        if int(data.get("SamplesPerPixel") or 1) != 1:
            raise Refused(f"{os.path.basename(p.file)} is in colour; grey pictures are needed")
        several = int(data.get("NumberOfFrames") or 1) > 1
        raw = pixel_array(p.file, index=p.number if several else None).astype(np.float64)
        slope, intercept = (number(data, "PixelValueTransformationSequence", key, p.number) for key in RESCALE)
        yield raw * (1.0 if slope is None else float(slope)) + (0.0 if intercept is None else float(intercept))


if __name__ == "__main__":
    child(*sys.argv[1:])
