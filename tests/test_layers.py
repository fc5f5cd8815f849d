"""Layers: closed forms, volumes, topology by shapely, files read back by parsers of their own and by lib3mf."""

import io
import json
import math
import re
import struct
import zipfile

import numpy as np
import pytest
import trabecula as lt
from conftest import command, in_process

STEP = 0.25


def lattice(part="sheet", cell="gyroid", wavelength=4, fraction=0.3):
    return lt.Lattice(cell, part, lt.map.affine(wavelength), lt.level.fraction(fraction))


def built(region=None, **more):
    """A solid: a gyroid in a box of 8 mm unless something else is asked for."""
    region = region or lt.region.box(size=[8, 8, 8])
    return lt.Design(region=region, **({"lattice": lattice()} | more)).build()


def full(shape, z=0.0):
    """A solid that is full in a shape. A lattice must have some room, so there is a speck far away, at a height ``z``."""
    speck = lt.region.box(size=[0.5, 0.5, 0.01], center=[40, 0, z])
    box = lt.region.box(size=[30, 30, 30])
    return built(lt.region.union(shape, speck), keep={"all": box}, lattice=lattice(wavelength=8))


def near(layer):
    """The contours of a layer without the speck."""
    return [loop for loop in layer.loops if loop[0][0] < 30]


def area(loop):
    x, y = loop.T
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


def polygons(loops):
    """The section as shapely sees it: every hole in the smallest outer contour that holds it."""
    shapely = pytest.importorskip("shapely")
    outer = sorted((shapely.Polygon(p) for p in loops if area(p) > 0), key=lambda p: p.area)
    holes = {i: [] for i in range(len(outer))}
    for hole in (p for p in loops if area(p) < 0):
        inside = [i for i, p in enumerate(outer) if p.contains(shapely.Point(hole[0]))]
        assert inside, "a hole in no contour"
        holes[inside[0]].append(hole)
    return [shapely.Polygon(p.exterior, holes[i]) for i, p in enumerate(outer)]


DESIGNS = {
    "sheet": lambda: built(),
    "network": lambda: built(lattice=lattice("lower", "diamond")),
    "skin": lambda: built(lt.region.sphere(radius=5), skin=lt.skin(0.6)),
    "keep": lambda: built(keep={"boss": lt.region.cylinder([0, 0, -4], radius=1.5, height=8)}),
    "cylinder": lambda: built(lt.region.cylinder([0, 0, 0], radius=4, height=5)),
    "blend": lambda: built(
        lattice={"a": lattice(), "b": lattice("sheet", "primitive")},
        blend=lt.blend.between("a", "b", lt.grade.linear([1, 0, 0], {-2: 0, 2: 1})),
    ),
    "beams": lambda: lt.Design(
        region=lt.region.box(size=[8, 8, 8]), beams=lt.Beams("octet", lt.map.affine(4), radius=0.3)
    ).build(),
}


@pytest.mark.parametrize("name", DESIGNS)
def test_every_layer_is_valid_and_their_volume_is_the_solid(name):
    shapely = pytest.importorskip("shapely")
    solid = DESIGNS[name]()
    layers = solid.layers(0.05)
    total = 0.0
    for layer in layers:
        parts = polygons(layer.loops)
        whole = shapely.MultiPolygon(parts)
        assert whole.is_valid, (layer.z, shapely.is_valid_reason(whole))
        assert all((loop[0] == loop[-1]).all() for loop in layer.loops)
        assert layer.area == pytest.approx(whole.area, rel=1e-9, abs=1e-9)
        assert layer.area == pytest.approx(sum(map(area, layer.loops)), rel=1e-9, abs=1e-9)
        total += layer.area * layer.height
    mesh = solid.mesh(edge=0.06, islands="keep")
    # The midpoint rule at an eightieth of the cell (4e-4) and the mesh's own error.
    assert total == pytest.approx(mesh.volume, rel=1e-3)


def test_points_and_middles_are_within_the_tolerance_of_the_field():
    solid = DESIGNS["skin"]()
    for tolerance in (0.001, 0.02):
        layer = solid.layers(0.1, tolerance)[37]
        for loop in layer.loops:
            middles = 0.5 * (loop[:-1] + loop[1:])
            for points in (loop[:-1], middles):
                p = np.column_stack([points, np.full(len(points), layer.z)])
                h = 1e-4
                steps = [[h, 0, 0], [0, h, 0]]
                slope = np.hypot(*[(solid.field(p + d) - solid.field(p - np.array(d))) / (2 * h) for d in np.array(steps)])
                off = np.abs(solid.field(p)) / np.maximum(slope, 0.05)
                # At corners the difference is taken across an edge.
                assert np.quantile(off, 0.99) < 1.05 * tolerance and off.max() < 4 * tolerance


