"""``trabecula render``: pictures of designs and meshes."""

from __future__ import annotations

from argparse import Namespace

from ..base.files import check_place, write_bytes
from ..base.formats import is_design, kind_of
from ..base.terminal import Progress, say, settle
from ..errors import Refused, WrongUsage
from ..mesh import Mesh
from ..pictures.camera import NO_SCALE, VIEWS, section_plane, towards
from ..pictures.drawn import WALL, pixels_of
from ..pictures.shown import OF_MESH, look
from .inputs import build, meshed, surface

#: Most pixels of a picture along each side.
MOST_PIXELS = 16384

__all__ = ["render"]


def render(args: Namespace) -> None:
    """``trabecula render``."""
    check_place(args.output)
    angles = camera(args)
    pixels, dpi = resolution(args)
    line_art = drawn_in_lines(args)
    solid = None
    if not is_design(args.file):
        if args.show is not None and args.show not in OF_MESH:
            words = f"--show {args.show} is for a design"
            raise WrongUsage(f"{args.file} is a mesh; {words}")
        made, shown = surface(args), dict(OF_MESH.get(args.show, {}))
    else:
        solid = build(args.file)
        try:
            seen = look(solid, args.show, args.threads) if args.show else lambda *_: {}
        except ValueError as error:
            raise Refused(f"{args.file}: {error}") from None
        made = meshed(solid, args)
        shown = dict(seen(made, towards(*angles)))
    settle()
    shown |= {"projection": args.projection, "scale_bar": args.scale_bar, "axes": args.axes, "solid": solid}
    shown |= {"up": args.up} if args.up else {}
    if line_art:
        made.render(args.output, pixels, *angles, section=args.section, dpi=dpi, line_width=args.line_width, **shown)
    else:
        shown |= {"background": args.background or "shaded", "dpi": dpi}
        if args.turn is None:
            made.render(args.output, pixels, *angles, section=args.section, **shown)
        else:
            turning(made, args, pixels, angles, shown)
    wide, high, unit = args.size
    more = f", {args.turn} pictures" if args.turn else f", {wide:g} × {high:g} mm" if unit == "mm" else ""
    say(
        f"{args.output}: {pixels[0]} × {pixels[1]} pixels{more}"
        if not line_art
        else f"{args.output}: {wide:g} × {high:g} {unit}"
    )


def resolution(args: Namespace) -> tuple[tuple[float, float], float | None]:
    """Pixels across and down, of a drawing also parts of one, and how many are an inch, if that is said."""
    wide, high, unit = args.size
    if unit == "px":
        return (int(wide), int(high)), args.dpi
    dpi = args.dpi or 300.0
    if kind_of(args.output) == "svg":
        dpi = min(dpi, 25.4 * MOST_PIXELS / max(wide, high))  # lines have no pixels
        return (wide / 25.4 * dpi, high / 25.4 * dpi), dpi
    across, down = (max(1, round(v / 25.4 * dpi)) for v in (wide, high))
    if max(across, down) > MOST_PIXELS:
        found = f"--size {wide:g}x{high:g}mm at {dpi:g} dpi is {across} × {down} pixels"
        raise Refused(f"{found}; at most {MOST_PIXELS} are possible each")
    return (across, down), dpi


def drawn_in_lines(args: Namespace) -> bool:
    """Whether a line drawing is asked for; refused with what it cannot show."""
    if kind_of(args.output) != "svg":
        if args.line_width is not None:
            raise WrongUsage("--line-width is for an .svg; a .png has no lines of its own")
        return False
    for name in ("turn", "background"):
        if getattr(args, name) is not None:
            raise WrongUsage(f"--{name} is for a .png; an .svg is a drawing in lines of one view, on no background")
    return True


def camera(args: Namespace) -> tuple[float, float]:
    """Azimuth and elevation; the section with the side that is kept. Refused: what does not go together, or cannot be read."""
    if args.view and (args.azimuth is not None or args.elevation is not None):
        raise WrongUsage("--view says from where; leave out --azimuth and --elevation")
    if args.scale_bar and args.projection != "orthographic":
        raise WrongUsage(f"--scale-bar needs --projection orthographic: {NO_SCALE}")
    if args.up is not None and args.show != "overhang":
        raise WrongUsage("--up is the build direction of --show overhang: give that too, or leave it out")
    if args.seconds is not None and args.turn is None:
        raise WrongUsage("--seconds is the time of a turn: give --turn too, or leave it out")
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


def turning(made: Mesh, args: Namespace, pixels: tuple[float, float], angles: tuple[float, float], shown: dict) -> None:
    """Pictures from all round as one that is animated."""
    from ..pictures.turntable import animated

    color = shown.get("color")  # found once for all pictures
    if callable(color):
        shown |= {"color": color(made.vertices), "inside": color}
    elif color == "thickness":
        shown |= {"color": made.thickness_at_vertices(), "label": WALL}
    frames = []
    with Progress("drawing", args.progress) as progress:
        for i in range(args.turn):
            azimuth = angles[0] + 360 * i / args.turn
            frames.append(made.png(pixels_of(pixels), azimuth, angles[1], section=args.section, **shown))
            progress(i + 1, args.turn)
    write_bytes(args.output, animated(frames, args.seconds or 6.0))
