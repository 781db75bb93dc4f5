"""Recorded runs, read by the client libraries."""

import itertools
import os
import subprocess
import sys
from dataclasses import fields

import numpy as np
import pytest
from conftest import HALL, PROBES, RUEDO, probe


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "run.lcm"
    options = ["--record", str(path), "--duration", "1", "--rate", "max", "--lcm", "memq://"]
    subprocess.run(
        [RUEDO, "run", HALL, "--disable", "p3at/camera", *options], check=True, capture_output=True
    )
    return path


def events(data):
    """Where each event of a log begins, by its format: a head of 28 bytes, channel, data."""
    at, places = 0, []
    while at < len(data):
        places.append(at)
        sizes = data[at + 20 : at + 24], data[at + 24 : at + 28]
        at += 28 + sum(int.from_bytes(size, "big") for size in sizes)
    return places


def test_samples_by_channel(language, log):
    """Python reads by LCM's own reader and lcm-gen's classes."""
    said, python = probe(language, "-", "log", str(log)), probe("python", "-", "log", str(log))
    # All but what has no message type of its own kind there, as ruedo/applied.
    assert set(python.words("channels")) <= set(said.words("channels"))
    assert {"p3at/lrf", "p3at/pose", "ruedo/header"} <= set(said.words("channels"))
    for kind in ("scans", "poses"):
        assert said.numbers(kind) == pytest.approx(python.numbers(kind), abs=1e-5)
    assert said.numbers("poses")[:2] == [51, 1e6]  # 50 Hz, from 0 to 1 s
    if language != "python":
        assert said.one("raw") == str(8 + 8 + 16 * 8)  # fingerprint, utime, 16 doubles
        assert "fault" not in [line[0] for line in said.lines if len(line) == 2 and line[1]]
        unknown = said.one("unknown")
        assert "UnknownName:" in unknown and "has no channel 'nobody'; it has " in unknown
        assert "TypeMismatch: p3at/pose carries " in said.one("mismatch")


@pytest.mark.parametrize("repeats, begin", [(1, 0.3), (120, 84.3)])
def test_samples_of_a_time(language, log, tmp_path, repeats, begin):
    """50 Hz: from 0.3 to 0.5 s there are 11, in a long log found by halves."""
    if language == "python":
        return
    data, path = log.read_bytes(), tmp_path / "long.lcm"
    places = [*events(data), len(data)]
    with open(path, "wb") as out:
        for repeat in range(repeats):
            for at, end in itertools.pairwise(places):
                time = int.from_bytes(data[at + 12 : at + 20], "big") + repeat * 2_000_000
                out.write(data[at : at + 12] + time.to_bytes(8, "big") + data[at + 20 : end])
    assert repeats == 1 or path.stat().st_size > 4 << 20
    said = probe(language, "-", "log", str(path), str(begin))
    assert said.numbers("range") == [11, 3e5, 5e5]
    assert said.one("beyond") == "11"


def test_columns_are_those_of_the_live_samples(tmp_path):
    """What a program saw while it ran, and what pandas shows of the log: names and values."""
    import ruedo

    path = tmp_path / "run.lcm"
    with ruedo.launch(HALL, lockstep=1, args=["--record", str(path)]) as sim:
        robot = sim.robot("p3at")
        streams = [robot.lrf, robot.sonar, robot.odometry, robot.odometry_twist, robot.pose]
        streams += [robot.motion, robot.collisions, robot.camera]
        seen = sim.step(40, [robot.velocity_command(0.5, 0.1)])
        live = {stream.channel: seen.all(stream) for stream in streams}
    frames = ruedo.read_log(path)
    for channel, samples in live.items():
        assert samples, channel
        frame = frames[channel]
        assert list(frame.columns) == [one.name for one in fields(samples[0])], channel
        for sample, (time, row) in zip(samples, frame.iterrows()):
            assert time == sample.time
            for name, value in vars(sample).items():
                assert np.array_equal(row[name], value), (channel, name)


