"""The command ``trabecula``: thin, over the public Python names. Results on stdout, words on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from ..base.terminal import fail, interrupts_leave, interrupts_raise, listen, outcome, settle, warn
from .completion import script
from .parser import known_command, parser

__all__ = ["main"]


def main(argv: list[str] | None = None) -> int:
    """Runs the command; gives its exit status."""
    for name in ("stdout", "stderr"):  # streams that were closed before the start
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    interrupts_leave()
    try:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # a narrow terminal still gets the figures
        try:
            return serve(argv)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:
        fail(outcome())
        return 130
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    finally:
        interrupts_leave()  # what is left to do is to leave


def serve(argv: list[str] | None) -> int:
    """Reads the command line and runs the command."""
    import warnings

    top = parser()
    words = sys.argv[1:] if argv is None else argv
    known_command(top, words)
    args = top.parse_args(words)
    if args.version:
        from .. import _core

        print(f"trabecula {_core.__version__}")
        return 0
    if args.command == "completion":
        from .. import beams, cell

        known: dict[str, Sequence[str]] = {"cell": cell.names(), "beams": beams.names()}
        known["name"] = [*cell.names(), *beams.names()]
        print(script(top, args.shell, known), end="")
        return 0
    if args.command == "simplify" and args.tolerance is None and args.triangles is None:
        top.error("simplify needs --tolerance MM, --triangles N, or both")
    if args.command == "mesh" and args.smooth and (args.tolerance, args.triangles, args.chord) != (None, None, None):
        top.error("--smooth is for the triangles of a grid: leave out --tolerance, --triangles and --chord")
    if args.command == "slice" and args.layer is None and args.z is None:
        top.error("slice needs --layer MM and -o OUT for all layers, or --z MM for one section")
    if args.command == "slice" and args.layer is not None and args.output is None:
        top.error("slice --layer needs -o OUT, the file of layers to write")
    if args.command is None:
        top.print_help(sys.stderr)
        return 2
    listen(getattr(args, "quiet", False), getattr(args, "strict", False))
    try:
        from ..base.machine import fewer_threads

        fewer_threads(getattr(args, "threads", None))
        from ..errors import DesignWarning
        from . import actions, inputs

        interrupts_raise()
        with warnings.catch_warnings():
            # Whatever the environment asks of Python's own warnings.
            warnings.simplefilter("always", DesignWarning)
            warnings.showwarning = lambda found, *rest, **more: warn(
                getattr(found, "message", str(found)), getattr(found, "path", "")
            )
            inputs.stdin_text.cache_clear()
            getattr(actions, args.command)(args)
        settle()
        return 0
    except BrokenPipeError:
        raise
    except Exception as error:
        if os.environ.get("TRABECULA_DEBUG"):
            raise
        fail("trabecula: " + words_of(error))
        return status_of(error)


def status_of(error: Exception) -> int:
    """The exit status of an error."""
    from ..errors import Refused

    return error.status if isinstance(error, Refused) else 1


def words_of(error: Exception) -> str:
    """An error in one line."""
    from ..errors import Refused

    if isinstance(error, OSError) and error.filename:
        return f"{os.fsdecode(error.filename)}: {error.strerror}"
    if isinstance(error, OSError) and error.strerror:
        return f"the output could not be written: {error.strerror}"
    text = " ".join(str(error).split("\n"))
    if isinstance(error, (Refused, ValueError, OverflowError, OSError, MemoryError)):
        return text or type(error).__name__
    return f"internal error ({type(error).__name__}: {text}); please report it with the design and the command"
