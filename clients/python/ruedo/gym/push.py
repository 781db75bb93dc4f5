"""Push-v0: a Pioneer 3-AT pushes a box of 3 kg to a place in a room without obstacles.

- Observation, float32, all in the robot's frame (x ahead, y left) and divided by 6 m: the box (x,
  y), the place seen from the box (x, y); the cosine and sine of four times the box's heading (it
  looks the same after a quarter turn); the robot's distances to the room's walls at x+, y+, x- and
  y-, and the cosine and sine of its heading; its speed in units of 0.5 m/s and its turn rate in
  rad/s, from the odometry.
- Action, float32 in [-1, 1]: the speed, 0.5 m/s ahead at 1 and back at -1, and the turn rate, 1
  rad/s at 1; held for 0.1 s.
- Reward: metres of the box nearer to its place, times 2; metres of the robot nearer to the box,
  times 0.2; + 5 at the place; - 0.01 each step.
- An episode is terminated when the box's centre is nearer than 0.3 m to the place, truncated after
  600 actions (60 s).
- ``split``: as Navigate-v0's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ..rooms import PushRoom, make_push_room
from .drive import DriveTask, Terms
from .environments import TaskEnv, TaskVectorEnv
from .task import SPEED_M_S, Outcome

PLACE_M = 0.3
ROOM_M = 6.0
# Of each term: how many numbers, and the most.
TERMS = {
    "box": (2, 2.0),
    "place": (2, 2.0),
    "turned": (2, 1.0),
    "walls": (4, 2.0),
    "heading": (2, 1.0),
}


class Push(DriveTask):
    """options: those of `DriveTask`."""

    max_episode_steps = 600
    sensors = ("odometry",)
    slowest_m_s = -SPEED_M_S
    choices = ((1.0, 0.0), (0.5, 1.0), (0.5, -1.0), (0.0, 1.0), (0.0, -1.0), (-1.0, 0.0))
    weights = {"progress": 2.0, "approach": 0.2, "success": 5.0, "step": -0.01}

    def __init__(self, **options: Any) -> None:
        terms = {
            name: spaces.Box(-most, most, (count,), np.float32)
            for name, (count, most) in TERMS.items()
        }
        super().__init__(terms, **options)

    def setup(self) -> None:
        super().setup()
        self._robot, self._box = self.position("robot")[:, :2], self.position("box")[:, :2]
        self._goals = np.zeros((self.num_envs, 2))
        self._apart = np.zeros((self.num_envs, 2))  # box to place, robot to box

    def scene(self, number: int) -> PushRoom:
        return make_push_room(number, robot=self.robot, size=ROOM_M)

    def begin(self, episodes: NDArray[np.intp]) -> None:
        for i in episodes:
            self._goals[i] = self.scenes[i].goal
        self._apart[episodes] = self._distances()[episodes]

    def outcome(self) -> Outcome:
        before, self._apart = self._apart, self._distances()
        nearer = before - self._apart
        success = self._apart[:, 0] < PLACE_M
        rewards, *ends = self.rewarded(nearer[:, 0], success, np.zeros_like(success))
        return Outcome(rewards + self.weights["approach"] * nearer[:, 1], *ends)

    def terms(self) -> Terms:
        heading, of_box = self.heading("robot"), self.heading("box")
        cos, sin = np.cos(heading), np.sin(heading)
        turned, half = 4.0 * (of_box - heading), ROOM_M / 2

        def seen_from_robot(way: NDArray[np.float64]) -> NDArray[np.float64]:
            ahead = cos * way[:, 0] + sin * way[:, 1]
            return np.stack([ahead, cos * way[:, 1] - sin * way[:, 0]], axis=1) / ROOM_M

        return {
            "box": seen_from_robot(self._box - self._robot),
            "place": seen_from_robot(self._goals - self._box),
            "turned": np.stack([np.cos(turned), np.sin(turned)], axis=1),
            "walls": np.concatenate([half - self._robot, half + self._robot], axis=1) / ROOM_M,
            "heading": np.stack([cos, sin], axis=1),
        }

    def _distances(self) -> NDArray[np.float64]:
        ways = np.stack([self._goals - self._box, self._box - self._robot], axis=1)
        distances: NDArray[np.float64] = np.linalg.norm(ways, axis=2)
        return distances


class PushVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine. options: those of `TaskVectorEnv` and `Push`."""

    def __init__(self, num_envs: int = 1, **options: Any) -> None:
        super().__init__(Push, num_envs, **options)


class PushEnv(TaskEnv):
    """One environment of the push task."""

    def __init__(self, **options: Any) -> None:
        super().__init__(Push, **options)
