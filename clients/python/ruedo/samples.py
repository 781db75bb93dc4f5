"""What devices deliver: one frozen class for each kind of sample, with numpy arrays.

SI units and radians. x ahead, y left, z up; quaternions w, x, y, z. `utime` is the sim time of the
state shown, in integer microseconds; `time` is the same in seconds.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import lcmtypes, notebook
from .errors import NotSupported, for_terminal
from .geometry import Floats, Placed, transformed

_PIXEL_FORMATS = {
    lcmtypes.image_t.PIXEL_FORMAT_GRAY: "gray",
    lcmtypes.image_t.PIXEL_FORMAT_RGB: "rgb",
    lcmtypes.image_t.PIXEL_FORMAT_BGR: "bgr",
    lcmtypes.image_t.PIXEL_FORMAT_MJPEG: "jpeg",
    lcmtypes.image_t.PIXEL_FORMAT_LE_GRAY16: "gray16",
    lcmtypes.image_t.PIXEL_FORMAT_FLOAT_GRAY32: "float32",
}
_MOTION_KINDS = {
    0: "none",
    1: "advance",
    2: "rotate",
    3: "heading",
    4: "arc",
    5: "stop",
    16: "velocity",
    17: "wheels",
}
_MOTION_STATES = {0: "idle", 1: "running", 2: "done", 3: "ended", 4: "refused"}
_MOTION_REASONS = {
    0: "",
    1: "replaced",
    2: "blocked",
    3: "watchdog",
    4: "not finite",
    5: "bad kind",
    6: "bad value",
    7: "no drive",
    8: "not possible",
}


class Value:
    """Equal when all is equal, NaN to NaN too; hashed alike; and shown in a line."""

    def _key(self) -> tuple[Any, ...]:
        values: Any = self  # every subclass is a dataclass
        return tuple(_comparable(getattr(self, field.name)) for field in fields(values))

    def __eq__(self, other: object) -> bool:
        return self is other or (type(self) is type(other) and self._key() == other._key())

    def __hash__(self) -> int:
        return hash((type(self), self._key()))

    def __repr__(self) -> str:
        values: Any = self
        shown = ", ".join(
            f"{field.name}={_short(getattr(self, field.name))}" for field in fields(values)
        )
        return f"{type(self).__name__}({shown})"


def _comparable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.shape, value.dtype.str, (value + 0).tobytes()  # -0 as 0
    if isinstance(value, list):
        return tuple(_comparable(one) for one in value)
    return "nan" if isinstance(value, float) and math.isnan(value) else value


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        if value.size <= 4:
            return "[" + ", ".join(f"{one:g}" for one in value.ravel()) + "]"
        finite = value[np.isfinite(value)] if value.dtype.kind == "f" else value
        return f"<{' x '.join(map(str, value.shape))}{f', {finite.min():g} to {finite.max():g}' if finite.size and value.dtype.kind != 'b' else ''}>"
    if isinstance(value, bytes):
        return f"<{len(value)} bytes>"
    if isinstance(value, list) and len(value) > 4:
        return f"<{len(value)}>"
    return f"{value:g}" if isinstance(value, float) else repr(value)


@dataclass(frozen=True, eq=False, repr=False)
class Sample(Value):
    """utime: us of sim time. Nothing in a sample can be written into: others may have the same
    one.
    """

    utime: int

    @property
    def time(self) -> float:
        """Sim time, s."""
        return self.utime * 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Scan(Sample):
    """A scan of a planar laser range finder with n rays, in the device's frame."""

    ranges: Floats  # (n,) m; +inf: no return, -inf: nearer than the minimum range
    angles: Floats  # (n,) rad from the device's x axis towards y (left)
    intensities: Floats  # (n,) 0 to 1; (0,) when the device has none

    def nearest(self, from_angle: float = -math.pi, to_angle: float = math.pi) -> float:
        """The smallest range (m) between two angles (rad); +inf when nothing is there, -inf when
        something is nearer than the device can measure."""
        part = self.ranges[(self.angles >= from_angle) & (self.angles <= to_angle)]
        return float(part.min()) if part.size else math.inf

    def points(self, device: Placed | None = None, pose: Placed | None = None) -> Floats:
        """Where the rays ended, of those that returned: (k, 2) m in the device's frame; with the
        device (``robot.lrf``) (k, 3) in base_link, and with the robot's pose, too, in the world."""
        good = np.isfinite(self.ranges)
        ranges, angles = self.ranges[good], self.angles[good]
        points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1)
        if device is None:
            if pose is not None:
                raise TypeError("points(pose=...) needs the device, too: points(robot.lrf, pose)")
            return points
        above = transformed(np.column_stack([points, np.zeros(len(points))]), device)
        return above if pose is None else transformed(above, pose)

    def plot(self, axes: Any = None) -> Any:
        """Draws the scan, x upwards as the robot looks, y to the left. axes: matplotlib's; None:
        new ones. Returns them. Needs matplotlib.
        """
        if axes is None:
            try:
                from matplotlib import pyplot
            except ImportError:
                raise NotSupported("plot() needs matplotlib: pip install matplotlib") from None
            axes = pyplot.subplots()[1]
        points = self.points()
        axes.plot(-points[:, 1], points[:, 0], ".", markersize=3)
        axes.plot(0.0, 0.0, "^", color="tab:red")
        axes.set(aspect="equal", xlabel="to the right, m", ylabel="ahead, m")
        return axes

    def _repr_svg_(self) -> str:
        return notebook.scan_svg(self.points())


