"""The package ruedo_ros: its launch files, parameters and actions, and what colcon installs.

PyPI lacks ROS 2's launch packages: what stands for them takes any call. What the actions start is
run. With the real ones, ros2.workspace runs the package's own tests.
"""

from __future__ import annotations

import importlib.util
import os
import re
import runpy
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from unittest.mock import MagicMock

import pytest
import yaml

SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[3]))
RUEDO = os.environ.get("RUEDO", str(SOURCE / "build/release/bin/ruedo"))
PACKAGE = SOURCE / "clients/ros2/ruedo_ros"
PACKAGES = (
    "launch",
    "launch.actions",
    "launch.conditions",
    "launch.launch_description_sources",
    "launch.some_substitutions_type",
    "launch.substitutions",
    "launch.utilities",
    "launch_ros",
    "launch_ros.actions",
    "launch_ros.substitutions",
    "nav2_common",
    "nav2_common.launch",
)


class Process:
    """launch's ExecuteProcess, which is run by hand."""

    def __init__(self, *, cmd, on_exit=None, **options):
        self.words, self.on_exit, self.options = list(map(str, cmd)), on_exit, options


@pytest.fixture
def stand_ins(monkeypatch):
    for package in PACKAGES:
        monkeypatch.setitem(sys.modules, package, MagicMock())
    sys.modules["launch.actions"].ExecuteProcess = Process
    monkeypatch.syspath_prepend(PACKAGE)
    monkeypatch.setenv("RUEDO", RUEDO)
    yield
    for name in [name for name in sys.modules if name.partition(".")[0] == "ruedo_ros"]:
        monkeypatch.delitem(sys.modules, name)


