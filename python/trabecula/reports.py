"""Reports: figures with their units, one class each. Made by scripts/report_classes.py; do not edit."""

from __future__ import annotations

from .base.record import Report

# ruff: noqa: RUF012  the parts of a class are declared by its base

__all__ = [
    "BeamMeshReport",
    "BeamsFileReport",
    "BeamsReport",
    "BlendReport",
    "CellGrid",
    "CleanedReport",
    "ConductivityReport",
    "Creases",
    "DanglingReport",
    "DesignReport",
    "DihedralReport",
    "DistanceReport",
    "DistortionReport",
    "DomainReport",
    "EstimateReport",
    "FilletShortfall",
    "FitReport",
    "FractionAlong",
    "Histogram",
    "IslandsReport",
    "LargestFragment",
    "LargestIsland",
    "LatticeReport",
    "LayersMade",
    "LayersReport",
    "LooseBodies",
    "LostFeatureReport",
    "MapSpread",
    "MeshReport",
    "MinMeanMax",
    "NarrowestNeck",
    "NetReport",
    "PeriodReport",
    "PermeabilityReport",
    "PropertyReport",
    "QualityReport",
    "RbfReport",
    "RegionReport",
    "RepairReport",
    "SetReport",
    "ShellReport",
    "SimplifyReport",
    "SingularLineReport",
    "SmoothReport",
    "SpecificSurface",
    "StepReport",
    "StiffnessReport",
    "SurfaceReport",
    "TessellationReport",
    "TetMeshReport",
    "TetQualityReport",
    "ThicknessReport",
    "ThicknessSpread",
    "TilingReport",
    "TransitionReport",
    "TrimmedReport",
    "VoidReport",
    "VolumeReport",
    "VoxelElementsReport",
    "WallSpread",
    "WarningReport",
    "ZoneJoin",
    "ZoneReport",
]


class BeamMeshReport(Report):
    """The figures of beams as finite elements."""

    _parts = {
        "sets": "SetReport",
    }
    _by_name = frozenset(["sets"])

    beams: int
    """Number of beams of which some length is in the region."""
    cut: int
    """Number of those that the region cuts."""
    elements: int
    """Number of elements."""
    length: float
    """Length of all axes, mm."""
    loose: float
    """Length of components that were left out, mm."""
    nodes: int
    """Number of nodes."""
    order: int
    """1 for linear elements, 2 for quadratic ones."""
    pieces: int
    """Number of connected components."""
    sections: int
    """Number of sections: radii to five digits, each with one or two directions of its first axis."""
    sets: dict[str, SetReport]
    """The named sets; faces are ends of elements."""
    thickest: float
    """Greatest radius of an element, mm."""
    thinnest: float
    """Smallest radius of an element, mm."""
    volume: float
    """Area times length of all elements, mm³: more than the solid's volume, since beams overlap in hubs."""


class BeamsFileReport(Report):
    """What a file of beams contains."""

    balls: int
    """Number of balls at nodes, where a hub is larger than its beams are there."""
    beams: int
    """Number of beams; of a 3MF the frusta of cones."""
    clipped: bool
    """Whether the file has the mesh of the region that cuts the beams."""
    error: float | None
    """Greatest difference between the radius of a beam and that of its frusta, mm; None for a graph."""
    lost: list[str]
    """What of the beams the format cannot hold, a sentence each."""
    nodes: int
    """Number of nodes."""
    split: int
    """Number of beams that are several frusta."""


class BeamsReport(Report):
    """A graph of beams, or a pattern of them: figures of both first, then those of a graph or of a pattern."""

    _parts = {
        "cleaned": "CleanedReport",
        "fillet_shortfalls": "FilletShortfall",
        "trimmed": "TrimmedReport",
    }

    area: float | None
    """Surface area, mm²; None where the volume is."""
    beams: float | None
    """Number of beams, repeats included."""
    cell: str | None
    """Name of the unit cell; None for nodes and struts of your own and for patterns."""
    centroid: list[float] | None
    """Centre of mass, mm."""
    cleaned: CleanedReport | None
    """What was cleaned."""
    collisions: int | None
    """Pairs of beams that run into each other without a common node, about one hub of each kind; None if not known."""
    dangling: int | None
    """Number of nodes inside the region with a single beam."""
    fillet_radius: list[float] | None
    """Least and greatest radius of fillets at their tightest places, mm; None without fillets."""
    fillet_shortfalls: list[FilletShortfall] | None
    """Hubs in the region that cannot have the fillets asked for, that with the tightest crotch first."""
    fraction: float
    """Solid fraction of the part."""
    fraction_exact: bool
    """Whether the fraction is exact; else it is estimated at points."""
    hub_radius: list[float]
    """Least and greatest radius of the hubs of these, mm."""
    hubs: float | None
    """Number of hubs, repeats included."""
    inertia: list[list[float]] | None
    """Inertia tensor about the centre of mass for density 1, mm⁵."""
    kinds: int | None
    """Number of hubs that differ in more than position and scale."""
    length: list[float] | None
    """Least and greatest length of these beams from hub to hub, mm; None where there are none, only fillets of others."""
    pieces: int | None
    """Number of connected components of these beams, which are joined at hubs whose ball reaches into the region."""
    porosity: float
    """1 − fraction."""
    repeats: list[int] | None
    """Repeats of its three steps."""
    smallest_angle: float | None
    """Least angle between two beams of a node, degrees."""
    smallest_angle_at: list[float] | None
    """Position of that node, mm."""
    solved_radius: float | None
    """Radius of beams, mm, solved for from the fraction asked for; None where the radius is given."""
    thickness: float
    """Diameter of the thinnest beam in the region, mm."""
    total_length: float | None
    """Sum of these lengths, mm: also of beams that the region cuts, in full."""
    trimmed: TrimmedReport | None
    """What the region trimmed."""
    valence: dict[str, int] | None
    """Number of hubs in the region by their number of beams."""
    volume: float | None
    """Volume with fillets, mm³; None where the region cuts the beams or beams collide."""
    wavelength: float
    """The cell's edge or the mean length of struts, mm."""