@dataclass(frozen=True, eq=False, repr=False)
class LidarScan(Sample):
    """A scan of a laser scanner with m layers of n rays, in the device's frame."""

    ranges: (
        Floats  # (m, n) m, lowest layer first; +inf: no return, -inf: nearer than the minimum range
    )
    azimuths: Floats  # (n,) rad, left is positive
    elevations: Floats  # (m,) rad, up is positive
    intensities: Floats  # (m, n) 0 to 1, or (0, 0)


@dataclass(frozen=True, eq=False, repr=False)
class SonarReading(Sample):
    """The last reading of each of an array's n transducers; their poses are the device's
    `elements`.
    """

    ranges: Floats  # (n,) m from the transducer's face; without an echo: the maximum range
    fired_utime: NDArray[np.int64]  # (n,) us of sim time at which each fired last; -1: not yet
    fresh: NDArray[np.bool_]  # (n,) true where the reading is of this very message


@dataclass(frozen=True, eq=False, repr=False)
class Odometry(Sample):
    """What the robot believes of its motion from its wheels; pose of base_link in the frame
    odom.
    """

    x: float  # m
    y: float  # m
    theta: float  # rad, not wrapped
    v: float  # m/s
    omega: float  # rad/s
    wheel_angles: Floats  # (n,) rad since the start, positive ahead; order of Robot.wheels
    wheel_rates: Floats  # (n,) rad/s
    ticks: NDArray[np.int64]  # (n,) encoder counts
    resets: int  # how often the pose was reset

    @property
    def heading(self) -> float:
        """theta, wrapped as Pose.heading is: rad, counter-clockwise from odom's x axis, in [-pi,
        pi].
        """
        return math.remainder(self.theta, math.tau)


@dataclass(frozen=True, eq=False, repr=False)
class OdometryTwist(Sample):
    """What the robot believes of its velocity from its wheels, in base_link; comes with each
    Odometry.
    """

    vx: float  # m/s, ahead
    vy: float  # m/s, to the left
    omega: float  # rad/s
    covariance: Floats  # (3, 3) of (vx, vy, omega); 0: ideal encoders


