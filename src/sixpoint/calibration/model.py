"""What is known of the body beforehand: a figure, the person's own or one by proportion, and how sure it is.

Heights are those of the neutral pose. Of all coordinates of a standing person they are known best, and they
lie along the bones, which is where pivots are weakest.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure
from sixpoint.body.stature import stature_of
from sixpoint.calibration.pivots import Rest
from sixpoint.calibration.standing import Posture

Array = NDArray[np.float64]

ANKLE_HEIGHT = 0.039  # of the stature, over the floor; Drillis & Contini 1966
# Standard deviation of a standing person's heights [m]: of head, wrists, ankles. Ankles are over the floor by
# proportion even where lengths are known: soles differ, and so do the ankles of one and the same rig.
STD_GIVEN = (0.010, 0.020, 0.010)  # lengths known: posture
STD_STATURE = (0.020, 0.040, 0.010)  # by proportion of a known stature
STD_FOUND = (np.inf, np.inf, 0.010)  # by proportion of a stature that the head's own offset goes into


@dataclass(frozen=True, eq=False)
class Body:
    """A figure and how sure it is.

    Attributes:
        figure: The person's own, or the built-in one by proportion.
        stature: [m].
        height_std: (3,) standard deviations of the standing heights of head, wrists and ankles [m].
        leg_std: Of the length of a leg, hip to ankle [m].
        hip_std: Of where the hips are in the pelvis [m].
        neck_std: Of where a neck turns under the head joint [m].
    """

    figure: Figure
    stature: float
    height_std: tuple[float, float, float]
    leg_std: float
    hip_std: float
    neck_std: float

    @classmethod
    def from_figure(cls, figure: Figure) -> Body:
        """A person whose lengths are known."""
        return cls(figure, stature_of(figure), STD_GIVEN, 0.004, 0.004, 0.008)

    @classmethod
    def from_stature(cls, stature: float, found: bool) -> Body:
        """A person of average proportions; ``found`` where the stature comes from this recording."""
        std = STD_FOUND if found else STD_STATURE
        return cls(Figure.from_stature(stature), stature, std, 0.025, 0.008, 0.03)

    def heights(self, posture: Posture) -> Array:
        """(6,) heights of the effectors over the floor, standing [m]."""
        roles, rest = self.figure.roles, self.figure.rest_positions
        head = rest[roles.head] + self.figure.head_offset
        arms = roles.shoulder if posture == "t" else roles.wrist
        height = [rest[roles.pelvis][1], head[1], *rest[list(arms), 1], *rest[list(roles.ankle), 1]]
        return np.asarray(np.array(height) - np.mean(height[4:]) + ANKLE_HEIGHT * self.stature, float)

    @property
    def hips(self) -> Array:
        """(2, 3) from the pelvis joint to the hips in the neutral pose [m]."""
        return np.stack(
            [self.figure.offset_between(self.figure.roles.pelvis, h) for h in self.figure.roles.hip]
        )

    @property
    def legs(self) -> Array:
        """(2,) lengths of the stretched legs, hip to ankle [m]."""
        return self.figure.limb_lengths[2:]

    def rests(self, mounts: Array) -> dict[int, Rest]:
        """How still head, wrists and ankles are held, by effector; the neck turns with the head.

        Args:
            mounts: (6, 3, 3) rotations segment<-tracker; NaN where unknown.
        """
        roles, h = self.figure.roles, self.stature
        carried = [j for j in roles.spine if j in self.figure.skeleton.path(0, roles.shoulder[0])]
        neck = roles.spine[len(carried) :]
        links = [
            (k / len(neck), mounts[1].T @ self.figure.offset_between(a, b))
            for k, (a, b) in enumerate(pairwise(neck), start=1)
            if np.isfinite(mounts[1]).all()
        ]
        arm, leg = Rest(0.154 * h, 0.05, 0.02), Rest(0.49 * h, 0.05, 0.006)
        return {1: Rest(0.29 * h, 0.04, 0.01, tuple(links)), 2: arm, 3: arm, 4: leg, 5: leg}
