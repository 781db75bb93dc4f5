"""Each robot goes straight to its goal."""

import numpy as np


def many_robots(robot):
    while True:
        x, y, heading = robot.poses.T
        off = np.arctan2(robot.goals[:, 1] - y, robot.goals[:, 0] - x) - heading
        off = (off + np.pi) % (2 * np.pi) - np.pi
        robot.drive(np.where(abs(off) < 0.3, 0.3, 0.0), np.clip(2 * off, -1, 1))