def test_closed_forms():
    made = list(full(lt.region.sphere(radius=3)).layers(0.1, step=0.2))
    assert len(made) == 60 and made[0].bottom == -3 and made[-1].top == 3
    areas = [sum(map(area, near(layer))) for layer in made]
    for found, layer in zip(areas, made, strict=True):
        assert found == pytest.approx(math.pi * (9 - layer.z**2), rel=1e-5)
    assert sum(areas) * 0.1 == pytest.approx(36 * math.pi, rel=2e-4)  # (h/2r)² / 2
    cut = full(lt.region.box(size=[5, 7, 2])).layers(0.3, step=0.2)
    assert len(cut) == 7 and cut[-1].height == pytest.approx(0.2)
    for layer in cut:
        (loop,) = near(layer)
        assert len(loop) == 5 and area(loop) == pytest.approx(35, rel=1e-6)
        assert np.abs(np.abs(loop) - [2.5, 3.5]).max() < 1e-6


def test_faces_in_the_plane_of_a_layer_and_corners():
    """Planes through faces and corners: what begins in the plane belongs to the section, what ends there does not."""
    stairs = lt.region.union(
        lt.region.box(min=[0, 0, 0], max=[4, 4, 1]),
        lt.region.box(min=[0, 0, 0], max=[2, 4, 2]),
    )
    whole = full(stairs, 0.7).layers(2.0, step=0.2)
    found = [sum(map(area, near(whole.at(z)))) for z in (0, 0.5, 1, 1.5, 2)]
    assert found == pytest.approx([16, 16, 8, 8, 0], abs=2e-3)
    # A pyramid on its tip: from the corner, where its four faces meet, upwards.
    sides = [lt.region.halfspace(point=[0, 0, 0], normal=n) for n in ([1, 0, -1], [-1, 0, -1], [0, 1, -1], [0, -1, -1])]
    pyramid = full(lt.region.intersection(*sides, lt.region.box(min=[-5, -5, 0], max=[5, 5, 1])), 0.5).layers(0.25, step=0.2)
    for layer in pyramid:
        (loop,) = near(layer)
        assert len(loop) == 5 and area(loop) == pytest.approx(4 * layer.z**2, rel=1e-4)
    assert near(pyramid.at(0)) == []


def read_cli(data):
    """A parser of the Common Layer Interface, from its description."""
    head, _, rest = data.partition(b"$$HEADEREND")
    lines = head.decode("ascii").splitlines()
    assert lines[0] == "$$HEADERSTART" and lines[1] in ("$$ASCII", "$$BINARY")
    facts = dict(line[2:].split("/", 1) for line in lines[2:])
    assert float(facts["UNITS"]) == 1 and facts["VERSION"] == "200"
    layers = []
    if lines[1] == "$$ASCII":
        words = rest.decode("ascii").split()
        assert words[0] == "$$GEOMETRYSTART" and words[-1] == "$$GEOMETRYEND"
        for word in words[1:-1]:
            name, _, values = word[2:].partition("/")
            numbers = [float(v) for v in values.split(",")]
            if name == "LAYER":
                layers.append((numbers[0], []))
                continue
            assert name == "POLYLINE" and numbers[2] * 2 == len(numbers) - 3
            layers[-1][1].append((int(numbers[1]), np.array(numbers[3:]).reshape(-1, 2)))
    else:
        at = 0
        while at < len(rest):
            (opcode,) = struct.unpack_from("<H", rest, at)
            if opcode == 127:
                layers.append((struct.unpack_from("<f", rest, at + 2)[0], []))
                at += 6
                continue
            assert opcode == 130
            _, direction, count = struct.unpack_from("<iii", rest, at + 2)
            points = np.frombuffer(rest, "<f4", 2 * count, at + 14).reshape(-1, 2)
            layers[-1][1].append((direction, points.astype(float)))
            at += 14 + 8 * count
    assert int(facts["LAYERS"]) == len(layers)
    return layers


@pytest.fixture(scope="module")
def part():
    return built(lt.region.sphere(radius=4), skin=lt.skin(0.5))


