"""Recorded runs in the console: what a viewer gets at each moment, and truncated, odd or invalid
logs.
"""

import json
import math
import os
import struct
import subprocess
import time
from urllib.parse import quote

import pytest
from harness import (
    ARENA,
    PLAY,
    RUEDO,
    SEEK,
    SEEN,
    SOURCE,
    TRAFFIC,
    WANT,
    Socket,
    get,
    playing,
    running,
)


def record(log, world=ARENA, *arguments):
    subprocess.run(
        [
            RUEDO,
            "run",
            world,
            "--lcm",
            "memq://",
            "--quiet",
            "--rate",
            "max",
            "--duration",
            "4",
            "--record",
            log,
            *arguments,
        ],
        check=True,
        timeout=120,
    )
    return log


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return record(tmp_path_factory.mktemp("logs") / "run.lcm", ARENA, "--disable", "p3at/camera")


def greeting(port):
    viewer = Socket(port)
    hello = json.loads(viewer.receive()[1])["hello"]
    return viewer, hello


def texts_until(viewer, member):
    while True:
        opcode, data = viewer.receive()
        told = json.loads(data) if opcode == 1 else {}
        viewer.names = getattr(viewer, "names", []) + told.get("channels", [])
        if member in told:
            return told[member]


def seek(viewer, time_s):
    viewer.send(bytes([PLAY, 0]) + struct.pack("<d", 1.0))
    viewer.send(bytes([SEEK]) + struct.pack("<d", time_s))


def newest(viewer, wanted):
    """{channel: its message}, once each is that of a time: {channel: us}."""
    found = {}
    viewer.names = getattr(viewer, "names", [])
    deadline = time.monotonic() + 20
    while found.keys() != wanted.keys() and time.monotonic() < deadline:
        opcode, data = viewer.receive()
        if opcode == 1:
            viewer.names += json.loads(data).get("channels", [])
        elif data and data[0] == 1:
            viewer.send(bytes([SEEN]))
            at = 4
            while at < len(data):
                index, size = struct.unpack_from("<II", data, at)
                message, name = data[at + 8 : at + 8 + size], viewer.names[index]
                if name in wanted and struct.unpack_from("!q", message, 8)[0] == wanted[name]:
                    found[name] = message
                at += 8 + size
    assert found.keys() == wanted.keys()
    return found


def test_each_channel_shows_its_newest_message_of_a_moment(log):
    import lcm

    events = [(event.channel, event.timestamp, event.data) for event in lcm.EventLog(str(log))]
    with playing(log) as process:
        viewer, hello = greeting(process.port)
        assert hello["mode"] == "log" and hello["title"] == "run.lcm" and hello["fault"] == ""
        viewer.send(bytes([WANT]) + b"p3at/lrf\np3at/odometry")
        for moment in (3.017, 0.5, 2.0, 3.999):
            seek(viewer, moment)
            last = {
                c: (t, d)
                for c, t, d in events
                if c in ("p3at/lrf", "p3at/odometry") and t <= moment * 1e6
            }
            assert newest(viewer, {c: t for c, (t, _) in last.items()}) == {
                c: d for c, (_, d) in last.items()
            }
        # A channel chosen during a pause is shown at once.
        viewer.send(bytes([WANT]) + b"p3at/pose")
        newest(
            viewer,
            {"p3at/pose": [t for c, t, _ in events if c == "p3at/pose" and t <= 3_999_000][-1]},
        )


def test_the_time_line_goes_with_the_log(log):
    with playing(log, "--speed", "2") as process:
        viewer, _ = greeting(process.port)
        playback = texts_until(viewer, "playback")
        assert (playback["begin"], playback["end"], playback["speed"], playback["playing"]) == (
            0,
            4,
            2,
            True,
        )
        seek(viewer, 1e9)
        while playback["now"] != 4:
            playback = texts_until(viewer, "playback")
        seek(viewer, -1e9)
        while playback["now"] != 0:
            playback = texts_until(viewer, "playback")
        assert not playback["playing"]