@dataclass(frozen=True, eq=False, repr=False)
class Pose(Sample):
    """The true pose of base_link in the world; velocities are expressed in base_link."""

    position: Floats  # (3,) m
    orientation: Floats  # (4,) w, x, y, z
    velocity: Floats  # (3,) m/s
    rotation_rate: Floats  # (3,) rad/s
    acceleration: Floats  # (3,) m/s^2, without gravity

    @property
    def x(self) -> float:
        return float(self.position[0])

    @property
    def y(self) -> float:
        return float(self.position[1])

    @property
    def heading(self) -> float:
        """rad, counter-clockwise from the world's x axis, in (-pi, pi]."""
        w, x, y, z = self.orientation
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@dataclass(frozen=True, eq=False, repr=False)
class Image(Sample):
    """A picture. format: "jpeg", "rgb", "bgr", "gray", "gray16" (labels: body index + 1) or
    "float32" (depth, m along the optical axis, +inf: nothing, -inf: nearer than the camera
    sees)."""

    width: int  # pixels
    height: int  # pixels
    format: str
    row_stride: int  # bytes in a row, 0 for jpeg
    data: bytes  # as they came

    def array(self) -> NDArray[Any]:
        """The pixels, rows from the top: (height, width, 3) uint8 in the order R, G, B for "jpeg",
        "rgb" and "bgr"; (height, width) uint8, uint16 or float32 for the others. Pictures in "jpeg"
        need Pillow."""
        if self.format == "jpeg":
            try:
                from PIL import Image as pillow  # type: ignore[import-not-found, unused-ignore]
            except ImportError:
                raise ImportError(
                    "the picture is a JPEG: array() needs Pillow (pip install pillow); "
                    "save(path) writes it without"
                ) from None
            import io

            return np.asarray(pillow.open(io.BytesIO(self.data)).convert("RGB"))
        if self.format not in _RAW:
            raise ValueError(f"unknown pixel format {self.format}")
        dtype, channels = _RAW[self.format]
        pixel_bytes = np.dtype(dtype).itemsize * channels
        stride = self.row_stride or self.width * pixel_bytes
        if stride < self.width * pixel_bytes or len(self.data) < stride * self.height:
            raise ValueError(
                f"a {self.format} picture of {self.width} x {self.height} pixels needs more than "
                f"{len(self.data)} bytes in rows of {stride}"
            )
        rows = np.frombuffer(self.data, np.uint8, stride * self.height).reshape(self.height, stride)
        pixels = np.ascontiguousarray(rows[:, : self.width * pixel_bytes]).view(dtype)
        if channels == 1:
            return pixels
        colour = pixels.reshape(self.height, self.width, channels)
        return colour[:, :, ::-1] if self.format == "bgr" else colour

    def _repr_jpeg_(self) -> bytes | None:
        return self.data if self.format == "jpeg" else None

    def _repr_png_(self) -> bytes | None:
        return None if self.format == "jpeg" else notebook.png(notebook.visible(self.array()))

    def save(self, path: str | Path) -> None:
        """Writes a JPEG's bytes as they are. Raw 8-bit pictures are written as PPM or PGM."""
        content = self.data
        if self.format in ("rgb", "bgr", "gray"):
            head = "P5" if self.format == "gray" else "P6"
            content = f"{head} {self.width} {self.height} 255\n".encode() + self.array().tobytes()
        elif self.format != "jpeg":
            raise ValueError(f"{self.format} pictures have no common file format: use array()")
        Path(path).write_bytes(content)


_RAW = {
    "gray": ("u1", 1),
    "rgb": ("u1", 3),
    "bgr": ("u1", 3),
    "gray16": ("<u2", 1),
    "float32": ("<f4", 1),
}


@dataclass(frozen=True, eq=False, repr=False)
class CameraInfo(Sample):
    """Intrinsics: a pinhole with OpenCV's distortion."""

    width: int  # pixels
    height: int  # pixels
    fx: float  # pixels
    fy: float  # pixels
    cx: float  # pixels
    cy: float  # pixels
    distortion: Floats  # (5,) k1, k2, p1, p2, k3


@dataclass(frozen=True, eq=False, repr=False)
class Imu(Sample):
    """An inertial measurement unit, in the device's frame."""

    orientation: Floats  # (4,) w, x, y, z: device to world
    angular_velocity: Floats  # (3,) rad/s
    linear_acceleration: Floats  # (3,) m/s^2, specific force: at rest gravity upwards