class BlendReport(Report):
    """A blend of lattices."""

    _parts = {
        "rbf": "RbfReport",
    }

    by: str
    """fraction or value: what is interpolated."""
    lattices: list[str]
    """Names of its lattices, in the order of their weights."""
    phases: str | None
    """locked, independent or drifting: how the phases of its lattices go together. None for by = value."""
    rbf: list[RbfReport]
    """The radial basis functions among its weights."""
    width: float | None
    """Width of the narrowest transition, mm."""


class CellGrid(Report):
    """The tensor on one of the grids from which a limit was found."""

    fraction: float
    """Mean of the solid fractions of the voxels."""
    shape: list[int]
    """Voxels along each edge of the cell."""
    tensor: list[list[float]]
    """The tensor on this grid."""


class CleanedReport(Report):
    """Nodes and struts left out before beams are made."""

    dangling: int
    """Struts with a free end."""
    duplicates: int
    """Struts that join the same nodes as another."""
    isolated: int
    """Nodes without a strut."""
    merged: int
    """Nodes merged into another at the same position."""
    zero_length: int
    """Struts of zero length."""


class ConductivityReport(Report):
    """Effective conductivity of a periodic cell, in world axes, relative to the solid's."""

    _parts = {
        "grids": "CellGrid",
        "warnings": "WarningReport",
    }

    axis_errors: list[float]
    """Estimated relative errors of k along the axes."""
    bounds: list[float]
    """Hashin's and Shtrikman's bounds of the mean conductivity."""
    edges: list[list[float]]
    """Edges of the cell, mm, one row each."""
    error: float
    """Estimated relative error of k: its distance from k_n over its size (Frobenius's norm). Each eigenvalue of k is
    extrapolated by an order of its own, and changed by half at most."""
    fraction: float
    """Solid fraction of the cell."""
    grids: list[CellGrid]
    """The grids."""
    iterations: int
    """Most iterations of a load case."""
    k: list[list[float]]
    """Conductivity, extrapolated to infinitely many voxels: 3 × 3."""
    k_n: list[list[float]]
    """Conductivity at n voxels."""
    n: int
    """Voxels along the edge of the cell, or of a cube of its volume."""
    order: float
    """Exponent of the voxel's edge with which the error was taken to fall, of the eigenvalue that changes most."""
    pore: float
    """Conductivity of the pore relative to the solid's."""
    residual: float
    """Greatest relative residual of the load cases."""
    wall_voxels: float | None
    """Voxels across the thinnest wall or neck; None if not known."""
    warnings: list[WarningReport]
    """Possible mistakes."""


class Creases(Report):
    """Angles between walls at the faces of tetrahedra, degrees."""

    max: float
    """Maximum, before smoothing by overlap."""
    mean: float
    """Mean along all traces, before smoothing by overlap."""
    smoothed: float | None
    """Maximum after smoothing by overlap, at sampled points of the faces; None without overlap."""


class DanglingReport(Report):
    """Weakly attached fragments."""

    _parts = {
        "largest": "LargestFragment",
    }

    count: int
    """Their number."""
    largest: LargestFragment | None
    """The largest of them."""
    neck: float
    """The neck below which a fragment counts, mm."""
    step: float
    """Distance between sample points, mm."""
    volume: float
    """Their volume in all, mm³."""


class DesignReport(Report):
    """The figures of a design, without meshing it."""

    _parts = {
        "beams": "BeamsReport",
        "blend": "BlendReport",
        "lattices": "LatticeReport",
        "region": "RegionReport",
        "warnings": "WarningReport",
    }
    _by_name = frozenset(["beams", "lattices"])

    beams: dict[str, BeamsReport]
    """The graphs and patterns of beams by name."""
    blend: BlendReport | None
    """The blend of its lattices, where there is one."""
    chord: float | None
    """Chord error of a mesh of whole beams unless another resolution is asked for, mm: a fiftieth of the radius of the
    thinnest. None for what is meshed on a grid."""
    lattices: dict[str, LatticeReport]
    """The lattices by name."""
    region: RegionReport
    """The region."""
    spacing: float
    """Grid spacing of a mesh unless another is asked for, mm: the smallest wavelength / 32, or less for what is finer: 1/24
    of a cell's finest wave (down to a wavelength / 128), half the thinnest wall or neck, a sixth of the thinnest beam,
    the skin (down to a wavelength / 64). More than 20 million triangles are made with a coarser one."""
    warnings: list[WarningReport]
    """Possible mistakes in the design."""


class DihedralReport(Report):
    """Dihedral angles, degrees: 70.53 in a regular tetrahedron."""

    histogram: list[int]
    """Number of angles (six for each tetrahedron) in steps of ten degrees from 0 to 180."""
    max: float
    """Maximum."""
    max_p50: float
    """Median of each tetrahedron's greatest angle."""
    max_p95: float
    """95th percentile of each tetrahedron's greatest angle."""
    min: float
    """Minimum."""
    min_p05: float
    """5th percentile of each tetrahedron's least angle."""
    min_p50: float
    """Median of each tetrahedron's least angle."""


class DistanceReport(Report):
    """Distances from one surface to another, by samples an eighth of a tetrahedron's size apart, mm."""

    at: list[float]
    """Position of the maximum, mm."""
    max: float
    """Maximum."""
    mean: float
    """Mean."""
    p95: float
    """95th percentile."""
    p99: float
    """99th percentile."""


