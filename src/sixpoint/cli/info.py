"""``sixpoint info``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from sixpoint.cli.options import Mapping, Rate, Skeleton, Unit, Up
from sixpoint.cli.screen import Screen

if TYPE_CHECKING:
    from sixpoint.body.figure import Figure
    from sixpoint.body.skeleton import Skeleton as Rig
    from sixpoint.jobs.info import MotionInfo, TargetsInfo


def info(
    file: Annotated[
        Path, Parameter(help="A motion (.bvh, .amc, .asf, .glb, .vrm ..) or six points (.csv, .npz).")
    ],
    /,
    *,
    tree: Annotated[bool, Parameter(negative="", help="Show the tree of joints.")] = False,
    skeleton: Skeleton = None,
    mapping: Mapping = None,
    unit: Unit = None,
    up: Up = None,
    rate: Rate = None,
) -> None:
    """Say what a file holds: frames, units, joints, and which joint is which part of the body.

    For example:

    ```
    sixpoint info 17_10.amc
    sixpoint info avatar.vrm --tree
    sixpoint info points.csv
    ```
    """
    from sixpoint.jobs.info import TargetsInfo, inspect
    from sixpoint.jobs.reading import Reading

    found = inspect(file, reading=Reading(skeleton, unit, up, rate), mapping=mapping)
    screen = Screen()
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
            *describe.describe_space(opened),
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
