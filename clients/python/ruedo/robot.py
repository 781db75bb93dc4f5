"""A robot, its devices, and how it is driven."""

from __future__ import annotations

import contextlib
import math
import struct
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, TypeVar

import numpy as np

from . import lcmtypes
from .arguments import check_callback, finite, number, numbers, options, shown, text
from .errors import NoServer, NotSupported, UnknownName
from .geometry import Floats, Transform
from .joints import JointStream, limits_of
from .joints import message as joint_message
from .lockstep import Command
from .motion import Driver, Motion
from .samples import (
    AirPressure,
    AirSpeed,
    Altimeter,
    Boxes2D,
    Boxes3D,
    CameraInfo,
    Collisions,
    Contact,
    ForceTorque,
    Image,
    Imu,
    Joints,
    LidarScan,
    LogicalCamera,
    Magnetometer,
    MotionStatus,
    NavSat,
    Odometry,
    OdometryTwist,
    Pose,
    Scan,
    SonarReading,
)
from .stream import RAW, Form, Stream, form_of
from .vocabulary import JointMode

if TYPE_CHECKING:
    from .callbacks import Subscription
    from .session.connection import Connection

T = TypeVar("T")

_VELOCITY = struct.Struct(">8sqddd")  # fingerprint, utime, vx, vy, omega
_MOVE_SIDEWAYS = (" mecanum", " omni", " holonomic")  # ends of a drive's name
_VELOCITY_FINGERPRINT = lcmtypes.velocity_command_t._get_packed_fingerprint()


class Device(Stream[T]):
    """A sensor of a robot: latest(), next() and on_sample() deliver its samples.

    kind: "lrf", "sonar", "odometry", "camera", "pose", "motion", "imu", "contact", ... position
    (3,) m and orientation (4,) w, x, y, z: the device's frame in base_link at the start. range_min,
    range_max: m. fov_horizontal, fov_vertical: rad. width, height: rays and layers, transducers, or
    pixels. elements (n, 6): a sonar's transducers, x, y, z, roll, pitch, yaw in its frame.
    """

    def __init__(self, connection: Connection, robot: str, info: Any, channel: Any):
        super().__init__(connection, channel.name, channel.type, channel.fingerprint, info.rate)
        self._owner = connection
        self.robot: str = robot
        self.name: str = info.name
        self.kind: str = info.kind
        self.position: Floats = np.array(info.position, np.float64)
        self.orientation: Floats = np.array(info.orientation, np.float64)
        self.range_min: float = info.range_min
        self.range_max: float = info.range_max
        self.fov_horizontal: float = info.fov_horizontal
        self.fov_vertical: float = info.fov_vertical
        self.width: int = info.width
        self.height: int = info.height
        self.elements: Floats = np.array(info.element_pose, np.float64).reshape(info.nelements, 6)

    @property
    def transform(self) -> Transform:
        """The device's frame in base_link at the start."""
        return Transform(self.position, self.orientation)


class Camera(Device[Image]):
    """A camera; its further channels, where the world file asks for them: depth, labels,
    intrinsics.
    """

    @property
    def depth(self) -> Stream[Image]:
        """Pictures of depth: "float32", m along the optical axis. Raises UnknownName for none."""
        return self._part("depth")

    @property
    def labels(self) -> Stream[Image]:
        """Pictures of labels: "gray16", body index + 1. Raises UnknownName for none."""
        return self._part("labels")

    @property
    def intrinsics(self) -> Stream[CameraInfo]:
        """The camera's pinhole model. Raises UnknownName if it has none."""
        return self._part("info")

    def _part(self, part: str) -> Stream[Any]:
        return _camera_part(self._owner, self.robot, self.name, part)


class JointDevice(JointStream, Device[Joints]):
    """The states of a robot's joints."""


_DEVICES: dict[str, type[Device[Any]]] = {"image_t": Camera, "joint_state_t": JointDevice}


