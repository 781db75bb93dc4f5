"""Trained policies, replayed with NumPy alone: what results.py keeps of each run.

python replay.py results/Reach-v0/Reach-v0-ppo-1.npz [--episodes 100]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium
import numpy as np
import ruedo.gym  # noqa: F401
from numpy.typing import NDArray


class Policy:
    """A multilayer perceptron. Hidden layers end in ``hidden`` ("tanh" or "relu"), the last one in
    ``last`` ("clip" to [-1, 1], or "tanh").
    """

    def __init__(
        self, layers: list[tuple[NDArray[np.float32], NDArray[np.float32]]], hidden: str, last: str
    ):
        self.layers, self.hidden, self.last = layers, hidden, last

    def __call__(self, observations: NDArray[np.generic]) -> NDArray[np.float32]:
        """Actions for observations, one in a row."""
        if observations.dtype == np.uint8:  # pictures, as Stable-Baselines3 shows them to a network
            observations = observations.transpose(0, 3, 1, 2) / np.float32(255.0)
        values = observations.reshape(len(observations), -1).astype(np.float32)
        for weights, offsets in self.layers[:-1]:
            values = values @ weights + offsets
            values = np.tanh(values) if self.hidden == "tanh" else np.maximum(values, 0.0)
        weights, offsets = self.layers[-1]
        values = values @ weights + offsets
        return np.tanh(values) if self.last == "tanh" else np.clip(values, -1.0, 1.0)

    def save(self, file: str | Path) -> None:
        arrays: dict[str, NDArray[np.generic]] = {"ends": np.array([self.hidden, self.last])}
        for i, (weights, offsets) in enumerate(self.layers):
            arrays[f"weights{i}"] = weights.astype(np.float16)
            arrays[f"offsets{i}"] = offsets.astype(np.float16)
        np.savez_compressed(file, **arrays)

    @classmethod
    def load(cls, file: str | Path) -> Policy:
        with np.load(file) as arrays:
            layers = [
                (arrays[f"weights{i}"].astype(np.float32), arrays[f"offsets{i}"].astype(np.float32))
                for i in range(len(arrays.files) // 2)
            ]
            hidden, last = map(str, arrays["ends"])
        return cls(layers, hidden, last)


def success_rate(task: str, policy: Policy, episodes: int = 100, **options: object) -> float:
    """Of so many episodes in scenes that training does not draw."""
    envs = gymnasium.make_vec(
        f"ruedo/{task}", num_envs=episodes, split="test", autoreset_mode="Disabled", **options
    )
    observations, _ = envs.reset(seed=1)
    running, success = np.ones(episodes, bool), np.zeros(episodes, bool)
    while running.any():
        observations, _, terminated, truncated, info = envs.step(policy(observations))
        success |= running & info["success"]
        running &= ~(terminated | truncated)
    envs.close()
    return float(success.mean())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path, help="TASK-ALGORITHM-SEED.npz")
    parser.add_argument("--episodes", type=int, default=100)
    given = parser.parse_args()
    task = given.file.stem.rpartition("-")[0].rpartition("-")[0]
    rate = success_rate(task, Policy.load(given.file), given.episodes)
    print(f"{task}: {rate:.0%} of {given.episodes} episodes")


if __name__ == "__main__":
    main()
