"""Methods of samples, by the kind of sample. The classes themselves are made
from proto/vocabulary.toml.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from . import notebook
from .arguments import shown
from .errors import UnknownName
from .geometry import Floats, Placed, Transform, between, heading_of, transformed

if TYPE_CHECKING:
    from .samples import ContactPoint, NavSat, Odometry, Pose


class ScanMethods:
    ranges: Floats
    angles: Floats

    def nearest(self, from_angle: float = -math.pi, to_angle: float = math.pi) -> float:
        """The smallest range (m) between two angles (rad); +inf when nothing is there, -inf when
        something is nearer than the device can measure."""
        part = self.ranges[(self.angles >= from_angle) & (self.angles <= to_angle)]
        return float(part.min()) if part.size else math.inf

    def points(self, device: Placed | None = None, pose: Placed | None = None) -> Floats:
        """The end points of the rays that returned: (k, 2) m in the device's frame; with the
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
        axes = notebook.axes_of(axes)
        points = self.points()
        axes.plot(-points[:, 1], points[:, 0], ".", markersize=3)
        axes.plot(0.0, 0.0, "^", color="tab:red")
        axes.set(aspect="equal", xlabel="to the right, m", ylabel="ahead, m")
        return axes

    def _repr_svg_(self) -> str:
        return notebook.scan_svg(self.points())


class OdometryMethods:
    utime: int
    x: float
    y: float
    theta: float

    @property
    def heading(self) -> float:
        """theta, wrapped as Pose.heading is: rad, counter-clockwise from odom's x axis, in [-pi,
        pi].
        """
        return math.remainder(self.theta, math.tau)

    @property
    def transform(self) -> Transform:
        """base_link in odom."""
        return Transform.of(self.x, self.y, self.theta)

    def interpolated(self, later: Odometry, utime: int) -> Odometry:
        """Between this one and a later one, at utime (us)."""
        share = (utime - self.utime) / (later.utime - self.utime)
        values = {
            name: (1.0 - share) * getattr(self, name) + share * getattr(later, name)
            for name in ("x", "y", "theta", "v", "omega", "wheel_angles", "wheel_rates")
        }
        return replace(cast("Odometry", self), utime=utime, **values)


class PoseMethods:
    utime: int
    position: Floats
    orientation: Floats

    @property
    def transform(self) -> Transform:
        """base_link in the world."""
        return Transform(self.position, self.orientation)

    def interpolated(self, later: Pose, utime: int) -> Pose:
        """Between this one and a later one, at utime (us)."""
        share = (utime - self.utime) / (later.utime - self.utime)
        values = {
            name: (1.0 - share) * getattr(self, name) + share * getattr(later, name)
            for name in ("position", "velocity", "rotation_rate", "acceleration")
        }
        turned = between(self.orientation, later.orientation, share)
        return replace(cast("Pose", self), utime=utime, orientation=turned, **values)

    @property
    def x(self) -> float:
        """m."""
        return float(self.position[0])

    @property
    def y(self) -> float:
        """m."""
        return float(self.position[1])

    @property
    def heading(self) -> float:
        """rad, counter-clockwise from the world's x axis, in (-pi, pi]."""
        return heading_of(self.orientation)


_RAW = {
    "gray": ("u1", 1),
    "rgb": ("u1", 3),
    "bgr": ("u1", 3),
    "gray16": ("<u2", 1),
    "float32": ("<f4", 1),
}


class ImageMethods:
    width: int
    height: int
    format: str
    row_stride: int
    data: bytes

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
        """Writes PNG to a name that ends in .png, else a JPEG's bytes as they are (.jpg) and raw
        8-bit pictures as PPM or PGM. Raises ValueError for an ending of another format.
        """
        ending = Path(path).suffix.lower()
        own = {"jpeg": [".jpg", ".jpeg"], "gray": [".pgm"]}.get(self.format, [".ppm"])
        if self.format in ("gray16", "float32"):
            raise ValueError(f"{self.format} pictures have no common file format: use array()")
        if ending not in ("", ".png", *own):
            raise ValueError(
                f"{self.format} pictures are saved as .png or {own[0]}, not as {ending}"
            )
        if ending == ".png":
            content = notebook.png(self.array())
        elif self.format == "jpeg":
            content = self.data
        else:
            head = "P5" if self.format == "gray" else "P6"
            content = f"{head} {self.width} {self.height} 255\n".encode() + self.array().tobytes()
        Path(path).write_bytes(content)


class ImuMethods:
    orientation: Floats

    @property
    def heading(self) -> float:
        """rad, counter-clockwise from the world's x axis to the device's, in (-pi, pi]."""
        return Transform(np.zeros(3), self.orientation).heading


class NavSatMethods:
    latitude_deg: float
    longitude_deg: float
    altitude: float

    def enu(self, origin: NavSat) -> Floats:
        """(3,) m to the east, to the north and upwards of another fix, usually the first: on the
        plane that touches the WGS 84 ellipsoid's parallel surface there.
        """
        latitude, longitude = math.radians(origin.latitude_deg), math.radians(origin.longitude_deg)
        north = math.sin(latitude), math.cos(latitude)
        east = math.sin(longitude), math.cos(longitude)
        to_enu = np.array(
            [
                [-east[0], east[1], 0.0],
                [-north[0] * east[1], -north[0] * east[0], north[1]],
                [north[1] * east[1], north[1] * east[0], north[0]],
            ]
        )
        made: Floats = to_enu @ (_earth_centred(self) - _earth_centred(origin))
        return made


def _earth_centred(fix: NavSatMethods) -> Floats:
    """Earth-centred, Earth-fixed coordinates, m: WGS 84 (NIMA TR8350.2, eq. 4-14)."""
    axis, flattening = 6378137.0, 1.0 / 298.257223563
    squared = flattening * (2.0 - flattening)
    latitude, longitude = math.radians(fix.latitude_deg), math.radians(fix.longitude_deg)
    normal = axis / math.sqrt(1.0 - squared * math.sin(latitude) ** 2)
    along = (normal + fix.altitude) * math.cos(latitude)
    return np.array(
        [
            along * math.cos(longitude),
            along * math.sin(longitude),
            ((1.0 - squared) * normal + fix.altitude) * math.sin(latitude),
        ]
    )


class JointsMethods:
    names: list[str]
    positions: Floats
    velocities: Floats
    efforts: Floats

    def index(self, name: str) -> int:
        """A joint's index in the arrays. Raises UnknownName, which lists the joints."""
        if name not in self.names:
            raise UnknownName(
                f"there is no joint {shown(name)}; there is {', '.join(self.names) or 'none'}"
            )
        return self.names.index(name)

    def position(self, name: str) -> float:
        """The position of a joint, rad or m. Raises UnknownName."""
        return float(self.positions[self.index(name)])

    def velocity(self, name: str) -> float:
        """The velocity of a joint, rad/s or m/s. Raises UnknownName."""
        return float(self.velocities[self.index(name)])

    def effort(self, name: str) -> float:
        """The effort of a joint's motor, N m or N. Raises UnknownName."""
        return float(self.efforts[self.index(name)])


class CollisionsMethods:
    points: list[ContactPoint]

    @property
    def bodies(self) -> list[str]:
        """The names of what is touched, each once, sorted; empty: nothing is."""
        return sorted({point.body for point in self.points})
