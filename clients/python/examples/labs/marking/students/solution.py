"""A model solution of all labs; a student's file has the same form."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from lab import APART, SIDE, Robot
from mapping import CELL, HALF, Grid
from particle_filter import BEAMS, Filter

ANGLES = np.radians(np.arange(-90, 91))  # of the range finder's rays
AHEAD = 0.16  # m, from the robot's centre to the range finder


def wander(robot: Robot) -> Iterator[None]:
    turning = 0.0
    while True:
        if robot.ranges[50:131].min() > 0.8:
            turning = 0.0
            robot.drive(0.35, 0.1)
        else:
            left, right = robot.ranges[90:].min(), robot.ranges[:91].min()
            turning = turning or (0.8 if left > right else -0.8)
            robot.drive(0.0, turning)
        yield


def square(robot: Robot, sign: float = 1.0) -> None:
    """By the odometry alone."""
    begin = robot.odometry
    for side in range(4):
        corner, heading = robot.odometry, begin[2] + sign * side * math.pi / 2
        while (rest := SIDE - math.dist(robot.odometry[:2], corner[:2])) > 0.01:
            robot.drive(min(0.4, 0.03 + 0.8 * rest), 1.5 * (heading - robot.odometry[2]))
        while abs(turn := heading + sign * math.pi / 2 - robot.odometry[2]) > 0.01:
            robot.drive(0.0, math.copysign(min(0.8, 0.02 + 1.2 * abs(turn)), turn))
        for _ in range(5):
            robot.drive(0.0, 0.0)


def wall_following(robot: Robot) -> None:
    while True:
        right = (ANGLES < -0.8) & np.isfinite(robot.ranges)
        rays, ranges = ANGLES[right], robot.ranges[right]
        slope, offset = np.polyfit(ranges * np.cos(rays), ranges * np.sin(rays), 1)
        if robot.ranges[67:114].min() < APART + 0.6:  # a corner: to the left
            robot.drive(0.1, 0.8)
        else:
            apart = min(abs(offset) / math.hypot(1.0, slope), 2.0)
            turn = 1.2 * (APART - apart) + 1.5 * math.atan(slope)
            robot.drive(0.3, float(np.clip(turn, -0.8, 0.8)))


def sonar_avoidance(robot: Robot) -> None:
    turning = 0.0
    while True:
        near = np.clip(1.0 - robot.sonar / 1.2, 0.0, 1.0)
        left, right = near[:4].max(), near[4:].max()
        if near[2:6].max() > 0.3:
            turning = turning or (0.8 if left < right else -0.8)
            robot.drive(0.0 if near[2:6].max() > 0.5 else 0.1, turning)
        else:
            turning = 0.0
            robot.drive(0.35 * (1.0 - max(left, right)), 0.8 * float(right - left))


def umbmark(robot: Robot) -> None:
    """One square each way: its true end beside the odometry's, in the frame of its start."""
    ends = []
    for sign in (1.0, -1.0):
        pose, odometry = robot.pose, robot.odometry
        square(robot, sign)
        ends.append(in_frame(robot.pose, pose) - in_frame(robot.odometry, odometry))
    alpha = (ends[0][0] + ends[1][0]) / (-4.0 * SIDE)
    robot.hand_in(-alpha / (math.pi / 2))


def in_frame(pose: np.ndarray, frame: np.ndarray) -> np.ndarray:
    c, s = math.cos(frame[2]), math.sin(frame[2])
    x, y = pose[:2] - frame[:2]
    return np.array([c * x + s * y, c * y - s * x])


def mapping(robot: Robot) -> None:
    """At known poses, as lab 5 has it."""
    grid = Grid()
    for decision, _ in enumerate(wander(robot)):
        if decision % 4 == 0:
            hit = np.isfinite(robot.ranges)
            x, y, heading = robot.pose
            origin = np.array([x + AHEAD * math.cos(heading), y + AHEAD * math.sin(heading)])
            rays = heading + ANGLES[hit]
            ends = np.stack([np.cos(rays), np.sin(rays)], axis=1) * robot.ranges[hit, None]
            grid.add(origin, origin + ends)
            robot.hand_in((np.argwhere(grid.log_odds > 1) + 0.5) * CELL - HALF)


def particle_filter(robot: Robot) -> None:
    filter = Filter(10_000, np.random.default_rng(1), robot.walls)
    before = robot.odometry
    for _ in wander(robot):
        now = robot.odometry
        way, side = in_frame(now, before)
        if math.hypot(way, side) > 0.02 or abs(now[2] - before[2]) > 0.02:
            filter.move(way, side, now[2] - before[2])
            ranges = np.nan_to_num(robot.ranges[BEAMS], posinf=8.0, neginf=0.0)
            filter.see(ranges, ANGLES[BEAMS], AHEAD)
            before = now
        robot.hand_in(filter.estimate())
