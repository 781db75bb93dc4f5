"""Topics in both directions, time, and nodes that come and go."""

from __future__ import annotations

import importlib
import itertools
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import LATCHED, seconds
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.clock import JumpThreshold
from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, JointState, LaserScan, Range
from server import ARENA, PATIENCE, Run
from simulation_interfaces.srv import ResetSimulation
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

HERE = Path(__file__).resolve().parent
COMMAND = {"jazzy": Twist, "kilted": TwistStamped}[os.environ["ROS_DISTRO"]]

# Kilted's rmw_fastrtps takes endpoints that Cyclone DDS announces for those of no node.
RUEDO_NODE = {"jazzy": "ruedo", "kilted": "_CREATED_BY_BARE_DDS_APP_"}[os.environ["ROS_DISTRO"]]


def kind_of(name: str) -> type:
    """The class of a type, as in "sensor_msgs/msg/LaserScan"."""
    package, group, kind = name.split("/")
    found = importlib.import_module(f"{package}.{group}")
    if kind.endswith("_FeedbackMessage"):
        return getattr(found, kind.removesuffix("_FeedbackMessage")).Impl.FeedbackMessage
    return getattr(found, kind)


def test_scans_are_of_the_wall_ahead(peer):
    scans = peer.hear(LaserScan, "/scan")
    peer.spin_until(lambda: len(scans) >= 10, "scans")
    stamps = [seconds(scan.header.stamp) for scan in scans]
    assert [b - a for a, b in itertools.pairwise(stamps)] == pytest.approx([0.1] * (len(scans) - 1))
    for scan in scans:
        assert scan.header.frame_id == "lrf"
        assert len(scan.ranges) == 181
        assert scan.angle_min == pytest.approx(-math.pi / 2, abs=1e-6)
        assert scan.angle_increment == pytest.approx(math.pi / 180, abs=1e-7)
        assert (scan.range_min, scan.range_max) == (pytest.approx(0.02), pytest.approx(8.0))
        assert all(0.02 < r < 8.0 for r in scan.ranges)


def publishers_names(peer, topic):
    """Of the nodes, once they are known."""
    names = {info.node_name for info in peer.node.get_publishers_info_by_topic(topic)}
    return names if names == {RUEDO_NODE} else None


SILENT = {  # until something happens
    "/simulate_steps/_action/status",
    "/collisions",
    "/collisions/markers",
    "/initialpose",
    "/markers",
    "/parameter_events",
    "/rosout",
    "/simulate_steps/_action/feedback",
}


@pytest.mark.parametrize(
    "world, some",
    [
        (ARENA, {"/scan", "/odom", "/tf", "/image_raw", "/joint_states"}),
        (HERE.parent / "sensors.sdf", {"/points", "/imu", "/contacts", "/depth", "/tf"}),
        (HERE.parent / "instruments.sdf", {"/fix", "/flat/detections", "/altimeter", "/wrench"}),
    ],
)
def test_each_topic_has_a_type_of_ros_and_its_hash(peers, world, some):
    """A message that comes was decoded by rosidl's own code; hashes tell of every field."""
    with Run("--no-noise", world=world) as run:
        peer = peers(run)
        peer.spin_until(lambda: all(publishers_names(peer, topic) for topic in some), some)
        peer.spin_until(lambda: "ruedo" in peer.node.get_node_names(), "the node")
        heard, hashes = {}, {}
        for topic, types in peer.topics().items():
            assert len(types) == 1, (topic, types)
            ours = [
                info
                for info in peer.node.get_publishers_info_by_topic(topic)
                + peer.node.get_subscriptions_info_by_topic(topic)
                if info.node_name != "peer"
            ]
            if not ours:
                continue
            assert {info.node_name for info in ours} == {RUEDO_NODE}, topic
            latched = any(info.qos_profile.durability == LATCHED.durability for info in ours)
            heard[topic] = peer.hear(kind_of(types[0]), topic, LATCHED if latched else 10)
            hashes[topic] = {str(info.topic_type_hash) for info in ours}
        assert len(heard) > 12
        for topic in heard:
            [mine] = [
                str(info.topic_type_hash)
                for info in peer.node.get_subscriptions_info_by_topic(topic)
                if info.node_name == "peer"
            ]
            assert hashes[topic] == {mine}, topic
        speaking = {topic for topic in heard if peer.node.count_publishers(topic)} - SILENT
        missing = set(speaking)

        def all_heard():
            missing.difference_update([topic for topic in missing if heard[topic]])
            return not missing

        peer.spin_until(all_heard, missing)


def test_readers_of_each_quality_are_served(peer):
    qualities = (
        qos_profile_sensor_data,
        10,
        QoSProfile(depth=1),
        QoSProfile(depth=1, durability=DurabilityPolicy.VOLATILE),
    )
    heard = [peer.hear(LaserScan, "/scan", qos) for qos in qualities]
    peer.spin_until(lambda: all(len(messages) >= 10 for messages in heard), "scans of each")


