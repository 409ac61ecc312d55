"""The program: its commands, and what happens when one fails.

What a user can cause ends in one line on stderr and exit code 2 (130 after Ctrl-C). Set SIXPOINT_DEBUG=1
for the traceback. Anything else is a bug of ours and is shown as it is.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Sequence

from cyclopts import App, CycloptsError

import sixpoint
from sixpoint.cli.compare import compare
from sixpoint.cli.convert import convert
from sixpoint.cli.data import data
from sixpoint.cli.demo import demo
from sixpoint.cli.info import info
from sixpoint.cli.live import live
from sixpoint.cli.reconstruct import reconstruct
from sixpoint.cli.render import render
from sixpoint.cli.screen import Screen, messages
from sixpoint.cli.study import study
from sixpoint.cli.view import view
from sixpoint.errors import SixpointError

HELP = """Pose a whole human figure from six tracked points: pelvis, head, wrists and ankles.

Start with `sixpoint demo`: it needs no file. `sixpoint COMMAND --help` explains a command, with examples.
"""

FAILED, INTERRUPTED = 2, 130


def make_app() -> App:
    """The program with all its commands."""
    app = App(name="sixpoint", help=HELP, version=sixpoint.__version__, help_format="markdown")
    for command in (demo, view, reconstruct, render, compare, convert, info, live, study, data):
        app.command(command)
    return app


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line.

    Args:
        argv: The words after the program's name; those of the process by default.

    Returns:
        0, or 2 after an error that was reported, or 130 after Ctrl-C.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    screen = Screen()
    try:
        with messages(screen):
            _run(words)
        return 0
    except KeyboardInterrupt:
        screen.error("interrupted")
        return INTERRUPTED
    except (SixpointError, OSError) as error:
        if os.environ.get("SIXPOINT_DEBUG", "0") not in ("", "0"):
            traceback.print_exc()
        screen.error(_one_line(error))
    except CycloptsError as error:
        named = [word for word in words[:1] if not word.startswith("-")]
        known = named if named and named[0] in make_app() else []
        screen.error(f"{_one_line(error)} (see: {' '.join(['sixpoint', *known, '--help'])})")
    return FAILED


def _run(words: list[str]) -> None:
    command, bound, _ = make_app().parse_args(words, exit_on_error=False, print_error=False)
    command(*bound.args, **bound.kwargs)


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__
