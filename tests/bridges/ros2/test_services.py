"""Services over DDS as rmw_cyclonedds maps them, which PyPI's ROS 2 lacks: called by another peer.

What the services do is tested by real ROS 2 (real/test_simulation.py).
"""

from __future__ import annotations

import itertools
import random
import re

import pytest
from conftest import Peer, take
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy
from ros_types import (
    Clock,
    Header,
    Point,
    Pose,
    Quaternion,
    Time,
)
from server import Run, wait_for
from simulation_types import (
    SERVICES,
    Bounds,
    EntityCategory,
    EntityFilters,
    PoseStamped,
    TagsFilter,
)

OK, FAILED = 1, 4
STOPPED, PLAYING, PAUSED = 0, 1, 2

CRATE = """<sdf version="1.9"><model name="crate"><link name="link">
  <inertial><mass>2</mass></inertial>
  <collision name="box"><geometry><box><size>0.3 0.3 0.3</size></box></geometry></collision>
</link></model></sdf>"""


class Client:
    """A client of the run's services; calls wait for their answer."""

    services = SERVICES

    _marks = itertools.count(1)

    def __init__(self, domain: int, peer: Peer | None = None):
        self.peer = peer or Peer(domain)
        self.mark = random.Random(next(self._marks)).getrandbits(64)
        self.sequence = itertools.count(1)
        self.ends = {}

    def call(self, service: str, *arguments):
        """The reply."""
        question, _ = self.services[service]
        if service not in self.ends:
            self.open(service)
            await_discovery(self.peer)
        writer, reader = self.ends[service]
        sequence = next(self.sequence)
        writer.write(question(self.mark, sequence, *(arguments or [0])))  # a message is never empty

        def mine():
            replies = [r for r in reader.take(N=1000) if hasattr(r, "__idl__")]
            return [r for r in replies if (r.client, r.sequence_number) == (self.mark, sequence)]

        [reply] = wait_for(mine, f"the reply of {service}")
        return reply

    def open(self, service: str) -> None:
        question, answer = self.services[service]
        writer = self.peer.writer(f"/{service}Request", question, prefix="rq")
        # Others' replies come here, too: 2000 a second, while this process waits for its turn.
        reader = self.peer.reader(f"/{service}Reply", answer, prefix="rr", depth=100_000)
        wait_for(
            lambda: writer.get_matched_subscriptions() and reader.get_matched_publications(),
            service,
        )
        self.ends[service] = writer, reader

    def state(self) -> int:
        return self.call("get_simulation_state").state


def await_discovery(peer: Peer) -> None:
    """Until the run knows all readers and writers that the peer has so far; what these write before
    that is lost (docs/ros2.md, too). A participant tells of them in order, and here of those of a
    new client last, which asks and is answered.
    """
    last = Client(peer.domain, peer)
    last.open("get_simulation_state")
    last.call("get_simulation_state")


def at(x=0.0, y=0.0, z=0.0, frame="") -> PoseStamped:
    return PoseStamped(Header(Time(), frame), Pose(Point(x, y, z), Quaternion()))


def filters(pattern="", categories=(), tags=(), points=()) -> EntityFilters:
    return EntityFilters(
        pattern,
        [EntityCategory(c) for c in categories],
        TagsFilter(list(tags), 0),
        Bounds(0, list(points)),
    )


@pytest.fixture
def client():
    with Run("--no-noise") as run:
        yield Client(run.domain)


def test_participants_of_one_process_are_all_heard():
    """Regression: Cyclone DDS sends what they tell at once in one message, of which the run heard
    the first participant alone."""
    with Run("--no-noise") as run:
        for _ in range(4):
            clients = [Client(run.domain) for _ in range(3)]
            assert [each.state() for each in clients] == [PLAYING] * 3
            clients.clear()  # and they leave


def test_states_follow_each_other(client):
    assert client.state() == PLAYING
    assert client.call("set_simulation_state", PAUSED).result.result == OK
    assert client.state() == PAUSED
    clocks = client.peer.reader("/clock", Clock)
    before = client.call("get_entity_state", "p3at").state.header.stamp.us
    assert client.call("step_simulation", 40).result.result == OK
    assert client.call("get_entity_state", "p3at").state.header.stamp.us == before + 40 * 5000
    assert take(clocks)
    assert client.call("set_simulation_state", STOPPED).result.result == OK
    assert client.state() == STOPPED
    assert client.call("set_simulation_state", PLAYING).result.result == OK
    assert client.state() == PLAYING


def test_a_text_that_is_too_large_is_refused_by_its_size(client):
    text = CRATE.replace("<link", f"<!--{'x' * 3_000_000}--><link")
    reply = client.call("spawn_entity", "crate", False, "", text, "", at(0.0, 3.0, 1.0))
    assert reply.result.result == FAILED
    assert re.fullmatch(
        "its body has 30[0-9]{5} bytes: a request has 1048576 at most", reply.result.error_message
    )
    spawned = client.call("spawn_entity", "crate", False, "", CRATE, "", at(0.0, 3.0, 1.0))
    assert spawned.result.result == OK, spawned.result.error_message


def test_models_that_are_spawned_at_once_have_names_of_their_own(client):
    client.call("spawn_entity", "crate", True, "", CRATE, "", at(0.0, 3.0, 1.0))
    question, _ = client.services["spawn_entity"]
    writer, reader = client.ends["spawn_entity"]
    for x in (1.0, 2.0):  # the run makes no more ready at once
        number = next(client.sequence)
        place = at(x, 3.0, 1.0)
        writer.write(question(client.mark, number, "crate", True, "", CRATE, "", place))
    assert {reply.entity_name for reply in take(reader, 2)} == {"crate_2", "crate_3"}


def test_both_ends_of_a_service_have_its_hash_and_one_id(client):
    reader = BuiltinDataReader(client.peer.participant, BuiltinTopicDcpsSubscription)
    found = {}

    def all_there():
        for s in reader.take(N=1000):
            if s.topic_name.startswith("rq/") and Policy.Userdata in s.qos:
                found[s.topic_name] = s.qos[Policy.Userdata].data.decode()
        return len(found) >= 22

    wait_for(all_there, "all services")
    # As rosidl generated it for simulation_interfaces 1.x.
    assert (
        "typehash=RIHS01_4ce285d7ff9b8ac70dcc95161f32bf54c05a6f4b13427990e41ab40c36c39646;"
        in found["rq/reset_simulationRequest"]
    )
    assert all(data.startswith("serviceid=") for data in found.values())