@pytest.mark.parametrize("binary", [False, True])
def test_a_common_layer_file_has_the_contours(part, tmp_path, binary):
    layers = part.layers(0.4)
    report = layers.save(tmp_path / "a.cli", binary=binary)
    read = read_cli((tmp_path / "a.cli").read_bytes())
    assert [z for z, _ in read] == pytest.approx(layers.heights[1:], rel=1e-6)
    for layer, (_, loops) in zip(layers, read, strict=True):
        assert len(loops) == len(layer.loops)
        for ours, (direction, theirs) in zip(layer.loops, loops, strict=True):
            assert direction == (area(ours) > 0) and (ours == theirs.astype(np.float32)).all()
    assert report.layers == len(read) == 20
    assert report.contours == sum(len(loops) for _, loops in read)
    assert report.volume == pytest.approx(sum(it.area * it.height for it in layers), rel=1e-12)


def test_a_drawing_has_groups_of_contours_and_holes(part, tmp_path):
    import xml.etree.ElementTree as tree

    layers = part.layers(0.4)
    layers.save(tmp_path / "a.svg")
    root = tree.parse(tmp_path / "a.svg").getroot()
    space = "{http://slic3r.org/namespaces/slic3r}"
    groups = root.findall("{http://www.w3.org/2000/svg}g")
    assert [float(g.get(space + "z")) for g in groups] == pytest.approx([it.z for it in layers], rel=1e-6)
    for group, layer in zip(groups, layers, strict=True):
        total = 0.0
        for polygon in group:
            points = np.array([list(map(float, p.split(","))) for p in polygon.get("points").split()])
            found = area(np.vstack([points, points[:1]]))
            assert (found > 0) == (polygon.get(space + "type") == "contour")
            total += found
        assert total == pytest.approx(layer.area, rel=1e-6)


def test_a_drawing_of_each_layer_has_its_contours_in_one_frame(part, tmp_path):
    import xml.etree.ElementTree as tree

    layers = part.layers(0.4)
    report = layers.save_each(tmp_path / "a.svg")
    whole = layers.save(tmp_path / "whole.svg")
    assert report == whole | {"volume": pytest.approx(whole.volume, rel=1e-12)} and len(layers) > 10
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == [f"{i:02}.svg" for i in range(len(layers))]
    low, high = part.bounds
    for name, layer in zip(names, layers, strict=True):
        root = tree.parse(tmp_path / "a" / name).getroot()
        assert root.get("width") == f"{high[0] - low[0]:.9g}mm"
        frame = [low[0], -high[1], high[0] - low[0], high[1] - low[1]]
        assert [float(v) for v in root.get("viewBox").split()] == pytest.approx(frame)
        drawn = [loop.split("L") for loop in root[0].get("d").replace("M", "").split("Z")[:-1]]
        loops = [np.array([list(map(float, p.split())) for p in loop]) * [1, -1] for loop in drawn]
        assert sum(area(np.vstack([loop, loop[:1]])) for loop in loops) == pytest.approx(layer.area, rel=1e-6)
    with pytest.raises(ValueError, match=r"a exists; drawings of layers go to a new folder"):
        layers.save_each(tmp_path / "a.svg")
    with pytest.raises(ValueError, match=r"must end in \.svg; found \.cli"):
        layers.save_each(tmp_path / "b.cli")

    def stopped(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        layers.save_each(tmp_path / "b.svg", progress=stopped)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "whole.svg"]


def test_lib3mf_reads_the_slices(part, tmp_path):
    lib3mf = pytest.importorskip("lib3mf")
    layers = part.layers(0.4)
    layers.save(tmp_path / "a.3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(tmp_path / "a.3mf"))
    assert reader.GetWarningCount() == 0
    stacks = model.GetSliceStacks()
    assert stacks.MoveNext()
    stack = stacks.GetCurrentSliceStack()
    assert stack.GetSliceCount() == len(layers) and stack.GetBottomZ() == pytest.approx(-4)
    for i, layer in enumerate(layers):
        made = stack.GetSlice(i)
        assert made.GetZTop() == pytest.approx(layer.top, rel=1e-6, abs=1e-6)
        points = np.array([list(v.Coordinates) for v in made.GetVertices()]).reshape(-1, 2)
        total = sum(area(points[list(made.GetPolygonIndices(k))]) for k in range(made.GetPolygonCount()))
        assert total == pytest.approx(layer.area, rel=1e-5)
    objects = model.GetObjects()
    assert objects.MoveNext() and objects.GetCurrentObject().HasSlices(False)


def png(data):
    """Grey pixels of a PNG, by a decoder of its own."""
    import zlib

    at, chunks = 8, {}
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        chunks[kind] = chunks.get(kind, b"") + data[at + 8 : at + 8 + size]
        at += 12 + size
    width, height, depth, colour = struct.unpack_from(">IIBB", chunks[b"IHDR"])
    assert (depth, colour) == (8, 0)
    raw = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, width + 1)
    assert set(raw[:, 0]) <= {0, 2}, "only the filters None and Up"
    out = np.zeros((height, width), np.uint8)
    above = np.zeros(width, np.uint8)
    for i, row in enumerate(raw):
        above = row[1:] + (above if row[0] == 2 else np.uint8(0))
        out[i] = above
    return out


