"""Environments of `ruedo.gym` for Stable-Baselines3 (pip install stable-baselines3), in one engine:

    from stable_baselines3 import PPO
    from ruedo.gym.sb3 import SB3VecEnv

    PPO("MlpPolicy", SB3VecEnv("ruedo/Navigate-v0", num_envs=64)).learn(100_000)

Tested against Stable-Baselines3 2.9.
"""

from __future__ import annotations

import time
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

try:
    from stable_baselines3.common.vec_env import VecEnv  # type: ignore[import-not-found, unused-ignore]
except ImportError as _error:
    raise ImportError(
        "ruedo.gym.sb3 needs Stable-Baselines3: pip install stable-baselines3"
    ) from _error

from .environments import TaskVectorEnv, row_of, without_masks
from .task import Task


class SB3VecEnv(VecEnv):  # type: ignore[misc, unused-ignore]    # Stable-Baselines3 may be missing
    """``num_envs`` environments of a task: its registered name, or the class. options: as for
    `TaskVectorEnv`, but ``autoreset_mode``.

    ``infos[i]`` of a step that ends an episode has ``terminal_observation``,
    ``TimeLimit.truncated``, ``is_success``, ``collision``, and ``episode`` (r: the sum of rewards,
    l: steps, t: s since the environments were made), as Stable-Baselines3's ``Monitor`` gives it:
    no ``VecMonitor`` is needed. ``get_attr`` and ``set_attr`` are of the task, which all share.
    """

    def __init__(self, task: str | type[Task], num_envs: int = 1, **options: Any) -> None:
        options["autoreset_mode"] = "SameStep"
        self.envs: TaskVectorEnv = (
            gymnasium.make_vec(task, num_envs=num_envs, **options)  # type: ignore[assignment]
            if isinstance(task, str)
            else TaskVectorEnv(task, num_envs, **options)
        )
        self._returns, self._lengths = np.zeros(num_envs), np.zeros(num_envs, int)
        self._made = time.time()
        super().__init__(
            num_envs, self.envs.single_observation_space, self.envs.single_action_space
        )

    def reset(self) -> Any:
        observations, info = self.envs.reset(seed=self._seeds)
        told = without_masks(info)
        self.reset_infos = [row_of(told, i) for i in range(self.num_envs)]
        self._returns[:], self._lengths[:] = 0.0, 0
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: NDArray[Any]) -> None:
        self.envs.send(actions)

    def step_wait(self) -> tuple[Any, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        observations, rewards, terminated, truncated, info = self.envs.recv()
        self._returns += rewards
        self._lengths += 1
        over = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        told = without_masks(info.get("final_info", {}))
        for i in np.flatnonzero(over).tolist():
            infos[i] = row_of(told, i) | {
                "terminal_observation": info["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i]),
                "is_success": bool(info["success"][i]),
                "collision": bool(info["collision"][i]),
                "episode": {
                    "r": float(self._returns[i]),
                    "l": int(self._lengths[i]),
                    "t": time.time() - self._made,
                },
            }
        self._returns[over], self._lengths[over] = 0.0, 0
        return observations, rewards.astype(np.float32), over, infos

    def close(self) -> None:
        self.envs.close()

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        return list(self.envs.render() or [None] * self.num_envs)

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        keeper = self.envs if hasattr(self.envs, attr_name) else self.envs.task
        return [getattr(keeper, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        if len(list(self._get_indices(indices))) != self.num_envs:
            raise ValueError(f"{attr_name} is of the task, which all environments share")
        if not hasattr(self.envs.task, attr_name):
            raise AttributeError(f"{type(self.envs.task).__name__} has no attribute {attr_name!r}")
        setattr(self.envs.task, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any:
        raise NotImplementedError(f"call {method_name} of .envs, which is all environments at once")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * len(list(self._get_indices(indices)))
