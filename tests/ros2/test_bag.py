"""`ruedo export --ros2`: bags that rosbags and mcap-ros2-support read message by message equal to
the log.
"""

from __future__ import annotations

import math
import os
import subprocess
from pathlib import Path

import lcm
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_types_from_msg
from ruedo import lcmtypes
from stores import store_of

SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[2]))
RUEDO = os.environ.get("RUEDO", str(SOURCE / "build/release/bin/ruedo"))


def ruedo(*arguments) -> str:
    result = subprocess.run(
        [RUEDO, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=600,
    )
    assert result.returncode == 0, result.stdout
    return result.stdout


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bag")
    ruedo(
        "run",
        SOURCE / "worlds/arena.sdf",
        "--rate",
        "max",
        "--duration",
        "2",
        "--record",
        folder / "run.lcm",
        "--lcm",
        "auto",
        "--quiet",
    )
    ruedo("export", folder / "run.lcm", "--ros2", folder / "run")
    return folder


def bag_messages(folder, store):
    """{topic: [(time in us, message)]}"""
    found = {}
    with Reader(folder) as reader:
        for connection, time_ns, raw in reader.messages():
            message = store.deserialize_cdr(raw, connection.msgtype)
            assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw), (
                connection.topic
            )
            found.setdefault(connection.topic, []).append((time_ns // 1000, message))
    return found


TYPES = {
    one._get_packed_fingerprint(): one
    for name, one in vars(lcmtypes).items()
    if name.endswith("_t") and isinstance(one, type)
}


def log_messages(path):
    found = {}
    for event in lcm.EventLog(str(path), "r"):
        found.setdefault(event.channel, []).append(
            (event.timestamp, TYPES[event.data[:8]].decode(event.data))
        )
    return found


def us(stamp) -> int:
    return stamp.sec * 1_000_000 + stamp.nanosec // 1000


def test_rosbags_reads_the_log_message_by_message(logged):
    bag, log = (
        bag_messages(logged / "run", store_of("jazzy")),
        log_messages(logged / "run.lcm"),
    )
    pairs = [
        ("/scan", "p3at/lrf"),
        ("/odom", "p3at/odometry"),
        ("/ground_truth", "p3at/pose"),
        ("/camera_info", "p3at/camera/info"),
        ("/image_raw/compressed", "p3at/camera"),
        ("/sonar_front/sonar", "p3at/sonar_front"),
    ]
    for topic, channel in pairs:
        assert [(t, us(m.header.stamp)) for t, m in bag[topic]] == [
            (t, m.utime) for t, m in log[channel]
        ], topic
    for (_, scan), (_, ours) in zip(bag["/scan"], log["p3at/lrf"]):
        assert list(scan.ranges) == list(ours.ranges) and list(scan.intensities) == list(
            ours.intensities
        )
    for (_, odometry), (_, ours) in zip(bag["/odom"], log["p3at/odometry"]):
        q = odometry.pose.pose.orientation
        assert (odometry.pose.pose.position.x, odometry.pose.pose.position.y) == (ours.x, ours.y)
        assert 2 * math.atan2(q.z, q.w) == pytest.approx(ours.theta, abs=1e-12)
        assert (odometry.twist.twist.linear.x, odometry.twist.twist.angular.z) == (
            ours.v,
            ours.omega,
        )
    for (_, pose), (_, ours) in zip(bag["/ground_truth"], log["p3at/pose"]):
        p, q = pose.pose.pose.position, pose.pose.pose.orientation
        assert (p.x, p.y, p.z, q.w, q.x, q.y, q.z) == (*ours.pos, *ours.orientation)
    for (_, image), (_, ours) in zip(bag["/image_raw/compressed"], log["p3at/camera"]):
        assert bytes(image.data) == ours.data


def test_ranges_are_those_that_were_measured_anew(logged):
    bag, log = (
        bag_messages(logged / "run", store_of("jazzy")),
        log_messages(logged / "run.lcm"),
    )
    for i in range(8):
        fresh = [(m.fired_utime[i], m.range[i]) for _, m in log["p3at/sonar_front"] if m.fresh[i]]
        assert [(us(m.header.stamp), m.range) for _, m in bag[f"/sonar_front/range_{i}"]] == fresh
        assert fresh


def test_hashes_and_definitions_are_those_of_ros(logged):
    store = store_of("jazzy")
    with Reader(logged / "run") as reader:
        for connection in reader.connections:
            assert connection.digest == store.hash_rihs01(connection.msgtype)
            told = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            for name, (_, fields) in told.items():
                assert fields == store.fielddefs[name][1], name


def test_mcap_ros2_support_reads_it(logged):
    log = log_messages(logged / "run.lcm")
    with open(logged / "run/run_0.mcap", "rb") as file:
        decoded = [
            (channel.topic, message)
            for _, channel, _, message in make_reader(
                file, decoder_factories=[DecoderFactory()]
            ).iter_decoded_messages()
        ]
    scans = [message for topic, message in decoded if topic == "/scan"]
    assert [list(s.ranges) for s in scans] == [list(m.ranges) for _, m in log["p3at/lrf"]]
    assert {topic for topic, _ in decoded} >= {"/tf", "/tf_static", "/joint_states", "/image_raw"}


def test_the_humble_of_a_bag_is_humbles(logged):
    ruedo("export", logged / "run.lcm", "--ros2", logged / "humble", "--distro", "humble")
    store = store_of("humble")
    assert len(bag_messages(logged / "humble", store)["/sonar_front/range_0"]) > 0


@pytest.mark.parametrize("distro", ["humble", "iron", "jazzy", "kilted", "lyrical"])
def test_hashes_are_those_of_each_release(logged, distro, tmp_path):
    ruedo("export", logged / "run.lcm", "--ros2", tmp_path / "bag", "--distro", distro)
    store = store_of(distro)
    with open(tmp_path / "bag/bag_0.mcap", "rb") as file:
        summary = make_reader(file).get_summary()
    told = {
        summary.schemas[c.schema_id].name: c.metadata["topic_type_hash"]
        for c in summary.channels.values()
    }
    assert told == {name: store.hash_rihs01(name) for name in told} and len(told) >= 9
    assert len(bag_messages(tmp_path / "bag", store)) == len(summary.channels)


def test_topics_of_a_bag_are_remapped(logged):
    ruedo(
        "export",
        logged / "run.lcm",
        "--ros2",
        f"{logged / 'remapped'}/",
        "--remap",
        "/scan=/front/scan",
    )
    assert "/front/scan" in bag_messages(logged / "remapped", store_of("jazzy"))
    wrong = subprocess.run(
        [RUEDO, "export", logged / "run.lcm", "--ros2", logged / "none", "--remap", "/scam=/x"],
        capture_output=True,
        text=True,
    )
    assert wrong.returncode in (2, 3) and "did you mean '/scan'?" in wrong.stderr
    assert not (logged / "none").exists()


def test_a_folder_that_is_there_is_left_alone(logged):
    (logged / "mine").mkdir()
    result = subprocess.run(
        [RUEDO, "export", logged / "run.lcm", "--ros2", logged / "mine"],
        capture_output=True,
        text=True,
    )
    assert result.returncode in (2, 3) and "is there already" in result.stderr
    assert list((logged / "mine").iterdir()) == []


@pytest.mark.parametrize("what", ["run", "run/run_0.mcap"])
def test_play_says_who_plays_a_bag(logged, what):
    result = subprocess.run(
        [RUEDO, "play", logged / what], capture_output=True, text=True, timeout=120
    )
    assert result.returncode in (2, 3)
    assert "`ros2 bag play --clock`" in result.stderr and len(result.stderr.splitlines()) == 1
