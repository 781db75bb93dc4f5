"""A model solution of all labs; a student's file has the same form."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator

import numpy as np
from lab import APART, BEFORE, SIDE, Robot
from mapping import CELL, HALF, Grid
from particle_filter import BEAMS, Filter

ANGLES = np.radians(np.arange(-90, 91))  # of the range finder's rays
AHEAD = 0.16  # m, from the robot's centre to the range finder
STEP, CLEAR = 0.1, 0.45  # m: of a cell, and how near the robot's middle may come to anything


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


def planning(robot: Robot) -> None:
    """Plans anew every 0.8 s, by the map and by what the range finder has seen."""
    taken = [np.linspace(a, b, 2 + int(math.dist(a, b) / 0.05)) for a, b in np.asarray(robot.walls)]
    seen: list[np.ndarray] = []
    decision = 0
    while math.dist(robot.pose[:2], robot.goal) > 0.1:
        if decision % 8 == 0:
            seen.append(hits(robot))
            way = shortest(np.concatenate(taken + seen), robot.pose[:2], robot.goal)
        decision += 1
        while len(way) > 1 and math.dist(robot.pose[:2], way[0]) < 0.4:
            way = way[1:]
        go_to(robot, way[0])
    robot.drive(0.0, 0.0)


def hits(robot: Robot) -> np.ndarray:
    """(n, 2) m, in the world."""
    x, y, heading = robot.pose
    near = robot.ranges < 3.0
    rays, ranges = heading + ANGLES[near], robot.ranges[near, None]
    device = (x + AHEAD * math.cos(heading), y + AHEAD * math.sin(heading))
    return device + ranges * np.stack([np.cos(rays), np.sin(rays)], axis=1)


def shortest(taken: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Places (m) from begin to end by A* on a grid; a cell costs more the nearer it is to what is
    taken."""
    low = np.array([-4.0, -3.0])
    cells = low + STEP * np.stack(np.meshgrid(np.arange(81), np.arange(61), indexing="ij"), axis=-1)
    once = np.unique(np.round(taken / STEP).astype(int), axis=0) * STEP
    apart = np.full(cells.shape[:2], np.inf)
    for column in range(len(cells)):  # a column at a time: less memory
        off = cells[column, :, None] - once
        apart[column] = np.hypot(off[..., 0], off[..., 1]).min(axis=1)
    cost = np.where(apart < CLEAR, 50.0, 1.0 + 4.0 * np.clip(0.8 - apart, 0.0, None))
    first, last = (
        tuple(np.clip(np.rint((one - low) / STEP).astype(int), 0, (80, 60)).tolist())
        for one in (begin, end)
    )
    before, best = {first: first}, {first: 0.0}
    queue = [(0.0, first)]
    while queue:
        _, here = heapq.heappop(queue)
        if here == last:
            break
        for i, j in ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)):
            there = here[0] + i, here[1] + j
            if not (0 <= there[0] <= 80 and 0 <= there[1] <= 60):
                continue
            new = best[here] + math.hypot(i, j) * cost[there]
            if new < best.get(there, math.inf):
                best[there], before[there] = new, here
                heapq.heappush(queue, (new + math.dist(there, last), there))
    way = [last]
    while way[-1] != first:
        way.append(before[way[-1]])
    return np.array([*(low + STEP * np.array(way[-2::-1])), end])


def go_to(robot: Robot, place: np.ndarray) -> None:
    x, y, heading = robot.pose
    off = math.remainder(math.atan2(place[1] - y, place[0] - x) - heading, math.tau)
    speed = 0.4 * max(0.0, math.cos(off)) if abs(off) < 0.6 else 0.0
    robot.drive(min(speed, 0.1 + math.dist((x, y), robot.goal)), float(np.clip(2 * off, -1, 1)))


def vision(robot: Robot) -> None:
    """Turns until it sees red, then towards it; by the range finder, until it is there."""
    focal = 40.0 / math.tan(math.radians(30.0))  # pixels
    away, aside = math.inf, 1.0  # m, rad, to the left: where the red was last
    while abs(away - BEFORE) > 0.03 or abs(aside) > 0.1:
        red, green, blue = (robot.image[..., i].astype(int) for i in range(3))
        columns = np.flatnonzero(((red > 60) & (red > 2 * green) & (red > 2 * blue)).any(axis=0))
        if not len(columns):
            robot.drive(0.0, 0.6 if aside > 0 else -0.6)
            continue
        aside = math.atan2(39.5 - columns.mean(), focal)
        ahead = 90 + round(math.degrees(aside))
        away = robot.ranges[ahead - 3 : ahead + 4].min() + 0.15 + AHEAD  # to its middle
        speed = float(np.clip(0.8 * (away - BEFORE), -0.3, 0.4)) * max(0.0, math.cos(2 * aside))
        robot.drive(speed, float(np.clip(1.5 * aside, -0.8, 0.8)))
    robot.drive(0.0, 0.0)


def many_robots(robot: Robot) -> None:
    """As at a roundabout: all go to a circle, around it to the left, and leave it outwards."""
    radius = 1.1  # m
    entered, leaving = np.zeros((2, len(robot.poses)), dtype=bool)
    exits = np.arctan2(robot.goals[:, 1], robot.goals[:, 0])
    while (away := np.hypot(*(robot.goals - robot.poses[:, :2]).T)).max() > 0.1:
        x, y, heading = robot.poses.T
        at = np.arctan2(y, x)
        entered |= np.hypot(x, y) < radius + 0.2
        leaving |= entered & (abs(np.sin((exits - at) / 2)) < 0.075)
        ahead = np.where(entered, at + 0.35, at)  # on the circle
        on = radius * np.stack([np.cos(ahead), np.sin(ahead)], axis=1)
        aim = np.where(leaving[:, None], robot.goals, on)
        off = np.arctan2(aim[:, 1] - y, aim[:, 0] - x) - heading
        off = (off + math.pi) % math.tau - math.pi
        speed = np.where(abs(off) < 0.6, 0.3 * np.cos(off), 0.0)
        speed = np.where(leaving, np.minimum(speed, np.clip(away - 0.05, 0.0, None)), speed)
        robot.drive(speed, np.where(leaving & (away < 0.1), 0.0, np.clip(2.0 * off, -1.0, 1.0)))
    robot.drive(np.zeros(len(away)), 0.0)
