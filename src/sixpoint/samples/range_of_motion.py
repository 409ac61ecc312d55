"""The movement that calibration asks of a person, as an honest person would do it: not exactly.

Stand still; circle both hands, elbows at the waist, and turn the head; lift each straight leg outwards and
circle its foot; bow and sway on straight legs. Forearms, shanks and chest are meant to be still meanwhile.
They are not: they give way by a share of what hands, feet and head do, and wander. Joint angles are
authored, so the truth is known.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body import rotations as rot
from sixpoint.body.figure import Figure
from sixpoint.body.motion import Motion
from sixpoint.samples.keyframes import smooth_step

Array = NDArray[np.float64]

X, Y, Z = np.eye(3)
STAND, HANDS, LEG, BOW = 1.5, 4.0, 2.8, 2.2  # how long each part lasts [s]
DURATION = STAND + HANDS + 2 * LEG + BOW


def range_of_motion(figure: Figure, seed: int = 0, *, sloppy: float = 0.05, rate: float = 90.0) -> Motion:
    """Thirteen seconds of calibration movement in front of +Z.

    Args:
        figure: Whom to move.
        seed: Of speeds, widths and of how the body gives way; the same seed gives the same movement.
        sloppy: Typical share of a hand's, foot's or head's rotation that forearm, leg or chest make with
            it, and of 20 degrees by which they wander besides.
        rate: Frames per second [Hz].
    """
    rng = np.random.default_rng(seed)
    t = np.arange(round(DURATION * rate)) / rate
    roles = figure.roles
    turned = np.tile(rot.IDENTITY, (len(t), len(figure.skeleton), 1))
    start = STAND + np.cumsum([0.0, HANDS, LEG, LEG])
    _bow(figure, turned, _bump(t, start[3], BOW), t, rng)
    hands = _bump(t, start[0], HANDS)
    for side, sign in enumerate((1.0, -1.0)):
        circles = _circles(t, hands, (45.0, 22.0, 48.0), rng)
        give = sloppy * (_give(circles, rng) + _wander(t, rng))
        elbow = np.radians(80.0) * hands + give[:, 0]
        turned[:, roles.wrist[side]] = rot.from_euler("YXZ", circles)
        turned[:, roles.elbow[side]] = rot.from_axis_angle(X, -elbow)
        turned[:, roles.shoulder[side]] = rot.from_euler(
            "ZXY", 0.3 * give[:, [2, 0, 1]] + np.radians([8.0 * sign, 0.0, 0.0]) * hands[:, None]
        )
    _turn_head(figure, turned, _circles(t, hands, (40.0, 25.0, 18.0), rng), sloppy, t, rng)
    lifted = [_bump(t, start[1 + side], LEG) for side in (0, 1)]
    for side, sign in enumerate((1.0, -1.0)):
        circles = _circles(t, lifted[side], (15.0, 32.0, 22.0), rng)
        give = sloppy * (_give(circles, rng) + _wander(t, rng))
        flexion, away = np.radians(rng.uniform([10.0, 25.0], [22.0, 34.0]))
        bend = np.radians(
            rng.uniform(1.0, 7.0) + rng.uniform(0.0, 1.0) * np.sin(2.5 * t + rng.uniform(0, 6.3))
        )
        swing = np.outer(lifted[side], [sign * away, -flexion, 0.0])
        swing[:, :2] += give[:, [2, 0]] * (lifted[0] + lifted[1])[:, None]
        swing[:, 1] -= 0.5 * bend  # the ankle stays below the hip
        hip = roles.hip[side]
        turned[:, hip] = rot.mul(turned[:, hip], rot.from_euler("ZXY", swing))
        turned[:, roles.knee[side]] = rot.from_axis_angle(X, bend)
        turned[:, roles.ankle[side]] = rot.from_euler("YXZ", circles)
    return _planted(figure, turned, lifted, rate)


def _bump(t: Array, start: float, duration: float, ease: float = 0.35) -> Array:
    """0 outside, 1 inside of a part of the movement (F,), eased."""
    return smooth_step((t - start) / ease) * smooth_step((start + duration - t) / ease)


def _circles(t: Array, during: Array, widths: tuple[float, float, float], rng: np.random.Generator) -> Array:
    """Angles (F, 3) about Y, X and Z [rad] of circles with changing axes; amplitudes in degrees."""
    speed = rng.uniform(0.85, 1.15) * np.array([0.7, 1.0, rng.uniform(0.95, 1.05)])
    phase = (
        0.0 if not during.any() else -2 * np.pi * speed * t[np.argmax(during > 0)] + rng.uniform(0, 2 * np.pi)
    )
    lag = np.array([rng.uniform(0, 2 * np.pi), 0.0, np.pi / 2])
    waves = np.sin(2 * np.pi * speed * t[:, None] + phase + lag)
    return np.asarray(np.radians(widths) * rng.uniform(0.9, 1.1, 3) * waves * during[:, None])


def _give(circles: Array, rng: np.random.Generator) -> Array:
    """What the next segment inwards makes of it (F, 3), about X, Y and Z [rad]: any share, any sign."""
    return np.asarray(circles[:, [1, 0, 2]] * rng.normal(size=3), float)


def _wander(t: Array, rng: np.random.Generator) -> Array:
    """Slow independent movement (F, 3) [rad] of 20 degrees, to be scaled; none while standing still."""
    waves = np.sin(2 * np.pi * rng.uniform(0.2, 0.6, 3) * t[:, None] + rng.uniform(0, 2 * np.pi, 3))
    return np.asarray(np.radians(20.0) * waves * smooth_step((t - STAND) / 0.5)[:, None])


def _bow(figure: Figure, turned: Array, during: Array, t: Array, rng: np.random.Generator) -> None:
    """Bow from the hips and sway sideways; the legs stay parallel."""
    wave = 0.5 - 0.5 * np.cos(2 * np.pi * np.cumsum(during) / max(during.sum(), 1e-9))
    tilt = np.radians(rng.uniform(40.0, 50.0)) * wave
    lean = np.radians(8.0) * np.sin(2 * np.pi * 0.8 * t) * during
    turned[:, figure.roles.pelvis] = rot.from_axis_angle(X, tilt)
    for hip in figure.roles.hip:
        turned[:, hip] = rot.mul(rot.from_axis_angle(X, -tilt), rot.from_axis_angle(Z, lean))


def _turn_head(
    figure: Figure, turned: Array, circles: Array, sloppy: float, t: Array, rng: np.random.Generator
) -> None:
    """Spread the head's turn over the neck, in shares that vary from person to person."""
    spine, shoulder = figure.roles.spine, figure.roles.shoulder[0]
    carried = [j for j in spine if j in figure.skeleton.path(0, shoulder)]
    neck = spine[len(carried) :]
    shares = rng.uniform(0.8, 1.2, len(neck))
    whole = rot.unit(vector := _log(rot.from_euler("YXZ", circles))), np.linalg.norm(vector, axis=1)
    for joint, share in zip(neck, shares / max(shares.sum(), 1e-9), strict=True):
        turned[:, joint] = rot.from_axis_angle(whole[0], share * whole[1])
    give = sloppy * (_give(circles, rng) + _wander(t, rng))
    turned[:, spine[0]] = rot.from_euler("XYZ", 0.5 * give)


