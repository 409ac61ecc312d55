"""The rows of each kind of task are derivatives, by central differences of independent kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sixpoint as sp
from prioritized_bodies import (
    BODIES,
    EFFECTORS,
    SHAPES,
    Body,
    State,
    figure,
    limb,
    mass_centre,
    outside,
    rig,
    robot,
    snake,
    support,
    unit,
)

RADIAN = 0.2  # metres that a radian counts for in rows
ALL = pytest.mark.parametrize("make", BODIES, ids=lambda make: make.__name__)
SEEDS = pytest.mark.parametrize("seed", range(2))
STANDING = ("pelvis", "l_ankle", "r_ankle")


def rows_of(body: Body, state: State, task: sp.PositionTask, goal: object = None):
    """The linear step of one task alone."""
    goals = {} if goal is None else {task.label: goal}
    return body.solver([task], limits=False).compute_step(goals, start=body.pose(state))


def assert_same_plane(rows: np.ndarray, wanted: np.ndarray, velocity: np.ndarray, error: np.ndarray) -> None:
    """Two rows and their wish are ``velocity`` (3, n) and ``error`` (3,) seen in some basis of a plane."""
    np.testing.assert_allclose(rows.T @ rows, velocity.T @ velocity, atol=1e-6)
    np.testing.assert_allclose(rows.T @ wanted, velocity.T @ error, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(wanted), np.linalg.norm(error), atol=1e-6)


class Marker:
    """A random point fixed to the outermost joint of a body in a random pose."""

    def __init__(self, make, seed: int) -> None:
        self.body, self.rng = make(), np.random.default_rng(seed)
        self.at = EFFECTORS[self.body.name][0]
        self.joint = self.body.joint(self.at)
        self.state = self.body.random(self.rng)
        self.offset = self.rng.normal(size=3) * 0.1
        positions, world = self.body.world(self.state)
        self.place, self.turn = positions[self.joint] + world[self.joint] @ self.offset, world[self.joint]

    def where(self, positions: np.ndarray, world: np.ndarray) -> np.ndarray:
        """The point (F, 3)."""
        return positions[:, self.joint] + world[:, self.joint] @ self.offset

    def task(self, kind: type, **options: object):
        """A task at the point, weighted."""
        return kind(self.at, offset=tuple(self.offset), weight=1.7, **options)


# --- rows are derivatives --------------------------------------------------------------------------


@ALL
@SEEDS
def test_position_rows(make, seed):
    """The rows of a position are the derivative of the point, marker offset included."""
    m = Marker(make, seed)
    step = rows_of(m.body, m.state, m.task(sp.PositionTask), m.place + [0.01, -0.02, 0.005])
    np.testing.assert_allclose(step.jacobian, 1.7 * m.body.differences(m.state, m.where), atol=1e-6)
    np.testing.assert_allclose(step.wanted, 1.7 * np.array([0.01, -0.02, 0.005]), atol=1e-9)


@ALL
@SEEDS
def test_orientation_rows(make, seed):
    """The rows of an orientation are the world angular velocity of the joint."""
    m = Marker(make, seed)
    turn = np.array([0.1, -0.05, 0.2])
    goal = (Rotation.from_rotvec(turn) * Rotation.from_matrix(m.turn)).as_quat()
    step = rows_of(m.body, m.state, m.task(sp.OrientationTask), goal)
    rate = m.body.differences(m.state, lambda p, world: world[:, m.joint].reshape(-1, 9)).reshape(3, 3, -1)
    spin = np.einsum("ikc,jk->ijc", rate, m.turn)
    np.testing.assert_allclose(step.jacobian, 1.7 * RADIAN * spin[[2, 0, 1], [1, 2, 0]], atol=1e-6)
    np.testing.assert_allclose(step.wanted, 1.7 * RADIAN * turn, atol=1e-9)


@ALL
@SEEDS
@pytest.mark.parametrize("kind", [sp.LookAtTask, sp.AlignTask])
def test_direction_rows(make, seed, kind):
    """The rows of gaze and axis are how fast the axis turns across itself, less how fast the goal turns."""
    m = Marker(make, seed)
    axis = unit(m.rng.normal(size=3))
    wanted = unit(m.turn @ axis + 0.05 * m.rng.normal(size=3))
    goal = m.place + 1.5 * wanted if kind is sp.LookAtTask else wanted
    step = rows_of(m.body, m.state, m.task(kind, axis=tuple(axis)), goal)
    along = m.turn @ axis
    turning = m.body.differences(m.state, lambda p, world: world[:, m.joint] @ axis)
    if kind is sp.LookAtTask:
        turning = turning - m.body.differences(m.state, lambda p, world: unit(goal - m.where(p, world)))
    across = np.eye(3) - np.outer(along, along)
    error = np.arccos(along @ wanted) * unit(across @ wanted)
    scale = 1.7 * RADIAN
    assert_same_plane(step.jacobian, step.wanted, scale * across @ turning, scale * error)


@ALL
@SEEDS
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_obstacle_rows(make, seed, shape):
    """The row of an obstacle is the derivative of the distance to it, outside and inside."""
    m = Marker(make, seed)
    turn = Rotation.from_quat(m.rng.normal(size=4))
    for reach in (0.7, 0.12):
        goal = np.concatenate([m.place + reach * unit(m.rng.normal(size=3)), turn.as_quat()])

        def gap(p: np.ndarray, world: np.ndarray, goal=goal) -> np.ndarray:
            return outside(shape, turn.inv().apply(m.where(p, world) - goal[:3]))[:, None]

        step = rows_of(m.body, m.state, m.task(sp.ObstacleTask, shape=shape), goal)
        np.testing.assert_allclose(step.jacobian, 1.7 * m.body.differences(m.state, gap), atol=1e-6)
        depth = -float(gap(*(a[None] for a in m.body.world(m.state)))[0, 0])
        assert step.active[0] == (depth > 0)
        assert depth <= 0 or 0 < step.wanted[0] <= 1.7 * depth + 1e-9
    if isinstance(shape, sp.HalfSpace):
        plane = rows_of(m.body, m.state, m.task(sp.PlaneTask), goal)
        np.testing.assert_allclose(plane.jacobian, step.jacobian, atol=1e-12)


@ALL
@SEEDS
def test_balance_point_rows(make, seed):
    """The rows of a balance above a point are the horizontal derivative of the centre of mass."""
    m = Marker(make, seed)
    step = rows_of(m.body, m.state, sp.BalanceTask(target="point", name="b", weight=1.7), (0.1, 0.0, 0.2))
    rate = m.body.differences(m.state, lambda p, world: mass_centre(m.body, p, world))
    np.testing.assert_allclose(step.jacobian, 1.7 * rate[[0, 2]], atol=1e-6)


@pytest.mark.parametrize("make", [figure, rig], ids=lambda make: make.__name__)
@SEEDS
def test_balance_polygon_row(make, seed):
    """The row of a balance is how fast the centre of mass moves away from the nearest edge."""
    body, rng = make(), np.random.default_rng(seed)
    state = body.moved(body.rest(), 0.03 * rng.normal(size=len(body.columns)))
    positions, world = body.world(state)
    hull = support(body, positions, world)
    centre = mass_centre(body, positions[None], world[None])[0, [0, 2]]
    nearest = hull.equations[np.argmax(hull.equations[:, :2] @ centre + hull.equations[:, 2])]
    step = rows_of(body, state, sp.BalanceTask(weight=1.7))
    rate = body.differences(state, lambda p, world: mass_centre(body, p, world))[[0, 2]]
    np.testing.assert_allclose(step.jacobian[0], -1.7 * nearest[:2] @ rate, atol=1e-6)


COUPLED = [
    (figure, "l_elbow", "r_elbow"),
    (figure, "l_shoulder", "head"),
    (rig, "l_hip", "r_hip"),
    (snake, "s3", "s9"),
    (robot, "turret", "wrist"),
]


@pytest.mark.parametrize(("make", "at", "other"), COUPLED)
@SEEDS
def test_coupling_rows(make, at, other, seed):
    """The rows of a coupling are the derivative of one's coordinates less the ratio of the other's."""
    m = Marker(make, seed)
    one, two = m.body.joint(at), m.body.joint(other)
    parents = m.body.skeleton.parents

    def coordinates(p: np.ndarray, world: np.ndarray) -> np.ndarray:
        found = []
        for j in (one, two):
            above = world[:, parents[j]] if parents[j] >= 0 else np.eye(3)[None]
            local = Rotation.from_matrix(np.swapaxes(above, 1, 2) @ world[:, j])
            dof = m.body.dofs[j]
            found.append(local.as_rotvec() if dof.size == 3 else dof.compute_angles(local.as_quat()))
        return found[0] - 0.6 * found[1]

    step = rows_of(m.body, m.state, sp.CouplingTask(at, other, ratio=0.6, weight=1.7))
    expected = 1.7 * RADIAN * m.body.differences(m.state, coordinates)
    np.testing.assert_allclose(step.jacobian, expected, atol=1e-6)


FLEXED = [
    (figure, "l_wrist", "l_shoulder", "l_elbow"),
    (rig, "r_ankle", "r_hip", "r_knee"),
    (limb, "hand", "shoulder", "elbow"),
    (robot, "tip", "arm", "wrist"),
]


@pytest.mark.parametrize(("make", "at", "root", "middle"), FLEXED)
@SEEDS
def test_flext_rows_across_and_along_the_limb(make, at, root, middle, seed):
    """Below flexion come the end's derivative across the line from the limb's root, then along that line."""
    m = Marker(make, seed)
    m.joint = m.body.joint(at)
    positions, world = m.body.world(m.state)
    place = positions[m.joint] + world[m.joint] @ m.offset
    along = unit(place - positions[m.body.joint(root)])
    goal = place + 2.0 * along + 0.003 * m.rng.normal(size=3)
    task = sp.FlextTask(
        at,
        offset=tuple(m.offset),
        weight=1.7,
        drag=True,
        root=root,
        middle=middle,
        predict=False,
        form="tangent",
    )
    step = rows_of(m.body, m.state, task, goal)
    rate = m.body.differences(m.state, m.where)
    across = np.eye(3) - np.outer(along, along)
    assert list(step.level) == [0, 1, 1, 2] and step.active.all()
    assert np.linalg.norm(step.jacobian[0]) == pytest.approx(1.0, abs=1e-12)
    assert_same_plane(
        step.jacobian[1:3], step.wanted[1:3], 1.7 * across @ rate, 1.7 * across @ (goal - place)
    )
    np.testing.assert_allclose(step.jacobian[3], 1.7 * along @ rate, atol=1e-6)
