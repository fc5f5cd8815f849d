"""The solids of corpus/designs as functions, negative inside: numpy and the formulas, written out once more here."""

import numpy as np
from cell_reference import formula, waves
from corpus_files import SCATTER, plate, rods

TAU = 2 * np.pi


def rotation(x, y, z):
    """Rx Ry Rz, degrees."""
    (sx, cx), (sy, cy), (sz, cz) = ((np.sin(a), np.cos(a)) for a in np.radians((x, y, z)))
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return rx @ ry @ rz


def seen(name, p, matrix, offset=(0, 0, 0)):
    """The named cell at phases matrix (p - offset)."""
    u = [sum(matrix[i][k] * (p[k] - offset[k]) for k in range(3)) for i in range(3)]
    return formula(name, *map(waves, u))


def box(p, low, high):
    """A function with the sign of the distance to a box."""
    parts = [np.maximum(low[k] - p[k], p[k] - high[k]) for k in range(3)]
    return np.maximum(np.maximum(parts[0], parts[1]), parts[2])


def ball(p, centre, radius):
    """Distance to a sphere."""
    return np.sqrt(sum((p[k] - centre[k]) ** 2 for k in range(3))) - radius


def tube(p, radius, low, high):
    """A function with the sign of the distance to an upright cylinder."""
    return np.maximum(np.hypot(p[0], p[1]) - radius, np.maximum(low - p[2], p[2] - high))


def ramp(s, s0, v0, s1, v1):
    """Linear between two stops, constant beyond."""
    return v0 + (v1 - v0) * np.clip((s - s0) / (s1 - s0), 0, 1)


def lens(p):
    """The ball of radius 9 about (0, 0, -4) above z = -1, grown by 0.5 as min and max do it."""
    return np.maximum(ball(p, (0, 0, -4), 9), -1 - p[2]) - 0.5


def iso(n):
    """Scaling by 1/n."""
    return np.eye(3) / n


SHEAR = np.array([[1, 0, -np.tan(np.radians(20))], [0, 1, 0], [0, 0, 1]])
MOVED = (0.3, 0.7, 1.1)
T30 = 0.463951958  # gyroid, sheet, fraction 0.30: corpus/cells.toml
D35 = 0.365449953  # diamond, f >= t, fraction 0.35: the sheet of fraction 0.3 has this half-level, and V(-t) = 0.35


def polynomial(porosity):
    """The SPARTAN note's level of the diamond (f <= t), as published."""
    c = (-1401.81203, 6314.42849, -12073.4024, 12771.4436, -8165.88099, 3237.5785, -784.778926, 109.747587, -10.1136257)
    return np.polyval((*c, 1.39501223), porosity)


def slabs(x, fraction, period=4.0):
    """|cos| of x less the level whose sheet is `fraction`: V(t) - V(-t) = 1 - 2 acos(t)/pi."""
    return np.abs(np.cos(TAU * (x - 0.1) / period)) - np.sin(np.pi * fraction / 2)


def tetrahedron(p, corners):
    """The greatest of the distances to the planes of a tetrahedron."""
    corners = np.array(corners, float)
    out = None
    for i in range(4):
        a, b, c = np.delete(corners, i, 0)
        n = np.cross(b - a, c - a)
        n *= -np.sign(n @ (corners[i] - a)) / np.linalg.norm(n)
        plane = sum(n[k] * (p[k] - a[k]) for k in range(3))
        out = plane if out is None else np.maximum(out, plane)
    return out


def bilinear(p):
    """The grid of plate.npy at y and z, from 10 to 44 as 0.2 to 0.6; between its nodes z^2 is a chord."""
    z = np.clip(p[2], 0, 4)
    chord = np.where(z < 2, 2 * z, 4 + 6 * (z - 2))
    return ramp(plate(np.clip(p[1], 0, 6), 0) + chord, 10, 0.2, 44, 0.6)


