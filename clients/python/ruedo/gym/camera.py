"""Camera-v0: a Pioneer 3-AT drives to a red pillar among others, by its camera alone.

- Observation, uint8 (64, 64, 3): the picture of the robot's camera, rows from the top, red, green,
  blue.
- Action: as Navigate-v0's.
- Reward: metres nearer to the red pillar, + 5 at it, - 5 for touching something else, - 0.01 each
  step.
- An episode is terminated when the robot's centre is nearer than 0.8 m to the red pillar's, or by
  touching something, truncated after 400 actions (40 s).
- ``split``: as Navigate-v0's.
"""

from __future__ import annotations

from typing import Any

from ..rooms import Room, make_landmark_room
from .drive import GoalTask
from .environments import TaskEnv, TaskVectorEnv


class Camera(GoalTask):
    """options: those of `DriveTask`."""

    sensors = ("camera",)
    goal_m = 0.8  # between the centres of the robot and the pillar
    tells_goal = False

    def scene(self, number: int) -> Room:
        return make_landmark_room(number, robot=self.robot)


class CameraVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine. options: those of `TaskVectorEnv` and `Camera`."""

    def __init__(self, num_envs: int = 1, **options: Any) -> None:
        super().__init__(Camera, num_envs, **options)


class CameraEnv(TaskEnv):
    """One environment of the camera task."""

    def __init__(self, **options: Any) -> None:
        super().__init__(Camera, **options)