@dataclass(frozen=True, eq=False, repr=False)
class NavSat(Sample):
    """Satellite navigation (GPS)."""

    latitude_deg: float  # degrees, north is positive
    longitude_deg: float  # degrees, east is positive
    altitude: float  # m above the ellipsoid
    velocity: Floats  # (3,) m/s, to the east, to the north, upwards


@dataclass(frozen=True, eq=False, repr=False)
class Magnetometer(Sample):
    """The magnetic field, in the device's frame."""

    field: Floats  # (3,) T


@dataclass(frozen=True, eq=False, repr=False)
class Altimeter(Sample):
    """Height above where the device was at the start."""

    altitude: float  # m
    velocity: float  # m/s, upwards


@dataclass(frozen=True, eq=False, repr=False)
class AirPressure(Sample):
    """A barometer."""

    pressure: float  # Pa


@dataclass(frozen=True, eq=False, repr=False)
class AirSpeed(Sample):
    """A Pitot tube along the device's x axis."""

    differential_pressure: float  # Pa, total less static; negative: from behind
    temperature: float  # K, of the air


@dataclass(frozen=True, eq=False, repr=False)
class ForceTorque(Sample):
    """In a joint: what the child puts on the parent, unless the world file says otherwise."""

    force: Floats  # (3,) N
    torque: Floats  # (3,) N m, about the joint's origin


@dataclass(frozen=True, eq=False, repr=False)
class LogicalObject(Value):
    """A model that a logical camera sees, in the device's frame."""

    model: str  # its name
    position: Floats  # (3,) m
    orientation: Floats  # (4,) w, x, y, z: model to device


@dataclass(frozen=True, eq=False, repr=False)
class LogicalCamera(Sample):
    objects: list[LogicalObject]


@dataclass(frozen=True, eq=False, repr=False)
class Box2D(Value):
    """A labelled object in a picture; whole numbers are the middles of pixels."""

    label: int
    name: str  # of the model
    x: float  # pixels, the middle
    y: float
    width: float  # pixels
    height: float


@dataclass(frozen=True, eq=False, repr=False)
class Boxes2D(Sample):
    width: int  # pixels, of the picture
    height: int
    boxes: list[Box2D]


@dataclass(frozen=True, eq=False, repr=False)
class Box3D(Value):
    """A labelled object before the camera, in the device's frame."""

    label: int
    name: str  # of the model
    center: Floats  # (3,) m
    orientation: Floats  # (4,) w, x, y, z: box to device
    size: Floats  # (3,) m, full lengths


@dataclass(frozen=True, eq=False, repr=False)
class Boxes3D(Sample):
    boxes: list[Box3D]


@dataclass(frozen=True, eq=False, repr=False)
class ContactPoint(Value):
    body: str  # the other body
    position: Floats  # (3,) m, world
    normal: Floats  # (3,) unit vector, world, towards the sensor's body
    force: float  # N
    depth: float  # m


@dataclass(frozen=True, eq=False, repr=False)
class Contact(Sample):
    """A bumper."""

    pressed: bool
    points: list[ContactPoint]


@dataclass(frozen=True, eq=False, repr=False)
class Collisions(Sample):
    """What a robot runs into: with what neither carries it nor lies on it."""

    blocked_by: str  # the body that blocks what it was told to do; "": nothing does
    points: list[ContactPoint]

    @property
    def bodies(self) -> list[str]:
        """The names of what is touched, each once, sorted; empty: nothing is."""
        return sorted({point.body for point in self.points})


@dataclass(frozen=True, eq=False, repr=False)
class Joints(Sample):
    names: list[str]
    positions: Floats  # (n,) rad or m
    velocities: Floats  # (n,) rad/s or m/s
    efforts: Floats  # (n,) N m or N


@dataclass(frozen=True, eq=False, repr=False)
class MotionStatus(Sample):
    """What a robot is executing."""

    id: int  # of the primitive; 0 for velocity and wheel commands
    kind: str  # "none", "advance", "rotate", "heading", "arc", "stop", "velocity", "wheels"
    state: str  # "idle", "running", "done", "ended", "refused"
    reason: str  # "", "replaced", "blocked", "watchdog", "not finite", "bad kind", "bad value", "no drive", "not possible"
    progress: float  # m or rad done
    remaining: float  # m or rad
    v: float  # m/s
    omega: float  # rad/s


