"""The pictures of docs/render.md: the built-in surface in six postures, a result, other bodies.

python benchmarks/render_pictures.py docs/avatars
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import sixpoint as sp
from sixpoint.body.anthropometry import segments_of_stature
from sixpoint.body.surface.flesh import build_shape
from sixpoint.jobs.driving import drive
from sixpoint.render.colours import paint
from sixpoint.render.encoding import encode_png, lay_out
from sixpoint.render.stage import Actor, Stage
from sixpoint.render.surface import Surface

SIZE = (300, 400)
POSTURES = (("boxing", 128), ("jump_kick", 120), ("climb_and_hang", 300), ("reach", 190), ("walk", 104))
VIEWS = ("three-quarter", "side", "three-quarter", "three-quarter", "side")
AROUND = 10  # frames before and after that are in view, too
SMALL, MOMENTS = (240, 320), (80, 239)  # of boxing, on other bodies


def actor_of(figure: sp.Figure, motion: sp.Motion, colours: str = "sides", ghost: bool = False) -> Actor:
    """A body in the built-in surface."""
    shape = build_shape(figure)
    return Actor(figure, motion, Surface(shape, paint(figure, shape, colours)), ghost)


def draw_postures(figure: sp.Figure) -> bytes:
    """Standing, and a frame of each built-in motion."""
    pose = figure.neutral_pose
    standing = sp.Motion(pose.skeleton, pose.rotations[None], pose.translations[None], 60.0, pose.moving)
    pictures = [Stage([actor_of(figure, standing)], SIZE, "front").take(0)]
    for (name, frame), view in zip(POSTURES, VIEWS, strict=True):
        motion = sp.make_sample(name, figure).sliced(slice(frame - AROUND, frame + AROUND))
        pictures.append(Stage([actor_of(figure, motion)], SIZE, view).take(AROUND))
    return encode_png(lay_out(pictures, [""] * len(pictures), len(pictures)))


def draw_result(figure: sp.Figure) -> bytes:
    """The jump kick from its six points, over its truth."""
    truth = sp.make_sample("jump_kick", figure)
    result = sp.SequentialIKPlus(figure).solve_motion(figure.targets(truth))
    stage = Stage([actor_of(figure, result), actor_of(figure, truth, "ghost", True)], SIZE)
    return draw_frames(stage, np.linspace(0, len(truth) - 1, 6).round().astype(int), truth.rate)


def draw_bodies(figure: sp.Figure) -> bytes:
    """The same boxing on a child, on a giant, and on somebody with short legs and broad shoulders."""
    usual = segments_of_stature(1.75)
    stout = {
        name: usual[name] * factor for name, factor in (("calf", 0.8), ("thigh", 0.8), ("torso_width", 1.25))
    }
    bodies = (
        (sp.Figure.from_stature(1.10), "#dcb98c"),
        (sp.Figure.from_stature(2.40), "#7d9cc0"),
        (sp.Figure.from_segments(**stout), "#b97b7b"),
    )
    motion = sp.make_sample("boxing", figure)
    pictures, labels = [], []
    for body, colour in bodies:
        stage = Stage([actor_of(body, drive(body, motion, figure)[1].solution.motion, colour)], SMALL)
        pictures += [stage.take(frame) for frame in MOMENTS]
        labels += [f"{frame / motion.rate:.2f} s" for frame in MOMENTS]
    return encode_png(lay_out(pictures, labels, len(pictures)))


def draw_frames(stage: Stage, frames: np.ndarray, rate: float) -> bytes:
    """A row of frames with their times."""
    labels = [f"{frame / rate:.2f} s" for frame in frames]
    return encode_png(lay_out([stage.take(int(frame)) for frame in frames], labels, len(frames)))


def main(folder: Path) -> None:
    """Draw all."""
    figure = sp.Figure.from_stature(1.75)
    for name, draw in (("mannequin", draw_postures), ("result", draw_result), ("bodies", draw_bodies)):
        (folder / f"{name}.png").write_bytes(draw(figure))


if __name__ == "__main__":
    main(Path(sys.argv[1])) if len(sys.argv) == 2 else sys.exit(__doc__)
