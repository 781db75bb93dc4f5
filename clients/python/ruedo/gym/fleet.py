"""FleetEnv: several Pioneers in one room, each with a goal of its own, as a parallel environment of
PettingZoo.

Observations and actions are those of Navigate-v0, for each robot; its scan sees the others.
Rewards, too, but that touching something costs 5 and ends the episode of that robot, which then
stands where it is, seen by the others. ``infos[robot]`` has ``success`` and ``collision``.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv  # type: ignore[import-untyped, unused-ignore]

from ..arguments import named, whole
from ..engine import Engine, Saved, SavedWorld
from ..rooms import TEST_ROOMS, make_fleet_room
from .drive import GOAL_M, MOST_SPEED, goal_term
from .environments import MOST_SEED, PICTURE, MadeAnew, check_options
from .task import (
    DRIVE,
    SPEED_M_S,
    checked_actions,
    clipped,
    drive_commands,
    drive_rewards,
    headings,
    seen,
)

STEPS = 20  # of 5 ms in an action
LIMITS = np.array([1.0, 1.0, 1.0, *MOST_SPEED], np.float32)  # of what follows the beams

Each = dict[str, Any]


class SavedFleet(Saved):
    """A state that `FleetEnv.save` returned; it does not change."""

    def __init__(self, world: SavedWorld, episode: Each) -> None:
        self._saved_world, self._episode = world, episode

    def __repr__(self) -> str:
        return f"<ruedo.gym.SavedFleet: at {self._saved_world.time:g} s>"


class FleetEnv(MadeAnew, ParallelEnv):  # type: ignore[misc]    # PettingZoo's generics
    """``robots`` of them, called robot0, robot1, ... settings: as those of `ruedo.Engine`."""

    metadata: ClassVar[Each] = {
        "name": "ruedo_fleet_v0",
        "render_modes": ["rgb_array"],
        "render_fps": 10,
    }
    most_actions = 600

    def __init__(
        self,
        robots: int = 4,
        *,
        beams: int = 24,
        split: Literal["train", "test"] = "train",
        noise: bool = True,
        settings: Mapping[str, object] | None = None,
        render_mode: Literal["rgb_array"] | None = None,
    ) -> None:
        robots = whole("robots", robots, 1, 32)
        if split not in ("train", "test"):
            raise ValueError(f"split is {split!r}; allowed are 'train' and 'test'")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode is {render_mode!r}; allowed are None and 'rgb_array'")
        self.possible_agents = [f"robot{i}" for i in range(robots)]
        self.agents: list[str] = []
        self.render_mode = render_mode
        low = np.concatenate([np.zeros(whole("beams", beams, 2, 1024) + 1), -LIMITS[1:]]).astype(
            np.float32
        )
        high = np.concatenate([np.ones(beams), LIMITS]).astype(np.float32)
        self._spaces = {
            name: spaces.Box(low, high, dtype=np.float32) for name in self.possible_agents
        }
        self._drives = {
            name: spaces.Box(DRIVE.low, DRIVE.high, dtype=np.float32)
            for name in self.possible_agents
        }
        self._first = 0 if split == "train" else TEST_ROOMS
        self._generator = np.random.default_rng()
        self._engine = Engine(
            "FleetEnv",
            text=self._text(0),
            noise=noise,
            settings={
                **{
                    f"{name}/lrf.lidar.scan.horizontal.samples": beams
                    for name in self.possible_agents
                },
                **named("settings", settings, '{"robot0/lrf.update_rate": 10}'),
            },
            disable=[
                f"{name}/{device}"
                for name in self.possible_agents
                for device in ("camera", "sonar_front", "sonar_rear")
            ],
        )
        observe = self._engine.observe
        self._places, self._turned = observe("pose.pos")[0], observe("pose.orientation")[0]
        self._ranges = observe("lrf.ranges")[0]
        self._speed, self._turn = observe("odometry.v")[0], observe("odometry.omega")[0]
        self._touching = self._engine.touching()[0]
        self._actions = 0

    def observation_space(self, agent: str) -> spaces.Box:
        return self._spaces[agent]

    def action_space(self, agent: str) -> spaces.Box:
        return self._drives[agent]

    def reset(self, seed: int | None = None, options: Each | None = None) -> tuple[Each, Each]:
        check_options(options)
        if seed is not None:
            self._generator = np.random.default_rng(whole("seed", seed, 0, MOST_SEED))
        number = int(self._generator.integers(TEST_ROOMS))
        self._engine.reset(
            0, seed=int(self._generator.integers(2**31)), text=self._text(self._first + number)
        )
        self.agents = list(self.possible_agents)
        self._actions = 0
        self._distance = self._distances()
        return self._begun()

    def step(self, actions: Each) -> tuple[Each, Each, Each, Each, Each]:
        self._check_begun("the first step()")
        if not isinstance(actions, dict):
            raise TypeError(f"actions are a dict, an action for each robot, not {actions!r}")
        if strangers := [name for name in actions if name not in self.possible_agents]:
            raise ValueError(f"{strangers[0]!r} is not one of {self.possible_agents}")
        commands = np.zeros((1, len(self.possible_agents), 2))
        for i, name in enumerate(self.possible_agents):
            if name in self.agents:
                if name not in actions:
                    raise ValueError(f"no action for {name}; each of {self.agents} needs one")
                action = checked_actions(actions[name], self._drives[name])
                commands[0, i] = drive_commands(action)[0, 0]
        self._engine.step(commands, STEPS)
        self._actions += 1
        before, self._distance = self._distance, self._distances()
        success = self._distance < GOAL_M
        collision = (self._touching > 0) & ~success
        rewards = drive_rewards(before - self._distance, success, collision)
        over = success | collision
        late = np.full(len(over), self._actions >= self.most_actions) & ~over
        infos = {
            name: {"success": bool(success[i]), "collision": bool(collision[i])}
            for i, name in enumerate(self.possible_agents)
            if name in self.agents
        }
        result = (
            self._of_agents(self._observations()),
            self._of_agents(rewards.tolist()),
            self._of_agents(over.tolist()),
            self._of_agents(late.tolist()),
            infos,
        )
        self.agents = [
            name
            for i, name in enumerate(self.possible_agents)
            if name in self.agents and not over[i] and not late[i]
        ]
        return result

    def save(self) -> SavedFleet:
        """The episode as it stands, with all that decides what follows: the world, the goals, who
        is still on the way, and the seeds of the episodes to come.
        """
        self._check_begun("save()")
        return SavedFleet(self._engine.save(), self._episode())

    def restore(self, saved: SavedFleet) -> tuple[Each, Each]:
        """Restores the episode: the same actions then have the same results, byte for byte. Returns
        the observations and infos of those on the way, as `reset` does.
        """
        if not isinstance(saved, SavedFleet):
            raise TypeError(f"restore() takes what save() gave, not {saved!r}")
        self._engine.restore(saved._saved_world)
        for name, value in copy.deepcopy(saved._episode).items():
            setattr(self, name, value)
        return self._begun()

    def render(self) -> NDArray[np.uint8] | None:
        """Seen from above, (256, 256, 3)."""
        if self.render_mode is None:
            return None
        frame: NDArray[np.uint8] = self._engine.observe("overview.data")[0, 0]
        return frame.reshape(PICTURE, PICTURE, 3).copy()

    def close(self) -> None:
        self._engine.close()

    def _check_begun(self, call: str) -> None:
        if not hasattr(self, "_distance"):
            raise gymnasium.error.ResetNeeded(f"call reset() before {call}")

    def _begun(self) -> tuple[Each, Each]:
        return self._of_agents(self._observations()), {name: {} for name in self.agents}

    def _episode(self) -> Each:
        """The state of an episode besides the engine's world."""
        names = ("agents", "_goals", "_distance", "_actions", "_generator")
        return copy.deepcopy({name: getattr(self, name) for name in names})

    def _text(self, number: int) -> str:
        scene, self._goals = make_fleet_room(number, len(self.possible_agents))
        return scene.seen_from_above() if self.render_mode else scene.sdf

    def _distances(self) -> NDArray[np.float64]:
        count = len(self.possible_agents)
        distances: NDArray[np.float64] = np.linalg.norm(
            np.array(self._goals) - self._places[:count, :2], axis=1
        )
        return distances

    def _observations(self) -> NDArray[np.float32]:
        count = len(self.possible_agents)
        to_goal = np.array(self._goals) - self._places[:count, :2]
        row = [
            seen(self._ranges),
            goal_term(to_goal, headings(self._turned[:count])),
            self._speed[:, None] / SPEED_M_S,
            self._turn[:, None],
        ]
        space = self._spaces[self.possible_agents[0]]
        return clipped(np.concatenate(row, axis=1, dtype=np.float32), space.low, space.high)

    def _of_agents(self, values: Any) -> Each:
        return {
            name: values[i] for i, name in enumerate(self.possible_agents) if name in self.agents
        }
