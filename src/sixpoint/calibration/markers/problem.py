"""The least-squares problem of calibration: lengths, offsets and poses that explain the markers best.

Each frame has a pose of its own; lengths and offsets are common to all. So the normal equations are an
arrow: poses are eliminated frame by frame, and a small system of the common unknowns remains (Triggs et al.
1999, "Bundle adjustment", section 6). Steps are damped as in Levenberg and Marquardt; residuals of markers
count less the larger they are (Cauchy's weights), so that a swapped or ghost marker does little.

What the movement does not tell is told by priors: proportions of people, places of markers, resting joints.
Frames of one movement share their errors (skin slides with the pose), so all of them together count as
``INDEPENDENT`` against the priors of what is common.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sixpoint.calibration.markers.kinematics import BLOCKS, Kinematics, Placement
from sixpoint.calibration.markers.places import Places

Array = NDArray[np.float64]

INDEPENDENT = 10.0  # frames
OUTLIER = 0.04  # residuals beyond count less and less [m]
LIMIT_STD = np.radians(3.0)  # how softly a hinge stops


@dataclass(eq=False)
class State:
    """What is looked for.

    Attributes:
        lengths: (K,) [m].
        offsets: (M, 3) of the markers from where they are given [m].
        poses: (F, D) see ``Kinematics.place``.
    """

    lengths: Array
    offsets: Array
    poses: Array

    def copy(self) -> State:
        """Another one that may be changed."""
        return State(self.lengths.copy(), self.offsets.copy(), self.poses.copy())


@dataclass(eq=False)
class Problem:
    """What is known.

    Attributes:
        kinematics: The figure.
        places: Markers and where they are expected.
        observed: (F, M, 3) [m], NaN where not seen.
        log_lengths: (K,) expected logarithms of the lengths.
        length_information: (K, K) inverse covariance of these.
        pose_std: (F, D) or (D,) of the coordinates around neutral [m, rad].
        sigma: Standard deviation of a marker around its place [m].
    """

    kinematics: Kinematics
    places: Places
    observed: Array
    log_lengths: Array
    length_information: Array
    pose_std: Array
    sigma: float = 0.01
    _hinges: list[tuple[int, float, float]] = field(init=False)

    def __post_init__(self) -> None:
        starts = self.kinematics.starts
        self._hinges = [
            (int(starts[k]), *np.radians(b.range)) for k, b in enumerate(BLOCKS) if np.isfinite(b.range[0])
        ]
        self.seen = np.isfinite(self.observed[..., 0])
        self.filled = np.where(self.seen[..., None], self.observed, 0.0)

    # --- errors ----------------------------------------------------------------------------------

    def predict(self, state: State) -> tuple[Array, Placement, Array]:
        """Places of the markers (F, M, 3) [m], of the joints, and the carriers' rotations (F, M, 3, 3)."""
        placement = self.kinematics.place(state.lengths, state.poses)
        turned = placement.world[:, self.places.carriers]
        local = state.offsets + self.places.reach @ state.lengths
        marks = placement.positions[:, self.places.carriers] + (turned @ local[..., None])[..., 0]
        return marks, placement, turned

    def residuals(self, state: State) -> Array:
        """(F, M, 3) observed minus predicted [m]; NaN where not seen."""
        return np.asarray(self.observed - self.predict(state)[0])

    def _weights(self, errors: Array) -> Array:
        square = np.sum(errors**2, axis=-1)
        return np.asarray(self.seen / (1.0 + square / OUTLIER**2) / (self.sigma * self.places.skin) ** 2)

    def frame_costs(self, state: State) -> Array:
        """(F,) what each frame's pose is charged."""
        errors = self.filled - self.predict(state)[0]
        square = np.sum(errors**2, axis=-1)
        charged = np.log1p(square / OUTLIER**2) * (OUTLIER / self.sigma / self.places.skin) ** 2
        cost = np.sum(self.seen * charged, axis=1)
        cost += np.sum((state.poses / self.pose_std) ** 2, axis=1)
        for column, low, high in self._hinges:
            over = state.poses[:, column] - np.clip(state.poses[:, column], low, high)
            cost += (over / LIMIT_STD) ** 2
        return np.asarray(cost)

    def _common_cost(self, state: State) -> float:
        off = (state.offsets - self.places.offsets) / self.places.std
        grown = np.log(state.lengths) - self.log_lengths
        return self._share * float(np.sum(off**2) + grown @ self.length_information @ grown)

    @property
    def _share(self) -> float:
        return max(len(self.observed) / INDEPENDENT, 1.0)

    # --- derivatives -----------------------------------------------------------------------------

    def _pose_system(self, state: State) -> tuple[Array, Array, Array, Array, Array, Array, Placement]:
        """Errors (F, M, 3), weights (F, M), weighted J (F, 3M, D), H, g per frame; carriers, joints."""
        kin = self.kinematics
        marks, placement, turned = self.predict(state)
        errors = self.filled - marks
        weights = self._weights(errors)
        _, joint = kin.columns
        arms = marks[:, :, None] - placement.positions[:, None, joint]
        moved = np.cross(placement.axes[:, None], arms) * kin.carried[self.places.carriers][None, :, :, None]
        jacobian = np.swapaxes(moved, 2, 3) @ kin.gather  # (F, M, 3, D)
        jacobian[..., :3] = np.eye(3)
        frames, count = weights.shape
        jacobian = jacobian.reshape(frames, 3 * count, kin.size)
        weighted = jacobian * np.repeat(weights, 3, axis=1)[..., None]
        hessian = np.swapaxes(weighted, 1, 2) @ jacobian
        gradient = (np.swapaxes(weighted, 1, 2) @ errors.reshape(frames, -1, 1))[..., 0]
        self._add_pose_priors(state.poses, hessian, gradient)
        return errors, weights, weighted, hessian, gradient, turned, placement

    def _add_pose_priors(self, poses: Array, hessian: Array, gradient: Array) -> None:
        information = np.broadcast_to(self.pose_std, poses.shape) ** -2
        diagonal = np.arange(poses.shape[1])
        hessian[:, diagonal, diagonal] += information
        gradient -= information * poses
        for column, low, high in self._hinges:
            over = poses[:, column] - np.clip(poses[:, column], low, high)
            hessian[:, column, column] += (over != 0.0) / LIMIT_STD**2
            gradient[:, column] -= over / LIMIT_STD**2

    def pose_step(self, state: State, damping: Array) -> Array:
        """(F, D) step of the poses alone, each frame with its own damping (F,)."""
        _, _, _, hessian, gradient, _, _ = self._pose_system(state)
        return np.asarray(np.linalg.solve(_damped(hessian, damping), gradient[..., None])[..., 0])

    def full_step(self, state: State, damping: float) -> State:
        """The state after a step of everything."""
        kin, places = self.kinematics, self.places
        errors, weights, weighted, hessian, gradient, turned, placement = self._pose_system(state)
        frames, count = weights.shape
        size = len(state.lengths)
        grown = (placement.growth[:, places.carriers] + turned @ places.reach) * state.lengths
        # Common unknowns: logarithms of lengths, then offsets. Rotations keep the offsets' block diagonal.
        flat, spread = grown.reshape(frames, 3 * count, size), np.repeat(weights, 3, axis=1)[..., None]
        back = np.swapaxes(turned, 2, 3)
        cross = np.empty((frames, kin.size, size + 3 * count))
        cross[..., :size] = np.swapaxes(weighted, 1, 2) @ flat
        per_marker = weighted.reshape(frames, count, 3, kin.size)
        cross[..., size:] = (back @ per_marker).reshape(frames, 3 * count, kin.size).swapaxes(1, 2)
        common = np.zeros((size + 3 * count,) * 2)
        common[:size, :size] = np.sum(np.swapaxes(flat * spread, 1, 2) @ flat, axis=0)
        mixed = np.sum(weights[..., None, None] * (back @ grown), axis=0).reshape(3 * count, size)
        common[size:, :size], common[:size, size:] = mixed, mixed.T
        right = np.empty(size + 3 * count)
        right[:size] = np.sum(flat * spread * errors.reshape(frames, -1, 1), axis=(0, 1))
        seen_from = (back @ errors[..., None])[..., 0] * weights[..., None]
        right[size:] = seen_from.sum(axis=0).reshape(-1)
        diagonal = np.arange(size, size + 3 * count)
        common[diagonal, diagonal] += np.repeat(weights.sum(axis=0), 3)
        common[diagonal, diagonal] += self._share * (places.std**-2).reshape(-1)
        right[size:] -= self._share * ((state.offsets - places.offsets) / places.std**2).reshape(-1)
        common[:size, :size] += self._share * self.length_information
        right[:size] -= self._share * self.length_information @ (np.log(state.lengths) - self.log_lengths)
        solved = np.linalg.solve(
            _damped(hessian, np.full(frames, damping)), np.concatenate([cross, gradient[..., None]], axis=2)
        )
        # One product of flat matrices: BLAS threads meet once, not in every frame.
        reduced = cross.reshape(-1, cross.shape[2]).T @ solved.reshape(-1, solved.shape[2])
        common -= reduced[:, :-1]
        right -= reduced[:, -1]
        step = np.linalg.solve(_damped(common[None], np.array([damping]))[0], right)
        poses = state.poses + solved[..., -1] - solved[..., :-1] @ step
        kin.wrap(poses)
        lengths = state.lengths * np.exp(np.clip(step[:size], -0.2, 0.2))
        return State(lengths, state.offsets + step[size:].reshape(-1, 3), poses)

    def cost(self, state: State) -> float:
        """Everything that is charged."""
        return float(self.frame_costs(state).sum()) + self._common_cost(state)


