"""A policy for Navigate-v0: two hidden layers, in numpy alone."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

VALUES, ACTION = 5, 2  # observed behind the beams; commanded


class Policy:
    """layers: (weights, offsets) of each layer. tanh follows each but the last, whose values are
    the action.
    """

    def __init__(self, layers: list[tuple[NDArray[np.float32], NDArray[np.float32]]]):
        self.layers = layers

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Actions in [-1, 1] for one observation, or a row of them for each row of observations."""
        values = observations
        for weights, offsets in self.layers[:-1]:
            values = np.tanh(values @ weights + offsets)
        weights, offsets = self.layers[-1]
        return np.clip(values @ weights + offsets, -1.0, 1.0)

    @property
    def beams(self) -> int:
        """How many beams of the scan it was trained with; five other values follow them."""
        return len(self.layers[0][0]) - VALUES

    def save(self, file: str | Path) -> None:
        arrays = {}
        for i, (weights, offsets) in enumerate(self.layers):
            arrays[f"weights{i}"], arrays[f"offsets{i}"] = (
                weights.astype(np.float16),
                offsets.astype(np.float16),
            )
        np.savez_compressed(file, **arrays)

    @classmethod
    def load(cls, file: str | Path | None = None) -> Policy:
        """From a file that save() wrote; None: the one beside this program. Raises ValueError."""
        file = file or Path(__file__).resolve().parent / "policy.npz"
        try:
            with np.load(file) as arrays:
                names = [(f"weights{i}", f"offsets{i}") for i in range(len(arrays.files) // 2)]
                layers = [tuple(arrays[one].astype(np.float32) for one in two) for two in names]
        except (ValueError, KeyError, TypeError, AttributeError, EOFError, BadZipFile):
            layers = []
        if not _fit(layers):
            raise ValueError(f"{file}: is not a policy that save() wrote")
        return cls(layers)


def _fit(layers: list[tuple[NDArray[np.float32], ...]]) -> bool:
    """Whether each takes what the one before gives, and the last gives an action."""
    if not layers or any(weights.ndim != 2 for weights, _ in layers):
        return False
    return (
        len(layers[0][0]) > VALUES
        and layers[-1][0].shape[1] == ACTION
        and all(one.shape[1] == len(next_one) for (one, _), (next_one, _) in pairwise(layers))
        and all(offsets.shape == weights.shape[1:] for weights, offsets in layers)
        and all(np.isfinite(values).all() for layer in layers for values in layer)
    )
