"""--wait-for on ROS topics: a controller that knows nothing of steps drives twice, and both runs
have the same bytes.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from server import PATIENCE, RUEDO, Run

HERE = Path(__file__).resolve().parent


def driven(log: Path, *arguments: str) -> bytes:
    with Run(
        "--rate",
        "max",
        "--duration",
        "6",
        "--wait-for",
        "/cmd_vel@10",
        "--record",
        str(log),
        *arguments,
    ) as run:
        # One scan each 0.1 s; the one at 6 s gets no answer.
        controller = subprocess.Popen(
            [sys.executable, str(HERE / "controller.py"), str(run.domain), "60"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            output = run.process.communicate(timeout=PATIENCE)[0]
            assert run.process.returncode == 0, output
        finally:
            controller.kill()
            controller.wait()
    return log.read_bytes()


def test_a_plain_controller_drives_twice_with_the_same_bytes(tmp_path):
    first = driven(tmp_path / "first.lcm")
    second = driven(tmp_path / "second.lcm")
    assert first.count(b"p3at/velocity\0") >= 59  # each answer acted
    assert first == second
    assert (
        subprocess.run([RUEDO, "verify", tmp_path / "first.lcm"], capture_output=True).returncode
        == 0
    )


def test_a_run_without_ros2_has_the_same_bytes(tmp_path):
    """A recording does not depend on its readers."""
    logs = []
    for name, arguments in (("with", ["--ros2"]), ("without", [])):
        log = tmp_path / f"{name}.lcm"
        subprocess.run(
            [
                RUEDO,
                "run",
                str(HERE.parents[2] / "worlds/arena.sdf"),
                "--rate",
                "max",
                "--duration",
                "2",
                "--lcm",
                "auto",
                "--record",
                log,
                *arguments,
            ],
            check=True,
            capture_output=True,
            timeout=PATIENCE,
        )
        logs.append(log.read_bytes())
    assert logs[0] == logs[1]


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--wait-for", "/cmd_vle@10"], "'/cmd_vle' that takes commands; did you mean '/cmd_vel'?"),
        (["--wait-for", "/scan@10"], "'/scan' that takes commands"),
    ],
)
def test_a_topic_without_commands_is_refused(arguments, words):
    with Run(*arguments) as run:
        assert words in run.process.communicate(timeout=60)[0]
        assert run.process.returncode == 2
