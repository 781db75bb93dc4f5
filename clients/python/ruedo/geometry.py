"""Rotations and frames of devices and robots."""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class Placed(Protocol):
    """A thing with a pose in another frame: a device in base_link, a robot in the world."""

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
        raise TypeError(f"expected a device or a pose, such as robot.lrf, not {by!r}")
    return points @ rotation(by.orientation).T + by.position


def normalize_angle(angle: Any) -> Any:
    """An angle, or an array of angles (rad), as the equal one in [-pi, pi)."""
    turned = np.mod(np.asarray(angle, np.float64) + np.pi, 2.0 * np.pi) - np.pi
    return turned if turned.ndim else float(turned)


def between(first: Floats, second: Floats, share: float) -> Floats:
    """The unit quaternion w, x, y, z that is a share of the way from one to the other: the linear
    one, normalised, which for the small angles between two samples is the shortest way.
    """
    near = second if float(np.dot(first, second)) >= 0.0 else -second
    mixed = (1.0 - share) * first + share * near
    made: Floats = mixed / np.linalg.norm(mixed)
    return made


def heading_of(orientation: Floats) -> float:
    """rad, counter-clockwise from the x axis, in (-pi, pi]; of a unit quaternion w, x, y, z."""
    w, x, y, z = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


class Transform:
    """The pose of a frame B in a frame A: takes points of B to A.

    Products compose: if ``a`` is B in A and ``b`` is C in
    B, ``a @ b`` is C in A, and ``a.inverse()`` is A in B. position: (3,) m. orientation: (4,) unit
    quaternion w, x, y, z. It takes the place of a device or a pose in Scan.points().
    """

    __slots__ = ("orientation", "position")

    def __init__(self, position: ArrayLike, orientation: ArrayLike = (1.0, 0.0, 0.0, 0.0)):
        self.position: Floats = np.array(position, np.float64)
        self.orientation: Floats = np.array(orientation, np.float64)
        if self.position.shape != (3,) or self.orientation.shape != (4,):
            raise ValueError("a Transform has a position of 3 numbers and an orientation of 4")
        norm = float(np.linalg.norm(self.orientation))
        if not 0.5 < norm < 2.0:
            raise ValueError(f"orientation is {self.orientation}: it must be a unit quaternion")
        self.orientation /= norm

    @classmethod
    def of(cls, x: float, y: float, heading: float = 0.0, z: float = 0.0) -> Transform:
        """A transform from m and rad, counter-clockwise from the x axis."""
        return cls((x, y, z), (np.cos(heading / 2.0), 0.0, 0.0, np.sin(heading / 2.0)))

    @property
    def x(self) -> float:
        """m."""
        return float(self.position[0])

    @property
    def y(self) -> float:
        """m."""
        return float(self.position[1])

    @property
    def z(self) -> float:
        """m."""
        return float(self.position[2])

    @property
    def heading(self) -> float:
        """rad, counter-clockwise from A's x axis, in (-pi, pi]."""
        return heading_of(self.orientation)

    def inverse(self) -> Transform:
        """A in B."""
        back = self.orientation * (1.0, -1.0, -1.0, -1.0)
        return Transform(-(rotation(back) @ self.position), back)

    def __matmul__(self, other: Transform) -> Transform:
        if not isinstance(other, Transform):
            return NotImplemented
        w, v = self.orientation[0], self.orientation[1:]
        s, u = other.orientation[0], other.orientation[1:]
        turned = np.concatenate([[w * s - v @ u], w * u + s * v + np.cross(v, u)])
        return Transform(self.apply(other.position), turned)

    def apply(self, points: ArrayLike) -> Floats:
        """Points (n, 3) or (3,), or (n, 2) or (2,) at z = 0, of B: in A, of 3 numbers each (m)."""
        given = np.asarray(points, np.float64)
        if given.shape[-1:] == (2,):
            given = np.concatenate([given, np.zeros((*given.shape[:-1], 1))], axis=-1)
        if given.shape[-1:] != (3,):
            raise ValueError(f"points have 2 or 3 numbers each; their shape is {given.shape}")
        made: Floats = given @ rotation(self.orientation).T + self.position
        return made

    def __repr__(self) -> str:
        numbers = ", ".join(f"{one:.6g}" for one in (*self.position, self.heading))
        return f"Transform(x, y, z, heading: {numbers})"
