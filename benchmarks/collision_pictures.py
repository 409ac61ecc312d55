"""The pictures of docs/collision.md: an outline with an elbow in it, and arms before and after.

Run beside its table:

python benchmarks/collision_pictures.py docs/collision
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
from collision import Meter
from PIL import Image, ImageDraw
from reaches import reach_across

import sixpoint as sp
from sixpoint.body import rotations as rot
from sixpoint.body.surface.flesh import build_shape
from sixpoint.body.surface.prisms import build_prisms, directions
from sixpoint.render.camera import Camera
from sixpoint.render.colours import paint
from sixpoint.render.encoding import encode_png, lay_out
from sixpoint.render.floor import Ground
from sixpoint.render.picture import take_picture
from sixpoint.render.stage import Actor
from sixpoint.render.surface import Surface
from sixpoint.solvers.avoidance.clearance import deepest
from sixpoint.solvers.avoidance.packing import unpack_flesh

mpl.use("Agg")
import matplotlib.pyplot as plt

SHOWN = 0.04  # m, depth of the elbow in the drawing
INK, FLESH, ARM, WRONG, RIGHT = "#33404d", "#c9d1d8", "#e58550", "#b3312c", "#1f7a5c"


def outline(prism, radii, height):
    """Points (32, 2) of a prism's outline at a height, closed."""
    upper = np.clip(np.searchsorted(prism.heights, height), 1, len(prism.heights) - 1)
    t = (height - prism.heights[upper - 1]) / (prism.heights[upper] - prism.heights[upper - 1])
    size = radii[upper - 1] + t * (radii[upper] - radii[upper - 1])
    ring = prism.centre + size[:, None] * directions()
    return np.vstack([ring, ring[:1]])


def shrink(ring, by):
    """A closed outline (n, 2), moved inward: the trunk as the elbow's ball feels it."""
    along = np.roll(ring[:-1], -1, axis=0) - np.roll(ring[:-1], 1, axis=0)
    across = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    outward = np.sign(np.sum(across * (ring[:-1] - ring[:-1].mean(axis=0)), axis=1))
    moved = ring[:-1] - by * outward[:, None] * across
    return np.vstack([moved, moved[:1]])


def find_deepest(figure, motion, frame, side):
    """Depth of an elbow [m], the centre of its deepest ball, and where that should be."""
    solver = sp.SequentialIK(figure, avoid="elbows")
    flesh = unpack_flesh(solver._arrays[-2], None, None, None)  # the trunk; the last array is of the thighs
    chain, roles = figure.spine_chain, figure.roles
    positions, world = (array[frame] for array in motion.transforms)
    turned = rot.mul(world, rot.inv(figure.neutral))
    joints = [*chain.joints, roles.head]
    segs = np.pad(np.diff(positions[joints], axis=0), ((0, 0), (0, 1)))
    arm = [tuple(positions[getattr(roles, n)[side]]) for n in ("shoulder", "elbow", "wrist")]
    return deepest(flesh, tuple(positions[joints[0]]), turned[list(chain.joints)], segs, *arm)


def mark_depth(picture, camera, ends):
    """Draw into a picture (H, W, 3) the way from an elbow's deepest point to the trunk's outline."""
    shown = Image.fromarray(picture)
    pen, (a, b) = ImageDraw.Draw(shown), [tuple(p) for p in camera.project(np.array(ends))]
    for colour, width, size in (("#ffffff", 8, 8), (WRONG, 4, 6)):
        pen.line([a, b], fill=colour, width=width)
        for x, y in (a, b):
            pen.ellipse([x - size, y - size, x + size, y + size], fill=colour)
    return np.asarray(shown)


