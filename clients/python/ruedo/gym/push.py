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

from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from ..rooms import PushRoom, make_push_room
from .base import DRIVE, SPEED_M_S, TURN_RAD_S, Outcome, TaskEnv, TaskVectorEnv, clipped

PLACE_M = 0.3
ROOM_M = 6.0
LIMITS = np.array([2.0] * 4 + [1.0] * 2 + [2.0] * 4 + [1.0] * 2 + [2.0, 4.0], np.float32)
ROBOT, BOX = 0, 1  # of those that have a pose


class PushVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine."""

    most_actions = 600

    def __init__(
        self,
        num_envs: int = 1,
        *,
        split: Literal["train", "test"] = "train",
        noise: bool = True,
        threads: int = 0,
        randomize: dict[str, str] | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: Literal["rgb_array", "human"] | None = None,
    ) -> None:
        super().__init__(
            num_envs,
            spaces.Box(-LIMITS, LIMITS, dtype=np.float32),
            DRIVE,
            split=split,
            noise=noise,
            threads=threads,
            autoreset_mode=autoreset_mode,
            render_mode=render_mode,
            disabled=("robot/camera", "robot/lrf", "robot/sonar_front", "robot/sonar_rear"),
            randomize=randomize,
        )
        self._speed = self._engine.observe("odometry.v")[:, 0]
        self._turn = self._engine.observe("odometry.omega")[:, 0]
        self._goals = np.zeros((num_envs, 2))
        self._apart = np.zeros((num_envs, 2))  # box to place, robot to box

    def _scene(self, number: int) -> PushRoom:
        return make_push_room(number, size=ROOM_M)

    def _begun(self, indices: NDArray[np.intp]) -> None:
        for i in indices:
            self._goals[i] = self._scenes[i].goal
        self._apart[indices] = self._distances()[indices]

    def _commands(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        wanted = clipped(np.asarray(actions, np.float64).reshape(-1, 1, 2), -1.0, 1.0)
        return wanted * (SPEED_M_S, TURN_RAD_S)

    def _outcome(self) -> Outcome:
        before, self._apart = self._apart, self._distances()
        nearer = before - self._apart
        success = self._apart[:, 0] < PLACE_M
        rewards = 2.0 * nearer[:, 0] + 0.2 * nearer[:, 1] + 5.0 * success - 0.01
        return rewards, success, np.zeros(self.num_envs, bool)

    def _distances(self) -> NDArray[np.float64]:
        box, robot = self._places[:, BOX, :2], self._places[:, ROBOT, :2]
        return np.stack(
            [np.linalg.norm(self._goals - box, axis=1), np.linalg.norm(box - robot, axis=1)], axis=1
        )

    def _observe(self) -> NDArray[np.float32]:
        robot, box = self._places[:, ROBOT, :2], self._places[:, BOX, :2]
        heading, of_box = self._headings(ROBOT), self._headings(BOX)
        cos, sin = np.cos(heading), np.sin(heading)

        def seen_from_robot(way: NDArray[np.float64]) -> list[NDArray[np.float64]]:
            return [
                (cos * way[:, 0] + sin * way[:, 1]) / ROOM_M,
                (cos * way[:, 1] - sin * way[:, 0]) / ROOM_M,
            ]

        half = ROOM_M / 2
        columns = [
            *seen_from_robot(box - robot),
            *seen_from_robot(self._goals - box),
            np.cos(4.0 * (of_box - heading)),
            np.sin(4.0 * (of_box - heading)),
            *((half - robot).T / ROOM_M),
            *((half + robot).T / ROOM_M),
            cos,
            sin,
            self._speed / SPEED_M_S,
            self._turn,
        ]
        result = np.stack(columns, axis=1).astype(np.float32)
        return clipped(result, -LIMITS, LIMITS)


class PushEnv(TaskEnv):
    """One of them."""

    task = PushVectorEnv
