"""The prior: features of a frame -> where pelvis, spine and head begin, and where elbows and knees point.

A linear map and a small network on the same features, added. The features are seen in a frame of reference
near the pelvis: its remembered X axis with the estimated Y, or its measured rotation. ``sequential_prior``
computes the same in compiled code; ``tests/test_prior.py`` compares the two.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from sixpoint.study.prior import turns
from sixpoint.study.prior.body import (
    Places,
    bend_limb,
    chained,
    close_trunk,
    picked,
    place_roots,
    trunk_nodes,
)
from sixpoint.study.prior.frames import UP, Frames

OUTPUTS = 21  # rotation vectors of the pelvis, five spine joints and the head
POINTS, TURNED, MASKS = 34, 30, 5
LIMB, END = 14, 6
MIRROR = torch.tensor([-1.0, 1.0, 1.0])
MIRROR_TURN = torch.tensor([1.0, -1.0, -1.0, 1.0])
NEUTRAL = torch.tensor([0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
CLIP = 5.0  # standard deviations


@dataclass(frozen=True)
class Posed:
    """What a frame was posed as: places, local rotations of trunk and head, world rotations of the limbs."""

    places: Places
    trunk: Tensor
    head: Tensor
    limbs: Tensor
    hinges: Tensor
    carriers: Tensor


def height(b: Frames) -> Tensor:
    """Height of a figure (B, 1), the unit of the position error [m]."""
    leg = b.lengths[:, 2].sum(-1, keepdim=True) + b.hips[:, 0, 1:2].abs()
    return leg + turns.length(b.segments).squeeze(-1).sum(-1, keepdim=True)


def point_features(b: Frames, points: Tensor, frame: Tensor) -> Tensor:
    """Features (B, 34) of points (B, 6, 3) seen in a frame of reference (B, 4)."""
    back, tall = turns.inv(frame), height(b)
    middle = b.hips.mean(1)
    base = points[:, 0] + turns.turn(frame, middle)
    seen = turns.turn(back[:, None], points[:, 1:] - base[:, None]) / tall[..., None]
    told = turns.turn(back, b.told) / tall
    whole = turns.length(b.segments).squeeze(-1).sum(-1, keepdim=True)
    ratio = (turns.length(points[:, 1] - points[:, 0]) / whole).clamp(max=1.0)
    spread = turns.length(points[:, 2] - points[:, 3]) / tall
    proportions = torch.cat(
        [
            b.lengths[:, 0].sum(-1, keepdim=True),
            b.lengths[:, 2].sum(-1, keepdim=True),
            whole,
            turns.length(b.shoulders[:, 0]),
            (b.hips[:, 0, :1] - b.hips[:, 1, :1]).abs(),
            middle[:, 1:],
        ],
        1,
    )
    return torch.cat(
        [
            seen.flatten(1),
            turns.turn(back, UP.expand(len(points), 3)),
            told / torch.sqrt(1.0 + turns.dot(told, told)),
            turns.turn(back, b.velocity) / tall,
            ratio,
            torch.sqrt(1.0 - ratio**2 + 1e-4),
            spread,
            proportions / tall,
        ],
        1,
    )


def axes_of(q: Tensor) -> Tensor:
    """Y and Z axis of a rotation without those of the neutral pose (..., 6)."""
    y, z = (turns.turn(q, NEUTRAL[k : k + 3].expand(*q.shape[:-1], 3)) for k in (0, 3))
    return torch.cat([y, z], -1) - NEUTRAL


def limb_features(gap: Tensor, reach: Tensor) -> Tensor:
    """Features (B, 14) of the vector from a limb's root to its end, in the frame of chest or pelvis."""
    d = turns.length(gap)
    n, r = gap / d, d / reach
    x, y, z = n[:, :1], n[:, 1:2], n[:, 2:]
    return torch.cat([gap / reach, n, n * n, x * y, y * z, z * x, r, r * r], 1)


