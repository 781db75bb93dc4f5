"""Corridor-v0: a Pioneer 3-AT drives along a corridor that winds, another one in each episode, to
its end.

- Observation, float32: ``beams`` ranges of a scan over 180 degrees, from right to left, divided by
  8 m and cut at 1; the speed ahead in units of 0.5 m/s and the turn rate in rad/s, from the
  odometry. Nothing says where the end is.
- Action: as Navigate-v0's.
- Reward: metres forward along the corridor's middle, + 5 at the end, - 5 for touching something, -
  0.01 each step.
- An episode is terminated at the end of the corridor (12 to 18 m) or by touching something,
  truncated after 800 actions (80 s).
- ``split``: as Navigate-v0's.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..rooms import Corridor as Scene
from ..rooms import make_corridor
from .drive import DriveTask
from .environments import TaskEnv, TaskVectorEnv
from .task import Outcome, clipped

END_M = 0.5  # from the end: it is reached
PIECES = 6


class Corridor(DriveTask):
    """options: those of `DriveTask`."""

    max_episode_steps = 800

    def setup(self) -> None:
        super().setup()
        self._position = self.position("robot")[:, :2]
        self._middles = np.zeros((self.num_envs, PIECES + 1, 2))
        self._way = np.zeros(self.num_envs)

    def scene(self, number: int) -> Scene:
        return make_corridor(number, robot=self.robot, pieces=PIECES)

    def begin(self, episodes: NDArray[np.intp]) -> None:
        for i in episodes:
            self._middles[i] = self.scenes[i].middle
        self._way[episodes] = self._ways()[episodes]

    def outcome(self) -> Outcome:
        before, self._way = self._way, self._ways()
        success = self._way > self._lengths().sum(axis=1) - END_M
        return self.rewarded(self._way - before, success, (self._touching > 0) & ~success)

    def _lengths(self) -> NDArray[np.float64]:
        lengths: NDArray[np.float64] = np.linalg.norm(np.diff(self._middles, axis=1), axis=2)
        return lengths

    def _ways(self) -> NDArray[np.float64]:
        """How far along the middle the nearest point of it lies, m."""
        begin, along = self._middles[:, :-1], np.diff(self._middles, axis=1)
        here = self._position[:, None] - begin
        length = self._lengths()
        part = clipped((here * along).sum(axis=2) / np.maximum(length**2, 1e-12), 0.0, 1.0)
        apart = np.linalg.norm(here - part[..., None] * along, axis=2)
        nearest = apart.argmin(axis=1)
        before = np.cumsum(length, axis=1) - length
        way: NDArray[np.float64] = np.take_along_axis(
            before + part * length, nearest[:, None], axis=1
        )[:, 0]
        return way


class CorridorVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine. options: those of `TaskVectorEnv` and `Corridor`."""

    def __init__(self, num_envs: int = 1, **options: Any) -> None:
        super().__init__(Corridor, num_envs, **options)


class CorridorEnv(TaskEnv):
    """One environment of the corridor task."""

    def __init__(self, **options: Any) -> None:
        super().__init__(Corridor, **options)
