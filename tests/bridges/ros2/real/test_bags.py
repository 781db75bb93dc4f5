"""Bags: what rclpy hears is what `ruedo export --ros2` writes, and rosbags keeps both in either of
rosbag2's formats.
"""

from __future__ import annotations

import os
import subprocess

import pytest
from conftest import LATCHED
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState, LaserScan
from server import PATIENCE, RUEDO, Run
from std_msgs.msg import String
from test_topics import kind_of

TOPICS = {"/scan": LaserScan, "/odom": Odometry, "/joint_states": JointState}


def export(log, folder):
    command = [RUEDO, "export", log, "--ros2", folder, "--distro", os.environ["ROS_DISTRO"]]
    free = {n: v for n, v in os.environ.items() if n != "LD_LIBRARY_PATH"}
    subprocess.run(command, env=free, check=True, timeout=PATIENCE, capture_output=True)


def contents(folder):
    """{topic: {its messages' bytes}}, and {topic: (type, hash)}."""
    found, types = {}, {}
    with Reader(folder) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(bytes(raw))
            types[connection.topic] = connection.msgtype, connection.digest
    return found, types


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The folder of a bag that was exported, and what a node heard meanwhile."""
    folder = tmp_path_factory.mktemp("bags")
    with Run("--no-noise", "--disable", "p3at/camera", "--record", str(folder / "log")) as run:
        from conftest import Peer

        peer = Peer(run.domain)
        heard = {topic: peer.hear(kind, topic, raw=True) for topic, kind in TOPICS.items()}
        heard["/robot_description"] = peer.hear(String, "/robot_description", LATCHED, raw=True)
        peer.spin_until(lambda: all(len(m) >= 10 for t, m in heard.items() if t in TOPICS), "all")
        peer.close()
    export(folder / "log", folder / "bag")
    return folder, heard


def test_a_bag_has_the_bytes_that_were_on_the_wire(recorded):
    folder, heard = recorded
    bag, _ = contents(folder / "bag")
    for topic, messages in heard.items():
        assert messages and set(messages) <= set(bag[topic]), topic


def test_ros_decodes_each_message_of_a_bag(recorded):
    folder, _ = recorded
    bag, types = contents(folder / "bag")
    assert set(TOPICS) < set(bag)
    for topic, messages in bag.items():
        kind = kind_of(types[topic][0])
        for raw in messages:
            message = deserialize_message(raw, kind)
            # Not the bytes: Fast DDS pads with what was in its memory.
            assert deserialize_message(serialize_message(message), kind) == message, topic


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_either_format_keeps_what_was_heard(recorded, tmp_path, plugin):
    _, heard = recorded
    store = get_typestore(getattr(Stores, f"ROS2_{os.environ['ROS_DISTRO'].upper()}"))
    with Writer(tmp_path / "bag", version=9, storage_plugin=plugin) as writer:
        for topic in TOPICS:
            kind = TOPICS[topic]
            name = f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
            connection = writer.add_connection(topic, name, typestore=store)
            for i, raw in enumerate(heard[topic]):
                writer.write(connection, i, raw)
    bag, _ = contents(tmp_path / "bag")
    assert bag == {topic: heard[topic] for topic in TOPICS}
    for topic, kind in TOPICS.items():
        for raw in bag[topic]:
            ours = deserialize_message(raw, kind)
            name = f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
            theirs = store.deserialize_cdr(raw, name)
            assert (ours.header.stamp.sec, ours.header.frame_id) == (
                theirs.header.stamp.sec,
                theirs.header.frame_id,
            )