class Prior(nn.Module):
    """Start of the trunk, and poles of the limbs.

    Args:
        hidden: Width of the two layers of the small network.
        drop: Share of them that is dropped in training.
        turned: Whether the pelvis' rotation is measured, and those of head, hands and feet may be.
    """

    mean: Tensor
    spread: Tensor

    def __init__(self, hidden: int, drop: float, turned: bool) -> None:
        super().__init__()
        self.turned = turned
        inputs = POINTS + (TURNED + MASKS if turned else 0)
        self.linear = nn.Linear(inputs, OUTPUTS)
        self.hidden1, self.hidden2 = nn.Linear(inputs, hidden), nn.Linear(hidden, hidden)
        self.hidden3 = nn.Linear(hidden, OUTPUTS)
        self.arm, self.leg = (nn.Linear(LIMB + (END if turned else 0), 3) for _ in range(2))
        self.drop = nn.Dropout(drop)
        for layer in (self.linear, self.hidden3, self.arm, self.leg):
            nn.init.zeros_(layer.weight)
            nn.init.zeros_(layer.bias)
        with torch.no_grad():
            self.arm.bias.copy_(torch.tensor([0.05, -1.25, -0.6]))
            self.leg.bias.copy_(torch.tensor([0.0, 0.0, 1.0]))
        self.register_buffer("mean", torch.zeros(inputs))
        self.register_buffer("spread", torch.ones(inputs))

    def features(self, b: Frames, points: Tensor, frame: Tensor, known: Tensor) -> Tensor:
        """Features (B, N); ``known`` (B, 5): whose rotation, of head, wrists and ankles, is measured."""
        f = point_features(b, points, frame)
        if not self.turned:
            return f
        relative = turns.mul(turns.inv(frame)[:, None], measured(b))
        return torch.cat([f, (axes_of(relative) * known[..., None]).flatten(1), known], 1)

    def start(self, features: Tensor) -> Tensor:
        """Rotation vectors (B, 21) from features."""
        z = ((features - self.mean) / self.spread).clamp(-CLIP, CLIP)
        h = self.drop(torch.relu(self.hidden1(z)))
        h = self.drop(torch.relu(self.hidden2(h)))
        return self.linear(z) + self.hidden3(h)  # type: ignore[no-any-return]

    def forward(self, b: Frames, points: Tensor, frame: Tensor, known: Tensor, rounds: int = 2) -> Posed:
        """Pose frames as ``sik-prior`` does without limits.

        Args:
            b: Lengths, and the measured rotations.
            points: (B, 6, 3) the six points, the pelvis at the origin [m].
            frame: (B, 4) frame of reference; the measured rotation of the pelvis where that is known.
            known: (B, 5) which rotations are used.
            rounds: Steps of closing the trunk.
        """
        out = self.start(self.features(b, points, frame, known))
        spine = turns.exp(out[:, 3:].unflatten(1, (6, 3)))
        pelvis = frame if self.turned else turns.mul(frame, turns.exp(out[:, :3]))
        local = torch.cat([pelvis[:, None], spread_over(spine, b.stations)[:, 1:]], 1)
        local = close_trunk(b, local, points[:, 1], rounds)
        world = chained(local)
        nodes = trunk_nodes(b, world)
        still = torch.zeros_like(b.clavicles) + b.clavicles.new_tensor([0.0, 0.0, 0.0, 1.0])
        joints, roots, carriers = place_roots(b, world, nodes, still)
        limbs, hinges = self.pose_limbs(
            b, points, roots, torch.stack([picked(world, b.chest), pelvis], 1), known
        )
        middles = roots + turns.turn(limbs, limbs.new_tensor([0.0, -1.0, 0.0]) * b.lengths[..., :1])
        head = spine[:, 5]
        if self.turned:
            given = turns.mul(turns.inv(world[:, -1]), measured(b)[:, 0])
            head = torch.where(known[:, :1] > 0.0, given, head)
        return Posed(Places(nodes, joints, roots, middles), local, head, limbs, hinges, carriers)

    def pose_limbs(
        self, b: Frames, points: Tensor, roots: Tensor, bases: Tensor, known: Tensor
    ) -> tuple[Tensor, Tensor]:
        """World rotations of limb roots and hinges (B, 4, 4); right limbs are posed as mirrored left ones."""
        found = []
        for k in range(4):
            side = MIRROR if k % 2 else torch.ones(3)
            base, reach = bases[:, k // 2], b.lengths[:, k].sum(-1, keepdim=True)
            gap = points[:, k + 2] - roots[:, k]
            f = limb_features(turns.turn(turns.inv(base), gap) * side, reach)
            if self.turned:
                end = turns.mul(turns.inv(base), b.ends[:, k]) * (MIRROR_TURN if k % 2 else torch.ones(4))
                f = torch.cat([f, axes_of(end) * known[:, k + 1 : k + 2]], 1)
            pole = turns.turn(base, (self.leg if k > 1 else self.arm)(f) * side)
            found.append(bend_limb(gap, b.lengths[:, k], 1.0 if k > 1 else -1.0, pole))
        return torch.stack([a for a, _ in found], 1), torch.stack([a for _, a in found], 1)


def measured(b: Frames) -> Tensor:
    """World rotations (B, 5, 4) of head, wrists and ankles as recorded."""
    world = chained(b.trunk)
    return torch.cat([turns.mul(world[:, -1], b.head)[:, None], b.ends], 1)


def spread_over(spine: Tensor, stations: Tensor) -> Tensor:
    """Local rotations (B, 6, 4) of trunk joints from those at the six stations above the pelvis."""
    course = [torch.zeros_like(spine[:, 0]) + spine.new_tensor([0.0, 0.0, 0.0, 1.0])]
    for k in range(spine.shape[1]):
        course.append(turns.mul(course[-1], spine[:, k]))
    knots = torch.stack(course, 1)
    below = stations.floor().clamp(max=spine.shape[1] - 1).long()
    index = below[..., None].expand(*below.shape, 4)
    a, c = torch.gather(knots, 1, index), torch.gather(knots, 1, index + 1)
    between = turns.mul(a, turns.exp(turns.log(turns.mul(turns.inv(a), c)) * (stations - below)[..., None]))
    return torch.cat([between[:, :1], turns.mul(turns.inv(between[:, :-1]), between[:, 1:])], 1)
