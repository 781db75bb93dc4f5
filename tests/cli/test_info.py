"""ruedo info LOG: what it says of a log that lcm's own module wrote."""

import json
import os
import subprocess

import lcm
import pytest
from ruedo.lcmtypes import log_header_t, pose_t

RUEDO = os.environ["RUEDO"]


def info(*arguments):
    return subprocess.run(
        [RUEDO, "info", *map(str, arguments)], capture_output=True, text=True, timeout=400
    )


def as_json(*arguments):
    done = info(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def header():
    message = log_header_t()
    message.world, message.world_file, message.version = "hall", "hall.sdf", "0.1.0 (here)"
    message.seed, message.step_us = -1, 4000  # -1: as in C++, the largest that has no sign
    message.options = ["--no-noise"]
    message.noptions = 1
    return message.encode()


@pytest.fixture
def written(tmp_path):
    """A header; 101 poses in 2 s, from 1 s on; three messages of a type that Ruedo lacks."""
    path = tmp_path / "run.lcm"
    events = [(0, "ruedo/header", header())]
    events += [(1_000_000 + 20_000 * k, "r/pose", pose_t().encode()) for k in range(101)]
    events += [(4_000_000, "other", bytes(range(8)) + b"x" * k) for k in range(3)]
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for event in events:
        log.write_event(*event)
    log.close()
    return path


def test_info_lists_the_contents_of_a_log(written):
    told = as_json(written)
    assert told["size"] == told["readable"] == written.stat().st_size
    assert told["whole"] and told["fault"] == "" and told["messages"] == 105
    assert (told["begin"], told["end"]) == (0, 4)
    assert (told["world"], told["world_file"], told["version"]) == (
        "hall",
        "hall.sdf",
        "0.1.0 (here)",
    )
    assert told["seed"] == 2**64 - 1 and told["step_us"] == 4000
    assert told["options"] == ["--no-noise"]
    other, pose, first = told["channels"]
    assert pose == {
        "name": "r/pose",
        "type": "pose_t",
        "fingerprint": pose_t._get_packed_fingerprint().hex(),
        "messages": 101,
        "bytes": 101 * len(pose_t().encode()),
        "rate": 50,
        "begin": 1,
        "end": 3,
    }
    assert other["type"] == "" and other["fingerprint"] == "0001020304050607"
    assert other["messages"] == 3 and other["bytes"] == 8 + 9 + 10 and other["rate"] == 0
    assert first["name"] == "ruedo/header" and first["messages"] == 1


def test_for_people(written):
    lines = info(written).stdout.splitlines()
    assert lines[0].endswith("105 messages, 4 s of sim time (0 to 4 s), whole")
    assert "world hall (hall.sdf), steps of 4 ms, seed 18446744073709551615" in lines
    assert ["r/pose", "pose_t", "101", "50", "Hz"] in [line.split()[:5] for line in lines]
    assert ["other", "0001020304050607", "3"] in [line.split()[:3] for line in lines]


@pytest.mark.parametrize("lost", [1, 20, 5000])
def test_a_log_that_was_cut_off(written, lost):
    whole = written.read_bytes()
    written.write_bytes(whole[:-lost])
    told = as_json(written)
    assert not told["whole"] and f"begins at byte {told['readable']}" in told["fault"]
    assert told["readable"] < told["size"] == len(whole) - lost
    assert told["messages"] == sum(channel["messages"] for channel in told["channels"]) < 105


def test_a_damaged_log(written):
    whole = bytearray(written.read_bytes())
    at = whole.rindex(b"\xed\xa1\xda\x01")
    whole[at] = 0
    written.write_bytes(whole)
    told = as_json(written)
    assert told["fault"] == f"damaged at byte {at}" and told["readable"] == at
    assert told["messages"] == 104


def test_an_empty_log_and_a_file_that_is_not_a_log(tmp_path):
    empty = tmp_path / "empty.lcm"
    empty.write_bytes(b"")
    assert info(empty).returncode != 0  # no world, either
    assert info(tmp_path / "none.lcm").returncode != 0


def test_options_of_worlds_are_refused(written):
    done = info(written, "--no-noise")
    assert done.returncode == 2 and "--no-noise" in done.stderr and "is a log" in done.stderr
