"""Interrupts of the command: before and after the work they end it on the spot, during the work they are raised.

An exception in the middle of an import can come out as almost anything, and there is nothing to clean up yet.
"""

from __future__ import annotations

import os
import signal

__all__ = ["as_exception", "at_once", "left", "outcome"]

#: What outputs have been left so far, in words.
left: list[str] = []


def outcome() -> str:
    """What is said after an interrupt."""
    return f"stopped; {' and '.join(left) or 'nothing was left behind'}"


def at_once() -> None:
    """From here on an interrupt ends the process."""
    _install(_leave, signal.SIGINT)


def as_exception() -> None:
    """From here on an interrupt, and the end of the terminal, is a KeyboardInterrupt."""
    _install(_raise, signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))


def _install(handler, *signals) -> None:
    try:
        for which in signals:
            if signal.getsignal(which) is not signal.SIG_IGN:  # started in the background, or by nohup
                signal.signal(which, handler)
    except ValueError:  # not the main thread
        pass


def _leave(*_) -> None:
    try:  # noqa: SIM105  contextlib takes time to import
        os.write(2, f"{outcome()}\n".encode(errors="replace"))
    except OSError:
        pass
    os._exit(130)


def _raise(*_) -> None:
    raise KeyboardInterrupt
