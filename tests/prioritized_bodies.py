"""Bodies for the tests of prioritized IK, with forward kinematics that share no code with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import sixpoint as sp
from body_rigs import exercise, random_quaternions, reframed
from independent import world_matrices
from sixpoint.body.masses import rod_masses, segment_masses

X, Y, Z = np.eye(3)
STEP = 1e-5  # of central differences


@dataclass(frozen=True, eq=False)
class State:
    """Anatomical local rotations (J, 4), hinge angles (J, 3) [rad] and the base's position (3,) [m]."""

    local: np.ndarray
    angles: np.ndarray
    base: np.ndarray


@dataclass(frozen=True, eq=False)
class Body:
    """A body to pose, and where its points are by SciPy's matrices."""

    name: str
    model: sp.Figure | sp.Skeleton
    dofs: sp.Dofs

    @property
    def skeleton(self) -> sp.Skeleton:
        """The rig."""
        return self.model.skeleton if isinstance(self.model, sp.Figure) else self.model

    @property
    def base(self) -> int:
        """The joint that translates, or is fixed in the world."""
        return self.model.roles.pelvis if isinstance(self.model, sp.Figure) else 0

    @cached_property
    def columns(self) -> list[tuple[int, int]]:
        """Joint and number within the joint of every coordinate; joint -1 is the base's translation."""
        free = [(-1, k) for k in range(3)] if self.dofs.free_root else []
        return free + [(j, k) for j in sorted(self.dofs.joints) for k in range(self.dofs[j].size)]

    def solver(self, tasks: list, **options: object) -> sp.PrioritizedIK:
        """The solver under test."""
        return sp.PrioritizedIK(self.model, tasks, dofs=self.dofs, **options)

    def joint(self, name: str) -> int:
        """Index of a role or a joint."""
        if isinstance(self.model, sp.Figure) and name in self.model.roles.named():
            return self.model.roles.named()[name]
        return self.skeleton.names.index(name)

    # --- states ----------------------------------------------------------------------------------

    def rest(self) -> State:
        """The neutral pose, as near as limits allow."""
        joints = len(self.skeleton)
        identity = np.tile([0.0, 0.0, 0.0, 1.0], (joints, 1))
        state = State(identity, np.zeros((joints, 3)), np.array([0.0, 1.0, 0.0]))
        if not isinstance(self.model, sp.Figure):
            state = replace(state, base=np.array(self.model.offsets[0]))
        for j, dof in self.dofs.joints.items():
            if isinstance(dof, sp.Hinges):
                state = self.set_angles(state, j, np.clip(0.0, dof.lower, dof.upper))
        return state

    def random(self, rng: np.random.Generator, share: float = 0.7) -> State:
        """A pose within a share of the ranges of motion."""
        state = self.rest()
        if self.dofs.free_root:
            state = replace(state, base=state.base + rng.normal(size=3) * 0.3)
        for j, dof in self.dofs.joints.items():
            if isinstance(dof, sp.Ball):
                state.local[j] = _random_ball(dof, rng, share)
            elif isinstance(dof, sp.Hinges):
                low, high = np.maximum(dof.lower, -1.4), np.minimum(dof.upper, 1.4)
                middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
                state = self.set_angles(state, j, rng.uniform(middle - half, middle + half))
        return state

    def set_angles(self, state: State, joint: int, angles: np.ndarray) -> State:
        """The state with other angles of a hinge joint."""
        local, all_angles = state.local.copy(), state.angles.copy()
        dof = self.dofs[joint]
        all_angles[joint, : dof.size] = angles
        turn = Rotation.identity()
        for axis, angle in zip(dof.axes, np.atleast_1d(angles), strict=True):
            turn = turn * Rotation.from_rotvec(axis * angle)
        local[joint] = turn.as_quat()
        return State(local, all_angles, state.base)

    def moved(self, state: State, change: np.ndarray) -> State:
        """The state after coordinate changes (n,)."""
        local, base = state.local.copy(), state.base.copy()
        state = State(local, state.angles, base)
        for j in {j for (j, _), value in zip(self.columns, change, strict=True) if value}:
            part = np.array([v for (i, _), v in zip(self.columns, change, strict=True) if i == j])
            if j < 0:
                state.base[:] += part
            elif isinstance(self.dofs[j], sp.Ball):
                turn = Rotation.from_rotvec(part) * Rotation.from_quat(state.local[j])
                state.local[j] = turn.as_quat()
            else:
                state = self.set_angles(state, j, state.angles[j, : len(part)] + part)
        return state

    # --- poses -----------------------------------------------------------------------------------

    def motion(self, states: list[State]) -> sp.Motion:
        """States as frames of the rig."""
        local, base = np.stack([s.local for s in states]), np.stack([s.base for s in states])
        if isinstance(self.model, sp.Figure):
            return self.model.compute_motion(local, base, 60.0)
        return sp.Motion(self.model, local, base[:, None], 60.0)

    def pose(self, state: State) -> sp.Pose:
        """A state as a pose of the rig."""
        return self.motion([state]).pose(0)

    def world(self, motion: sp.Motion | sp.Pose | State) -> tuple[np.ndarray, np.ndarray]:
        """Positions (F, J, 3) and anatomical world matrices (F, J, 3, 3); without F of a single pose."""
        if isinstance(motion, State):
            return tuple(a[0] for a in self.world(self.motion([motion])))
        if isinstance(motion, sp.Pose):
            return tuple(a[0] for a in self.world(sp.Motion.from_poses([motion], 60.0)))
        positions, world = world_matrices(motion)
        if isinstance(self.model, sp.Figure):
            neutral = Rotation.from_quat(self.model.neutral).as_matrix()
            world = world @ np.swapaxes(neutral, 1, 2)
        return positions, world

    def locals(self, pose: sp.Pose) -> np.ndarray:
        """(J, 3, 3) anatomical rotation of every joint against its parent."""
        _, world = self.world(pose)
        parents = self.skeleton.parents
        return np.stack([world[j] if p < 0 else world[p].T @ world[j] for j, p in enumerate(parents)])

    def differences(self, state: State, value: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        """(m, n) central differences of ``value``: positions and world matrices -> (F, m)."""
        changes = [sign * STEP * row for row in np.eye(len(self.columns)) for sign in (1, -1)]
        found = value(*self.world(self.motion([self.moved(state, change) for change in changes])))
        return ((found[0::2] - found[1::2]) / (2 * STEP)).T


def _random_ball(dof: sp.Ball, rng: np.random.Generator, share: float) -> np.ndarray:
    if dof.limit is None:
        return Rotation.from_rotvec(rng.normal(size=3) * 0.8 * share).as_quat()
    theta = rng.uniform(-np.pi, np.pi)
    psi = rng.uniform(0.0, share) * float(dof.limit.compute_limit(theta))
    lean = np.cos(theta) * dof.limit.forward + np.sin(theta) * dof.limit.side
    twist = rng.uniform(*(share * dof.limit.twist))
    turn = Rotation.from_rotvec(np.cross(dof.limit.axis, lean) * psi)
    return (turn * Rotation.from_rotvec(dof.limit.axis * twist)).as_quat()


@cache
def figure(stature: float = 1.75) -> Body:
    """The built-in figure with hands and feet that move."""
    model = sp.Figure.from_stature(stature)
    return Body("figure", model, model.full_dofs())


@cache
def rig(seed: int = 0) -> Body:
    """A figure of random proportions whose joint frames are turned at random."""
    rng = np.random.default_rng(seed)
    parts = {"calf": 0.42, "thigh": 0.43, "upper_arm": 0.3, "forearm": 0.26, "torso_length": 0.5}
    model = sp.Figure.from_segments(**{name: size * rng.uniform(0.8, 1.2) for name, size in parts.items()})
    motion = reframed(exercise(model, 60, seed), random_quaternions(rng, len(model.skeleton)))
    model = sp.Figure.from_motion(motion)
    return Body("rig", model, model.dofs)


@cache
def limb(upper: float = 0.3, lower: float = 0.27, low: float = -2.6, high: float = 0.0) -> Body:
    """A two-bone limb hanging from a ball joint in the world; flexion is negative about X."""
    skeleton = sp.Skeleton(
        ("shoulder", "elbow", "hand"), [-1, 0, 1], [[0, 0, 0], [0, -upper, 0], [0, -lower, 0]]
    )
    return Body("limb", skeleton, sp.Dofs({0: sp.Ball(), 1: sp.Hinges(X, low, high)}, free_root=False))


@cache
def snake(links: int = 20) -> Body:
    """Balls in a row, the first one fixed in the world."""
    names = tuple(f"s{k}" for k in range(links + 1))
    offsets = np.tile([0.0, 0.0, 0.1], (links + 1, 1)) * (np.arange(links + 1) > 0)[:, None]
    skeleton = sp.Skeleton(names, np.arange(-1, links), offsets)
    return Body("snake", skeleton, sp.Dofs({k: sp.Ball() for k in range(links)}, free_root=False))


@cache
def robot() -> Body:
    """Seven hinges in sequences of one, two and three, with box limits."""
    names = ("turret", "arm", "wrist", "tool", "tip")
    offsets = [[0, 0.2, 0], [0, 0.3, 0], [0.1, 0.4, 0], [0, 0.35, 0.05], [0, 0.15, 0.1]]
    joints = {
        0: sp.Hinges(Y, -2.5, 2.5),
        1: sp.Hinges([X, Z], [-1.2, -0.7], [1.5, 0.9]),
        2: sp.Hinges(X, -2.2, 0.4),
        3: sp.Hinges([Y, X, Z], [-1.5, -1.0, -1.2], [1.5, 1.1, 1.0]),
    }
    return Body("robot", sp.Skeleton(names, np.arange(-1, 4), offsets), sp.Dofs(joints, free_root=False))


BODIES = [figure, rig, limb, snake, robot]
EFFECTORS = {
    "figure": ("l_wrist", "r_wrist", "head", "l_ankle", "r_ankle"),
    "rig": ("l_wrist", "r_wrist", "head", "l_ankle", "r_ankle"),
    "limb": ("hand", "elbow"),
    "snake": ("s20", "s10", "s15", "s5"),
    "robot": ("tip", "tool", "wrist"),
}


def random_stack(body: Body, state: State, rng: np.random.Generator, count: int, reach: float) -> tuple:
    """Tasks of mixed kinds, weights and levels (with gaps, some shared), and goals about ``reach`` away."""
    positions, world = body.world(state)
    tasks, goals = [], {}
    for k in range(count):
        at = str(rng.choice(EFFECTORS[body.name]))
        joint, name = body.joint(at), f"task {k}"
        own = {"name": name, "level": int(rng.choice([0, 2, 3, 7, 50])), "weight": rng.uniform(0.3, 3.0)}
        axis, away = rng.normal(size=3), rng.normal(size=3) * reach
        kind = rng.integers(4)
        if kind == 0:
            tasks.append(sp.PositionTask(at, offset=tuple(rng.normal(size=3) * 0.1), **own))
            goals[name] = positions[joint] + away
        elif kind == 1:
            turn = Rotation.from_rotvec(away) * Rotation.from_matrix(world[joint])
            tasks.append(sp.OrientationTask(at, **own))
            goals[name] = turn.as_quat()
        elif kind == 2:
            tasks.append(sp.LookAtTask(at, axis=tuple(axis), **own))
            goals[name] = positions[joint] + 2.0 * world[joint] @ axis + away
        else:
            tasks.append(sp.AlignTask(at, axis=tuple(axis), **own))
            goals[name] = world[joint] @ axis + away
    return tasks, goals


def held(step) -> tuple[np.ndarray, np.ndarray]:
    """What joint limits prescribe: their part of the step (n,), and the projector (n, n) onto the rest."""
    free = np.diag(~step.locked * 1.0) - step.directions.T @ step.directions
    return step.step - free @ step.step, free


def textbook_step(step, largest: float = 0.4) -> tuple[np.ndarray, list[np.ndarray]]:
    """Baerlocher and Boulic's recursion by singular values: the step (n,) and each level's part of it."""
    dq, free = held(step)
    parts = []
    for level in range(step.level.max() + 1):
        rows = step.active & (step.level == level)
        jacobian = step.jacobian[rows]
        left = step.wanted[rows] - jacobian @ dq
        u, s, v = np.linalg.svd(jacobian @ free, full_matrices=False)
        rank = np.count_nonzero(s > max(1e-6, 1e-4 * np.linalg.norm(jacobian, axis=1).max(initial=0.0)))
        u, s, v = u[:, :rank], s[:rank], v[:rank]
        wish = np.linalg.norm(left) / largest
        least = s.min(initial=np.inf)
        damping = 0.0 if least >= wish else np.sqrt(least * max(wish - least, 0.0))
        damping = 0.5 * wish if least < 0.5 * wish else damping
        parts.append(v.T @ (s / (s**2 + damping**2) * (u.T @ left)))
        dq = dq + parts[-1]
        free = free - v.T @ v
    return dq, parts


@cache
def crane(low: float = -2.6) -> Body:
    """A limb held out forward by a trunk: a ball at its foot, the limb's root half a metre above."""
    names = ("trunk", "shoulder", "elbow", "hand")
    offsets = [[0, 0, 0], [0, 0.5, 0], [0, 0, 0.3], [0, 0, 0.27]]
    joints = {0: sp.Ball(), 1: sp.Ball(), 2: sp.Hinges(X, low, 0.0)}
    return Body("crane", sp.Skeleton(names, [-1, 0, 1, 2], offsets), sp.Dofs(joints, free_root=False))


@cache
def leg() -> Body:
    """A two-bone limb below a root that moves freely; flexion is positive about X."""
    skeleton = sp.Skeleton(("hip", "knee", "foot"), [-1, 0, 1], [[0, 0.9, 0], [0, -0.42, 0], [0, -0.4, 0]])
    return Body("leg", skeleton, sp.Dofs({0: sp.Ball(), 1: sp.Hinges(X, 0.0, 2.6)}))


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def outside(shape: object, p: np.ndarray) -> np.ndarray:
    """Signed distance of points (F, 3) to a shape in its own frame."""
    match shape:
        case sp.Sphere(radius):
            return np.linalg.norm(p, axis=1) - radius
        case sp.Capsule(radius, length):
            return np.linalg.norm(p - np.clip(p * Y, -0.5 * length, 0.5 * length), axis=1) - radius
        case sp.Box(size):
            past = np.abs(p) - 0.5 * np.array(size)
            return np.linalg.norm(np.maximum(past, 0.0), axis=1) + np.minimum(past.max(axis=1), 0.0)
    return p[:, 1]


SHAPES = [sp.Sphere(0.2), sp.Capsule(0.1, 0.3), sp.Box((0.3, 0.2, 0.4)), sp.HalfSpace()]


def masses_of(body: Body) -> np.ndarray:
    return segment_masses(body.model) if isinstance(body.model, sp.Figure) else rod_masses(body.model)


def mass_centre(body: Body, positions: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Centre of mass (F, 3) by matrices."""
    masses = masses_of(body)
    centres = positions + np.einsum("fjik,jk->fji", world, masses[:, 1:])
    return np.einsum("j,fji->fi", masses[:, 0] / masses[:, 0].sum(), centres)


def support(body: Body, positions: np.ndarray, world: np.ndarray) -> ConvexHull:
    """Hull (x, z) of what is below the ankles and within 5 cm of the lowest of it."""
    skeleton, points = body.skeleton, []
    for ankle in body.model.roles.ankle:
        below = [j for j in skeleton.subtree(ankle) if j != ankle]
        points += [positions[j] for j in below]
        for site, joint in enumerate(skeleton.site_parents):
            if joint == ankle or joint in below:
                neutral = Rotation.from_quat(body.model.neutral[joint]).as_matrix()
                points.append(positions[joint] + world[joint] @ neutral @ skeleton.site_offsets[site])
    points = np.array(points)
    return ConvexHull(points[points[:, 1] <= points[:, 1].min() + 0.05][:, [0, 2]])
