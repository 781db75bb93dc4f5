"""A hall with a robot in it, and a controller that drives to a goal, with three faults that hide
well.
"""

import math

import numpy as np
from ruedo import World

GOAL = (4.0, 0.0)


def hall(width=4.0, heading=0.0):
    """12 m long, from x = -6 to 6; the robot starts in its middle. heading: of the robot, rad."""
    world = World("hall")
    for x1, y1, x2, y2 in ((-6, -1, 6, -1), (-6, 1, 6, 1)):
        world.wall(x1, y1 * width / 2, x2, y2 * width / 2)
    for x in (-6, 6):
        world.wall(x, -width / 2, x, width / 2)
    return world.robot("p3at", 0.0, 0.0, heading)


class Corridor:
    """Turns towards the goal and drives there, slower near obstacles, and around them."""

    def __init__(self, planted=""):
        self.planted = planted  # "far", "pi" or "frozen": which fault it has
        self.lost = False
        self.last, self.same = None, 0

    def __call__(self, view):
        x, y, _ = view["pose.pos"]
        w, _, _, z = view["pose.orientation"]
        ranges = np.asarray(view["lrf.ranges"], float)
        if math.hypot(GOAL[0] - x, GOAL[1] - y) < 0.3:
            return "done"
        if self.planted == "far" and ranges[0] > 8.0:
            self.lost = True  # treats the reading as a sensor fault, and never recovers from it
        if self.lost:
            return 0.0, 0.0
        heading = math.atan2(2 * w * z, 1 - 2 * z * z)
        error = math.atan2(GOAL[1] - y, GOAL[0] - x) - heading
        if not (self.planted == "pi" and abs(error) == math.pi):
            error = math.atan2(math.sin(error), math.cos(error))
        else:
            error = 0.0  # wraps with < where <= belongs
        if self.blind(ranges):
            return 0.0, 0.0
        return self.drive(error, np.minimum(ranges, 8.0))

    def blind(self, ranges):
        """A scan that is identical to the last one is a dead sensor: there is always noise."""
        if self.planted == "frozen":
            return False
        self.same = (
            self.same + 1 if self.last is not None and np.array_equal(ranges, self.last) else 0
        )
        self.last = ranges.copy()
        return self.same >= 5

    def drive(self, error, ranges):
        n = len(ranges)
        bearings = np.linspace(-math.pi / 2, math.pi / 2, n)
        ahead = ranges[np.abs(bearings) < 0.5].min()
        left, right = ranges[bearings > 0.3].min(), ranges[bearings < -0.3].min()
        if abs(error) > 0.6:
            return 0.0, math.copysign(0.6, error)
        if ahead < 0.9:
            return 0.0, 0.5 if left > right else -0.5
        side = 0.8 * (max(0.0, 0.8 - right) - max(0.0, 0.8 - left))
        return min(0.5, 0.4 * (ahead - 0.6)), max(-0.8, min(0.8, error + side))
