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

from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from ..rooms import Room, make_landmark_room
from .base import DRIVE, Outcome, TaskEnv, TaskVectorEnv, drive_commands, drive_rewards

PIXELS = 64
PILLAR_M = 0.8


class CameraVectorEnv(TaskVectorEnv):
    """``num_envs`` of them in one engine."""

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
            spaces.Box(0, 255, (PIXELS, PIXELS, 3), np.uint8),
            DRIVE,
            split=split,
            noise=noise,
            threads=threads,
            autoreset_mode=autoreset_mode,
            render_mode=render_mode,
            settings={
                "robot/camera.camera.image.width": PIXELS,
                "robot/camera.camera.image.height": PIXELS,
                "robot/camera.encoding": "rgb",
                "robot/camera.update_rate": 10,
            },
            disabled=("robot/lrf", "robot/sonar_front", "robot/sonar_rear"),
            randomize=randomize,
        )
        self._touching = self._engine.touching()[:, 0]
        self._goals = np.zeros((num_envs, 2))
        self._distance = np.zeros(num_envs)

    def _scene(self, number: int) -> Room:
        return make_landmark_room(number)

    def _begun(self, indices: NDArray[np.intp]) -> None:
        for i in indices:
            self._goals[i] = self._scenes[i].goal
        self._distance[indices] = self._distances()[indices]

    def _commands(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        return drive_commands(actions)

    def _outcome(self) -> Outcome:
        before, self._distance = self._distance, self._distances()
        success = self._distance < PILLAR_M
        collision = (self._touching > 0) & ~success
        rewards = drive_rewards(before - self._distance, success, collision)
        return rewards, success, collision

    def _distances(self) -> NDArray[np.float64]:
        distances: NDArray[np.float64] = np.linalg.norm(
            self._goals - self._places[:, 0, :2], axis=1
        )
        return distances

    def _observe(self) -> NDArray[np.uint8]:
        pictures = self._engine.observe("camera.data")[:, 0]
        return pictures.reshape(self.num_envs, PIXELS, PIXELS, 3).copy()


class CameraEnv(TaskEnv):
    """One of them."""

    task = CameraVectorEnv
