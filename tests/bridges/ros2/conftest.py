"""`ruedo run --ros2` and an independent peer: the PyPI package cyclonedds, with types written from
the ROS interfaces.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from server import PATIENCE, RUEDO, wait_for


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
