"""To the nearest coloured thing but the red one."""

import numpy as np


def vision(robot):
    for _ in range(550):
        red, green, blue = (robot.image[..., i].astype(int) for i in range(3))
        columns = np.flatnonzero(((green > 2 * red) | (blue > 2 * red)).sum(axis=0) > 2)
        if not len(columns):
            robot.drive(0.0, 0.5)
            continue
        aside = (39.5 - columns.mean()) / 70
        robot.drive(0.3 if robot.ranges[80:101].min() > 0.9 else 0.0, 1.5 * aside)
