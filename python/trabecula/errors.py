"""Errors and warnings."""

from __future__ import annotations

import os
import sys
import warnings

__all__ = ["DesignError", "DesignWarning", "IslandsWarning", "Refused", "WrongUsage", "warn_caller"]

#: The folder of this package.
HOME = os.path.dirname(__file__) + os.sep


class DesignError(ValueError):
    """A refused design.

    Attributes: ``path`` (of the key, such as ``lattice.core.map.affine.wavelength``), ``line`` (in the file, or None),
    ``message`` (what is wrong, what is allowed, what to do), ``found`` (what stood there, or None) and ``nearest`` (the
    nearest right word to a misspelt one, or None). ``str(error)`` says it all in one line.
    """

    def __init__(
        self,
        text: str,
        path: str = "",
        line: int | None = None,
        message: str = "",
        found: str | None = None,
        nearest: str | None = None,
    ):
        super().__init__(text)
        self.path = path
        self.line = line
        self.message = message or text
        self.found = found
        self.nearest = nearest

    def __reduce__(self) -> tuple:
        return (type(self), (str(self), self.path, self.line, self.message, self.found, self.nearest))


class DesignWarning(UserWarning):
    """A possible mistake in the design: allowed, but perhaps not meant.

    Attributes: ``message`` and ``path`` (of the table or key that it is about, or empty).
    """

    def __init__(self, message: str, path: str = ""):
        super().__init__(f"{path}: {message}" if path else message)
        self.message = message
        self.path = path

    def __reduce__(self) -> tuple:
        return (type(self), (self.message, self.path))


class IslandsWarning(DesignWarning):
    """A result in several connected components."""


def warn_caller(message: str, path: str = "", kind: type[DesignWarning] = DesignWarning) -> None:
    """Warns of a possible mistake, at the line outside of this package that asked for what it is about."""
    level, frame = 2, sys._getframe(1)
    while frame.f_back and frame.f_code.co_filename.startswith(HOME):
        level, frame = level + 1, frame.f_back
    warnings.warn(kind(message, path), stacklevel=level)


class Refused(Exception):
    """A file or a request that cannot be served: one line, exit status 1."""

    status = 1


class WrongUsage(Refused):
    """Options that do not go together, or with a file of this kind: one line, exit status 2."""

    status = 2