class DistortionReport(Report):
    """Deviation of a solved map's gradients ∇Φᵢ from the wanted ones Kᵢ."""

    _parts = {
        "angle": "MapSpread",
        "anisotropy": "MapSpread",
        "curl": "MapSpread",
        "shear": "MapSpread",
        "spacing": "MapSpread",
    }

    angle: list[MapSpread]
    """Angle between ∇Φᵢ and Kᵢ for each axis, degrees."""
    anisotropy: MapSpread
    """Greatest over least stretch of a cell."""
    curl: MapSpread
    """|curl Kᵢ| λᵢ², what no map can follow."""
    density: list[float]
    """Least and greatest det J over the one asked for; 0 or less where the map folds."""
    outside: float
    """Share of points and axes with a spacing ratio outside 1/1.5 to 1.5."""
    shear: MapSpread
    """Greatest deviation from a right angle between two gradients, degrees."""
    spacing: list[MapSpread]
    """|∇Φᵢ| / |Kᵢ| for each axis: above one, cells are smaller than asked for. p95 and max are of the ratio or its inverse,
    whichever is greater."""
    stretch: list[float]
    """Least and greatest length of a cell over the one asked for, along any direction."""
    turn: float
    """Greatest turn of the wanted orientation within a cell, or twice that within half a cell or less, degrees."""


class DomainReport(Report):
    """A domain of a volume mesh."""

    elements: int
    """Number of tetrahedra."""
    inside: list[float]
    """A point inside: the centroid of its largest tetrahedron, mm."""
    volume: float
    """Volume, mm³; of quadratic tetrahedra that between their corners."""


class EstimateReport(Report):
    """What a surface will take, estimated on a coarse grid."""

    cells: list[int]
    """Grid cells along x, y, z."""
    memory: float
    """Bytes of memory of the mesh."""
    stl: float
    """Bytes of a binary STL."""
    triangles: float
    """Number of triangles."""


class FilletShortfall(Report):
    """A hub with a fillet smaller than asked for. A crotch is where two of its beams meet."""

    asked_radius: float | None
    """Radius asked for, mm; None if τ, α or β was."""
    asked_tau: float | None
    """τ asked for, also by α or β; None if a radius was."""
    crotches: int
    """Number of its crotches."""
    hub: int
    """Number of the hub, as in `Solid.beams` and for `Quadors.hub`."""
    position: list[float]
    """Its centre, mm."""
    radius: list[float] | None
    """Radius of the smallest and of the largest fillet in its crotches, mm; None if no crotch is concave."""
    short: int
    """Number of its crotches with a smaller fillet than asked for."""
    tau: list[float]
    """Least and greatest τ of its crotches; the smallest fillet has the greatest."""


class FitReport(Report):
    """How a tetrahedral mesh fits its region."""

    _parts = {
        "from_part": "DistanceReport",
        "lost": "LostFeatureReport",
        "to_part": "DistanceReport",
    }

    from_part: DistanceReport
    """Distances from the region's surface to the boundary of the mesh."""
    gained: float
    """Volume of tetrahedra outside the region, mm³."""
    lost: list[LostFeatureReport]
    """Features of the region that the mesh does not keep, the deepest first: where its surface is farther than an eighth of
    a tetrahedron's size from the boundary."""
    mended: float
    """Volume left out where the boundary would meet itself, and of fragments, mm³."""
    missed: float
    """Volume of the region outside the tetrahedra, mm³."""
    to_part: DistanceReport
    """Distances from the boundary of the mesh to the region's surface."""
    uncovered: float
    """Share of the region that no tetrahedron covers."""
    uncovered_at: list[float]
    """Position of that point, mm."""
    uncovered_depth: float
    """Greatest depth of such a point below the region's surface, mm."""


class FractionAlong(Report):
    """Solid fraction in windows of two cells, at one share of the second lattice."""

    asked: float | None
    """Fraction asked for; None where it is not known."""
    found: float
    """Fraction found."""
    share: float
    """Share of the second lattice, 0 to 1."""


class Histogram(Report):
    """A histogram."""

    edges: list[float]
    """Ends of the bars, ascending from 0, mm."""
    share: list[float]
    """Share of the volume in each bar."""


class IslandsReport(Report):
    """The connected components of a solid other than the largest."""

    _parts = {
        "largest": "LargestIsland",
    }

    border: int
    """Number of those with surface on the region's boundary: mostly fragments that it cuts off."""
    dropped: int
    """Number of those that were left out."""
    dropped_volume: float
    """The volume of these in all, mm³."""
    filled: int
    """Number of closed voids smaller than a grid cell that were filled."""
    filled_volume: float
    """The volume of these in all, mm³."""
    found: int
    """Their number."""
    largest: LargestIsland | None
    """The largest of them."""
    share: float
    """The largest component's share of all volume, 0 to 1."""
    volume: float
    """Their volume in all, mm³."""


class LargestFragment(Report):
    """The largest weakly attached fragment."""

    place: list[float]
    """A point in it, mm."""
    volume: float
    """Volume, mm³."""


class LargestIsland(Report):
    """The largest connected component but one."""

    bounds: list[list[float]]
    """Lower and upper corner of its bounds, mm."""
    place: list[float]
    """Centre of its bounds, mm."""
    volume: float
    """Volume, mm³."""


