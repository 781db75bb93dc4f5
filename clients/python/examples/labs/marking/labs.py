"""How the labs are marked: the world of each, what a program must deliver, and when it passes.

A student's file has a class for each lab, derived from the one here. Its program() is a generator:
it yields (m/s, rad/s) ten times a second, and reads self.view in between; any further results that
the lab asks for go into the attributes that the class names. A missing lab has failed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import ruedo

Command = tuple[float, float]

SIDE = 2.0  # m, of squares
APART = 0.8  # m, from the wall
ROOM = [
    ((-4.0, -3.0), (4.0, -3.0)),
    ((4.0, -3.0), (4.0, 3.0)),
    ((4.0, 3.0), (-4.0, 3.0)),
    ((-4.0, 3.0), (-4.0, -3.0)),
]
INSIDE = [((-1.0, -3.0), (-1.0, -0.5)), ((1.5, 3.0), (1.5, 1.0)), ((2.0, -1.5), (4.0, -1.5))]
THICKNESS = 0.1  # m, of walls
TRACK_ERROR = 0.02  # as in labs.yaml


def world(lab: str) -> ruedo.World:
    made = ruedo.World(lab)
    walls = {"Square": [], "UmbMark": [], "WallFollowing": ROOM}.get(lab, ROOM + INSIDE)
    for a, b in walls:
        made.wall(*a, *b, thickness=THICKNESS)
    start = {"WallFollowing": (-3.0, -1.5, 0.0)}.get(lab, (-2.5, 1.0, 0.4) if walls else (0, 0, 0))
    return made.robot("p3at", *start)


class Failed(Exception):
    """Why a lab has not passed."""


class Lab:
    seconds = 40.0  # that the program has

    def __init__(self) -> None:
        self.view: Any = None
        self._way: list[np.ndarray] = []
        self._running: Iterator[Command] | None = None

    def program(self) -> Iterator[Command]:
        raise Failed("nothing was handed in")

    def judge(self, way: np.ndarray) -> None:
        """Raises Failed. way: the robot's true positions, (n, 2) m, ten a second."""

    def __call__(self, view: Any) -> Command | str:
        self.view = view
        self._way.append(self.true_pose()[:2])
        self._running = self._running or self.program()
        command = next(self._running, None) if view.time < self.seconds else None
        if command is not None:
            return command
        self.judge(np.array(self._way))
        return "done"

    def odometry(self) -> np.ndarray:
        """x, y, angle turned (m, m, rad), by the wheels."""
        return np.array([float(self.view[f"odometry.{name}"]) for name in ("x", "y", "theta")])

    def true_pose(self) -> np.ndarray:
        """x, y, heading (m, m, rad), as a camera on the ceiling would see it."""
        x, y = self.view["pose.pos"][:2]
        w, _, _, z = self.view["pose.orientation"]
        return np.array([x, y, 2.0 * math.atan2(z, w)])


class Square(Lab):
    """A square of 2 m, turning left, back to its start."""

    seconds = 70.0

    def judge(self, way: np.ndarray) -> None:
        corners = np.array([(SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE), (0.0, 0.0)])
        after = 0
        for x, y in corners:
            near = np.flatnonzero(np.hypot(*(way[after:] - (x, y)).T) < 0.3)
            if not len(near):
                raise Failed(f"was not at the corner {x:g}, {y:g} in its turn")
            after += near[0] + 1
        if np.hypot(*way[-1]) > 0.3:
            raise Failed(f"ends {np.hypot(*way[-1]):.2f} m from where it began")


class WallFollowing(Lab):
    """Along the walls of a room, 0.8 m away."""

    def judge(self, way: np.ndarray) -> None:
        apart = np.minimum(4.0 - abs(way[50:, 0]), 3.0 - abs(way[50:, 1])) - THICKNESS / 2
        if length(way) < 6.0:
            raise Failed(f"went {length(way):.1f} m, and 6 are asked for")
        if not abs(np.median(apart) - APART) < 0.2:
            raise Failed(f"was {np.median(apart):.2f} m from the wall, not {APART}")


class SonarAvoidance(Lab):
    """Around a room, by sonars alone, touching nothing (labs.yaml expects that of all labs)."""

    def judge(self, way: np.ndarray) -> None:
        if length(way) < 5.0:
            raise Failed(f"went {length(way):.1f} m, and 5 are asked for")


class UmbMark(Lab):
    """Stores in track_error by how much the odometry overestimates the robot's track."""

    seconds = 120.0
    track_error = math.nan

    def judge(self, way: np.ndarray) -> None:
        if not abs(self.track_error - TRACK_ERROR) < 0.005:
            raise Failed(f"measured {self.track_error:+.3f} for the track's error")


class Mapping(Lab):
    """Stores in points the occupied places of the world, (n, 2) m."""

    points = np.zeros((0, 2))

    def judge(self, way: np.ndarray) -> None:
        walls = np.concatenate(
            [np.linspace(a, b, 1 + round(10 * math.dist(a, b))) for a, b in ROOM + INSIDE]
        )
        apart = np.linalg.norm(np.asarray(self.points)[:, None] - walls, axis=2)
        if apart.size == 0 or np.mean(apart.min(axis=1) < 0.2) < 0.9:
            raise Failed("more than a tenth of what it has for taken is free")
        if np.mean(apart.min(axis=0) < 0.2) < 0.6:
            raise Failed(f"knows {np.mean(apart.min(axis=0) < 0.2):.0%} of the walls, not 60 %")


class ParticleFilter(Lab):
    """Stores in estimate where the robot is (x, y, heading), by a map, odometry and scans alone."""

    estimate = np.full(3, math.nan)

    def judge(self, way: np.ndarray) -> None:
        off = float(np.hypot(*(self.estimate[:2] - way[-1])))
        if not off < 0.4:
            raise Failed(f"believes to be {off:.2f} m from where it is")


def length(way: np.ndarray) -> float:
    return float(np.hypot(*np.diff(way, axis=0).T).sum())
