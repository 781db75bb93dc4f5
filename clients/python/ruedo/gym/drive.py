"""The base of the shipped tasks: a robot that drives, observed sensors, a
goal, and options for all of these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from ..arguments import finite, named, shown, texts, whole, word
from ..engine import Engine
from ..world import World
from .task import (
    DRIVE,
    RANGE_M,
    SPEED_M_S,
    TURN_RAD_S,
    Outcome,
    Task,
    clipped,
    headings,
    seen,
)

SENSORS = ("lrf", "sonar", "odometry", "camera", "depth")
OWN = ("collisions", "motion", "odometry", "pose")  # kinds of what a robot has without a sensor
GOAL_M = 0.4

Terms = dict[str, NDArray[Any]]


class DriveTask(Task):
    """A robot, called "robot", drives. A subclass defines `scene`, `begin`, `outcome`, and `terms`
    if it observes more than sensors: it tells their spaces to this constructor.

    robot: one of Ruedo's ("p3dx", "turtle") or a file. sensors: what is observed besides the
    task's own terms: "lrf" (``beams`` ranges of its lidar), "sonar" (all its sonars), "odometry"
    (speed and turn rate), "camera" (``pixels`` x ``pixels``, colour) and "depth" (of the same
    camera). observations: "array", numbers in a row or a single picture; "dict", each term by its
    name. actions: "continuous" or "discrete", see `commands`. rewards: weights that replace those
    of the task, by name.
    """

    # Of discrete actions, as continuous ones: ahead, ahead to the left, to the right, turning left,
    # right.
    choices: tuple[tuple[float, float], ...] = (
        (1.0, 0.0),
        (0.0, 1.0),
        (0.0, -1.0),
        (-1.0, 1.0),
        (-1.0, -1.0),
    )
    sensors: tuple[str, ...] = ("lrf", "odometry")
    weights: Mapping[str, float] = {"progress": 1.0, "success": 5.0, "failure": -5.0, "step": -0.01}
    slowest_m_s = 0.0

    def __init__(
        self,
        terms: Mapping[str, spaces.Box] | None = None,
        *,
        robot: str = "p3at",
        sensors: Iterable[str] | None = None,
        beams: int = 24,
        pixels: int = 64,
        observations: Literal["array", "dict"] = "array",
        actions: Literal["continuous", "discrete"] = "continuous",
        rewards: Mapping[str, float] | None = None,
    ) -> None:
        self.robot = word("robot", robot)
        self.beams = whole("beams", beams, 2, 1024)
        self.pixels = whole("pixels", pixels, 8, 1024)
        if sensors is not None:
            self.sensors = tuple(texts("sensors", sensors))
        self.weights = {**self.weights, **self._checked_weights(rewards)}
        if actions not in ("continuous", "discrete"):
            raise ValueError(
                f"actions is {shown(actions)}; allowed are 'continuous' and 'discrete'"
            )
        if observations not in ("array", "dict"):
            raise ValueError(
                f"observations is {shown(observations)}; allowed are 'array' and 'dict'"
            )
        self.action_space = DRIVE if actions == "continuous" else spaces.Discrete(len(self.choices))
        self._choose_sensors()
        self._own_terms = dict(terms or {})
        self._make_space(observations == "dict")

    def terms(self) -> Terms:
        """The task's own terms, by name: (environments, numbers)."""
        return {}

    def setup(self) -> None:
        self._values = [
            [self.sensor(field, "robot") for field in sensor.fields] for sensor in self._observed
        ]
        self._touching = self.engine.touching()[:, 0]

    def observe(self) -> Any:
        values: Terms = {
            sensor.name: sensor.convert(*fields)
            for sensor, fields in zip(self._observed, self._values)
        }
        values |= self.terms()
        if isinstance(self.observation_space, spaces.Dict):
            return {
                name: _within(values[name], space) for name, space in self.observation_space.items()
            }
        if len(self._names) == 1:
            return _within(values[self._names[0]], self.observation_space)
        row = np.concatenate([values[name] for name in self._names], axis=1, dtype=np.float32)
        return _within(row, self.observation_space)

    def commands(self, actions: NDArray[Any]) -> NDArray[np.float64]:
        """Continuous actions: the speed ahead, from the slowest at -1 (0, or -0.5 m/s in Push-v0)
        to 0.5 m/s at 1, and the turn rate, 1 rad/s at 1. A discrete one is a row of ``choices``.
        """
        if isinstance(self.action_space, spaces.Discrete):
            actions = np.array(self.choices)[actions]
        commands = clipped(np.asarray(actions, np.float64).reshape(-1, 1, 2), -1.0, 1.0)
        speed = 0.5 * (SPEED_M_S - self.slowest_m_s)
        commands *= (speed, TURN_RAD_S)
        commands[..., 0] += SPEED_M_S - speed
        return commands

    def rewarded(
        self,
        progress: NDArray[np.float64],
        success: NDArray[np.bool_],
        failure: NDArray[np.bool_],
    ) -> Outcome:
        """The weighted sum of progress (m), success, failure and the step itself."""
        weights = self.weights
        rewards = weights["progress"] * progress + weights["success"] * success
        if "failure" in weights:
            rewards += weights["failure"] * failure
        return Outcome(rewards + weights["step"], success, failure)

    def _checked_weights(self, rewards: Any) -> dict[str, float]:
        given = named("rewards", rewards, '{"success": 10.0}')
        for name, weight in given.items():
            if name not in self.weights:
                raise ValueError(f"rewards has {shown(name)}; there are {', '.join(self.weights)}")
            finite(f"rewards[{name!r}]", weight)
        return given

    def _choose_sensors(self) -> None:
        """Selects the observed sensors, and disables the others."""
        if wrong := [one for one in self.sensors if one not in SENSORS]:
            raise ValueError(f"sensors has {shown(wrong[0])}; there are {', '.join(SENSORS)}")
        kinds = ["camera" if one == "depth" else one for one in self.sensors]
        with Engine(World().robot(self.robot, name="robot")) as engine:
            devices = [(name, kind) for robot, name, kind in engine.devices if robot == "robot"]
            for one, kind in zip(self.sensors, kinds):
                if kind not in [other for _, other in devices]:
                    raise ValueError(f"sensors has {one!r}, but {self.robot} has no such sensor")
            self._observed = [
                self._sensor(one, [name for name, other in devices if other == kind], engine)
                for one, kind in zip(self.sensors, kinds)
            ]
        self.settings = {
            f"robot/{key}": value
            for sensor in self._observed
            for key, value in sensor.settings.items()
        }
        self.disable = [f"robot/{name}" for name, kind in devices if kind not in (*kinds, *OWN)]

    def _sensor(self, which: str, devices: list[str], engine: Engine) -> _Sensor:
        device = devices[0]
        if which == "lrf":
            space = spaces.Box(0.0, 1.0, (self.beams,), np.float32)
            settings: dict[str, object] = {f"{device}.lidar.scan.horizontal.samples": self.beams}
            return _Sensor("ranges", space, settings, [f"{device}.ranges"], seen)
        if which == "sonar":
            fields = [f"{one}.range" for one in devices]
            count = sum(engine.observe(field).shape[-1] for field in fields)
            space = spaces.Box(0.0, 1.0, (count,), np.float32)
            return _Sensor("sonar", space, {}, fields, _sonars)
        if which == "odometry":
            space = spaces.Box(-MOST_SPEED, MOST_SPEED, dtype=np.float32)
            return _Sensor("velocity", space, {}, ["odometry.v", "odometry.omega"], _velocity)
        n = self.pixels
        settings = {
            f"{device}.camera.image.width": n,
            f"{device}.camera.image.height": n,
            f"{device}.encoding": "rgb",
            f"{device}.update_rate": 1.0 / self.action_seconds,
        }
        if which == "camera":
            picture: spaces.Box = spaces.Box(0, 255, (n, n, 3), np.uint8)
            return _Sensor(
                "camera",
                picture,
                settings,
                [f"{device}.data"],
                lambda data: data.reshape(-1, n, n, 3),
            )
        space = spaces.Box(0.0, 1.0, (n, n, 1), np.float32)
        return _Sensor(
            "depth",
            space,
            {**settings, f"{device}.depth": "true"},
            [f"{device}/depth.data"],
            lambda data: seen(data.view(np.float32).reshape(-1, n, n, 1)),
        )

    def _make_space(self, as_dict: bool) -> None:
        sensors = {sensor.name: sensor.space for sensor in self._observed}
        before: dict[str, spaces.Box] = {
            name: sensors[name] for name in ("ranges", "sonar") if name in sensors
        }
        boxes: dict[str, spaces.Box] = {**before, **self._own_terms, **sensors}
        self._names = list(boxes)
        if not boxes:
            raise ValueError("sensors is empty, and nothing else is observed")
        if as_dict:
            self.observation_space = spaces.Dict(list(boxes.items()))
        elif len(boxes) == 1:
            self.observation_space = boxes[self._names[0]]
        elif any(len(box.shape) > 1 for box in boxes.values()):
            raise ValueError(
                f"{', '.join(boxes)} do not fit into one array: observations='dict' gives each by its name"
            )
        else:
            low, high = (
                np.concatenate([getattr(box, end) for box in boxes.values()])
                for end in ("low", "high")
            )
            self.observation_space = spaces.Box(low, high, dtype=np.float32)


