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

from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from ..arguments import whole
from ..rooms import Room, make_room
from .base import (
    DRIVE,
    RANGE_M,
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

GOAL_M = 0.4
LIMITS = np.array([1.0, 1.0, 1.0, 2.0, 4.0], np.float32)  # of what follows the beams


class NavigateVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine."""

    def __init__(
        self,
        num_envs: int = 1,
        *,
        beams: int = 24,
        split: Literal["train", "test"] = "train",
        noise: bool = True,
        obstacles: int = 8,
        threads: int = 0,
        randomize: dict[str, str] | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: Literal["rgb_array", "human"] | None = None,
    ) -> None:
        self._beams = checked_beams(beams)
        self._obstacles = whole("obstacles", obstacles, 0, 100)
        low = np.concatenate([np.zeros(beams + 1), -LIMITS[1:]]).astype(np.float32)
        high = np.concatenate([np.ones(beams), LIMITS]).astype(np.float32)
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
        self._goals = np.zeros((num_envs, 2))
        self._distance = np.zeros(num_envs)

    def _scene(self, number: int) -> Room:
        return make_room(number, obstacles=self._obstacles)

    def _begun(self, indices: NDArray[np.intp]) -> None:
        for i in indices:
            self._goals[i] = self._scenes[i].goal
        self._distance[indices] = self._distances()[indices]

    def _commands(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        return drive_commands(actions)

    def _outcome(self) -> Outcome:
        before, self._distance = self._distance, self._distances()
        success = self._distance < GOAL_M
        collision = (self._touching > 0) & ~success
        rewards = drive_rewards(before - self._distance, success, collision)
        return rewards, success, collision

    def _distances(self) -> NDArray[np.float64]:
        ahead = self._goals - self._places[:, 0, :2]
        distances: NDArray[np.float64] = np.hypot(ahead[:, 0], ahead[:, 1])
        return distances

    def _observe(self) -> NDArray[np.float32]:
        return observation(
            self._ranges,
            self._goals - self._places[:, 0, :2],
            self._headings(),
            self._speed,
            self._turn,
        )


def observation(
    ranges: NDArray[np.float32],
    to_goal: NDArray[np.float64],
    heading: NDArray[np.float64],
    speed: NDArray[np.float64],
    turn: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Of (n, beams) ranges in m, (n, 2) m to the goal in the world, and n headings (rad), speeds
    (m/s) and turn rates (rad/s).
    """
    beams = ranges.shape[1]
    result = np.empty((len(ranges), beams + 5), np.float32)
    result[:, :beams] = seen(ranges)
    bearing = np.arctan2(to_goal[:, 1], to_goal[:, 0]) - heading
    result[:, beams] = np.hypot(to_goal[:, 0], to_goal[:, 1]) / RANGE_M
    result[:, beams + 1] = np.cos(bearing)
    result[:, beams + 2] = np.sin(bearing)
    result[:, beams + 3] = speed / SPEED_M_S
    result[:, beams + 4] = turn
    result[:, beams:] = clipped(result[:, beams:], -LIMITS, LIMITS)
    return result


class NavigateEnv(TaskEnv):
    """One of them."""

    task = NavigateVectorEnv

    @property
    def room(self) -> Room:
        """The room of this episode."""
        room: Room = self.scene
        return room
