"""Effective stiffness as material cards of finite element programs."""

from __future__ import annotations

from collections.abc import Sequence

from ..reports import StiffnessReport

__all__ = ["CARDS", "abaqus", "ansys", "nastran"]

#: Places in Voigt's order 11 22 33 23 13 12 of the stresses as Abaqus and CalculiX order them, 11 22 33 12 13 23, and as
#: Nastran and Ansys do, 11 22 33 12 23 13. All take engineering shears.
ABAQUS, NASTRAN = (0, 1, 2, 5, 4, 3), (0, 1, 2, 5, 3, 4)


def upper(c: Sequence[Sequence[float]], order: Sequence[int], by_column: bool) -> list[float]:
    """The 21 constants of a symmetric matrix in another order, column by column down to the diagonal, or row by row from it."""
    if by_column:
        return [c[order[i]][order[j]] for j in range(6) for i in range(j + 1)]
    return [c[order[i]][order[j]] for i in range(6) for j in range(i, 6)]


#: Entries that couple stretches and shears, over the greatest of the diagonal, up to which they are those of voxels alone.
COUPLED = 1e-3


def abaqus(found: StiffnessReport, title: str) -> str:
    """``*ELASTIC, TYPE=ANISOTROPIC`` for Abaqus (CalculiX reads it too), eight constants a line; and as a comment the
    engineering constants E1 E2 E3 nu12 nu13 nu23 G12 G13 G23, if the axes are those of symmetry: if nothing couples stretches
    and shears.
    """
    constants = upper(found.C, ABAQUS, True)
    lines = ["*MATERIAL, NAME=LATTICE", "*ELASTIC, TYPE=ANISOTROPIC"]
    lines += [", ".join(f"{v:.9g}" for v in constants[i : i + 8]) for i in range(0, 21, 8)]
    coupled = [found.C[i][j] for i in range(6) for j in range(3, 6) if i != j]
    orthotropic = max(map(abs, coupled)) <= COUPLED * max(found.C[i][i] for i in range(6))
    if orthotropic and found.E and found.G and found.nu:
        (g23, g13, g12), (n23, n13, n12) = found.G, found.nu
        lines += ["** Along axes of symmetry instead:", "** *ELASTIC, TYPE=ENGINEERING CONSTANTS"]
        lines += ["** " + ", ".join(f"{v:.9g}" for v in (*found.E, n12, n13, n23, g12, g13)), f"** {g23:.9g}"]
    return "\n".join([f"** {title}", *lines, ""])


def nastran(found: StiffnessReport, title: str) -> str:
    """``MAT9`` for Nastran, in fields of 16 characters."""
    fields = [f"{1:16d}", *(f"{v:16.9E}" for v in upper(found.C, NASTRAN, False))]
    rows = [fields[i : i + 4] for i in range(0, len(fields), 4)]
    lines = [("MAT9*   " if i == 0 else "*       ") + "".join(row) for i, row in enumerate(rows)]
    return "\n".join([f"$ {title}", *lines, ""])


def ansys(found: StiffnessReport, title: str) -> str:
    """``TB,ANEL`` for Ansys: stiffness, six constants a command."""
    constants = upper(found.C, NASTRAN, False)
    lines = [f"TBDATA,{i + 1}," + ",".join(f"{v:.9g}" for v in constants[i : i + 6]) for i in range(0, 21, 6)]
    return "\n".join([f"! {title}", "TB,ANEL,1,1,21,0", "TBTEMP,0", *lines, ""])


#: Programs by the suffix of their files.
CARDS = {"inp": abaqus, "bdf": nastran, "mac": ansys}
