"""Input from strangers: counted, harmless, and reported once a second at most."""

import contextlib
import itertools
import math
import os
import random
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from conftest import Peer, take
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription
from cyclonedds.core import Policy
from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.types import float64, sequence, uint8
from cyclonedds.util import duration
from ros_types import Clock, LaserScan, Odometry, Twist, Vector3
from rtps import participant, prefix, reader
from server import PATIENCE, Run, wait_for
from simulation_types import SERVICES
from test_services import Client, await_discovery, filters

RIG = str(Path(__file__).resolve().parent / "sensors.sdf")


@dataclass
class NotATwist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    """Bytes that claim to be a Twist."""

    data: sequence[uint8]


@dataclass
class ShortTwist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    x: float64


def await_delivery(*writers):
    for writer in writers:
        assert writer.wait_for_acks(duration(seconds=PATIENCE))


def drives(peer, cmd_vel, odometry):
    def moves():
        cmd_vel.write(Twist(Vector3(x=0.3), Vector3()))
        return any(o.twist.twist.linear.x == pytest.approx(0.3) for o in odometry.take(N=100))

    wait_for(moves, "0.3 m/s")


@pytest.mark.parametrize(
    "kind, samples",
    [
        (
            NotATwist,
            [
                NotATwist(bytes(random.Random(i).randrange(256) for _ in range(n)))
                for i, n in enumerate((0, 1, 3, 7, 20, 31))
            ],
        ),
        (ShortTwist, [ShortTwist(math.nan), ShortTwist(1e308)]),
    ],
    ids=["bytes", "short"],
)
def test_malformed_messages_are_counted(kind, samples):
    with Run("--no-noise") as run:
        peer = Peer(run.domain)
        liar = peer.writer("/cmd_vel", kind)
        await_discovery(peer)
        for sample in samples:
            liar.write(sample)
        await_delivery(liar)
        honest = Peer(run.domain)
        drives(honest, honest.writer("/cmd_vel", Twist), honest.reader("/odom", Odometry))
        output = run.end()
    assert run.process.returncode == 0
    assert f"{len(samples)} messages that came were faulty" in output
    assert "that are not a valid geometry_msgs/msg/Twist" in output


def inputs(peer) -> set[tuple[str, str]]:
    """(topic, type) of all that the run reads: topics, services and the action's."""
    reader = BuiltinDataReader(peer.participant, BuiltinTopicDcpsSubscription)
    found: set[tuple[str, str]] = set()

    def all_there():
        for sample in reader.take(N=1000):
            told = sample.qos[Policy.Userdata] if sample.qos else None
            if told and b"typehash=" in told.data:
                found.add((sample.topic_name, sample.type_name))
        return {"rq/get_entitiesRequest", "rt/initialpose"} <= {topic for topic, _ in found}

    wait_for(all_there, "what the run reads")
    return found


def noise(seed: int) -> bytes:
    """Random bytes, among which lengths of billions are frequent."""
    random_ = random.Random(seed)
    words = [bytes(random_.randrange(256) for _ in range(4)) for _ in range(random_.randrange(60))]
    return b"".join(random_.choice((w, w, b"\xff\xff\xff\xff", b"\0\0\0\0")) for w in words)


def test_noise_on_all_that_is_read_is_harmless():
    with Run("--no-noise", world=RIG) as run:
        peer = Peer(run.domain)
        read = inputs(peer)
        # Joint commands of each kind, the pose, 22 services, the action, the parameters.
        assert len(read) == 4 + 1 + 22 + 3 + 6
        liars = [
            peer.writer(topic, make_idl_struct("Noise", kind, {"data": sequence[uint8]}), "")
            for topic, kind in sorted(read)
        ]
        await_discovery(peer)
        for liar, seed in itertools.product(liars, range(40)):
            liar.write(liar.topic.data_type(noise(seed)))
        await_delivery(*liars)
        # It reads its answers, as none of those did.
        client = Client(run.domain)
        assert client.call("get_simulation_state").result.result == 1
        assert client.call("get_simulator_features").spawn_formats == ["sdf", "urdf"]
        assert client.call("get_entities", filters()).entities
        assert client.call("get_entity_state", "rig").result.result == 1
        output = run.end()
    assert run.process.returncode == 0
    assert "messages that came were faulty" in output, output


@pytest.mark.parametrize("hears", [False, True], ids=["deaf", "hears"])
def test_a_client_with_many_calls_delays_no_other(hears):
    with Run("--no-noise") as run:
        hostile, honest = Client(run.domain), Client(run.domain)
        question, answer = SERVICES["get_entity_state"]
        greedy = hostile.peer.writer("/get_entity_stateRequest", question, prefix="rq")
        wait_for(greedy.get_matched_subscriptions, "a reader")
        if hears:
            hostile.peer.reader("/get_entity_stateReply", answer, prefix="rr")
        sequence = itertools.count(1)
        for _ in range(20):
            for _ in range(300):
                greedy.write(question(hostile.mark + 1, next(sequence), "p3at"))
            # Answered, and not by "try again".
            assert honest.call("get_entity_state", "p3at").result.result == 1
        assert honest.call("get_entities", filters("^p3at$")).entities == ["p3at"]
        run.end()
    assert run.process.returncode == 0