def test_pictures_have_the_area_of_layers(part, tmp_path):
    layers, pixel = part.layers(0.8), 0.05
    layers.save(tmp_path / "a.zip", pixel=pixel)
    layers.save(tmp_path / "a.npy", pixel=pixel)
    layers.save(tmp_path / "a.sl1", pixel=pixel, size=(200, 180))
    archive = zipfile.ZipFile(tmp_path / "a.zip")
    assert archive.testzip() is None
    facts = json.loads(archive.read("manifest.json"))
    stack = np.load(tmp_path / "a.npy")
    assert stack.shape == (facts["width"], facts["height"], len(layers)) == (160, 160, 10)
    resin = zipfile.ZipFile(tmp_path / "a.sl1")
    config = dict(re.findall(r"^(\w+) = (.*)$", resin.read("config.ini").decode(), re.M))
    assert config["action"] == "print" and float(config["layerHeight"]) == pytest.approx(0.8)
    for i, layer in enumerate(layers):
        image = png(archive.read(facts["layers"][i]["file"]))
        assert facts["layers"][i]["area"] == pytest.approx(layer.area, rel=1e-12)
        grey = image.astype(float).sum() / 255 * pixel**2
        # Each pixel on the boundary is rounded by half a 255th at most; signs are random.
        edge = ((image > 0) & (image < 255)).sum()
        assert grey == pytest.approx(layer.area, abs=5 * 0.5 / 255 * pixel**2 * math.sqrt(edge) + 1e-9)
        assert (image == stack[:, ::-1, i].T).all()
        large = png(resin.read(f"{config['jobDir']}{i:05}.png"))
        assert large.shape == (180, 200) and (large[10:170, 20:180] == image).all()


def test_a_tiff_by_another_reader(part, tmp_path):
    tifffile = pytest.importorskip("tifffile")
    layers = part.layers(0.8)
    layers.save(tmp_path / "a.tif", pixel=0.1)
    layers.save(tmp_path / "a.npy", pixel=0.1)
    with tifffile.TiffFile(tmp_path / "a.tif") as file:
        assert (file.asarray() == np.load(tmp_path / "a.npy")[:, ::-1].T).all()
        assert file.imagej_metadata["slices"] == len(layers) and file.imagej_metadata["spacing"] == pytest.approx(0.8)
        dots, unit = file.pages[0].tags["XResolution"].value, file.pages[0].tags["ResolutionUnit"].value
        # ImageJ takes the unit of its description for that of the tag, and writes "none" there unless it is inch or cm.
        assert file.imagej_metadata["unit"] == "mm" and unit == 1
        assert dots[0] / dots[1] == pytest.approx(10)


def test_the_same_bytes_for_any_number_of_threads(part, tmp_path):
    for suffix in ("cli", "svg", "3mf", "zip", "sl1", "tif", "npy"):
        pictures = {"pixel": 0.2} if suffix in ("zip", "sl1", "tif", "npy") else {}
        files = []
        for threads in (1, 2):
            path = tmp_path / f"{threads}.{suffix}" if suffix != "sl1" else tmp_path / str(threads) / "a.sl1"
            path.parent.mkdir(exist_ok=True)
            part.layers(0.4, threads=threads).save(path, **pictures)
            files.append(path.read_bytes().replace(b"1.0.", b""))
        if suffix == "cli":
            files = [re.sub(rb"LABEL/1,\d", b"", f) for f in files]
        if suffix == "3mf":
            models = [
                zipfile.ZipFile(io.BytesIO((tmp_path / f"{t}.3mf").read_bytes())).read("3D/3dmodel.model") for t in (1, 2)
            ]
            files = [re.sub(rb'Title">\d|name="\d"', b"", m) for m in models]
        assert files[0] == files[1], suffix


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        ({"layer": 0}, "layer is 0"),
        ({"layer": math.nan}, "layer is nan"),
        ({"layer": 9}, "the part is only 8 mm high"),
        ({"layer": 1e-9}, "layers; at most"),
        ({"layer": 0.1, "tolerance": 1e-9}, "single precision"),
        ({"layer": 0.1, "start": 5}, "the part lies between -4 and 4 mm"),
        ({"layer": 0.1, "start": 2, "stop": 1}, "no layer is between 2 mm and 1 mm"),
    ],
)
def test_bad_layers_are_refused(arguments, why):
    with pytest.raises(ValueError, match=re.escape(why)):
        built().layers(**arguments)


