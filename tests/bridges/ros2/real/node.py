"""What a node of real ROS 2 sees of a run, as JSON.

node.py WHAT [NUMBER]
"""

import itertools
import json
import sys
import time

import rclpy
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
from sensor_msgs.msg import LaserScan

PATIENCE = 30  # s


class Peer:
    """A node in a context of its own, as a process of its own has it."""

    def __init__(self, name="peer"):
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = Node(name, context=self.context)
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
