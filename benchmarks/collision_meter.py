"""How deep parts of a body are in each other, measured on its meshes by trimesh."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray
from reaches import is_within
from scipy.spatial.transform import Rotation

import sixpoint as sp

Array = NDArray[np.float64]
Body = tuple[trimesh.Trimesh, Array | None]

NEAR = 0.07  # m, of an elbow joint: vertices of the arm that count as its elbow
LIMBS = ("arm", "hand", "leg")


class Meter:
    """Depth of a part of a figure in others; its shape has named parts.

    Args:
        figure: Whose.
        what: "elbows" in the trunk; "forearms", of what is beyond the elbows, hands included, in trunk and
            head; "arms", elbows and what is beyond them, in the thighs; "thighs" in each other, from a
            quarter of their length on.
    """

    def __init__(self, figure: sp.Figure, what: str = "elbows") -> None:
        shape, roles = figure.shape, figure.roles
        self.figure, self.shape, self.apart = figure, shape, what == "thighs"
        self.bodies, self.points = [], []
        parts = {"elbows": ("trunk",), "forearms": ("trunk", "head")}.get(what, ("l_leg", "r_leg"))
        for part in parts:
            ids, faces = np.unique(shape.triangles[shape.parts[part]], return_inverse=True)
            side = "lr".index(part[0]) if part.endswith("leg") else None
            line = None if side is None else (roles.hip[side], roles.knee[side], roles.ankle[side])
            self.bodies.append((ids, faces.reshape(-1, 3), line))
        positions, world = figure.neutral_pose.compute_transforms()
        vertices = shape.place(positions, world)
        for k, side in enumerate("lr"):
            own = {name: np.unique(shape.triangles[shape.parts[f"{side}_{name}"]]) for name in LIMBS}
            if what == "thighs":
                hip, knee = positions[roles.hip[k]], positions[roles.knee[k]]
                share = (vertices[own["leg"]] - hip) @ (knee - hip) / np.sum((knee - hip) ** 2)
                self.points.append(own["leg"][(share > 0.25) & (share < 1.05)])
                continue
            elbow, wrist = positions[roles.elbow[k]], positions[roles.wrist[k]]
            arm = own["arm"]
            along = (vertices[arm] - elbow) @ (wrist - elbow) / np.linalg.norm(wrist - elbow)
            near = np.linalg.norm(vertices[arm] - elbow, axis=1) < NEAR
            chosen = {"elbows": near, "forearms": along > NEAR}.get(what, near | (along > 0.0))
            hand = own["hand"][:0] if what == "elbows" else own["hand"]
            self.points.append(np.concatenate([arm[chosen], hand]))

    def place_bodies(self, vertices: Array, positions: Array) -> list[Body]:
        """The closed meshes in a frame, and of a leg its hip, knee and ankle."""
        return [
            (
                trimesh.Trimesh(vertices[ids], faces, process=False),
                None if line is None else positions[[*line]],
            )
            for ids, faces, line in self.bodies
        ]

    def find_depth(self, bodies: list[Body], side: int, points: Array) -> float:
        """Depth of the points of a side [m]; a thigh is not in its own leg."""
        others = [body for k, body in enumerate(bodies) if not (self.apart and k == side)]
        return max(depth_in(mesh, points, line) for mesh, line in others)

    def measure(self, motion: sp.Motion, known: tuple[sp.Motion, Array] | None = None) -> Array:
        """Depth (F, 2) of the left and the right side [m], 0 outside.

        Frames posed as in a ``known`` motion are as deep as there.
        """
        positions, world = motion.transforms
        out, frames = np.zeros((len(positions), 2)), np.arange(len(positions))
        if known is not None:
            out[:] = known[1]
            frames = np.flatnonzero((motion.rotations != known[0].rotations).any(axis=(1, 2)))
            out[frames] = 0.0
        for f in frames:
            vertices = self.shape.place(positions[f], world[f])
            bodies = self.place_bodies(vertices, positions[f])
            for side, ids in enumerate(self.points):
                out[f, side] = self.find_depth(bodies, side, vertices[ids])
        return out

    def find_way_out(self, motion: sp.Motion, frame: int, side: int) -> float:
        """The least depth of an arm [m] over all swivel angles within the shoulder's limits, by 5 degrees.

        The wrist stays where it is: the arm turns about the line to it.
        """
        figure, joint = self.figure, self.figure.roles.shoulder[side]
        positions, world = (array[frame] for array in motion.transforms)
        parent = int(figure.skeleton.parents[joint])
        above = Rotation.from_quat(world[parent]) * Rotation.from_quat(figure.neutral[parent]).inv()
        line = positions[figure.roles.wrist[side]] - positions[joint]
        line /= np.linalg.norm(line)
        below = figure.skeleton.subtree(joint)
        vertices = self.shape.place(positions, world)
        bodies = self.place_bodies(vertices, positions)
        least = np.inf
        for angle in np.radians(np.arange(0, 360, 5)):
            turn = Rotation.from_rotvec(angle * line)
            own = turn * Rotation.from_quat(world[joint]) * Rotation.from_quat(figure.neutral[joint]).inv()
            if not is_within(figure.dofs[joint].limit, above.inv() * own) and angle > 0.0:
                continue
            moved, turned = positions.copy(), world.copy()
            moved[below] = positions[joint] + turn.apply(positions[below] - positions[joint])
            turned[below] = (turn * Rotation.from_quat(world[below])).as_quat()
            points = self.shape.place(moved, turned)[self.points[side]]
            least = min(least, self.find_depth(bodies, side, points))
            if least == 0.0:
                break
        return least


def depth_in(mesh: trimesh.Trimesh, points: Array, line: Array | None = None) -> float:
    """How deep the deepest of points is in a closed mesh [m]; 0 outside.

    With a ``line`` (3, 3), a leg's, only points that are nearer to its thigh than to its shank count.
    """
    low, high = mesh.bounds
    if line is not None:
        points = points[find_distance(points, *line[:2]) < find_distance(points, *line[1:])]
    points = points[((points > low) & (points < high)).all(axis=1)]
    inside = points[mesh.contains(points)] if len(points) else points
    return float(trimesh.proximity.closest_point(mesh, inside)[1].max()) if len(inside) else 0.0


def find_distance(points: Array, a: Array, b: Array) -> Array:
    """Distance of points (n, 3) from the line from a to b (n,) [m]."""
    t = np.clip((points - a) @ (b - a) / np.sum((b - a) ** 2), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - a - t[:, None] * (b - a), axis=1))
