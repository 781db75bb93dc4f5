"""Reader of LCM logs with Ruedo's types, which include bot_core's pose_t and planar_lidar_t."""

from __future__ import annotations

from pathlib import Path as File
from typing import Any

import numpy as np

from .. import lcmtypes
from ..decoding import decode
from ..logs import events
from .errors import FitError
from .recording import (
    Array,
    Commands,
    Geometry,
    Imu,
    Path,
    Recording,
    Scans,
    Wheels,
    body_steps,
    sorted_rows,
)

_TYPES = (
    "pose_t",
    "odometry_t",
    "planar_lidar_t",
    "velocity_command_t",
    "imu_t",
    "world_info_t",
    "applied_t",
)


def read_lcm(file: File, robot: str = "") -> Recording:
    """robot: whose channels; "": those of the only one, or of none, as bot_core's. Raises
    FitError.
    """
    types = {getattr(lcmtypes, name)._get_packed_fingerprint(): name for name in _TYPES}
    found: dict[str, dict[str, list[Any]]] = {name: {} for name in _TYPES}
    for event in events(file):
        name = types.get(event.data[:8])
        if name is not None:
            try:
                message = decode(getattr(lcmtypes, name), event.data)
            except Exception:
                continue  # a message that does not decode as its type
            if name == "applied_t":  # when a command took effect
                _add_command(found["velocity_command_t"], message)
                continue
            if name == "velocity_command_t":  # its own stamp is informational
                message.utime = event.timestamp
            found[name].setdefault(event.channel, []).append(message)
    robots = {_robot_of(channel) for name in _TYPES[1:4] for channel in found[name]} - {""}
    if robot and robot not in robots:
        raise FitError(f"{file}: no robot '{robot}'; it has {', '.join(sorted(robots)) or 'none'}")
    if not robot:
        if len(robots) > 1:
            raise FitError(
                f"{file}: several robots: {', '.join(sorted(robots))}; name one with --of"
            )
        robot = next(iter(robots), "")
    recording = Recording(file, "LCM log")
    own = {name: _own(recording, name, every, robot) for name, every in found.items()}
    own["pose_t"] = found["pose_t"].get(f"{robot}/pose", own["pose_t"])
    _fill(recording, own)
    infos = next(iter(found["world_info_t"].values()), [])
    if infos:
        _use_info(recording, infos[-1], robot)
    return recording


def _robot_of(channel: str) -> str:
    """ "" for a channel that is not of a robot, as bot_core's POSE and LASER."""
    return channel.split("/")[0] if "/" in channel else ""


def _own(recording: Recording, name: str, every: dict[str, list[Any]], robot: str) -> list[Any]:
    """The messages of a type on the first channel of the robot, else on the first of none."""
    for owner in (robot, ""):
        channels = sorted(one for one in every if _robot_of(one) == owner)
        if channels:
            if len(channels) > 1 and name == "planar_lidar_t":
                recording.findings.append(f"range finders {', '.join(channels)}: the first is read")
            return every[channels[0]]
    return []


def _add_command(commands: dict[str, list[Any]], applied: Any) -> None:
    if applied.channel.endswith("/velocity") and not applied.kind:
        try:
            message = decode(lcmtypes.velocity_command_t, bytes(applied.data))
        except Exception:
            return  # a message that does not decode as its type
        message.utime = applied.utime
        commands.setdefault(applied.channel, []).append(message)


def _stamps(messages: list[Any]) -> Array:
    return np.array([one.utime for one in messages]) * 1e-6


def yaw_of(quaternion: Array) -> Array:
    """(N, 4) w, x, y, z to headings (N,)."""
    w, x, y, z = quaternion.T
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _fill(recording: Recording, own: dict[str, list[Any]]) -> None:
    if poses := own["pose_t"]:
        yaw = yaw_of(np.array([one.orientation for one in poses]))
        place = np.array([one.pos[:2] for one in poses])
        recording.truth = Path(_stamps(poses), np.column_stack([place, yaw]), "simulation")
        recording.streams["pose"] = recording.truth.time
    if odometry := own["odometry_t"]:
        last = odometry[-1].resets
        kept = [one for one in odometry if one.resets == last and one.n == odometry[-1].n]
        pose = np.array([[one.x, one.y, one.theta] for one in kept])
        recording.odometry = Path(_stamps(kept), pose, "odometry")
        recording.streams["odometry"] = recording.odometry.time
        if kept[-1].n:
            time, angles = sorted_rows(_stamps(kept), np.array([one.angle for one in kept]))
            turned = _sides(angles, body_steps(recording.odometry.pose)[:, 2])
            recording.wheels = None if turned is None else Wheels(time, turned)
    if scans := own["planar_lidar_t"]:
        rays = scans[-1].nranges
        kept = [one for one in scans if one.nranges == rays]
        time, ranges = sorted_rows(_stamps(kept), np.array([one.ranges for one in kept]))
        recording.scans = Scans(time, ranges, scans[-1].rad0, scans[-1].radstep, np.inf)
        recording.streams["scans"] = time
    if sent := own["velocity_command_t"]:
        value = np.array([[one.vx, one.vy, one.omega] for one in sent])
        recording.commands = Commands(*sorted_rows(_stamps(sent), value))
        recording.streams["commands"] = recording.commands.time
    if imus := own["imu_t"]:
        recording.imu = Imu(
            *sorted_rows(
                _stamps(imus),
                np.array([one.angular_velocity for one in imus]),
                np.array([one.linear_acceleration for one in imus]),
            )
        )
        recording.streams["imu"] = recording.imu.time


def _sides(angles: Array, turns: Array) -> Array | None:
    """Mean angles of the left and of the right wheels (N, 2). Which is which shows in the turns
    (N - 1,) of the robot's own odometry; None for a drive that is not a differential one.
    """
    steps = np.diff(angles, axis=0)
    if steps.shape[1] < 2 or len(turns) != len(steps):
        return None
    slope = (steps - steps.mean(axis=1, keepdims=True)).T @ turns
    right = slope > 0
    if not right.any() or right.all():
        return None
    for side in (right, ~right):  # wheels of one side turn alike, those of omni bases do not
        if np.ptp(angles[:, side], axis=1).max() > 0.01 * np.abs(angles).max():
            return None
    return np.stack([angles[:, ~right].mean(axis=1), angles[:, right].mean(axis=1)], axis=1)


def _use_info(recording: Recording, info: Any, name: str) -> None:
    """The measures of the drive, and where the range finder is."""
    robot = next((one for one in info.robots if one.name == name), None)
    if robot is not None and recording.wheels is not None:
        recording.geometry = Geometry("differential", robot.wheel_radius, robot.track)
    scans = recording.scans
    if scans is None:
        return
    for one in info.devices:
        if (one.robot, one.kind, one.width) == (name, "lrf", scans.ranges.shape[1]):
            heading = float(yaw_of(np.array([one.orientation]))[0])
            scans.mount = np.array([*one.position[:2], heading])
            break
