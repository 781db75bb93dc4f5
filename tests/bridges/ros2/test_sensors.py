"""The sensors that the arena's robot has not, in a bag against what geometry says; and joints that
are moved over DDS.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import pytest
from conftest import Peer, bag_of
from ros_types import (
    Contacts,
    Duration,
    Float64MultiArray,
    Header,
    JointState,
    JointTrajectory,
    JointTrajectoryPoint,
    MarkerArray,
    MultiArrayDimension,
    MultiArrayLayout,
    Time,
    Twist,
    Vector3,
)
from server import Run, wait_for
from test_services import await_discovery

WORLD = str(Path(__file__).resolve().parent / "sensors.sdf")


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """{topic: messages}"""
    return bag_of(WORLD, tmp_path_factory.mktemp("sensors"))


def test_points_lie_on_the_wall_and_the_ground(bag):
    cloud = bag["/points"][-1]
    assert (cloud.header.frame_id, cloud.width, cloud.height, cloud.point_step, cloud.row_step) == (
        "lidar",
        3,
        4,
        16,
        48,
    )
    assert [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields] == [
        ("x", 0, 7, 1),
        ("y", 4, 7, 1),
        ("z", 8, 7, 1),
        ("intensity", 12, 7, 1),
    ]
    points = list(struct.iter_unpack("<4f", bytes(cloud.data)))
    assert len(points) == 12
    for i, (x, y, z, _) in enumerate(points):
        elevation, azimuth = -0.3 + 0.2 * (i // 3), -0.1 + 0.1 * (i % 3)
        assert math.atan2(y, x) == pytest.approx(azimuth, abs=1e-5)
        assert math.atan2(z, math.hypot(x, y)) == pytest.approx(elevation, abs=1e-5)
        if elevation < -0.2:  # the ray meets the ground, half a metre below, before the wall
            assert z == pytest.approx(-0.5, abs=2e-3)
        else:
            assert x == pytest.approx(2.0, abs=2e-3)


def test_imu_at_rest_shows_gravity(bag):
    imu = bag["/imu"][-1]
    assert imu.linear_acceleration.z == pytest.approx(9.8, abs=0.05)
    assert abs(imu.angular_velocity.z) < 1e-3
    assert imu.orientation.w == pytest.approx(1.0, abs=1e-4)
    assert imu.orientation_covariance[0] == 0.0


def test_depth_is_that_of_the_wall(bag):
    depth = bag["/depth"][-1]
    assert (depth.encoding, depth.width, depth.height, depth.step, depth.header.frame_id) == (
        "32FC1",
        32,
        24,
        128,
        "eye_optical",
    )
    values = struct.unpack(f"<{32 * 24}f", bytes(depth.data))
    assert values[12 * 32 + 16] == pytest.approx(1.7, abs=0.01)
    assert len(bag["/image_raw"]) == len(bag["/camera_info"]) == len(bag["/depth"])


def test_contacts_carry_the_weight(bag):
    contacts = bag["/contacts"][-1].contacts
    assert sum(c.wrenches[0].body_1_wrench.force.z for c in contacts) == pytest.approx(
        10.5 * 9.8, rel=0.1
    )
    assert all(
        c.wrenches[0].body_2_wrench.force.z == -c.wrenches[0].body_1_wrench.force.z
        for c in contacts
    )
    assert all(
        c.collision1.name == "rig/bumper" and c.normals[0].z == pytest.approx(1.0) for c in contacts
    )
    assert bag["/bumper"][-1].data is True


def test_collisions_of_a_robot_are_published():
    """The arena's parcel, a box of 0.45 m, stands 2 m ahead of the robot."""
    with Run("--no-noise", "--rate", "4") as run:
        peer = Peer(run.domain)
        drive, told = peer.writer("/cmd_vel", Twist), peer.reader("/collisions", Contacts)
        shown = peer.reader("/collisions/markers", MarkerArray)

        def touched():
            drive.write(Twist(Vector3(x=0.5), Vector3()))
            return [m for m in told.take(N=100) if hasattr(m, "__idl__") and m.contacts]

        first = wait_for(touched, "a collision")[0]
        arrows = wait_for(
            lambda: [a for m in shown.take(N=100) if hasattr(m, "__idl__") for a in m.markers],
            "an arrow",
        )
    assert first.header.frame_id == "world" and first.header.stamp.us > 0
    for contact in first.contacts:
        assert contact.collision1.name == "p3at"
        assert contact.collision2.name.startswith("parcel")
        assert 2.0 - 0.23 * math.sqrt(2.0) < contact.positions[0].x < 2.0
        # Towards the robot, which comes from -x, and by no more than the box's turn of 0.2 rad
        # beside it.
        assert contact.normals[0].x < -math.cos(0.21)
        wrench = contact.wrenches[0]
        assert wrench.body_1_wrench.force.x == -wrench.body_2_wrench.force.x
        assert wrench.body_2_name.data == contact.collision2.name
    for arrow in arrows:
        assert (arrow.header.frame_id, arrow.ns, arrow.type) == ("world", "p3at", 0)
        assert arrow.text.startswith("parcel")
        touch, tip = arrow.points
        assert math.dist((touch.x, touch.y, touch.z), (tip.x, tip.y, tip.z)) == pytest.approx(0.3)
        assert tip.x < touch.x < 2.0


