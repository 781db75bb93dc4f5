"""`ruedo run --ros2` and an independent peer: the PyPI package cyclonedds, with types written from
the ROS interfaces.
"""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

import pytest
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

PATIENCE = float(os.environ.get("RUEDO_PATIENCE", "300"))  # s, for what comes sooner or later
SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[3]))
RUEDO = os.environ.get("RUEDO", str(SOURCE / "build/release/bin/ruedo"))
ARENA = str(SOURCE / "worlds/arena.sdf")

_domains = iter(range(1, 200))


class Peer:
    """A participant; `topic` is ROS's name."""

    def __init__(self, domain: int):
        self.domain = domain
        self.participant = DomainParticipant(domain)
        self.entities: list[object] = []

    def reader(
        self,
        topic: str,
        kind: type,
        latched: bool = False,
        reliable: bool = True,
        depth: int = 1000,
        prefix: str = "rt",
    ) -> DataReader:
        qos = [Policy.History.KeepLast(depth)]
        qos.append(
            Policy.Reliability.Reliable(duration(seconds=1))
            if reliable
            else Policy.Reliability.BestEffort
        )
        if latched:
            qos.append(Policy.Durability.TransientLocal)
        reader = DataReader(
            self.participant, Topic(self.participant, prefix + topic, kind), qos=Qos(*qos)
        )
        self.entities.append(reader)
        return reader

    def writer(self, topic: str, kind: type, prefix: str = "rt") -> DataWriter:
        qos = Qos(Policy.History.KeepLast(100), Policy.Reliability.Reliable(duration(seconds=1)))
        writer = DataWriter(
            self.participant, Topic(self.participant, prefix + topic, kind), qos=qos
        )
        self.entities.append(writer)
        return writer


class Run:
    """`ruedo run WORLD --ros2` in a domain of its own; ends with the with-block."""

    def __init__(
        self,
        *arguments: str,
        world: str = ARENA,
        environment: dict[str, str] | None = None,
        lcm: str = "auto",
    ):
        self.domain = next(_domains)
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self.domain), **(environment or {})}
        self.process = subprocess.Popen(
            [RUEDO, "run", world, "--ros2", "--lcm", lcm, *arguments],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def __enter__(self) -> Run:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> str:
        """Its output."""
        if self.process.poll() is None:
            self.process.terminate()
        try:
            return self.process.communicate(timeout=PATIENCE)[0]
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.communicate()[0]
        except ValueError:  # read already
            return ""


def wait_for(condition, what: str = "the condition"):
    """What `condition` returns, once that is true."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if result := condition():
            return result
        time.sleep(0.01)
    pytest.fail(f"{what} did not come")


def take(reader: DataReader, count: int = 1) -> list:
    """The next samples of a reader, at least so many."""
    samples: list = []

    def enough():
        samples.extend(s for s in reader.take(N=1000) if hasattr(s, "__idl__"))
        return len(samples) >= count

    wait_for(enough, f"{count} samples on {reader.topic.name}")
    return samples


def bag_of(world: str, folder: Path) -> dict[str, list]:
    """{topic: messages} of a second of a world without noise.

    Each encodes again to the bytes that it came in.
    """
    for arguments in (
        [
            "run",
            world,
            "--no-noise",
            "--rate",
            "max",
            "--duration",
            "1",
            "--record",
            folder / "run.lcm",
            "--lcm",
            "auto",
            "--quiet",
        ],
        ["export", folder / "run.lcm", "--ros2", folder / "run"],
    ):
        subprocess.run(
            [RUEDO, *map(str, arguments)], check=True, timeout=PATIENCE, capture_output=True
        )
    store = get_typestore(Stores.ROS2_JAZZY)
    found: dict[str, list] = {}
    with Reader(folder / "run") as reader:
        for connection in reader.connections:
            told = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            store.register(
                {name: fields for name, fields in told.items() if name not in store.fielddefs}
            )
        for connection, _, raw in reader.messages():
            message = store.deserialize_cdr(raw, connection.msgtype)
            assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw), (
                connection.topic
            )
            found.setdefault(connection.topic, []).append(message)
    return found