class LatticeReport(Report):
    """A lattice: a number, or [least, greatest] over the region where it varies."""

    _parts = {
        "distortion": "DistortionReport",
        "fit": "FitReport",
        "periods": "PeriodReport",
        "property": "PropertyReport",
        "singular": "SingularLineReport",
        "tets": "TilingReport",
    }

    connected_fraction: list[list[float]]
    """Intervals of the fraction in which the periodic solid is one connected component."""
    distortion: DistortionReport | None
    """Deviation of a solved map from the orientation and wavelength asked for."""
    fit: FitReport | None
    """How the tetrahedra of a lattice fit the region."""
    folding: float | None
    """The thickness beyond which a wall of given thickness folds, mm; None for other levels."""
    fraction: float | list[float]
    """Solid fraction of the cell, 0 to 1."""
    iso: float | list[float] | None
    """The level t. Where the thickness is given: the constant level of equal fraction. None for cells by zones."""
    part: str
    """sheet (|f| ≤ t), lower (f ≤ t) or upper (f ≥ t)."""
    periods: list[PeriodReport] | None
    """Cells round the holes of the region, empty where the phases of a solved map have one value. None without a solved map."""
    pore: float | list[float] | None
    """Diameter of the largest ball that passes through the void from cell to cell, mm; of a sheet the lesser of its two
    sides. Zero where the void is closed."""
    pore_sides: list[float | list[float]] | None
    """Of a sheet: the same of the void f < 0 and of the void f > 0, mm."""
    porosity: float | list[float]
    """1 − fraction."""
    property: PropertyReport | None
    """The stiffness or permeability that the level was solved for. None for other levels."""
    singular: list[SingularLineReport] | None
    """Lines round which the axes that a solved map is asked for do not come back to themselves, at least half a wavelength
    long, the longest first. None without a solved map."""
    tets: TilingReport | None
    """The tetrahedral mesh of a lattice over tetrahedra, and the cells in it."""
    thickness: float | list[float] | None
    """Minimum wall (sheet) or narrowest neck diameter (lower, upper), mm; None where there is none."""
    truncation: float | None
    """Root mean square share of a cell from a file that the kept terms leave out."""
    wavelength: float
    """The smallest wavelength, mm."""
    wavelengths: list[float] | None
    """The least and the greatest wavelength over the region, mm, where a solved map is asked for one that varies; of unequal
    edges, the smallest. None elsewhere."""


class LayersMade(Report):
    """Layers of prisms along the surface of a tetrahedral mesh."""

    at: list[float]
    """Where it is, mm."""
    least: float
    """The least of these heights."""
    lower: float
    """Share of that area where they are lower than nine tenths of these."""
    mean: float
    """Mean over their area of their heights in those asked for, where layers do not taper to their end."""
    prisms: int
    """Number of prisms and wedges, each cut into tetrahedra."""


class LayersReport(Report):
    """What a file of layers holds."""

    contours: int
    """Number of contours, holes included."""
    empty: int
    """Layers without a contour."""
    largest: float
    """The largest area of a layer, mm²."""
    layers: int
    """Number of layers."""
    points: int
    """Number of points of all contours."""
    volume: float
    """The sum of area times thickness over the layers, mm³: each area is that of the section in the layer's middle."""


class LooseBodies(Report):
    """Connected components that hold to little or nothing."""

    bodies: int
    """Their number."""
    volume: float
    """Their volume, mm³."""


class LostFeatureReport(Report):
    """A feature of a region that a mesh does not keep."""

    at: list[float]
    """Where it is farthest from the boundary of the mesh, mm."""
    depth: float
    """The greatest distance from the boundary of the mesh, mm."""
    kind: str
    """Filled: hole, slot, recess; left out: wall, pin, block."""
    size: float
    """Its width, mm: of a hole or pin the diameter, of a slot or wall the distance between its faces, else the depth."""


class MapSpread(Report):
    """Mean, 95th percentile and maximum."""

    max: float
    """Maximum."""
    mean: float
    """Mean."""
    p95: float
    """95th percentile."""


class MeshReport(Report):
    """The figures of a triangle mesh. Those that need a region are None for a mesh without one."""

    _parts = {
        "specific_surface": "SpecificSurface",
        "voids": "VoidReport",
    }

    area: float
    """Surface area, mm²."""
    area_cut: float | None
    """Area of cut faces, on the region's boundary, mm²."""
    area_lattice: float | None
    """Area on the lattice, mm²."""
    bounds: list[list[float]]
    """Lower and upper corner of the bounds, mm."""
    cavities: int
    """Number of closed voids."""
    closed: bool
    """Whether every edge has exactly two triangles, of opposite direction."""
    euler: int
    """Euler number V − E + F of the surface mesh, twice that of the solid."""
    hydraulic_diameter: float | None
    """4 · pore volume / area_lattice, mm. Cut faces are not counted as wetted area."""
    pieces: int
    """Number of solids; a cavity is not a piece."""
    porosity: float | None
    """1 − solid_fraction."""
    solid_fraction: float | None
    """Volume of the solid over volume of the region."""
    specific_surface: SpecificSurface
    """Area over volume, 1/mm."""
    voids: list[VoidReport]
    """The closed voids, the largest first."""
    volume: float
    """Enclosed volume, mm³."""


class MinMeanMax(Report):
    """Minimum, mean and maximum."""

    max: float
    """Maximum."""
    mean: float
    """Mean."""
    min: float
    """Minimum."""


class NarrowestNeck(Report):
    """The narrowest place of the widest path across a transition."""

    diameter: float
    """Diameter, mm, to within one step."""
    place: list[float]
    """Position, mm."""


class NetReport(Report):
    """What the net on a part's surface covers."""

    opening: float
    """Diameter of the largest disc on the surface between its rods, mm."""
    opening_at: list[float]
    """Middle of that disc, mm."""
    ports: int
    """Number of ports where it is."""
    untied: int
    """Number of those that no rod reaches."""


class PeriodReport(Report):
    """The whole numbers of cells round a hole of the region."""

    along: list[float]
    """Direction of the line there."""
    asked: list[float]
    """The numbers that least squares ask for."""
    at: list[float]
    """A point in the hole, on the line through it that cells go round, mm."""
    cells: list[int]
    """Whole cells round the line along each axis of the cell; negative against a right-handed screw."""


