"""robot_description and the links in /tf: rviz's RobotModel draws the one by the other, and
robot_state_publisher would say the same from joint_states.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from conftest import Peer, take
from ros_types import (
    Float64MultiArray,
    JointState,
    MultiArrayLayout,
    Odometry,
    String,
    TFMessage,
    Twist,
    Vector3,
)
from server import Run, wait_for
from urdf import about, child_frames, of_transform, pose

WORLD = str(Path(__file__).resolve().parent / "links.sdf")


class Tree:
    """What a peer hears of a run's frames, joints and description."""

    def __init__(self, peer: Peer, robot: str = ""):
        self.moving = peer.reader("/tf", TFMessage)
        self.joints = peer.reader(f"{robot}/joint_states", JointState)
        self.fixed = {
            (t.header.frame_id, t.child_frame_id): of_transform(t.transform)
            for t in take(peer.reader("/tf_static", TFMessage, latched=True))[-1].transforms
        }
        self.description = take(
            peer.reader(f"{robot}/robot_description", String, latched=True, depth=1)
        )[-1].data
        self.frames: dict[int, dict] = {}  # by time
        self.positions: dict[int, dict[str, float]] = {}
        self.speeds: list[tuple[float, float]] = []  # m/s ahead, rad/s to the left

    def listen(self):
        for message in self.moving.take(N=1000):
            for t in message.transforms:
                at = self.frames.setdefault(t.header.stamp.us, dict(self.fixed))
                at[t.header.frame_id, t.child_frame_id] = of_transform(t.transform)
        for joints in self.joints.take(N=1000):
            at = self.positions.setdefault(joints.header.stamp.us, {})
            at.update(zip(joints.name, joints.position))


def near(found: np.ndarray, wanted: np.ndarray, what: object):
    np.testing.assert_allclose(found, wanted, atol=1e-6, err_msg=str(what))


@pytest.fixture(scope="module")
def driven():
    """Frames of a robot that drives and moves its arm."""
    with Run("--no-noise", "--rate", "2", world=WORLD) as run:
        peer = Peer(run.domain)
        tree, odometry = Tree(peer), peer.reader("/odom", Odometry)
        cmd_vel = peer.writer("/cmd_vel", Twist)
        arm = peer.writer("/forward_position_controller/commands", Float64MultiArray)

        def arrived():
            cmd_vel.write(Twist(Vector3(x=0.2), Vector3(z=0.3)))
            arm.write(Float64MultiArray(MultiArrayLayout([], 0), [0.7, 0.15]))
            tree.listen()
            heard = odometry.take(N=100)
            tree.speeds += [(o.twist.twist.linear.x, o.twist.twist.angular.z) for o in heard]
            moved = any(o.pose.pose.position.x > 0.3 for o in heard)
            return moved and any(p.get("out", 0) > 0.12 for p in tree.positions.values())

        wait_for(arrived, "an arm that is out on a robot that drives")
        yield tree


def test_odometry_has_the_commanded_velocities(driven):
    assert driven.speeds[-1] == pytest.approx((0.2, 0.3), abs=0.02)


def complete(tree: Tree, joints: int) -> list[int]:
    """The times of which all joints and all frames came."""
    most = max(len(frames) for frames in tree.frames.values())
    return [
        time
        for time, positions in tree.positions.items()
        if len(positions) == joints and len(tree.frames.get(time, {})) == most
    ]


def test_frames_are_those_of_the_description_and_the_joints(driven):
    times = complete(driven, 4)
    assert len(times) > 10
    for time in times:
        wanted = child_frames(driven.description, driven.positions[time])
        for pair, at in wanted.items():
            near(driven.frames[time][pair], at, (time, pair))
    last = driven.positions[max(times)]
    # By hand: both wheels have rolled ahead, and the left one's axis points to the right.
    assert last["left_joint"] < -1 and last["right_joint"] > 1