def _fixed(values: NDArray[Any]) -> NDArray[Any]:
    values.setflags(write=False)
    return values


def floats(values: Any) -> Floats:
    return _fixed(np.array(values, np.float64))


def _scan(m: Any) -> Scan:
    return Scan(
        m.utime,
        floats(m.ranges),
        _fixed(m.rad0 + m.radstep * np.arange(m.nranges)),
        floats(m.intensities),
    )


def _lidar(m: Any) -> LidarScan:
    if m.nranges != m.nlayers * m.ncolumns or m.nintensities not in (0, m.nranges):
        raise ValueError("sizes that do not fit each other")
    shape = (m.nlayers, m.ncolumns)
    return LidarScan(
        m.utime,
        floats(m.ranges).reshape(shape),
        _fixed(m.azimuth0 + m.azimuth_step * np.arange(m.ncolumns)),
        _fixed(m.elevation0 + m.elevation_step * np.arange(m.nlayers)),
        floats(m.intensities).reshape(shape if m.nintensities else (0, 0)),
    )


def _sonar(m: Any) -> SonarReading:
    return SonarReading(
        m.utime,
        floats(m.range),
        _fixed(np.array(m.fired_utime, np.int64)),
        _fixed(np.array(m.fresh, np.bool_)),
    )


def _odometry(m: Any) -> Odometry:
    return Odometry(
        m.utime,
        m.x,
        m.y,
        m.theta,
        m.v,
        m.omega,
        floats(m.angle),
        floats(m.rate),
        _fixed(np.array(m.ticks, np.int64)),
        m.resets,
    )


def _odometry_twist(m: Any) -> OdometryTwist:
    return OdometryTwist(m.utime, m.vx, m.vy, m.omega, floats(np.reshape(m.covariance, (3, 3))))


def _pose(m: Any) -> Pose:
    return Pose(
        m.utime,
        floats(m.pos),
        floats(m.orientation),
        floats(m.vel),
        floats(m.rotation_rate),
        floats(m.accel),
    )


def _image(m: Any) -> Image:
    _counted(m.nmetadata)
    return Image(
        m.utime,
        m.width,
        m.height,
        _PIXEL_FORMATS.get(m.pixelformat, f"0x{m.pixelformat:08x}"),
        m.row_stride,
        bytes(m.data),
    )


def _camera_info(m: Any) -> CameraInfo:
    return CameraInfo(m.utime, m.width, m.height, m.fx, m.fy, m.cx, m.cy, floats(m.distortion))


def _imu(m: Any) -> Imu:
    return Imu(
        m.utime, floats(m.orientation), floats(m.angular_velocity), floats(m.linear_acceleration)
    )


def _navsat(m: Any) -> NavSat:
    return NavSat(m.utime, m.latitude_deg, m.longitude_deg, m.altitude, floats(m.velocity))


def _magnetometer(m: Any) -> Magnetometer:
    return Magnetometer(m.utime, floats(m.field))


def _altimeter(m: Any) -> Altimeter:
    return Altimeter(m.utime, m.altitude, m.velocity)


def _air_pressure(m: Any) -> AirPressure:
    return AirPressure(m.utime, m.pressure)


def _air_speed(m: Any) -> AirSpeed:
    return AirSpeed(m.utime, m.differential_pressure, m.temperature)


def _force_torque(m: Any) -> ForceTorque:
    return ForceTorque(m.utime, floats(m.force), floats(m.torque))


def _logical_camera(m: Any) -> LogicalCamera:
    _counted(m.n)
    return LogicalCamera(
        m.utime,
        [LogicalObject(o.model, floats(o.position), floats(o.orientation)) for o in m.objects],
    )


def _boxes_2d(m: Any) -> Boxes2D:
    _counted(m.n)
    boxes = [Box2D(b.label, b.name, b.x, b.y, b.width, b.height) for b in m.boxes]
    return Boxes2D(m.utime, m.width, m.height, boxes)