class PermeabilityReport(Report):
    """Permeability of the pore of a periodic cell to creeping flow, in world axes: mean flux over the whole cell = -k grad p
    / viscosity."""

    _parts = {
        "grids": "CellGrid",
        "warnings": "WarningReport",
    }

    area_per_volume: float
    """Area of the wall of the pore over the volume of the cell, 1/mm."""
    axis_errors: list[float]
    """Estimated relative errors of k along the axes; 0 where nothing flows."""
    conductivity: list[list[float]]
    """Conductivity of the pore, 1 where it is open: 3 x 3."""
    edges: list[list[float]]
    """Edges of the cell, mm, one row each."""
    error: float
    """Estimated relative error of k: its distance from k_n over its size (Frobenius's norm), and what a cell that is not
    whole numbers of steps adds. Each eigenvalue of k is extrapolated by an order of its own, and changed by half at most."""
    fraction: float
    """Solid fraction of the cell."""
    grids: list[CellGrid]
    """The grids, with the share of nodes that are not in the pore and the tensor in mm²."""
    hydraulic_diameter: float | None
    """Hydraulic diameter, 4 volume of the pore / area of its wall, mm; None without a wall."""
    iterations: int
    """Most steps of a force."""
    k: list[list[float]]
    """Permeability, extrapolated to infinitely many nodes: 3 x 3, mm²."""
    k_cell: list[list[float]] | None
    """Permeability in units of the wavelength squared; None unless the cell is a cube."""
    k_n: list[list[float]]
    """Permeability at n nodes, mm²."""
    kozeny: float | None
    """Kozeny's constant porosity³ / (k S²), with the mean k over the axes and the area S of the wall over the volume of the
    cell; None where nothing flows."""
    n: int
    """Nodes along the edge of the cell, or of a cube of its volume."""
    order: float
    """Exponent of the grid's step with which the error was taken to fall, of the eigenvalue that changes most."""
    pore_nodes: float | None
    """Steps of the grid across the hydraulic diameter; None without a wall."""
    porosity: float
    """Volume of the pore over that of the cell."""
    residual: float
    """Greatest change by a step of the iteration, over that of the first."""
    side: str | None
    """Which pore: both sides of a sheet together if None."""
    tortuosity: float | None
    """Tortuosity porosity / conductivity, with the mean conductivity over the axes; None where the pore does not conduct."""
    warnings: list[WarningReport]
    """Possible mistakes."""


class PropertyReport(Report):
    """A property of the cell that a level was solved for."""

    error: float
    """Estimated relative error of that: the change from n voxels to infinitely many; where it varies, the greatest."""
    n: int
    """Voxels along the edge of the cell, or of a cube of its volume."""
    name: str
    """stiffness: Young's modulus of the cell over that of the solid; permeability, mm²."""
    value: float | list[float]
    """What it is at the fraction found, extrapolated to infinitely many voxels; where it varies, what it was interpolated
    for."""


class QualityReport(Report):
    """How well shaped the triangles of a mesh are."""

    largest_aspect: float | None
    """Longest edge over 2√3 times the inscribed circle's radius, 1 at best; None for a triangle without area."""
    smallest_angle: float
    """Smallest angle, degrees; 60 at best."""
    smallest_angle_p05: float
    """Its 5th percentile, degrees."""


class RbfReport(Report):
    """Radial basis functions."""

    condition: float
    """Condition number of their equations."""
    delta: float
    """Width δ of the functions, mm."""
    path: str
    """Path of their key in the design."""
    points: int
    """Number of control points."""


class RegionReport(Report):
    """The region of a design."""

    _parts = {
        "tessellated": "TessellationReport",
    }

    bounds: list[list[float]]
    """Lower and upper corner of its bounds, mm."""
    described_volume: float | None
    """Volume of the region as described, mm³, of a lattice over tetrahedra; else None."""
    tessellated: list[TessellationReport] | None
    """Files of CAD systems that the region is made of, as triangles; None if it is made of none."""
    volume: float
    """Volume of what the lattice fills, mm³: the region's, or of what it has in common with tetrahedra that are no mesh of
    it."""
    volume_exact: bool
    """Whether that is the region's exact volume: not where it is estimated at points, or tetrahedra have only a part of it."""


class RepairReport(Report):
    """What was repaired in a mesh; all zero for a clean one."""

    bodies_turned: int
    """Bodies that were inside out and were turned."""
    crossings: int
    """Pairs of triangles that crossed or covered each other."""
    degenerate: int
    """Triangles without area left out."""
    duplicates: int
    """Triangles given more than once left out."""
    hole_area: float
    """Area of the caps, mm²."""
    hole_length: float
    """Length of the boundary loops of the holes, mm."""
    hole_share: float
    """Area of the caps over that of the surface with them."""
    holes: int
    """Holes capped."""
    inner: int
    """Triangles left out because solid, or none, is on both sides."""
    joined: int
    """Corners of open edges joined with others."""
    split: int
    """Open edges split at corners that lay on them."""
    turned: int
    """Triangles turned to face as their neighbours do."""


class SetReport(Report):
    """A named set of a volume mesh."""

    elements: int
    """Number of elements."""
    faces: int
    """Number of faces."""
    nodes: int
    """Number of nodes."""


class ShellReport(Report):
    """The figures of a mesh of shells."""

    _parts = {
        "sets": "SetReport",
    }
    _by_name = frozenset(["sets"])

    area: float
    """Area of the mid-surface, mm², between the corners of triangles."""
    edge: float
    """Grid spacing, mm: edges are about as long."""
    elements: int
    """Number of triangles."""
    min_angle: float
    """Smallest angle of a triangle between its corners, degrees."""
    nodes: int
    """Number of nodes."""
    order: int
    """1 for linear triangles, 2 for quadratic ones."""
    sets: dict[str, SetReport]
    """The named sets; faces are edges on the border."""
    straight: int
    """Number of edges of quadratic triangles that stayed straight: on the border where it is no bounding plane."""
    thickest: float
    """Greatest thickness at a node, mm."""
    thinnest: float
    """Smallest thickness at a node, mm."""
    volume: float
    """Volume, mm³: the thickness integrated over the area."""


class SimplifyReport(Report):
    """What simplification did."""

    area: float
    """Area after, mm²."""
    area_before: float
    """Area before, mm²."""
    deviation: float
    """Proven bound of the distance between the two surfaces, in both directions, mm."""
    triangles: int
    """Triangles after."""
    triangles_before: int
    """Triangles before."""
    volume: float
    """Volume after, mm³."""
    volume_before: float
    """Volume before, mm³."""


