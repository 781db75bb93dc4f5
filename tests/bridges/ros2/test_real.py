"""Real ROS 2: rclpy over rmw_fastrtps, from PyPI (real/install.py)."""

import json
import os
import subprocess
from pathlib import Path

import pytest
from conftest import Run

ROS = Path(os.environ["RUEDO_REAL_ROS"])
PATIENCE = 300  # s


def node(run, *words):
    """What real/node.py sees."""
    environment = {
        **os.environ,
        "AMENT_PREFIX_PATH": str(ROS),
        "LD_LIBRARY_PATH": str(ROS / "lib"),
        "PYTHONPATH": str(ROS / "lib/python3.11/site-packages"),
        "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(run.domain),
    }
    script = Path(__file__).parent / "real/node.py"
    done = subprocess.run(
        [ROS / "bin/python", script, *words],
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.fixture
def run():
    with Run("--no-noise", "--disable", "p3at/camera") as one:
        yield one


def test_sensors_are_heard(run):
    seen = node(run, "topics")
    assert seen["beams"] == 181
    assert seen["periods"] == pytest.approx([0.1] * len(seen["periods"]))
    assert seen["types"]["/cmd_vel"] == ["geometry_msgs/msg/Twist"]
    assert all(len(types) == 1 for types in seen["types"].values())


def test_parameters_are_those_of_a_node(run):
    seen = node(run, "parameters")
    assert seen["before"] == {
        "fault": "",
        "paused": False,
        "rate": 1.0,
        "seed": 1,
        "step_size": 0.005,
        "use_sim_time": False,
        "world": "arena",
    }
    assert seen["types"] == [4, 1, 3, 2, 3, 1, 4]
    assert seen["read_only"] == ["seed", "step_size", "use_sim_time", "world"]
    good, bad = seen["set"][:3], seen["set"][3:]
    assert good == ["", "", ""]
    for told, expected in zip(
        bad,
        ("'seed' is read-only", "'rate' is a double", "no parameter 'nobody'", "0.0001", "dropout"),
        strict=True,
    ):
        assert expected in told
    assert seen["after"] == [2.0, True, "p3at/lrf:dropout,for=5"]
    assert seen["atomically"] == "'seed' is read-only"
    assert seen["rate"] == [2.0, None]
    assert seen["events"] == ["rate", "paused", "fault"]


def test_the_first_reply_reaches_each_new_client(run):
    """Regression: of 25 first requests one was lost, for it came before the word of its writer."""
    waited = node(run, "fresh_clients", "100")
    assert len(waited) == 100
