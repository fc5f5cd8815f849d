"""The workloads of the benchmarks: design files for the command, and the same geometry for programs that take an array.

n is the number of samples along each axis of a closed cube of 4 x 4 x 4 gyroid cells, 20 mm on a side.
"""

CELLS = 4
SIZE = 20.0
T30 = 0.463951958  # |f| <= t is 30 % of the gyroid: corpus/cells.toml

DESIGN = """schema = 1
units = "mm"
[region.box]
min = [0, 0, 0]
max = [{size}, {size}, {size}]
[lattice.a]
cell = "gyroid"
part = "{part}"
map.affine.wavelength = {wavelength}
level.iso = {iso}
"""

# name: (part, iso, exact volume)
WORKLOADS = {
    "skeletal": ("lower", 0.0, 0.5 * SIZE**3),
    "sheet": ("sheet", T30, 0.3 * SIZE**3),
}


def design(name):
    """The design file's text."""
    part, iso, _ = WORKLOADS[name]
    return DESIGN.format(size=SIZE, part=part, wavelength=SIZE / CELLS, iso=iso)


def spacing(n):
    """Grid spacing, mm."""
    return SIZE / (n - 1)


def field(name, n):
    """f as a float32 array (z, y, x), one outer layer closing the cube: the fastest plain-numpy way, by tables."""
    import numpy as np

    u = 2 * np.pi * np.linspace(0, CELLS, n)
    s, c = np.sin(u).astype("f4"), np.cos(u).astype("f4")
    f = s * c[:, None] + (s[:, None] * c[:, None, None])
    f += s[:, None, None] * c
    if name == "sheet":
        np.abs(f, out=f)
        f -= np.float32(T30)
    return np.pad(f, 1, constant_values=np.float32(1e3))


def write_stl(path, vertices, triangles):
    """Binary STL with plain numpy."""
    import numpy as np

    corners = np.ascontiguousarray(vertices, dtype="<f4")[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    facet = np.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    facet["normal"], facet["corners"] = normal, corners
    with open(path, "wb") as out:
        out.write(bytes(80) + np.uint32(len(triangles)).astype("<u4").tobytes())
        facet.tofile(out)


def read_volume(path):
    """(triangles, enclosed volume) of a binary STL."""
    import numpy as np

    count = int(np.fromfile(path, "<u4", 1, offset=80)[0])
    facets = np.memmap(path, np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]), "r", 84, (count,))
    volume = 0.0
    for start in range(0, count, 1 << 20):
        v = facets["v"][start : start + (1 << 20)].astype("f8") - SIZE / 2
        volume += float(np.einsum("ij,ij->", v[:, 0], np.cross(v[:, 1], v[:, 2]))) / 6
    return count, volume