def weighted(p):
    """The mean of SCATTER at x = 0 and x = 8 by one over the squared distance."""
    total = number = 0
    for x in (0, 8):
        for y, z, v in SCATTER:
            w = 1 / ((p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2 + 1e-300)
            total, number = total + w * v, number + w
    return total / number


def bumps(p, values=(0.6, 0.3, 0.5), delta=6.0):
    """Gaussian functions of y and z that take `values` at control points."""
    y, z = (np.array(c, float) for c in ((1, 5, 3), (1, 1, 3)))
    square = (y[:, None] - y) ** 2 + (z[:, None] - z) ** 2
    beta = np.linalg.solve(np.exp(-square / delta**2), np.array(values))
    return sum(b * np.exp(-((p[1] - c) ** 2 + (p[2] - d) ** 2) / delta**2) for b, c, d in zip(beta, y, z, strict=True))


def step(s, middle, width):
    """The logistic step from 0 to 1, its outer fiftieths cut off and stretched to [0, 1] over `width`."""
    logistic = 1 / (1 + np.exp(-np.log(49) * 2 * (s - middle) / width))
    return np.clip((logistic - 0.02) / 0.96, 0, 1)


def by_value(p):
    """Primitive to gyroid along x, values and levels weighted alike."""
    w = step(p[0], 5, 8)
    return (1 - w) * (seen("primitive", p, iso(4), MOVED) - 0.1) + w * (seen("gyroid", p, iso(4), MOVED) - 0.3)


def of_three(p):
    """Primitive, gyroid and, in a ball, diamond."""
    weights = ramp(p[0], -4, 1, 4, 0), 0.5, step(-ball(p, (0, 0, 0), 3), 0, 4)
    fields = [seen(n, p, iso(4), MOVED) - t for n, t in (("primitive", 0.1), ("gyroid", 0.3), ("diamond", 0.2))]
    return sum(w * f for w, f in zip(weights, fields, strict=True)) / sum(weights)


def cosines(p):
    """cos x cos y + cos y cos z + cos z cos x in cells of 4 mm."""
    x, y, z = (np.cos(TAU * (p[k] - MOVED[k]) / 4) for k in range(3))
    return x * y + y * z + z * x


def ell(tau):
    """Volume of two cylinders of radius 1 and length 6 with round ends, at a right angle, filleted by S <= N(G) with
    R = [[1, tau], [tau, 1]] (Cirak and Sabin).

    Without a fillet both capsules less 4/3 + pi that they share. Seen from the hub in the direction phi, the fillet reaches
    z^2 + q rho^2 = 1 where the nearer cylinder reaches z^2 + m rho^2 = 1; a disc over both gives the difference.
    """
    x, w = np.polynomial.legendre.leggauss(200)
    start = np.arctan(tau)
    phi = start + (np.pi / 4 - start) * (x + 1) / 2
    q = 1 - (1 - tau * np.sin(2 * phi)) / (1 - tau**2 + 1e-300)
    more = 4 / 3 * (np.pi / 4 - start) / 2 * (w @ (1 / q - 1 / np.sin(phi) ** 2)) if tau < 1 else 0.0
    return 12 * np.pi + 8 * np.pi / 3 - 4 / 3 - np.pi + more


def frame(radius=0.5, length=4.0):
    """Volume of the edges of a cube as cylinders with balls at the corners. What three half-cylinders share is taken octant by
    octant: nearest to one axis the other two cost it the integral of max(y, z) over a quarter of a disc."""
    corner = -np.sqrt(2) - 2 + np.pi / 6
    return 12 * np.pi * radius**2 * length + 8 * corner * radius**3


def tau_of(radius):
    """tau of a fillet between equal cylinders of radius 1 at a right angle, by its radius of curvature in the middle:
    the hyperbola u^2 tau/(1 + tau) - v^2 tau/(1 - tau) = 1 has (1 - tau)/sqrt(tau (1 + tau)) there."""
    low, high = 1e-9, 1.0
    for _ in range(100):
        middle = (low + high) / 2
        wide = (1 - middle) / np.sqrt(middle * (1 + middle)) > radius
        low, high = (middle, high) if wide else (low, middle)
    return middle


def quadric_beam(first, second, length, lam):
    """(volume, area) of two balls and the quadric of parameter lam between them,
    rho^2 = (lam - 1) z^2 - 2 lam d z + first^2 + lam d^2, which touches the first ball at z = d."""
    radical = (length**2 + first**2 - second**2) / (2 * length)
    d, e = radical - length / (2 * lam), length - radical - length / (2 * lam)
    x, w = np.polynomial.legendre.leggauss(200)
    z = d + (length - e - d) * (x + 1) / 2
    w = w * (length - e - d) / 2
    square = (lam - 1) * z**2 - 2 * lam * d * z + first**2 + lam * d**2
    slope = (lam - 1) * z - lam * d  # rho rho'
    caps = [(r, r + c) for r, c in ((first, d), (second, e))]
    volume = np.pi * (w @ square) + sum(np.pi * h**2 * (3 * r - h) / 3 for r, h in caps)
    return volume, TAU * (w @ np.sqrt(square + slope**2)) + sum(TAU * r * h for r, h in caps)


def waist(radius, length, least):
    """lam of the beam between equal balls whose thinnest place has the radius `least`."""
    return 1 / (1 - 4 * (radius**2 - least**2) / length**2)


def hull(first, second, length):
    """(volume, area) of the convex hull of two balls."""
    sine = (first - second) / length
    cosine = np.sqrt(1 - sine**2)
    a, b, high = first * cosine, second * cosine, length - (first - second) * sine
    caps = [(first, first * (1 + sine)), (second, second * (1 - sine))]
    volume = np.pi * high * (a * a + a * b + b * b) / 3 + sum(np.pi * h**2 * (3 * r - h) / 3 for r, h in caps)
    return volume, np.pi * (a + b) * np.hypot(high, a - b) + sum(TAU * r * h for r, h in caps)


def row_of_beams():
    """(volume, area) of beams of radius 0.65, 0.75 and 0.85 at their middles in a row of balls of radius 1."""
    volume, area = 0.0, 0.0
    for middle in (0.65, 0.75, 0.85):
        one = quadric_beam(1, 1, 5, waist(1, 5, middle))
        volume, area = volume + one[0], area + one[1]
    # Balls between two beams are counted twice.
    return volume - 2 * 4 * np.pi / 3, area - 2 * 4 * np.pi


# name: volume and, of bodies of revolution, area
CLOSED = {
    "beam_cone": lambda: hull(2, 1, 6),
    "beam_waist": lambda: quadric_beam(1, 1, 6, waist(1, 6, 0.7)),
    "beam_lambda": lambda: quadric_beam(1, 1, 6, 0.9),
    "beams_graded": row_of_beams,
    "frame_of_cell": lambda: [frame()],
    "ell_none": lambda: [ell(1.0)],
    "ell_auto": lambda: [ell(1 / 2.997)],
    "ell_radius": lambda: [ell(tau_of(0.5))],
    "ell_tau": lambda: [ell(0.5)],
}
EVEN = ((0, 0, 0), (8, 6, 4))

# name: (bounds, region, lattice), negative inside
SOLIDS = {
    "lamellae": (
        ((-5,) * 3, (5,) * 3),
        lambda p: box(p, (-5,) * 3, (5,) * 3),
        lambda p: np.cos(TAU * (p[0] - 0.3) / 5) + 0 * p[1] * p[2],
    ),
    "gyroid_half": (
        ((-5,) * 3, (5,) * 3),
        lambda p: box(p, (-5,) * 3, (5,) * 3),
        lambda p: seen("gyroid", p, iso(5), MOVED),
    ),
    "gyroid_sheet_30": (
        ((0,) * 3, (10,) * 3),
        lambda p: box(p, (0,) * 3, (10,) * 3),
        lambda p: np.abs(seen("gyroid", p, iso(5), MOVED)) - T30,
    ),
    "diamond_upper_porous": (
        ((0,) * 3, (12, 10, 8)),
        lambda p: box(p, (0,) * 3, (12, 10, 8)),
        lambda p: D35 - seen("diamond", p, np.diag([1 / 6, 1 / 5, 1 / 4]), MOVED),
    ),
    "primitive_cavities": (
        ((-2.5,) * 3, (7.5,) * 3),
        lambda p: box(p, (-2.5,) * 3, (7.5,) * 3),
        lambda p: seen("primitive", p, iso(5)) - 2.5,
    ),
    "primitive_blobs": (
        ((-2.5,) * 3, (7.5,) * 3),
        lambda p: box(p, (-2.5,) * 3, (7.5,) * 3),
        lambda p: 2.5 - seen("primitive", p, iso(5)),
    ),
    "iwp_ball": (
        ((-5, -4, -3), (7, 8, 9)),
        lambda p: ball(p, (1, 2, 3), 6),
        lambda p: np.abs(seen("iwp", p, iso(5) @ rotation(10, 20, 30).T, (0.5, -0.25, 1.0))) - 0.9,
    ),
    "spartan_cylinder": (
        ((-6, -6, -4), (6, 6, 5)),
        lambda p: tube(p, 6, -4, 5),
        lambda p: seen("gyroid_mirrored", p, rotation(20, 35, 50).T @ np.diag([1 / 4, 1 / 5, 1 / 6])) - 0.25,
    ),
    "linear_slab": (
        ((0,) * 3, (20, 8, 8)),
        lambda p: box(p, (0,) * 3, (20, 8, 8)),
        lambda p: np.abs(seen("gyroid", p, iso(4), MOVED)) - ramp(p[0], 2, 0.2, 18, 0.9),
    ),
    "depth_ball": (
        ((-7,) * 3, (7,) * 3),
        lambda p: ball(p, (0,) * 3, 7),
        lambda p: np.abs(seen("primitive", p, iso(5))) - ramp(-ball(p, (0,) * 3, 7), 0, 0.9, 4, 0.3),
    ),
    "formula_ring": (
        ((-9, -9, 0), (9, 9, 5)),
        lambda p: np.maximum(tube(p, 9, 0, 5), -tube(p, 4, -1, 6)),
        lambda p: np.abs(seen("diamond", p, iso(5))) - (0.4 + 0.1 * np.sin(p[0] / 3)),
    ),
    "graded_about_bore": (
        ((-6, -6, 0), (6, 6, 5)),
        lambda p: np.maximum(box(p, (-6, -6, 0), (6, 6, 5)), -tube(p, 2, -1, 6)),
        lambda p: np.abs(seen("diamond", p, iso(5))) - ramp(2 - np.hypot(p[0], p[1]), -4, 0.3, 0, 0.6) * (1 + p[0] / 40),
    ),
    "skewed_lens": (
        ((-9.5, -9.5, -1.5), (9.5, 9.5, 5.5)),
        lens,
        lambda p: -seen("neovius", p, iso(6) @ SHEAR),
    ),
    "mesh_bracket": (
        ((0,) * 3, (10, 10, 5)),
        lambda p: np.maximum(box(p, (0,) * 3, (10, 10, 5)), -box(p, (5, 5, -1), (11, 11, 6))),
        lambda p: np.abs(seen("gyroid", p, iso(5), MOVED)) - T30,
    ),
    "united_tetrahedron": (
        ((-4, -4, -2), (4, 4, 7)),
        lambda p: np.minimum(box(p, (-4, -4, -2), (4, 4, 2)), tetrahedron(p, ((-3, -3, 0), (3, -3, 0), (0, 4, 0), (0, 0, 7)))),
        lambda p: seen("primitive", p, iso(4), MOVED) - 0.3,
    ),
    "discs_radial": (
        ((-6, -6, 0), (6, 6, 6)),
        lambda p: tube(p, 6, 0, 6),
        lambda p: slabs(p[2], ramp(np.hypot(p[0], p[1]), 0, 0.2, 6, 0.6), 3),
    ),
    "grid_numbers": (EVEN, lambda p: box(p, *EVEN), lambda p: slabs(p[0], bilinear(p))),
    "result_on_mesh": (EVEN, lambda p: box(p, *EVEN), lambda p: slabs(p[0], ramp(p[1], 0, 0.2, 6, 0.6))),
    "scattered_points": (EVEN, lambda p: box(p, *EVEN), lambda p: slabs(p[0], weighted(p))),
    "rbf_fraction": (EVEN, lambda p: box(p, *EVEN), lambda p: slabs(p[0], 1 - bumps(p))),
    "wall_by_distance": (
        ((0, 0.2, 0), (8, 1.2, 1)),
        lambda p: box(p, (0, 0.2, 0), (8, 1.2, 1)),
        lambda p: np.abs((p[0] - 0.3) % 2 - 1) - np.hypot(p[1], p[2]) / 2,
    ),
    "spartan_fit": (
        ((0,) * 3, (5,) * 3),
        lambda p: box(p, (0,) * 3, (5,) * 3),
        lambda p: seen("diamond", p, iso(5), MOVED) - polynomial(0.7),
    ),
    "series_of_group": (
        ((0,) * 3, (4,) * 3),
        lambda p: box(p, (0,) * 3, (4,) * 3),
        lambda p: 0.5 - 2 * cosines(p),
    ),
    "cell_of_numbers": (
        ((0,) * 3, (8, 8, 3)),
        lambda p: box(p, (0,) * 3, (8, 8, 3)),
        lambda p: 0.4 - rods((p[0] - 0.3) / 4, (p[1] - 0.7) / 4) + 0 * p[2],
    ),
    "blend_by_value": (((0,) * 3, (12, 4, 4)), lambda p: box(p, (0,) * 3, (12, 4, 4)), by_value),
    "blend_of_three": (((-4,) * 3, (4,) * 3), lambda p: box(p, (-4,) * 3, (4,) * 3), of_three),
    "turned_by_direction": (
        ((-3, -2, -3), (3, 4, 3)),
        lambda p: box(p, (-3, -2, -3), (3, 4, 3)),
        lambda p: seen("primitive", p, iso(4) @ rotation(0, 45, 0).T) - 0.3,
    ),
}
