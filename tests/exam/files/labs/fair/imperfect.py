"""Does what is asked for, as well as a first attempt does."""

import math


def square(robot):
    """Goes too far and stops late at each corner."""
    for side in range(1, 5):
        begin = robot.odometry
        while math.dist(robot.odometry[:2], begin[:2]) < 1.95:
            robot.drive(0.25, 0.0)
        while robot.odometry[2] < side * math.pi / 2 - 0.05:
            robot.drive(0.0, 0.4)


def wall_following(robot):
    """In a zigzag."""
    while True:
        if robot.ranges[70:111].min() < 1.2:  # a corner
            robot.drive(0.1, 0.8)
        else:
            robot.drive(0.3, 0.4 if robot.ranges[:60].min() < 0.8 else -0.4)


def sonar_avoidance(robot):
    """Straight on, until something is near."""
    while True:
        if robot.sonar[2:6].min() > 0.9:
            robot.drive(0.25, 0.0)
        else:
            robot.drive(0.0, 0.7)
