"""`ruedo export --ros2`: bags that rosbags and mcap-ros2-support read message by message equal to
the log.
"""

from __future__ import annotations

import math
import os
import random
import resource
import shutil
import subprocess
import tempfile
from pathlib import Path

import lcm
import mcap.writer
import pytest
import ruedo as ruedo_client
import zstandard
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg
from ruedo import lcmtypes
from stores import store_of

SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[3]))
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


def test_ranges_hold_only_fresh_measurements(logged):
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


# ---- Played again.


def play(*arguments, code=0):
    done = subprocess.run(
        [RUEDO, "play", *map(str, arguments)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == code, done.stderr
    return done


def page(log, to, *arguments):
    done = play(log, "--html", to, "--html-size", "1000", *arguments)
    assert done.stderr == ""
    return to.read_bytes()


def refused(bag):
    """What is said of a bag, in one line."""
    line = play(bag, "--html", bag.parent / "no.html", code=3).stderr
    assert len(line.splitlines()) == 1 and line.startswith(f"ruedo: {bag}")
    assert not (bag.parent / "no.html").exists()
    return line


def events(log):
    """{channel: [(us, bytes)]}; within a step channels have no order among each other."""
    found = {}
    for event in lcm.EventLog(str(log), "r"):
        found.setdefault(event.channel, []).append((event.timestamp, event.data))
    return found


def shown(bag, folder):
    """The events that the console shows of a bag: of the log that `play` makes of it meanwhile."""
    folder.mkdir()
    environment = {**os.environ, "TMPDIR": str(folder)}
    command = [RUEDO, "play", bag, "--view", "127.0.0.1:0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        try:
            assert process.stdout.readline().startswith("View it at ")
            (log,) = folder.glob("ruedo-bag-*/run/*.lcm")
            found = events(log)
        finally:
            process.terminate()
    assert process.returncode == 0 and list(folder.iterdir()) == []
    return found


def test_the_console_shows_of_a_bag_what_it_shows_of_the_log(logged, tmp_path):
    """Every message, byte for byte; and the page of it is as large, scene and all."""
    of_log = page(logged / "run.lcm", tmp_path / "log.html")
    for i, bag in enumerate((logged / "run", f"{logged}/run/", logged / "run/run_0.mcap")):
        assert shown(bag, tmp_path / str(i)) == events(logged / "run.lcm")
        of_bag = page(bag, tmp_path / "bag.html")
        assert len(of_bag) == pytest.approx(len(of_log), abs=100)  # the name is another one
    with (logged / "run/run_0.mcap").open("rb") as file:
        found = {one.name: one.data for one in make_reader(file).iter_attachments()}
    # Neither scans nor pictures are there twice.
    rest = unpacked(found["run.lcm.zst"])
    assert {"p3at/lrf", "p3at/camera"}.isdisjoint(log_channels(rest, tmp_path))


def unpacked(data):
    return zstandard.ZstdDecompressor().decompressobj().decompress(data)


def log_channels(data, folder):
    (folder / "rest.lcm").write_bytes(data)
    return events(folder / "rest.lcm").keys()


def test_raw_pictures_and_several_robots(tmp_path):
    log, bag = tmp_path / "run.lcm", tmp_path / "run"
    options = ["--set", "p3at/camera.ruedo:encoding=rgb", "--spawn", "p3at:other@0,3"]
    options += ["--rate", "max", "--duration", "1", "--lcm", "auto"]
    ruedo("run", SOURCE / "worlds/arena.sdf", "--record", log, *options)
    ruedo("export", log, "--ros2", bag)
    found = shown(bag, tmp_path / "temporary")
    assert found == events(log) and {"p3at/camera", "other/camera"} < found.keys()


def test_odometry_has_the_sideways_speed_and_its_covariance(tmp_path):
    (tmp_path / "w.sdf").write_text(
        "<sdf version='1.9'><world name='w'><model name='ground'><static>1</static><link name='l'>"
        "<collision name='c'><geometry><plane/></geometry></collision></link></model>"
        "<model name='h'><pose>0 0 0.1 0 0 0</pose><link name='base'><collision name='c'><geometry>"
        "<box><size>.3 .3 .2</size></box></geometry></collision></link>"
        "<ruedo:odometry><ruedo:slip_noise>0.01</ruedo:slip_noise></ruedo:odometry>"
        "<plugin name='p' filename='libgazebo_ros_planar_move.so'/></model></world></sdf>"
    )
    run = tmp_path / "run.lcm"
    with ruedo_client.launch(tmp_path / "w.sdf", args=["--lockstep", "1", "--record", run]) as sim:
        sim.step(50, [sim.robot("h").velocity_command(0.0, 0.0, 0.3)])
    ruedo("export", run, "--ros2", tmp_path / "bag")
    messages = bag_messages(tmp_path / "bag", store_of("jazzy"))["/odom"]
    last = [m.twist for _, m in messages if m.twist.twist.linear.y != 0.0][-1]
    assert last.twist.linear.y == pytest.approx(0.3, abs=0.2)  # the slip of a step is 0.08 m/s
    # 0.01^2 (0.3 m/s 0.005 s) / (0.005 s)^2
    assert last.covariance[7] == pytest.approx(0.006, rel=1e-6)
    assert sum(last.covariance) == last.covariance[7]


def test_a_bag_has_its_world_with_it(tmp_path):
    """On another machine the world's files are not there."""
    home = tmp_path / "home"
    shutil.copytree(SOURCE / "worlds/robots/p3at", home / "models/rover")
    (home / "hall.sdf").write_text(
        "<sdf version='1.9'><world name='hall'><include><uri>models/rover</uri><name>r</name></include>"
        "<model name='box'><static>true</static><pose>2 0 0.5 0 0 0</pose><link name='l'><collision "
        "name='c'><geometry><box><size>1 1 1</size></box></geometry></collision></link></model></world></sdf>"
    )
    log, bag = tmp_path / "run.lcm", tmp_path / "run"
    ruedo(
        "run",
        home / "hall.sdf",
        "--rate",
        "max",
        "--duration",
        "1",
        "--record",
        log,
        "--lcm",
        "auto",
        "--disable",
        "r/camera",
    )
    ruedo("export", log, "--ros2", bag)
    of_log = page(log, tmp_path / "log.html")
    shutil.rmtree(home)
    shutil.move(bag, tmp_path / "elsewhere/run")
    there = page(tmp_path / "elsewhere/run", tmp_path / "bag.html")
    assert b"box" in there and len(there) == pytest.approx(len(of_log), rel=0.001)
    assert "cannot be shown" in play(log, "--html", tmp_path / "no.html").stderr


def test_a_bag_of_another_program_has_no_scene(tmp_path):
    store = store_of("jazzy")
    for storage in (StoragePlugin.MCAP, StoragePlugin.SQLITE3):
        bag = tmp_path / storage.name
        with Writer(bag, version=9, storage_plugin=storage) as writer:
            text = store.types["std_msgs/msg/String"]
            topic = writer.add_connection("/talk", text.__msgtype__, typestore=store)
            writer.write(topic, 1, store.serialize_cdr(text("hello"), text.__msgtype__))
        line = refused(bag)
        assert (
            "sqlite3" if storage is StoragePlugin.SQLITE3 else "holds no run of Ruedo's"
        ) in line
    (tmp_path / "empty").mkdir()
    assert "is a folder; allowed is a log, or a ROS 2 bag" in refused(tmp_path / "empty")


def test_a_compressed_one_says_how_it_is_read(tmp_path):
    with (tmp_path / "run.mcap").open("wb") as file:
        writer = mcap.writer.Writer(file, compression=mcap.writer.CompressionType.LZ4)
        writer.start()
        channel = writer.register_channel("/a", "cdr", writer.register_schema("a", "ros2msg", b""))
        writer.add_message(channel, 1, b"1234" * 100, 1)
        writer.finish()
    assert "is compressed by lz4; allowed is zstd" in refused(tmp_path / "run.mcap")


def test_chunks_are_compressed(logged):
    """By the library mcap; each unpacks to the size and the CRC-32 that it names."""
    with (logged / "run/run_0.mcap").open("rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
        assert chunks and all(chunk.compression == "zstd" for chunk in chunks)
        assert all(chunk.compressed_size < chunk.uncompressed_size for chunk in chunks)
        assert list(make_reader(file, validate_crcs=True).iter_messages())


MAGIC = b"\x89MCAP0\r\n"


def test_damaged_bags_end_in_one_line(logged, tmp_path):
    """Cut off at any byte, and with any byte another one: said, or shown as far as it goes."""
    whole = (logged / "run/run_0.mcap").read_bytes()
    bad = tmp_path / "bad.mcap"
    summary = int.from_bytes(whole[-28:-20], "little")  # its place; what is behind is not read
    for share in (0.0001, 0.01, 0.3, 0.9, 0.9999):
        bad.write_bytes(whole[: int(share * summary)])
        assert " at byte " in refused(bad)
    chance = random.Random(1)
    for place in [8, 9, 16, *(chance.randrange(len(whole)) for _ in range(12))]:
        bad.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        done = subprocess.run(
            [RUEDO, "play", bad, "--html", tmp_path / "page.html"],
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert done.returncode in (0, 3) and len(done.stderr.splitlines()) <= 1, place
        assert done.stderr == "" or str(bad) in done.stderr or "ruedo-bag-" in done.stderr


@pytest.mark.parametrize("operation", [3, 4, 5, 6])  # schema, channel, message, chunk
def test_a_record_that_no_bag_has_takes_no_memory(operation, tmp_path):
    """Sparse: on the disk it takes no room either. A chunk ends with a message, the largest of
    which is a picture of 8192 x 8192 pixels."""
    most = 2 * (8192 * 8192 * 4 + 65536)
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(MAGIC + bytes([operation]) + (most + 1).to_bytes(8, "little"))
    os.truncate(bad, 17 + most + 1)
    line = refused(bad)
    assert f"has a record of {most + 1} bytes (at most {most} are allowed) at byte 8" in line


def attachments(bag, *parts):
    """A bag of attachments alone: (name, their first bytes, how many more, of which the disk has
    none)."""
    with bag.open("wb") as file:
        file.write(MAGIC)
        for name, data, more in parts:
            size = len(data) + more
            head = bytes(16) + len(name).to_bytes(4, "little") + name.encode() + bytes(4)
            head += size.to_bytes(8, "little")
            file.write(b"\x09" + (len(head) + size + 4).to_bytes(8, "little") + head + data)
            file.truncate(file.tell() + more + 4)
            file.seek(0, os.SEEK_END)
        file.write(b"\x0f" + bytes(8))


def test_attachments_take_no_more_of_the_disk_than_a_bag_may(tmp_path):
    """Sparse: in the bag they take no room. What cannot be written is not written on."""
    bad = tmp_path / "bad.mcap"
    attachments(bad, ("one", b"", (16 << 30) + 1))
    assert f"has attachments of more than {16 << 30} bytes in all" in refused(bad)
    attachments(bad, ("one", b"1", 0), ("two", b"", 16 << 30))
    assert f"has attachments of more than {16 << 30} bytes in all" in refused(bad)
    attachments(bad, *((f"{number}", b"", 0) for number in range(10_002)))
    assert "has more than 10001 attachments" in refused(bad)
    attachments(bad, ("one", b"", 15 << 30))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    full = subprocess.run(
        ["bash", "-c", 'ulimit -f 100 && exec "$0" play "$1" --html "$2"', RUEDO, bad, "no.html"],
        capture_output=True,
        text=True,
        timeout=600,
        cwd=tmp_path,
    )
    assert full.returncode == 4 and "cannot be written: File too large" in full.stderr, full
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert len(full.stderr.splitlines()) == 1
    assert used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime < 5


def test_a_packed_log_that_is_damaged(logged, tmp_path):
    bad = tmp_path / "bad.mcap"
    with (logged / "run/run_0.mcap").open("rb") as file:
        (good,) = (
            one.data for one in make_reader(file).iter_attachments() if one.name == "run.lcm.zst"
        )
    attachments(bad, ("run.lcm.zst", good[:-100], 0))
    assert "has an attachment that is cut off (zstd)" in refused(bad)
    attachments(bad, ("run.lcm.zst", b"run.lcm", 0))
    assert "has an attachment that is not what was written (zstd)" in refused(bad)


@pytest.mark.parametrize(
    "names",
    [
        ["aa", "aa/b"],
        ["aa/b", "aa"],
        ["a/.."],
        ["a/b/"],
        ["a" * 300],
        ["d/" * 65 + "x"],
        ["d/" * 3000 + "x"],
        ["bad.lcm/x"],  # where the log will be
    ],
)
def test_attachments_of_a_name_that_no_file_has(names, tmp_path):
    bad = tmp_path / "bad.mcap"
    attachments(bad, *((name, b"1", 0) for name in names))
    line = refused(bad)
    assert "has an attachment '" in line and "allowed are names of files" in line


def test_names_take_no_more_memory_than_names_need(tmp_path):
    bad = tmp_path / "bad.mcap"
    size = 40 << 20
    with bad.open("wb") as file:
        file.write(MAGIC)
        for number in (1, 1, 2):  # the same one again takes no more
            at = file.tell()
            file.write(b"\x03" + size.to_bytes(8, "little") + number.to_bytes(2, "little"))
            file.truncate(at + 9 + size)
            file.seek(at + 9 + size)
    line = refused(bad)
    assert f"has more than {64 << 20} bytes of schemas and channels at byte {at}" in line


def test_other_libraries_read_and_write_attachments(logged, tmp_path):
    """By the library mcap; a name that leads out of the folder is not followed."""
    with (logged / "run/run_0.mcap").open("rb") as file:
        found = {one.name: one.data for one in make_reader(file).iter_attachments()}
    assert found[str(SOURCE / "worlds/arena.sdf")] == (SOURCE / "worlds/arena.sdf").read_bytes()
    found["run.lcm"] = unpacked(found.pop("run.lcm.zst"))  # as earlier versions wrote it
    with (tmp_path / "run.mcap").open("wb") as file:
        writer = mcap.writer.Writer(file, compression=mcap.writer.CompressionType.NONE)
        writer.start()
        for name, data in (*found.items(), ("../../ruedo-escaped", b"out"), ("/", b""), ("", b"")):
            writer.add_attachment(0, 0, name, "", data)
        writer.finish()
    assert page(tmp_path / "run.mcap", tmp_path / "page.html")
    assert not (Path(tempfile.gettempdir()) / "ruedo-escaped").exists()


@pytest.mark.parametrize("what", ["run", "run/run_0.mcap"])
def test_commands_that_need_a_log_refuse_a_bag(logged, what):
    result = subprocess.run(
        [RUEDO, "verify", logged / what], capture_output=True, text=True, timeout=120
    )
    assert result.returncode in (2, 3)
    assert "`ros2 bag play --clock`" in result.stderr and len(result.stderr.splitlines()) == 1
