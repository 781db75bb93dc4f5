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

from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from ..rooms import Corridor, make_corridor
from .base import (
    DRIVE,
    SPEED_M_S,
    Outcome,
    TaskEnv,
    TaskVectorEnv,
    checked_beams,
    clipped,
    drive_commands,
    drive_rewards,
    seen,
)

END_M = 0.5  # from the end: it is reached
PIECES = 6


class CorridorVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine."""

    most_actions = 800

    def __init__(
        self,
        num_envs: int = 1,
        *,
        beams: int = 24,
        split: Literal["train", "test"] = "train",
        noise: bool = True,
        threads: int = 0,
        randomize: dict[str, str] | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: Literal["rgb_array", "human"] | None = None,
    ) -> None:
        self._beams = checked_beams(beams)
        low = np.concatenate([np.zeros(beams), [-2.0, -4.0]]).astype(np.float32)
        high = np.concatenate([np.ones(beams), [2.0, 4.0]]).astype(np.float32)
        super().__init__(
            num_envs,
            spaces.Box(low, high, dtype=np.float32),
            DRIVE,
            split=split,
            noise=noise,
            threads=threads,
            autoreset_mode=autoreset_mode,
            render_mode=render_mode,
            settings={"robot/lrf.lidar.scan.horizontal.samples": beams},
            disabled=("robot/camera", "robot/sonar_front", "robot/sonar_rear"),
            randomize=randomize,
        )
        self._ranges = self._engine.observe("lrf.ranges")[:, 0]
        self._speed = self._engine.observe("odometry.v")[:, 0]
        self._turn = self._engine.observe("odometry.omega")[:, 0]
        self._touching = self._engine.touching()[:, 0]
        self._middles = np.zeros((num_envs, PIECES + 1, 2))
        self._way = np.zeros(num_envs)

    def _scene(self, number: int) -> Corridor:
        return make_corridor(number, pieces=PIECES)

    def _begun(self, indices: NDArray[np.intp]) -> None:
        for i in indices:
            self._middles[i] = self._scenes[i].middle
        self._way[indices] = self._ways()[indices]

    def _commands(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        return drive_commands(actions)

    def _outcome(self) -> Outcome:
        before, self._way = self._way, self._ways()
        success = self._way > self._lengths().sum(axis=1) - END_M
        collision = (self._touching > 0) & ~success
        return drive_rewards(self._way - before, success, collision), success, collision

    def _lengths(self) -> NDArray[np.float64]:
        lengths: NDArray[np.float64] = np.linalg.norm(np.diff(self._middles, axis=1), axis=2)
        return lengths

    def _ways(self) -> NDArray[np.float64]:
        """How far along the middle the nearest point of it lies, m."""
        begin, along = self._middles[:, :-1], np.diff(self._middles, axis=1)
        here = self._places[:, 0, None, :2] - begin
        length = self._lengths()
        part = clipped((here * along).sum(axis=2) / np.maximum(length**2, 1e-12), 0.0, 1.0)
        apart = np.linalg.norm(here - part[..., None] * along, axis=2)
        nearest = apart.argmin(axis=1)
        before = np.cumsum(length, axis=1) - length
        way: NDArray[np.float64] = np.take_along_axis(
            before + part * length, nearest[:, None], axis=1
        )[:, 0]
        return way

    def _observe(self) -> NDArray[np.float32]:
        result = np.empty((self.num_envs, self._beams + 2), np.float32)
        result[:, : self._beams] = seen(self._ranges)
        result[:, -2] = clipped(self._speed / SPEED_M_S, -2.0, 2.0)
        result[:, -1] = clipped(self._turn, -4.0, 4.0)
        return result


class CorridorEnv(TaskEnv):
    """One of them."""

    task = CorridorVectorEnv
