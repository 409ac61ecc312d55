"""What the user sees: results on stdout, messages, errors and progress bars on stderr.

Without a terminal there are neither colours nor bars, and lines are as long as they need to be.
"""

from __future__ import annotations

import logging
import warnings
from collections.abc import Container, Iterable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from sixpoint.errors import Remark
from sixpoint.jobs.progress import Progress as Report

WIDE = 200  # columns where no terminal sets a width


class Screen:
    """The two streams of a command."""

    def __init__(self) -> None:
        self.out = _console(stderr=False)
        self.err = _console(stderr=True)

    def say(self, text: str = "", style: str = "") -> None:
        """One line of a result."""
        self.out.print(Text(text, style=style), soft_wrap=True)

    def rows(self, rows: Iterable[tuple[str, str]]) -> None:
        """Labels and texts in two columns; on a terminal long texts are folded in theirs."""
        rows = list(rows)
        if not self.out.is_terminal:
            width = max(len(label) for label, _ in rows)
            for label, text in rows:
                self.say(f"  {label:<{width}}  {text}")
            return
        table = Table.grid(padding=(0, 2))
        table.add_column(style="cyan", no_wrap=True)
        table.add_column(overflow="fold")
        for label, text in rows:
            table.add_row(Text(f"  {label}"), Text(text))
        self.out.print(table)

    def table(
        self, columns: Iterable[str], rows: Iterable[Iterable[str]], texts: Container[int] = (0,)
    ) -> None:
        """A table of numbers, aligned right, and of texts in the columns ``texts``."""
        table = Table(box=None, header_style="bold", pad_edge=False, padding=(0, 2, 0, 0))
        for number, column in enumerate(columns):
            table.add_column(Text(column), justify="left" if number in texts else "right", overflow="fold")
        for row in rows:
            table.add_row(*(Text(cell) for cell in row))
        self.out.print(table)

    def note(self, text: str, label: str = "note", style: str = "dim") -> None:
        """A message beside the result."""
        self.err.print(Text.assemble((f"{label}: ", style), " ".join(text.split())), soft_wrap=True)

    def error(self, text: str) -> None:
        """Why there is no result."""
        self.err.print(Text.assemble(("error: ", "bold red"), (text, "red")), soft_wrap=True)

    @contextmanager
    def progress(self) -> Iterator[Report]:
        """Progress bars, shown on a terminal only; yields what jobs report to."""
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        bar = Progress(*columns, console=self.err, transient=True, disable=not self.err.is_terminal)
        with bar:
            yield Bars(bar).report


class Bars:
    """The bars of what is under way.

    A finished one goes, unless it is the only one or others began while it ran: that one is of the whole.
    """

    def __init__(self, bar: Progress) -> None:
        self.bar = bar
        self.tasks: dict[str, TaskID] = {}
        self.finished: set[str] = set()
        self.whole: set[str] = set()

    def report(self, what: str, done: int, total: int) -> None:
        """Show how far something is."""
        if what not in self.tasks:
            if done >= total and self.tasks:
                return  # the end of what has no bar, or has it no more
            self.whole |= self.tasks.keys() - self.finished
            self.tasks[what] = self.bar.add_task(what, total=total)
        self.bar.update(self.tasks[what], completed=done, total=total)
        if done >= total:
            self.finished.add(what)
        else:
            self.finished.discard(what)
        if len(self.tasks) > 1:
            for over in self.finished - self.whole:
                self.bar.remove_task(self.tasks.pop(over))
                self.finished.discard(over)


def _console(*, stderr: bool) -> Console:
    console = Console(stderr=stderr, highlight=False)
    if not console.is_terminal:
        console.width = WIDE
    return console


class _Notes(logging.Handler):
    """Log records as notes on the screen."""

    def __init__(self, screen: Screen) -> None:
        super().__init__(logging.INFO)
        self.screen = screen

    def emit(self, record: logging.LogRecord) -> None:
        bad = record.levelno > logging.WARNING
        self.screen.note(record.getMessage(), "warning" if bad else "note", "yellow" if bad else "dim")


@contextmanager
def messages(screen: Screen) -> Iterator[None]:
    """Show the package's log and Python's warnings as single lines while a command runs."""
    log = logging.getLogger("sixpoint")
    handler, level, propagate = _Notes(screen), log.level, log.propagate
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False
    said: set[str] = set()

    def show(message: Warning | str, *_: object) -> None:
        if str(message) not in said:
            said.add(str(message))
            if isinstance(message, Remark):
                screen.note(str(message))
            else:
                screen.note(str(message), "warning", "yellow")

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", UserWarning)
            warnings.showwarning = show  # type: ignore[assignment]
            yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)
        log.propagate = propagate
