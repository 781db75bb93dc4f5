"""Reader of ROS 1 and ROS 2 bags (.bag, sqlite3, MCAP), by the package rosbags."""

from __future__ import annotations

from pathlib import Path as File
from typing import Any

import numpy as np

from .errors import FitError
from .lcm_log import yaw_of
from .recording import Array, Commands, Imu, Path, Recording, Scans, Wheels, composed, sorted_rows

_TYPES = (
    "sensor_msgs/msg/LaserScan",
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/Twist",
    "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/PoseStamped",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/JointState",
    "tf2_msgs/msg/TFMessage",
)
_TRUTHS = ("/ground_truth", "/pose", "/ground_truth/odom", "/base_pose_ground_truth")


def read_bag(file: File) -> Recording:
    """Raises FitError. The corrected path is /tf map->odom applied to odom->base, or a
    PoseStamped or Odometry on one of _TRUTHS.
    """
    messages = _messages(file)
    recording = Recording(file, "ROS bag")
    for topic, kind, all_of_it in messages:
        time, values = [one[0] for one in all_of_it], [one[1] for one in all_of_it]
        recording.streams[topic] = np.array(time)
        if kind.endswith(("Odometry", "PoseStamped")):
            poses = [one.pose.pose if kind.endswith("Odometry") else one.pose for one in values]
            path = Path(np.array(time), _planar(poses), topic)
            if topic in _TRUTHS or kind.endswith("PoseStamped"):
                recording.truth = recording.truth or path
            else:
                recording.odometry = recording.odometry or path
        elif kind.endswith("LaserScan") and recording.scans is None:
            recording.scans = _scans(recording, time, values)
        elif "Twist" in kind and recording.commands is None:
            twists = [one.twist if kind.endswith("Stamped") else one for one in values]
            value = [[one.linear.x, one.linear.y, one.angular.z] for one in twists]
            recording.commands = Commands(*sorted_rows(np.array(time), np.array(value)))
        elif kind.endswith("Imu") and recording.imu is None:
            recording.imu = Imu(
                *sorted_rows(
                    np.array(time),
                    np.array([_xyz(one.angular_velocity) for one in values]),
                    np.array([_xyz(one.linear_acceleration) for one in values]),
                )
            )
        elif kind.endswith("JointState") and recording.wheels is None:
            recording.wheels = _wheels(recording, time, values)
    _use_tf(recording, messages)
    return recording


