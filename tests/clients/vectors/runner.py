"""What the Python client makes of the test vectors; runner.cpp and Runner.java are its twins.

runner.py decode         reads lines TYPE BYTES, says what each means
runner.py converse N...  steps so often, over a transport on standard input and output; says what
                         it saw
"""

import select
import struct
import sys
import types
import zlib

import ruedo
from ruedo.simulation import Simulation
from ruedo.stream import Stream


def row(name, values=()):
    return " ".join([name, *(f"{v:.6f}" if isinstance(v, float) else str(int(v)) for v in values)])


def floats(values):
    return [float(v) for v in values]


def meaning(type, s):
    yield row("utime", [s.utime])
    if type == "planar_lidar_t":
        yield row("ranges", floats(s.ranges))
        yield row("intensities", floats(s.intensities))
        yield row("angles", floats([s.angles[0], s.angles[-1]]) if len(s.ranges) else [])
    elif type == "lidar_t":
        yield row("shape", s.ranges.shape)
        yield row("ranges", floats(s.ranges.ravel()))
        yield row("intensities", floats(s.intensities.ravel()))
        yield row("azimuths", floats([s.azimuths[0], s.azimuths[-1]]))
        yield row("elevations", floats([s.elevations[0], s.elevations[-1]]))
    elif type == "image_t":
        yield row("picture", [s.width, s.height, s.row_stride])
        yield f"format {s.format}"
        yield row("data", s.data)
    elif type == "camera_info_t":
        yield row("picture", [s.width, s.height])
        yield row("focus", [s.fx, s.fy, s.cx, s.cy])
        yield row("distortion", floats(s.distortion))
    elif type == "sonar_t":
        yield row("ranges", floats(s.ranges))
        yield row("fired_utime", s.fired_utime)
        yield row("fresh", s.fresh)
    elif type == "odometry_t":
        yield row("pose", [s.x, s.y, s.theta])
        yield row("twist", [s.v, s.omega])
        yield row("angles", floats(s.wheel_angles))
        yield row("rates", floats(s.wheel_rates))
        yield row("ticks", s.ticks)
        yield row("resets", [s.resets])
    elif type == "odometry_twist_t":
        yield row("twist", [s.vx, s.vy, s.omega])
        yield row("covariance", floats(s.covariance.ravel()))
    elif type == "pose_t":
        for name in ("position", "orientation", "velocity", "rotation_rate", "acceleration"):
            yield row(name, floats(getattr(s, name)))
        yield row("heading", [s.heading])
    elif type == "imu_t":
        for name in ("orientation", "angular_velocity", "linear_acceleration"):
            yield row(name, floats(getattr(s, name)))
    elif type == "navsat_t":
        yield row("place", [s.latitude_deg, s.longitude_deg, s.altitude])
        yield row("velocity", floats(s.velocity))
    elif type == "magnetometer_t":
        yield row("field", floats(s.field))
    elif type == "altimeter_t":
        yield row("altitude", [s.altitude, s.velocity])
    elif type == "air_pressure_t":
        yield row("pressure", [s.pressure])
    elif type == "air_speed_t":
        yield row("air", [s.differential_pressure, s.temperature])
    elif type == "force_torque_t":
        yield row("force", floats(s.force))
        yield row("torque", floats(s.torque))
    elif type == "logical_camera_t":
        for o in s.objects:
            yield row(f"object {o.model}", floats([*o.position, *o.orientation]))
    elif type == "boxes_2d_t":
        yield row("picture", [s.width, s.height])
        for b in s.boxes:
            yield row(f"box {b.name}", [b.label, b.x, b.y, b.width, b.height])
    elif type == "boxes_3d_t":
        for b in s.boxes:
            yield row(f"box {b.name}", [b.label, *floats([*b.center, *b.orientation, *b.size])])
    elif type == "contact_t":
        yield row("pressed", [s.pressed])
        for p in s.points:
            yield row(f"point {p.body}", floats([*p.position, *p.normal, p.force, p.depth]))
    elif type == "collisions_t":
        yield f"blocked by {s.blocked_by}"
        for p in s.points:
            yield row(f"point {p.body}", floats([*p.position, *p.normal, p.force, p.depth]))
    elif type == "joint_state_t":
        for i, name in enumerate(s.names):
            yield row(f"joint {name}", floats([s.positions[i], s.velocities[i], s.efforts[i]]))
    elif type == "motion_status_t":
        yield row("id", [s.id])
        yield f"{s.kind} {s.state} {s.reason}"
        yield row("amounts", [s.progress, s.remaining])
        yield row("twist", [s.v, s.omega])


def decode():
    for line in sys.stdin:
        type, *data = line.split()
        connection = types.SimpleNamespace(
            version="", faults=types.SimpleNamespace(note=lambda *_: None)
        )
        try:
            lines = list(
                meaning(
                    type,
                    Stream(connection, "c", type, 0, 0.0)._sample_of(bytes.fromhex("".join(data))),
                )
            )
        except ruedo.TypeMismatch:
            lines = ["broken"]
        print("\n".join(lines), end="\n.\n")


class PipeTransport:
    """Frames on standard input and output: the lengths of channel and message, and both."""

    loses_nothing = False
    is_connected = True

    def __init__(self):
        self._in, self._out = sys.stdin.buffer, sys.stdout.buffer

    def subscribe(self, channel):
        pass

    unsubscribe = subscribe

    def publish(self, channel, data):
        self._out.write(struct.pack(">ii", len(channel), len(data)) + channel.encode() + data)
        self._out.flush()

    def receive(self, seconds, receiver):
        if not select.select([self._in], [], [], seconds)[0]:
            return False
        name, size = struct.unpack(">ii", self._read(8))
        receiver([(self._read(name).decode(), self._read(size))])
        return True

    def _read(self, size):
        data = b""
        while len(data) < size:
            more = self._in.raw.read(
                size - len(data)
            )  # unbuffered, so that select() sees what is left
            if not more:
                sys.exit(3)
            data += more
        return data

    def close(self):
        pass


def converse(steps):
    sim = Simulation("memq://", "test", 300.0, transport=PipeTransport())
    try:
        robot = sim.robot("p3at")
        for n in steps:
            if n == "pause":
                sim.pause()
                continue
            seen = sim.step(int(n), [robot.velocity_command(0.5, 0.0)] if int(n) else [], 300.0)
            said = [f"{m.step}:{m.channel}:{zlib.crc32(m.data)}" for m in seen.messages]
            print("step", seen.step, seen.utime, seen.state_hash, *said, file=sys.stderr)
    except ruedo.RuedoError as error:
        code = f" {error.code}" if type(error) is ruedo.RequestError else ""
        print(f"{type(error).__name__}{code}: {error}", file=sys.stderr)


decode() if sys.argv[1] == "decode" else converse(sys.argv[2:])
