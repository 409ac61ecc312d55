"""``sixpoint info``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter

from sixpoint.cli.options import Layout, Mapping, Rate, Skeleton, Unit, Up
from sixpoint.cli.screen import Screen

if TYPE_CHECKING:
    from sixpoint.body.figure import Figure
    from sixpoint.body.markers.recording import Markers
    from sixpoint.body.skeleton import Skeleton as Rig
    from sixpoint.jobs.info import MarkersInfo, MotionInfo, TargetsInfo


def info(
    file: Annotated[
        Path,
        Parameter(
            help="A motion or avatar (.bvh, .amc, .asf, .glb, .vrm, .usd ...), six points (.csv, .npz) or "
            "markers (.c3d, .trc, .csv, .npz, .json)."
        ),
    ],
    /,
    *,
    tree: Annotated[bool, Parameter(negative="", help="Show the tree of joints.")] = False,
    skeleton: Skeleton = None,
    mapping: Mapping = None,
    layout: Layout = None,
    unit: Unit = None,
    up: Up = None,
    rate: Rate = None,
) -> None:
    """Say what a file holds: frames, units, joints or markers, and which is which part of the body.

    For example:

    ```
    sixpoint info 17_10.amc
    sixpoint info avatar.vrm --tree
    sixpoint info points.csv
    sixpoint info gait.c3d
    ```
    """
    from sixpoint.jobs.info import MarkersInfo, TargetsInfo, inspect
    from sixpoint.jobs.reading import Reading

    found = inspect(file, reading=Reading(skeleton, unit, up, rate), mapping=mapping, layout=layout)
    screen = Screen()
    if isinstance(found, MarkersInfo):
        _show_markers(screen, found)
        return
    if isinstance(found, TargetsInfo):
        _show_targets(screen, found)
    else:
        _show_motion(screen, found, tree)


def _show_motion(screen: Screen, found: MotionInfo, tree: bool) -> None:
    from sixpoint.cli import describe

    opened = found.opened
    motion, rig = opened.motion, opened.motion.skeleton
    screen.say(f"{found.path}: {_format(found.path)} motion", style="bold")
    dofs = motion.dofs
    declared = f"{dofs.size} rotations declared" if dofs.joints else "not declared"
    screen.rows(
        [
            ("length", describe.describe_length(len(motion), motion.rate)),
            *describe.describe_skeleton_file(opened),
            *describe.describe_space(motion.space),
            ("joints", f"{len(rig)}, and {describe.plural(len(rig.site_names), 'end site')}"),
            ("freedom", f"{declared}; {_describe_moving(motion.moving, rig)}"),
            ("root moves", describe.describe_box(motion.root_positions)),
        ]
    )
    if found.avatar is not None:
        screen.say("avatar", style="bold")
        screen.rows(describe.describe_avatar(found))
    if found.figure is None:
        screen.say("no human figure", style="bold yellow")
        screen.rows([("why", found.problem)])
    else:
        screen.say("human figure", style="bold")
        screen.rows([*describe.describe_figure(found.figure), *_role_rows(found.figure)])
    if tree:
        screen.say("joints", style="bold")
        for line in _tree(rig):
            screen.say(line)


def _format(path: Path) -> str:
    return path.suffix.lower().lstrip(".").upper()


def _describe_moving(moving: tuple[int, ...], rig: Rig) -> str:
    names = [rig.names[j] for j in moving[1:]]
    return "only the root translates" if not names else f"translating besides the root: {' '.join(names)}"


def _role_rows(figure: Figure) -> list[tuple[str, str]]:
    """Left and right joints of a role side by side."""
    r, names = figure.roles, figure.skeleton.names
    rows = [("pelvis", names[r.pelvis])]
    for role in ("clavicle", "shoulder", "elbow", "wrist", "hip", "knee", "ankle"):
        pair = [names[j] for j in getattr(r, role)]
        rows.append((role, f"left {pair[0]}, right {pair[1]}" if pair else "none"))
    return rows


def _tree(rig: Rig) -> list[str]:
    lines: list[str] = []

    def visit(joint: int, depth: int) -> None:
        lines.append(f"  {'  ' * depth}{rig.names[joint]}")
        for child in rig.children[joint]:
            visit(child, depth + 1)

    visit(0, 0)
    return lines


def _show_targets(screen: Screen, found: TargetsInfo) -> None:
    from sixpoint.body.targets import EFFECTORS
    from sixpoint.cli import describe

    targets = found.targets
    screen.say(f"{found.path}: {_format(found.path)} table of six points", style="bold")
    turned = "" if targets.rotations is None else ", with rotations"
    screen.rows([("length", describe.describe_length(len(targets), targets.rate) + turned)])
    rows = []
    for k, name in enumerate(EFFECTORS):
        share = targets.tracked[:, k].mean()
        rows.append([name, f"{100 * share:.1f} %", describe.describe_box(targets.positions[:, k])])
    screen.table(("effector", "tracked", "where"), rows, texts=(0, 2))


def _show_markers(screen: Screen, found: MarkersInfo) -> None:
    from sixpoint.cli import describe
    from sixpoint.errors import listed

    markers, roles = found.markers, found.roles
    screen.say(f"{found.path}: {describe.plural(len(markers.names), 'marker')}", style="bold")
    taken = f"{roles.set_name}, which names {100 * roles.share:.0f} % of the labels"
    rows = [
        ("length", describe.describe_length(len(markers), markers.rate)),
        *describe.describe_space(markers.space),
        ("where", describe.describe_box(markers.positions)),
        ("set", taken if roles.roles else "unknown: give the labels' roles by --layout"),
        ("roles", f"{len(roles.roles)} of {describe.plural(len(markers.names), 'marker')}"),
        ("unknown", listed(roles.unknown, 20) or "none"),
        ("residuals", _describe_residuals(markers)),
        ("events", _describe_events(markers)),
        ("ghosts", _describe_ghosts(found)),
    ]
    screen.rows([("subject", roles.subject), *rows] if roles.subject else rows)
    screen.say("markers, the worst seen first", style="bold")
    table = []
    for k in sorted(range(len(found.gaps)), key=lambda k: (found.gaps[k].seen, -found.gaps[k].longest)):
        gap, name = found.gaps[k], markers.names[k]
        span = f"{gap.first} to {gap.last}" if gap.first >= 0 else "never seen"
        numbers = [f"{100 * gap.seen:.1f} %", str(gap.count), f"{gap.longest / markers.rate:.2f} s", span]
        table.append([name, roles.roles.get(name, ""), roles.segments.get(name, ""), *numbers])
    screen.table(("marker", "role", "segment", "seen", "gaps", "longest", "frames"), table, texts=(0, 1, 2))


def _describe_residuals(markers: Markers) -> str:
    if markers.residuals is None:
        return "none"
    known = markers.residuals[np.isfinite(markers.residuals)]
    return f"mean {1e3 * known.mean():.2f} mm, worst {1e3 * known.max():.2f} mm" if len(known) else "none"


def _describe_events(markers: Markers) -> str:
    from sixpoint.errors import listed

    said = [f"{event.context} {event.label} {event.time:.2f} s".strip() for event in markers.events]
    return listed(said, 12) or "none"


def _describe_ghosts(found: MarkersInfo) -> str:
    from sixpoint.errors import listed

    names = found.markers.names
    said = [f"{names[g.point]} in frames {g.start} to {g.stop - 1} ({g.speed:.0f} m/s)" for g in found.ghosts]
    return listed(said, 8) or "none"
