"""Fast decoders for the messages that controllers read most: lcm-gen's classes take several times
as long.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .geometry import Floats
from .samples import Odometry, Pose, Scan
from .values import counted, fixed, steps

_BIG_FLOAT, _BIG_DOUBLE, _BIG_LONG = np.dtype(">f4"), np.dtype(">f8"), np.dtype(">i8")
_BEGIN = 16  # behind fingerprint and utime
_UTIME, _LENGTH = struct.Struct(">8xq"), struct.Struct(">i")
_RAYS = struct.Struct(">ff")  # rad0, radstep
_MOTION_OF_WHEELS = struct.Struct(">ddddd")  # x, y, theta, v, omega


def _made(sample: type[Any], values: dict[str, Any]) -> Any:
    """Past the constructor, which sets the fields of a frozen class one by one."""
    made = object.__new__(sample)
    made.__dict__.update(values)
    return made


def _array(data: bytes, at: int, count: int, dtype: Any, to: Any) -> NDArray[Any]:
    """Raises ValueError where so many are not there."""
    counted(count)
    if not count:
        return _empty(to)
    return fixed(np.frombuffer(data, dtype, count, at).astype(to))


@lru_cache(maxsize=8)
def _empty(dtype: Any) -> NDArray[Any]:
    return fixed(np.zeros(0, dtype))


@lru_cache(maxsize=256)
def _angles(first: float, step: float, count: int) -> Floats:
    """The angles of all scans of a device, one read-only array."""
    return steps(first, step, count)


def _scan_of(data: bytes) -> Scan:
    (rays,) = _LENGTH.unpack_from(data, _BEGIN)
    at = _BEGIN + 4
    ranges = _array(data, at, rays, _BIG_FLOAT, np.float64)
    at += 4 * rays
    (count,) = _LENGTH.unpack_from(data, at)
    intensities = _array(data, at + 4, count, _BIG_FLOAT, np.float64)
    first, step = _RAYS.unpack_from(data, at + 4 + 4 * count)
    values = {
        "utime": _UTIME.unpack_from(data)[0],
        "ranges": ranges,
        "angles": _angles(first, step, rays),
        "intensities": intensities,
    }
    made: Scan = _made(Scan, values)
    return made


def _odometry_of(data: bytes) -> Odometry:
    x, y, theta, v, omega = _MOTION_OF_WHEELS.unpack_from(data, _BEGIN)
    at = _BEGIN + 40
    (count,) = _LENGTH.unpack_from(data, at)
    counted(count)
    at, size = at + 4, 8 * count
    values = {
        "utime": _UTIME.unpack_from(data)[0],
        "x": x,
        "y": y,
        "theta": theta,
        "v": v,
        "omega": omega,
        "wheel_angles": _array(data, at, count, _BIG_DOUBLE, np.float64),
        "wheel_rates": _array(data, at + size, count, _BIG_DOUBLE, np.float64),
        "ticks": _array(data, at + 2 * size, count, _BIG_LONG, np.int64),
        "resets": _LENGTH.unpack_from(data, at + 3 * size)[0],
    }
    made: Odometry = _made(Odometry, values)
    return made


def _pose_of(data: bytes) -> Pose:
    numbers = _array(data, _BEGIN, 16, _BIG_DOUBLE, np.float64)
    values = {
        "utime": _UTIME.unpack_from(data)[0],
        "position": numbers[0:3],
        "velocity": numbers[3:6],
        "orientation": numbers[6:10],
        "rotation_rate": numbers[10:13],
        "acceleration": numbers[13:16],
    }
    made: Pose = _made(Pose, values)
    return made


DECODERS: dict[str, Callable[[bytes], Any]] = {
    "planar_lidar_t": _scan_of,
    "odometry_t": _odometry_of,
    "pose_t": _pose_of,
}