def _boxes_3d(m: Any) -> Boxes3D:
    _counted(m.n)
    boxes = [
        Box3D(b.label, b.name, floats(b.center), floats(b.orientation), floats(b.size))
        for b in m.boxes
    ]
    return Boxes3D(m.utime, boxes)


def _counted(length: int) -> None:
    if length < 0:  # lcm-gen's Python reads none then
        raise ValueError(f"a length of {length}")


def _points(m: Any) -> list[ContactPoint]:
    _counted(m.n)
    return [
        ContactPoint(p.body, floats(p.position), floats(p.normal), p.force, p.depth)
        for p in m.points
    ]


def _contact(m: Any) -> Contact:
    return Contact(m.utime, bool(m.pressed), _points(m))


def _collisions(m: Any) -> Collisions:
    return Collisions(m.utime, for_terminal(m.blocked_by), _points(m))


def _joints(m: Any) -> Joints:
    return Joints(
        m.utime,
        list(m.joint_name),
        floats(m.joint_position),
        floats(m.joint_velocity),
        floats(m.joint_effort),
    )


def _motion(m: Any) -> MotionStatus:
    return MotionStatus(
        m.utime,
        m.id,
        _MOTION_KINDS.get(m.kind, str(m.kind)),
        _MOTION_STATES.get(m.state, str(m.state)),
        _MOTION_REASONS.get(m.reason, str(m.reason)),
        m.done,
        m.remaining,
        m.v,
        m.omega,
    )


# Message type -> (generated class, conversion to a sample). A type that is not here is delivered as
# generated.
CONVERSIONS: dict[str, tuple[Any, Callable[[Any], Any]]] = {
    "planar_lidar_t": (lcmtypes.planar_lidar_t, _scan),
    "lidar_t": (lcmtypes.lidar_t, _lidar),
    "sonar_t": (lcmtypes.sonar_t, _sonar),
    "odometry_t": (lcmtypes.odometry_t, _odometry),
    "odometry_twist_t": (lcmtypes.odometry_twist_t, _odometry_twist),
    "pose_t": (lcmtypes.pose_t, _pose),
    "image_t": (lcmtypes.image_t, _image),
    "camera_info_t": (lcmtypes.camera_info_t, _camera_info),
    "imu_t": (lcmtypes.imu_t, _imu),
    "contact_t": (lcmtypes.contact_t, _contact),
    "collisions_t": (lcmtypes.collisions_t, _collisions),
    "joint_state_t": (lcmtypes.joint_state_t, _joints),
    "motion_status_t": (lcmtypes.motion_status_t, _motion),
    "navsat_t": (lcmtypes.navsat_t, _navsat),
    "magnetometer_t": (lcmtypes.magnetometer_t, _magnetometer),
    "altimeter_t": (lcmtypes.altimeter_t, _altimeter),
    "air_pressure_t": (lcmtypes.air_pressure_t, _air_pressure),
    "air_speed_t": (lcmtypes.air_speed_t, _air_speed),
    "force_torque_t": (lcmtypes.force_torque_t, _force_torque),
    "logical_camera_t": (lcmtypes.logical_camera_t, _logical_camera),
    "boxes_2d_t": (lcmtypes.boxes_2d_t, _boxes_2d),
    "boxes_3d_t": (lcmtypes.boxes_3d_t, _boxes_3d),
}


# What controllers read most, from the bytes: the generated classes take several times as long.

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
    _counted(count)
    if not count:
        return _empty(to)
    return _fixed(np.frombuffer(data, dtype, count, at).astype(to))


@lru_cache(maxsize=8)
def _empty(dtype: Any) -> NDArray[Any]:
    return _fixed(np.zeros(0, dtype))


@lru_cache(maxsize=256)
def _angles(first: float, step: float, count: int) -> Floats:
    """The same array for all scans of a device: nobody can write into it."""
    return _fixed(first + step * np.arange(count))


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
    _counted(count)
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