@pytest.mark.parametrize(
    ("name", "arguments", "why"),
    [
        ("a.png", {}, "the name must end in .cli, .svg, .3mf, .sl1, .zip, .tif, .npy"),
        ("a.zip", {}, "give pixel"),
        ("a.cli", {"pixel": 0.1}, "pixel and size are for pictures"),
        ("a.svg", {"size": (40, 80)}, "pixel and size are for pictures (.sl1, .zip, .tif, .npy)"),
        ("a.tif", {"pixel": 1.0, "exposure": (5.0, 9.0)}, "exposure is for .sl1"),
        ("a.svg", {"binary": True}, "binary is for .cli"),
        ("a.zip", {"pixel": 1e-7}, "at most 1048576 are possible"),
        ("a.npy", {"pixel": 2e-5}, "of memory for pictures"),
        ("a.zip", {"pixel": 0.1, "size": (40, 80)}, "smaller than the part: it needs 80 x 80"),
    ],
)
def test_bad_files_are_refused(tmp_path, name, arguments, why):
    with pytest.raises(ValueError, match=re.escape(why)):
        built().layers(1.0).save(tmp_path / name, **arguments)
    assert list(tmp_path.iterdir()) == []


def test_the_command_slices_a_design(cube, tmp_path):
    out = tmp_path / "cube.cli"
    found = json.loads(in_process("slice", cube, "-o", out, "--layer", 0.1, "--json"))
    assert found["layers"] == 80 and found["volume"] == pytest.approx(0.3 * 512, rel=2e-3)
    assert found["contours"] == sum(len(loops) for _, loops in read_cli(out.read_bytes()))
    text = in_process("slice", cube, "-o", tmp_path / "cube.zip", "--layer", 2, "--pixel", 0.1)
    assert "4 layers of 2 mm" in text
    stack = tmp_path / "cube.npy"
    in_process("slice", cube, "-o", stack, "--layer", 2, "--pixel", 0.1, "--size", "100x120")
    wide = np.load(stack)
    assert wide.shape == (100, 120, 4) and not wide[:10].any() and not wide[:, :20].any() and wide[10:90, 20:100].any()
    each = json.loads(in_process("slice", cube, "-o", tmp_path / "each.svg", "--layer", 2, "--each", "--json"))
    assert each["layers"] == 4 and sorted(path.name for path in (tmp_path / "each").iterdir())[-1] == "3.svg"
    one = json.loads(in_process("slice", cube, "--z", 1, "-o", tmp_path / "one.svg", "--json"))
    assert one["area"] > 10 and "<path" in (tmp_path / "one.svg").read_text()


def test_the_command_says_what_is_wrong(cube, tmp_path):
    for words, status, why in [
        ((), 2, "slice needs --layer MM"),
        (("--layer", 1, "--each", "-o", "a.cli"), 2, "--each writes an .svg for each layer"),
        (("--layer", 1, "--each", "-o", "a.svg", "--resume"), 2, "--each writes its layers in one run"),
        (("--z", 1, "--each", "-o", "a.svg"), 2, "--each belongs to --layer"),
        (("--layer", "1"), 2, "slice --layer needs -o OUT"),
        (("--layer", "0", "-o", "a.cli"), 2, "expected a length in mm greater than 0, found 0"),
        (("--layer", "1", "-o", tmp_path / "a.zip"), 2, "add --pixel MM"),
        (("--layer", "1", "--least", "0.1", "-o", "a.cli"), 2, "add --adaptive MM"),
        (("--layer", "1", "--beams", "b", "-o", "a.cli"), 2, "--beams belongs to --z"),
        (("--z", "0", "--from", "0"), 2, "--from belongs to --layer"),
        (("--z", "0", "--binary"), 2, "--binary belongs to --layer"),
        (("--z", "50"), 1, "outside the part, which lies from -4 to 4 mm"),
    ]:
        done = command("slice", cube, *words)
        assert (done.returncode, done.stdout) == (status, "") and why in done.stderr, done.stderr
