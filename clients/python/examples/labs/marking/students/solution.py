"""A model solution of all labs; a student's file has the same form."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path += [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2])]

import labs
from labs import Command
from mapping import CELL, HALF, Grid
from particle_filter import BEAMS, Filter

ANGLES = np.radians(np.arange(-90, 91))  # of the range finder's rays
AHEAD = 0.16  # m, from the robot's centre to the range finder


def wander(lab: labs.Lab) -> Iterator[Command]:
    turning = 0.0
    while True:
        ranges = lab.view["lrf.ranges"]
        if ranges[50:131].min() > 0.8:
            turning = 0.0
            yield 0.35, 0.1
        else:
            turning = turning or (0.8 if ranges[90:].min() > ranges[:91].min() else -0.8)
            yield 0.0, turning


def square(lab: labs.Lab, sign: float) -> Iterator[Command]:
    """By the odometry alone."""
    begin = lab.odometry()
    for side in range(4):
        corner, heading = lab.odometry(), begin[2] + sign * side * math.pi / 2
        while (rest := labs.SIDE - math.dist(lab.odometry()[:2], corner[:2])) > 0.01:
            yield min(0.4, 0.03 + 0.8 * rest), 1.5 * (heading - lab.odometry()[2])
        while abs(turn := heading + sign * math.pi / 2 - lab.odometry()[2]) > 0.01:
            yield 0.0, math.copysign(min(0.8, 0.02 + 1.2 * abs(turn)), turn)
        for _ in range(5):
            yield 0.0, 0.0


class Square(labs.Square):
    def program(self) -> Iterator[Command]:
        yield from square(self, 1.0)


class WallFollowing(labs.WallFollowing):
    def program(self) -> Iterator[Command]:
        while True:
            ranges = self.view["lrf.ranges"]
            right = (ANGLES < -0.8) & np.isfinite(ranges)
            x, y = ranges[right] * np.cos(ANGLES[right]), ranges[right] * np.sin(ANGLES[right])
            slope, offset = np.polyfit(x, y, 1)
            if ranges[67:114].min() < labs.APART + 0.6:  # a corner: to the left
                yield 0.1, 0.8
            else:
                apart = min(abs(offset) / math.hypot(1.0, slope), 2.0)
                turn = 1.2 * (labs.APART - apart) + 1.5 * math.atan(slope)
                yield 0.3, float(np.clip(turn, -0.8, 0.8))


class SonarAvoidance(labs.SonarAvoidance):
    def program(self) -> Iterator[Command]:
        turning = 0.0
        while True:
            near = np.clip(1.0 - self.view["sonar_front.range"] / 1.2, 0.0, 1.0)
            left, right = near[:4].max(), near[4:].max()
            if near[2:6].max() > 0.3:
                turning = turning or (0.8 if left < right else -0.8)
                yield 0.0 if near[2:6].max() > 0.5 else 0.1, turning
            else:
                turning = 0.0
                yield 0.35 * (1.0 - max(left, right)), 0.8 * float(right - left)


class UmbMark(labs.UmbMark):
    def program(self) -> Iterator[Command]:
        """One square each way: its true end beside the odometry's, in the frame of its
        start.
        """
        ends = []
        for sign in (1.0, -1.0):
            begins = self.true_pose(), self.odometry()
            yield from square(self, sign)
            true, believed = (
                in_frame(end, begin)
                for end, begin in zip((self.true_pose(), self.odometry()), begins)
            )
            ends.append(true - believed)
        alpha = (ends[0][0] + ends[1][0]) / (-4.0 * labs.SIDE)
        self.track_error = -alpha / (math.pi / 2)


def in_frame(pose: np.ndarray, frame: np.ndarray) -> np.ndarray:
    c, s = math.cos(frame[2]), math.sin(frame[2])
    x, y = pose[:2] - frame[:2]
    return np.array([c * x + s * y, c * y - s * x])


class Mapping(labs.Mapping):
    def program(self) -> Iterator[Command]:
        """At known poses, as lab 5 has it."""
        grid = Grid()
        for decision, command in enumerate(wander(self)):
            if decision % 4 == 0:
                ranges = self.view["lrf.ranges"]
                hit = np.isfinite(ranges)
                x, y, heading = self.true_pose()
                origin = np.array([x + AHEAD * math.cos(heading), y + AHEAD * math.sin(heading)])
                rays = heading + ANGLES[hit]
                ends = np.stack([np.cos(rays), np.sin(rays)], axis=1) * ranges[hit, None]
                grid.add(origin, origin + ends)
                self.points = (np.argwhere(grid.log_odds > 1) + 0.5) * CELL - HALF
            yield command


class ParticleFilter(labs.ParticleFilter):
    def program(self) -> Iterator[Command]:
        filter, before = Filter(10_000, np.random.default_rng(1)), self.odometry()
        for command in wander(self):
            now = self.odometry()
            way, side = in_frame(now, before)
            if math.hypot(way, side) > 0.02 or abs(now[2] - before[2]) > 0.02:
                filter.move(way, side, now[2] - before[2])
                ranges = np.nan_to_num(self.view["lrf.ranges"][BEAMS], posinf=8.0, neginf=0.0)
                filter.see(ranges, ANGLES[BEAMS], AHEAD)
                before = now
            self.estimate = filter.estimate()
            yield command
