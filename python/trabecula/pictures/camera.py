"""Where pictures are seen from, and what sections leave out."""

from __future__ import annotations

import math
import re

__all__ = ["BACKGROUNDS", "NO_SCALE", "PROJECTIONS", "VIEWS", "section_plane", "towards"]

#: What lies behind a surface in a picture.
BACKGROUNDS = ("shaded", "white", "transparent")
#: How space becomes a plane: by a lens, or by parallel rays.
PROJECTIONS = ("perspective", "orthographic")
#: Why pictures by a lens have no scale bar.
NO_SCALE = "in perspective what is nearer is larger, and no one length is to scale"
#: Azimuth about +z and elevation above xy, degrees, of views by name.
VIEWS = {
    "iso": (45.0, math.degrees(math.atan(math.sqrt(0.5)))),
    "front": (-90.0, 0.0),
    "back": (90.0, 0.0),
    "left": (180.0, 0.0),
    "right": (0.0, 0.0),
    "top": (-90.0, 90.0),
    "bottom": (-90.0, -90.0),
}


def towards(azimuth: float, elevation: float) -> tuple[float, float, float]:
    """The direction to the eye of a picture, a unit vector."""
    az, el = math.radians(azimuth), math.radians(max(-90.0, min(elevation, 90.0)))
    return math.cos(az) * math.cos(el), math.sin(az) * math.cos(el), math.sin(el)


def section_plane(text: str, eye: tuple[float, float, float]) -> tuple[tuple[float, float, float], float]:
    """Normal and offset (mm) of a section: what lies where normal · p > offset is left out.

    ``text`` says what is kept: ``"z<10"``, ``"z>10"`` (mm), or by ``"z=10"`` the side away from the eye, so that the cut is
    seen.
    Raises ValueError for anything else.
    """
    found = re.fullmatch(r"\s*([xyz])\s*(<=|>=|=|<|>)\s*(\S+)\s*", text) if isinstance(text, str) else None
    try:
        place = float(found[3]) if found else math.nan
    except ValueError:
        place = math.nan
    if found is None or not math.isfinite(place):
        raise ValueError(f'section is "{text}"; it must be x, y or z, then =, < or >, then mm, such as "z=10"')
    axis = "xyz".index(found[1])
    keeps_below = eye[axis] >= 0 if found[2] == "=" else "<" in found[2]
    side = 1.0 if keeps_below else -1.0
    normal = tuple(side if a == axis else 0.0 for a in range(3))
    return (normal[0], normal[1], normal[2]), side * place