def test_late_subscribers_get_latched_messages(run, peers):
    early = peers(run, "early")
    clocks = early.hear(Clock, "/clock")
    early.spin_until(lambda: clocks and seconds(clocks[-1].clock) > 1.0, "a second")
    for name in ("late", "later"):
        check_what_stays(peers(run, name))


def check_what_stays(peer):
    descriptions = peer.hear(String, "/robot_description", LATCHED)
    frames = peer.hear(TFMessage, "/tf_static", LATCHED)
    peer.spin_until(lambda: descriptions and frames, "what stays")
    assert descriptions[-1].data.lstrip().startswith("<")
    of = {frame.child_frame_id: frame for frame in frames[-1].transforms}
    lrf = of["lrf"].transform.translation
    assert of["lrf"].header.frame_id == "base_link"
    assert (lrf.x, lrf.y, lrf.z) == pytest.approx((0.16, 0.0, 0.3905))
    assert {f"sonar_front_{i}" for i in range(8)} <= set(of)


def test_frames_agree_with_odometry(peer):
    odometry, frames = peer.hear(Odometry, "/odom", 100), peer.hear(TFMessage, "/tf", 100)
    drive(peer, lambda: odometry and odometry[-1].pose.pose.position.x > 0.2)
    poses = {seconds(o.header.stamp): o.pose.pose.position.x for o in odometry}
    compared = 0
    for frame in itertools.chain.from_iterable(message.transforms for message in frames):
        if (frame.header.frame_id, frame.child_frame_id) == ("odom", "base_link"):
            x = poses.get(seconds(frame.header.stamp))
            compared += x is not None
            assert x is None or frame.transform.translation.x == pytest.approx(x, abs=1e-12)
    assert compared >= 10
    assert {(o.header.frame_id, o.child_frame_id) for o in odometry} == {("odom", "base_link")}


def drive(peer, arrived):
    publisher = peer.node.create_publisher(COMMAND, "/cmd_vel", 10)
    message = COMMAND()
    (message.twist if COMMAND is TwistStamped else message).linear.x = 0.4

    def has_arrived():
        publisher.publish(message)
        return arrived()

    peer.spin_until(has_arrived, "the robot")


def test_the_robot_drives_by_the_type_of_the_release(peer):
    poses = peer.hear(Odometry, "/ground_truth")
    drive(
        peer,
        lambda: any(
            o.pose.pose.position.x > 0.2 and o.twist.twist.linear.x == pytest.approx(0.4)
            for o in poses
        ),
    )
    assert peer.topics()["/cmd_vel"] == [f"geometry_msgs/msg/{COMMAND.__name__}"]


def test_pictures_wheels_and_sonars(peers):
    with Run("--no-noise") as run:
        peer = peers(run)
        images = peer.hear(Image, "/image_raw", QoSProfile(depth=2))
        wheels = peer.hear(JointState, "/joint_states")
        ranges = peer.hear(Range, "/sonar_front/range_3", qos_profile_sensor_data)
        peer.spin_until(lambda: images and wheels and ranges, "pictures, wheels, echoes")
        image = images[0]
        assert (image.width, image.height, image.encoding, image.step) == (640, 480, "rgb8", 1920)
        assert (image.header.frame_id, len(image.data)) == ("camera_optical", 640 * 480 * 3)
        assert sorted(wheels[0].name) == sorted(
            f"{end}_{side}_wheel_joint" for end in ("front", "rear") for side in ("left", "right")
        )
        assert ranges[0].header.frame_id == "sonar_front_3"
        assert ranges[0].field_of_view == pytest.approx(math.radians(30))


def test_a_node_keeps_the_time_of_the_run(run, peers):
    peer = peers(run, use_sim_time=True)
    odometry = peer.hear(Odometry, "/odom")
    apart = []

    def many():
        now = peer.node.get_clock().now().nanoseconds * 1e-9
        if odometry and now > 0:
            apart.append(abs(now - seconds(odometry.pop().header.stamp)))
        return len(apart) >= 100

    peer.spin_until(many, "the time")
    assert max(apart[50:]) <= 0.1  # /clock comes each 10 ms; a busy machine


def test_time_goes_back_when_it_is_reset(run, peers):
    peer = peers(run, use_sim_time=True)
    clock, jumps = peer.node.get_clock(), []
    any_jump = JumpThreshold(
        min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=False
    )
    handle = clock.create_jump_callback(any_jump, post_callback=jumps.append)
    peer.spin_until(lambda: clock.now().nanoseconds > 2_000_000_000, "two seconds")
    scans = peer.hear(LaserScan, "/scan")
    peer.spin_until(lambda: scans, "a scan")
    reset = peer.call(ResetSimulation, "/reset_simulation", scope=ResetSimulation.Request.SCOPE_ALL)
    assert reset.result.result == reset.result.RESULT_OK
    peer.spin_until(lambda: jumps, "a jump")
    assert jumps[0].delta.nanoseconds < 0
    assert clock.now().nanoseconds < 2_000_000_000
    before = len(scans)
    peer.spin_until(lambda: len(scans) >= before + 3, "scans of the new epoch")
    assert seconds(scans[-1].header.stamp) < 2.0
    clock.now()
    handle.unregister()


