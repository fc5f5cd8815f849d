"""Pictures: views by name, sections, turntables."""

import struct
import zlib

import numpy as np
import pytest
import trabecula as lt
from conftest import in_process
from hypothesis import given, settings
from hypothesis import strategies as st
from trabecula.pictures.camera import VIEWS, section_plane, towards
from trabecula.pictures.turntable import SIGNATURE, animated


def read(png, channels=3):
    """Control of the frames, and the pictures (h, w, channels)."""
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
        rows = np.frombuffer(zlib.decompress(raw), np.uint8).reshape(height, 1 + channels * width)
        pictures.append(unfiltered(rows, channels).reshape(height, width, channels))
    return frames, pictures


def unfiltered(rows, wide):
    """Rows of bytes without their filters (PNG, section 9), so many bytes a pixel."""
    above, out = [0] * (rows.shape[1] - 1), []
    for kind, *line in rows.tolist():
        for i, v in enumerate(line):
            left, corner = (line[i - wide], above[i - wide]) if i >= wide else (0, 0)
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


def test_parallel_rays_draw_to_scale(cube):
    """A square of 4 mm fills 92 % of the height, seen from the top, in whatever depth a section shows it."""
    low = lt.Mesh.of(cube.vertices * [1, 1, 3], cube.triangles)
    for mesh in (cube, low):
        png = mesh.png((200, 160), *VIEWS["top"], background="white", projection="orthographic", section="z=3.9")
        _, (seen,) = read(png)
        ys, xs = np.nonzero((seen[..., 0].astype(int) - seen[..., 1]) > 60)
        # A pixel that is partly covered at either end.
        assert abs(np.ptp(xs) + 1 - 0.92 * 160) <= 2 and abs(np.ptp(ys) + 1 - 0.92 * 160) <= 2
    with pytest.raises(ValueError, match="scale_bar needs an orthographic projection"):
        cube.png(scale_bar=True)
    with pytest.raises(ValueError, match="projection is 'flat'; it must be one of perspective, orthographic"):
        cube.png(projection="flat")
    with pytest.raises(ValueError, match="elevation is 200"):
        cube.png(elevation=200)
    with pytest.warns(lt.DesignWarning, match="80 × 60 pixels is too small for legend, scale bar or axes"):
        cube.png((80, 60), axes=True)
    with pytest.warns(lt.DesignWarning, match="too small for its legend"):
        cube.png((80, 60), color=np.arange(8.0))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2), st.booleans(), st.floats(-80, 80), st.floats(-80, 80), st.booleans())
def test_a_section_in_a_face_is_hatched_as_a_whole_and_one_outside_is_refused(cube, axis, far, azimuth, elevation, parallel):
    look = {"projection": "orthographic" if parallel else "perspective"}
    name, place = "xyz"[axis], 4 if far else 0
    eye = (azimuth + 180 * (axis == 0 and not far) + (90 if far else -90) * (axis == 1), elevation)
    eye = eye if axis < 2 else (azimuth, (5 + abs(elevation)) * (1 if far else -1))
    at, inside = (read(cube.png((160, 120), *eye, section=f"{name}={v}", **look))[1][0] for v in (place, abs(place - 0.004)))
    # Its edges may lie a pixel farther: a row and a column of it, which is much where it is seen at a narrow angle.
    seen = np.any([(p[..., 0].astype(int) - p[..., 1]) > 60 for p in (at, inside)], axis=0)
    assert abs(int(red(at)) - int(red(inside))) <= seen.any(axis=0).sum() + seen.any(axis=1).sum()
    for text in (f"{name}=100", f"{name}<100", f"{name}>100", f"{name}=-1"):
        with pytest.raises(ValueError, match=rf"the mesh lies from 0 to 4 mm along {name}"):
            cube.png((40, 30), section=text)


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
    for wrong in (["--seconds", 3], ["--scale-bar"]):
        in_process("render", tmp_path / "cube.stl", "-o", tmp_path / "a.png", *wrong, status=2)
    with pytest.raises(SystemExit, match="2"):  # what the parser of options refuses itself
        in_process("render", tmp_path / "cube.stl", "-o", tmp_path / "a.png", "--elevation", 200)
    assert mistaken == "" and not (tmp_path / "a.png").exists()