class Robot:
    """A robot of the simulation. Lengths in m, angles in rad, counter-clockwise is positive.

    drive: "kinematic", "wheels", or "" for a robot that only senses; "kinematic mecanum" and its
    like name another steering. watchdog: s of sim time without a command after which it stops, 0:
    never. wheels: names of the wheel joints.
    """

    def __init__(self, connection: Connection, name: str):
        self.name = name
        self._connection = connection
        self._devices_of: Any = None  # the info that _devices_now was made from
        self._devices_now: list[Device[Any]] = []
        self._inputs_of: Any = None  # the same, of _inputs_now
        self._inputs_now: dict[str, str] = {}  # channels by type

    def __repr__(self) -> str:
        return f"<Robot {self.name}: {', '.join(d.name for d in self.devices)}>"

    # Description.

    @property
    def _info(self) -> Any:
        return self._connection.robot_info(self.name)

    @property
    def model(self) -> str:
        """Name of the model that it was made of."""
        return str(self._info.model)

    @property
    def drive(self) -> str:
        """ "kinematic", "wheels", ...; "" for a robot that only senses."""
        return str(self._info.drive)

    @property
    def wheel_radius(self) -> float:
        """m."""
        return float(self._info.wheel_radius)

    @property
    def track(self) -> float:
        """m between the left and the right wheels."""
        return float(self._info.track)

    @property
    def max_speed(self) -> float:
        """m/s."""
        return float(self._info.max_speed)

    @property
    def max_turn_rate(self) -> float:
        """rad/s."""
        return float(self._info.max_turn_rate)

    @property
    def watchdog(self) -> float:
        """s of sim time without a command after which it stops; 0: never."""
        return float(self._info.watchdog_us) * 1e-6

    @property
    def wheels(self) -> list[str]:
        """Names of the wheel joints."""
        return list(self._info.wheels)

    # Its devices.

    @property
    def devices(self) -> list[Device[Any]]:
        """All devices, in the order of the world file."""
        known = self._connection.info
        if self._devices_of is not known:
            found = [self._device(info) for info in known.devices.get(self.name, ())]
            self._devices_now = [device for device in found if device is not None]
            self._devices_of = known
        return list(self._devices_now)

    def device(self, name: str) -> Device[Any]:
        """The device of that name; UnknownName lists those that exist."""
        devices = self.devices
        text("name", name)
        for device in devices:
            if device.name == name:
                return device
        raise UnknownName(
            f"{self.name} has no device {shown(name)}; it has {', '.join(d.name for d in devices) or 'none'}"
        )

    @property
    def lrf(self) -> Device[Scan]:
        """The first laser range finder with one layer."""
        return self._first("planar_lidar_t", "laser range finder")

    @property
    def lidar(self) -> Device[LidarScan]:
        """The first laser scanner with several layers."""
        return self._first("lidar_t", "laser scanner with several layers")

    @property
    def sonar(self) -> Device[SonarReading]:
        """The first sonar array."""
        return self._first("sonar_t", "sonar")

    @property
    def odometry(self) -> Device[Odometry]:
        """Wheel odometry."""
        return self._first("odometry_t", "odometry")

    @property
    def odometry_twist(self) -> Stream[OdometryTwist]:
        """The velocity that the odometry computes from the wheels' speeds, also sideways."""
        return self._stream("odometry_twist_t", "velocity of odometry")

    @property
    def camera(self) -> Camera:
        """The first camera."""
        camera = self._first("image_t", "camera")
        assert isinstance(camera, Camera)
        return camera

    @property
    def cameras(self) -> dict[str, Camera]:
        """All cameras, by their names: ``robot.cameras["left"].depth``."""
        return {one.name: one for one in self.devices if isinstance(one, Camera)}

    @property
    def boxes_2d(self) -> Device[Boxes2D]:
        """The first camera that boxes what it sees in its picture."""
        return self._first("boxes_2d_t", "bounding box camera")

    @property
    def boxes_3d(self) -> Device[Boxes3D]:
        """The first camera that boxes what it sees in space."""
        return self._first("boxes_3d_t", "bounding box camera in space")

    @property
    def imu(self) -> Device[Imu]:
        """The first inertial measurement unit."""
        return self._first("imu_t", "IMU")

    @property
    def gps(self) -> Device[NavSat]:
        """The first satellite receiver; ``fix.enu(origin)`` is its place in metres."""
        return self._first("navsat_t", "satellite receiver")

    @property
    def magnetometer(self) -> Device[Magnetometer]:
        """The first magnetometer."""
        return self._first("magnetometer_t", "magnetometer")

    @property
    def altimeter(self) -> Device[Altimeter]:
        """The first altimeter."""
        return self._first("altimeter_t", "altimeter")

    @property
    def air_pressure(self) -> Device[AirPressure]:
        """The first barometer."""
        return self._first("air_pressure_t", "barometer")

    @property
    def air_speed(self) -> Device[AirSpeed]:
        """The first Pitot tube."""
        return self._first("air_speed_t", "air speed sensor")

    @property
    def force_torque(self) -> Device[ForceTorque]:
        """The first force-torque sensor."""
        return self._first("force_torque_t", "force-torque sensor")

    @property
    def logical_camera(self) -> Device[LogicalCamera]:
        """The first logical camera."""
        return self._first("logical_camera_t", "logical camera")

    @property
    def contact(self) -> Device[Contact]:
        """The first bumper."""
        return self._first("contact_t", "contact sensor")

    @property
    def collisions(self) -> Stream[Collisions]:
        """The bodies that the robot touches, and the one that blocks it; no bumper is needed."""
        return self._stream("collisions_t", "collisions")

    def on_collision(self, callback: Callable[[Collisions], None]) -> Subscription:
        """Calls callback(collisions) as on_sample() does, but only when the robot runs into a body
        that it did not touch a moment before.
        """
        check_callback(callback)
        touched: list[str] = []

        def see(sample: Collisions) -> Any:
            news = not set(sample.bodies) <= set(touched)
            touched[:] = sample.bodies
            return callback(sample) if news else None

        return self.collisions.on_sample(see)

    @property
    def pose(self) -> Stream[Pose]:
        """The true pose."""
        return self._stream("pose_t", "true pose")

    @property
    def motion(self) -> Stream[MotionStatus]:
        """The status of the command that the robot executes."""
        return self._stream("motion_status_t", "motion status")

    @property
    def joints(self) -> JointStream:
        """The states of its joints, and each of them by its name: ``robot.joints["elbow"]``."""
        stream = self._stream("joint_state_t", "joints")
        assert isinstance(stream, JointStream)
        return stream.attach(self, self._connection)

    # Driving.

    def set_velocity(self, v: float, omega: float, vy: float = 0.0) -> None:
        """Drives with v (m/s ahead) and omega (rad/s), within the robot's limits, until the next
        command of any kind: this program repeats it in the background, so that the watchdog does
        not stop the robot. It lapses `watchdog` s of sim time after the program has ended or was
        stopped. driving() shows in the program how long that is to last. vy: m/s to the left, of a
        robot that moves sideways. Raises NotSupported for another robot, and in lockstep, as all
        that drives at once."""
        command = self.velocity_command(v, omega, vy)
        self._driver("velocity_command(v, omega)").keep_sending(command.channel, command.data)

    @contextlib.contextmanager
    def driving(self, v: float, omega: float, vy: float = 0.0) -> Iterator[Robot]:
        """``with robot.driving(0.3, 0.0): ...`` drives as set_velocity() does for as long as the
        block lasts, however it ends, and then stops.
        """
        self.set_velocity(v, omega, vy)
        try:
            yield self
        finally:
            with contextlib.suppress(NoServer):
                self.stop()

    def set_wheels(self, left: float, right: float) -> None:
        """Turns the wheels of the left and right side (rad/s, positive ahead), until the next
        command.
        """
        command = self.wheel_command(left, right)
        self._driver("wheel_command(left, right)").keep_sending(command.channel, command.data)

    def velocity_command(self, v: float, omega: float, vy: float = 0.0) -> Command:
        """A velocity command for Simulation.step(), as set_velocity() sends it, once."""
        data = _VELOCITY.pack(
            _VELOCITY_FINGERPRINT,
            self._connection.clock.utime,
            finite("v", v),
            finite("vy", vy),
            finite("omega", omega),
        )
        channel = self._input("velocity_command_t")
        if vy and not self.drive.endswith(_MOVE_SIDEWAYS):
            raise NotSupported(
                f"vy is {vy} m/s, but {self.name} cannot move sideways: its drive is {self.drive!r}"
            )
        return Command(channel, data)

    def command_joints(
        self, values: Mapping[str, float], mode: JointMode | str = "position"
    ) -> None:
        """Commands joints by their names: ``{"shoulder": 0.5, "elbow": -0.3}``. Each joint holds
        its command until the next one, without a watchdog.

        mode: "position" (rad or m), "velocity" (rad/s or m/s), "effort" (N m or N), or another of
        JointMode. Positions are kept within the joint's limits. Raises UnknownName, which lists the
        joints, NotSupported for a joint that takes no commands, and in lockstep.
        """
        self._connection.check_open()
        self._check_acts_at_once("joint_command({...})")
        command = self.joint_command(values, mode)
        self._connection.bus.publish(command.channel, command.data)

    def joint_command(
        self, values: Mapping[str, float], mode: JointMode | str = "position"
    ) -> Command:
        """A joint command for Simulation.step(), as command_joints() sends it."""
        channel = self._input("joint_command_t", "it has no joints")
        limits = limits_of(self._connection, self.name)
        command = joint_message(self.name, limits, values, mode)
        command.utime = self._connection.clock.utime
        return Command(channel, command.encode())

    def wheel_command(self, left: float, right: float) -> Command:
        """A wheel command for Simulation.step(), as set_wheels() sends it, once."""
        command = lcmtypes.wheel_command_t()
        command.utime, command.n = self._connection.clock.utime, 2
        command.rate = [finite("left", left), finite("right", right)]
        return Command(self._input("wheel_command_t"), command.encode())

    def move_command(
        self,
        kind: Literal["advance", "rotate", "heading", "arc", "stop"],
        value: float,
        speed: float = 0.0,
        acceleration: float = 0.0,
        deceleration: float = 0.0,
        radius: float = 0.0,
    ) -> Command:
        """A motion primitive for Simulation.step(). kind: "advance", "rotate", "heading", "arc" or
        "stop"; value in m or rad, of a stop 0; limits and radius as in advance() and its like."""
        kinds = {
            name: getattr(lcmtypes.move_command_t, name.upper())
            for name in ("advance", "rotate", "heading", "arc", "stop")
        }
        if kind not in kinds:
            raise ValueError(
                f"kind is {shown(kind)}: it must be one of {', '.join(map(repr, kinds))}"
            )
        command = self._move_message(kinds[kind], value, radius, speed, acceleration, deceleration)
        return Command(self._input("move_command_t"), command.encode())

    def fault_command(
        self,
        kind: str,
        target: str = "",
        *,
        duration: float = 0.0,
        value: float = 0.0,
        view: tuple[float, float] = (0.0, 1.0),
        place: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> Command:
        """A fault for Simulation.step(), or for inject(). kind and target as in proto/fault_t.lcm:
        "freeze" of "lrf", "kidnapped".

        duration: s of sim time, 0: to the end. view: of "blocked", parts of the field of view.
        place: of "kidnapped", m, m, rad.
        """
        fault = lcmtypes.fault_t()
        fault.utime = self._connection.clock.utime
        fault.kind, fault.target = text("kind", kind), text("target", target)
        fault.duration, fault.value = finite("duration", duration), finite("value", value)
        fault.view_begin, fault.view_end = (finite("view", one) for one in numbers("view", view, 2))
        fault.x, fault.y, fault.heading = (
            finite("place", one) for one in numbers("place", place, 3)
        )
        return Command(self._input("fault_t"), fault.encode())

    def inject(self, kind: str, target: str = "", **how: Any) -> None:
        """Injects a fault from now on, with the arguments of fault_command(). The server's log says
        what acted; a wrong one is ignored. Raises NotSupported in lockstep.
        """
        self._connection.check_open()
        self._check_acts_at_once(f"fault_command({shown(kind)}, ...)")
        command = self.fault_command(kind, target, **how)
        self._connection.bus.publish(command.channel, command.data)

    def stop(self, deceleration: float = 0.0) -> Motion:
        """Comes to rest. deceleration: limit in m/s^2, 0: the robot's own."""
        return self._move("stop", lcmtypes.move_command_t.STOP, 0.0, deceleration=deceleration)

    def advance(
        self,
        distance: float,
        speed: float = 0.0,
        acceleration: float = 0.0,
        deceleration: float = 0.0,
    ) -> Motion:
        """Drives straight on by a distance (m, negative: back), and comes to rest. Returns at once;
        wait() on the result waits for the end. Limits in m/s and m/s^2, 0: the robot's own.
        """
        return self._move(
            "advance",
            lcmtypes.move_command_t.ADVANCE,
            distance,
            0.0,
            speed,
            acceleration,
            deceleration,
        )

    def rotate(
        self, angle: float, speed: float = 0.0, acceleration: float = 0.0, deceleration: float = 0.0
    ) -> Motion:
        """Turns on the spot by an angle (rad, more than a turn is allowed). Limits in rad/s and
        rad/s^2.
        """
        _radians("rotate", angle, 4.0 * math.pi)
        return self._move(
            "rotate", lcmtypes.move_command_t.ROTATE, angle, 0.0, speed, acceleration, deceleration
        )

    def turn_to(
        self,
        heading: float,
        speed: float = 0.0,
        acceleration: float = 0.0,
        deceleration: float = 0.0,
    ) -> Motion:
        """Turns on the spot, the shorter way, to a heading (rad, in the frame odom). Limits in
        rad/s and rad/s^2.
        """
        _radians("turn_to", heading, 2.0 * math.pi)
        return self._move(
            "turn_to",
            lcmtypes.move_command_t.HEADING,
            heading,
            0.0,
            speed,
            acceleration,
            deceleration,
        )

    def arc(
        self,
        angle: float,
        radius: float,
        speed: float = 0.0,
        acceleration: float = 0.0,
        deceleration: float = 0.0,
    ) -> Motion:
        """Drives ahead along a circle of a radius (m, > 0) until it has turned by an angle (rad;
        positive: to the left). Limits in m/s and m/s^2."""
        if not number("radius", radius) > 0.0:
            raise ValueError(
                f"radius is {radius}: it must be > 0 m; the sign of the angle says left or right"
            )
        _radians("arc", angle, 4.0 * math.pi)
        return self._move(
            "arc", lcmtypes.move_command_t.ARC, angle, radius, speed, acceleration, deceleration
        )

    def _move(
        self,
        name: str,
        kind: int,
        value: float,
        radius: float = 0.0,
        speed: float = 0.0,
        acceleration: float = 0.0,
        deceleration: float = 0.0,
    ) -> Motion:
        command = self._move_message(kind, value, radius, speed, acceleration, deceleration)
        driver = self._driver(f'move_command("{"heading" if name == "turn_to" else name}", ...)')
        return driver.move(self._input("move_command_t"), command, name)

    def _move_message(
        self,
        kind: int,
        value: float,
        radius: float,
        speed: float,
        acceleration: float,
        deceleration: float,
    ) -> Any:
        command = lcmtypes.move_command_t()
        command.utime, command.id, command.kind = (
            self._connection.clock.utime,
            self._connection.next_id(),
            kind,
        )
        command.value, command.radius = finite("value", value), finite("radius", radius)
        command.speed = _limit("speed", speed)
        command.acceleration = _limit("acceleration", acceleration)
        command.deceleration = _limit("deceleration", deceleration)
        return command

    @options(type="message")
    def stream(self, name: str, message: Any = None, *, raw: bool = False) -> Stream[Any]:
        """The messages of a device or channel, by its name ("temp"); of a plugin's, too.

        message: the class that lcm-gen made of its .lcm file; samples are its objects. raw: samples
        are the bytes of the messages. Neither: Ruedo's own samples, where there are some of its
        type. What step() returns takes the stream, too.
        Raises UnknownName; at the first use TypeMismatch.
        """
        if message is not None and raw:
            raise TypeError("stream() takes a message's class or raw=True, not both")
        form = RAW if raw else form_of(message) if message is not None else None
        outputs = [channel for channel in self._channels if not channel.input]
        for channel in outputs:
            if name in (channel.device, channel.name) or channel.name == f"{self.name}/{name}":
                if form is None and any(device.name == channel.device for device in self.devices):
                    return next(d for d in self.devices if d.name == channel.device)
                return self._plain(channel, form)
        there = ", ".join(sorted({c.device or c.name for c in outputs}))
        raise UnknownName(
            f"{self.name} publishes no {shown(name)}; it publishes {there or 'nothing'}"
        )

    # Channels, by what info says of them: names on the bus may be remapped.

    @property
    def _channels(self) -> list[Any]:
        return self._connection.info.channels.get(self.name, [])

    def _input(self, type: str, lack: str = "") -> str:
        known = self._connection.info
        if self._inputs_of is not known:
            self._inputs_now, self._inputs_of = {}, known
        channel = self._inputs_now.get(type)
        if channel is None:
            channel = self._inputs_now[type] = self._find_input(type, lack)
        return channel

    def _driver(self, in_steps: str) -> Driver:
        driver = self._connection.drivers.get(self)
        self._check_acts_at_once(in_steps)
        return driver

    def _check_acts_at_once(self, in_steps: str) -> None:
        """in_steps: the call to make in lockstep, where what is sent beside the steps would act at
        whatever step the run has reached.
        """
        if self._connection.in_lockstep:
            raise NotSupported(
                "in lockstep a command acts at a step that its client chooses: "
                f"sim.step(n, [robot.{in_steps}])"
            )

    def _find_input(self, type: str, lack: str) -> str:
        for channel in self._channels:
            if channel.input and channel.type == type:
                return str(channel.name)
        if lack:
            raise NotSupported(f"{self.name} takes no {type}: {lack}")
        if not self.drive:
            raise NotSupported(
                f"{self.name} cannot be driven: its model has no drive; --drive {self.name}=LEFT+...,RIGHT+... gives it one, by its wheel joints"
            )
        raise NotSupported(f"{self.name} takes no {type}")

    def _device(self, info: Any) -> Device[Any] | None:
        channel = self._connection.info.device_channels.get((self.name, info.name))
        if channel is None:
            return None
        make = _DEVICES.get(channel.type, Device)
        stream = self._connection.streams.get(
            channel, partial(make, self._connection, self.name, info, channel)
        )
        return stream if isinstance(stream, Device) else None

    def _first(self, type: str, what: str) -> Any:
        devices = self.devices
        for device in devices:
            if device.type == type:
                return device
        raise UnknownName(
            f"{self.name} has no {what}; it has {', '.join(d.name for d in devices) or 'no devices'}"
        )

    def _stream(self, type: str, what: str) -> Any:
        for device in self.devices:
            if device.type == type:
                return device
        for channel in self._channels:
            if channel.type == type and not channel.input:
                return self._plain(channel)
        raise UnknownName(f"{self.name} publishes no {what}")

    def _plain(self, channel: Any, form: Form | None = None) -> Stream[Any]:
        return _plain(self._connection, channel, form)


def _plain(connection: Connection, channel: Any, form: Form | None = None) -> Stream[Any]:
    """A stream that belongs to no device."""
    made = JointStream if channel.type == "joint_state_t" and form is None else Stream
    return connection.streams.get(
        channel,
        lambda: made(
            connection, channel.name, channel.type, channel.fingerprint, channel.rate, form
        ),
        form,
    )


def _camera_part(connection: Connection, robot: str, camera: str, part: str) -> Stream[Any]:
    connection.robot_info(robot)  # raises UnknownName
    for channel in connection.info.channels.get(robot, []):
        named = channel.device == f"{camera}/{part}" or (
            channel.device == camera and channel.name.endswith("/" + part)
        )
        if named and not channel.input:
            return _plain(connection, channel)
    raise UnknownName(
        f"{robot}/{camera} publishes no {part}; <ruedo:{part}> in the world file switches it on"
    )


def _radians(call: str, angle: float, usual: float) -> None:
    """Warns of whole numbers that would be many turns as radians, as they are probably degrees;
    they are executed all the same.
    """
    if abs(number("angle", angle)) > usual and float(angle).is_integer():
        warnings.warn(
            f"{call}({angle:g}) is {abs(angle) / (2.0 * math.pi):.1f} turns: angles are in radians, {call}(math.radians({angle:g}))",
            stacklevel=3,
        )


def _limit(name: str, value: float) -> float:
    if not (math.isfinite(number(name, value)) and value >= 0.0):
        raise ValueError(
            f"{name} is {value}: it must be a finite number >= 0; 0 is the robot's own limit"
        )
    return float(value)
