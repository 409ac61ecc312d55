"""The command line: parse, call a job, print. Every command has a module, every job is in ``jobs``."""

import sys
from collections.abc import Sequence

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line, see ``app.main``; Ctrl-C counts from here on, also while the program is loaded."""
    try:
        from sixpoint.cli.app import main as run
    except KeyboardInterrupt:
        sys.stderr.write("error: interrupted\n")
        return 130
    return run(argv)