def _messages(file: File) -> list[tuple[str, str, list[tuple[float, Any]]]]:
    """(topic, type, [(time in s, message)]) of the types that a fit reads."""
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise FitError(f"{file}: bags need the package rosbags: pip install 'ruedo[fit]'") from None
    folder = (
        file.parent
        if file.suffix in (".db3", ".mcap") and (file.parent / "metadata.yaml").exists()
        else file
    )
    found: dict[tuple[str, str], list[tuple[float, Any]]] = {}
    try:
        with AnyReader([folder], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
            wanted = [one for one in reader.connections if one.msgtype in _TYPES]
            for connection, stamp, raw in reader.messages(connections=wanted):
                message = reader.deserialize(raw, connection.msgtype)
                head = getattr(message, "header", None)
                own = head.stamp.sec + 1e-9 * head.stamp.nanosec if head else 0.0
                row = (own if own > 0 else stamp * 1e-9, message)
                found.setdefault((connection.topic, connection.msgtype), []).append(row)
    except (AnyReaderError, OSError, ValueError, KeyError) as error:
        raise FitError(f"{file}: it is not a bag that can be read: {error}") from None
    if not found:
        raise FitError(f"{file}: no topic of the types that a fit reads: {', '.join(_TYPES)}")
    return [(topic, kind, rows) for (topic, kind), rows in sorted(found.items())]


def _xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


def _planar(poses: list[Any]) -> Array:
    """x, y, heading of geometry_msgs/Pose."""
    turns = np.array([[p.orientation.w, *_xyz(p.orientation)] for p in poses])
    return np.column_stack([[[p.position.x, p.position.y] for p in poses], yaw_of(turns)])


def _scans(recording: Recording, time: list[float], values: list[Any]) -> Scans:
    first = values[0]
    kept = [i for i, one in enumerate(values) if len(one.ranges) == len(first.ranges)]
    if len(kept) < len(values):
        recording.findings.append(
            f"{len(values) - len(kept)} scans have another number of rays; they are ignored"
        )
    ranges = np.array([values[i].ranges for i in kept], float)
    when, ranges = sorted_rows(np.array([time[i] for i in kept]), ranges)
    return Scans(
        when, ranges, float(first.angle_min), float(first.angle_increment), float(first.range_max)
    )


def _wheels(recording: Recording, time: list[float], values: list[Any]) -> Wheels | None:
    """The joints whose names say left and right; others are not wheels."""
    names = list(values[0].name)
    sides = [
        [i for i, name in enumerate(names) if side in name.lower()] for side in ("left", "right")
    ]
    sides = [[i for i in side if "wheel" in names[i].lower()] or side for side in sides]
    kept = [
        i
        for i, one in enumerate(values)
        if list(one.name) == names and len(one.position) == len(names)
    ]
    if not all(sides) or not kept:
        return None
    angles = np.array([values[i].position for i in kept])
    turned = np.stack([angles[:, side].mean(axis=1) for side in sides], axis=1)
    recording.findings.append(
        "wheels by their joints' names: left "
        + ", ".join(names[i] for i in sides[0])
        + "; right "
        + ", ".join(names[i] for i in sides[1])
    )
    when, turned = sorted_rows(np.array([time[i] for i in kept]), turned)
    return Wheels(when, turned)


def _use_tf(recording: Recording, messages: list[tuple[str, str, list[tuple[float, Any]]]]) -> None:
    """map->odom beside odom->base is the path after SLAM; base->scan is where the range finder is.
    Frames are those of the Odometry and LaserScan messages, else those of REP 105, with any prefix.
    """
    frames: dict[tuple[str, str], list[tuple[float, Any]]] = {}
    for _, kind, rows in messages:
        if kind.endswith("TFMessage"):
            for _, message in rows:
                for one in message.transforms:
                    key = (_frame(one.header.frame_id), _frame(one.child_frame_id))
                    stamp = one.header.stamp
                    frames.setdefault(key, []).append(
                        (stamp.sec + 1e-9 * stamp.nanosec, one.transform)
                    )
    odom, base = _drive_frames(messages, list(frames))
    moves = _path_of(frames.get((odom, base), []))
    recording.odometry = recording.odometry or moves
    correction = next((_path_of(frames[k]) for k in frames if k[1] == odom), None)
    if recording.truth is None and correction is not None and recording.odometry is not None:
        odometry = moves or recording.odometry
        pose = composed(correction.at(odometry.time), odometry.pose)
        recording.truth = Path(odometry.time, pose, "/tf map->odom")
    if recording.scans is not None:
        scan = next(rows[0][1] for _, kind, rows in messages if kind.endswith("LaserScan"))
        _use_mount(recording, frames, base, _frame(scan.header.frame_id))


def _frame(name: str) -> str:
    return name.strip("/")


def _drive_frames(
    messages: list[tuple[str, str, list[tuple[float, Any]]]], pairs: list[tuple[str, str]]
) -> tuple[str, str]:
    """The frame of the odometry and that of the robot."""
    for topic, kind, rows in messages:
        if kind.endswith("Odometry") and topic not in _TRUTHS:
            found = _frame(rows[0][1].header.frame_id), _frame(rows[0][1].child_frame_id)
            if found in pairs or any(child == found[0] for _, child in pairs):
                return found
    for base in ("base_footprint", "base_link"):
        for parent, child in pairs:
            if parent.split("/")[-1] == "odom" and child.split("/")[-1] == base:
                return parent, child
    return "odom", "base_link"


def _path_of(rows: list[tuple[float, Any]]) -> Path | None:
    if not rows:
        return None
    turns = np.array([[t.rotation.w, *_xyz(t.rotation)] for _, t in rows])
    place = [[t.translation.x, t.translation.y] for _, t in rows]
    return Path(np.array([s for s, _ in rows]), np.column_stack([place, yaw_of(turns)]), "/tf")


def _use_mount(
    recording: Recording,
    frames: dict[tuple[str, str], list[tuple[float, Any]]],
    base: str,
    scan: str,
) -> None:
    """The first transforms from the robot to the scans' frame. Turned over, it counts the rays the
    other way around.
    """
    scans = recording.scans
    assert scans is not None
    parents = {child: parent for parent, child in frames}
    chain: list[Any] = []
    while scan in parents and scan != base and len(chain) < len(frames):
        chain.append(frames[parents[scan], scan][0][1])
        scan = parents[scan]
    if scan != base:
        return
    mount, over = np.zeros((1, 3)), False
    for one in reversed(chain):
        q = one.rotation
        place = [one.translation.x, one.translation.y]
        step = np.array([[*place, float(yaw_of(np.array([[q.w, *_xyz(q)]]))[0])]])
        mount = composed(mount, step * ([1, -1, -1] if over else [1, 1, 1]))
        over ^= 1 - 2 * (q.x * q.x + q.y * q.y) < 0
    scans.mount = mount[0]
    if over:
        scans.ranges = scans.ranges[:, ::-1]
        scans.angle_min = -float(scans.angles[-1])