class SingularLineReport(Report):
    """A line round which the wanted axes of a solved map do not come back to themselves: no lattice is without a flaw there,
    and a core covers it if the map has one."""

    core: str | None
    """What covers it, "solid" or "void"; null where nothing does."""
    core_radius: float | None
    """How far that reaches from the line, mm; null where nothing does."""
    length: float
    """Its length within the region, mm, to about a tenth."""
    points: list[list[float]]
    """Points along it from end to end, mm, to a step of the map's grid; the first comes again at the end where it is closed.
    Lines that meet are lines of their own."""
    turn: float
    """By what the axes are turned once round it, degrees."""


class SmoothReport(Report):
    """What smoothing did to the triangles of a mesh. Angles are the smallest of each triangle."""

    flipped: int
    """Number of edges flipped."""
    merged: int
    """Number of edges whose ends were merged."""
    moved: int
    """Number of moves of vertices."""
    smallest_angle: float
    """Smallest angle after, degrees."""
    smallest_angle_before: float
    """Smallest angle before, degrees."""
    smallest_angle_p05: float
    """5th percentile of the smallest angles after, degrees."""
    smallest_angle_p05_before: float
    """5th percentile of the smallest angles before, degrees."""
    triangles: int
    """Triangles after."""
    triangles_before: int
    """Triangles before."""
    volume: float
    """Volume after, mm³."""
    volume_before: float
    """Volume before, mm³."""


class SpecificSurface(Report):
    """Area over volume, 1/mm; None where there is no such volume."""

    area_of_region: float | None
    """All area over the region's volume."""
    area_of_solid: float | None
    """All area over the solid's volume."""
    lattice_of_region: float | None
    """The lattice's area, without cut faces, over the region's volume."""


class StepReport(Report):
    """What a STEP file contains."""

    angle: float | None
    """Greatest angle between the normals of adjacent patches along their common edge, degrees; null for beams."""
    deviation: float
    """Greatest distance of patches from the surface that they stand for, mm, at 49 points of each; 0 for beams, which are
    exact."""
    edges: int
    """Number of edges; of an assembly, of its distinct parts."""
    faces: int
    """Number of faces; of an assembly, of its distinct parts."""
    parts: int | None
    """Number of distinct parts of an assembly, each a hub with its half-beams; null for a file that is none."""
    solids: int
    """Number of solids: connected components, or placed parts of an assembly."""
    vertices: int
    """Number of vertices; of an assembly, of its distinct parts."""
    volume: float
    """Enclosed volume, mm³: of beams to 1e-10, of patches that of the patches."""


class StiffnessReport(Report):
    """Effective stiffness of a periodic cell, in world axes; moduli in the unit of E. Voigt's order 11 22 33 23 13 12,
    engineering shears."""

    _parts = {
        "grids": "CellGrid",
        "warnings": "WarningReport",
    }

    C: list[list[float]]
    """Stiffness, extrapolated to infinitely many voxels: stress = C strain, 6 × 6."""
    C_n: list[list[float]]
    """Stiffness at n voxels."""
    E: list[float] | None
    """Young's moduli along the axes; None where the cell resists some strain not at all."""
    E_error: list[float] | None
    """Estimated relative errors of E."""
    G: list[float] | None
    """Shear moduli of the planes 23, 13, 12."""
    G_error: list[float] | None
    """Estimated relative errors of G."""
    anisotropy: float | None
    """Universal anisotropy 5 G_V / G_R + K_V / K_R - 6; 0 is isotropic."""
    bulk: float | None
    """Bulk modulus: pressure over relative change of volume."""
    bulk_bounds: list[float] | None
    """Hashin's and Shtrikman's bounds of the bulk modulus; None unless the solid is isotropic."""
    edges: list[list[float]]
    """Edges of the cell, mm, one row each."""
    error: float
    """Estimated relative error of C: its distance from C_n over its size (Frobenius's norm). Each eigenvalue of C is
    extrapolated by an order of its own, and changed by half at most; soft ones are less sure than C is as a whole: see
    E_error and G_error."""
    fraction: float
    """Solid fraction of the cell."""
    grids: list[CellGrid]
    """The grids."""
    iterations: int
    """Most iterations of a load case."""
    n: int
    """Voxels along the edge of the cell, or of a cube of its volume."""
    nu: list[float] | None
    """Poisson's ratios 23, 13, 12: contraction along the second axis under tension along the first."""
    order: float
    """Exponent of the voxel's edge with which the error was taken to fall, of the eigenvalue that changes most."""
    residual: float
    """Greatest relative residual of the load cases."""
    shear: float | None
    """Mean of Voigt's and Reuss's shear moduli over all orientations."""
    shear_bounds: list[float] | None
    """Hashin's and Shtrikman's bounds of the shear modulus of an isotropic cell; None unless the solid is isotropic."""
    wall_voxels: float | None
    """Voxels across the thinnest wall or neck; None if not known."""
    warnings: list[WarningReport]
    """Possible mistakes."""
    zener: float | None
    """Zener's ratio 2 C44 / (C11 - C12) of means over the axes; 1 is isotropic."""


class SurfaceReport(Report):
    """The figures of a surface that was made, streamed or held in memory."""

    _parts = {
        "islands": "IslandsReport",
    }

    area: float
    """Surface area, mm²."""
    area_cut: float | None
    """Area of cut faces, on the region's boundary, mm²."""
    area_lattice: float | None
    """Area on the lattice, mm²."""
    cavities: int
    """Number of closed voids."""
    chord_error: float | None
    """Greatest distance between a mesh without a grid and the surface, to first order, mm."""
    euler: int
    """Euler number V − E + F."""
    islands: IslandsReport | None
    """The connected components other than the largest; None where they are not looked for."""
    pieces: int
    """Number of solids."""
    triangles: int
    """Number of triangles."""
    volume: float
    """Enclosed volume, mm³."""