def draw_depth(figure, motion, cleared, frame, side, path):
    """The trunk's outline at the height of an elbow that is in it, and where the elbow goes."""
    prisms, roles = build_prisms(figure), figure.roles
    positions, world = (array[frame] for array in motion.transforms)
    turned = rot.mul(world, rot.inv(figure.neutral))
    arm = [tuple(positions[getattr(roles, n)[side]]) for n in ("shoulder", "elbow", "wrist")]
    depth, p_e, p_t = find_deepest(figure, motion, frame, side)
    after = cleared.positions[frame, roles.elbow[side]]
    # The prism in which the elbow is deepest: the way out is across its Y axis and ends on its grown outline.
    found = []
    for prism in prisms.prisms:
        turn = rot.inv(turned[prism.joint])
        local, way = rot.mul_vec(turn, np.array(p_e) - positions[prism.joint]), np.subtract(p_t, p_e)
        if prism.heights[0] <= local[1] <= prism.heights[-1]:
            across = abs(rot.mul_vec(turn, way)[1]) / np.linalg.norm(way)
            ring = outline(prism, prism.grown, local[1])
            end = (local + rot.mul_vec(turn, way))[[0, 2]]
            found.append((across + np.linalg.norm(ring - end, axis=1).min(), prism, local))
    _, prism, local = min(found, key=lambda item: item[0])

    def seen(point):
        return rot.mul_vec(rot.inv(turned[prism.joint]), np.array(point) - positions[prism.joint])[[0, 2]]

    figure_, axes = plt.subplots(figsize=(7.2, 5.4))
    grown = outline(prism, prism.grown, local[1])
    flat = shrink(grown, prisms.radius)
    axes.fill(*flat.T, color=FLESH, zorder=1)
    axes.plot(*flat.T, color=INK, lw=1.4, zorder=2)
    axes.plot(*grown.T, color=INK, lw=1, ls=(0, (4, 3)), zorder=2)
    centre, target, cleared_at = seen(p_e), seen(p_t), seen(after)
    out = (target - centre) / np.linalg.norm(target - centre)
    for place, colour, style in ((centre, WRONG, "-"), (cleared_at, RIGHT, "-")):
        ball = plt.Circle(place, prisms.radius, fc=colour, ec=colour, alpha=0.25, lw=1.2, ls=style, zorder=3)
        axes.add_patch(ball)
        axes.plot(*place, "o", color=colour, ms=4, zorder=5)
    shoulder, wrist = seen(arm[0]), seen(arm[2])
    for elbow, colour in ((centre, WRONG), (cleared_at, RIGHT)):
        axes.plot(*np.array([shoulder, elbow, wrist]).T, color=colour, lw=1.6, alpha=0.55, zorder=4)
    axes.plot(*np.array([shoulder, wrist]).T, "s", color=INK, ms=5, zorder=6)
    e = centre - prisms.radius * out
    t = e + depth * out
    axes.annotate(
        "",
        t,
        e,
        arrowprops={"arrowstyle": "<->", "color": INK, "lw": 1.3, "shrinkA": 0, "shrinkB": 0},
        zorder=7,
    )
    beside = np.array([-out[1], out[0]])
    words = (
        (e, "$p_e$", -0.014 * out),
        (t, "$p_t$", 0.015 * out),
        (0.5 * (e + t), f"depth {1e3 * depth:.0f} mm", 0.042 * beside * np.sign(beside[0] + 1e-9)),
        (shoulder, "shoulder", np.array([0.0, 0.014])),
        (wrist, "wrist", np.array([0.0, 0.014])),
        (prism.centre, "trunk", np.array([0.04, -0.03])),
    )
    for place, word, shift in words:
        box = {"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.6}
        x, y = place + shift
        axes.text(x, y, word, ha="center", va="center", color=INK, fontsize=10, bbox=box, zorder=8)
    axes.set(aspect="equal", xlabel="X of the joint, to the left [m]", ylabel="Z of the joint, forward [m]")
    axes.invert_xaxis()
    axes.spines[["top", "right"]].set_visible(False)
    axes.plot([], [], color=WRONG, lw=2, label="elbow without avoidance")
    axes.plot([], [], color=RIGHT, lw=2, label="with, its swivel turned")
    axes.plot([], [], color=INK, ls=(0, (4, 3)), lw=1, label="where the elbow's middle touches")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=3, frameon=False, fontsize=9)
    figure_.tight_layout()
    figure_.savefig(path, dpi=130)
    plt.close(figure_)


def draw_pair(figure, motions, frame, side, yaw):
    """A frame without and with avoidance, as bodies; the depth is drawn over the first."""
    surface = Surface(figure.shape, paint(figure, figure.shape))
    actors = [Actor(figure, motion, surface) for motion in motions]
    bodies = [actor.place(frame) for actor in actors]
    points = np.concatenate([body.vertices for body in bodies])
    points = points[points[:, 1] > points[:, 1].max() - 1.0]
    camera = Camera.framing(points, yaw, np.radians(10.0), (480, 560))
    ground = Ground.seen(camera, float(bodies[0].vertices[:, 1].min()), points.mean(axis=0))
    before, after = (take_picture([body], camera, ground) for body in bodies)
    depth, p_e, p_t = find_deepest(figure, motions[0], frame, side)
    out = np.subtract(p_t, p_e) / np.linalg.norm(np.subtract(p_t, p_e))
    deep = np.array(p_e) - build_prisms(figure).radius * out
    return [mark_depth(before, camera, [deep, deep + depth * out]), after]


def main() -> None:
    """Draw them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    plain = sp.Figure.from_stature(1.75)
    figure = plain.with_shape(build_shape(plain))
    meter, pictures, labels = Meter(figure), [], []
    for method in ("sik", "sik+"):
        targets = reach_across(figure, 2, 300)
        motions = [sp.make_solver(method, figure, avoid=a).solve_motion(targets) for a in ((), "elbows")]
        depths = [meter.measure(motion) for motion in motions]
        both = np.where(depths[1] < 1e-3, depths[0], 0.0)
        frame, side = np.unravel_index(both.argmax(), both.shape)
        print(method, "frame", frame, "side", side, "depth", depths[0][frame, side], depths[1][frame, side])
        yaw = 0.6 if side == 0 else -0.6
        pictures += draw_pair(figure, motions, frame, int(side), yaw)
        labels += [f"{method}: {1e3 * depths[0][frame, side]:.0f} mm deep", f'{method}, avoid="elbows"']
        if method == "sik":
            frame, side = np.unravel_index(np.abs(both - SHOWN).argmin(), both.shape)
            draw_depth(figure, *motions, frame, int(side), folder / "depth.png")
    (folder / "before_after.png").write_bytes(encode_png(lay_out(pictures, labels, 4)))


if __name__ == "__main__":
    main()
