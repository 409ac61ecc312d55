"""The body as a differentiable function: places from rotations, the trunk closed, limbs by a pole."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from sixpoint.study.prior import turns
from sixpoint.study.prior.frames import TRUNK, Frames

DOWN = torch.tensor([0.0, -1.0, 0.0])
STEP = 0.3  # rad, largest turn of a joint in a step of closing
DAMPING = 1e-5  # m^2


@dataclass(frozen=True)
class Places:
    """Where joints are, from the pelvis [m].

    Attributes:
        nodes: (B, 7, 3) trunk joints and the head.
        clavicles: (B, 2, 3) clavicle joints.
        roots: (B, 4, 3) shoulders and hips.
        middles: (B, 4, 3) elbows and knees.
    """

    nodes: Tensor
    clavicles: Tensor
    roots: Tensor
    middles: Tensor


def picked(rows: Tensor, index: Tensor) -> Tensor:
    """One row of each frame: (B, N, C), (B,) -> (B, C)."""
    return torch.gather(rows, 1, index[:, None, None].expand(-1, 1, rows.shape[-1])).squeeze(1)


def chained(local: Tensor) -> Tensor:
    """World rotations (B, 6, 4) of the trunk from local ones."""
    world = [local[:, 0]]
    for k in range(1, TRUNK):
        world.append(turns.mul(world[-1], local[:, k]))
    return torch.stack(world, 1)


def trunk_nodes(b: Frames, world: Tensor) -> Tensor:
    """Places of the trunk joints and the head (B, 7, 3)."""
    steps = turns.turn(world, b.segments)
    return torch.cat([torch.zeros_like(steps[:, :1]), torch.cumsum(steps, 1)], 1)


def place_roots(b: Frames, world: Tensor, nodes: Tensor, clavicles: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Clavicle joints (B, 2, 3), shoulders and hips (B, 4, 3), rotation of what carries each (B, 4, 4)."""
    chest = picked(world, b.chest)[:, None]
    joints = picked(nodes, b.chest)[:, None] + turns.turn(chest, b.girdle)
    girdle = turns.mul(chest, clavicles)
    shoulders = joints + turns.turn(girdle, b.shoulders)
    pelvis = world[:, :1]
    roots = torch.cat([shoulders, turns.turn(pelvis, b.hips)], 1)
    return joints, roots, torch.cat([girdle, pelvis.expand(-1, 2, -1)], 1)


def true_places(b: Frames) -> tuple[Places, Tensor]:
    """Where the recorded joints are, and the six points (B, 6, 3)."""
    world = chained(b.trunk)
    nodes = trunk_nodes(b, world)
    joints, roots, _ = place_roots(b, world, nodes, b.clavicles)
    middles = roots + turns.turn(b.limbs, DOWN * b.lengths[..., :1])
    ends = middles + turns.turn(b.hinges, DOWN * b.lengths[..., 1:])
    points = torch.cat([nodes[:, :1], nodes[:, -1:], ends], 1)
    return Places(nodes, joints, roots, middles), points


def close_trunk(b: Frames, local: Tensor, goal: Tensor, rounds: int) -> Tensor:
    """Turn the spine by the least weighted angles that bring the head to ``goal`` (B, 3), as SIK+ does."""
    eye = torch.eye(3)
    for _ in range(rounds):
        world = chained(local)
        steps = turns.turn(world, b.segments)
        levers = torch.flip(torch.cumsum(torch.flip(steps, [1]), 1), [1])
        w = b.weights[..., None]
        outer = levers[..., :, None] * levers[..., None, :]
        size = turns.dot(levers, levers)[..., None] * eye
        matrix = (w[..., None] * (size - outer)).sum(1) + DAMPING * eye
        force = torch.linalg.solve(matrix, goal - steps.sum(1))
        turned = w * turns.cross(levers, force[:, None].expand_as(levers))
        turned = turned * torch.clamp(STEP / turns.length(turned), max=1.0)
        parents = torch.cat([world[:, :1], world[:, :-1]], 1)
        moved = turns.unit(turns.mul(turns.exp(turns.turn(turns.inv(parents), turned)), local))
        local = torch.cat([local[:, :1], moved[:, 1:]], 1)
    return local


def bend_limb(gap: Tensor, lengths: Tensor, sign: float, pole: Tensor) -> tuple[Tensor, Tensor]:
    """World rotations of root and hinge of a limb with its end at ``gap`` and its middle towards ``pole``."""
    upper, lower = lengths[:, :1], lengths[:, 1:]
    d = turns.length(gap)
    n = gap / d
    reach = torch.minimum(torch.maximum(d, (upper - lower).abs() + 1e-4), upper + lower - 1e-5)
    cosine = ((upper**2 + reach**2 - lower**2) / (2.0 * upper * reach)).clamp(-1 + 1e-7, 1 - 1e-7)
    u = turns.unit(turns.reject(pole, n))
    first = cosine * n + torch.sqrt(1.0 - cosine**2) * u
    second = (reach * n - upper * first) / lower
    x = -sign * turns.cross(n, u)
    return tuple(  # type: ignore[return-value]
        turns.from_axes(turns.unit(turns.reject(x, -bone)), -bone) for bone in (first, turns.unit(second))
    )
