"""Connected components other than the largest: keep, drop or refuse them, and the warning."""

from __future__ import annotations

from ..errors import IslandsWarning, warn_caller

__all__ = ["check_islands", "warn_islands"]

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from typing import Literal

    from ..reports import IslandsReport

    Islands = Literal["keep", "drop-small", "drop", "error"]


#: What can become of all connected components but the largest.
ISLANDS = ("keep", "drop-small", "drop", "error")


def check_islands(islands: object) -> None:
    """Refuses what is no word for it, before any work is done."""
    if not (isinstance(islands, str) and islands in ISLANDS):
        raise ValueError(f'islands is {islands!r}; it must be "keep", "drop-small", "drop" or "error"')


def warn_islands(islands: IslandsReport, words: str) -> None:
    """Warns of a result in several pieces: to drop them unasked would change the part, to say nothing would hide them."""
    if islands.found > islands.dropped:
        message = f'the result is not in one piece: {words}; islands = "drop" (--islands drop) leaves all but the largest out'
        warn_caller(message, kind=IslandsWarning)