FLOOD = """
import itertools, sys
from server import wait_for
from simulation_types import SERVICES
from test_services import Client

hostile = Client(int(sys.argv[1]))
question, answer = SERVICES[sys.argv[2]]
calls = hostile.peer.writer(f"/{sys.argv[2]}Request", question, prefix="rq")
wait_for(calls.get_matched_subscriptions, "a reader")
if sys.argv[3] == "hears":
    hostile.peer.reader(f"/{sys.argv[2]}Reply", answer, prefix="rr")
for i in itertools.count(1):
    calls.write(question(hostile.mark + 1, i, *(sys.argv[4:] or [0])))
    if i % 1000 == 0:
        print(i, flush=True)
"""


class Flood:
    """Calls without end, in a process of its own; `sent` is how many so far."""

    def __init__(self, domain: int, *arguments: str):
        self.sent = 0
        self.process = subprocess.Popen(
            [sys.executable, "-c", FLOOD, str(domain), *arguments],
            env={**os.environ, "PYTHONPATH": str(Path(__file__).resolve().parent)},
            stdout=subprocess.PIPE,
            text=True,
        )
        self.thread = threading.Thread(target=self.count)
        self.thread.start()

    def count(self):
        for line in self.process.stdout:
            self.sent = int(line)

    def goes_on(self):
        before = self.sent
        wait_for(lambda: self.sent > before + 1000, "more calls")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.thread.join()


@pytest.mark.parametrize(
    "arguments",
    [("get_entity_state", "deaf", "p3at"), ("get_simulation_state", "hears")],
    ids=["deaf", "hears"],
)
def test_a_flood_of_calls_delays_no_other_client(arguments):
    with Run("--no-noise") as run:
        known = Client(run.domain)
        assert known.call("get_entity_state", "p3at").result.result == 1
        with Flood(run.domain, *arguments) as flood:
            for client in (known, Client(run.domain)):
                flood.goes_on()
                for _ in range(5):
                    reply = client.call("get_entity_state", "p3at")
                    assert reply.result.result == 1
                assert client.call("get_simulation_state").state == 1
                flood.goes_on()
        output = run.end()
    assert run.process.returncode == 0
    assert "too large or too many, and ignored" in output


def test_a_message_of_64_mb_is_not_looked_at():
    with Run("--no-noise") as run:
        peer = Peer(run.domain)
        liar = peer.writer("/cmd_vel", NotATwist)
        await_discovery(peer)
        liar.write(NotATwist(bytes(64 << 20)))
        liar.write(NotATwist(b"1"))  # what comes after it is
        await_delivery(liar)
        honest = Peer(run.domain)
        drives(honest, honest.writer("/cmd_vel", Twist), honest.reader("/odom", Odometry))
        output = run.end()
    assert run.process.returncode == 0
    assert "left out, for it has more than 4 MB" in output
    assert "1 messages that came were faulty" in output


