"""Reach-v0: an arm of two joints, which turns in a level plane, brings its tip to a target that is
another one in each episode.

- Observation, float32: cosine and sine of the two joints' angles, their rates in units of 2 rad/s,
  the way from the tip to the target (x, y) in m. All of it is true.
- Action, float32 in [-1, 1]: the rates of the joints, 2 rad/s at 1, within 50 N m; held for 0.1 s.
- Reward: metres nearer to the target, + 5 at it, - 0.01 each step.
- An episode is terminated when the tip is nearer than 0.03 m to the target, truncated after 100
  actions (10 s). Nothing fails.
- ``split``: as Navigate-v0's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ..rooms import ARM_M, ArmPlace, make_arm_place
from .environments import TaskEnv, TaskVectorEnv
from .task import Outcome, Task, clipped

JOINTS = ("shoulder", "elbow")
RATE_RAD_S = 2.0
TARGET_M = 0.03
LIMITS = np.array([1.0] * 4 + [2.0] * 4, np.float32)


class Reach(Task):
    """It has no options."""

    observation_space = spaces.Box(-LIMITS, LIMITS, dtype=np.float32)
    max_episode_steps = 100

    def scene(self, number: int) -> ArmPlace:
        return make_arm_place(number)

    def setup(self) -> None:
        self._angles = self.sensor("joints.joint_position", "arm")
        self._rates = self.sensor("joints.joint_velocity", "arm")
        self._targets = np.zeros((self.num_envs, 2))
        self._distance = np.zeros(self.num_envs)

    def begin(self, episodes: NDArray[np.intp]) -> None:
        for i in episodes:
            self._targets[i] = self.scenes[i].target
        self._distance[episodes] = np.linalg.norm(self._way(), axis=1)[episodes]

    def commands(self, actions: NDArray[Any]) -> None:
        self.command_joints("arm", JOINTS, RATE_RAD_S * clipped(actions, -1.0, 1.0))

    def outcome(self) -> Outcome:
        before, self._distance = self._distance, np.linalg.norm(self._way(), axis=1)
        success = self._distance < TARGET_M
        rewards = before - self._distance + 5.0 * success - 0.01
        return Outcome(rewards, success, np.zeros_like(success))

    def observe(self) -> NDArray[Any]:
        angles = self._angles
        terms = [np.cos(angles), np.sin(angles), self._rates / RATE_RAD_S, self._way()]
        return clipped(np.concatenate(terms, axis=1), -LIMITS, LIMITS)

    def _way(self) -> NDArray[np.float64]:
        """(environments, 2): from the tip to the target, m."""
        turned = np.cumsum(self._angles, axis=1, dtype=np.float64)
        tip = np.stack([np.cos(turned) @ ARM_M, np.sin(turned) @ ARM_M], axis=1)
        way: NDArray[np.float64] = self._targets - tip
        return way


class ReachVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine. options: those of `TaskVectorEnv`."""

    def __init__(self, num_envs: int = 1, **options: Any) -> None:
        super().__init__(Reach, num_envs, **options)


class ReachEnv(TaskEnv):
    """One environment of the reach task."""

    def __init__(self, **options: Any) -> None:
        super().__init__(Reach, **options)
