"""The parser of the command line, and errors of one line."""

from __future__ import annotations

import argparse
from typing import NoReturn

from .syntax import COMMANDS

__all__ = ["known_command", "parser"]

EPILOG = """\
examples:
  trabecula new first.toml --cell gyroid         write a commented design to start from
  trabecula check first.toml                     level, fraction, wall thickness, warnings; no mesh
  trabecula mesh first.toml -o first.3mf --edge 0.25
  trabecula measure first.toml --json
  trabecula render first.toml -o first.png

exit status: 0 done, 1 the design or a file is wrong, 2 wrong usage,
or options that do not go together.
Set TRABECULA_DEBUG=1 for the traceback of an internal error.
"""


class Parser(argparse.ArgumentParser):
    """argparse with errors of one line."""

    def error(self, message: str) -> NoReturn:
        """Leaves with status 2."""
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def parser() -> argparse.ArgumentParser:
    """Everything that the command understands."""
    top = Parser(
        prog="trabecula",
        description="Lattice design: a design file in, a closed and measured solid out.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action="store_true", help="print the version and exit")
    commands = top.add_subparsers(dest="command", metavar="COMMAND")
    plain = argparse.RawDescriptionHelpFormatter
    for name, (line, more, options) in COMMANDS.items():
        one = commands.add_parser(name, help=line, description=line, epilog=more, formatter_class=plain)
        for some in options:
            group = one.add_mutually_exclusive_group() if isinstance(some, list) else one
            for names, settings in some if isinstance(some, list) else [some]:
                group.add_argument(*names, **settings)
    return top


def known_command(top: argparse.ArgumentParser, words: list[str]) -> None:
    """Leaves with status 2 if the first word is no command, with the nearest one."""
    name = next((word for word in words if not word.startswith("-")), None)
    if name is not None and name not in COMMANDS:
        from difflib import get_close_matches

        near = get_close_matches(name[:80].lower(), COMMANDS, 1)
        hint = f"; did you mean {near[0]}?" if near else "."
        top.error(f"no command is named {name:.80}{hint} There are: {', '.join(COMMANDS)}")
