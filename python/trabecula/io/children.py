"""Work in processes of their own, for packages that may hang, take all memory, or take the process along."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["arrays", "bound", "python", "run", "stop"]

#: Where this package stands.
HOME = os.path.dirname(os.path.dirname(os.path.dirname(__file__)))
#: The children that run, which an interrupt ends.
running: set[subprocess.Popen] = set()
lock = threading.Lock()


def python(module: str, *given: str) -> list[str]:
    """The command of a module of this folder."""
    return [sys.executable, "-m", f"{__package__}.{module}", *given]


def run(command: list[str], folder: str, limit: float) -> str | None:
    """Runs a child at most ``limit`` seconds; what went wrong, if anything. Its words go to a file: a pipe may fill."""
    # What can be imported here can be there.
    path = os.pathsep.join([HOME, *filter(None, sys.path)])
    with open(os.path.join(folder, "said"), "w+b") as said:
        child = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=said, stderr=said, env={**os.environ, "PYTHONPATH": path}
        )
        with lock:
            running.add(child)
        try:
            status = child.wait(limit)
        except subprocess.TimeoutExpired:
            return f"did not finish within {limit:{'.3g' if limit < 100 else '.0f'}} s and was stopped"
        finally:
            if child.poll() is None:
                child.kill()
                child.wait()
            with lock:
                running.discard(child)
        if status == 0:
            return None
        if status < 0:
            return f"was ended by signal {-status}"
        said.seek(0)
        lines = said.read().decode("utf-8", "replace").strip().splitlines()
        return f"failed: {lines[-1] if lines else f'exit status {status}'}"


def arrays(module: str, given: Sequence[str], name: str, reader: str, memory: float, limit: float) -> list[NDArray]:
    """The arrays that a module of this folder makes of what is ``given``, as a child of at most ``limit`` seconds and
    ``memory`` bytes, in its order: it is run with these texts, the file that it writes them to, and the bytes. Raises
    ValueError with one sentence on ``name``, the file that the package ``reader`` reads.
    """
    import numpy as np

    with tempfile.TemporaryDirectory(prefix="trabecula-") as folder:
        made = os.path.join(folder, "made.npz")
        outcome = run(python(module, *given, made, str(memory)), folder, limit)
        if outcome is not None:
            failed, words = outcome.startswith("failed: "), outcome.removeprefix("failed: ")
            raise ValueError(f"{name} cannot be read: {words if failed else f'{reader} {words}; is it damaged?'}")
        with np.load(made) as found:
            return [found[key] for key in found.files]


def bound(memory: float) -> None:
    """Lets this process, a child, take at most ``memory`` bytes, where the system can."""
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        most = int(memory)
        resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    # Its threads would each reserve memory.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"


def stop() -> None:
    """Ends all children: whoever waits for them goes on. The core calls it when it is interrupted."""
    with lock:
        for child in running:
            child.kill()
