"""Crowd-v0: a Pioneer 3-AT drives from one end of a hall to a goal at the other, through people who
walk across it and along it.

- Observation, action and reward: Navigate-v0's. A scan shows where people are, not where they go:
  Gymnasium's ``FrameStackObservation`` shows the last few.
- People go around what is in their way, robots too, by the social force model of
  ``<ruedo:crowd>``; who is cut off can still walk into the robot.
- An episode is terminated at the goal (nearer than 0.4 m) or by touching a person or a wall, even
  when it was the person who walked; truncated after 600 actions (60 s).
- ``people``: how many there are, 8 by default, 0 to 50. Their places, likes and chance come from
  the episode's seed.
- ``split``: as Navigate-v0's.
"""

from __future__ import annotations

from typing import Any

from ..arguments import whole
from ..rooms import Room, make_crowd_hall
from .drive import GoalTask
from .environments import TaskEnv, TaskVectorEnv

MOST_PEOPLE = 50


class Crowd(GoalTask):
    """people: how many walk in a hall, 0 to 50. options: those of `DriveTask`."""

    max_episode_steps = 600

    def __init__(self, *, people: int = 8, **options: Any) -> None:
        if "obstacles" in options:
            raise TypeError("Crowd-v0 has no obstacles but people: people=8")
        super().__init__(**options)
        self.people = whole("people", people, 0, MOST_PEOPLE)

    def scene(self, number: int) -> Room:
        return make_crowd_hall(number, robot=self.robot, people=self.people)


class CrowdVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine. options: those of `TaskVectorEnv` and `Crowd`."""

    def __init__(self, num_envs: int = 1, **options: Any) -> None:
        super().__init__(Crowd, num_envs, **options)


class CrowdEnv(TaskEnv):
    """One environment of the crowd task."""

    def __init__(self, **options: Any) -> None:
        super().__init__(Crowd, **options)
