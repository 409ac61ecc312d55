"""A vector and how well it is known, direction by direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Estimate:
    """A vector and how well it is known.

    Attributes:
        offset: (3,) [m].
        information: (3, 3) inverse covariance [1/m^2]; zero where nothing is known.
    """

    offset: Array
    information: Array

    @property
    def std(self) -> float:
        """Largest standard deviation in any direction [m]; infinite where one is unknown."""
        least = float(np.linalg.eigvalsh(self.information)[0])
        return least**-0.5 if least > 1e-3 else float("inf")

    def blurred(self, std: float) -> Estimate:
        """The same with an independent error of a standard deviation in every direction [m]."""
        values, vectors = np.linalg.eigh(self.information)
        values = np.maximum(values, 0.0)
        return Estimate(self.offset, (vectors * (values / (1.0 + values * std**2))) @ vectors.T)

    @classmethod
    def nothing(cls) -> Estimate:
        """No knowledge at all."""
        return cls(np.zeros(3), np.zeros((3, 3)))

    @classmethod
    def fuse(cls, estimates: list[Estimate]) -> Estimate:
        """The weighted mean of estimates, its covariance widened where they contradict each other."""
        total = sum((e.information for e in estimates), np.zeros((3, 3)))
        if not estimates or np.linalg.eigvalsh(total)[-1] <= 0:
            return cls.nothing()
        mean = np.linalg.pinv(total, hermitian=True) @ sum(e.information @ e.offset for e in estimates)
        spread = sum(float((e.offset - mean) @ e.information @ (e.offset - mean)) for e in estimates)
        freedom = 3 * (len(estimates) - 1)
        return cls(mean, total / max(1.0, spread / freedom if freedom else 1.0))
