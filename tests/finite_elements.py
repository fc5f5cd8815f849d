"""Designs and arrays for the tests of volume meshes."""

import numpy as np
import trabecula as lt

CORNERS = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]


def solid(cell="gyroid", part="sheet", fraction=0.3, region=None, **more):
    core = lt.Lattice(
        cell=getattr(lt.cell, cell)(), part=part, map=lt.map.affine(wavelength=4), level=lt.level.fraction(fraction)
    )
    region = lt.region.box(min=[0, 0, 0], max=[4, 4, 4]) if region is None else region
    return lt.Design(region=region, lattice={"core": core}, **more).build()


def volumes(nodes, tets):
    a, b, c, d = (nodes[tets[:, i]] for i in range(4))
    return np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6


def faces_of(mesh, faces):
    tets = mesh.elements[:, :4]
    return tets[faces[:, 0][:, None], np.array(CORNERS)[faces[:, 1]]]


def area_of(mesh, name):
    p = mesh.nodes[faces_of(mesh, mesh.sets[name].faces)]
    return np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2
