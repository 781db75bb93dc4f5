"""Gymnasium environments over the engine in the process.

    import gymnasium
    import ruedo.gym                                # registers them

    env = gymnasium.make("ruedo/Navigate-v0", beams=24)
    # One engine, all cores
    envs = gymnasium.make_vec("ruedo/Navigate-v0", num_envs=64, beams=24)

**Navigate-v0**: a Pioneer 3-AT drives to a goal through a room that is another one in each episode.

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
from numpy.typing import NDArray

try:
    import gymnasium
except ImportError as _error:
    raise ImportError("ruedo.gym needs gymnasium: pip install gymnasium") from _error
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from .engine import Engine
from .rooms import TEST_ROOMS, Room, make_room

__all__ = ["NavigateEnv", "NavigateVectorEnv"]

STEPS = 20  # of the world in an action: 0.1 s
RANGE_M = 8.0
SPEED_M_S = 0.5
TURN_RAD_S = 1.0
GOAL_M = 0.4
MOST_ACTIONS = 400

Info = dict[str, Any]


class NavigateVectorEnv(VectorEnv):
    """Navigate-v0, ``num_envs`` of them in one engine. The modes of autoreset are Gymnasium's."""

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        *,
        beams: int = 24,
        split: Literal["train", "test"] = "train",
        noise: bool = True,
        obstacles: int = 8,
        threads: int = 0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: None = None,
    ) -> None:
        if not 2 <= beams <= 1024:
            raise ValueError(f"beams is {beams}; allowed are 2 to 1024")
        if split not in ("train", "test"):
            raise ValueError(f"split is {split!r}; allowed are 'train' and 'test'")
        if render_mode is not None:
            raise ValueError(
                f"render_mode is {render_mode!r}; these environments draw nothing yet: None"
            )
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = None
        self._first_room = 0 if split == "train" else TEST_ROOMS
        self._obstacles = obstacles
        self._rooms = [self._room(0)] * num_envs
        self._engine = Engine(
            "room",
            text=self._rooms[0].sdf,
            worlds=num_envs,
            noise=noise,
            threads=threads,
            set={"robot/lrf.lidar.scan.horizontal.samples": beams},
            disable=["robot/camera", "robot/sonar_front", "robot/sonar_rear"],
        )
        low = np.concatenate([np.zeros(beams + 1), [-1.0, -1.0, -2.0, -4.0]]).astype(np.float32)
        high = np.concatenate([np.ones(beams + 1), [1.0, 1.0, 2.0, 4.0]]).astype(np.float32)
        self._box = spaces.Box(low, high, dtype=np.float32)
        self.single_observation_space = self._box
        self.single_action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ranges = self._engine.observe("lrf.ranges")[:, 0]
        self._place = self._engine.observe("pose.pos")[:, 0]
        self._turned = self._engine.observe("pose.orientation")[:, 0]
        self._speed = self._engine.observe("odometry.v")[:, 0]
        self._turn = self._engine.observe("odometry.omega")[:, 0]
        self._touching = self._engine.touching()[:, 0]
        self._goals = np.zeros((num_envs, 2))
        self._distance = np.zeros(num_envs)
        self._actions = np.zeros(num_envs, int)
        self._over = np.ones(num_envs, bool)  # wait for a reset

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: Info | None = None
    ) -> tuple[NDArray[np.float32], Info]:
        """Begins new episodes: in all environments, or in those of ``options={"reset_mask":
        ...}``.
        """
        if isinstance(seed, list):
            self._generators = [np.random.default_rng(one) for one in seed]
        elif seed is not None or not hasattr(self, "_generators"):
            self._generators = [
                np.random.default_rng(None if seed is None else seed + i)
                for i in range(self.num_envs)
            ]
        mask = (
            np.ones(self.num_envs, bool)
            if not options or "reset_mask" not in options
            else np.asarray(options["reset_mask"], bool)
        )
        self._begin(np.flatnonzero(mask))
        return self._observations(), {}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Info
    ]:
        """One action of 0.1 s in every environment."""
        begun = np.zeros(self.num_envs, bool)
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and self._over.any():
            begun = self._over.copy()
            self._begin(np.flatnonzero(begun))
        wanted = np.clip(np.asarray(actions, np.float64).reshape(self.num_envs, 2), -1.0, 1.0)
        commands = np.empty((self.num_envs, 1, 2))
        commands[:, 0, 0] = (wanted[:, 0] + 1.0) / 2.0 * SPEED_M_S
        commands[:, 0, 1] = wanted[:, 1] * TURN_RAD_S
        commands[begun] = np.nan  # these show their beginning: their first action is the next one
        self._engine.step(commands, STEPS)
        if begun.any():
            self._engine.reset(begun)
        before, self._distance = self._distance, self._distances()
        self._actions += 1
        success = self._distance < GOAL_M
        collision = (self._touching > 0) & ~success
        terminated = (success | collision) & ~begun
        truncated = (self._actions >= MOST_ACTIONS) & ~terminated & ~begun
        rewards = before - self._distance + 5.0 * success - 5.0 * collision - 0.01
        rewards[begun] = 0.0
        self._actions[begun] = 0
        self._over = terminated | truncated
        info: Info = {"success": success & self._over, "collision": collision & self._over}
        observations = self._observations()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._over.any():
            info["final_obs"] = np.array(
                [
                    observation if over else None
                    for observation, over in zip(observations, self._over)
                ],
                dtype=object,
            )
            info["_final_obs"] = self._over.copy()
            info["final_info"] = {
                "success": info["success"].copy(),
                "collision": info["collision"].copy(),
            }
            info["_final_info"] = self._over.copy()
            self._begin(np.flatnonzero(self._over))
            observations = self._observations()
        return observations, rewards, terminated, truncated, info

    def close_extras(self, **_: object) -> None:
        self._engine.close()

    @property
    def rooms(self) -> list[Room]:
        """The room of each environment's episode."""
        return list(self._rooms)

    def _room(self, number: int) -> Room:
        return make_room(self._first_room + number, obstacles=self._obstacles)

    def _begin(self, indices: NDArray[np.intp]) -> None:
        for i in indices:
            self._rooms[i] = self._room(int(self._generators[i].integers(TEST_ROOMS)))
            self._engine.reset(
                int(i), seed=int(self._generators[i].integers(2**31)), text=self._rooms[i].sdf
            )
            self._goals[i] = self._rooms[i].goal
        self._actions[indices] = 0
        self._over[indices] = False
        self._distance[indices] = self._distances()[indices]

    def _distances(self) -> NDArray[np.float64]:
        return np.hypot(*(self._goals - self._place[:, :2]).T)

    def _observations(self) -> NDArray[np.float32]:
        w, x, y, z = self._turned.T
        heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        ahead = self._goals - self._place[:, :2]
        bearing = np.arctan2(ahead[:, 1], ahead[:, 0]) - heading
        seen = np.nan_to_num(self._ranges, posinf=RANGE_M, neginf=0.0) / RANGE_M
        columns = [
            np.clip(seen, 0.0, 1.0),
            np.clip(self._distance / RANGE_M, 0.0, 1.0)[:, None],
            np.cos(bearing)[:, None],
            np.sin(bearing)[:, None],
            self._speed[:, None] / SPEED_M_S,
            self._turn[:, None],
        ]
        observations = np.concatenate(columns, axis=1).astype(np.float32)
        return np.clip(observations, self._box.low, self._box.high)


class NavigateEnv(gymnasium.Env):
    """Navigate-v0, one of them."""

    metadata = {"render_modes": []}

    def __init__(self, render_mode: None = None, **options: Any) -> None:
        self._one = NavigateVectorEnv(
            1, autoreset_mode=AutoresetMode.DISABLED, render_mode=render_mode, **options
        )
        self.observation_space = self._one.single_observation_space
        self.action_space = self._one.single_action_space
        self.render_mode = None

    def reset(
        self, *, seed: int | None = None, options: Info | None = None
    ) -> tuple[NDArray[np.float32], Info]:
        super().reset(seed=seed)
        observations, _ = self._one.reset(seed=seed)
        return observations[0], {}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, Info]:
        observations, rewards, terminated, truncated, info = self._one.step(
            np.asarray(action)[None]
        )
        return (
            observations[0],
            float(rewards[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            {name: bool(values[0]) for name, values in info.items()},
        )

    @property
    def room(self) -> Room:
        """The room of this episode."""
        return self._one.rooms[0]

    def close(self) -> None:
        self._one.close()


gymnasium.register(
    "ruedo/Navigate-v0",
    entry_point="ruedo.gym:NavigateEnv",
    vector_entry_point="ruedo.gym:NavigateVectorEnv",
)