class TessellationReport(Report):
    """A file of a CAD system as triangles."""

    angle: float
    """Greatest angle between the normals of a face within a triangle, degrees."""
    chord: float
    """Greatest distance between faces and triangles that was asked for, mm."""
    faces: int
    """Number of faces."""
    path: str
    """The file."""
    triangles: int
    """Number of triangles."""
    volume: float | None
    """Volume within the exact faces, mm³; None where the file holds faces alone, which were sewn."""
    volume_error: float | None
    """Relative error of the triangles' volume: of first order in the chord error on curved faces."""


class TetMeshReport(Report):
    """The figures of a tetrahedral mesh."""

    _parts = {
        "fit": "FitReport",
        "layers": "LayersMade",
        "quality": "TetQualityReport",
        "warnings": "WarningReport",
    }

    fit: FitReport | None
    """How it fits its region; None without one, and within the report of a lattice, which has it itself."""
    layers: LayersMade | None
    """Its layers of prisms, if any."""
    mesher: str
    """What made it: background, ftetwild, or the file's name."""
    quality: TetQualityReport
    """Shapes and sizes."""
    region_volume: float | None
    """Volume of its region as described, mm³; None without one."""
    warnings: list[WarningReport] | None
    """Possible mistakes; None within the report of a design, which has them itself."""


class TetQualityReport(Report):
    """Shapes and sizes of a mesh's tetrahedra."""

    _parts = {
        "aspect": "MinMeanMax",
        "dihedral": "DihedralReport",
        "edge": "MinMeanMax",
        "size": "MinMeanMax",
    }

    aspect: MinMeanMax
    """Longest edge over √24 times the radius of the inscribed ball; 1 for a regular tetrahedron."""
    boundary_triangles: int
    """Number of triangles of the boundary."""
    bounds: list[list[float]]
    """Lower and upper corner of the bounds, mm."""
    dihedral: DihedralReport
    """Dihedral angles, degrees."""
    edge: MinMeanMax
    """Lengths of edges, mm, each counted once for each tetrahedron that has it."""
    inverted: int
    """Number of tetrahedra of negative volume."""
    nodes: int
    """Number of nodes."""
    pieces: int
    """Number of components connected by faces."""
    size: MinMeanMax
    """Sizes, mm: the edge of a regular tetrahedron of the same volume."""
    slivers: int
    """Number of tetrahedra with a dihedral angle below 10° or above 170°."""
    tets: int
    """Number of tetrahedra."""
    volume: float
    """Volume, mm³."""


class ThicknessReport(Report):
    """Local thickness: at each point the diameter of the largest ball that fits in and covers the point."""

    _parts = {
        "pore_size": "ThicknessSpread",
        "wall_thickness": "ThicknessSpread",
    }

    pore_size: ThicknessSpread | None
    """Of the pores, mm; None without a region."""
    wall_thickness: ThicknessSpread
    """Of the solid, mm."""


class ThicknessSpread(Report):
    """The distribution of local thickness over a volume."""

    _parts = {
        "histogram": "Histogram",
    }

    accuracy: float
    """Accuracy of these figures, mm."""
    histogram: Histogram
    """Shares of the volume by thickness."""
    max: float
    """Maximum, mm."""
    mean: float
    """Mean, mm."""
    min: float
    """Minimum between opposite sides, mm; sharp edges, where local thickness ends at 0, are left out."""
    p05: float
    """5th percentile, mm."""
    sd: float
    """Standard deviation, mm."""
    step: float
    """Edge of a voxel, mm."""


class TilingReport(Report):
    """A lattice over a tetrahedral mesh."""

    _parts = {
        "creases": "Creases",
        "joins": "ZoneJoin",
        "mesh": "TetMeshReport",
        "net": "NetReport",
        "thickness": "WallSpread",
        "zones": "ZoneReport",
    }
    _by_name = frozenset(["zones"])

    count: int
    """Number of tetrahedra."""
    creases: Creases | None
    """Angles between walls at faces of tetrahedra; None where there are none."""
    edge: float
    """Mean length of edges, mm."""
    end_radius: float | list[float] | None
    """Radius of the net's rods, or of rounded ends, mm; None with flat ends."""
    face_fraction: float | list[float] | None
    """Share of a tetrahedron's face that is solid; None for zones."""
    finished_fraction: float | None
    """Solid fraction of the finished part, with net, rounding and tetrahedra that are bent onto the surface; None where it
    is `solid_fraction`."""
    joins: list[ZoneJoin] | None
    """Which zones join, where zones have cells of their own."""
    mesh: TetMeshReport
    """The mesh."""
    method: str
    """How its surface is made: explicit, in each tetrahedron apart, or implicit, on a grid over the part."""
    method_reason: str | None
    """Why it is made on a grid, with the place if it is for one; None where it is not."""
    net: NetReport | None
    """What the net covers; None without one."""
    overlap: float
    """Overlap of tetrahedra, 0 to 0.2 of their size."""
    pieces: int | None
    """Number of connected components, predicted from values at small steps; None with a skin or kept zones, and where more
    than 20 000 tetrahedra differ (4 000 with an overlap): the mesh tells it then."""
    ports: int | None
    """Number of ports on each face of a tetrahedron; None for zones."""
    solid_fraction: float
    """Solid fraction of the lattice in its flat tetrahedra, without net or rounding."""
    surface: str
    """How the lattice ends at the part's surface: capped, open, net or rounded."""
    thickness: WallSpread | None
    """Thickness of the walls, mm; None for networks and for zones."""
    volume: float
    """Volume of its flat tetrahedra with their nodes on the surface, mm³; where `trabecula tets` writes them they balance
    about it."""
    zones: dict[str, ZoneReport] | None
    """The zones by the number or the name in the design, where zones have cells of their own."""


