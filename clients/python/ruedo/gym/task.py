"""A task for learning: its scenes, observations, actions, rewards and ends.

`Task` is the class that authors derive from; docs/tasks.md builds one from nothing.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ..arguments import array, shown
from ..engine import Engine
from ..lcmtypes import joint_command_t
from ..rooms import Scene
from ..world import World

SPEED_M_S = 0.5
TURN_RAD_S = 1.0
RANGE_M = 8.0
DRIVE = spaces.Box(-1.0, 1.0, (2,), np.float32)


class Outcome(NamedTuple):
    """The outcome of an action; each field is an array of (environments,)."""

    rewards: NDArray[np.float64]
    success: NDArray[np.bool_]  # the episode ends, because the task is done
    failure: NDArray[np.bool_]  # the episode ends, because it cannot be done any more


class Task:
    """A task, whose episodes run side by side in the copies of one engine: every array below has a
    row for each environment.

    A subclass sets ``observation_space`` (of one environment), and defines `observe` and
    `outcome`. It sets ``world`` or defines `scene`; the other attributes and methods have defaults.
    Arrays with a row for each environment that it keeps as attributes belong to the episodes:
    `TaskVectorEnv.save` saves them. Its other attributes may be changed between episodes, for a
    curriculum; scenes that begin later follow.

    world: of every episode, if `scene` is not defined: a file, the name of a world, or a
    `ruedo.World`. max_episode_steps: actions until an episode is truncated; -1: never.
    action_seconds: sim time of an action, a multiple of the world's step. settings: of devices, as
    ``--set``. disable: devices that are not needed, "robot/camera". randomize: what is drawn anew
    for each episode, as of `ruedo.Engine`.
    """

    observation_space: spaces.Space[Any]
    action_space: spaces.Space[Any] = DRIVE
    world: str | os.PathLike[str] | World | None = None
    max_episode_steps: int = 400
    action_seconds: float = 0.1
    settings: Mapping[str, object] = {}
    disable: Sequence[str] = ()
    randomize: Mapping[str, str] = {}

    # There when an environment has been made.
    engine: Engine
    num_envs: int
    scenes: list[Any]  # of each environment's episode
    acting: NDArray[np.bool_]  # during `commands`: those that take an action; the others begin now

    def scene(self, number: int) -> Scene | World | str:
        """The scene of that number: a world, its SDF, or a `ruedo.rooms.Scene` (or a subclass),
        which can carry what else belongs to it, such as the goal. The same number gives the same
        scene; all scenes have the same robots with the same devices.
        """
        raise NotImplementedError(f"{type(self).__name__} has neither a world nor scene()")

    def setup(self) -> None:
        """Makes arrays, looks for sensors: the engine is there. Once, before the first episode."""

    def begin(self, episodes: NDArray[np.intp]) -> None:
        """New episodes have begun in the environments of these indices, in ``scenes[i]``."""

    def commands(self, actions: NDArray[Any]) -> NDArray[np.float64] | None:
        """The velocities that actions command: (environments, driven robots, 2) as (m/s, rad/s), or
        3 as (m/s ahead, m/s left, rad/s); None: none (of robots without a drive, see
        `command_joints`). By default actions are those of `drive_commands`.
        """
        return drive_commands(actions)

    def outcome(self) -> Outcome | tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Rewards, successes and failures after an action. Called once per action."""
        raise NotImplementedError(f"{type(self).__name__} has no outcome()")

    def info(self) -> Mapping[str, NDArray[Any]]:
        """Further entries of ``info`` with an observation: a number for each environment."""
        return {}

    def observe(self) -> Any:
        """Observations after an action or at an episode's beginning: an array of the shape and type
        of ``observation_space`` with a row for each environment; a dict of these for a Dict.
        """
        raise NotImplementedError(f"{type(self).__name__} has no observe()")

    # ---- The state that a task reads.

    def sensor(self, name: str, robot: str | None = None) -> NDArray[Any]:
        """(environments, ...): the newest values of a sensor's field, "lrf.ranges"; a read-only
        view, which the engine keeps up to date (look for it once, in `setup`).

        robot: its name; by default the first that has such a sensor.
        """
        values = self.engine.observe(name)
        if robot is None:
            return values[:, 0]
        device = name.rpartition(".")[0].partition("/")[0].lower()
        found = [owner for owner, *names in self.engine.devices if device in map(str.lower, names)]
        owners = list(dict.fromkeys(found))
        if robot not in owners:
            raise ValueError(
                f"{type(self).__name__}: {shown(robot)} has no {device!r}; {owners} have. A model has "
                "a pose if it has a drive or a sensor"
            )
        return values[:, owners.index(robot)]

    def position(self, robot: str | None = None) -> NDArray[np.float64]:
        """(environments, 3): true positions in the world, m; a view like `sensor`'s."""
        return self.sensor("pose.pos", robot)

    def heading(self, robot: str | None = None) -> NDArray[np.float64]:
        """(environments,): true headings, rad in [-pi, pi]."""
        return headings(self.sensor("pose.orientation", robot))

    def command_joints(
        self,
        robot: str,
        joints: Sequence[str],
        values: NDArray[Any],
        mode: int = joint_command_t.VELOCITY,
    ) -> None:
        """Commands joints, from `commands`. values: (environments, joints), in rad/s or m/s, or as
        mode says: one of ``joint_command_t``'s, such as POSITION or EFFORT.
        """
        message = joint_command_t()
        message.n, message.name = len(joints), list(joints)
        message.mode = bytes([mode]) * len(joints)
        for i in np.flatnonzero(self.acting).tolist():
            message.value = values[i].tolist()
            self.engine.command(i, f"{robot}/joint_command", message)

    def touching(self) -> NDArray[np.bool_]:
        """(environments,): whether a driven robot ran into something during the last action."""
        touched: NDArray[np.bool_] = np.any(self.engine.touching() > 0, axis=1)
        return touched


