"""What is said: words on stderr, progress, figures with few digits."""

from __future__ import annotations

import contextlib
import math
import sys
import time

__all__ = ["Progress", "figure", "say", "span"]


class Progress:
    """Share done and time left, on stderr, a few times a second."""

    def __init__(self, word: str, wanted: bool | None):
        self.word = word
        self.terminal = sys.stderr.isatty()
        self.shown = self.terminal if wanted is None else wanted
        self.start = self.last = time.monotonic()
        self.tenth = 0
        self.width = 0

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_) -> None:
        self.clear()

    def __call__(self, done: int, total: int) -> None:
        """``done`` of ``total`` steps."""
        now = time.monotonic()
        if not self.shown or not total:
            return
        share = done / total
        left = (now - self.start) * (1 - share) / share if share > 0 else math.inf
        text = f"{self.word}: {100 * share:3.0f} %" + (f", {duration(left)} left" if math.isfinite(left) else "")
        if self.terminal:
            if now - self.last >= 0.1:
                self.last = now
                with contextlib.suppress(OSError, ValueError):
                    sys.stderr.write("\r" + text.ljust(self.width))
                    sys.stderr.flush()
                self.width = len(text)
        elif int(10 * share) > self.tenth:
            self.tenth = int(10 * share)
            say(text)

    def clear(self) -> None:
        """Takes the line away."""
        if self.width:
            with contextlib.suppress(OSError, ValueError):
                sys.stderr.write("\r" + " " * self.width + "\r")
                sys.stderr.flush()
            self.width = 0


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes} min {seconds} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def figure(v: float) -> str:
    """A number with six digits; what is left of a difference that should be nothing is nothing."""
    return f"{v:.6g}" if abs(v) > 1e-12 else "0"


def span(v) -> str:
    """A number, a range, or none."""
    if v is None:
        return "none"
    ends = [v] if isinstance(v, (int, float)) else v
    # Adding zero takes the sign off a negative one.
    told = [f"{round(end, 4) + 0.0:.4f}" for end in ends]
    return " to ".join(dict.fromkeys(told))


def say(text: str) -> None:
    """Words go to stderr; where nobody reads it, they are lost and the work goes on."""
    with contextlib.suppress(OSError, ValueError):
        print(text, file=sys.stderr, flush=True)
