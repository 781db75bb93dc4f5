"""What a node of real ROS 2 sees of a run, as JSON.

node.py WHAT [NUMBER]
"""

import itertools
import json
import os
import signal
import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

PATIENCE = 30  # s


class Peer:
    """A node in a context of its own, as a process of its own has it."""

    def __init__(self, name="peer", parameters=()):
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node(name, context=self.context, parameter_overrides=list(parameters))
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def call(self, kind, name, **request):
        client = self.node.create_client(kind, f"/ruedo/{name}")
        assert client.wait_for_service(PATIENCE), name
        future = client.call_async(kind.Request(**request))
        self.executor.spin_until_future_complete(future, timeout_sec=PATIENCE)
        assert future.done(), f"{name}: no reply"
        return future.result()

    def spin_until(self, condition):
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline
            self.executor.spin_once(timeout_sec=0.1)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def topics():
    """Of two sensors 20 messages each, and the types of all topics."""
    peer, got = Peer(), {"/scan": [], "/odom": []}
    for topic, kind in (("/scan", LaserScan), ("/odom", Odometry)):
        peer.node.create_subscription(kind, topic, got[topic].append, 10)
    peer.spin_until(lambda: all(len(messages) >= 20 for messages in got.values()))
    stamps = [m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in got["/scan"]]
    return {
        "beams": len(got["/scan"][0].ranges),
        "periods": [b - a for a, b in itertools.pairwise(stamps)],
        "types": dict(peer.node.get_topic_names_and_types()),
    }


def names(*wanted):
    """Of all topics, once those that are wanted are there."""
    peer = Peer()
    peer.spin_until(lambda: set(wanted) <= set(topics_of(peer)))
    return topics_of(peer)


def topics_of(peer):
    return [name for name, _ in peer.node.get_topic_names_and_types()]


def qos():
    """Messages for a reader of each kind, and the description for one that comes late."""
    peer, got = Peer(), {"best_effort": 0, "reliable": 0, "depth": 0, "late": 0}

    def count(name):
        def heard(_):
            got[name] += 1

        return heard

    node = peer.node
    node.create_subscription(LaserScan, "/scan", count("best_effort"), qos_profile_sensor_data)
    node.create_subscription(LaserScan, "/scan", count("reliable"), 10)
    node.create_subscription(LaserScan, "/scan", count("depth"), QoSProfile(depth=1))
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(String, "/robot_description", count("late"), latched)
    peer.spin_until(lambda: got["late"] and min(got.values()) >= 1 and got["best_effort"] >= 10)
    return got


def sim_time():
    """How far a node's own clock is from the newest odometry, at most, in s of sim time."""
    peer = Peer(parameters=[Parameter("use_sim_time", value=True)])
    apart = []

    def heard(odometry):
        now = peer.node.get_clock().now().nanoseconds * 1e-9
        stamp = odometry.header.stamp
        if now > 0:
            apart.append(now - (stamp.sec + stamp.nanosec * 1e-9))

    peer.node.create_subscription(Odometry, "/odom", heard, 10)
    peer.spin_until(lambda: len(apart) >= 100)
    return max(map(abs, apart[50:]))


def drives():
    """How far the robot came within a second of sim time under a velocity of the release's type."""
    peer, poses = Peer(), []
    peer.node.create_subscription(Odometry, "/ground_truth", poses.append, 10)
    types = []
    peer.spin_until(lambda: poses and types.extend(command_types(peer)) is None and types)
    stamped = types[0].endswith("Stamped")
    publisher = peer.node.create_publisher(TwistStamped if stamped else Twist, "/cmd_vel", 10)
    message = publisher.msg_type()
    (message.twist if stamped else message).linear.x = 0.5

    def has_driven():
        publisher.publish(message)
        return poses[-1].pose.pose.position.x > 0.3

    peer.spin_until(has_driven)
    return types[0]


def command_types(peer):
    return dict(peer.node.get_topic_names_and_types()).get("/cmd_vel", [])


def many_nodes(count):
    """Scans that each of so many nodes heard."""
    peers = [Peer(f"node{i}") for i in range(int(count))]
    got = [[] for _ in peers]
    for peer, messages in zip(peers, got, strict=True):
        peer.node.create_subscription(LaserScan, "/scan", messages.append, 10)
    for peer, messages in zip(peers, got, strict=True):
        peer.spin_until(lambda messages=messages: len(messages) >= 5)
    return [len(messages) for messages in got]


def killed(process):
    """Whether a node sees a run go that was killed."""
    peer = Peer()
    peer.spin_until(lambda: peer.node.count_publishers("/scan") == 1)
    os.kill(int(process), signal.SIGKILL)
    peer.spin_until(lambda: peer.node.count_publishers("/scan") == 0)
    return True


def diagnostics():
    """The second of two messages: by status its level and values; and how far they are apart."""
    peer, got = Peer(), []
    peer.node.create_subscription(DiagnosticArray, "/diagnostics", got.append, 10)
    peer.spin_until(lambda: len(got) >= 2)
    stamps = [m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in got]
    return {
        "apart": stamps[1] - stamps[0],
        "status": {
            s.name: [ord(s.level), {v.key: v.value for v in s.values}] for s in got[1].status
        },
    }


def parameters():
    """Each parameter service once, and the events of what was set."""
    peer, events = Peer(), []
    peer.node.create_subscription(ParameterEvent, "/parameter_events", events.append, 10)
    names = list(peer.call(ListParameters, "list_parameters").result.names)

    def values(*which):
        found = peer.call(GetParameters, "get_parameters", names=which).values
        return [parameter_value_to_python(one) for one in found]

    def given(**wanted):
        return [Parameter(name, value=value).to_parameter_msg() for name, value in wanted.items()]

    described = peer.call(DescribeParameters, "describe_parameters", names=names).descriptors
    before = dict(zip(names, values(*names)))
    tried = given(rate=2.0, paused=True, fault="p3at/lrf:dropout,for=5")
    tried += given(seed=3, rate="fast", nobody=1) + given(rate=-1.0, fault="lrf:nonsense")
    done = peer.call(SetParameters, "set_parameters", parameters=tried).results
    peer.spin_until(lambda: any(e.node == "/ruedo" and e.changed_parameters for e in events))
    both = given(rate=3.0, seed=4)
    atomically = peer.call(SetParametersAtomically, "set_parameters_atomically", parameters=both)
    return {
        "before": before,
        "types": list(peer.call(GetParameterTypes, "get_parameter_types", names=names).types),
        "read_only": [one.name for one in described if one.read_only],
        "set": [one.reason for one in done],
        "after": values("rate", "paused", "fault"),
        "atomically": atomically.result.reason,
        "rate": values("rate", "nobody"),
        "events": [one.name for e in events if e.node == "/ruedo" for one in e.changed_parameters],
    }


def fresh_clients(count):
    """How long each of so many new clients waited for its first reply."""
    waited = []
    for i in range(int(count)):
        peer = Peer(f"fresh{i}")
        begin = time.monotonic()
        peer.call(GetParameterTypes, "get_parameter_types", names=["rate"])
        waited.append(time.monotonic() - begin)
        peer.close()
    return waited


print(json.dumps(globals()[sys.argv[1]](*sys.argv[2:])))
