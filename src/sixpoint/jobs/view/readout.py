"""What the page says about the frame that is shown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from sixpoint.body.figure import Figure
from sixpoint.body.targets import EFFECTORS
from sixpoint.jobs.view.posing import SolvedClip
from sixpoint.solvers.base import Solution, Status

STATUS = {
    Status.CONVERGED: ("met", "#3f9b5c"),
    Status.UNREACHABLE: ("not all met", "#c9374f"),
    Status.LOST: ("points lost", "#b8952f"),
}
MOST = 4  # joints at their limits that are named


def describe_frame(solved: SolvedClip, frame: int) -> list[tuple[str, str]]:
    """Rows about a frame of a solved clip: label and HTML."""
    rows = [("six points", _met(solved.solution.status[frame], solved.solution.residual[frame]))]
    if solved.errors is not None:
        distance, angle = solved.errors.distances.mean(axis=1), solved.errors.orientation_curve
        rows += [
            (
                "position",
                f"<b>{100 * distance[frame]:.1f} cm</b> &nbsp;({100 * distance.mean():.1f} overall)",
            ),
            ("orientation", f"<b>{angle[frame]:.2f} rad</b> &nbsp;({angle.mean():.2f} overall)"),
        ]
    return [*rows, ("solve", f"<b>{1e6 * solved.seconds:.1f} us</b> a frame")]


def describe_solution(solution: Solution, seconds: float) -> list[tuple[str, str]]:
    """Rows about a pose that was dragged."""
    rows = [("six points", _met(solution.status, solution.residual))]
    if solution.gave_way:
        told = (f"{name} to {', '.join(causes) or 'reach'}" for name, causes in solution.gave_way.items())
        rows.append(("gave way", escape("; ".join(told))))
    return [*rows, ("solve", f"<b>{1e6 * seconds:.0f} us</b> a call")]


def describe_limited(figure: Figure, joints: Sequence[int]) -> tuple[str, str]:
    """The row of joints at their limits, by role."""
    roles = {joint: name for name, joint in figure.roles.named().items()}
    names = [roles.get(joint, figure.skeleton.names[joint]) for joint in joints]
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return "at limit", escape(", ".join(names[:MOST])) + more or "none"


def lay_out(title: str, rows: Iterable[tuple[str, str]], message: str = "", bad: bool = False) -> str:
    """HTML of a title, rows of labels and HTML, and a message."""
    cells = "".join(
        f'<tr><td style="color:#8793a0;padding-right:10px;white-space:nowrap;vertical-align:top">{label}</td>'
        f"<td>{text}</td></tr>"
        for label, text in rows
    )
    colour = "#c9374f" if bad else "#3f9b5c"
    note = f'<div style="color:{colour};margin-top:4px">{escape(message)}</div>' if message else ""
    return (
        '<div style="font-size:0.85em;line-height:1.45;padding:2px 10px 6px">'
        f"<b>{escape(title)}</b><table>{cells}</table>{note}</div>"
    )


def _met(status: int, residual: Iterable[float]) -> str:
    word, colour = STATUS[Status(status)]
    worst, where = max(zip(residual, EFFECTORS, strict=False))
    off = f" &nbsp;{where} {100 * worst:.1f} cm off" if worst > 0.001 else ""
    return f'<b style="color:{colour}">{word}</b>{off}'
