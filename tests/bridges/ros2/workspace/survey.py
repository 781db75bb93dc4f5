"""Drives a robot along a route while slam_toolbox maps, and compares its map with the true one.

survey.py TRUE_MAP.yaml '[[X, Y], ...]'    (m, in world; prints one JSON line)

The driver knows the robot's true pose, and slam_toolbox does not. Shares in the answer: "right" of
the known cells whose true value is the same within one cell; "walls" of the occupied cells within
two cells of a true one; "found" of the true walls in view of the route within two cells of one in
the map. "off_m": between the true pose at the end and the one in the map.
"""

import argparse
import json
import math
import re
from pathlib import Path

import numpy as np
import rclpy
import yaml
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from tf2_ros import Buffer, TransformListener

AHEAD, TURN, NEAR = 0.45, 0.6, 0.15  # m/s, rad/s, m


def yaw_of(q) -> float:
    return math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def pose_of(pose) -> np.ndarray:
    return np.array([pose.position.x, pose.position.y, yaw_of(pose.orientation)])


class Driver(Node):
    """Follows the route: turns to each point, then goes there."""

    def __init__(self, route):
        super().__init__("surveyor", parameter_overrides=[Parameter("use_sim_time", value=True)])
        self.route = [np.array(point, float) for point in route]
        self.start = self.pose = self.map = None
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(OccupancyGrid, "map", self.keep, latched)
        self.create_subscription(Odometry, "ground_truth", self.drive, 1)
        self.command = self.create_publisher(Twist, "cmd_vel", 1)
        self.buffer = Buffer()
        self.listener = TransformListener(self.buffer, self, spin_thread=False)

    def keep(self, grid):
        self.map = grid

    def drive(self, truth):
        self.pose = pose_of(truth.pose.pose)
        if self.start is None:
            self.start = self.pose
        if self.map is None:  # slam_toolbox is not there yet
            return
        twist = Twist()
        while self.route and np.hypot(*(self.route[0] - self.pose[:2])) < NEAR:
            self.route.pop(0)
        if self.route:
            to = self.route[0] - self.pose[:2]
            error = math.remainder(math.atan2(to[1], to[0]) - self.pose[2], math.tau)
            twist.angular.z = max(-TURN, min(TURN, 1.5 * error))
            twist.linear.x = AHEAD * max(0.0, 1 - abs(error) / 0.4)
        self.command.publish(twist)


def true_cells(file: Path):
    """(occupied, free) as in the picture but with row 0 at the bottom; origin, resolution."""
    about = yaml.safe_load(file.read_text())
    data = (file.parent / about["image"]).read_bytes()
    head = re.match(rb"P5\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)\s+255\s", data)
    width, height = int(head[1]), int(head[2])
    gray = np.frombuffer(data, np.uint8, offset=head.end()).reshape(height, width)[::-1]
    return gray < 50, gray > 250, np.array(about["origin"][:2]), about["resolution"]


def near(cells: np.ndarray, steps: int) -> np.ndarray:
    """Cells with one of `cells` within so many rows and columns."""
    grown = np.zeros_like(cells)
    padded = np.pad(cells, steps)
    for dy in range(2 * steps + 1):
        for dx in range(2 * steps + 1):
            grown |= padded[dy : dy + cells.shape[0], dx : dx + cells.shape[1]]
    return grown


def compared(grid: OccupancyGrid, start: np.ndarray, file: Path) -> dict:
    occupied, free, origin, resolution = true_cells(file)
    data = np.array(grid.data, np.int8).reshape(grid.info.height, grid.info.width)
    rows, columns = np.nonzero(data >= 0)
    place = pose_of(grid.info.origin)[:2] + (np.c_[columns, rows] + 0.5) * grid.info.resolution
    c, s = math.cos(start[2]), math.sin(start[2])
    place = place @ np.array([[c, s], [-s, c]]) + start[:2]
    at = np.floor((place - origin) / resolution).astype(int)
    inside = np.all((at >= 0) & (at < occupied.shape[::-1]), axis=1)
    at, values = at[inside], data[rows, columns][inside]
    x, y = at.T
    wall = values > 50
    right = np.where(wall, near(occupied, 1)[y, x], near(free, 1)[y, x])
    mapped = np.zeros_like(occupied)
    mapped[y[wall], x[wall]] = True
    seen = np.zeros_like(occupied)
    seen[y[~wall], x[~wall]] = True
    surface = occupied & near(free, 1) & near(seen, 2)
    return {
        "cells": len(values),
        "right": float(right.mean()),
        "walls": float(near(occupied, 2)[y, x][wall].mean()),
        "found": float(near(mapped, 2)[surface].mean()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("true_map", type=Path)
    parser.add_argument("route", type=json.loads)
    options = parser.parse_args()
    rclpy.init()
    driver = Driver(options.route)
    while driver.map is None or driver.route:
        rclpy.spin_once(driver)
    driver.map = None  # the next one has the last scans
    while driver.map is None or not driver.buffer.can_transform("map", "base_link", Time()):
        rclpy.spin_once(driver)
    found = driver.buffer.lookup_transform("map", "base_link", Time()).transform.translation
    c, s = math.cos(driver.start[2]), math.sin(driver.start[2])
    expected = np.array([[c, s], [-s, c]]) @ (driver.pose[:2] - driver.start[:2])
    off = math.hypot(found.x - expected[0], found.y - expected[1])
    answer = compared(driver.map, driver.start, options.true_map)
    answer["sim_s"] = driver.get_clock().now().nanoseconds * 1e-9
    print(json.dumps({**answer, "off_m": off}), flush=True)


if __name__ == "__main__":
    main()