def test_a_log_that_was_cut_off_is_read_up_to_there(language, log, tmp_path):
    if language == "python":  # LCM's reader says nothing
        return
    data = log.read_bytes()
    last = events(data)[-1]
    cut = tmp_path / "cut.lcm"
    for size in (last + 1, last + 27, len(data) - 1):
        cut.write_bytes(data[:size])
        said = probe(language, "-", "log", str(cut))
        assert said.one("fault") == f"it was cut off in the event that begins at byte {last}"
    before = events(data)[-2]
    cut.write_bytes(data[:last] + b"\x00" * 40)
    assert probe(language, "-", "log", str(cut)).one("fault") == f"it is damaged at byte {last}"
    lying = data[:last] + data[before : before + 24] + b"\x0f\xff\xff\xff" + b"\x00" * 40
    cut.write_bytes(lying)
    said = probe(language, "-", "log", str(cut))
    assert said.one("fault") == f"it was cut off in the event that begins at byte {last}"


LARGEST = 8192 * 8192 * 4 + 65536  # the largest picture, and what describes it


def test_a_message_that_no_run_sends_is_damage(language, log, tmp_path):
    """Each byte of it is there, and takes no room on the disk: read, it would take memory."""
    if language == "python":  # see test_read_log_warns_where_a_log_is_damaged
        return
    data = log.read_bytes()
    path = tmp_path / "sparse.lcm"
    for size in (LARGEST + 1, 1 << 30):
        head = data[:20] + (6).to_bytes(4, "big") + size.to_bytes(4, "big") + b"sparse"
        path.write_bytes(data + head)
        os.truncate(path, len(data) + len(head) + size)
        said = probe(language, "-", "log", str(path))
        assert said.one("fault") == f"it is damaged at byte {len(data)}"


def test_a_file_that_is_not_a_log_is_refused(language, tmp_path):
    text = tmp_path / "text.lcm"
    text.write_text("this is not a log, but a text that is longer than the head of an event\n")
    for path in (text, tmp_path, tmp_path / "nothing.lcm"):
        if language == "python" and path == text:
            continue  # LCM's reader finds no event, and says nothing
        result = subprocess.run(
            [*PROBES[language], "-", "log", str(path)], capture_output=True, text=True
        )
        assert str(path) in result.stdout + result.stderr
        if language != "python":
            assert "failed " in result.stdout, result


