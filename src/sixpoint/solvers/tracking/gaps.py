"""Gaps in which no marker tells a joint: from the last pose before to the first one after, joint by joint."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.dofs import Ball
from sixpoint.solvers.prioritized.articulation import Articulation

Array = NDArray[np.float64]
Told = NDArray[np.bool_]

COAST = 0.06  # a joint goes on as it moved for about so long [s]
FASTEST = 4.0  # at no more than this speed [rad/s]
LONG = 2.0  # a longer gap leads by the relaxed posture [s]
SINK = 1.0  # within this time [s]
SAMPLE = 1 / 60  # speeds are differences over about so long [s]


def bridge(body: Articulation, states: Array, told: Told, rest: Array, rate: float) -> Array:
    """Fill in what no marker tells, in joint space: the limb hangs on a trunk that is followed.

    A joint goes on as it moved, ever slower, and over to where it is found again, so that its speed has no
    jump either. The way of a ball is the shorter one between the two, chosen once for the whole gap: it does
    not change sides where they are half a turn apart. Where one end is missing, or far away in time, it goes
    by the relaxed posture.

    Args:
        body: What is posed.
        states: (F, 2 J + 1, 4) states in which joints that are told are right.
        told: (F, J) whether markers on or below a joint are used.
        rest: (2 J + 1, 4) the relaxed posture.
        rate: Frames per second [Hz].

    Returns:
        The states, other where joints are not told that are told in some other frame.
    """
    out, joints = states.copy(), len(body.tree)
    for joint, dof in body.dofs.joints.items():
        if dof.size and told[:, joint].any():
            if isinstance(dof, Ball):
                row, free = joint, joint == body.base
                out[:, row] = _fill_ball(states[:, row], told[:, joint], None if free else rest[row], rate)
            else:
                row, part = joints + 1 + joint, slice(0, dof.size)
                out[:, row, part] = _fill(
                    states[:, row, part], told[:, joint], rest[row, part], rate, FASTEST
                )
    if told[:, body.base].any():
        out[:, joints, :3] = _fill(states[:, joints, :3], told[:, body.base], None, rate, np.inf)
    return out


def _fill_ball(turns: Array, told: Told, rest: Array | None, rate: float) -> Array:
    """Rotations (F, 4): each gap in the rotation vectors about the last one before it, or the first after."""
    out = turns.copy()
    for start, stop in _gaps(told):
        low, high = max(start - _lead(rate) - 1, 0), min(stop + _lead(rate) + 1, len(turns))
        pivot = turns[start - 1 if start else stop]
        part = slice(low, high)
        chart = rot.to_vector(rot.mul(turns[part], rot.inv(pivot)))
        _unwrap(chart, start - low, stop - low)
        middle = None if rest is None else rot.to_vector(rot.mul(rest, rot.inv(pivot)))
        filled = _fill(chart, told[part], middle, rate, FASTEST)
        inside = slice(start - low, stop - low)
        out[start:stop] = rot.mul(rot.from_vector(filled[inside]), pivot)
    return out


def _unwrap(chart: Array, start: int, stop: int) -> None:
    """Rotation vectors after a gap as neighbours of the first one there, in place."""
    for k in range(stop + 1, len(chart)):
        length = np.linalg.norm(chart[k])
        if length > 1e-9:
            other = chart[k] * (1 - 2 * np.pi / length)
            if np.linalg.norm(other - chart[k - 1]) < np.linalg.norm(chart[k] - chart[k - 1]):
                chart[k] = other


def _fill(values: Array, told: Told, rest: Array | None, rate: float, fastest: float) -> Array:
    """Values (F, n) with every gap filled."""
    out, sink = values.copy(), max(round(SINK * rate), 1)
    for start, stop in _gaps(told):
        before = start > 0
        after = stop < len(values)
        first = values[start - 1] if before else None
        last = values[stop] if after else None
        speeds = [_speed(values, told, *end, rate) for end in ((start - 1, -1), (stop, 1))]
        speeds = [v * min(1.0, fastest / max(float(np.linalg.norm(v)), 1e-9)) for v in speeds]
        if first is not None and last is not None and (rest is None or stop - start <= LONG * rate):
            out[start:stop] = _cross(first, last, speeds[0], speeds[1], stop - start, rate)
            continue
        if rest is None:
            out[start:stop] = first if first is not None else last
            continue
        out[start:stop] = rest
        still = np.zeros_like(rest)
        if first is not None:
            count = min(sink, stop - start)
            out[start : start + count] = _cross(first, rest, speeds[0], still, sink, rate)[:count]
        if last is not None:
            count = min(sink, stop - start)
            out[stop - count : stop] = _cross(rest, last, still, speeds[1], sink, rate)[sink - count :]
    return out


def _cross(first: Array, last: Array, speed: Array, end: Array, frames: int, rate: float) -> Array:
    """(frames, n) values strictly between two, which are left and reached at these speeds [1/s]."""
    time = np.arange(1, frames + 1)[:, None] / rate
    whole = (frames + 1) / rate
    x = time / whole
    share = x * x * (3 - 2 * x)
    leaving = first + speed * COAST * (1 - np.exp(-time / COAST))
    coming = last - end * COAST * (1 - np.exp(-(whole - time) / COAST))
    return np.asarray((1 - share) * leaving + share * coming)


def _lead(rate: float) -> int:
    return max(round(SAMPLE * rate), 1)


def _speed(values: Array, told: Told, at: int, step: int, rate: float) -> Array:
    """Rate of change [1/s] at a frame, from it and one away from the gap; zero where that one is not told."""
    other = at + step * _lead(rate)
    if not (0 <= at < len(values) and 0 <= other < len(values) and told[other] and told[at]):
        return np.zeros(values.shape[1])
    return np.asarray((values[other] - values[at]) * (step * rate / _lead(rate)))


def _gaps(told: Told) -> list[tuple[int, int]]:
    """First frame of every gap, and one past its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[1], told.astype(int), [1]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
