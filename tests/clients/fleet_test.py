"""Lockstep with 256 robots over every transport, and what the client computes for every message, in
C++ and in Python.
"""

import hashlib
import importlib.util
import random
import struct
import subprocess
import sys
import zlib

import pytest
from conftest import HALL, PATIENCE, SOURCE, free_url, ruedo_run, tcp_server
from lockstep_test import bad_network
from ruedo import _engine, lcmtypes, samples
from ruedo.fast_decoding import DECODERS

ROBOTS, DECISIONS = 256, 3


def module_of(path, name):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


PLAIN = module_of(SOURCE / "clients/python/ruedo/transport/arrivals.py", "plain_arrivals")
BENCHMARK = module_of(SOURCE / "benchmarks/bench_lockstep_fleet.py", "bench_lockstep_fleet")


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    file = tmp_path_factory.mktemp("fleet") / "fleet.sdf"
    file.write_text(BENCHMARK.world(ROBOTS))
    return str(file)


def decisions(url):
    """How many messages came in three decisions of 0.1 s, their digest, and the hash at the end."""
    import ruedo

    digest, count = hashlib.sha256(), 0
    with ruedo.connect(url, name="fleet", timeout=PATIENCE) as sim:
        robots = [sim.robot(f"r{i}") for i in range(ROBOTS)]
        commands = []
        for _ in range(DECISIONS):
            seen = sim.step(20, commands, timeout=PATIENCE)
            for message in seen.messages:
                digest.update(repr(message).encode())
            count += len(seen.messages)
            nearest = [seen.latest(robot.lrf).nearest() for robot in robots]
            commands = [
                robot.velocity_command(0.2, 0.5 if near < 2.0 else -0.5)
                for robot, near in zip(robots, nearest, strict=True)
            ]
        return count, digest.hexdigest(), seen.state_hash


def test_256_robots_over_every_transport(fleet, tmp_path):
    """Also when every tenth datagram is lost: a step then misses more than one RESEND may want."""
    lockstep = ("--lockstep", "1", "--lease", str(PATIENCE), "--quiet")  # a list of 3 000 channels
    servers = {
        "unix": lambda: ruedo_run(*lockstep, world=fleet, url=f"unix://{tmp_path}/bus"),
        "tcpq": lambda: tcp_server(*lockstep, world=fleet),
        "udpm": lambda: ruedo_run(*lockstep, world=fleet),
    }
    ends = {}
    for name, start in servers.items():
        with start() as server:
            ends[name] = decisions(server.url)
    with servers["udpm"]() as server, bad_network(server.url, 1, 0.1) as [url]:
        ends["lossy"] = decisions(url)
    # From 0 to 0.3 s pose, odometry and its twist at 50 Hz; lrf, motion and collisions at 10 Hz;
    # motion once more, when the first command comes; ruedo/world at 30 Hz.
    assert ends["unix"][0] == ROBOTS * (3 * 16 + 3 * 4 + 1) + 10
    assert all(end == ends["unix"] for end in ends.values()), ends


def random_frames(random_, count):
    frames = b""
    for _ in range(count):
        name = random_.choice(["r1/lrf", "r2/lrf", "ruedo/tick", "", "\u00fc" * 31]).encode()
        data = random_.randbytes(random_.choice([0, 1, 8, 100, 5000]))
        frames += struct.pack(">II", 1, len(name)) + name + struct.pack(">I", len(data)) + data
    return frames


def test_streams_are_taken_apart_alike():
    random_ = random.Random(5)
    for _ in range(300):
        data = random_frames(random_, random_.randrange(8))
        data = data[: random_.randrange(len(data) + 1)]
        at = random_.choice([0, min(8, len(data))])
        names, others = {}, {}
        assert _engine.take_apart(data, at, names) == PLAIN.take_apart(data, at, others)
        assert names == others
    for broken in (struct.pack(">III", 1, 64, 0), struct.pack(">III", 1, 0, 1 << 27)):
        assert _engine.take_apart(broken, 0, {}) is PLAIN.take_apart(broken, 0, {}) is None


def test_messages_are_dispatched_alike():
    arrived = [("a", b"1"), ("b", b"2"), ("c", b"3"), ("d", b"4"), ("a", b"5")]
    for functions in (_engine, PLAIN):
        collected, handed = [], []
        functions.dispatch(
            arrived,
            {"a": collected.append, "b": collected.append},
            {"b": ("hb",), "c": ("hc",)},
            lambda *one, handed=handed: handed.append(one),
        )
        assert collected == [("a", b"1"), ("b", b"2"), ("a", b"5")]
        assert handed == [(("hb",), b"2"), (("hc",), b"3")]

        def fails(handlers, data):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            functions.dispatch(arrived, {}, {"a": ()}, fails)


