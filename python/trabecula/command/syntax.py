"""The commands: lines of help, and options."""

from __future__ import annotations

import argparse

from ..base.formats import (
    BEAM_WRITES,
    CAD_READS,
    CONDUCTIVITY_WRITES,
    DESIGNS,
    LAW_WRITES,
    LAYER_WRITES,
    MESH_WRITES,
    PART_READS,
    PERMEABILITY_WRITES,
    STEP_PROTOCOLS,
    STEP_WRITES,
    STIFFNESS_READS,
    STIFFNESS_WRITES,
    SWEEP_WRITES,
    TET_READS,
    TET_WRITES,
    VOLUME_WRITES,
    VOXEL_WRITES,
    dotted,
)
from ..base.islands import ISLANDS
from ..pictures.camera import BACKGROUNDS, PROJECTIONS, VIEWS
from ..pictures.shown import SHOWN
from .arguments import (
    ANGLE,
    COUNT,
    DPI,
    ELEVATION,
    FRACTION,
    FRAMES,
    LENGTH,
    MODULUS,
    NUMBER,
    POINTS,
    POISSON,
    PROPERTIES,
    SAMPLES,
    SECONDS,
    SHARE,
    VOXELS,
    Ending,
    cluster,
    direction,
    exposure,
    front,
    load,
    names,
    number,
    parts,
    pixels,
    properties,
    size,
)
from .completion import SHELLS
from .options import (
    APART,
    DESIGN,
    DESIGN_OR_MESH,
    JSON,
    LIGHTER,
    MEASURED,
    NOTICES,
    PLAIN,
    PROGRESS,
    SERVED,
    THREADS,
    TRANSITIONS,
    WRITTEN,
    command,
    file,
    of_cell,
    option,
    output,
    shards,
    spacing,
)

__all__ = ["COMMANDS"]

#: Units of lengths in files.
UNITS = ("mm", "micron", "cm", "m", "inch", "foot")