def test_frames_of_devices_hang_on_the_robot(bag):
    frames = {t.child_frame_id: t for t in bag["/tf_static"][0].transforms}
    assert frames["lidar"].header.frame_id == frames["eye"].header.frame_id == "base_link"
    assert frames["lidar"].transform.translation.z == pytest.approx(0.4)


def trajectory(name: str, *points: float) -> JointTrajectory:
    return JointTrajectory(
        Header(Time(), ""),
        [name],
        [JointTrajectoryPoint([p], [], [], [], Duration(i + 1, 0)) for i, p in enumerate(points)],
    )


def numbers(*values: float) -> Float64MultiArray:
    return Float64MultiArray(
        MultiArrayLayout([MultiArrayDimension("joints", len(values), len(values))], 0), list(values)
    )


@pytest.mark.parametrize(
    "topic, kind, message",
    [
        (
            "/joint_trajectory_controller/joint_trajectory",
            JointTrajectory,
            trajectory("elbow", 0.1, 0.5),
        ),
        ("/forward_position_controller/commands", Float64MultiArray, numbers(0.5)),
    ],
)
def test_joints_go_where_they_are_sent(topic, kind, message):
    with Run(world=WORLD) as run:
        peer = Peer(run.domain)
        joints, commands = peer.reader("/joint_states", JointState), peer.writer(topic, kind)

        def arrived():
            commands.write(message)
            return any(
                j.name == ["elbow"] and j.position[0] == pytest.approx(0.5, abs=0.02)
                for j in joints.take(N=100)
            )

        wait_for(arrived, "the elbow at 0.5 rad")


@pytest.mark.parametrize(
    "topic, kind, message",
    [
        (
            "/joint_trajectory_controller/joint_trajectory",
            JointTrajectory,
            JointTrajectory(Header(Time(), ""), ["elbow"], []),
        ),
        ("/forward_position_controller/commands", Float64MultiArray, numbers(0.5, 0.5)),
        ("/forward_velocity_controller/commands", Float64MultiArray, numbers()),
    ],
)
def test_commands_that_do_not_fit_the_joints_are_counted(topic, kind, message):
    with Run(world=WORLD) as run:
        peer = Peer(run.domain)
        commands = peer.writer(topic, kind)
        await_discovery(peer)
        commands.write(message)
        wait_for(lambda: "ignored (1 such" in (run.process.stdout.readline() or ""), "the warning")
        assert "1 messages that came were faulty" in run.end()
