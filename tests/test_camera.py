"""Pictures: views by name, sections, turntables."""

import struct
import zlib

import numpy as np
import pytest
import trabecula as lt
from conftest import in_process
from trabecula.camera import VIEWS, section_plane, towards
from trabecula.turntable import SIGNATURE, animated


def read(png, kinds=(b"IDAT",)):
    """Control of the frames and rows (h, w, 3) of the first picture of these chunks."""
    assert png.startswith(SIGNATURE)
    at, head, frames, data = len(SIGNATURE), None, [], {}
    while at < len(png):
        (length,) = struct.unpack_from(">I", png, at)
        kind, body = png[at + 4 : at + 8], png[at + 8 : at + 8 + length]
        assert struct.unpack_from(">I", png, at + 8 + length)[0] == zlib.crc32(kind + body)
        if kind == b"IHDR":
            head = struct.unpack(">II", body[:8])
        elif kind in (b"acTL", b"fcTL"):
            frames.append((kind, body))
        elif kind in (b"IDAT", b"fdAT"):
            data.setdefault(len(frames), b"")
            data[len(frames)] += body[4:] if kind == b"fdAT" else body
        at += 12 + length
    width, height = head
    pictures = []
    for raw in data.values():
        rows = np.frombuffer(zlib.decompress(raw), np.uint8).reshape(height, 1 + 3 * width)
        pictures.append(unfiltered(rows).reshape(height, width, 3))
    return frames, pictures


def unfiltered(rows):
    """Rows of bytes without their filters (PNG, section 9), three bytes a pixel."""
    above, out = [0] * (rows.shape[1] - 1), []
    for kind, *line in rows.tolist():
        for i, v in enumerate(line):
            left, corner = (line[i - 3], above[i - 3]) if i > 2 else (0, 0)
            up = above[i]
            guess = left + up - corner
            paeth = min((left, up, corner), key=lambda c: abs(guess - c))
            line[i] = (v + (0, left, up, (left + up) // 2, paeth)[kind]) % 256
        above = line
        out.append(line)
    return np.array(out, np.uint8)


@pytest.fixture(scope="module")
def cube():
    corners = np.array([[x, y, z] for z in (0, 4) for y in (0, 4) for x in (0, 4)], float)
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return lt.Mesh.of(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def red(picture):
    return ((picture[..., 0].astype(int) - picture[..., 1]) > 60).sum()


@pytest.mark.parametrize("name", VIEWS)
def test_views_look_along_axes(name):
    eye = np.array(towards(*VIEWS[name]))
    axis = {"right": (0, 1), "left": (0, -1), "back": (1, 1), "front": (1, -1), "top": (2, 1), "bottom": (2, -1)}.get(name)
    if axis is None:
        assert np.allclose(eye, 3**-0.5)
    else:
        assert np.isclose(eye[axis[0]], axis[1]) and np.isclose(np.linalg.norm(eye), 1)


def test_a_section_keeps_the_side_away_from_the_eye_unless_one_is_named():
    assert section_plane("z=1.5", (0, 0, 1)) == ((0, 0, 1), 1.5) == section_plane(" z < 1.5 ", (0, 0, -1))
    assert section_plane("x=-2", (-1, 0, 0)) == ((-1, 0, 0), 2.0) == section_plane("x>=-2", (1, 0, 0))
    for wrong in ("w=1", "z", "z=", "z=nan", "z=1,2", "10"):
        with pytest.raises(ValueError, match="it must be x, y or z"):
            section_plane(wrong, (0, 0, 1))


def test_a_cube_that_is_cut_shows_its_section(cube):
    _, (whole,) = read(cube.png((160, 160), *VIEWS["top"]))
    _, (cut,) = read(cube.png((160, 160), *VIEWS["top"], section="z=2"))
    _, (other,) = read(cube.png((160, 160), *VIEWS["top"], section="z>2"))
    # The section is a square: its area is that of its bounding rectangle but for the pixels at its edges.
    ys, xs = np.nonzero((cut[..., 0].astype(int) - cut[..., 1]) > 60)
    rectangle = (np.ptp(ys) + 1) * (np.ptp(xs) + 1)
    assert red(whole) == red(other) == 0 and 0 <= rectangle - red(cut) <= 2 * (np.ptp(ys) + np.ptp(xs)) and red(cut) > 4000


def test_a_turntable_is_its_pictures(cube, tmp_path):
    frames = [cube.png((40, 30), azimuth, 20) for azimuth in (0, 90, 180)]
    control, pictures = read(animated(frames, 1.5))
    assert control[0] == (b"acTL", struct.pack(">II", 3, 0)) and len(control) == 4
    assert all(struct.unpack(">HH", c[1][20:24]) == (500, 1000) for c in control[1:])
    for frame, picture in zip(frames, pictures, strict=True):
        assert (read(frame)[1][0] == picture).all()
    cube.write(tmp_path / "cube.stl")
    in_process("render", tmp_path / "cube.stl", "-o", tmp_path / "turn.png", "--turn", 4, "--size", "40x30", "--section", "x=2")
    control, pictures = read((tmp_path / "turn.png").read_bytes())
    # The same side is kept all round: the section is seen from the front and not from behind.
    assert len(pictures) == 4 and red(pictures[0]) > 100 and red(pictures[2]) == 0
    mistaken = in_process("render", tmp_path / "cube.stl", "-o", tmp_path / "a.png", "--section", "w=2", status=1)
    assert mistaken == "" and not (tmp_path / "a.png").exists()
