"""Points in the unit cube: Latin hypercubes and Sobol sequences. The same seed gives the same points on every system."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

__all__ = ["DIMENSIONS", "latin", "sobol"]

#: Of each dimension from the second on: the degree of its primitive polynomial, the coefficients between the first and the
#: last, and the initial direction numbers. Source: S. Joe, F. Y. Kuo, Constructing Sobol sequences with better
#: two-dimensional projections, SIAM J. Sci. Comput. 30, 2008 (the first of their table).
POLYNOMIALS = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)),
    (5, 2, (1, 1, 5, 5, 17)),
    (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
    (5, 11, (1, 1, 5, 1, 1)),
    (5, 13, (1, 1, 1, 3, 11)),
    (5, 14, (1, 3, 5, 5, 31)),
    (6, 1, (1, 3, 3, 9, 7, 49)),
    (6, 13, (1, 1, 1, 15, 21, 21)),
    (6, 16, (1, 3, 1, 13, 27, 49)),
    (6, 19, (1, 1, 1, 15, 7, 5)),
    (6, 22, (1, 3, 1, 15, 13, 25)),
    (6, 25, (1, 1, 5, 5, 19, 61)),
    (7, 1, (1, 3, 7, 11, 23, 15, 103)),
    (7, 4, (1, 3, 7, 13, 13, 15, 69)),
)
#: Most dimensions of a Sobol sequence here.
DIMENSIONS = 1 + len(POLYNOMIALS)
BITS = 32


def latin(count: int, dimensions: int, seed: int) -> Iterator[tuple[float, ...]]:
    """A Latin hypercube of ``count`` points: of each coordinate one value in each of ``count`` equal parts of 0 to 1, uniformly
    within, in random order. Source: McKay, Beckman, Conover, Technometrics 21, 1979.
    """
    random = Random(seed)
    columns = []
    for _ in range(dimensions):
        column = [(i + random.random()) / count for i in range(count)]
        for i in range(count - 1, 0, -1):  # by hand: what `shuffle` does may change between versions of Python
            j = int(random.random() * (i + 1))
            column[i], column[j] = column[j], column[i]
        columns.append(column)
    return zip(*columns, strict=True)


def sobol(count: int, dimensions: int, seed: int) -> Iterator[tuple[float, ...]]:
    """The first ``count`` points of a Sobol sequence in Gray-code order, in [0, 1); a seed other than 0 shifts them digit by
    digit.

    Raises ValueError for more than 21 dimensions.
    """
    if dimensions > DIMENSIONS:
        raise ValueError(f"a Sobol sequence has at most {DIMENSIONS} dimensions here, found {dimensions}; choose latin")
    random = Random(seed)
    directions = [_directions(d) for d in range(dimensions)]
    point = [int(random.random() * 2**BITS) if seed else 0 for _ in range(dimensions)]
    for i in range(count):
        yield tuple(p / 2**BITS for p in point)
        lowest_zero = (~i & (i + 1)).bit_length() - 1
        point = [p ^ v[lowest_zero] for p, v in zip(point, directions, strict=True)]


def _directions(dimension: int) -> list[int]:
    """The direction numbers of a dimension, as fractions of 2^32."""
    if dimension == 0:
        return [1 << (BITS - 1 - k) for k in range(BITS)]
    degree, middle, first = POLYNOMIALS[dimension - 1]
    numbers = list(first)
    for k in range(degree, BITS):
        new = numbers[k - degree] ^ (numbers[k - degree] << degree)
        for i in range(1, degree):
            new ^= ((middle >> (degree - 1 - i)) & 1) * (numbers[k - i] << i)
        numbers.append(new)
    return [n << (BITS - 1 - k) for k, n in enumerate(numbers)]