def fragments(writer: bytes, kind: str) -> Iterator[bytes]:
    """RTPS messages (2.5, 9.4.5.5) in a writer's name, of samples that never become whole."""
    small, large = b"x" * 600, b"x" * 60_000
    beside = struct.pack("<BBH", 0x80, 1, 59_000) + bytes(59_000)  # a submessage of no meaning
    payload, whole, rest = {
        "of a huge sample": (large, 2**31 - 1, b""),
        "of one byte": (b"x" * 4, 2**31 - 1, b""),
        "with much beside them": (small, 4 << 20, beside),
        "large": (large, 4 << 20, b""),
    }[kind]
    size = 1 if kind == "of one byte" else len(payload)
    repeated = 100 if kind == "of one byte" else 1
    # The first and every second are left out.
    numbers = 2 * min(3000, whole // size // 2 - 1)
    for number in itertools.count(2, 2 * repeated):
        message = b"RTPS\x02\x01\x01\x10" + writer[:12]
        sample, start = 1 + number // numbers, 2 + number % numbers
        for i in range(repeated):
            body = struct.pack("<HHI", 0, 28, 0) + writer[12:]
            body += struct.pack("<iIIHHI", 0, sample, start + 2 * i, 1, size, whole) + payload
            message += struct.pack("<BBH", 0x16, 1, len(body)) + body
        yield message + rest


def ports(domain: int, kind: int) -> list[tuple[str, int]]:
    """Where the first two participants of this machine listen: 10 to discovery, 11 to data."""
    return [("127.0.0.1", 7400 + 250 * domain + kind + 2 * index) for index in (0, 1)]


def resident_mb(process) -> int:
    status = Path(f"/proc/{process.pid}/status").read_text()
    return int(next(line for line in status.splitlines() if "VmRSS" in line).split()[1]) >> 10


@pytest.mark.parametrize(
    "kind",
    ["of a huge sample", "of one byte", "with much beside them"],
    ids=["huge", "tiny", "hollow"],
)
def test_fragments_that_never_make_a_sample_take_no_memory(kind):
    """Regression: 3.7 GB in five seconds, which stayed."""
    with Run("--no-noise") as run, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        peer = Peer(run.domain)
        writer = peer.writer("/cmd_vel", Twist)
        await_discovery(peer)
        before = resident_mb(run.process)
        sent = 0
        for message in itertools.islice(fragments(writer.guid.bytes, kind), 25_000):
            for to in ports(run.domain, 11):
                with contextlib.suppress(ConnectionRefusedError):
                    sent += stranger.sendto(message, to)
            if sent > 1_000_000:
                time.sleep(0.005)  # the run reads as fast as it can
                sent = 0
        assert resident_mb(run.process) - before < 400
        honest = Peer(run.domain)
        drives(honest, honest.writer("/cmd_vel", Twist), honest.reader("/odom", Odometry))
        run.end()
    assert run.process.returncode == 0


def test_fragments_of_many_writers_take_little_memory():
    """Regression: each writer had 16 MB and more of its own: more than 1 GB of these. What is held
    is 128 MB, with what the allocator keeps beside it.
    """
    with Run("--no-noise") as run, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        peer = Peer(run.domain)
        writers = [peer.writer("/cmd_vel", Twist) for _ in range(70)]
        await_discovery(peer)
        before = resident_mb(run.process)
        kinds = [fragments(writer.guid.bytes, "large") for writer in writers]
        for number, kind in enumerate(itertools.islice(itertools.cycle(kinds), 12_000)):
            for to in ports(run.domain, 11):
                with contextlib.suppress(ConnectionRefusedError):
                    stranger.sendto(next(kind), to)
            if number % 8 == 0:
                time.sleep(0.005)  # the run reads as fast as it can
        assert resident_mb(run.process) - before < 400
        honest = Peer(run.domain)
        drives(honest, honest.writer("/cmd_vel", Twist), honest.reader("/odom", Odometry))
        run.end()
    assert run.process.returncode == 0


def test_one_socket_has_its_share_of_participants():
    """Regression: beside 900 that do not exist, a new client waited for 20 s."""
    with contextlib.ExitStack() as stack:
        run = stack.enter_context(Run("--no-noise"))
        stranger, *false_ones = [
            stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(61)
        ]
        for each in false_ones:
            each.bind(("127.0.0.1", 0))
            each.setblocking(False)
        clock = Peer(run.domain).reader("/clock", Clock)
        take(clock)

        def tell(number: int):
            for message in (
                participant(prefix(number), false_ones[number].getsockname()[1]),
                reader(prefix(number), "rt/clock", "rosgraph_msgs::msg::dds_::Clock_"),
            ):
                for to in ports(run.domain, 10):
                    with contextlib.suppress(ConnectionRefusedError):
                        stranger.sendto(message, to)

        def served() -> set[int]:
            """Those that the run sends to now."""
            found = set()
            for keep in (False, True):
                for number, each in enumerate(false_ones):
                    with contextlib.suppress(BlockingIOError):
                        while each.recv(65536):
                            found |= {number} if keep else set()
                if not keep:
                    take(clock, 100)
            return found

        for number in range(len(false_ones)):
            tell(number)
            time.sleep(0.01)
        last = len(false_ones) - 1
        wait_for(lambda: tell(last) or last in served(), "the last")
        wait_for(lambda: len(served()) <= 32, "at most 32")
        assert Client(run.domain).call("get_simulation_state").state == 1
        output = run.end()
    assert run.process.returncode == 0
    assert output.count("more than 32 participants come from one socket") == 1


@pytest.mark.parametrize("speed", [math.nan, math.inf, -math.inf])
def test_no_number_moves_nothing(speed):
    with Run("--no-noise", "--rate", "2") as run:
        peer = Peer(run.domain)
        cmd_vel, odometry = peer.writer("/cmd_vel", Twist), peer.reader("/odom", Odometry)
        take(odometry)
        await_discovery(peer)
        cmd_vel.write(Twist(Vector3(x=speed), Vector3()))
        assert all(o.pose.pose.position.x == 0.0 for o in take(odometry, 50))
    assert run.process.returncode == 0


def test_a_reader_that_never_reads_slows_no_other():
    with Run("--rate", "max", "--duration", "20", "--paused") as run:
        sleeper, peer = Peer(run.domain), Peer(run.domain)
        sleeper.reader("/scan", LaserScan, depth=1)
        scans = peer.reader("/scan", LaserScan)
        await_discovery(peer)
        Client(run.domain, peer).call("set_simulation_state", 1)  # playing
        take(scans, 5)
        assert run.process.wait(timeout=300) == 0
