"""ruedo bench: every table has its rows, and the workload is the one that is described. No figure
of speed is judged.
"""

import json
import os
import select
import signal
import subprocess
import time
from pathlib import Path

import pytest

RUEDO = os.environ["RUEDO"]
PATIENCE = 200  # s


def bench(*arguments):
    return subprocess.run([RUEDO, "bench", *arguments], capture_output=True, text=True, timeout=200)


def rows_of(*arguments):
    result = bench("--json", *arguments)
    assert result.returncode == 0, result.stderr
    return [json.loads(line) for line in result.stdout.splitlines()]


def test_all_tables_run_by_themselves():
    rows = rows_of("--duration", "0.5")
    counts = {}
    for row in rows:
        counts[row["table"]] = counts.get(row["table"], 0) + 1
    assert counts == {"robots": 4, "lcm": 4, "camera": 3, "latency": 2, "pacing": 1, "rays": 3}
    for row in rows:
        if row["table"] in ("robots", "lcm", "camera"):
            assert row["real_time_factor"] > 0 and row["memory_mb"] > 1
            assert row["real_time_factor"] == pytest.approx(row["sim_s"] / row["wall_s"], rel=1e-3)
        elif row["table"] == "rays":
            # The same ranges as Embree's own, within single precision at 190 m, so both did the
            # same work.
            assert row["largest_difference_m"] < 1e-3
            assert row["rays"] == 181 * max(200, row["robots"])
            assert row["ratio_to_embree"] == pytest.approx(
                row["embree_rays_per_s"] / row["rays_per_s"], rel=1e-3
            )
        else:
            assert row["lost"] == 0 and row["count"] > 0
            assert 0 <= row["median_ms"] <= row["p99_ms"] <= row["max_ms"]
    for table in ("robots", "lcm"):
        assert [row["robots"] for row in rows if row["table"] == table] == [1, 10, 100, 1000]


def test_the_workload_is_the_one_described():
    (row,) = rows_of("--robots", "7", "--duration", "4")
    # A second of a robot: 10 scans, 25 of each of two sonar arrays, 50 odometry and as many
    # twists of it, 50 poses, 10 motions, 10 collisions. Beside them the world's: 30 states, 10
    # ticks, 1 info. Each starts at 0, so there may be one more of each, and of motions at once two.
    assert 230 * 7 + 40 <= row["messages_per_sim_s"] <= 230 * 7 + 45 + 7 * 10 / 4
    # Each scan has two lists of 181 floats, so that is its least.
    assert row["bytes_per_sim_s"] > 7 * 10 * 2 * 181 * 4
    (with_cameras,) = rows_of("--only", "camera", "--robots", "2", "--duration", "2")
    assert with_cameras["pictures_per_s"] * with_cameras["wall_s"] == pytest.approx(
        2 * 15 * 2 + 2, abs=1
    )


def test_several_robots_give_several_rows_of_one_table():
    rows = rows_of("--robots", "1", "3", "--duration", "0.5")
    assert [(row["table"], row["robots"]) for row in rows] == [("robots", 1), ("robots", 3)]
    rows = rows_of("--robots", "3", "--duration", "0.5", "--lcm", "memq://")
    assert [(row["table"], row["robots"]) for row in rows] == [("lcm", 3)]


def test_a_failed_table_is_reported_and_the_others_continue():
    result = bench(
        "--only",
        "robots",
        "lcm",
        "--robots",
        "1",
        "--duration",
        "0.5",
        "--lcm",
        "tcpq://127.0.0.1:1",
    )
    assert result.returncode == 4
    assert "'lcm'" in result.stderr
    assert "messages encoded and counted" in result.stdout and "1" in result.stdout


def test_errors_of_arguments_list_the_allowed_values():
    assert bench("--robots", "0").returncode == 2
    wrong = bench("--only", "robot")
    assert wrong.returncode == 2 and "latency" in wrong.stderr


def test_the_world_can_be_written(tmp_path):
    path = tmp_path / "rooms.sdf"
    assert bench("--robots", "20", "--write-world", str(path)).returncode == 0
    text = path.read_text()
    assert text.count("model://p3at") == 20
    # 5 rooms a side: 4 outer walls, and 2 pieces beside the door of each of 2 x 4 x 5 inner walls.
    assert text.count("<collision") == 4 + 2 * 2 * 4 * 5


@pytest.mark.parametrize("command", ["bench", "experiments"])
def test_help_has_the_options_that_measure(command):
    result = subprocess.run([RUEDO, command, "--help"], capture_output=True, text=True, timeout=200)
    assert (
        result.returncode == 0 and ("--robots" if command == "bench" else "--out") in result.stdout
    )


def test_unknown_options_are_reported():
    result = bench("--robts", "3")
    assert result.returncode == 2 and "did you mean '--robots'" in result.stderr


def children_of(process: int) -> list[int]:
    words = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return [int(word) for word in words]


@pytest.mark.parametrize("told", [signal.SIGTERM, signal.SIGKILL])
def test_nothing_continues_after_its_end(told):
    """One process measures, and with latency that has a client in another."""
    with subprocess.Popen(
        [RUEDO, "bench", "--only", "latency", "--duration", "1e4", "--lcm", "memq://"],
        stdout=subprocess.DEVNULL,
    ) as process:
        started = time.monotonic()
        while not (measures := children_of(process.pid)) or not (
            clients := children_of(measures[0])
        ):
            assert process.poll() is None and time.monotonic() < started + PATIENCE
            time.sleep(0.01)
        handles = [os.pidfd_open(pid) for pid in measures + clients]
        process.send_signal(told)
        process.wait(PATIENCE)
    for handle in handles:
        assert select.select([handle], [], [], PATIENCE)[0]  # by itself it would go on for hours
        os.close(handle)