#: For each command: one line, examples and more, options; of a list of options one at most may be given.
COMMANDS = {
    "new": command(
        "Write a commented design to start from.",
        "examples:\n  trabecula new first.toml --cell diamond\n"
        "  trabecula new stem.toml --part stem.stl --beams octet --skin 0.8",
        file("file", ("toml",), "the design file to write (.toml)"),
        [
            option("--cell", default="gyroid", metavar="NAME", help="a named cell; see `trabecula cells`"),
            option("--beams", metavar="NAME", help="a unit cell of beams; see `trabecula cells --beams`"),
        ],
        file("--part", PART_READS, "the part to fill, a closed mesh or a STEP file; without it a box", "PART"),
        option("--skin", type=LENGTH, metavar="MM", help="a skin of this thickness, mm"),
        option("--schema", action="store_true", help="also write design-schema.json, by which editors complete and check keys"),
        option("--force", action="store_true", help="replace the file if it exists"),
    ),
    "check": command(
        "Build a design and print its level, fraction, wall thickness and warnings, without meshing.",
        "example:\n  trabecula check part.toml --json",
        *(DESIGN, JSON, TRANSITIONS, *NOTICES),
    ),
    "mesh": command(
        "Mesh a design: closed, oriented, free of self-intersection.",
        f"The name of OUT decides the format: {WRITTEN}; or .step, for CAD systems, the exact surface\n"
        "of uncut beams alone, or smooth patches on lattices in a box, within --tolerance (default: a thousandth of the\n"
        "wavelength). With --beams it has the beams themselves: .3mf with the beam lattice extension, or a graph:\n"
        ".ltcx, .csv, .json, .obj, .vtu, .inp (Abaqus B31), .bdf (Nastran CBAR).\n"
        "A mesh is written while it is made, in bounded memory, unless the design has a skin, whose\n"
        "closed voids are looked for.\n"
        "With --tolerance or --triangles the mesh is held in memory and simplified, whatever the format. With\n"
        "--smooth it is held in memory too, and the smallest angle of 19 in 20 triangles is then 15 degrees or more; all\n"
        "guarantees, sharp edges, flat faces and the volume are kept. --open leaves out the faces on the region's boundary:\n"
        "the lattice's own surface, for shells; not a solid, and not to be printed.\n\n"
        "examples:\n  trabecula mesh part.toml -o part.3mf --edge 0.25\n"
        "  trabecula mesh part.toml -o part.stl --per-cell 48 --threads 4\n"
        "  trabecula mesh part.toml -o part.stl --edge 0.1 --tolerance 0.01\n"
        "  trabecula mesh part.toml -o part.stl --smooth\n"
        "  trabecula mesh exchanger.toml -o exchanger.3mf --parts wall,lower,upper\n"
        "  trabecula mesh beams.toml -o beams.stl --chord 0.01\n"
        "  trabecula mesh beams.toml -o beams.step\n"
        "  trabecula mesh beams.toml -o beams.3mf --beams\n"
        "  trabecula mesh beams.toml -o beams.inp --beams",
        *(DESIGN, output(tuple(dict.fromkeys((*MESH_WRITES, *STEP_WRITES, *BEAM_WRITES))), "the file to write")),
        spacing(
            "--edge",
            option(
                "--chord",
                type=LENGTH,
                metavar="MM",
                help="mesh uncut beams without a grid, triangles within this distance of the surface, mm (default without a "
                "spacing: a fiftieth of the thinnest beam's radius)",
            ),
        ),
        *(THREADS, PROGRESS),
        *APART,
        shards("without .stl", ", and of any number of triangles"),
        option(
            "--islands",
            choices=ISLANDS,
            default="drop-small",
            help="connected components other than the largest: drop those at the region's boundary with less volume than "
            "eight grid cells and a thousandth of the largest one, and warn of the others (default), keep all with a "
            "warning, drop all, or refuse; --parts keep all",
        ),
        *LIGHTER,
        option(
            "--smooth",
            action="store_true",
            help="better triangles: slivers merged, edges flipped, vertices moved in the surface",
        ),
        option(
            "--parts",
            type=parts,
            metavar="NAMES",
            help="several solids of a sheet, by commas: wall (what the design makes), lower, upper (what is left of the region "
            "on each side); objects of one .3mf, else files OUT-wall.stl …",
        ),
        option("--open", action="store_true", help="write the lattice's own surface alone, open at the region's boundary"),
        option(
            "--beams",
            action="store_true",
            help="write the beams themselves, not their surface; in a .3mf as frusta within --chord of them, clipped by the "
            "region",
        ),
        option(
            "--implicit",
            action="store_true",
            help="write the part as a function of position: .3mf with the volumetric and implicit extensions, which are drafts",
        ),
        option("--no-mesh", action="store_true", help="with --beams, no coarse mesh for programs that cannot show beams"),
        option("--protocol", choices=STEP_PROTOCOLS, help="of a .step, the application protocol (default: ap214)"),
        option(
            "--assembly",
            action=argparse.BooleanOptionalAction,
            help="of a .step of beams, a part for each distinct hub, placed wherever it is (default: for more than 2,000 hubs, "
            "of which at most half differ)",
        ),
        *(JSON, *NOTICES),
    ),
    "simplify": command(
        "Make a mesh file lighter: fewer triangles, every guarantee and sharp edges kept; the change of volume is printed.",
        "The distance between the two surfaces is at most the tolerance; with --triangles it is printed.\n"
        "The mesh must be closed and free of self-intersection.\n\n"
        "examples:\n  trabecula simplify part.stl -o light.stl --tolerance 0.02\n"
        "  trabecula simplify part.3mf -o light.3mf --triangles 200000",
        file("file", PART_READS, "a mesh file, mm"),
        *(output(MESH_WRITES, "the mesh to write"), *LIGHTER, PROGRESS, JSON),
    ),
    "volume": command(
        "Mesh the inside of a design: tetrahedra with named sets, for finite elements and flow.",
        "The name of OUT decides the format: .inp (Abaqus, CalculiX), .msh (Gmsh 4.1), .msh2 (Gmsh 2.2), .vtu (ParaView),\n"
        ".xdmf (with .h5), .bdf (Nastran), .mesh (Medit), or .foam: OpenFOAM's mesh, in m, in the folder constant/polyMesh of\n"
        "the file's own.\n"
        "Tetrahedra conform to all surfaces, edges and corners. Sets: X0 X1 Y0 Y1 Z0 Z1 (bounding planes), CUT (the region's\n"
        "boundary), LATTICE (the lattice's own surface), SKIN, KEEP_NAME, and NAME of each [set.NAME.REGION] in the design.\n"
        ".inp has the nodes, elements and faces of each set, .msh its faces, .msh2, .mesh and .foam those of its faces that\n"
        "are in no smaller set, .vtu and .bdf its nodes, .xdmf its nodes and elements.\n"
        "The .inp of a --periodic cell has equations and six steps, that of --hold and --load a step: they run as they are.\n"
        "--voxels makes hexahedra with their solid fractions (.inp, .msh, .msh2, .vtu, .xdmf), --of beams line elements of\n"
        "beams alone (.inp, .bdf, .vtu); of their sections CalculiX takes diameters and Abaqus radii (--solver).\n\n"
        "examples:\n  trabecula volume part.toml -o part.inp --wall 3 --order 2\n"
        "  trabecula volume part.toml -o part.inp --edge 0.5 --order 2 --E 114000 --nu 0.34 --hold X0 --load X1=0,-1000,0\n"
        "  trabecula volume part.toml -o voxels.inp --voxels 0.2\n"
        "  trabecula volume part.toml -o shell.inp --of shell --per-cell 24 --order 2\n"
        "  trabecula volume frame.toml -o frame.inp --of beams --E 114000 --nu 0.34 --hold Z0 --load Z1=0,0,-100\n"
        "  trabecula volume exchanger.toml -o fluids.msh --of all\n"
        "  trabecula volume foam.toml -o carrier.vtu --of carrier --fields stiffness\n"
        "  trabecula volume cell.toml -o rve.inp --periodic --per-cell 32 --E 114000 --nu 0.34",
        *(DESIGN, output(VOLUME_WRITES, f"the mesh to write ({dotted(VOLUME_WRITES)})")),
        [
            option("--edge", type=LENGTH, metavar="MM", help="longest edge of most tetrahedra, longest element of beams, mm"),
            option("--per-cell", type=SAMPLES, metavar="N", help="edges along the smallest wavelength"),
            option("--wall", type=SAMPLES, metavar="N", help="number of edges across the thinnest wall (default: 2)"),
            option("--voxels", type=LENGTH, metavar="MM", help="hexahedra of a grid instead, with their exact solid fractions"),
        ],
        option("--order", type=int, choices=(1, 2), help="linear or quadratic elements (default: 1, of beams 2, but in .bdf)"),
        option(
            "--of",
            choices=("solid", "pore", "lower", "upper", "all", "shell", "beams", "carrier"),
            default="solid",
            help="solid (default), pore, the space on one side of a sheet, or all of them with common nodes; "
            "shell: triangles on the mid-surface of a sheet with its thickness at nodes (.inp, .bdf, .vtu); beams: line "
            "elements along their axes with sections (.inp, .bdf, .vtu); or carrier: the "
            "tetrahedra of a lattice over tetrahedra, each a material by its solid fraction",
        ),
        option(
            "--islands",
            choices=("keep", "drop", "error"),
            default="keep",
            help="components other than the largest, which no support on that one holds: keep (default), with a warning if "
            "it is the solid, drop, or refuse",
        ),
        option("--periodic", action="store_true", help="match opposite faces of a box of whole cells bit for bit"),
        option("--least", type=NUMBER, metavar="F", help="least solid fraction of a voxel that is an element (default: 0.01)"),
        option("--sets", type=names, metavar="NAMES", help="sets that must not be empty, by commas"),
        option(
            "--fields",
            type=names,
            metavar="NAMES",
            help="what the design says at nodes, by commas, in .vtu, .xdmf and .msh: fraction, share (of each lattice), "
            "orientation (unit vectors along the cell's axes), wavelength; and of a carrier's elements stiffness",
        ),
        option("--solver", choices=("calculix", "abaqus"), help="whose .inp of --of beams it is: calculix (default) or abaqus"),
        option("--oriented", action="store_true", help="of a carrier's .inp: cubic materials along each element's axes"),
        option("--hold", type=names, metavar="NAMES", help="sets whose nodes do not move, by commas, in .inp"),
        option(
            "--load",
            type=load,
            action="append",
            metavar="NAME=LOAD",
            help="a load on a set, in .inp: FX,FY,FZ a uniform traction with this resultant, N; one number a pressure against "
            "its faces, MPa; may be repeated",
        ),
        option("--E", type=MODULUS, default=1.0, metavar="E", help="Young's modulus of the solid in the file (default: 1)"),
        option("--nu", type=POISSON, default=0.3, metavar="NU", help="Poisson's ratio of the solid in the file (default: 0.3)"),
        *(THREADS, PROGRESS, JSON, *NOTICES),
    ),
    "voxels": command(
        "Write the solid as cubic voxels.",
        "The name of OUT decides the format: .npy (indexed [x, y, z], 1 is solid) or .vti (for ParaView).\n\n"
        "example:\n  trabecula voxels part.toml -o part.vti --step 0.2",
        *(DESIGN, output(VOXEL_WRITES, "the voxels to write"), spacing("--step")),
        *APART,
        shards("without its ending", "; of .vti also all.pvti, by which ParaView opens them as one"),
        *(THREADS, PROGRESS, JSON, *NOTICES),
    ),
    "tets": command(
        "Make or check the tetrahedral mesh that carries a lattice; print its quality; write it.",
        "FILE is a design with [lattice.NAME.map.tets], of which only the region and that table are read, or a file of\n"
        "tetrahedra: vtu, vtk, or with the extra fe (pip install 'trabecula[fe]') msh, inp, med, mesh and others.\n\n"
        "examples:\n  trabecula tets part.toml --json\n  trabecula tets part.toml -o part.vtu\n"
        "  trabecula tets bracket.inp --unit m -o bracket.vtu",
        file("file", (*DESIGNS, *TET_READS), "a design or a file of tetrahedra"),
        output(TET_WRITES, f"the mesh to write ({dotted(TET_WRITES)})", False),
        option("--lattice", metavar="NAME", help="the lattice whose mesh is made (default: the first that has one)"),
        option("--unit", choices=UNITS, help="unit of a file's coordinates (default: mm)"),
        option("--split", action="store_true", help="split a file's hexahedra, wedges and pyramids into tetrahedra"),
        *(THREADS, JSON),
    ),
    "sweep": command(
        "Build and measure many designs of one: a table with a row for each.",
        "The design has a table [sweep] of keys that vary, each with a list of values or a range, as in\n"
        "  [sweep]\n"
        '  "lattice.core.level.fraction" = [0.2, 0.3, 0.4]\n'
        '  "lattice.core.map.affine.wavelength" = { from = 3, to = 6, count = 4 }\n'
        "Rows stand in OUT.rows as they are made. Stopped and started again, it goes on where it was.\n"
        "A design that cannot be made is a row with its error.\n\n"
        "examples:\n  trabecula sweep study.toml -o study.csv --jobs 4 --per-cell 24\n"
        "  trabecula sweep study.toml -o study.parquet --meshes parts/{design}.3mf\n"
        "  trabecula sweep study.csv --plot solid_fraction area_mm2 wall_mm -o study.svg --front min,max",
        file(
            "study",
            (*DESIGNS, *SWEEP_WRITES),
            "a design with [sweep] (.toml or .json), or - for standard input; or a table (.csv or .parquet) to plot",
            "STUDY",
            True,
        ),
        file(
            "-o --output",
            (*SWEEP_WRITES, "svg"),
            "the table to write (.csv or .parquet); of --plot also the drawing (.svg)",
            "OUT",
            required=True,
        ),
        spacing(),
        option(
            "--jobs",
            type=COUNT,
            metavar="N",
            help="processes (default: one a processor); any number gives the same table",
        ),
        option(
            "--cluster",
            type=cluster,
            metavar="ADDRESS",
            help="a Dask cluster at this address, local:N processes, or slurm:N jobs; needs the extra scale",
        ),
        option(
            "--properties",
            type=properties,
            metavar="NAMES",
            help=f"what else is computed of each design, by commas: {', '.join(PROPERTIES)}",
        ),
        option("--n", type=VOXELS, metavar="N", help="voxels along a cell for these properties"),
        option("--meshes", type=Ending(MESH_WRITES), metavar="NAMES", help="write the meshes, such as parts/{design}.3mf"),
        option("--pictures", type=Ending(("png",)), metavar="NAMES", help="write pictures, such as pictures/{design}.png"),
        option("--plot", nargs="+", metavar=("X", "Y"), help="draw column Y against X, a third as colour, to OUT with .svg"),
        option(
            "--front", type=front, metavar="BETTER", help="with the Pareto front: min or max of X and of Y, such as min,max"
        ),
        option(
            "--new",
            action="store_true",
            help="begin anew: rows of an earlier run are not taken up, and its table is overwritten",
        ),
        option("--yes", action="store_true", help="make more than a million designs"),
        *(PROGRESS, JSON, NOTICES[0]),
    ),
    "slice": command(
        "Slice a design into layers for a machine, from its field and without a mesh; or at one height.",
        "The name of OUT decides the format: .cli (--binary or text), .svg, .3mf (slices), or pictures of a --pixel in .zip\n"
        "(PNG), .sl1 (resin printers), .tif or .npy. Contours are within the tolerance of the section in the middle of each\n"
        "layer and have its area; grey is the exact area fraction of a pixel. Layers are written while they are made.\n"
        "With --z a design that is beams alone is cut in exact conic arcs (also with --beams, uncut by region and skin).\n\n"
        "examples:\n  trabecula slice part.toml -o part.cli --layer 0.05 --binary\n"
        "  trabecula slice part.toml -o part.3mf --layer 0.05 --tolerance 0.002\n"
        "  trabecula slice part.toml -o part.zip --layer 0.05 --pixel 0.05\n"
        "  trabecula slice part.toml -o part.sl1 --layer 0.05 --pixel 0.047 --size 2560x1440\n"
        "  trabecula slice part.toml --z 5 -o section.svg\n  trabecula slice beams.toml --z 5 -o arcs.svg --chord 0.005",
        DESIGN,
        [
            option("--layer", type=LENGTH, metavar="MM", help="thickness of a layer, mm"),
            option("--z", type=number("a height in mm"), metavar="MM", help="one section at this height, mm"),
        ],
        output(LAYER_WRITES, f"the file to write ({dotted(LAYER_WRITES)}; with --z .svg)", False),
        option("--tolerance", type=LENGTH, default=0.001, metavar="MM", help="distance of contours from the section (0.001)"),
        option("--from", type=number("a height in mm"), dest="start", metavar="MM", help="where the first layer begins, mm"),
        option("--to", type=number("a height in mm"), dest="stop", metavar="MM", help="where the last layer ends, mm"),
        option("--step", type=LENGTH, metavar="MM", help="edge of the cells in which the section is looked for, mm"),
        option("--adaptive", type=LENGTH, metavar="MM", help="thinner layers by slope: greatest height of steps, mm"),
        option("--least", type=LENGTH, metavar="MM", help="thinnest adaptive layer, mm (default: a quarter of --layer)"),
        option("--binary", action="store_true", help="write .cli as bytes"),
        option("--each", action="store_true", help="an .svg for each layer, in the new folder OUT without .svg"),
        option("--pixel", type=LENGTH, metavar="MM", help="edge of a pixel of pictures, mm"),
        option("--size", type=pixels, metavar="WxH", help="pixels of pictures, the part in the middle (default: the part)"),
        option("--exposure", type=exposure, metavar="S,S", help="of layers and first ones of .sl1, s (default: 8,35)"),
        *APART,
        option("--beams", metavar="NAME", help="the beams to cut in arcs, of several"),
        option("--chord", type=LENGTH, metavar="MM", help="chord error of drawn arcs, mm (default: 0.01)"),
        *(THREADS, PROGRESS, JSON, *NOTICES),
    ),
    "measure": command(
        "Measure a design or a mesh file: volume, areas, solid fraction, Euler number, pieces, closedness, quality.",
        "A design is measured while it is meshed, tile by tile; with --region or --thickness it is held in memory.\n"
        "A mesh file has a solid fraction and pores only against a region.\n"
        "For a design with a blend the transitions are printed too: pieces, loose and weakly attached components, necks.\n"
        "Of a file of tetrahedra: elements, volume, dihedral angles; of domains and sets the nodes, elements and faces in it.\n"
        "Local thickness is the diameter of the largest ball that fits in and covers a point (Hildebrand, Rueegsegger).\n\n"
        "examples:\n  trabecula measure part.toml --edge 0.25 --json\n"
        "  trabecula measure part.stl --region part.toml\n  trabecula measure part.stl --region hull.stl --json\n"
        "  trabecula measure part.toml --thickness --step 0.05 --histogram part.svg",
        MEASURED,
        file(
            "--region",
            (*DESIGNS, *PART_READS),
            "region of the solid fraction: a design, a file with a [region] alone, or a closed mesh in mm",
            "R",
        ),
        option("--solid", metavar="NAME", help="one object of a 3MF, or one solid of a file from a CAD system"),
        *(spacing(), THREADS, PROGRESS),
        *APART,
        option("--thickness", action="store_true", help="also distributions of wall thickness and pore size"),
        option(
            "--step",
            type=LENGTH,
            metavar="MM",
            help="voxel edge for the thickness, mm (default: an eighth of the mean wall)",
        ),
        file("--histogram", ("svg",), "draw the distributions (with --thickness)", "OUT.svg"),
        option(
            "--dangling",
            action="store_true",
            help="also weakly attached fragments of a design: necks under half the lattice's narrowest",
        ),
        *(TRANSITIONS, JSON, *NOTICES),
    ),
    "faces": command(
        "List the faces of a STEP or IGES file: by these names a design opens its skin, keeps places solid and holds sets.",
        "A face goes by its name, its colour or its number; faces of one name go together.\n"
        "Needs pip install 'trabecula[cad]'.\n\n"
        "examples:\n  trabecula faces part.step\n  trabecula faces assembly.step --solid bracket --json",
        file("file", CAD_READS, "a file from a CAD system (.step, .stp, .iges, .igs)"),
        option("--solid", metavar="NAME", help="of this solid alone"),
        JSON,
    ),
    "cells": command(
        "List the named cells: formula, space group, range, fractions in one piece, source.",
        "In a formula s = sin 2πx and c = cos 2πx; s2x = sin 4πx. x, y, z are phases in turns.\n\n"
        "examples:\n  trabecula cells\n  trabecula cells gyroid --json\n  trabecula cells --tet\n  trabecula cells --beams",
        option("name", nargs="?", metavar="NAME", help="one cell only"),
        option("--tet", action="store_true", help="the ready tetrahedral cells instead, for maps over tetrahedra"),
        option("--beams", action="store_true", help="the unit cells of beams instead: group, nodes, valence, Maxwell count"),
        JSON,
    ),
    "stiffness": command(
        "Find how stiff the periodic cell of a design is, in every direction, and how sure that is.",
        "The cell is that of one lattice under map.affine at one level, or of beams by a unit cell; the region plays no part.\n"
        "C is the limit of three grids, n, n/2 and n/4 voxels along the cell, each voxel by its exact solid fraction.\n"
        "The solid is isotropic, of --E and --nu, or of any stiffness: --C, six lines of six numbers by commas or spaces, in\n"
        "Voigt's order 11 22 33 23 13 12 with engineering shears.\n"
        "OUT: .csv, a row for each figure; .png, .ply, .vtu, the surface of Young's modulus by direction; .inp (Abaqus,\n"
        "CalculiX), .bdf (Nastran), .mac (Ansys), material cards. Several may be named.\n\n"
        "examples:\n  trabecula stiffness part.toml --E 114000 --nu 0.34\n"
        "  trabecula stiffness part.toml --json --n 96\n  trabecula stiffness part.toml -o cell.inp modulus.png",
        *(DESIGN, *of_cell(STIFFNESS_WRITES), PLAIN),
        option("--E", type=MODULUS, metavar="E", help="Young's modulus of the solid (default: 1)"),
        option("--nu", type=POISSON, metavar="NU", help="Poisson's ratio of the solid (default: 0.3)"),
        file("--C", STIFFNESS_READS, "stiffness of a solid that is not isotropic, instead of --E and --nu: 6 x 6 numbers"),
    ),
    "conductivity": command(
        "Find how well the periodic cell of a design conducts heat or electricity, relative to its solid.",
        "As `stiffness`. With --pore the pore conducts too, this many times as well as the solid.\n\n"
        "examples:\n  trabecula conductivity part.toml\n  trabecula conductivity part.toml --pore 0.026 --json",
        *(DESIGN, *of_cell(CONDUCTIVITY_WRITES), PLAIN),
        option("--pore", type=SHARE, default=0.0, metavar="K", help="conductivity of the pore by the solid's (default: 0)"),
    ),
    "permeability": command(
        "Find how permeable the pore of the periodic cell of a design is to creeping flow, in every direction.",
        "The cell is that of `stiffness`. k, in mm², is the limit of three grids, n, n/2 and n/4 nodes along the cell:\n"
        "mean flux over the whole cell = -k grad p / viscosity. With hydraulic diameter, tortuosity and Kozeny's constant.\n"
        "Of a sheet both sides together, or one of them with --side.\n\n"
        "examples:\n  trabecula permeability part.toml\n  trabecula permeability part.toml --side lower --json",
        *(DESIGN, *of_cell(PERMEABILITY_WRITES)),
        option("--side", choices=("lower", "upper"), help="the pore on one side of a sheet (default: both)"),
    ),
    "law": command(
        "Find what a cell does by its solid fraction: stiffness, conductivity, permeability, area of the wall.",
        "At each fraction the limit of grids of n, n/2 and n/4 voxels along the cell; between them monotone cubics, and\n"
        "powers of the fraction fitted (Gibson and Ashby). Stiffness and conductivity are relative to the solid's, lengths\n"
        "to the wavelength; with --tet, to the edge of a regular tetrahedron of the same volume. OUT: .csv, a row for each\n"
        "fraction; .json, with fits and notes; .svg, plots.\n\n"
        "examples:\n  trabecula law gyroid -o gyroid.csv gyroid.svg\n  trabecula law diamond_sheet --tet --from 0.1 --to 0.4\n"
        "  trabecula law diamond --part lower --from 0.2 --to 0.5 --count 7 --properties stiffness --json",
        option("cell", metavar="CELL", help="a cell by its name, as `trabecula cells` and `trabecula cells --beams` list them"),
        option(
            "-o", "--output", nargs="+", type=Ending(LAW_WRITES), metavar="OUT", help=f"files to write ({dotted(LAW_WRITES)})"
        ),
        option(
            "--part",
            choices=("sheet", "lower", "upper", "beams"),
            help="what is solid (default: sheet, or beams where no other is; with --tet what the cell is meant for)",
        ),
        option(
            "--tet",
            action="store_true",
            help="the cell is a tetrahedral one (`trabecula cells --tet`), in the tetrahedra of a body-centred lattice",
        ),
        option("--from", dest="start", type=FRACTION, default=0.05, metavar="F", help="the least fraction (default: 0.05)"),
        option("--to", dest="stop", type=FRACTION, default=0.6, metavar="F", help="the greatest fraction (default: 0.6)"),
        option("--count", type=POINTS, default=12, metavar="N", help="fractions (default: 12)"),
        option("--n", type=VOXELS, default=48, metavar="N", help="voxels along the cell's edge (default: 48)"),
        option("--nu", type=POISSON, default=0.3, metavar="NU", help="Poisson's ratio of the solid (default: 0.3)"),
        option(
            "--properties",
            nargs="+",
            choices=("stiffness", "conductivity", "permeability", "area"),
            default=("stiffness", "conductivity", "permeability", "area"),
            help="which of stiffness, conductivity, permeability, area (default: all)",
        ),
        *(THREADS, PROGRESS, JSON, *NOTICES),
    ),
    "doctor": command(
        "Say what is installed, and what is missing: versions, processors, memory, extras.",
        "example:\n  trabecula doctor",
        JSON,
    ),
    "completion": command(
        "Print the script by which a shell completes the command.",
        "examples:\n  trabecula completion bash > ~/.local/share/bash-completion/completions/trabecula\n"
        "  trabecula completion zsh > ~/.zfunc/_trabecula     (a folder of $fpath)\n"
        "  trabecula completion fish > ~/.config/fish/completions/trabecula.fish",
        option("shell", choices=tuple(SHELLS), help="bash, zsh or fish"),
    ),
    "schema": command(
        "Print the JSON Schema of designs, by which an editor completes and checks them.",
        "An editor that knows Taplo's directive takes the schema of a TOML file from its first line, `#:schema FILE`.\n\n"
        "example:\n  trabecula schema > design.json",
    ),
    "studio": command(
        "Design in the browser: a page of this machine with live picture, figures, mesh and files.",
        "The page needs no network.\n\nexamples:\n  trabecula studio\n  trabecula studio part.toml",
        file("design", DESIGNS, "design file to open (.toml, .json)", "DESIGN", nargs="?"),
        *SERVED,
    ),
    "view": command(
        "Open a design in the studio, to turn it, cut it and change it.",
        "The same as `trabecula studio DESIGN`.\n\nexample:\n  trabecula view part.toml",
        file("design", DESIGNS, "design file to open (.toml, .json)", "DESIGN"),
        *SERVED,
    ),
    "report": command(
        "Write a report of a design as one HTML page: the part to turn, with sections; figures, wall thickness, warnings.",
        "The page needs no network. Beside the mesh, which is measured whole, it holds a lighter one to look at.\n\n"
        "example:\n  trabecula report part.toml -o part.html",
        *(DESIGN, output(("html",), "the page (.html)")),
        option("--title", metavar="TEXT", help="title of the page (default: the file's name)"),
        option(
            "--thickness",
            action=argparse.BooleanOptionalAction,
            default=True,
            help="distributions of wall thickness and pore size (default: with them)",
        ),
        *(spacing(), THREADS, PROGRESS, *NOTICES),
    ),
    "render": command(
        "Draw a design or a mesh file as PNG, or as SVG in lines.",
        "example:\n  trabecula render part.toml -o part.png --size 1600x1200 --azimuth 30 --elevation 25\n"
        "  trabecula render part.toml -o figure.svg --size 85mm --section x=0\n"
        "  trabecula render part.toml -o front.png --view front --projection orthographic --scale-bar --axes",
        *(DESIGN_OR_MESH, output(("png", "svg"), "the picture (.png), or line drawing (.svg)")),
        option(
            "--size",
            type=size,
            default=(1600, 1200, "px"),
            metavar="WxH",
            help="pixels, or mm as 85mm or 85x60mm (default: 1600x1200)",
        ),
        option("--dpi", type=DPI, metavar="N", help="pixels an inch in print (default, of a size in mm: 300)"),
        option(
            "--line-width",
            type=LENGTH,
            metavar="W",
            help="of an SVG: width of contours, in mm or pixels as --size (default: 1/340 of its width)",
        ),
        option("--background", choices=BACKGROUNDS, help="what is behind the part in a PNG (default: shaded)"),
        option("--azimuth", type=ANGLE, metavar="DEG", help="camera about +z (default: 30)"),
        option("--elevation", type=ELEVATION, metavar="DEG", help="camera above xy (default: 25)"),
        option("--view", choices=VIEWS, help="camera by name, in place of its angles"),
        option(
            "--projection",
            choices=PROJECTIONS,
            default=PROJECTIONS[0],
            help="orthographic: lengths across the view are to scale at any depth (default: perspective)",
        ),
        option("--scale-bar", action="store_true", help="with a bar of a round length; needs --projection orthographic"),
        option("--axes", action="store_true", help="with the directions of x, y and z"),
        option(
            "--section",
            metavar="PLANE",
            help='"z=10": without what is before this plane (mm), what it cuts hatched; "z<10", "z>10": what is kept',
        ),
        option("--turn", type=FRAMES, metavar="N", help="an animated PNG: N pictures from all round"),
        option("--seconds", type=SECONDS, metavar="S", help="time of one turn (default: 6)"),
        option(
            "--show",
            choices=SHOWN,
            help="local thickness of walls, overhang, solid fraction or E of the cell; of a solved map: angle, spacing or "
            "density off, the axes asked for, lines along them, its singular lines; of a blend: which lattice is where",
        ),
        option("--up", type=direction, metavar="X,Y,Z", help="along what layers are stacked, of overhang (default: 0,0,1)"),
        *(spacing(), THREADS, PROGRESS, *NOTICES),
    ),
}
