"""A fitted prior as arrays for compiled inference."""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from sixpoint.study.prior.network import Prior

LAYERS = ("linear", "hidden1", "hidden2", "hidden3", "arm", "leg")


def to_arrays(prior: Prior, name: str) -> dict[str, NDArray[np.float16] | NDArray[np.float32]]:
    """Arrays by name: ``<name>_mean``, ``_spread`` and the layers, each with its bias as the last column.

    Half precision is enough for weights: it moves a joint by less than a hundredth of a degree.
    """
    out: dict[str, NDArray[np.float16] | NDArray[np.float32]] = {
        f"{name}_mean": prior.mean.numpy().astype(np.float32),
        f"{name}_spread": prior.spread.numpy().astype(np.float32),
    }
    for layer in LAYERS:
        linear = getattr(prior, layer)
        assert isinstance(linear, nn.Linear)
        with torch.no_grad():
            rows = torch.cat([linear.weight, linear.bias[:, None]], 1)
        out[f"{name}_{layer}"] = rows.numpy().astype(np.float16)
    return out