def test_frames_are_where_the_file_has_them(driven):
    """By hand from links.sdf: base_link is on the ground between the wheels, the model's origin."""
    time = max(complete(driven, 4))
    frames, positions = driven.frames[time], driven.positions[time]
    near(frames["base_link", "base_link_link"], pose(np.eye(3), [0.05, 0, 0.2]), "base_link_link")
    # The joint lies at (-0.05, 0.02, 0) of the turret, turned by 0.2 about its x.
    turret = pose(about([0, 0, 1], 0.4), [0.1, 0.05, 0.5]) @ pose(
        about([1, 0, 0], 0.2), [-0.05, 0.02, 0]
    )
    turned = turret @ pose(about([0, 0.6, 0.8], positions["turn"]), [0, 0, 0])
    near(
        frames["base_link", "base_link_link"] @ frames["base_link_link", "turret"], turned, "turret"
    )
    slide = pose(about([0, 1, 0], 0.5), [0.3, 0.05, 0.6])
    at_zero = np.linalg.inv(turret) @ slide
    slid = at_zero @ pose(np.eye(3), [positions["out"], 0, 0])
    near(frames["turret", "slide_r"], slid, "slide")
    # A sensor on the arm moves with it; a link that is fixed there is in /tf_static.
    near(driven.fixed["slide_r", "eye"], pose(about([0, 0, 1], 0.1), [0.02, 0.01, 0.1]), "eye")
    near(
        driven.fixed["slide_r", "tip"],
        np.linalg.inv(slide) @ pose(np.eye(3), [0.4, 0.05, 0.6]),
        "tip",
    )


def test_each_frame_has_one_parent(driven):
    frames = driven.frames[max(complete(driven, 4))]
    children = [child for _, child in frames]
    assert len(children) == len(set(children))
    assert {parent for parent, _ in frames} - set(children) == {"odom"}


def test_every_robot_has_its_own():
    with Run("--spawn", "turtle:bob@0,1.5") as run:
        peer = Peer(run.domain)
        bob, p3at = Tree(peer, "/bob"), Tree(peer, "/p3at")
        assert ET.fromstring(bob.description).get("name") == "turtle"
        assert ET.fromstring(p3at.description).get("name") == "p3at"

        def wheels_turn():
            bob.listen()
            pairs = set().union(*bob.frames.values()) if bob.frames else set()
            return {
                ("bob/base_link", "bob/left_wheel"),
                ("p3at/base_link", "p3at/front_left_wheel"),
            } <= pairs

        wait_for(wheels_turn, "the wheels of both")


def test_meshes_are_files_that_are_there():
    with Run() as run:
        description = Tree(Peer(run.domain)).description
    meshes = [mesh.get("filename") for mesh in ET.fromstring(description).iter("mesh")]
    assert meshes
    for mesh in meshes:
        assert Path(mesh.removeprefix("file://")).is_file()


def test_joint_states_have_the_joints_that_only_go_along():
    """A user's own URDF has them, too: robot_state_publisher waits for each that is not fixed."""
    world = str(Path(__file__).resolve().parent / "casters.sdf")
    with Run("--no-noise", world=world) as run:
        peer = Peer(run.domain)
        joints, drive = peer.reader("/joint_states", JointState), peer.writer("/cmd_vel", Twist)

        def turned():
            drive.write(Twist(Vector3(x=0.2), Vector3()))
            return [m for m in joints.take(N=100) if hasattr(m, "__idl__") and m.velocity[0] > 1.9]

        message = wait_for(turned, "wheels that turn")[-1]
    assert message.name == ["left_joint", "right_joint", "fork_joint", "caster_joint"]
    assert message.velocity == [pytest.approx(2.0, abs=0.1)] * 2 + [0.0, 0.0]
    assert message.position[0] == pytest.approx(message.position[1]) and message.position[0] > 0
    assert message.position[2:] == [0.0, 0.0]