def test_manifests_are_compared_alike():
    from collections import deque

    random_ = random.Random(7)
    indices = {"a": 3, "b": 4}
    came = deque((random_.choice("ab"), random_.randbytes(20)) for _ in range(6))
    entries = [(indices[name], 0, len(data), zlib.crc32(data)) for name, data in came]

    def said(listed, messages=came):
        tick = b"head" + b"".join(struct.pack(">iqiI", *entry) for entry in listed)
        both = [each.are_listed(messages, tick, 4, indices) for each in (_engine, PLAIN)]
        assert both[0] == both[1]
        return both[0]

    assert said(entries) and said([], deque())
    for place in range(6):
        for field in (0, 2, 3):
            other = [list(entry) for entry in entries]
            other[place][field] ^= 1
            assert not said(other), (place, field)
    unknown = deque(came)
    unknown[2] = ("c", unknown[2][1])
    assert not said(entries, unknown)
    steps = [(1, list(came)), (2, []), (3, list(came))]
    assert _engine.by_channel(steps) == PLAIN.by_channel(steps)


def random_message(kind, random_):
    message = getattr(lcmtypes, kind)()
    message.utime = random_.getrandbits(40)
    many = [random_.uniform(-9, 9) for _ in range(random_.choice([0, 1, 24, 181]))]
    if kind == "planar_lidar_t":
        message.ranges, message.nranges = [*many, float("inf")], len(many) + 1
        message.intensities = message.ranges if random_.random() < 0.5 else []
        message.nintensities = len(message.intensities)
        message.rad0, message.radstep = random_.uniform(-3, 3), random_.uniform(0, 0.1)
    elif kind == "odometry_t":
        message.x, message.y, message.theta, message.v, message.omega = (
            random_.uniform(-9, 9) for _ in range(5)
        )
        message.angle = message.rate = many
        message.n, message.resets = len(many), random_.randrange(9)
        message.ticks = [random_.randrange(-(2**40), 2**40) for _ in many]
    else:
        for name in ("pos", "vel", "rotation_rate", "accel"):
            setattr(message, name, [random_.uniform(-9, 9) for _ in range(3)])
        message.orientation = [random_.uniform(-1, 1) for _ in range(4)]
    return message


@pytest.mark.parametrize("kind", sorted(DECODERS))
def test_samples_from_the_bytes_are_those_of_the_generated_types(kind):
    random_ = random.Random(3)
    message_type, convert = samples.CONVERSIONS[kind]
    for _ in range(20):
        data = random_message(kind, random_).encode()
        made, same = DECODERS[kind](data), convert(message_type.decode(data))
        assert made == same and repr(made) == repr(same) and hash(made) == hash(same)
        assert {k: type(v) for k, v in vars(made).items()} == {
            k: type(v) for k, v in vars(same).items()
        }
    data = random_message(kind, random_).encode()
    for size in range(8, len(data)):
        with pytest.raises((struct.error, ValueError)):
            DECODERS[kind](data[:size])
    if kind != "pose_t":  # a length that is negative, or more than is there
        at = {"planar_lidar_t": 16, "odometry_t": 56}[kind]
        for length in (-1, 2**31 - 1):
            with pytest.raises((struct.error, ValueError)):
                DECODERS[kind](data[:at] + struct.pack(">i", length) + data[at + 4 :])


STEPS = """
import hashlib, sys
if sys.argv[2] == "without": sys.modules["ruedo._engine"] = None
import ruedo
from ruedo.transport import arrivals
with ruedo.connect(sys.argv[1], name="one", timeout=400.0) as sim:
    robot, digest = sim.robot("p3at"), hashlib.sha256()
    for _ in range(30):
        seen = sim.step(10, [robot.velocity_command(0.3, 0.2)], timeout=400.0)
        for message in seen.messages: digest.update(repr(message).encode())
        for device in (robot.lrf, robot.odometry, robot.pose, robot.motion):
            for one in seen.all(device): digest.update(repr(one._key()).encode())
    compiled = not hasattr(arrivals.take_apart, "__code__")
    print(compiled, seen.step, f"{seen.state_hash:x}", digest.hexdigest())
"""


@pytest.mark.parametrize("transport", ["unix", "udpm"])
def test_without_the_engine_module_it_is_the_same(transport, tmp_path):
    said = {}
    for way in ("with", "without"):
        url = f"unix://{tmp_path}/{way}" if transport == "unix" else free_url()
        with ruedo_run(
            "--lockstep", "1", "--disable", "p3at/camera", world=HALL, url=url
        ) as server:
            ran = subprocess.run(
                [sys.executable, "-c", STEPS, server.url, way], capture_output=True, text=True
            )
        assert ran.returncode == 0, ran.stderr
        said[way] = ran.stdout.split()
    assert said["with"].pop(0) == "True" and said["without"].pop(0) == "False"
    assert said["with"] == said["without"] and said["with"][0] == "300"
