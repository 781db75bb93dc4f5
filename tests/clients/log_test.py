"""Recorded runs, read by the client libraries."""

import os
import subprocess
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


def test_what_is_no_log_is_said(language, tmp_path):
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


def test_a_fifo_is_no_log_and_not_waited_for(language, tmp_path):
    os.mkfifo(tmp_path / "fifo")
    done = subprocess.run(
        [*PROBES[language], "-", "log", str(tmp_path / "fifo")],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert "fifo" in done.stdout + done.stderr


def test_read_log_says_what_is_no_log(tmp_path):
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
