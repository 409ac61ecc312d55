"""Which part of a surface is trunk, arm, hand or leg, as points in the neutral pose; and plain stand-ins.

A vertex belongs to the joint that carries most of it, and with that to the part of the body that the joint,
or the nearest one above it with a role, moves.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.anthropometry import MEAN_STATURE
from sixpoint.body.figure import Figure
from sixpoint.body.stature import stature_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]

SPACING = 0.012  # m, between points of a surface
TRUNK, NECK, HEAD, UPPER, LOWER, HAND, THIGH, SHANK, FOOT = range(9)
SHARE = 0.995  # of the vertices around a bone that its radius encloses

# A trunk without a shape, from the hips (0) over the waist to the shoulders (1): half widths and half depth
# of elliptic cylinders as shares of the stature; at the shoulders about 3/4 of half their width.
HEIGHTS = (0.0, 0.45, 0.8, 1.0)
WIDTHS = (0.09, 0.075, 0.09, 0.09)
DEPTH = 0.06
ELBOW = 0.045  # m, radius of an elbow without a shape, for the mean stature
ARM_RADII = ((UPPER, 0.043), (LOWER, 0.038), (HAND, 0.035))  # m, likewise
THIGH_RADII = (0.092, 0.06)  # at hip and knee, likewise [m]
WRIST, PALM = 0.026, 0.02  # m, radius of a wrist, and half the thickness of a hand, likewise
# Across a hand: how far beyond the wrist, and its edges from the line of the forearm, the thumb's last [m].
HAND_EDGES = ((0.075, -0.03, 0.085), (0.145, -0.012, 0.064))
ENCLOSED = 0.9  # of the vertices of a thigh that its radii enclose
NEAR_HIP = 0.25  # share of a thigh above which another one cannot be kept away: hips stand still
BESIDE = 2e-3  # m, half of the least gap between neutral thighs


def unit_of(figure: Figure) -> float:
    """How many times as tall as the mean a figure is, for which lengths here are given."""
    return stature_of(figure) / MEAN_STATURE


def parts_of_joints(figure: Figure) -> Index:
    """(J,) part of the body that each joint moves, and 16 more on the right side."""
    roles, parents = figure.roles, figure.skeleton.parents
    known = {roles.pelvis: TRUNK}
    below_head = set(figure.skeleton.path(0, roles.head))
    arms = (roles.clavicle or roles.shoulder)[0]
    carrier = max(figure.skeleton.path(0, arms)[:-1], key=lambda j: (j in below_head, j))
    for joint in roles.spine:
        known[joint] = TRUNK if joint <= carrier else NECK
    known[roles.head] = HEAD
    for k in range(2):
        for part, joints in (
            (UPPER, roles.shoulder),
            (LOWER, roles.elbow),
            (HAND, roles.wrist),
            (THIGH, roles.hip),
            (SHANK, roles.knee),
            (FOOT, roles.ankle),
        ):
            known[joints[k]] = part + 16 * k
        for joint in roles.clavicle[k : k + 1]:
            known[joint] = TRUNK
    parts = np.full(len(parents), TRUNK, np.int64)
    for joint, parent in enumerate(parents):
        parts[joint] = known.get(joint, parts[parent] if parent >= 0 else TRUNK)
    return parts


def neutral_surface(figure: Figure) -> tuple[Array, Index]:
    """Vertices (V, 3) of the shape in the neutral pose, the root at the origin [m], and their parts (V,)."""
    shape = figure.shape
    assert shape is not None
    positions, world = figure.neutral_pose.compute_transforms()
    pelvis = figure.roles.pelvis  # a root above it stands still, while a pose may have the pelvis anywhere
    vertices = shape.place(positions, world) - positions[pelvis] + figure.rest_positions[pelvis]
    carrier = shape.joints[np.arange(len(vertices)), shape.weights.argmax(axis=1)]
    return vertices, parts_of_joints(figure)[carrier]


def trunk_points(figure: Figure, head: bool) -> Array:
    """Points (N, 3) all over the surface of the trunk, with or without neck and head [m]."""
    vertices, parts = neutral_surface(figure)
    wanted = np.isin(parts, (TRUNK, NECK, HEAD) if head else (TRUNK,))
    assert figure.shape is not None
    triangles = figure.shape.triangles
    points = spread_points(vertices, triangles[wanted[triangles].all(axis=1)])
    return points if len(points) else bare_trunk(figure, head)


def spread_points(vertices: Array, triangles: Index) -> Array:
    """Points on triangles, near enough to each other to stand for the surface."""
    corners = vertices[triangles]
    if not len(corners):
        return np.zeros((0, 3))
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    counts = np.clip(np.ceil(edges / SPACING), 1, 40).astype(int)
    found = []
    for n in np.unique(counts):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        inside = i + j <= n
        u, v = i[inside] / n, j[inside] / n
        shares = np.column_stack([1.0 - u - v, u, v])
        found.append(np.einsum("sk,tkc->tsc", shares, corners[counts == n]).reshape(-1, 3))
    points = np.concatenate(found)
    _, first = np.unique(np.round(points / (0.5 * SPACING)), axis=0, return_index=True)
    return np.asarray(points[first])


def bare_trunk(figure: Figure, head: bool) -> Array:
    """Points of elliptic cylinders in place of a trunk, and of a ball for a head [m]."""
    roles, rest = figure.roles, figure.rest_positions
    unit, stature = unit_of(figure), stature_of(figure)
    hips, shoulders = rest[list(roles.hip)], rest[list(roles.shoulder)]
    low, high = hips[:, 1].mean() - 0.05 * unit, shoulders[:, 1].mean() + 0.03 * unit
    middle = np.array([hips.mean(axis=0), shoulders.mean(axis=0)])
    angles = np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)
    rings = []
    for y in np.arange(low, high + SPACING, SPACING):
        t = (min(y, high) - low) / (high - low)
        width, depth = np.interp(t, HEIGHTS, WIDTHS) * stature, DEPTH * stature
        centre = middle[0] + t * (middle[1] - middle[0])
        x, z = centre[0] + width * np.cos(angles), centre[2] + depth * np.sin(angles)
        rings.append(np.column_stack([x, np.full_like(x, min(y, high)), z]))
    if head:
        top = rest[roles.head] + figure.head_offset
        rings += [_bare_head(top, unit), _bare_neck(shoulders.mean(axis=0), top, unit)]
    return np.concatenate(rings)


def _bare_head(top: Array, unit: float) -> Array:
    polar, around = np.meshgrid(np.linspace(0, np.pi, 24), np.linspace(0, 2 * np.pi, 48, endpoint=False))
    x, z = np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around)
    ball = np.stack([0.075 * x, 0.11 * np.cos(polar) + 0.06, 0.095 * z + 0.02], axis=-1).reshape(-1, 3)
    return np.asarray(top + unit * ball)


def _bare_neck(low: Array, high: Array, unit: float) -> Array:
    angles, t = np.meshgrid(np.linspace(0, 2 * np.pi, 48, endpoint=False), np.linspace(0, 1, 16))
    line = low + t[..., None] * (high - low)
    ring = 0.058 * unit * np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=-1)
    return np.asarray((line + ring).reshape(-1, 3))


def arm_radius(figure: Figure, reach: float, along: float, half: float, *, forearm: bool) -> float:
    """Radius of the arms' flesh around a bone near a place on it [m], the larger of both sides.

    Args:
        figure: Whose arms.
        reach: How far beyond the elbow flesh may lie that counts [m].
        along: Distance of the place from the elbow [m].
        half: How far to both sides to look [m].
        forearm: On the line from elbow to wrist; else on that from elbow to shoulder.
    """
    roles, unit = figure.roles, unit_of(figure)
    lower = float(np.linalg.norm(figure.offset_between(roles.elbow[0], roles.wrist[0])))
    part = (LOWER if along <= lower else HAND) if forearm else UPPER
    bare = (ELBOW if forearm and along == 0.0 else dict(ARM_RADII)[part]) * unit
    if figure.shape is None:
        return bare
    vertices, parts = neutral_surface(figure)
    widest = 0.0
    for k in range(2):
        elbow = figure.rest_positions[roles.elbow[k]]
        other = figure.rest_positions[(roles.wrist if forearm else roles.shoulder)[k]]
        axis = (other - elbow) / max(float(np.linalg.norm(other - elbow)), 1e-9)
        arm = vertices[np.isin(parts, np.array([UPPER, LOWER, HAND]) + 16 * k)] - elbow
        t = arm @ axis
        near = np.abs(t - along) <= half
        if near.sum() >= 8:
            off = np.linalg.norm(arm[near] - t[near, None] * axis, axis=1)
            widest = max(widest, float(np.quantile(off, SHARE)))
    return widest if 0.0 < widest < 3.0 * bare else bare


def hand_balls(figure: Figure) -> list[tuple[float, float, float]]:
    """Balls of a hand that goes straight on from the forearm: the wrist, then two across palm and fingers.

    Each is how far beyond the wrist and how far beside its line, to the thumb's side, and its radius [m].
    They lie at both edges of the hand's flesh and are as thick as that, the mean of both hands.
    """
    unit, roles = unit_of(figure), figure.roles
    found = [(0.0, 0.0, WRIST * unit)]
    flat = []
    if figure.shape is not None:
        vertices, parts = neutral_surface(figure)
        for k in range(2):
            elbow, wrist = (figure.rest_positions[j[k]] for j in (roles.elbow, roles.wrist))
            hand = vertices[parts == HAND + 16 * k] - wrist
            along = (wrist - elbow) / max(float(np.linalg.norm(wrist - elbow)), 1e-9)
            flat.append(np.column_stack([hand @ along, np.abs(hand[:, 0]), hand[:, 2]]))
    for beyond, low, high in HAND_EDGES:
        edges, radius = np.array([low, high]) * unit, PALM * unit
        near = [f[np.abs(f[:, 0] - beyond * unit) < 0.02 * unit] for f in flat]
        if near and all(len(f) >= 8 for f in near):
            edges = np.mean([[f[:, 2].min(), f[:, 2].max()] for f in near], axis=0)
            radius = float(np.clip(np.mean([f[:, 1].max() for f in near]), 0.5 * radius, 1.5 * radius))
        found += [
            (beyond * unit, float(edges[0]) + radius, radius),
            (beyond * unit, float(edges[1]) - radius, radius),
        ]
    return found


def thigh_radii(figure: Figure) -> tuple[float, float]:
    """Radii of the thighs at hip and knee [m]: a straight course that encloses most of both thighs' flesh.

    Thighs that touch in the neutral pose are narrower here, by half of what they would share a quarter of
    their length below the hips or at the knees: else they could never be beside each other.
    """
    roles, rest, unit = figure.roles, figure.rest_positions, unit_of(figure)
    radii = np.array(THIGH_RADII) * unit
    if figure.shape is not None:
        vertices, parts = neutral_surface(figure)
        places, widths = [], []
        for k in range(2):
            hip, knee = rest[[roles.hip[k], roles.knee[k]]]
            thigh = vertices[np.isin(parts, np.array([THIGH, SHANK]) + 16 * k)] - hip
            share = thigh @ (knee - hip) / max(float((knee - hip) @ (knee - hip)), 1e-12)
            near = (share > 0.1) & (share < 1.05)
            places.append(share[near])
            widths.append(np.linalg.norm(thigh[near] - share[near, None] * (knee - hip), axis=1))
        x, y = np.concatenate(places), np.concatenate(widths)
        if len(x) >= 8 and np.ptp(x) > 0.5:
            slope, start = np.polyfit(x, y, 1)
            start += np.quantile(y - start - slope * x, ENCLOSED)
            found = np.array([start, start + slope])
            if np.all((found > radii / 3.0) & (found < radii * 3.0)):
                radii = found
    room = 0.5 * np.linalg.norm(
        rest[[roles.hip[0], roles.knee[0]]] - rest[[roles.hip[1], roles.knee[1]]], axis=1
    )
    high, low = radii[0] + NEAR_HIP * (radii[1] - radii[0]), radii[1]
    high = min(high, room[0] + NEAR_HIP * (room[1] - room[0]) - BESIDE)
    low = min(low, room[1] - BESIDE)
    return float(high + (high - low) * NEAR_HIP / (1.0 - NEAR_HIP)), float(low)
