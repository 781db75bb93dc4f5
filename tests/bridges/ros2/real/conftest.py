"""`ruedo run --ros2` and real ROS 2: rclpy over rmw_fastrtps, from PyPI (install.py)."""

from __future__ import annotations

import time

import pytest
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from server import PATIENCE, Run

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Peer:
    """A node in a context of its own, as a process of its own has it."""

    def __init__(self, domain: int, name: str = "peer", **parameters: object):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        given = [Parameter(name, value=value) for name, value in parameters.items()]
        self.node = Node(name, context=self.context, parameter_overrides=given)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.clients: dict[str, object] = {}

    def hear(self, kind: type, topic: str, qos: object = 10, **options: object) -> list:
        """What comes on a topic, while the peer spins."""
        messages: list = []
        self.node.create_subscription(kind, topic, messages.append, qos, **options)
        return messages

    def call(self, kind: type, name: str, /, **request: object):
        """The response."""
        client = self.clients.get(name) or self.node.create_client(kind, name)
        self.clients[name] = client
        assert client.wait_for_service(PATIENCE), name
        return self.result(client.call_async(kind.Request(**request)), name)

    def result(self, future: object, what: str):
        self.executor.spin_until_future_complete(future, timeout_sec=PATIENCE)
        assert future.done(), f"{what}: no reply"
        return future.result()

    def spin_until(self, condition, what: str = "the condition"):
        """What `condition` returns, once that is true."""
        deadline = time.monotonic() + PATIENCE
        while not (result := condition()):
            assert time.monotonic() < deadline, f"{what} did not come"
            self.executor.spin_once(timeout_sec=0.1)
        return result

    def topics(self) -> dict[str, list[str]]:
        """{name: types}"""
        return dict(self.node.get_topic_names_and_types())

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def peers():
    """Makes peers, which go when the test ends."""
    made = []

    def make(run: Run, name: str = "peer", **parameters: object) -> Peer:
        made.append(Peer(run.domain, name, **parameters))
        return made[-1]

    yield make
    for peer in made:
        peer.close()


@pytest.fixture
def run():
    with Run("--no-noise", "--disable", "p3at/camera") as one:
        yield one


@pytest.fixture
def peer(run, peers):
    return peers(run)


def seconds(stamp: object) -> float:
    return stamp.sec + stamp.nanosec * 1e-9
