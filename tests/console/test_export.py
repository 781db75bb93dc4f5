"""ruedo export: the MCAP file is whole by the mcap package's reader, and says what the log says."""

import base64
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import lcm
import pytest
from mcap.reader import SeekingReader, make_reader
from mcap.stream_reader import StreamReader

SOURCE = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
RUEDO = BUILD / "bin" / "ruedo"
sys.path.insert(0, str(BUILD / "python"))

# A robot beside a wall, a scan straight ahead: what there is to see is known. The mast carries the
# scanner.
WORLD = """<?xml version="1.0"?><sdf version="1.9" xmlns:ruedo="http://ruedo/schema"><world name="wall">
<include><uri>model://ground_plane</uri></include><include><uri>model://p3at</uri><pose>1 2 0 0 0 1.5707963267948966</pose></include>
<model name="wall"><static>true</static><pose>1 6 0.5 0 0 0</pose><link name="link"><collision name="c"><geometry><box><size>20 0.5 1</size></box></geometry></collision>
<visual name="v"><geometry><box><size>20 0.5 1</size></box></geometry><material><diffuse>0.2 0.4 0.6 1</diffuse></material></visual></link></model>
</world></sdf>"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    (folder / "wall.sdf").write_text(WORLD)
    subprocess.run(
        [
            RUEDO,
            "run",
            folder / "wall.sdf",
            "--lcm",
            "memq://",
            "--quiet",
            "--rate",
            "max",
            "--duration",
            "4",
            "--no-noise",
            "--record",
            folder / "run.lcm",
        ],
        check=True,
        timeout=120,
    )
    done = subprocess.run(
        [RUEDO, "export", folder / "run.lcm", folder / "run.mcap"],
        check=True,
        timeout=120,
        capture_output=True,
        text=True,
    )
    assert "left out" not in done.stdout and done.stderr == ""
    return folder


def messages(path):
    """{topic: [(schema name, log time in ns, value)]}"""
    found = {}
    with open(path, "rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
            found.setdefault(channel.topic, []).append(
                (schema.name, message.log_time, json.loads(message.data))
            )
    return found


@pytest.fixture(scope="module")
def topics(exported):
    return messages(exported / "run.mcap")


def events(folder, channel):
    return [event for event in lcm.EventLog(str(folder / "run.lcm")) if event.channel == channel]


def fits(schema, value, path="$"):
    """Whether a value is what its JSON Schema says: of the words that are used here."""
    kind = schema["type"]
    if kind == "object":
        assert isinstance(value, dict) and set(value) <= set(schema["properties"]), (
            path,
            set(value) - set(schema["properties"]),
        )
        for name, each in value.items():
            fits(schema["properties"][name], each, f"{path}.{name}")
    elif kind == "array":
        assert isinstance(value, list), path
        for each in value:
            fits(schema["items"], each, f"{path}[]")
    elif kind == "string":
        assert isinstance(value, str), path
        if schema.get("contentEncoding") == "base64":
            base64.b64decode(value, validate=True)
    elif kind == "integer":
        assert (
            isinstance(value, int)
            and not isinstance(value, bool)
            and schema.get("minimum", -math.inf) <= value <= schema.get("maximum", math.inf)
        ), path
    else:
        assert (
            isinstance(value, bool)
            if kind == "boolean"
            else isinstance(value, (int, float)) and not isinstance(value, bool)
        ), path


def test_the_container_is_whole(exported):
    """Every checksum, the order of records, and a summary that says what is there."""
    with open(exported / "run.mcap", "rb") as stream:
        records = list(StreamReader(stream, validate_crcs=True).records)  # data section and chunks
        counted = sum(type(record).__name__ == "Message" for record in records)
        stream.seek(0)
        reader = SeekingReader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert reader.get_header().library.startswith("Ruedo")
    assert summary.statistics.message_count == counted > 500
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) > 0  # of 4 MiB
    assert sum(summary.statistics.channel_message_counts.values()) == counted
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (
        0,
        4_000_000_000,
    )
    names = [type(record).__name__ for record in records]
    assert names[0] == "Header" and names[-1] == "Footer" and names.count("DataEnd") == 1
    # The checksum of the summary, which this reader does not look at.
    import struct
    import zlib

    data = (exported / "run.mcap").read_bytes()
    (begin,) = struct.unpack_from("<Q", data, len(data) - 28)
    assert (
        zlib.crc32(data[begin : len(data) - 12])
        == struct.unpack_from("<I", data, len(data) - 12)[0]
    )


def test_a_moment_is_found_by_the_index(exported):
    with open(exported / "run.mcap", "rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True)
        found = [
            message.log_time
            for _, _, message in reader.iter_messages(
                ["p3at/pose"], starting_at=1_000_000_000, ending_before=1_100_000_000
            )
        ]
    assert found == [1_000_000_000 + 20_000_000 * i for i in range(5)]  # 50 Hz


def test_messages_are_as_their_schemas_say(exported):
    with open(exported / "run.mcap", "rb") as stream:
        for schema, _, message in make_reader(stream).iter_messages():
            described = json.loads(schema.data)
            assert described["title"] in (schema.name, schema.name.removeprefix("ruedo."))
            fits(described, json.loads(message.data))


def test_a_scan(exported, topics):
    from ruedo.lcmtypes import planar_lidar_t

    scans = topics["p3at/lrf"]
    logged = events(exported, "p3at/lrf")
    assert len(scans) == len(logged) and {name for name, _, _ in scans} == {"foxglove.LaserScan"}
    _, time_ns, scan = scans[3]
    truth = planar_lidar_t.decode(logged[3].data)
    assert time_ns == logged[3].timestamp * 1000 and scan["timestamp"] == {
        "sec": time_ns // 10**9,
        "nsec": time_ns % 10**9,
    }
    assert scan["ranges"] == pytest.approx(list(truth.ranges), rel=1e-6)
    assert scan["start_angle"] == pytest.approx(truth.rad0) and scan["end_angle"] == pytest.approx(
        truth.rad0 + (truth.nranges - 1) * truth.radstep
    )
    assert any(math.isinf(value) for value in scan["ranges"]) == any(
        math.isinf(value) for value in truth.ranges
    )
    # The ray straight ahead ends at the wall's face, 3.75 m before the robot: what the frames say,
    # end to end.
    frames = {each["child_frame_id"]: each for each in topics["ruedo/frames"][0][2]["transforms"]}
    mount = frames["p3at/lrf"]
    assert mount["parent_frame_id"] == "p3at"
    ahead = scan["ranges"][round(-scan["start_angle"] / truth.radstep)]
    assert mount["translation"]["x"] + ahead == pytest.approx(3.75, abs=0.01)


def test_poses_and_frames(exported, topics):
    from ruedo.lcmtypes import pose_t

    name, _, pose = topics["p3at/pose"][-1]
    truth = pose_t.decode(events(exported, "p3at/pose")[-1].data)
    assert name == "foxglove.PoseInFrame" and pose["frame_id"] == "world"
    assert [pose["pose"]["position"][k] for k in "xyz"] == list(truth.pos)
    assert [pose["pose"]["orientation"][k] for k in "wxyz"] == list(truth.orientation)
    assert pose["pose"]["position"]["x"] == pytest.approx(1, abs=1e-3) and pose["pose"]["position"][
        "y"
    ] == pytest.approx(2, abs=1e-3)
    assert topics["p3at/pose/values"][-1][2]["vel"] == pytest.approx(list(truth.vel))
    name, _, odometry = topics["p3at/odometry"][-1]
    assert (
        name == "foxglove.PoseInFrame"
        and odometry["frame_id"] == "p3at/odom"
        and odometry["pose"]["position"]["x"] == pytest.approx(0, abs=1e-3)
    )
    # odom is where the robot began, turned by a quarter.
    name, _, first = topics["ruedo/frames"][0]
    frames = {each["child_frame_id"]: each for each in first["transforms"]}
    assert name == "foxglove.FrameTransforms" and frames["p3at/odom"]["parent_frame_id"] == "world"
    assert frames["p3at/odom"]["rotation"]["w"] == pytest.approx(math.cos(math.pi / 4)) and frames[
        "p3at/odom"
    ]["translation"]["y"] == pytest.approx(2, abs=1e-6)
    # The robot's frame hangs on its body's, and that one moves.
    body = frames["p3at"]["parent_frame_id"]
    moving = topics["ruedo/world"][-1][2]["transforms"]
    assert [each["parent_frame_id"] for each in moving if each["child_frame_id"] == body] == [
        "world"
    ]


def test_pictures(exported, topics):
    from ruedo.lcmtypes import camera_info_t, image_t

    name, _, picture = topics["p3at/camera"][5]
    truth = image_t.decode(events(exported, "p3at/camera")[5].data)
    assert (
        name == "foxglove.CompressedImage"
        and picture["format"] == "jpeg"
        and picture["frame_id"] == "p3at/camera/optical"
    )
    assert base64.b64decode(picture["data"]) == bytes(truth.data) and bytes(truth.data).startswith(
        b"\xff\xd8\xff"
    )
    name, _, camera = topics["p3at/camera/info"][5]
    intrinsics = camera_info_t.decode(events(exported, "p3at/camera/info")[5].data)
    assert name == "foxglove.CameraCalibration" and camera["width"] == intrinsics.width
    assert camera["K"] == [
        intrinsics.fx,
        0,
        intrinsics.cx,
        0,
        intrinsics.fy,
        intrinsics.cy,
        0,
        0,
        1,
    ]
    frames = {each["child_frame_id"]: each for each in topics["ruedo/frames"][0][2]["transforms"]}
    q = frames["p3at/camera/optical"]["rotation"]
    # z of the optical frame is x of the device's, and x of it points to the right, which is -y.
    w, x, y, z = (q[k] for k in "wxyz")
    assert (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)) == (1, 0, 0)
    assert (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)) == (0, -1, 0)


def test_the_scene(topics):
    assert {name for name, _, _ in topics["ruedo/scene"]} == {"foxglove.SceneUpdate"}
    entities = {
        entity["id"]: entity
        for _, _, update in topics["ruedo/scene"]
        for entity in update["entities"]
    }
    wall = entities["wall/link"]
    assert wall["frame_id"] == "world" and wall["lifetime"] == {"sec": 0, "nsec": 0}
    points = [point for part in wall["triangles"] for point in part["points"]]
    for axis, low, high in (("x", -9, 11), ("y", 5.75, 6.25), ("z", 0, 1)):
        assert (
            min(point[axis] for point in points),
            max(point[axis] for point in points),
        ) == pytest.approx((low, high), abs=1e-4)
    assert wall["triangles"][0]["color"] == pytest.approx({"r": 0.2, "g": 0.4, "b": 0.6, "a": 1})
    for part in wall["triangles"]:
        assert len(part["indices"]) % 3 == 0 and max(part["indices"]) < len(part["points"])
    assert any(entity["frame_id"].startswith("p3at/") for entity in entities.values())


def test_everything_else_goes_along(exported, topics):
    from ruedo.lcmtypes import log_header_t, sonar_t

    for channel in {event.channel for event in lcm.EventLog(str(exported / "run.lcm"))}:
        assert len(topics[channel]) == len(events(exported, channel)), channel
    name, _, sonar = topics["p3at/sonar_front"][7]
    truth = sonar_t.decode(events(exported, "p3at/sonar_front")[7].data)
    assert (
        name == "ruedo.sonar_t"
        and sonar["range"] == pytest.approx(list(truth.range), rel=1e-6)
        and sonar["fresh"] == list(truth.fresh)
    )
    assert sonar["fired_utime"] == list(truth.fired_utime)
    header = log_header_t.decode(events(exported, "ruedo/header")[0].data)
    assert topics["ruedo/header"][0][2]["files"] == [
        {"path": each.path, "sha256": each.sha256} for each in header.files
    ]


def test_logs_that_are_cut_off_or_strange(exported, tmp_path):
    whole = (exported / "run.lcm").read_bytes()
    begin = whole.index(b"\xed\xa1\xda\x01", len(whole) // 2)  # of an event
    (tmp_path / "cut.lcm").write_bytes(whole[: begin + 3])
    done = subprocess.run(
        [RUEDO, "export", tmp_path / "cut.lcm", tmp_path / "cut.mcap"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0 and "cut off" in done.stderr
    assert len(messages(tmp_path / "cut.mcap")["p3at/lrf"]) > 3
    import struct

    def event(channel, data):
        return struct.pack("!IqqII", 0xEDA1DA01, 0, -5, len(channel), len(data)) + channel + data

    (tmp_path / "odd.lcm").write_bytes(
        event(b"a\xff", b"")
        + event(b"b", os.urandom(999))
        + event(b"p3at/pose", events(exported, "p3at/pose")[0].data)
    )
    done = subprocess.run(
        [RUEDO, "export", tmp_path / "odd.lcm", tmp_path / "odd.mcap"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (
        done.returncode == 0
        and "2 of types that are not known, or damaged, are left out" in done.stdout
        and "no ruedo/header" in done.stderr
    )
    assert list(messages(tmp_path / "odd.mcap")) == ["p3at/pose", "p3at/pose/values"]


def test_an_impossible_request_is_reported(exported, tmp_path):
    log = exported / "run.lcm"
    (tmp_path / "no.lcm").write_bytes(b"hello")
    for arguments, code, words in (
        ([tmp_path / "no.lcm", tmp_path / "out.mcap"], 3, "is not an LCM log"),
        ([tmp_path / "none.lcm", tmp_path / "out.mcap"], 3, "no such file"),
        ([log, log], 2, "OUT is the same file as LOG"),
        ([log, tmp_path / "no" / "out.mcap"], 4, "cannot be written"),
        ([log, "/dev/full"], 4, "cannot be written"),
    ):
        done = subprocess.run(
            [RUEDO, "export", *arguments], capture_output=True, text=True, timeout=120
        )
        assert done.returncode == code and words in done.stderr, (done.returncode, done.stderr)
    assert not (tmp_path / "out.mcap").exists() and log.read_bytes().startswith(b"\xed\xa1\xda\x01")
    assert os.path.exists("/dev/full")


def test_it_is_listed():
    assert (
        "export"
        in subprocess.run([RUEDO, "--help"], capture_output=True, text=True, timeout=20).stdout
    )


def test_a_fix_is_a_place_on_the_map(tmp_path):
    """By hand: tests/bridges/ros2/instruments.sdf lies at 45 degrees north, 8 east, 110 m high."""
    world, log, out = (
        SOURCE / "tests/bridges/ros2/instruments.sdf",
        tmp_path / "i.lcm",
        tmp_path / "i.mcap",
    )
    quiet = ["--lcm", "memq://", "--quiet", "--rate", "max", "--duration", "1", "--no-noise"]
    subprocess.run([RUEDO, "run", world, *quiet, "--record", log], check=True, timeout=120)
    subprocess.run([RUEDO, "export", log, out], check=True, timeout=120, capture_output=True)
    with open(out, "rb") as file:
        fixes = [
            json.loads(message.data)
            for schema, _, message in make_reader(file).iter_messages()
            if schema.name == "foxglove.LocationFix"
        ]
    assert fixes
    for fix in fixes:
        assert fix["latitude"] == pytest.approx(45, abs=1e-12)
        assert fix["longitude"] == pytest.approx(8, abs=1e-12)
        assert fix["altitude"] == pytest.approx(110, abs=1e-8)
        assert fix["frame_id"].endswith("/gps") and fix["position_covariance"] == [0] * 9
        assert fix["position_covariance_type"] == 0


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """A log in which a client drew: one of each kind along with a robot, then fewer in the world,
    then nothing.
    """
    import ruedo

    folder = tmp_path_factory.mktemp("drawn")
    (folder / "wall.sdf").write_text(WORLD)
    made = ruedo.markers
    arguments = ["--disable", "p3at/camera", "--record", str(folder / "run.lcm")]
    with ruedo.launch(folder / "wall.sdf", args=arguments) as sim:
        sim.sleep(0.1)
        square = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
        lines = made.lines(square, (1, 0.5, 0, 0.5), 0.125)
        lines.position, lines.orientation = [1, 2, 3], [math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
        points = made.points([[0, 0, 0.5], [1, 2, 3]], (0, 1, 0), 0.5)
        points.position = [1, 0, 0]
        sim.markers(
            "all",
            [
                lines,
                made.path(square, (1, 1, 0), 0.25),
                points,
                made.text("goal", (0, 1, 0.5), (1, 1, 1), 0.5),
                made.map([[100, 100, 0], [0, -1, 50]], 0.25, (1, -0.5), color=(0.5, 0, 1)),
            ],
            frame="p3at",
        )
        sim.sleep(0.1)
        sim.markers("all", [made.points([[1, 0]])])
        sim.markers("other", [made.points([[1, 0]])])
        sim.sleep(0.1)
        sim.markers("all")
        sim.sleep(0.1)
    return folder


def places_of(primitive):
    """Its points, in the frame of its entity: by its pose, with the conjugation of a quaternion."""
    turn, at = primitive["pose"]["orientation"], primitive["pose"]["position"]
    x, y, z, w = (turn[name] for name in "xyzw")
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return [
        tuple(
            round(at[name] + sum(r * p[axis] for r, axis in zip(row, "xyz", strict=True)), 6)
            for name, row in zip("xyz", rows, strict=True)
        )
        for p in primitive["points"]
    ]


def test_a_foxglove_file_has_the_drawings_of_clients(drawn):
    subprocess.run(
        [RUEDO, "export", drawn / "run.lcm", drawn / "run.mcap"], check=True, timeout=120
    )
    updates = [value for name, _, value in messages(drawn / "run.mcap")["ruedo/markers"]]
    assert [len(update["entities"]) for update in updates] == [1, 1, 1, 0]
    (everything,) = updates[0]["entities"]
    assert (everything["frame_id"], everything["id"]) == ("p3at", "all")
    lines, path = everything["lines"]
    assert (lines["type"], path["type"]) == (2, 0)  # a list, a strip
    assert (lines["thickness"], path["thickness"]) == (0.125, 0.25)
    assert lines["color"] == {"r": 1, "g": 0.5, "b": 0, "a": 0.5}
    # turned by a quarter about the place
    assert places_of(lines) == [(2, 1, 3), (2, 3, 3), (0, 3, 3), (0, 1, 3)]
    balls = everything["spheres"]
    assert [tuple(ball["pose"]["position"].values()) for ball in balls] == [(1, 0, 0.5), (2, 2, 3)]
    assert balls[0]["size"] == {"x": 0.5, "y": 0.5, "z": 0.5}
    (text,) = everything["texts"]
    assert (text["text"], text["font_size"], text["billboard"]) == ("goal", 0.5, True)
    (cells,) = everything["triangles"]
    # two occupied cells in one, one unknown, one half; the clear ones are left out
    assert len(cells["points"]) == len(cells["colors"]) == 12 and len(cells["indices"]) == 18
    at = places_of(cells)
    assert at[:4] == [(1, -0.5, 0), (1.5, -0.5, 0), (1.5, -0.25, 0), (1, -0.25, 0)]
    assert at[4:6] == [(1.25, -0.25, 0), (1.5, -0.25, 0)]
    colors = [tuple(cells["colors"][i].values()) for i in (0, 4, 8)]
    assert colors == [(0.5, 0, 1, 1), (0.5, 0.5, 0.5, 0.25), (0.5, 0, 1, 0.5)]
    assert updates[1]["entities"][0]["frame_id"] == "world"
    assert [gone["id"] for gone in updates[3]["deletions"]] == ["all"]
    with open(drawn / "run.mcap", "rb") as stream:
        for schema, _channel, message in make_reader(stream).iter_messages(["ruedo/markers"]):
            assert schema.name == "foxglove.SceneUpdate"
            fits(json.loads(schema.data), json.loads(message.data))


def test_a_bag_has_the_drawings_of_clients(drawn):
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    said = subprocess.run(
        [RUEDO, "export", drawn / "run.lcm", "--ros2", drawn / "bag"],
        check=True,
        timeout=120,
        capture_output=True,
        text=True,
    )
    assert said.stderr == ""
    arrays = []
    with Reader(drawn / "bag") as reader:
        (topic,) = [c for c in reader.connections if c.topic == "/markers"]
        assert topic.digest == store.hash_rihs01("visualization_msgs/msg/MarkerArray")
        for _, _, raw in reader.messages([topic]):
            array = store.deserialize_cdr(raw, topic.msgtype)
            assert bytes(store.serialize_cdr(array, topic.msgtype)) == bytes(raw)
            arrays.append(array.markers)
    first = arrays[0]
    assert [(m.ns, m.id, m.type, m.action) for m in first] == [
        ("all", i, kind, 0) for i, kind in enumerate([5, 4, 7, 9, 6])
    ]
    lines, path, points, text, cells = first
    assert {m.header.frame_id for m in first} == {"base_link"} and lines.frame_locked
    assert (lines.pose.position.x, lines.pose.position.z) == (1, 3)
    assert lines.pose.orientation.z == pytest.approx(math.sqrt(0.5))
    assert [(p.x, p.y, p.z) for p in lines.points] == [
        (-1, -1, 0),
        (1, -1, 0),
        (1, 1, 0),
        (-1, 1, 0),
    ]
    assert [m.scale.x for m in (lines, path, points, cells)] == [0.125, 0.25, 0.5, 0.25]
    assert (text.text, text.scale.z, text.pose.position.y) == ("goal", 0.5, 1)
    assert [(p.x, p.y) for p in cells.points] == [
        (0.125, 0.125),
        (0.375, 0.125),
        (0.375, 0.375),
        (0.625, 0.375),
    ]
    assert [(c.r, c.a) for c in cells.colors] == [(0.5, 1), (0.5, 1), (0.5, 0.25), (0.5, 0.5)]
    # Removed things are deleted.
    assert [(m.id, m.action) for m in arrays[1]] == [(0, 0), (1, 2), (2, 2), (3, 2), (4, 2)]
    assert arrays[1][0].header.frame_id == "world"
    assert [(m.ns, m.id, m.action) for m in arrays[3]] == [("all", 0, 2)]
    # `play` makes the log from the bag again, with what was drawn once.
    page = drawn / "bag.html"
    subprocess.run([RUEDO, "play", drawn / "bag", "--html", page], check=True, timeout=100)
    assert page.stat().st_size > 100_000
