"""The command, and ``python -m trabecula``. Interrupts are seen to before anything is imported that takes time."""

import sys

from .base import terminal


def main() -> int:
    """Runs the command; gives its exit status."""
    terminal.interrupts_leave()
    from .command.cli import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
