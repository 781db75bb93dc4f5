"""Hills-v0: a Pioneer 3-AT drives to a goal over hills, other ones in each episode.

- Observation, float32: Navigate-v0's terms, and between the goal and the speed the way in which the
  robot leans: the upward direction along its x axis (ahead) and its y axis (left), each in [-1, 1],
  from the true pose. A level beam meets the hills; they are not obstacles.
- Action: as Navigate-v0's.
- Reward: as Navigate-v0's.
- An episode is terminated at the goal (nearer than 0.4 m), by touching a wall, or by leaning more
  than 0.7 rad; truncated after 600 actions (60 s).
- ``split``: as Navigate-v0's.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ..arguments import whole
from ..rooms import Room, make_hills
from .drive import GoalTask, Terms
from .environments import TaskEnv, TaskVectorEnv

MOST_LEAN_RAD = 0.7


class Hills(GoalTask):
    """hills: how many, 0 to 20. options: those of `DriveTask`."""

    max_episode_steps = 600
    own_terms = {"lean": spaces.Box(-1.0, 1.0, (2,), np.float32)}

    def __init__(self, *, hills: int = 6, **options: Any) -> None:
        super().__init__(**options)
        self.hills = whole("hills", hills, 0, 20)

    def scene(self, number: int) -> Room:
        return make_hills(number, robot=self.robot, hills=self.hills)

    def failed(self) -> NDArray[np.bool_]:
        """The environments whose robot touches something or leans too much."""
        ahead, left = self._up().T
        steep = np.hypot(ahead, left) > math.sin(MOST_LEAN_RAD)
        return super().failed() | steep

    def terms(self) -> Terms:
        return {**super().terms(), "lean": self._up()}

    def _up(self) -> NDArray[np.float64]:
        """(environments, 2): the world's z axis along the robot's x and y axes."""
        w, x, y, z = self._orientation.T
        return np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x)], axis=1)


class HillsVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine. options: those of `TaskVectorEnv` and `Hills`."""

    def __init__(self, num_envs: int = 1, **options: Any) -> None:
        super().__init__(Hills, num_envs, **options)


class HillsEnv(TaskEnv):
    """One environment of the hills task."""

    def __init__(self, **options: Any) -> None:
        super().__init__(Hills, **options)
