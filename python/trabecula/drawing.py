"""``trabecula render``: pictures of designs and meshes."""

from __future__ import annotations

from .camera import VIEWS, section_plane, towards
from .errors import Refused
from .files import check_place, whole_file
from .formats import is_design
from .inputs import build, meshed, surface
from .mesh import Mesh
from .shown import OF_MESH, look
from .terminal import Progress, say, settle

__all__ = ["render"]


def render(args) -> None:
    """``trabecula render``."""
    check_place(args.output)
    angles = camera(args)
    if args.show is None:
        made, shown = surface(args), {}
    elif not is_design(args.file):
        if args.show not in OF_MESH:
            raise Refused(f"{args.file} is a mesh; --show {args.show} is for a design with a solved map (map.phase) or a blend")
        made, shown = surface(args), OF_MESH[args.show]
    else:
        solid = build(args.file)
        try:
            seen = look(solid, args.show)
        except ValueError as error:
            raise Refused(f"{args.file}: {error}") from None
        made = meshed(solid, args)
        shown = seen(made, towards(*angles))
    settle()
    if args.turn is None:
        made.render(args.output, args.size, *angles, section=args.section, **shown)
    else:
        turning(made, args, angles, shown)
    say(f"{args.output}: {args.size[0]} × {args.size[1]} pixels" + (f", {args.turn} pictures" if args.turn else ""))


def camera(args) -> tuple[float, float]:
    """Azimuth and elevation; the section with the side that is kept, refused if it cannot be read."""
    if args.view and (args.azimuth is not None or args.elevation is not None):
        raise Refused("--view says from where; leave out --azimuth and --elevation")
    azimuth, elevation = VIEWS[args.view] if args.view else (30.0, 25.0)
    azimuth = azimuth if args.azimuth is None else args.azimuth
    elevation = elevation if args.elevation is None else args.elevation
    if args.section is not None:
        try:
            (normal, offset) = section_plane(args.section, towards(azimuth, elevation))
        except ValueError as error:
            raise Refused(str(error)) from None
        side = sum(normal)
        # The same side in all pictures of a turn.
        args.section = f"{'xyz'[[abs(v) for v in normal].index(1)]}{'<' if side > 0 else '>'}{side * offset!r}"
    return azimuth, elevation


def turning(made: Mesh, args, angles: tuple[float, float], shown: dict) -> None:
    """Pictures from all round as one that is animated."""
    from .turntable import animated

    frames = []
    with Progress("drawing", args.progress) as progress:
        for i in range(args.turn):
            azimuth = angles[0] + 360 * i / args.turn
            frames.append(made.png(args.size, azimuth, angles[1], section=args.section, **shown))
            progress(i + 1, args.turn)
    with whole_file(args.output) as temporary, open(temporary, "wb") as out:
        out.write(animated(frames, args.seconds))
