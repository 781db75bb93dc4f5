"""Learns Navigate-v0 by PPO (Stable-Baselines3), on the CPU, and writes the policy as a few kB of
numbers.

    python3 -m venv LEARN && LEARN/bin/pip install -r requirements.txt      # torch is large: it is
    for this script alone PYTHONPATH=BUILD/python LEARN/bin/python train.py [--minutes 60] [--policy
    policy.npz] [--curve curve.csv]

The policy sees rooms for training alone. Every row of the curve is a stretch of training: steps,
seconds of wall time, and the fractions of the episodes since the previous row that reached the goal
and that touched something. The written policy can be driven without torch (policy.py).
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

import numpy as np
import torch
from policy import Policy
from ruedo.gym.sb3 import SB3VecEnv
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback


class Curve(BaseCallback):
    """Writes a row and the policy after each stretch, and ends the training in time."""

    def __init__(self, arguments: argparse.Namespace):
        super().__init__()
        self._arguments = arguments
        self._finished: list[tuple[bool, bool]] = []  # of each episode: success, collision
        self._begin = time.monotonic()
        self._file = open(arguments.curve, "w", newline="")
        self._rows = csv.writer(self._file)
        self._rows.writerow(["steps", "seconds", "episodes", "success", "collision"])

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self._finished.append((info["is_success"], info["collision"]))
        return time.monotonic() - self._begin < 60.0 * self._arguments.minutes

    def _on_rollout_end(self) -> None:
        if len(self._finished) < 200:
            return
        ended = np.array(self._finished)
        self._finished.clear()
        seconds = time.monotonic() - self._begin
        success, collision = ended.mean(axis=0)
        self._rows.writerow(
            [self.num_timesteps, f"{seconds:.1f}", len(ended), f"{success:.4f}", f"{collision:.4f}"]
        )
        self._file.flush()
        print(
            f"{self.num_timesteps:9} steps, {seconds:6.0f} s: success {success:.3f}, collision {collision:.3f}",
            flush=True,
        )
        policy_of(self.model).save(self._arguments.policy)


def policy_of(model: PPO) -> Policy:
    """The layers that lead to the mean of the actions."""
    linear = [
        layer for layer in model.policy.mlp_extractor.policy_net if hasattr(layer, "weight")
    ] + [model.policy.action_net]
    return Policy(
        [
            (layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy())
            for layer in linear
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    here = Path(__file__).resolve().parent
    parser.add_argument("--minutes", type=float, default=60.0, help="of wall time (default 60)")
    parser.add_argument("--envs", type=int, default=64)
    parser.add_argument("--beams", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1, help="of torch")
    parser.add_argument("--policy", default=str(here / "policy.npz"))
    parser.add_argument("--curve", default=str(here / "curve.csv"))
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    environments = SB3VecEnv("ruedo/Navigate-v0", num_envs=arguments.envs, beams=arguments.beams)
    environments.seed(arguments.seed)
    model = PPO(
        "MlpPolicy",
        environments,
        seed=arguments.seed,
        device="cpu",
        n_steps=128,
        batch_size=1024,
        n_epochs=6,
        learning_rate=5e-4,
        gamma=0.99,
        ent_coef=0.002,
        policy_kwargs={"net_arch": {"pi": [32, 32], "vf": [64, 64]}, "log_std_init": -0.5},
    )
    model.learn(10**9, callback=Curve(arguments))
    policy_of(model).save(arguments.policy)


if __name__ == "__main__":
    main()
