"""Fit the prior: end to end through closing and forward kinematics, on the errors that are reported.

Every example is drawn anew: mirrored or not, with other lengths, with the rig's root elsewhere about the
hips, and with the frame of reference turned about its Y as a remembered one would be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from sixpoint.study.prior import turns
from sixpoint.study.prior.body import Places, chained, picked, true_places
from sixpoint.study.prior.frames import TRUNK, Frames, Habits, axis_y
from sixpoint.study.prior.network import MASKS, MIRROR, MIRROR_TURN, POINTS, TURNED, Posed, Prior, height

Report = Callable[[int, float, float], None]


@dataclass(frozen=True)
class Recipe:
    """How a prior is fitted.

    Attributes:
        turned: Whether the pelvis' rotation is measured.
        hidden: Width of the network's layers.
        drop: Share of them dropped.
        steps: Steps of Adam.
        batch: Frames in a step.
        rate: Learning rate at the beginning; it falls to zero as a cosine.
        decay: Weight decay.
        yaw: Standard deviation of the turn of the frame of reference [rad].
        lengths: Largest relative change of a length.
        shift: Standard deviation of the root's displacement against the hips [m].
        position: Position error that counts as one.
        orientation: Orientation error that counts as one [rad].
        all_known: Share of examples in which all rotations are measured.
        seed: Of all that is random.
    """

    turned: bool = False
    hidden: int = 64
    drop: float = 0.3
    steps: int = 2000
    batch: int = 768
    rate: float = 3e-3
    decay: float = 1e-3
    yaw: float = 0.25
    lengths: float = 0.2
    shift: float = 0.04
    position: float = 0.018
    orientation: float = 0.24
    all_known: float = 0.6
    seed: int = 0


def mirrored(b: Frames) -> Frames:
    """Left and right exchanged."""
    swap, four = [1, 0], [1, 0, 3, 2]
    return b._replace(
        trunk=b.trunk * MIRROR_TURN,
        head=b.head * MIRROR_TURN,
        clavicles=(b.clavicles * MIRROR_TURN)[:, swap],
        limbs=(b.limbs * MIRROR_TURN)[:, four],
        hinges=(b.hinges * MIRROR_TURN)[:, four],
        ends=(b.ends * MIRROR_TURN)[:, four],
        told=-(b.told * MIRROR),  # it points to the left
        velocity=b.velocity * MIRROR,
        segments=b.segments * MIRROR,
        hips=(b.hips * MIRROR)[:, swap],
        girdle=(b.girdle * MIRROR)[:, swap],
        shoulders=(b.shoulders * MIRROR)[:, swap],
        lengths=b.lengths[:, four],
    )


def resized(b: Frames, most: float, shift: float, random: torch.Generator) -> Frames:
    """Other proportions, and the pelvis joint elsewhere in the pelvis."""

    def factor() -> Tensor:
        return 1.0 + most * (2.0 * torch.rand(b.size, 1, generator=random) - 1.0)

    trunk, neck, arm, forearm, leg, shank, across, wide = (factor() for _ in range(8))
    above = (torch.arange(TRUNK)[None] >= b.chest[:, None]).float()
    segments = b.segments * ((1.0 - above) * trunk + above * neck)[..., None]
    moved = shift * torch.randn(b.size, 3, generator=random) * torch.tensor([0.0, 0.7, 1.0])
    segments = torch.cat([segments[:, :1] - moved[:, None], segments[:, 1:]], 1)
    width = torch.cat([wide, torch.ones_like(wide), torch.ones_like(wide)], 1)
    scales = torch.stack(
        [torch.cat([arm, arm, leg, leg], 1), torch.cat([forearm, forearm, shank, shank], 1)], -1
    )
    return b._replace(
        segments=segments,
        girdle=b.girdle * neck[:, None],
        shoulders=b.shoulders * across[:, None],
        hips=b.hips * width[:, None] - moved[:, None],
        lengths=b.lengths * scales,
    )


def x_axis(q: Tensor) -> Tensor:
    """X axes of rotations."""
    return turns.turn(q, q.new_tensor([1.0, 0.0, 0.0]).expand(len(q), 3))


def frame_about(points: Tensor, x: Tensor, habits: Habits) -> Tensor:
    """Frame of reference: the estimated Y axis, and X as near to a given vector as that allows."""
    y = axis_y(points, habits)
    return turns.from_axes(turns.unit(turns.reject(x, y)), y)


def errors(b: Frames, truth: Places, posed: Posed, known: Tensor) -> tuple[Tensor, Tensor]:
    """Mean joint distance over the height (B,), mean joint angle (B,) [rad], as of ``compute_errors``."""
    count = b.posed.sum(1) + 16.0  # with the head, clavicles, four limbs of three joints, and the sacroiliac
    p = posed.places

    def distance(a: Tensor, c: Tensor) -> Tensor:
        return torch.sqrt(((a - c) ** 2).sum(-1) + 1e-10)

    spine = distance(p.nodes[:, 1:TRUNK], truth.nodes[:, 1:TRUNK]) * b.posed[:, 1:]
    pairs = ((p.clavicles, truth.clavicles), (p.roots, truth.roots), (p.middles, truth.middles))
    total = spine.sum(1) + sum(distance(a, c).sum(1) for a, c in pairs)

    def off(a: Tensor, c: Tensor) -> Tensor:
        return turns.angle(turns.mul(turns.inv(a), c))

    world = chained(b.trunk)
    girdle = turns.mul(picked(world, b.chest)[:, None], b.clavicles)
    carriers = torch.cat([girdle, world[:, :1].expand(-1, 2, -1)], 1)
    rest = turns.mul(turns.inv(b.hinges), b.ends)  # wrists and ankles: neutral where nothing is measured
    met = turns.mul(turns.inv(posed.hinges), b.ends)
    angles = (
        (off(b.trunk, posed.trunk) * b.posed).sum(1)
        + off(b.head, posed.head)
        + turns.angle(b.clavicles).sum(1)
        + off(turns.mul(turns.inv(carriers), b.limbs), turns.mul(turns.inv(posed.carriers), posed.limbs)).sum(
            1
        )
        + off(turns.mul(turns.inv(b.limbs), b.hinges), turns.mul(turns.inv(posed.limbs), posed.hinges)).sum(1)
        + torch.where(known[:, 1:] > 0.0, off(rest, met), turns.angle(rest)).sum(1)
    )
    return total / count / height(b).squeeze(-1), angles / count


def draw_known(count: int, recipe: Recipe, random: torch.Generator) -> Tensor:
    """Which rotations are measured (count, 5): mostly all, else the head, the hands, the feet by chance."""
    if not recipe.turned:
        return torch.zeros(count, MASKS)
    some = (torch.rand(count, 3, generator=random) < 0.5).float()[:, [0, 1, 1, 2, 2]]
    every = (torch.rand(count, 1, generator=random) < recipe.all_known).float()
    return torch.maximum(some, every)


def fit(
    frames: Frames, chances: Tensor, recipe: Recipe, habits: Habits, report: Report | None = None
) -> Prior:
    """Fit a prior.

    Args:
        frames: The examples.
        chances: (B,) how often each is drawn.
        recipe: How.
        habits: Constants of SIK+.
        report: Called every hundred steps with the step, position and orientation error of the batch.
    """
    torch.manual_seed(recipe.seed)
    random = torch.Generator().manual_seed(recipe.seed)
    prior = Prior(recipe.hidden, recipe.drop, recipe.turned)

    def drawn(count: int) -> tuple[Frames, Places, Tensor, Tensor, Tensor]:
        b = frames.at(torch.multinomial(chances, count, replacement=True, generator=random))
        half = count // 2
        b = Frames(
            *(
                torch.cat(pair)
                for pair in zip(mirrored(b.at(slice(half))), b.at(slice(half, None)), strict=True)
            )
        )
        b = resized(b, recipe.lengths, recipe.shift, random)
        truth, points = true_places(b)
        frame = b.trunk[:, 0]
        if not recipe.turned:
            reference = frame_about(points, x_axis(frame), habits)
            yaw = recipe.yaw * torch.randn(count, 1, generator=random)
            frame = turns.mul(reference, turns.exp(yaw * torch.tensor([0.0, 1.0, 0.0])))
        return b, truth, points, frame, draw_known(count, recipe, random)

    with torch.no_grad():
        b, _, points, frame, known = drawn(20000)
        f = prior.features(b, points, frame, known)
        prior.mean.copy_(f.mean(0))
        prior.spread.copy_(f.std(0).clamp(min=0.05))
        prior.mean[POINTS:] = 0.0
        prior.spread[POINTS : POINTS + TURNED] = 0.5
        prior.spread[POINTS + TURNED :] = 1.0
    adam = torch.optim.AdamW(prior.parameters(), lr=recipe.rate, weight_decay=recipe.decay)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(adam, recipe.steps)
    prior.train()
    for step in range(recipe.steps):
        b, truth, points, frame, known = drawn(recipe.batch)
        position, orientation = errors(b, truth, prior(b, points, frame, known), known)
        # Squares, since what is reported is the root of their mean over frames.
        loss = ((position / recipe.position) ** 2 + (orientation / recipe.orientation) ** 2).mean()
        adam.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(prior.parameters(), 1.0)
        adam.step()
        schedule.step()
        if report and (step + 1) % 100 == 0:
            report(step + 1, position.mean().item(), orientation.mean().item())
    return prior.eval()


def chances_of(frames: Frames) -> Tensor:
    """Chance of each frame (B,): a person with more of them is drawn more often, but not in proportion."""
    counts = torch.bincount(frames.person).float()
    return counts[frames.person] ** -0.5


@torch.no_grad()
def follow(prior: Prior, frames: Frames, habits: Habits, known: Tensor, lag: float = 0.0) -> Tensor:
    """Errors (B, 2) of every frame when each clip is posed from its first frame on, the X axis remembered.

    Args:
        prior: What was fitted.
        frames: Clips at 30 Hz.
        habits: Constants of SIK+.
        known: (5,) which rotations are measured, where the prior takes them.
        lag: Time constant of the remembered X axis [s].
    """
    starts = [int((frames.clip == c).nonzero()[0]) for c in torch.unique(frames.clip)]
    counts = torch.tensor([int((frames.clip == c).sum()) for c in torch.unique(frames.clip)])
    first = torch.tensor(starts)
    x = frames.told[first].clone()
    kept = float(torch.exp(torch.tensor(-1.0 / 30.0 / lag))) if lag > 0 else 0.0
    found = torch.zeros(frames.size, 2)
    for f in range(int(counts.max())):
        live = (f < counts).nonzero()[:, 0]
        b = frames.at(first[live] + f)
        truth, points = true_places(b)
        frame = b.trunk[:, 0] if prior.turned else frame_about(points, x[live], habits)
        asked = known.expand(b.size, MASKS)
        posed = prior(b, points, frame, asked, rounds=4)
        found[first[live] + f] = torch.stack(errors(b, truth, posed, asked), 1)
        new = x_axis(posed.trunk[:, 0])
        x[live] = turns.unit(kept * turns.unit(x[live]) + (1.0 - kept) * new)
    return found