def headings(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """The headings of (n, 4) orientations w, x, y, z: rad in [-pi, pi]."""
    w, x, y, z = quaternions.T
    heading: NDArray[np.float64] = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return heading


def drive_commands(actions: NDArray[Any]) -> NDArray[np.float64]:
    """Actions in [-1, 1]: the speed ahead, from 0 to 0.5 m/s, and the turn rate, 1 rad/s at 1."""
    commands = clipped(np.asarray(actions, np.float64).reshape(-1, 1, 2), -1.0, 1.0)
    commands[..., 0] += 1.0
    commands *= (0.5 * SPEED_M_S, TURN_RAD_S)
    return commands


def drive_rewards(
    progress: NDArray[np.float64], success: NDArray[np.bool_], collision: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """The reward of a step towards a goal: progress in m, + 5 for success, - 5 for a collision, -
    0.01.
    """
    rewards: NDArray[np.float64] = progress + 5.0 * success - 5.0 * collision - 0.01
    return rewards


def seen(ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    """A scan as a network likes it: divided by 8 m and cut at 1; what is nearer than the device can
    measure is 0.
    """
    return clipped(ranges * np.float32(1.0 / RANGE_M), 0.0, 1.0)


def clipped(values: NDArray[Any], low: Any, high: Any) -> NDArray[Any]:
    """np.clip, in a third of its time with few values."""
    result: NDArray[Any] = np.minimum(np.maximum(values, low), high)
    return result


def checked_actions(actions: Any, space: spaces.Space[Any]) -> NDArray[Any]:
    """Finite numbers in the space's shape; choices of a discrete space as integers. Raises
    TypeError and ValueError.
    """
    given = array(f"actions are numbers of shape {space.shape}", actions)
    if given.shape != space.shape:
        raise ValueError(f"actions have the shape {space.shape}, not {given.shape}")
    if not np.isfinite(given).all():
        raise ValueError(f"actions are finite numbers, not {shown(actions)}")
    if isinstance(space, spaces.Box):
        return given
    choices = given.astype(np.int64)
    if (choices != given).any() or not space.contains(choices.astype(space.dtype)):
        raise ValueError(f"actions are choices of {space}, not {shown(actions)}")
    return choices
