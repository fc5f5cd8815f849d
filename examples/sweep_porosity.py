"""The level of every part of the gyroid over a range of fractions, without meshing."""

import numpy as np
import trabecula as lt

fractions = np.linspace(0.1, 0.9, 9)
print("fraction   sheet    lower    upper")
for row in zip(fractions, *(lt.iso("gyroid", fractions, part=part) for part in ("sheet", "lower", "upper")), strict=True):
    print("  {:.2f}   {:8.5f} {:8.5f} {:8.5f}".format(*row))

back = lt.fraction("gyroid", lt.iso("gyroid", fractions, part="sheet"), part="sheet")
assert np.abs(back - fractions).max() < 1e-4
