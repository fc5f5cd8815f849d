"""Text that is read whole, with a hint where it is no text."""

from __future__ import annotations

import os

from . import _core
from .errors import DesignError

__all__ = ["read_text"]


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a file in UTF-8, a byte order mark left out.

    Raises OSError for what is no file or cannot be read, DesignError for what is not such text.
    """
    name = os.fsdecode(path)
    raw = _core.read_file(name)
    try:
        if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
            line, message = 1, "text in UTF-16; save it as UTF-8"
        else:
            return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        message = f"not text in UTF-8 (byte {error.start}); save it as UTF-8"
    raise DesignError(f"{name}:{line}: {message}", "", line, message)
