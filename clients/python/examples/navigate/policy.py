"""A policy for Navigate-v0: two hidden layers, in numpy alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray


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
        return len(self.layers[0][0]) - 5

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
        """From a file that save() wrote; None: the one beside this program."""
        with np.load(file or Path(__file__).resolve().parent / "policy.npz") as arrays:
            return cls(
                [
                    (
                        arrays[f"weights{i}"].astype(np.float32),
                        arrays[f"offsets{i}"].astype(np.float32),
                    )
                    for i in range(len(arrays.files) // 2)
                ]
            )
