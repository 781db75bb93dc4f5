"""Navigate-v0: a Pioneer 3-AT drives to a goal through a room that is another one in each episode.

- Observation, float32: ``beams`` ranges of a scan over 180 degrees, from right to left, divided by
  8 m and cut at 1; the goal's distance divided by 8 m, cut at 1, and the cosine and sine of its
  bearing; the speed ahead in units of 0.5 m/s and the turn rate in rad/s, from the odometry.
  Sensors have their noise; the goal's place is that of the true pose.
- Action, float32 in [-1, 1]: the speed ahead, from 0 to 0.5 m/s, and the turn rate, 1 rad/s at 1;
  held for 0.1 s.
- Reward: metres nearer to the goal (of the straight way), + 5 at the goal, - 5 for touching
  something, - 0.01 each step.
- An episode is terminated at the goal (nearer than 0.4 m) or by touching something, truncated after
  400 actions (40 s). ``info["success"]`` and ``info["collision"]`` say which, apart from the
  reward.
- ``split="train"`` draws its rooms from the numbers below 1 000 000, ``split="test"`` from those
  above: no room is in both.
"""

from __future__ import annotations

from typing import Any

from ..arguments import whole
from ..rooms import Room, make_room
from .drive import GoalTask
from .environments import TaskEnv, TaskVectorEnv


class Navigate(GoalTask):
    """obstacles: boxes and pillars in a room, 0 to 100. options: those of `DriveTask`."""

    def __init__(self, *, obstacles: int = 8, **options: Any) -> None:
        super().__init__(**options)
        self.obstacles = whole("obstacles", obstacles, 0, 100)

    def scene(self, number: int) -> Room:
        return make_room(number, robot=self.robot, obstacles=self.obstacles)


class NavigateVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine. options: those of `TaskVectorEnv` and `Navigate`."""

    def __init__(self, num_envs: int = 1, **options: Any) -> None:
        super().__init__(Navigate, num_envs, **options)


class NavigateEnv(TaskEnv):
    """One environment of the navigation task."""

    def __init__(self, **options: Any) -> None:
        super().__init__(Navigate, **options)

    @property
    def room(self) -> Room:
        """The room of this episode."""
        room: Room = self.scene
        return room
