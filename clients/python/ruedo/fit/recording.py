"""A recorded drive, whatever file it came from: arrays of one robot, in s, m and rad."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path as File

import numpy as np
from numpy.typing import NDArray

from .errors import FitError

Array = NDArray[np.float64]


@dataclass(eq=False)
class Path:
    """Poses over time. pose (N, 3): x, y (m), heading (rad, unwrapped), of the robot in the
    world.
    """

    time: Array  # (N,) s, increasing
    pose: Array
    source: str  # where it comes from: "motion capture", "SLAM", "simulation"

    def __post_init__(self) -> None:
        self.time, self.pose = sorted_rows(self.time, self.pose)
        if len(self.pose):
            self.pose[:, 2] = np.unwrap(self.pose[:, 2])

    def at(self, time: Array) -> Array:
        """(M, 3) poses at these times (s), linear between neighbours."""
        return np.stack([np.interp(time, self.time, self.pose[:, k]) for k in range(3)], axis=1)

    def length_m(self) -> float:
        return float(np.hypot(*np.diff(self.pose[:, :2], axis=0).T).sum())


@dataclass(eq=False)
class Wheels:
    """Encoders. turned (N, W): rad that each wheel has turned since the start; for a differential
    drive the left side's and the right side's. steering (N,): rad, of a tricycle's front wheel.
    """

    time: Array
    turned: Array
    steering: Array | None = None
    tick_rad: float = 0.0  # wheel angle of one tick; 0: unknown


@dataclass(eq=False)
class Scans:
    """Scans of one planar range finder. ranges (N, K) m; not finite: no return. pose (N, 3): of the
    robot at each scan, or None.
    """

    time: Array
    ranges: Array
    angle_min: float  # rad, of ray 0
    angle_step: float  # rad
    max_range: float  # m, from which on a reading means "no return"
    pose: Array | None = None
    source: str = ""  # of the poses
    mount: Array | None = None  # (3,) x, y (m), heading (rad) on the robot, where the log says it

    @property
    def angles(self) -> Array:
        return np.asarray(self.angle_min + self.angle_step * np.arange(self.ranges.shape[1]), float)


@dataclass(eq=False)
class Commands:
    """Velocity commands. value (N, 3): m/s ahead, m/s left, rad/s."""

    time: Array
    value: Array


@dataclass(eq=False)
class Imu:
    """rate (N, 3) rad/s, acceleration (N, 3) m/s^2, in the device's frame."""

    time: Array
    rate: Array
    acceleration: Array


@dataclass(eq=False)
class Geometry:
    """Nominal measures of a drive: what the robot believes before any fit."""

    kind: str = "differential"  # or "tricycle", "omni3", "omni4"
    radius_m: float = 0.0  # of the wheels
    track_m: float = (
        0.0  # wheel to wheel; tricycle: wheelbase; omni: centre to wheel, mecanum: (l1 + l2) / 2
    )


@dataclass(eq=False)
class Recording:
    """The contents of a log; None for each stream that it lacks."""

    file: File
    kind: str  # of the file, for people: "CARMEN log"
    truth: Path | None = None
    odometry: Path | None = None  # the robot's own dead reckoning
    wheels: Wheels | None = None
    scans: Scans | None = None
    commands: Commands | None = None
    imu: Imu | None = None
    geometry: Geometry | None = None
    streams: dict[str, Array] = field(default_factory=dict)  # times of each stream, s
    timed: bool = True  # whether times are those of the log
    findings: list[str] = field(default_factory=list)

    def need(self, what: str, why: str) -> None:
        """Raises FitError where the log lacks a stream; what: the name of a member."""
        if getattr(self, what) is None:
            has = [
                name
                for name in ("truth", "odometry", "wheels", "scans", "commands", "imu")
                if getattr(self, name) is not None
            ]
            raise FitError(
                f"{self.file}: {why}; this {self.kind} has {', '.join(has) or 'no stream that a fit reads'}"
            )


def sorted_rows(time: Array, *columns: Array) -> tuple[Array, ...]:
    """By time, the first of equal times: streams of real logs repeat and swap stamps."""
    time = np.asarray(time, float)
    kept, first = np.unique(time, return_index=True)
    return (kept, *(np.asarray(column, float)[first] for column in columns))


def body_steps(pose: Array) -> Array:
    """(N - 1, 3): arc ahead, arc to the left, turn, between poses (N, 3)."""
    step = np.diff(pose, axis=0)
    along = pose[:-1, 2] + step[:, 2] / 2
    stretch = 1 / np.sinc(step[:, 2] / (2 * np.pi))
    ahead = np.cos(along) * step[:, 0] + np.sin(along) * step[:, 1]
    left = -np.sin(along) * step[:, 0] + np.cos(along) * step[:, 1]
    return np.stack([ahead * stretch, left * stretch, step[:, 2]], axis=1)


def composed(first: Array, then: Array) -> Array:
    """(N, 3): poses (N, 3) of things whose poses `then` (N, 3) are as seen from poses `first`."""
    sine, cosine = np.sin(first[:, 2]), np.cos(first[:, 2])
    x, y, heading = then.T
    return np.stack(
        [
            first[:, 0] + cosine * x - sine * y,
            first[:, 1] + sine * x + cosine * y,
            first[:, 2] + heading,
        ],
        axis=1,
    )


def inverse(pose: Array) -> Array:
    """(N, 3): poses of the world as seen from poses (N, 3)."""
    sine, cosine = np.sin(pose[:, 2]), np.cos(pose[:, 2])
    x, y, heading = pose.T
    return np.stack([-cosine * x - sine * y, sine * x - cosine * y, -heading], axis=1)


def wrapped(angle: Array) -> Array:
    """Into [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
