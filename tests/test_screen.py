"""What progress bars are on the screen while a command runs."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.progress import Progress

from sixpoint.cli.screen import Bars, Screen


@pytest.fixture
def bars():
    """Bars on a terminal that nobody sees."""
    return Bars(Progress(console=Console(file=io.StringIO(), force_terminal=True)))


def shown(bars):
    """What the bars on the screen say."""
    return [(task.description, task.completed, task.total) for task in bars.bar.tasks]


def test_a_long_comparison_has_two_bars(bars):
    """The bar of the whole stays, that of a part goes when it is done, even if its end is said twice."""
    bars.report("comparing", 0, 30)
    for part in range(30):
        bars.report(f"clip {part}", 0, 5)
        bars.report(f"clip {part}", 3, 5)
        assert shown(bars) == [("comparing", part, 30), (f"clip {part}", 3, 5)]
        for _ in range(2):
            bars.report(f"clip {part}", 5, 5)
        bars.report("comparing", part + 1, 30)
        assert shown(bars) == [("comparing", part + 1, 30)]
    for what in ("gathering", "drawing"):
        bars.report(what, 0, 4)
        assert shown(bars) == [("comparing", 30, 30), (what, 0, 4)]
        bars.report(what, 4, 4)
        assert shown(bars) == [("comparing", 30, 30)]


def test_the_only_bar_stays_when_it_is_done(bars):
    """Until the next begins, so that the screen is not empty between two steps."""
    bars.report("reading", 0, 2)
    bars.report("reading", 2, 2)
    assert shown(bars) == [("reading", 2, 2)]
    bars.report("solving", 0, 9)
    assert shown(bars) == [("solving", 0, 9)]
    bars.report("solving", 9, 9)
    assert shown(bars) == [("solving", 9, 9)]


def test_the_same_work_can_begin_again(bars):
    """A second round under the same name is shown like the first."""
    bars.report("whole", 0, 2)
    for _ in range(2):
        bars.report("solving", 1, 9)
        assert shown(bars) == [("whole", 0, 2), ("solving", 1, 9)]
        bars.report("solving", 9, 9)
        assert shown(bars) == [("whole", 0, 2)]


def test_the_end_of_what_has_no_bar_changes_nothing(bars):
    """What is over when it is first told gets no bar, and does not make the other one the whole."""
    bars.report("solving", 1, 9)
    bars.report("reading", 2, 2)
    assert shown(bars) == [("solving", 1, 9)]
    bars.report("solving", 9, 9)
    bars.report("writing", 0, 1)
    assert shown(bars) == [("writing", 0, 1)]


def test_a_terminal_sees_them_and_is_left_clean(monkeypatch):
    """Bars are drawn while a command runs, and gone afterwards; without a terminal there are none."""
    for terminal in (True, False):
        screen, stream = Screen(), io.StringIO()
        monkeypatch.setattr(screen, "err", Console(file=stream, force_terminal=terminal, width=80))
        with screen.progress() as report:
            report("comparing", 1, 3)
        assert ("comparing" in stream.getvalue()) == terminal
        assert stream.getvalue().endswith("\x1b[2K") == terminal