def test_each_viewer_has_a_moment_of_its_own(tmp_path):
    """A robot comes on the way. Who looks at the time before sees a world without it, while another
    one sees it; when one of them plays, the other's time stands still.
    """
    import lcm
    import ruedo

    log = tmp_path / "run.lcm"
    with (
        running("--disable", "p3at/camera", "--record", log) as process,
        ruedo.connect(timeout=60) as sim,
    ):
        sim.sleep(0.3)
        sim.spawn("p3dx", -2.0, 2.0, name="late")
        sim.sleep(0.3)
    poses = [event.timestamp for event in lcm.EventLog(str(log)) if event.channel == "late/pose"]
    with playing(log) as process:
        early, _ = greeting(process.port)
        late, _ = greeting(process.port)
        seek(early, 0.1)
        seek(late, poses[-1] * 1e-6)
        assert texts_until(late, "scene") == 1
        late.send(bytes([WANT]) + b"late/pose")
        newest(late, {"late/pose": poses[-1]})

        def robots(scene):
            answer = json.loads(get(process.port, f"/scene/{scene}.json")[1])
            return {base["robot"] for base in answer["bases"]}

        assert robots(0) == {"p3at"} and robots(1) == {"p3at", "late"}
        assert get(process.port, "/scene/2.json")[0] == 404
        assert get(process.port, "/scene/99999999999999999999.json")[0] == 404
        # To its end, which a busy server may reach before it reports that it plays
        late.send(bytes([PLAY, 1]) + struct.pack("<d", 1000.0))
        told = texts_until(late, "playback")
        while (told["speed"], told["now"], told["playing"]) != (1000, told["end"], False):
            told = texts_until(late, "playback")
        early.send(bytes([PLAY, 0]) + struct.pack("<d", 3.0))
        while (told := texts_until(early, "playback"))["speed"] != 3:
            pass
        assert (told["now"], told["playing"]) == (0.1, False)


def test_the_log_is_not_steered(log):
    with playing(log) as process:
        viewer, _ = greeting(process.port)
        viewer.send(bytes([3, 13]) + b"p3at/velocity" + b"junk")
        assert texts_until(viewer, "refused") == "p3at/velocity"