def test_a_fifo_is_refused_as_a_log_at_once(language, tmp_path):
    os.mkfifo(tmp_path / "fifo")
    done = subprocess.run(
        [*PROBES[language], "-", "log", str(tmp_path / "fifo")],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert "fifo" in done.stdout + done.stderr


def test_read_log_refuses_a_file_that_is_not_a_log(tmp_path):
    ruedo = pytest.importorskip("ruedo")
    pytest.importorskip("pandas")
    path = tmp_path / "noise.bin"
    path.write_bytes(bytes(range(1, 200)))
    with pytest.raises(ValueError, match=r"noise\.bin: no LCM log: it begins with 01 02 03 04"):
        ruedo.read_log(path)
    path.write_bytes(b"")
    assert ruedo.read_log(path) == {}


def test_read_log_warns_where_a_log_is_damaged(tmp_path, log, caplog):
    """LCM's own reader ended there without a word: a part passed for the whole."""
    ruedo = pytest.importorskip("ruedo")
    pytest.importorskip("pandas")
    whole = {channel: len(frame) for channel, frame in ruedo.read_log(log).items()}
    assert not caplog.records
    data = log.read_bytes()
    places = events(data)
    middle = places[len(places) // 2]
    damaged = bytearray(data)
    damaged[middle + 1] ^= 1
    too_large = (LARGEST + 1).to_bytes(4, "big")
    for bad, why in (
        (damaged, f"it is damaged at byte {middle}"),
        (data[: middle + 30], f"it was cut off in the event that begins at byte {middle}"),
        (data[: middle + 24] + too_large, f"it is damaged at byte {middle}"),
    ):
        path = tmp_path / "bad.lcm"
        path.write_bytes(bad)
        if bad[middle + 24 :] == too_large:
            os.truncate(path, middle + 2 * LARGEST)
        caplog.clear()
        frames = ruedo.read_log(path)
        assert caplog.messages == [f"{path}: {why}"]
        assert 0 < sum(map(len, frames.values())) < sum(whole.values())


def written(path, found):
    """A log of these events, by LCM's own module."""
    lcm = pytest.importorskip("lcm")
    writer = lcm.EventLog(str(path), "w", overwrite=True)
    for timestamp, channel, data in found:
        writer.write_event(timestamp, channel, data)
    writer.close()
    return path


def all_kinds():
    """Five messages of each of three types: numbers, arrays that are not equally long, texts."""
    from ruedo.lcmtypes import joint_state_t, marker_t, pose_t

    for k in range(5):
        pose = pose_t()
        pose.utime, pose.pos, pose.orientation = 10_000 * k, [0.5 * k, -1.0, 2.0], [1.0, 0, 0, 0]
        yield 10_000 * k, "r/pose", pose.encode()
        joints = joint_state_t()
        joints.num_joints = k % 3
        joints.joint_name = [f"joint{i}\u00e9" for i in range(k % 3)]
        for name, kind in zip(joints.__slots__, joints.__typenames__):
            if name not in ("num_joints", "joint_name", "utime"):
                setattr(joints, name, [0.25 * k + i for i in range(k % 3)])
                assert kind in ("float", "double"), name
        yield 10_000 * k, "r/joints", joints.encode()
        marker = marker_t()
        marker.n, marker.points = 2 * k, [[float(i), 0.5, -k] for i in range(2 * k)]
        yield 10_000 * k, "markers", marker.encode()


def test_columns_of_a_log(tmp_path):
    ruedo = pytest.importorskip("ruedo")
    path = written(tmp_path / "run.lcm", all_kinds())
    log = ruedo.open_log(path)
    assert log.channels["r/pose"] == ("pose_t", 5, 0.0, 0.04)
    pose = log.columns("r/pose")
    assert pose["utime"].tolist() == [0, 10_000, 20_000, 30_000, 40_000]
    assert pose["position"].tolist() == [[0.5 * k, -1.0, 2.0] for k in range(5)]
    assert log.columns("r/pose", raw=True)["pos"].tolist() == pose["position"].tolist()
    joints = log.columns("r/joints")
    assert joints["names"].tolist() == [[f"joint{i}\u00e9" for i in range(k % 3)] for k in range(5)]
    markers = log.columns("markers")
    assert [one.tolist() for one in markers["points"]] == [
        [[float(i), 0.5, -k] for i in range(2 * k)] for k in range(5)
    ]
    assert log.columns("r/pose", begin=0.02, end=0.03)["utime"].tolist() == [20_000, 30_000]
    with pytest.raises(ruedo.UnknownName, match="no channel 'nobody'; it has markers, r/joints"):
        log.columns("nobody")


def test_messages_that_do_not_decode_are_left_out(tmp_path):
    ruedo = pytest.importorskip("ruedo")
    [(_, _, pose), (_, _, joints), *_] = all_kinds()
    bad = [pose[:-1], pose + b"x", joints, b"", pose[:3]]
    path = written(
        tmp_path / "run.lcm", [(k, "c", one) for k, one in enumerate([pose, *bad, pose])]
    )
    assert len(ruedo.open_log(path).columns("c")["utime"]) == 2


def same(one, other):
    """Cells may be arrays, lists, dicts and texts."""
    if hasattr(one, "dtype") or hasattr(other, "dtype"):
        assert one.dtype == other.dtype and one.shape == other.shape
        if one.dtype != object:
            return one.tobytes() == other.tobytes()
        return all(same(a, b) for a, b in zip(one, other))
    return one == other


@pytest.mark.parametrize("raw", [True, False])
def test_the_module_and_python_read_the_same(log, tmp_path, raw):
    """Python decodes by the classes of lcm-gen, which know nothing of the module."""
    pytest.importorskip("ruedo._engine")
    from ruedo import logs

    for path in (str(log), str(written(tmp_path / "kinds.lcm", all_kinds()))):
        compiled, python = (
            logs.read_columns(path, None, None, None, raw),
            logs._read_in_python(path, None, None, None, raw),
        )
        assert set(compiled) == set(python) and len(compiled) >= 3
        for channel, columns in python.items():
            assert list(compiled[channel]) == list(columns)
            for name, column in columns.items():
                assert same(compiled[channel][name], column), (channel, name)


@pytest.fixture(scope="module")
def long_log(tmp_path_factory):
    """64 MB: a scan of 1000 rays, and a pose, each ms."""
    ruedo = pytest.importorskip("ruedo")
    scan, pose = ruedo.lcmtypes.planar_lidar_t(), ruedo.lcmtypes.pose_t()
    scan.nranges, scan.ranges = 1000, [1.0] * 1000
    scan.nintensities, scan.intensities = 0, []

    def found():
        for k in range(15_000):
            scan.utime = pose.utime = 1000 * k
            yield 1000 * k, "r/lrf", scan.encode()
            yield 1000 * k, "r/pose", pose.encode()

    return written(tmp_path_factory.mktemp("long") / "run.lcm", found())


@pytest.mark.parametrize(
    "begin, end", [(None, 0.5), (0.0, 0.0), (7.4995, 7.5025), (14.9, None), (14.999, 20), (16, 17)]
)
def test_a_range_of_times(long_log, begin, end):
    """In a log that is long enough to be halved."""
    ruedo = pytest.importorskip("ruedo")
    there = [
        1000 * k
        for k in range(15_000)
        if (begin is None or k >= begin * 1000) and (end is None or k <= end * 1000)
    ]
    found = ruedo.open_log(long_log).columns("r/pose", begin, end)
    assert (found["utime"].tolist() if found else []) == there


def test_memory_is_what_is_returned(long_log):
    """A channel of small messages, and one of large ones: with a buffer of 16 MB."""
    pytest.importorskip("ruedo._engine")
    program = (
        "import resource, sys, ruedo\n"
        "log = ruedo.open_log(sys.argv[1])\n"
        "log.columns('r/pose', end=0.001)\n"  # what is loaded once
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "columns = log.columns(sys.argv[2])\n"
        "after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "print((after - before) * 1024, sum(one.nbytes for one in columns.values()))\n"
    )
    for channel in ("r/pose", "r/lrf"):
        done = subprocess.run(
            [sys.executable, "-c", program, str(long_log), channel],
            capture_output=True,
            text=True,
            check=True,
        )
        grown, returned = map(int, done.stdout.split())
        assert returned > 15_000 * 8 * 8
        assert grown < returned + 16e6, (channel, grown, returned)


def test_arrow_and_parquet(tmp_path):
    ruedo = pytest.importorskip("ruedo")
    parquet = pytest.importorskip("pyarrow.parquet")
    log = ruedo.open_log(written(tmp_path / "run.lcm", all_kinds()))
    for channel in ("r/pose", "r/joints", "markers"):
        table = log.arrow(channel)
        parquet.write_table(table, tmp_path / "table.parquet")
        assert parquet.read_table(tmp_path / "table.parquet").equals(table)
    assert log.arrow("r/pose")["position"].to_pylist()[4] == [2.0, -1.0, 2.0]
    assert log.arrow("r/joints")["names"].to_pylist()[1] == ["joint0\u00e9"]
