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
from typing import Any

import gymnasium
import numpy as np
import ruedo.gym  # noqa: F401    registers the environments
import torch
from policy import Policy
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv


class Environments(VecEnv):
    """Gymnasium's vector environments as Stable-Baselines3 takes them."""

    def __init__(self, environments: gymnasium.vector.VectorEnv):
        self._inner = environments
        self.finished: list[tuple[bool, bool]] = []  # of each episode: success, collision
        super().__init__(
            environments.num_envs,
            environments.single_observation_space,
            environments.single_action_space,
        )

    def reset(self) -> np.ndarray:
        return self._inner.reset(seed=self._seeds[0])[0]

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> Any:
        observations, rewards, terminated, truncated, info = self._inner.step(self._actions)
        over = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(over):
            infos[i]["terminal_observation"] = info["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i])
            self.finished.append((bool(info["success"][i]), bool(info["collision"][i])))
        return observations, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        self._inner.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self._inner, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise NotImplementedError

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any:
        raise NotImplementedError

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs


class Curve(BaseCallback):
    """Writes a row and the policy after each stretch, and ends the training in time."""

    def __init__(self, environments: Environments, arguments: argparse.Namespace):
        super().__init__()
        self._environments, self._arguments = environments, arguments
        self._begin = time.monotonic()
        self._file = open(arguments.curve, "w", newline="")
        self._rows = csv.writer(self._file)
        self._rows.writerow(["steps", "seconds", "episodes", "success", "collision"])

    def _on_step(self) -> bool:
        return time.monotonic() - self._begin < 60.0 * self._arguments.minutes

    def _on_rollout_end(self) -> None:
        if len(self._environments.finished) < 200:
            return
        ended = np.array(self._environments.finished)
        self._environments.finished.clear()
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
    environments = Environments(
        gymnasium.make_vec(
            "ruedo/Navigate-v0",
            num_envs=arguments.envs,
            beams=arguments.beams,
            autoreset_mode="SameStep",
        )
    )
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
    model.learn(10**9, callback=Curve(environments, arguments))
    policy_of(model).save(arguments.policy)


if __name__ == "__main__":
    main()