def test_ten_nodes_hear_each_scan(run, peers):
    nodes = [peers(run, f"node{i}") for i in range(10)]
    heard = [peer.hear(LaserScan, "/scan") for peer in nodes]
    for peer, scans in zip(nodes, heard, strict=True):
        peer.spin_until(lambda scans=scans: len(scans) >= 5, "scans")


def test_a_run_that_is_killed_goes_and_the_next_one_is_heard(run, peers):
    peer = peers(run)
    scans = peer.hear(LaserScan, "/scan")
    peer.spin_until(lambda: scans, "a scan")
    run.process.kill()
    peer.spin_until(lambda: peer.node.count_publishers("/scan") == 0, "the end")
    scans.clear()
    with Run("--no-noise", "--disable", "p3at/camera", domain=run.domain):
        peer.spin_until(lambda: scans, "a scan of the next run")


DRIVER = """
import sys, time
import rclpy
from geometry_msgs.msg import Twist, TwistStamped
rclpy.init(domain_id=int(sys.argv[1]))
node = rclpy.create_node("driver")
kind = {"jazzy": Twist, "kilted": TwistStamped}[sys.argv[2]]
publisher, message = node.create_publisher(kind, "/cmd_vel", 10), kind()
getattr(message, "twist", message).linear.x = 0.2
while True:
    publisher.publish(message)
    time.sleep(0.05)
"""


def test_a_robot_stops_when_its_driver_is_killed(run, peer):
    truth = peer.hear(Odometry, "/ground_truth")

    def speed():
        return truth[-1].twist.twist.linear.x if truth else math.nan

    words = [sys.executable, "-c", DRIVER, str(run.domain), os.environ["ROS_DISTRO"]]
    with subprocess.Popen(words) as driver:
        peer.spin_until(lambda: speed() > 0.19, "a robot that drives")
        driver.send_signal(signal.SIGKILL)
    peer.spin_until(lambda: speed() == pytest.approx(0.0, abs=1e-9), "a robot that stands")
    drive(peer, lambda: speed() > 0.39)
    assert run.process.poll() is None


LISTENER = """
import sys
import rclpy
from rosgraph_msgs.msg import Clock
rclpy.init(domain_id=int(sys.argv[1]))
node, heard = rclpy.create_node("listener"), []
node.create_subscription(Clock, "/clock", heard.append, 10)
while not heard:
    rclpy.spin_once(node, timeout_sec=0.1)
"""


def test_processes_that_begin_at_once_all_hear(run):
    """Regression: Cyclone DDS crashed on the types of which several of Kilted's told it."""
    words = [sys.executable, "-c", LISTENER, str(run.domain)]
    for listener in [subprocess.Popen(words) for _ in range(6)]:
        assert listener.wait(PATIENCE) == 0
    assert run.process.poll() is None


def children(messages):
    return {each.child_frame_id for message in messages for each in message.transforms}


def test_two_robots_have_a_namespace_each(peers):
    with Run("--no-noise", "--disable", "p3at/camera", "--spawn", "turtle@3,0") as run:
        peer = peers(run)
        own = {"/p3at/scan", "/turtle/scan", "/p3at/cmd_vel", "/turtle/cmd_vel"}
        peer.spin_until(lambda: own <= set(peer.topics()), "topics of both")
        assert not {"/scan", "/cmd_vel"} & set(peer.topics())
        scans = {robot: peer.hear(LaserScan, f"/{robot}/scan") for robot in ("p3at", "turtle")}
        trees = {robot: peer.hear(TFMessage, f"/{robot}/tf", 100) for robot in scans}
        all_trees = peer.hear(TFMessage, "/tf", 100)
        heard = [*scans.values(), *trees.values(), all_trees]
        peer.spin_until(lambda: all(heard), "scans and frames of both")
        for robot, messages in scans.items():
            assert messages[0].header.frame_id.startswith(f"{robot}/")
            assert "base_link" in children(trees[robot])
            assert not any("/" in child for child in children(trees[robot]))
        assert all("/" in child for child in children(all_trees))


def test_diagnostics_report_the_runs_rate(peer):
    messages = peer.hear(DiagnosticArray, "/diagnostics")
    peer.spin_until(lambda: len(messages) >= 2, "diagnostics")
    apart = seconds(messages[1].header.stamp) - seconds(messages[0].header.stamp)
    status = {s.name: {v.key: v.value for v in s.values} for s in messages[1].status}
    assert list(status) == ["ruedo: simulation", "ruedo: ROS 2", "ruedo: bus"]
    simulation = status["ruedo: simulation"]
    factor = float(simulation["real-time factor"])
    # At least a second of real time lies between two messages.
    assert 0 < factor <= apart * 1.01
    assert float(simulation["real time per step (ms)"]) == pytest.approx(5 / factor, rel=0.01)
    assert int(status["ruedo: ROS 2"]["messages sent"]) > 0
