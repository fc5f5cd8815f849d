#!/usr/bin/env python3
"""Writes docs/generated/{command,python}.md from the help pages and the docstrings."""

import contextlib
import inspect
import subprocess
import sys
from pathlib import Path

import trabecula
from trabecula.command.syntax import COMMANDS

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "docs" / "generated"
STAMP = "<!-- Made by scripts/design_reference.py; do not edit. -->"


def command():
    """The help pages."""
    lines = [STAMP, "# The command: its help", ""]
    for name in ["", *COMMANDS]:
        words = [sys.executable, "-m", "trabecula", *name.split(), "--help"]
        text = subprocess.run(words, check=True, capture_output=True, text=True).stdout.rstrip()
        lines += [f"## trabecula {name}".rstrip(), "", "```text", text, "```", ""]
    return "\n".join(lines)


def python():
    """Names, signatures and docstrings."""
    lines = [STAMP, "# Python: every name", ""]
    for name in sorted(trabecula.__all__):
        thing = getattr(trabecula, name)
        members = [(name, thing)]
        if inspect.ismodule(thing) or inspect.isclass(thing):
            own = [
                c for c in getattr(thing, "__mro__", [thing]) if getattr(c, "__module__", "trabecula").startswith("trabecula")
            ]
            named = getattr(thing, "__all__", {k for c in own for k in vars(c)})
            public = sorted(k for k in named if not k.startswith("_"))
            owned = [(k, getattr(thing, k)) for k in public]
            owned = [(k, m) for k, m in owned if callable(m) or hasattr(m, "__get__")]
            keep = inspect.isclass(thing)
            members += [(f"{name}.{k}", m) for k, m in owned if keep or getattr(m, "__module__", "") == thing.__name__]
        for label, member in members:
            with contextlib.suppress(TypeError, ValueError):
                label += str(inspect.signature(member)) if callable(member) else ""
            lines += [f"### `{label}`", "", inspect.getdoc(member) or "", ""]
    return "\n".join(lines)


def main():
    """Write the pages."""
    OUT.mkdir(parents=True, exist_ok=True)
    for name, text in (("command", command()), ("python", python())):
        (OUT / f"{name}.md").write_text(text.rstrip() + "\n", encoding="utf-8")
        print(OUT / f"{name}.md")


if __name__ == "__main__":
    main()
