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
    assert all(len(types) == 1 for types in seen["types"].values())


def test_readers_of_each_quality_are_served(run):
    node(run, "qos")


def test_a_node_keeps_the_time_of_the_run(run):
    assert node(run, "sim_time") <= 0.1  # /clock comes each 10 ms; a busy machine


def test_the_robot_drives_by_the_type_of_the_release(run):
    kind = {"jazzy": "Twist", "kilted": "TwistStamped"}[os.environ["ROS_DISTRO"]]
    assert node(run, "drives") == f"geometry_msgs/msg/{kind}"


def test_ten_nodes_hear_each_scan(run):
    assert min(node(run, "many_nodes", "10")) >= 5


def test_who_is_killed_is_gone(run):
    assert node(run, "killed", str(run.process.pid))


def test_two_robots_have_a_namespace_each():
    with Run("--no-noise", "--disable", "p3at/camera", "--spawn", "turtle@3,0") as run:
        own = ("/p3at/scan", "/turtle/scan", "/p3at/cmd_vel", "/turtle/cmd_vel")
        assert not {"/scan", "/cmd_vel"} & set(node(run, "names", *own))


def test_diagnostics_tell_how_the_run_gets_on(run):
    seen = node(run, "diagnostics")
    assert list(seen["status"]) == ["ruedo: simulation", "ruedo: ROS 2", "ruedo: bus"]
    _, simulation = seen["status"]["ruedo: simulation"]
    factor = float(simulation["real-time factor"])
    # At least a second of real time lies between two messages.
    assert 0 < factor <= seen["apart"] * 1.01
    assert float(simulation["real time per step (ms)"]) == pytest.approx(5 / factor, rel=0.01)
    _, values = seen["status"]["ruedo: ROS 2"]
    assert int(values["messages sent"]) > 0


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
    waited = node(run, "fresh_clients", "50")
    assert len(waited) == 50
