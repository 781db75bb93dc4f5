"""Where devices and robots are: rotations and frames."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Placed(Protocol):
    """What has a place in another frame: a device in base_link, a robot's pose in the world."""

    @property
    def position(self) -> Floats: ...  # (3,) m

    @property
    def orientation(self) -> Floats: ...  # (4,) w, x, y, z


def rotation(orientation: Floats) -> Floats:
    """The (3, 3) matrix of a unit quaternion w, x, y, z: from the frame of what is turned to that
    which it is given in.
    """
    w, x, y, z = orientation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def transformed(points: Floats, by: Placed) -> Floats:
    """(n, 3) points of a frame that is placed so, in the frame above. Raises TypeError."""
    if not hasattr(by, "orientation") or not hasattr(by, "position"):
        raise TypeError(f"a device or a pose is wanted, such as robot.lrf, not {by!r}")
    return points @ rotation(by.orientation).T + by.position
