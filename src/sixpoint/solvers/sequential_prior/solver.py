"""The solver with a fitted prior, and the numbers of that."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from sixpoint.body.figure import Figure, SpineChain
from sixpoint.body.motion import Motion
from sixpoint.body.targets import Targets
from sixpoint.errors import SixpointError
from sixpoint.solvers.sequential_plus.solver import Habits, SequentialIKPlus
from sixpoint.solvers.sequential_prior.clear import solve_prior_clear
from sixpoint.solvers.sequential_prior.frame import solve_prior
from sixpoint.solvers.sequential_prior.packing import (
    END,
    LAYERS,
    LIMB,
    MASKS,
    OUTPUTS,
    POINTS,
    STATIONS,
    TURNED,
    Facts,
    pack_facts,
    pack_network,
    thought_size,
)
from sixpoint.solvers.six_points.model import build_model
from sixpoint.solvers.six_points.packing import Model
from sixpoint.solvers.six_points.solver import SixPointSolver

Array = NDArray[np.float64]

WITHOUT, WITH = "places", "turns"
"""The two priors of a file: of positions alone, and with the measured rotation of the pelvis."""


class SequentialIKPrior(SequentialIKPlus):
    """SIK+ whose trunk, elbows and knees begin where a small fitted prior says.

    The prior is a linear map and a network of two small layers, some 8,500 numbers. What it says
    is a start: the trunk then closes on the head and the limbs on their points, exactly and within the
    limits, as in SIK+. Where the input is unlike what it was fitted on, SIK+'s own start takes over smoothly.

    Args:
        figure: What to pose.
        limits: Keep every joint within the figure's limits.
        habits: Constants of SIK+: of the frame of reference, and of what is left to SIK+.
        rotations: Effectors whose measured rotations are used, see ``SequentialIKPlus``. The prior that was
            fitted with rotations is used where that of the pelvis is among them.
        avoid: What arms stay out of, see ``SequentialIKPlus``.
        prior: File of a prior of your own (``sixpoint study prior``); the shipped one by default.

    Raises:
        SixpointError: As of ``SequentialIKPlus``, or the file holds no prior.
    """

    fitted_on = (*SequentialIKPlus.fitted_on, "mass")

    takes_start = False

    _entry = staticmethod(solve_prior)
    _entry_clear = staticmethod(solve_prior_clear)

    def __init__(
        self,
        figure: Figure,
        *,
        limits: bool = True,
        habits: Habits | None = None,
        rotations: Sequence[str] = (),
        avoid: Sequence[str] = (),
        prior: Path | str | None = None,
    ) -> None:
        self._networks = read_prior(None if prior is None else Path(prior))
        super().__init__(figure, limits=limits, habits=habits, rotations=rotations, avoid=avoid)

    def _lower(self, model: Model) -> tuple[NDArray[Any] | None, ...]:
        plain = SixPointSolver._lower(self, model)
        return (*plain, pack_facts(self._find_facts(model)), *self._networks, *self._find_flesh())

    def _beside(self, targets: Targets, start: Motion | Array | None = None) -> tuple[Array, ...]:
        if start is not None:
            raise SixpointError("the prior is the start; SequentialIKPlus takes another one")
        return super()._beside(targets)

    def _find_facts(self, model: Model) -> Facts:
        """What the features need of the figure."""
        figure = self.figure
        lengths = np.linalg.norm(model.segments[:, :3], axis=1)
        middle = model.hips[:, :3].mean(axis=0)
        shoulder = np.linalg.norm(model.clavicles[0, :3])
        sizes = [model.limbs[0, :2].sum(), model.limbs[2, :2].sum(), lengths.sum(), shoulder]
        sizes += [abs(model.hips[0, 0] - model.hips[1, 0]), *middle[1:]]
        chain = SpineChain.from_figure(figure, own_pelvis=True)
        return Facts(
            figure.height,
            float(lengths.sum()),
            middle,
            np.array(sizes) / figure.height,
            chain.stations(int(model.chest[0])),
        )

    def _build_model(self) -> Model:
        return build_model(self.figure, SpineChain.from_figure(self.figure, own_pelvis=True), ends=True)

    def _make_work(self) -> tuple[Array, ...]:
        hidden = max(table.shape[0] for table in self._networks) // 2
        return (*super()._make_work(), np.zeros((STATIONS, 4)), np.zeros(thought_size(hidden)))


@lru_cache(maxsize=8)
def read_prior(path: Path | None) -> tuple[Array, Array]:
    """The two networks of a file as tables, see ``packing``; None is the shipped file.

    Raises:
        SixpointError: The file cannot be read or holds something else.
    """
    source = resources.files(__package__).joinpath("data/prior.npz") if path is None else path
    try:
        with source.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return _table(arrays, WITHOUT, POINTS, LIMB), _table(
                arrays, WITH, POINTS + TURNED + MASKS, LIMB + END
            )
    except OSError as error:
        raise SixpointError(f"{source}: the prior cannot be read: {error}") from error
    except (ValueError, KeyError, TypeError, EOFError, BadZipFile) as error:
        raise SixpointError(f"{source} is no prior as `sixpoint study prior` writes it: {error}") from error


def _table(arrays: Any, name: str, inputs: int, limb: int) -> Array:
    layers = {layer: np.asarray(arrays[f"{name}_{layer}"], float) for layer in LAYERS}
    hidden = len(layers["hidden1"])
    shapes = {
        "mean": (inputs,),
        "spread": (inputs,),
        "linear": (OUTPUTS, inputs + 1),
        "hidden1": (hidden, inputs + 1),
        "hidden2": (hidden, hidden + 1),
        "hidden3": (OUTPUTS, hidden + 1),
        "arm": (3, limb + 1),
        "leg": (3, limb + 1),
    }
    for layer, shape in shapes.items():
        if layers[layer].shape != shape or not np.all(np.isfinite(layers[layer])):
            raise ValueError(f"{name}_{layer} must be numbers {shape}, got {layers[layer].shape}")
    if not np.all(layers["spread"] > 0):
        raise ValueError(f"{name}_spread must be positive")
    return np.ascontiguousarray(pack_network(layers))