def _damped(matrices: Array, damping: Array) -> Array:
    """Matrices (F, D, D) with their diagonals grown by a share (F,)."""
    out, index = matrices.copy(), np.arange(matrices.shape[1])
    out[:, index, index] *= 1.0 + damping[:, None]
    out[:, index, index] += 1e-9
    return out


def solve_poses(problem: Problem, state: State, steps: int = 25, tolerance: float = 1e-4) -> State:
    """Fit the poses alone, all frames at once; each stops or is damped on its own."""
    state = state.copy()
    damping = np.full(len(state.poses), 1e-2)
    costs = problem.frame_costs(state)
    for _ in range(steps):
        poses = state.poses + problem.pose_step(state, damping)
        problem.kinematics.wrap(poses)
        tried = problem.frame_costs(State(state.lengths, state.offsets, poses))
        better = tried < costs
        state.poses[better] = poses[better]
        settled = np.all(~better | (costs - tried < tolerance * (1.0 + costs)))
        costs = np.where(better, tried, costs)
        damping = np.where(better, damping / 4.0, np.minimum(damping * 8.0, 1e6))
        if settled and np.all(better | (damping > 1e3)):
            break
    return state


def solve_all(problem: Problem, state: State, steps: int = 40, tolerance: float = 1e-5) -> State:
    """Fit lengths, offsets and poses."""
    damping, cost = 1e-3, problem.cost(state)
    for _ in range(steps):
        tried = problem.full_step(state, damping)
        now = problem.cost(tried)
        if now < cost:
            gain, state, cost = cost - now, tried, now
            damping = max(damping / 5.0, 1e-8)
            if gain < tolerance * (1.0 + cost):
                break
        else:
            damping *= 10.0
            if damping > 1e4:
                break
    return state