def _log(q: Array) -> Array:
    """Rotation vectors (F, 3) [rad] of unit quaternions with positive real part."""
    q = q * np.where(q[:, 3:] < 0, -1.0, 1.0)
    return np.asarray(rot.unit(q[:, :3]) * rot.angle(q)[:, None], float)


def _planted(figure: Figure, turned: Array, lifted: list[Array], rate: float) -> Motion:
    """Level the standing feet and put the pelvis where they stay."""
    roles, pelvis = figure.roles, figure.roles.pelvis
    place = np.zeros((len(turned), 3))
    weights = [1.0 - up for up in lifted]
    standing = figure.rest_positions - figure.rest_positions[pelvis]
    for side in (0, 1):
        at, world = np.zeros((len(turned), 3)), turned[:, pelvis]
        for joint in figure.skeleton.path(pelvis, roles.ankle[side])[1:]:
            at = at + rot.mul_vec(world, figure.offsets[joint])
            if joint == roles.ankle[side]:
                turned[:, joint] = rot.mul(
                    rot.inv(world) if not lifted[side].any() else _level(world, lifted[side]),
                    turned[:, joint],
                )
            world = rot.mul(world, turned[:, joint])
        weight = (weights[side] / (weights[0] + weights[1]))[:, None]
        place += weight * (standing[roles.ankle[side]] - at)
    place[:, 1] -= standing[list(roles.ankle), 1].min() - 0.07
    return figure.compute_motion(turned, place, rate, name="range_of_motion")


def _level(shank: Array, lifted: Array) -> Array:
    """Ankle rotation (F, 4) that levels a standing foot and leaves a lifted one to its shank."""
    vector = _log(rot.inv(shank))
    size = np.linalg.norm(vector, axis=1)
    return rot.from_axis_angle(rot.unit(vector), size * (1.0 - lifted))