class GoalTask(DriveTask):
    """Drive to a goal on the floor, the scene's ``goal`` (m, m), without touching anything.

    Observes the goal as "goal": its distance / 8 m, cut at 1, and the cosine and sine of its
    bearing, from the true pose; unless ``tells_goal`` is False.
    """

    goal_m = GOAL_M
    tells_goal = True
    own_terms: Mapping[str, spaces.Box] = {}  # behind the goal

    def __init__(self, **options: Any) -> None:
        low = np.array([0.0, -1.0, -1.0], np.float32)
        goal = spaces.Box(low, np.ones(3, np.float32), dtype=np.float32)
        goals = {"goal": goal} if self.tells_goal else {}
        super().__init__({**goals, **self.own_terms}, **options)

    def setup(self) -> None:
        super().setup()
        self._position = self.position("robot")[:, :2]
        self._orientation = self.sensor("pose.orientation", "robot")
        self.goals = np.zeros((self.num_envs, 2))
        self._distance = np.zeros(self.num_envs)

    def begin(self, episodes: NDArray[np.intp]) -> None:
        for i in episodes:
            scene = self.scenes[i]
            if not hasattr(scene, "goal"):
                raise TypeError(
                    f"{type(self).__name__}.scene({scene.number}) has no goal: a GoalTask's scenes are "
                    "ruedo.rooms.Room(number, sdf, start=(x, y, heading), goal=(x, y))"
                )
            self.goals[i] = scene.goal
        self._distance[episodes] = self._distances()[episodes]

    def outcome(self) -> Outcome:
        before, self._distance = self._distance, self._distances()
        success = self._distance < self.goal_m
        return self.rewarded(before - self._distance, success, self.failed() & ~success)

    def failed(self) -> NDArray[np.bool_]:
        """The environments whose robot touches something."""
        touched: NDArray[np.bool_] = self._touching > 0
        return touched

    def terms(self) -> Terms:
        if not self.tells_goal:
            return {}
        return {"goal": goal_term(self.goals - self._position, headings(self._orientation))}

    def _distances(self) -> NDArray[np.float64]:
        ahead = self.goals - self._position
        distances: NDArray[np.float64] = np.hypot(ahead[:, 0], ahead[:, 1])
        return distances