def launch_file(name):
    spec = importlib.util.spec_from_file_location(name, PACKAGE / f"launch/{name}.launch.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def launch(stand_ins):
    return launch_file("nav2")


def test_pages_name_files_that_are_there():
    for page in (SOURCE / "docs/ros2.md", PACKAGE / "README.md"):
        for name in re.findall(r"clients/ros2/[\w./]+\w", page.read_text(encoding="utf-8")):
            assert (SOURCE / name).exists(), name


def test_colcon_installs_each_file(monkeypatch):
    """What setup.py tells setuptools."""
    monkeypatch.chdir(PACKAGE)
    told = {}
    monkeypatch.setattr("setuptools.setup", told.update)
    runpy.run_path("setup.py")
    description = ET.parse("package.xml").getroot()
    version = (SOURCE / "VERSION").read_text(encoding="utf-8").strip()
    for name in ("name", "version"):
        assert (
            description.findtext(name) == told[name] == {"version": version}.get(name, "ruedo_ros")
        )
    files = {file for _, names in told["data_files"] for file in names}
    assert all(Path(file).is_file() for file in files)
    folders = ("config", "launch", "resource", "rviz")
    there = {str(f) for folder in folders for f in Path(folder).iterdir() if f.is_file()}
    assert files == {*there, "package.xml"}


def read_once(name):
    text = Path(name).read_text(encoding="utf-8")
    Path(name).unlink()
    return yaml.safe_load(text)


@pytest.mark.parametrize("namespace, use_namespace", [("", "False"), ("alice", "True")])
def test_everything_is_launched(launch, nav2, namespace, use_namespace):
    launch.generate_launch_description()
    values = {"map": "arena.yaml", "slam": "False", "robot": "p3at", "namespace": namespace}
    launch.LaunchConfiguration.side_effect = lambda name: MagicMock(
        perform=lambda context: values[name]
    )
    launch.FindPackageShare.return_value.perform.return_value = str(nav2.parents[1])
    assert len(launch.bring_up(MagicMock())) == 3
    started = [
        dict(call.kwargs["launch_arguments"])
        for call in launch.IncludeLaunchDescription.call_args_list[-2:]
    ]
    assert all(one["use_namespace"] == use_namespace for one in started)
    all_nodes = launch.parameters(nav2, "p3at")
    assert read_once(started[0]["params_file"]) == all_nodes
    if namespace:  # in which "slam_toolbox" alone would be another node
        [call] = launch.SetParametersFromFile.call_args_list
        assert read_once(call.args[0]) == {"/**/slam_toolbox": all_nodes["slam_toolbox"]}


@pytest.mark.parametrize("world, spawned", [("arena", []), ("empty", ["--spawn", "turtle@0,0"])])
def test_a_robot_is_spawned_where_the_world_has_none(stand_ins, world, spawned):
    module = launch_file("sim")
    module.generate_launch_description()
    values = {"world": world, "robot": "turtle", "bag": "", "lcm": "memq://", "view": "false"}
    values["options"] = "--seed 7"
    module.LaunchConfiguration.side_effect = lambda name: MagicMock(
        perform=lambda context: values[name]
    )
    module.perform_substitutions.return_value = RUEDO
    [simulation] = module.simulation(MagicMock())
    words = [RUEDO, "run", world, "--ros2", "--watch-stdin", "--quiet", "--lcm", "memq://"]
    assert simulation.words == [*words, *spawned, "--seed", "7"]


def test_a_simulation_leaves_a_bag(stand_ins, tmp_path):
    from ruedo_ros import Simulation

    bag = tmp_path / "bag"
    simulation = Simulation("arena", bag=bag, arguments=["--duration", "1"])
    running = {"stdin": subprocess.PIPE}
    assert subprocess.Popen(simulation.words, **running).wait(120) == 0
    assert sorted(path.suffix for path in bag.iterdir()) == [".mcap", ".yaml"]
    assert subprocess.Popen(simulation.words, **running).wait(120) == 2  # it is there already


def ended(regression):
    """Runs it as launch does."""
    code = subprocess.run(regression.words, capture_output=True, timeout=120).returncode
    regression.on_exit(MagicMock(returncode=code), MagicMock())
    return regression


def test_the_referee_judges(stand_ins, tmp_path):
    from ruedo_ros import Regression

    stays = {"duration": 1.0, "arguments": ["--rate", "max", "--no-noise"]}
    good = ended(Regression("arena", no_contact=True, record=tmp_path / "run.lcm", **stays))
    good.assert_passed(0)
    assert (tmp_path / "run.lcm").stat().st_size > 0
    assert any("touched nothing" in one["text"] for one in good.verdict(0)["evidence"])
    bad = ended(Regression("arena", goal=(3.0, 0.0), **stays))
    with pytest.raises(AssertionError, match="failed: p3at was not within 0.3 m"):
        bad.assert_passed(0)
    with pytest.raises(RuntimeError, match="ended with 3"):
        ended(Regression("no_such_world", **stays)).verdict(0)
    with pytest.raises(RuntimeError, match="not ended within 0 s"):
        Regression("arena", **stays).verdict(0)


@pytest.mark.parametrize("robot", ["p3at", "turtle"])
def test_rviz_shows_topics_of_the_robot(robot):
    told = yaml.safe_load((PACKAGE / f"rviz/{robot}.rviz").read_text(encoding="utf-8"))
    model = SOURCE / f"worlds/robots/{robot}/model.sdf"
    command = [RUEDO, "run", model, "--ros2", "--lcm", "memq://", "--duration", "0.1"]
    printed = subprocess.run(command, capture_output=True, text=True, timeout=120).stdout
    topics = set(re.findall(r"-> (/\S+)", printed))
    for display in told["Visualization Manager"]["Displays"]:
        topic = display.get("Topic") or display.get("Description Topic")
        assert topic is None or topic["Value"] in topics, display["Name"]


@pytest.mark.parametrize("robot", ["p3at", "turtle"])
def test_parameters_are_the_robots(robot):
    """After a change of the robot: `ruedo nav2-params ROBOT > config/ROBOT.yaml`."""
    made = subprocess.run(
        [RUEDO, "nav2-params", robot], stdout=subprocess.PIPE, text=True, timeout=120, check=True
    ).stdout
    assert (PACKAGE / f"config/{robot}.yaml").read_text(encoding="utf-8") == made


NAV2 = """
controller_server: {ros__parameters: {failure_tolerance: 0.3, FollowPath: {vx_max: 0.5, critics: [CostCritic]}}}
local_costmap: {local_costmap: {ros__parameters: {robot_radius: 0.22, width: 3}}}
global_costmap: {global_costmap: {ros__parameters: {robot_radius: 0.22}}}
map_saver: {ros__parameters: {save_map_timeout: 5.0}}
"""


@pytest.fixture
def nav2(tmp_path):
    (tmp_path / "params").mkdir()
    file = tmp_path / "params/nav2_params.yaml"
    file.write_text(NAV2, encoding="utf-8")
    return file


def test_parameters_of_nav2_keep_what_the_robot_does_not_change(launch, nav2):
    told = launch.parameters(nav2, "p3at")
    controller = told["controller_server"]["ros__parameters"]
    assert controller["failure_tolerance"] == 0.3
    assert controller["FollowPath"]["critics"] == ["CostCritic"]
    assert controller["FollowPath"]["vx_max"] == 0.6
    local = told["local_costmap"]["local_costmap"]["ros__parameters"]
    assert local["width"] == 3 and "robot_radius" not in local and "footprint" in local
    assert told["map_saver"]["ros__parameters"] == {"save_map_timeout": 5.0}
    slam = told["slam_toolbox"]["ros__parameters"]
    assert slam["scan_topic"] == "/scan" and slam["loop_match_minimum_chain_size"] == 10
    round_one = launch.parameters(nav2, str(PACKAGE / "config/turtle.yaml"))
    local = round_one["local_costmap"]["local_costmap"]["ros__parameters"]
    assert local["robot_radius"] == 0.17 and "footprint" not in local


def test_slam_toolbox_reads_ruedos_frames():
    told = yaml.safe_load((PACKAGE / "config/slam_toolbox.yaml").read_text(encoding="utf-8"))
    parameters = told["slam_toolbox"]["ros__parameters"]
    frames = [parameters[f"{each}_frame"] for each in ("map", "odom", "base")]
    assert frames == ["map", "odom", "base_link"]
    assert parameters["use_sim_time"] is True and parameters["scan_topic"] == "/scan"
