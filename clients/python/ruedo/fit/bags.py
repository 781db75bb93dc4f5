"""Reader of ROS 1 and ROS 2 bags (.bag, sqlite3, MCAP), by the package rosbags."""

from __future__ import annotations

from pathlib import Path as File
from typing import Any

import numpy as np

from .errors import FitError
from .lcm_log import yaw_of
from .recording import Array, Commands, Imu, Path, Recording, Scans, Wheels, sorted_rows

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
    _use_tf(
        recording,
        [one for _, kind, all_of_it in messages if kind.endswith("TFMessage") for one in all_of_it],
    )
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


def _use_tf(recording: Recording, messages: list[tuple[float, Any]]) -> None:
    """map->odom beside odom->base is the path after SLAM."""
    frames: dict[tuple[str, str], list[tuple[float, Any]]] = {}
    for _, message in messages:
        for one in message.transforms:
            key = (one.header.frame_id.strip("/"), one.child_frame_id.strip("/"))
            frames.setdefault(key, []).append(
                (one.header.stamp.sec + 1e-9 * one.header.stamp.nanosec, one.transform)
            )

    def path(parent: str, *children: str) -> Path | None:
        rows = next((frames[parent, child] for child in children if (parent, child) in frames), [])
        if not rows:
            return None
        turns = np.array([[t.rotation.w, *_xyz(t.rotation)] for _, t in rows])
        place = [[t.translation.x, t.translation.y] for _, t in rows]
        return Path(np.array([s for s, _ in rows]), np.column_stack([place, yaw_of(turns)]), "/tf")

    odometry = path("odom", "base_footprint", "base_link")
    recording.odometry = recording.odometry or odometry
    correction = path("map", "odom")
    if recording.truth is None and correction is not None and odometry is not None:
        step = correction.at(odometry.time)
        sine, cosine = np.sin(step[:, 2]), np.cos(step[:, 2])
        x, y, theta = odometry.pose.T
        moved = [
            step[:, 0] + cosine * x - sine * y,
            step[:, 1] + sine * x + cosine * y,
            step[:, 2] + theta,
        ]
        recording.truth = Path(odometry.time, np.stack(moved, axis=1), "/tf map->odom")
