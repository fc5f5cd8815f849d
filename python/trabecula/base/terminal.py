"""What a terminal shows: messages on stderr, figures as JSON, progress, figures with few digits, and what an interrupt does.

Before and after the work of a command an interrupt ends the process on the spot, during the work it is raised: an exception in
the middle of an import can come out as almost anything, and there is nothing to clean up yet.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
from collections import deque

__all__ = [
    *("Progress", "fail", "figure", "interrupts_leave", "interrupts_raise", "left", "listen", "outcome", "put_json"),
    *("say", "settle", "span", "warn", "warned"),
]

TYPE_CHECKING = False  # as type checkers know it, without the import
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType

#: The share between two times that the pace is taken from.
FINE = 0.002


class Progress:
    """Share done and time left, on stderr, a few times a second.

    The time left is by the pace of the second half of what is done: work starts with files to read and fields to set up.
    """

    def __init__(self, word: str, wanted: bool | None):
        self.word = word
        self.terminal = sys.stderr.isatty()
        self.shown = not _voice.quiet and (self.terminal if wanted is None else wanted)
        self.last = time.monotonic()
        #: Shares done and when, of which the first is the last before half of what is done now.
        self.past = deque([(0.0, self.last)])
        self.tenth = 0
        self.width = 0

    def __enter__(self) -> Progress:
        _voice.progress = self
        return self

    def __exit__(self, *_: object) -> None:
        self.clear()
        _voice.progress = None

    def __call__(self, done: int, total: int) -> None:
        """``done`` of ``total`` steps."""
        now = time.monotonic()
        if not self.shown or not total:
            return
        share = done / total
        while len(self.past) > 1 and self.past[1][0] <= share / 2:
            self.past.popleft()
        before, then = self.past[0]
        left = (now - then) * (1 - share) / (share - before) if share > before else math.inf
        if share >= self.past[-1][0] + FINE:
            self.past.append((share, now))
        text = f"{self.word}: {100 * share:3.0f} %" + (f", {duration(left)} left" if math.isfinite(left) else "")
        if self.terminal:
            if now - self.last >= 0.1:
                self.last = now
                _write("\r" + text.ljust(self.width))
                self.width = len(text)
        elif int(10 * share) > self.tenth:
            self.tenth = int(10 * share)
            say(text)

    def clear(self) -> None:
        """Takes the line away."""
        if self.width:
            _write("\r" + " " * self.width + "\r")
            self.width = 0


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes} min {seconds} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def figure(v: float, nothing: float = 1e-12) -> str:
    """A number with six digits; what is left of a difference that should be ``nothing`` is 0, and what is no number ``-``."""
    return f"{v:.6g}" if abs(v) > nothing else "0" if v == v else "-"


def span(v: float | list[float] | None) -> str:
    """A number, a range, or none."""
    if v is None:
        return "none"
    ends = [v] if isinstance(v, (int, float)) else v
    # Adding zero takes the sign off a negative one.
    texts = [f"{round(end, 4) + 0.0:.4f}" for end in ends]
    return " to ".join(dict.fromkeys(texts))


class _Voice:
    """How much is said: ``quiet`` errors only; ``strict`` a warning is an error."""

    def __init__(self, quiet: bool = False, strict: bool = False):
        self.quiet = quiet
        self.strict = strict
        self.notices: list[dict[str, str]] = []
        self.progress: Progress | None = None


_voice = _Voice()


def listen(quiet: bool, strict: bool) -> None:
    """Begins a command: nothing has been warned of yet."""
    global _voice
    _voice = _Voice(quiet, strict)


def warned() -> list[dict[str, str]]:
    """What has been warned of, each text once, as {path, message}: the path of a key, or nothing."""
    return list(_voice.notices)


def put_json(figures: object) -> None:
    """Figures as JSON on stdout."""
    print(json.dumps(figures, indent=2))


def fail(text: str) -> None:
    """An error on stderr, on a line of its own."""
    if _voice.progress:
        _voice.progress.clear()
    _write(text + "\n")


def say(text: str) -> None:
    """A message on stderr, on a line of its own."""
    if not _voice.quiet:
        fail(text)


def warn(message: str, path: str = "", shown: bool = True) -> None:
    """Warns, once with each text; with ``strict`` it is an error, and shown even if ``quiet``."""
    notice = {"path": path, "message": message}
    if notice in _voice.notices:
        return
    _voice.notices.append(notice)
    if shown or _voice.strict:
        (fail if _voice.strict else say)(f"warning: {path}: {message}" if path else f"warning: {message}")


def settle() -> None:
    """Refuses to go on, if a warning is an error and there was one."""
    if _voice.strict and _voice.notices:
        from ..errors import Refused

        many = "a warning" if len(_voice.notices) == 1 else f"{len(_voice.notices)} warnings"
        raise Refused(f"{many}, refused by --strict; nothing is written")


def _write(text: str) -> None:
    """Text on stderr; where nobody reads it, it is lost and the work goes on."""
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except (OSError, ValueError):
        pass


#: What outputs have been left so far, in words.
left: list[str] = []


def outcome() -> str:
    """What is said after an interrupt."""
    return f"stopped; {' and '.join(left) or 'nothing was left behind'}"


def interrupts_leave() -> None:
    """From here on an interrupt ends the process."""
    _install(_leave, signal.SIGINT)


def interrupts_raise() -> None:
    """From here on an interrupt, and the end of the terminal, is a KeyboardInterrupt."""
    _install(_raise, signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))


def _install(handler: Callable[[int, FrameType | None], object], *signals: signal.Signals) -> None:
    try:
        for which in signals:
            if signal.getsignal(which) is not signal.SIG_IGN:  # started in the background, or by nohup
                signal.signal(which, handler)
    except ValueError:  # not the main thread
        pass


def _leave(*_: object) -> None:
    try:  # noqa: SIM105  contextlib takes time to import
        os.write(2, f"{outcome()}\n".encode(errors="replace"))
    except OSError:
        pass
    os._exit(130)


def _raise(*_: object) -> None:
    raise KeyboardInterrupt