@dataclass(frozen=True)
class _Sensor:
    """An observed sensor: its term, the settings that it needs, and how the term follows
    from its fields.
    """

    name: str
    space: spaces.Box
    settings: dict[str, object]
    fields: list[str]
    convert: Callable[..., NDArray[Any]]


MOST_SPEED = np.array([2.0, 4.0], np.float32)  # of the observed speed / 0.5 m/s, and turn rate


def _velocity(speed: NDArray[np.float64], turn: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([speed / SPEED_M_S, turn], axis=1)


def _sonars(*ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    return seen(np.concatenate(ranges, axis=1))


def goal_term(to_goal: NDArray[np.float64], heading: NDArray[np.float64]) -> NDArray[np.float64]:
    """The goal's distance / 8 m, and cosine and sine of its bearing, (n, 3). to_goal: (n, 2) m, in
    the world. heading: (n,) rad.
    """
    bearing = np.arctan2(to_goal[:, 1], to_goal[:, 0]) - heading
    distance = np.hypot(to_goal[:, 0], to_goal[:, 1])
    return np.stack([distance / RANGE_M, np.cos(bearing), np.sin(bearing)], axis=1)


def _within(values: NDArray[Any], space: spaces.Space[Any]) -> NDArray[Any]:
    """The values in the space's type; numbers are clipped to its limits."""
    assert isinstance(space, spaces.Box)
    if space.dtype == np.uint8:
        return values
    return clipped(values.astype(np.float32, copy=False), space.low, space.high)
