"""The report of the study of Sequential IK in Markdown: each picture, and what is seen, with its numbers.

Every sentence that judges is chosen by the numbers, so the report stays true when the solver changes.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sixpoint.errors import listed
from sixpoint.jobs.sik_study.limb import SWIVELS

if TYPE_CHECKING:
    from sixpoint.jobs.sik_study.clips import ClipRun
    from sixpoint.jobs.sik_study.job import SikStudy
    from sixpoint.jobs.sik_study.trunk import SpineCase

EXACT, EVEN = 1e-6, 1e-4
"""A distance that is met [m]; turns that are the same [rad]."""

HEAD = """# Sequential IK: the figures of the paper with this solver

Unzueta, Peinado, Boulic and Suescun, *Full-body performance animation with Sequential Inverse Kinematics*
(Graphical Models 70, 2008), Figures 2, 4 to 7 and 10 to 13. Written by `sixpoint study sik`. All postures are
posed by `SequentialIK` with its joint limits, on the built-in figure of 1.75 m unless said otherwise; all
numbers are measured on the postures by forward kinematics.
"""
CREDIT = (
    "The data used in this project was obtained from mocap.cs.cmu.edu. The database was created with funding "
    "from NSF EIA-0196217."
)


def report(study: SikStudy) -> str:
    """The whole report, as Markdown beside its pictures."""
    parts = (_spine(study), _clavicle(study), _limb(study), _limits(study), _clips(study), _hierarchy(study))
    text = "\n".join([HEAD, *(_wrapped(line) for part in parts for line in part)])
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    return text


def _wrapped(line: str) -> str:
    """A paragraph in lines of 110 characters; rows of a table, headings and pictures as they are."""
    return line if line[:1] in ("|", "#", "!") else textwrap.fill(line, 110, break_on_hyphens=False)


def _table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    lines = [columns, ["---"] * len(columns), *rows]
    return ["", *("| " + " | ".join(line) + " |" for line in lines), ""]


def _section(title: str, picture: str | None = None) -> list[str]:
    return [f"## {title}", "", *([f"![{title}]({picture})", ""] if picture else [])]


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle):.1f}°"


def _millimetres(length: float) -> str:
    """A bound on a small length; a thousandth at least."""
    return f"{max(length, 1e-3):.1g}"


def spine_columns(spine: SpineCase) -> list[str]:
    """Headings of ``spine_rows``."""
    return ["posture", "asked, cm", "reached, cm", *(f"{name}, °" for name in spine.joints)]


def spine_rows(spine: SpineCase) -> list[list[str]]:
    """One row a posture: distance of pelvis and head, asked and reached, and turns of the joints between."""
    return [
        [name, f"{100 * asked:.2f}", f"{100 * chord:.2f}", *(f"{np.degrees(bend):.1f}" for bend in bends)]
        for name, asked, chord, bends in zip(spine.names, spine.asked, spine.chords, spine.bends, strict=True)
    ]


def _spine(study: SikStudy) -> list[str]:
    spine = study.spine
    off = 1e3 * np.abs(spine.chords - spine.asked)
    stretched = (
        "The stretched trunk is straight."
        if off[0] < 1e3 * EXACT
        else f"The stretched trunk is asked to be straight; the limits of {listed(_held(spine, 0))} keep it "
        f"{off[0]:.1f} mm short, which both ends share: {1e3 * spine.misses[0, 0]:.1f} mm each (Algorithm 2, "
        "line 17)."
    )
    return [
        *_section("A spine between two known points (Figure 2)", "spine.png"),
        "The trunk from its right side. Only the rings are known, pelvis and head; the dashed line is their "
        "distance. From the left: totally stretched, neutral, then the head comes nearer and leans to the "
        "front. Each posture starts from the one before.",
        *_table(spine_columns(spine), spine_rows(spine)),
        f"{stretched} All other distances are met within {_millimetres(off[1:].max())} mm. {_bending(spine)}",
        "",
    ]


def _held(spine: SpineCase, posture: int) -> list[str]:
    """Joints that stand at their limits."""
    at = spine.bends[posture] > spine.allowed[posture] - EVEN
    return [name for name, stands in zip(spine.joints, at, strict=True) if stands]


def _bending(spine: SpineCase) -> str:
    """Which postures bend evenly, and which joints stop in the last."""
    text = ""
    even = [k for k, bends in enumerate(spine.bends) if k > 1 and np.ptp(bends) < EVEN]
    if even:
        share = 100 * spine.asked[even[-1]] / spine.neutral
        text += (
            f"Down to {share:.0f} % of the neutral distance all joints between pelvis and head turn by the "
            f"same angle, as in Eq. 1: {_degrees(spine.bends[even[-1]].mean())} there. "
        )
    last = spine.bends[-1]
    held = _held(spine, -1)
    if 0 < len(held) < len(spine.joints):
        most = int(last.argmax())
        text += (
            f"In the deepest posture {listed(held)} stand at their limits, and {spine.joints[most]} goes on "
            f"to {_degrees(last[most])}."
        )
    return text


def _clavicle(study: SikStudy) -> list[str]:
    case = study.clavicle
    end = (
        "Then shoulder and known wrist are exactly the length of the arm apart, and the wrist misses by "
        f"{1e3 * case.misses[1]:.2f} mm. **Agrees with Algorithm 4.**"
        if abs(case.gaps[1] - case.reach) < EXACT
        else f"There its limits stop it: the wrist still misses by {100 * case.misses[1]:.1f} cm."
    )
    return [
        *_section("A clavicle that helps its arm (Figure 4)", "clavicle.png"),
        f"The figure from the front. The left wrist is known to be {100 * case.gaps[0]:.1f} cm from the "
        f"shoulder, but the arm is {100 * case.reach:.1f} cm long: with the clavicle held (left) the "
        f"stretched arm misses by {100 * case.misses[0]:.1f} cm. Free (middle and right), the clavicle turns "
        f"by {_degrees(case.angle)} of the {_degrees(case.limit)} that its limits allow in that direction. "
        f"{end}",
        "",
    ]


def _limb(study: SikStudy) -> list[str]:
    case = study.limb
    upper, fore, far = (f"{100 * length:.1f} cm" for length in case.lengths)
    psi, flexion = case.by_triangle
    wrong = max(abs(case.psi - psi), abs(case.flexion - flexion))
    same = "the same" if wrong < EXACT else f"up to {_degrees(wrong)} off, as limits hold"
    return [
        *_section("A limb in closed form (Figure 5)", "limb.png"),
        f"Left: the right arm from the side. Upper arm ({upper}), forearm ({fore}) and the way from the "
        f"shoulder to the known wrist ({far}) make a triangle. It gives the angle at the shoulder, "
        f"ψ = {_degrees(psi)}, and the flexion of the elbow, φ = {_degrees(flexion)}; in the solver's "
        f"posture they are {same}. "
        "Right: the same arm aslant. The triangle may turn about the line from shoulder to wrist: the elbow "
        f"is somewhere on a circle of {100 * case.radius:.1f} cm radius, and at all {len(SWIVELS) + 1} drawn "
        f"swivel angles the wrist is within {_millimetres(1e3 * case.drift)} mm of its place. The solver "
        "does not search: its swivel angle is that of the stretched, hanging arm after the shortest turn "
        "towards the wrist.",
        "",
    ]


def _limits(study: SikStudy) -> list[str]:
    from sixpoint.study.sik_figures.limits import compute_overshoot  # Matplotlib is slow to import

    case = study.limits
    knots = np.degrees(np.column_stack([case.shoulder.theta, case.shoulder.psi, case.hip.psi]))
    off = np.abs(case.kept - np.column_stack([case.asked[:, 0], case.allowed])).max()
    across, back = (
        f"θ = {np.degrees(asked[0]):.0f}°, ψ = {np.degrees(asked[1]):.0f}°, "
        f"it stops at ψ = {_degrees(kept[1])}"
        for asked, kept in zip(case.asked, case.kept, strict=True)
    )
    return [
        *_section("Limits of swing (Figures 6 and 7)", "limits.png"),
        "Left: how far a limb may swing out of its hanging pose (ψ) in each direction (θ). The circles are "
        "the knots of the shipped table, the line is the cubic spline through them with equal slopes at both "
        "ends (Eq. 3). Dotted: the shoulder's spline itself goes up to "
        f"{_degrees(compute_overshoot(case.shoulder))} above its highest knot; it is clipped to the range of "
        "its knots. Right: the sphere on which the left elbow moves. Tinted is what the limits allow, "
        "bordered by the same curve; it is dashed on the far side.",
        *_table(("θ, °", "shoulder ψ, °", "hip ψ, °"), ([f"{value:.0f}" for value in row] for row in knots)),
        "The dashed ray is where the stretched arm is asked to go. Across the body, "
        f"{across}; backward, {back}. "
        + (
            "θ stays, and ψ is the spline's value."
            if off < EVEN
            else f"That is {_degrees(off)} off the border."
        ),
        "",
    ]


CLIP_COLUMNS = (
    "clip",
    "from",
    "frames",
    "position error / H",
    "orientation error, rad",
    "all points met",
    "without limits",
)


def clip_rows(clips: Iterable[ClipRun]) -> list[list[str]]:
    """One row a clip; the columns are ``CLIP_COLUMNS``."""
    return [
        [
            run.clip.title,
            run.source,
            f"{run.frames} at {run.rate:g} Hz",
            f"{run.errors.position:.4f}",
            f"{run.errors.orientation:.4f}",
            f"{100 * run.reached / run.frames:.0f} %",
            f"{100 * run.reached_free / run.frames:.0f} %",
        ]
        for run in clips
    ]


def _clips(study: SikStudy) -> list[str]:
    columns, rows = [*CLIP_COLUMNS], clip_rows(study.clips)
    if study.recorded:
        columns.append("paper, Table 1")
        paper = (run.clip.paper for run in study.clips)
        rows = [[*row, f"{p:.4f} / {o:.4f}"] for row, (p, o) in zip(rows, paper, strict=True)]
    what = (
        "The recordings of the paper, each on its own skeleton."
        if study.recorded
        else "Built-in motions of the kind of the paper's clips; `--data FOLDER` takes its recordings."
    )
    return [
        *_section("Samples of three motions (Figures 10 to 12)"),
        f"{what} From every frame only six positions are taken. At the left of each pair is the "
        "reconstruction, at its right, pale, the original; the dots are the six points. The samples are the "
        "postures of the clip that are most unlike each other, each seen from the left of where the original "
        "faces. Under a pair: the time, and the mean distance of the joints from the original ones. What is "
        "beyond wrists and ankles is not posed: hands and feet keep their neutral rotation.",
        *_table(columns, rows),
        "Errors are those of section 9 of the paper, over all frames. The last columns count frames in which "
        "all six points are met within 1 cm, with joint limits and without.",
        "",
        *(line for run in study.clips for line in _clip(run)),
        *([CREDIT, ""] if study.recorded else []),
    ]


def _clip(run: ClipRun) -> list[str]:
    """A picture, and what is seen in it."""
    worst = int(np.argmax(run.distances))
    weights = ", ".join(f"{w:g}" for w in run.clip.weights)
    missed = (
        f" The point that is missed most often is {run.missed}, in "
        f"{100 * run.missed_frames / run.frames:.0f} % of the frames and by up to "
        f"{100 * run.missed_most:.0f} cm."
        if run.missed
        else ""
    )
    return [
        f"![{run.clip.title}]({run.clip.picture})",
        "",
        f"**{run.clip.title}** ({run.source}), weights of the pelvis' estimate ({weights}) as in the paper. "
        f"Over all frames the joints are {100 * run.errors.distances.mean():.1f} cm off on average; of the "
        f"samples the one at {run.shown[worst] / run.rate:.2f} s is farthest off, "
        f"{100 * run.distances[worst]:.1f} cm.{missed}",
        "",
    ]


def _hierarchy(study: SikStudy) -> list[str]:
    figure = study.figure
    names, places = figure.skeleton.names, figure.rest_positions
    root, head = figure.roles.pelvis, figure.roles.head
    same = [names[j] for j in np.flatnonzero(np.linalg.norm(places - places[root], axis=1) < EXACT)]
    return [
        *_section("The joints of the figure (Figure 13)", "hierarchy.png"),
        f"The built-in figure from the front, and its {len(names)} joints as a tree. Filled are the six "
        f"whose positions are known: {names[root]}, which is the pelvis, {names[head]}, which is the head, "
        f"both wrists and both ankles. At one place are {listed(same)}.",
        "",
    ]
