"""ruedo run --foxglove: seen by Foxglove's own client library, message by message as `ruedo export`
writes the same run.
"""

from __future__ import annotations

import base64
import json
import os
import re
import socket
import struct
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from harness import ARENA, BUILD, NODE, RUEDO, SOURCE, Socket
from mcap.reader import make_reader

TOPICS = ["p3at/lrf", "p3at/odometry", "ruedo/world", "ruedo/frames", "ruedo/scene"]


@contextmanager
def serving(*arguments: str, world: Path = ARENA) -> Iterator[tuple[subprocess.Popen, str]]:
    process = subprocess.Popen(
        [RUEDO, "run", world, "--foxglove", "127.0.0.1:0", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        for line in process.stdout:
            if found := re.match(r"Foxglove: (ws://\S+)", line):
                yield process, found.group(1)
                break
        else:
            pytest.fail(process.stderr.read())
    finally:
        process.terminate()
        process.communicate(timeout=100)


def seen(url: str, seconds: float, *topics: str) -> list[dict]:
    viewer = subprocess.run(
        [NODE, Path(__file__).with_name("foxglove.mjs"), url, str(seconds), *topics],
        cwd=BUILD / "web",
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert viewer.returncode == 0, viewer.stderr
    return [json.loads(line) for line in viewer.stdout.splitlines()]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict], dict]:
    """What a viewer saw in six seconds of a run, and the same run's messages as an exported file
    has them.
    """
    folder = tmp_path_factory.mktemp("foxglove")
    with serving("--record", str(folder / "run.lcm")) as (_, url):
        lines = seen(url, 6, *TOPICS)
    subprocess.run([RUEDO, "export", folder / "run.lcm", folder / "run.mcap"], check=True)
    exported: dict = {}
    with open(folder / "run.mcap", "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            key = (channel.topic, message.log_time)
            exported.setdefault(key, []).append((schema.name, message.data.decode()))
    return lines, exported


def test_the_foxglove_server_equals_the_export(run: tuple[list[dict], dict]) -> None:
    lines, exported = run
    assert not [line for line in lines if "error" in line or "status" in line]
    messages = [line for line in lines if "topic" in line]
    for topic in TOPICS:
        here = [line for line in messages if line["topic"] == topic]
        assert here, f"nothing came on {topic}"
        if topic in ("ruedo/frames", "ruedo/scene"):  # as for the first viewer
            texts = {
                text for (name, _), all in exported.items() if name == topic for _, text in all
            }
            assert {line["text"] for line in here} <= texts
            continue
        for line in here:
            assert line["text"] in [text for _, text in exported[topic, int(line["at"])]]
    scans = [int(line["at"]) for line in messages if line["topic"] == "p3at/lrf"]
    assert len(scans) > 20 and scans == list(range(scans[0], scans[-1] + 1, 100_000_000))


def test_channels_have_foxgloves_schemas(run: tuple[list[dict], dict]) -> None:
    lines, exported = run
    schemas = {
        line["channel"]["topic"]: line["channel"]["schemaName"]
        for line in lines
        if "channel" in line
    }
    assert schemas["p3at/lrf"] == "foxglove.LaserScan"
    assert schemas["ruedo/world"] == "foxglove.FrameTransforms"
    for (topic, _), messages in exported.items():
        if topic in schemas:
            assert schemas[topic] in [name for name, _ in messages]
    info = next(line["info"] for line in lines if "info" in line)
    assert info["capabilities"] == ["time", "clientPublish"]
    assert info["supportedEncodings"] == ["json"]


def test_a_client_that_joins_at_once_may_drive() -> None:
    """Before the run's first messages have come this way; what was advertised is told by what is
    complained of first."""
    wish = {"id": 1, "topic": "/cmd_vel", "encoding": "json"}
    for _ in range(10):
        with serving("--disable", "p3at/camera") as (_, url):
            port = int(url.removesuffix("/").split(":")[-1])
            viewer = Socket(port, path="/", **{"Sec-WebSocket-Protocol": "foxglove.sdk.v1"})
            viewer.send(json.dumps({"op": "advertise", "channels": [wish]}).encode(), 1)
            viewer.send(struct.pack("<BI", 1, 7))
            told: dict = {}
            while told.get("op") != "status":
                opcode, data = viewer.receive()
                told = json.loads(data) if opcode == 1 else {}
            assert told["message"] == "no channel 7 was advertised"


def test_a_twist_drives_the_only_robot(run: tuple[list[dict], dict]) -> None:
    lines, _ = run
    poses = [
        json.loads(line["text"])["pose"]["position"]
        for line in lines
        if line.get("topic") == "p3at/odometry"
    ]
    assert abs(poses[-1]["x"] - poses[0]["x"]) + abs(poses[-1]["y"] - poses[0]["y"]) > 0.2


def test_time_is_the_simulations(run: tuple[list[dict], dict]) -> None:
    times = [int(line["time"]) for line in run[0] if "time" in line]
    assert times == sorted(times)
    assert 0 < times[-1] - times[0] < 60_000_000_000  # how many come is the machine's affair


def test_a_fix_is_a_place_on_the_map() -> None:
    """By hand: tests/bridges/ros2/instruments.sdf lies at 45 degrees north, 8 east, 110 m high."""
    world = SOURCE / "tests/bridges/ros2/instruments.sdf"
    with serving("--no-noise", world=world) as (_, url):
        lines = seen(url, 6, "mast/gps")
    channel = next(
        line["channel"] for line in lines if line.get("channel", {}).get("topic") == "mast/gps"
    )
    assert channel["schemaName"] == "foxglove.LocationFix"
    fixes = [json.loads(line["text"]) for line in lines if line.get("topic") == "mast/gps"]
    assert fixes
    for fix in fixes:
        assert fix["latitude"] == pytest.approx(45, abs=1e-12)
        assert fix["longitude"] == pytest.approx(8, abs=1e-12)
        assert fix["altitude"] == pytest.approx(110, abs=1e-8)
        assert fix["frame_id"] == "mast/gps" and fix["position_covariance_type"] == 0


def open_socket(url: str, origin: str = "") -> tuple[socket.socket, bytes]:
    host, port = url.removeprefix("ws://").rstrip("/").split(":")
    one = socket.create_connection((host, int(port)), timeout=60)
    key = base64.b64encode(os.urandom(16)).decode()
    one.sendall(
        (
            f"GET / HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n"
            + (f"Origin: {origin}\r\n" if origin else "")
            + "\r\n"
        ).encode()
    )
    return one, one.recv(4096)


def frame(payload: bytes, opcode: int) -> bytes:
    mask = b"\1\2\3\4"
    body = bytes(b ^ mask[i % 4] for i, b in enumerate(payload))
    size = (
        struct.pack("!B", 0x80 | len(payload))
        if len(payload) < 126
        else struct.pack("!BH", 0xFE, len(payload))
    )
    return struct.pack("!B", 0x80 | opcode) + size + mask + body


HOSTILE = [
    (1, b"{"),
    (1, b"[]"),
    (1, b"{}"),
    (1, b'{"op":7}'),
    (1, b'{"op":"subscribe"}'),
    (1, b'{"op":"subscribe","subscriptions":[{"id":-1,"channelId":1e300}]}'),
    (1, b'{"op":"subscribe","subscriptions":[{"id":1,"channelId":99999999}]}'),
    (1, b'{"op":"unsubscribe","subscriptionIds":["x",null]}'),
    (1, b'{"op":"advertise","channels":[{"id":1,"topic":"/cmd_vel","encoding":"cdr"}]}'),
    (1, b'{"op":"advertise","channels":[{"id":"1","topic":5,"encoding":"json"}]}'),
    (1, b'{"op":"advertise","channels":[{"id":1,"topic":"/cmd_vel","encoding":"json"}]}'),
    (2, b"\1"),
    (2, b"\1\1\0\0\0"),
    (2, b'\1\1\0\0\0{"linear":{"x":1e999},"angular":{}}'),
    (2, b'\1\1\0\0\0{"linear":{"x":"fast","y":0},"angular":{"z":0}}'),
    (2, b"\1\7\0\0\0{}"),
    (2, b"\2\0"),
    (2, bytes(range(256)) * 8),
    (1, b'{"op":"' + b"[" * 20000),
]


def test_malformed_messages_of_a_viewer_are_harmless() -> None:
    with serving() as (process, url):
        for opcode, payload in HOSTILE:
            one, answer = open_socket(url)
            assert b"101 " in answer and b"foxglove.sdk.v1" in answer
            one.sendall(frame(payload, opcode))
            one.close()
        lines = seen(url, 2, "p3at/lrf")
        assert [line for line in lines if line.get("topic") == "p3at/lrf"]
        assert process.poll() is None


def test_a_message_of_many_wishes_costs_little() -> None:
    """A channel has few subscriptions of one viewer, and a message gets one complaint."""
    wishes = [{"id": i, "channelId": 0} for i in range(1000)]
    topics = [{"id": i, "topic": "x", "encoding": "json"} for i in range(99)]
    with serving("--disable", "p3at/camera") as (_, url):
        port = int(url.removesuffix("/").split(":")[-1])
        viewer = Socket(port, path="/", **{"Sec-WebSocket-Protocol": "foxglove.sdk.v1"})

        def until(wanted: Callable[[dict], bool]) -> list[dict]:
            texts: list[dict] = []
            while not texts or not wanted(texts[-1]):
                opcode, data = viewer.receive()
                if opcode == 1:
                    texts.append(json.loads(data))
            return texts

        until(lambda text: any(one["id"] == 1 for one in text.get("channels", [])))
        for asked in (
            {"op": "subscribe", "subscriptions": wishes},
            {"op": "unsubscribe", "subscriptionIds": list(range(1000))},
            {"op": "subscribe", "subscriptions": wishes[:8]},
            {"op": "subscribe", "subscriptions": [{"id": 0, "channelId": 1}]},
            {"op": "advertise", "channels": topics},
            {"op": "subscribe", "subscriptions": [{"id": 9, "channelId": 1 << 30}]},
        ):
            viewer.send(json.dumps(asked).encode(), opcode=1)
        last = f"no channel {1 << 30}"
        said = [text.get("message") for text in until(lambda text: text.get("message") == last)]
        viewer.close()
    assert [words for words in said if words] == [
        "too many subscriptions to channel 0",
        "subscription 0 is there already",
        "publishing is for velocities (geometry_msgs/Twist as json) on: "
        "cmd_vel, p3at/cmd_vel, p3at/velocity",
        last,
    ]


def test_pictures_are_drawn_for_a_viewer_after_a_change(tmp_path: Path) -> None:
    """Whether anybody wants them was asked only when models or clients of the bus came or went."""
    import ruedo

    bus = f"unix://{tmp_path / 'bus'}"
    with serving("--lcm", bus) as (_, url), ruedo.connect(bus, timeout=60) as sim:
        sim.spawn("desk", x=5, y=5)
        lines = seen(url, 3, "p3at/camera")
    assert [line for line in lines if line.get("topic") == "p3at/camera"]


def test_only_foxgloves_own_pages_and_programs_come_in() -> None:
    with serving() as (_, url):
        for origin in ("http://evil.example", "https://app.foxglove.dev.evil.example", "null"):
            assert b"403" in open_socket(url, origin)[1], origin
        for origin in ("https://app.foxglove.dev", ""):
            assert b"101 " in open_socket(url, origin)[1], origin


def test_a_later_viewer_sees_the_drawings_of_clients() -> None:
    """The newest of each layer, once."""
    import ruedo

    points = ruedo.markers.points
    with (
        serving("--disable", "p3at/camera") as (_, url),
        ruedo.connect(timeout=60) as sim,
    ):
        sim.markers("plan", [points([[0, 0], [1, 0]])])
        sim.markers("plan", [points([[3, 0]], size=0.5)], frame="p3at")
        sim.markers("other", [points([[0, 0]])])
        sim.sleep(0.5)
        lines = seen(url, 3, "ruedo/markers")
    updates = [json.loads(line["text"]) for line in lines if line.get("topic") == "ruedo/markers"]
    entities = [entity for update in updates for entity in update["entities"]]
    assert [(one["id"], one["frame_id"]) for one in entities] == [
        ("plan", "p3at"),
        ("other", "world"),
    ]
    assert [ball["size"]["x"] for ball in entities[0]["spheres"]] == [0.5]
    schemas = [
        line["channel"]["schemaName"]
        for line in lines
        if "channel" in line and line["channel"]["topic"] == "ruedo/markers"
    ]
    assert schemas == ["foxglove.SceneUpdate"]