class TransitionReport(Report):
    """The transition between two lattices of a blend: the lattices alone, without skin and keep zones."""

    _parts = {
        "dangling": "LooseBodies",
        "fractions": "FractionAlong",
        "loose": "LooseBodies",
        "neck": "NarrowestNeck",
    }

    between: list[str]
    """Names of the two lattices."""
    dangling: LooseBodies
    """Components attached by necks under half the narrowest neck of the widest path across."""
    fractions: list[FractionAlong]
    """Solid fraction along the transition, by tenths of the second lattice's share."""
    gap: list[float] | None
    """Where the first lattice's solid ends if no path leads to the second's, mm; None where one does, or the grid cannot
    tell."""
    loose: LooseBodies
    """Components that touch neither side."""
    neck: NarrowestNeck | None
    """The narrowest neck of the widest path from one lattice to the other; None where they are not connected."""
    pieces: int
    """Connected components of the solid that reach into it; 1 where it holds together."""
    resolved: bool
    """Whether the thinnest wall, neck or beam of the lattices is two steps thick: else it may seem broken, and components
    more."""
    step: float
    """Distance between sample points, mm."""
    volume: float
    """Volume in which both have a weight, mm³."""


class TrimmedReport(Report):
    """Struts that leave the region."""

    dropped: int
    """Struts left out."""
    outside: int
    """Struts without a part in the region."""
    snapped: int
    """Struts shortened to the surface."""


class VoidReport(Report):
    """A closed void, from which powder and resin cannot drain."""

    bounds: list[list[float]]
    """Lower and upper corner of the bounds, mm."""
    point: list[float]
    """A point inside, mm."""
    volume: float
    """Volume, mm³."""


class VolumeReport(Report):
    """The figures of a volume mesh."""

    _parts = {
        "domains": "DomainReport",
        "sets": "SetReport",
    }
    _by_name = frozenset(["domains", "sets"])

    deviation: float
    """Greatest distance of boundary faces from the surface, mm, at their corners, edges and centroids; faces on flat cuts
    have none."""
    domains: dict[str, DomainReport]
    """The domains by name."""
    dropped: float
    """Volume left out, mm³: small loose components, flat tetrahedra, and those where the boundary would touch itself."""
    edge: list[float]
    """Edges of the background's cubes along x, y, z, mm: the longest edges of most tetrahedra."""
    elements: int
    """Number of tetrahedra."""
    loose: float
    """Volume of the components other than the largest that were left out on request, mm³."""
    max_angle: float
    """Greatest dihedral angle, degrees."""
    max_angle_p50: float
    """Median of each tetrahedron's greatest dihedral angle, degrees."""
    max_angle_p99: float
    """99th percentile of each tetrahedron's greatest dihedral angle, degrees."""
    min_angle: float
    """Smallest dihedral angle, degrees; of quadratic tetrahedra between the planes of their corners."""
    min_angle_p01: float
    """1st percentile of each tetrahedron's smallest dihedral angle, degrees."""
    min_angle_p50: float
    """Median of each tetrahedron's smallest dihedral angle, degrees."""
    nodes: int
    """Number of nodes."""
    order: int
    """1 for linear tetrahedra, 2 for quadratic ones."""
    pairs: int
    """Number of nodes on upper bounding planes that are tied to their periodic images."""
    pieces: int
    """Number of components connected by faces."""
    sets: dict[str, SetReport]
    """The named sets."""
    straight: int
    """Number of edges of quadratic tetrahedra that stayed straight, because a tetrahedron would be distorted."""
    volume: float
    """Volume, mm³."""
    worst_angle_at: list[float]
    """The middle of the tetrahedron with the angle nearest to 0 or 180, mm."""


class VoxelElementsReport(Report):
    """The figures of voxels as finite elements."""

    _parts = {
        "sets": "SetReport",
    }
    _by_name = frozenset(["sets"])

    dropped: float
    """Solid volume left out, mm³: voxels of a smaller fraction, and pieces other than the largest."""
    elements: int
    """Number of hexahedra."""
    least: float
    """Smallest solid fraction of a hexahedron."""
    nodes: int
    """Number of nodes."""
    sets: dict[str, SetReport]
    """The named sets."""
    step: list[float]
    """Edges of a hexahedron along x, y, z, mm."""
    volume: float
    """Solid volume, mm³: of each hexahedron its solid share."""


class WallSpread(Report):
    """Wall thickness over a tetrahedral mesh, along normals of the mid-surface and weighted by its area, mm."""

    high: float
    """95th percentile."""
    low: float
    """5th percentile."""
    max: float
    """Maximum of some thousand."""
    mean: float
    """Mean: volume of walls over area of their mid-surface."""
    merged: float
    """Share of the mid-surface from which a wall runs into the next one before it ends."""
    min: float
    """Minimum of some thousand."""
    through: float
    """Mean length of the solid along normals, to where it ends: more than the mean wall where walls run into each other."""


class WarningReport(Report):
    """Something in a design that is allowed but may be a mistake."""

    message: str
    """The possible mistake, with the numbers."""
    path: str
    """Path of the key in the design."""


class ZoneJoin(Report):
    """Two zones with faces in common."""

    faces: int
    """Number of faces between them."""
    joined: bool
    """Whether the largest components of both are connected."""
    open: int
    """Number of those that solid passes through."""
    ports: float
    """Share of a face that is solid in both cells."""
    zones: list[int]
    """Numbers of the zones."""


class ZoneReport(Report):
    """A zone of a tetrahedral mesh."""

    cell: str
    """Name of its cell."""
    count: int
    """Number of tetrahedra."""
    finished_fraction: float | None
    """Solid fraction of the finished part in the zone, skin and keep zones included, by samples; None where it is
    `solid_fraction`, and for a zone too small to be sampled."""
    numbers: list[int]
    """Numbers of its tetrahedra in the mesh: several, where elements of a group are of other groups too."""
    solid_fraction: float
    """Solid fraction of the lattice in the zone's flat tetrahedra, without net or rounding."""
    volume: float
    """Volume, mm³."""