def test_a_log_that_was_cut_off_is_shown_up_to_there(log, tmp_path):
    whole = log.read_bytes()
    begin = whole.index(b"\xed\xa1\xda\x01", len(whole) // 2)  # of an event
    (tmp_path / "cut.lcm").write_bytes(whole[: begin + 5])
    with playing(tmp_path / "cut.lcm") as process:
        viewer, hello = greeting(process.port)
        assert "cut off in the event that begins at byte" in hello["fault"]
        assert 1.5 < texts_until(viewer, "playback")["end"] < 2.5
        assert get(process.port, "/scene.json")[0] == 200


def test_a_changed_or_missing_world_is_reported(tmp_path):
    (tmp_path / "world.sdf").write_text((SOURCE / "tests/console/bumper.sdf").read_text())
    log = record(tmp_path / "run.lcm", tmp_path / "world.sdf")
    with open(tmp_path / "world.sdf", "a", encoding="utf-8") as world:
        world.write("<!-- later -->\n")
    with playing(log) as process:
        viewer, hello = greeting(process.port)
        assert "was changed since" in hello["fault"] and "world.sdf" in hello["fault"]
        assert get(process.port, "/scene.json")[0] == 200
    (tmp_path / "world.sdf").unlink()
    with playing(log) as process:
        viewer, hello = greeting(process.port)
        assert "cannot be shown" in hello["fault"] and "world.sdf" in hello["fault"]
        assert get(process.port, "/scene.json")[0] == 404
        viewer.send(bytes([WANT]) + b"p3dx/pose\nruedo/info")
        seek(viewer, 2.0)
        newest(viewer, {"p3dx/pose": 2_000_000})


def event(number, time_us, channel, data):
    return (
        struct.pack("!IqqII", 0xEDA1DA01, number, time_us, len(channel), len(data)) + channel + data
    )


@pytest.mark.parametrize("count, every", [(1, 1), (3, 1), (150_000, 2), (200_001, 3)])
def test_a_field_is_reported_over_the_whole_log(tmp_path, count, every):
    """Its first and its last message are always there; of many every so many."""
    from ruedo.lcmtypes import odometry_t

    message, path = odometry_t(), tmp_path / "long.lcm"
    message.x = 0.25
    place = message.encode().index(struct.pack("!d", 0.25))
    data = bytearray(message.encode())
    with open(path, "wb") as log:
        for i in range(count):
            struct.pack_into("!d", data, place, i)
            log.write(event(i, 1000 * i, b"p3at/odometry", bytes(data)))
    with playing(path) as process:
        status, body, _ = get(process.port, "/history/x/p3at/odometry")
        assert status == 200
        numbers = struct.unpack(f"<{len(body) // 8}d", body)
        wanted = sorted({*range(0, count, every), count - 1})
        assert numbers[0] == every
        assert numbers[1::2] == pytest.approx([0.001 * i for i in wanted])
        assert list(numbers[2::2]) == wanted
        assert get(process.port, "/history/angle%5B7%5D/p3at/odometry")[1] == struct.pack(
            "<d", every
        )
        for none in ("x/p3at/lrf", "x", "", "%00/p3at/odometry"):
            assert get(process.port, f"/history/{none}")[0] in (200, 404)


def test_fields_are_reported_together_and_arrays_as_a_whole(tmp_path):
    """Of the finite elements; where there are none, and of fields that there are not, nothing."""
    from ruedo.lcmtypes import planar_lidar_t

    path = tmp_path / "scans.lcm"
    with open(path, "wb") as log:
        for i, ranges in enumerate([[3, math.inf, 1, 2], [], [math.inf, -math.inf]]):
            scan = planar_lidar_t()
            scan.utime, scan.nranges, scan.ranges = 50 * i, len(ranges), ranges
            log.write(event(i, 1000 * i, b"p3at/lrf", scan.encode()))
    fields = [
        "min(ranges)",
        "max(ranges)",
        "mean(ranges)",
        "sum(ranges)",
        "ranges[2]",
        "none",
        "utime",
    ]
    with playing(path) as process:
        _, body, _ = get(process.port, f"/history/{quote(','.join(fields))}/p3at/lrf")
        numbers = struct.unpack(f"<{len(body) // 8}d", body)
        assert numbers[0] == 1
        rows = [numbers[1 + 8 * i : 9 + 8 * i] for i in range(3)]
        nan = math.nan
        assert rows[0] == pytest.approx((0, 1, 3, 2, 6, 1, nan, 0), nan_ok=True)
        assert rows[1] == pytest.approx((0.001, nan, nan, nan, nan, nan, nan, 50), nan_ok=True)
        assert rows[2] == pytest.approx((0.002, nan, nan, nan, nan, nan, nan, 100), nan_ok=True)
        many = ",".join(["utime"] * 200)  # of which it sends some
        assert len(get(process.port, f"/history/{many}/p3at/lrf")[1]) < 8 * 200


def test_strange_logs_do_not_hurt(log, tmp_path):
    """Times that go back and forth, names that are no text, lengths that lie, messages that are
    none.
    """
    pose = next(e.data for e in __import__("lcm").EventLog(str(log)) if e.channel == "p3at/pose")
    strange = tmp_path / "strange.lcm"
    strange.write_bytes(
        event(0, 5, b"\xff\xfe\x00\n\xc3", b"")
        + event(1, 9 * 10**15, b"p3at/pose", pose)
        + event(2, -9 * 10**15, b"p3at/pose", pose)
        + event(3, 7, b"ruedo/world", os.urandom(500))
        + event(4, 8, b"ruedo/header", os.urandom(50))
        + event(5, 9, b"ruedo/applied", b"\0" * 9)
        + event(6, 10, b"", b"x" * 100_000)
        + event(7, 11, b"ruedo/info", bytes(8))
        + b"\xed\xa1\xda\x01"
        + b"\x7f" * 24
    )
    with playing(strange) as process:
        viewer, hello = greeting(process.port)
        assert "no ruedo/header" in hello["fault"] and "damaged at byte" in hello["fault"]
        viewer.send(bytes([WANT]) + b"p3at/pose\nruedo/world\nruedo/header\nruedo/info\n")
        viewer.send(bytes([TRAFFIC, 1]))
        names = texts_until(viewer, "channels")
        assert "p3at/pose" in names and all("\ufffd" not in name for name in names)
        for moment in (float("nan"), float("inf"), -float("inf"), 1e300, -1e300, 0.0, 9e12):
            viewer.send(bytes([SEEK]) + struct.pack("<d", moment))
            viewer.send(bytes([PLAY, 1]) + struct.pack("<d", moment))
        viewer.send(bytes([SEEK, 1]))  # too short: that viewer must go
        other, _ = greeting(process.port)
        other.send(bytes([WANT]) + b"p3at/pose")
        seek(other, 9e9)
        assert other.frame()
        assert process.poll() is None and get(process.port, "/")[0] == 200


@pytest.mark.parametrize(
    "content, words",
    [
        (None, "no such file"),
        (b"", "holds no message"),
        (b"hello, world" * 100, "is not an LCM log"),
        (b"\xed\xa1\xda\x01" + b"\xff" * 40, "holds no message: damaged at byte 0"),
        (event(0, -(2**63), b"p3at/pose", b""), "holds no message: damaged at byte 0"),
        (event(0, 2**63 - 1, b"p3at/pose", b""), "holds no message: damaged at byte 0"),
        ("folder", "is a folder; allowed is a log, or a ROS 2 bag"),
    ],
)
def test_a_file_that_is_not_a_log_is_refused(tmp_path, content, words):
    path = tmp_path / "no.lcm"
    if content == "folder":
        path.mkdir()
    elif content is not None:
        path.write_bytes(content)
    done = subprocess.run(
        [RUEDO, "play", path, "--view", "0"], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 3 and words in done.stderr and "no.lcm" in done.stderr


def test_conflicting_options_are_refused(log):
    for arguments in (["--speed", "max"], ["--lcm", "memq://"]):
        done = subprocess.run(
            [RUEDO, "play", log, "--view", "0", *arguments],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 2 and "--view" in done.stderr


@pytest.mark.parametrize(
    "path",
    [
        "/../../etc/passwd",
        "/scene/textures/../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "//etc/passwd",
        "/run.lcm",
        "/scene/../run.lcm",
    ],
)
def test_no_path_escapes(log, path):
    with playing(log) as process:
        status, body, _ = get(process.port, path)
        assert (
            status in (400, 403, 404) and b"root:" not in body and b"\xed\xa1\xda\x01" not in body
        )
