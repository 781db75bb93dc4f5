"""A node drives; the referee says how. Needs a workspace with launch_pytest (colcon test)."""

import sys
from pathlib import Path

import launch_pytest
import pytest
from launch import LaunchDescription
from launch.actions import ExecuteProcess
from launch_pytest.tools import process
from ruedo_ros import Regression, Simulation

DRIVER = Path(__file__).with_name("drive.py")
DRIVE = {"duration": 8.0, "goal": (1.0, 0.0), "radius": 0.2}


def driver():
    return ExecuteProcess(cmd=[sys.executable, str(DRIVER)], output="screen")


@launch_pytest.fixture
def arrives():
    run = Regression("arena", **DRIVE, no_contact=True)
    return LaunchDescription([run, driver()]), run


@pytest.mark.launch(fixture=arrives)
def test_a_robot_that_arrives_passes(arrives):
    _, run = arrives
    run.assert_passed()
    assert any("reached" in one["text"] for one in run.verdict()["evidence"])


@launch_pytest.fixture
def stays():
    run = Regression("arena", **DRIVE)
    return LaunchDescription([run]), run


@pytest.mark.launch(fixture=stays)
def test_a_robot_that_stays_fails(stays):
    _, run = stays
    with pytest.raises(AssertionError, match="was not within 0.2 m"):
        run.assert_passed()


@launch_pytest.fixture
def repeated(tmp_path):
    runs = [Regression("arena", **DRIVE, wait_for=["/cmd_vel@20"], record=tmp_path / "run.lcm")]
    return LaunchDescription([*runs, driver()]), runs[0]


@pytest.mark.launch(fixture=repeated)
def test_a_run_waits_for_its_node(repeated):
    _, run = repeated
    run.assert_passed()


@launch_pytest.fixture
def wrong():
    run = Regression("no_such_world", **DRIVE)
    return LaunchDescription([run]), run


@pytest.mark.launch(fixture=wrong)
def test_an_unrun_regression_is_reported(wrong):
    _, run = wrong
    with pytest.raises(RuntimeError, match="ended with 3"):
        run.verdict(60)


@launch_pytest.fixture
def recorded(tmp_path):
    run = Simulation("arena", bag=str(tmp_path / "bag"), arguments=["--duration", "1"])
    return LaunchDescription([run]), run, tmp_path / "bag"


@pytest.mark.launch(fixture=recorded)
def test_a_simulation_leaves_a_bag(recorded, launch_context):
    _, run, bag = recorded
    process.wait_for_exit_sync(launch_context, run, timeout=120)
    assert sorted(path.suffix for path in bag.iterdir()) == [".mcap", ".yaml"]
