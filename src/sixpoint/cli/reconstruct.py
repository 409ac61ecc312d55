"""``sixpoint reconstruct``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from sixpoint.cli.options import Force, Frames, LimitsFile, Mapping, NoLimits, Rate, Unit, Up
from sixpoint.cli.screen import Screen

if TYPE_CHECKING:
    from sixpoint.jobs.reconstruct import Reconstruction


def reconstruct(
    file: Annotated[Path, Parameter(help="A motion (.bvh, .amc) or six points (.csv, .npz).")],
    /,
    *,
    out: Annotated[
        Path | None,
        Parameter(
            name=("--out", "-o"),
            help="A .bvh, an .amc with its .asf, a .glb or a .vrma; by default `<name>_<method>.bvh` in this "
            "folder, of an avatar `<name>_<avatar>.glb`.",
        ),
    ] = None,
    skeleton: Annotated[
        Path | None,
        Parameter(help="For an .amc: its .asf. For six points: the rig to pose (.bvh, .asf, .amc)."),
    ] = None,
    stature: Annotated[
        float | None,
        Parameter(
            help="For six points: stature of the built-in figure [m]; 1.75 by default. With --avatar: of the "
            "person whose points they are, else estimated from them."
        ),
    ] = None,
    avatar: Annotated[
        Path | None,
        Parameter(help="Pose this avatar (.glb, .gltf, .vrm) instead, whatever its proportions."),
    ] = None,
    avatar_mapping: Annotated[
        Path | None, Parameter(help="As --mapping, for the bones of the avatar.")
    ] = None,
    retarget: Annotated[
        Literal["relative", "absolute"],
        Parameter(help="For an avatar: keep the pose, or what hands and feet touch."),
    ] = "relative",
    frames: Frames = None,
    method: Annotated[
        str,
        Parameter(
            help="How to solve: sik+ or sik-prior (world Y must be up), hybrid, sik, tgbsik, kma, ccd, jt, "
            "pinv, dls, dls-svd, sdls, pik, pik-flext; `module:Class` for your own."
        ),
    ] = "sik+",
    weights: Annotated[
        str | None,
        Parameter(
            help="Of sik, tgbsik, kma, ccd and the Jacobian methods: influence of wrists, ankles and the "
            "last frame on the turn of the pelvis: 1,1,0 for boxing and kicks; 0.1,0.1,1 is steadier."
        ),
    ] = None,
    search: Annotated[
        Literal["exact", "literal"] | None, Parameter(help="Of sik: how the bend of the spine is found.")
    ] = None,
    rotations: Annotated[
        str | None,
        Parameter(
            help="Whose rotations are used too, as trackers of six degrees of freedom measure them: `all`, "
            "or some of pelvis,head,l_wrist,r_wrist,l_ankle,r_ankle. With sik+ and sik-prior."
        ),
    ] = None,
    avoid: Annotated[
        str | None,
        Parameter(
            help="Keep apart, of elbows,forearms,thighs,arms: elbows and trunk; forearms with hands "
            "and trunk with head; both thighs; arms and thighs (experimental). With sik, sik+ and sik-prior."
        ),
    ] = None,
    limits: LimitsFile = None,
    no_limits: NoLimits = False,
    mapping: Mapping = None,
    extras: Annotated[
        bool, Parameter(negative="", help="Copy fingers, toes and face from the recording.")
    ] = False,
    picture: Annotated[
        Path | None, Parameter(help="Also draw the result over the recording, to this .png.")
    ] = None,
    unit: Unit = None,
    up: Up = None,
    rate: Rate = None,
    force: Force = False,
) -> None:
    """Pose a whole body from six points, and write it.

    Of a motion the six points are taken, and the result is measured against it. Six points alone are
    posed on the rig of --skeleton, or on the built-in figure; they are in metres and Y up. With --avatar the
    points of either move an avatar, which is written with its meshes and materials.

    For example:

    ```
    sixpoint reconstruct 17_10.amc -o boxing.bvh --picture boxing.png
    sixpoint reconstruct 90_05.bvh --frames 1: --extras
    sixpoint reconstruct kick.bvh --method sik --weights 1,1,0
    sixpoint reconstruct walk.bvh --rotations pelvis,head
    sixpoint reconstruct boxing.bvh --avoid elbows
    sixpoint reconstruct points.csv --stature 1.68
    sixpoint reconstruct points.csv --skeleton avatar.bvh -o avatar_moves.bvh
    sixpoint reconstruct 17_10.amc --avatar robot.glb -o boxing_robot.glb
    sixpoint reconstruct points.csv --avatar miko.vrm -o miko.vrma
    ```
    """
    from sixpoint.jobs.reading import ALL, Reading, parse_frames
    from sixpoint.jobs.reconstruct import Body
    from sixpoint.jobs.reconstruct import reconstruct as run
    from sixpoint.jobs.solving import parse_solving

    solving = parse_solving(method, weights, search, rotations, limits, no_limits, avoid)
    reading = Reading(unit=unit, up=up, rate=rate, frames=ALL if frames is None else parse_frames(frames))
    screen = Screen()
    with screen.progress() as progress:
        done = run(
            file,
            out,
            reading=reading,
            solving=solving,
            body=Body(skeleton, stature, mapping, avatar, avatar_mapping, retarget),
            extras=extras,
            picture=picture,
            force=force,
            progress=progress,
        )
    _show(screen, file, done, stature)


def _show(screen: Screen, file: Path, done: Reconstruction, stature: float | None) -> None:
    from sixpoint.cli import describe
    from sixpoint.jobs.reconstruct import STATURE

    screen.say(f"{file}: {describe.describe_length(len(done.targets), done.targets.rate)}", style="bold")
    if done.avatar is not None:
        described = (
            f"{done.avatar.name}, {done.avatar.kind}, {describe.plural(len(done.figure.skeleton), 'joint')}"
        )
        screen.rows([("avatar", described), *describe.describe_figure(done.figure)])
    elif done.opened is None:
        chosen = "" if stature else "; give your own with --stature or --skeleton"
        screen.rows([("figure", f"built-in, {STATURE if stature is None else stature:g} m tall{chosen}")])
    else:
        joints = describe.plural(len(done.figure.skeleton), "joint")
        screen.rows(
            [
                *describe.describe_skeleton_file(done.opened),
                ("rig", joints if done.errors else f"{joints} of {done.opened.motion.name}"),
                *describe.describe_figure(done.figure),
                *describe.describe_space(done.opened.motion.space),
            ]
        )
    errors = describe.describe_errors(done.errors) if done.errors else []
    screen.say("result", style="bold")
    screen.rows([*errors, *describe.describe_solved(done.solved, done.targets)])
    screen.say(describe.describe_files(done.files), style="green")
