"""The launch and parameter files of docs/ros2.md: they are there, parse, and fit the robots.

ROS 2's launch packages cannot be had here: what stands for them takes any call.
"""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path
from unittest.mock import MagicMock

import pytest
import yaml

SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[3]))
RUEDO = os.environ.get("RUEDO", str(SOURCE / "build/release/bin/ruedo"))
CLIENTS = SOURCE / "clients/ros2"
PACKAGES = (
    "launch",
    "launch.actions",
    "launch.launch_description_sources",
    "launch.substitutions",
    "launch_ros",
    "launch_ros.actions",
    "launch_ros.substitutions",
    "nav2_common",
    "nav2_common.launch",
)


@pytest.fixture
def launch(monkeypatch):
    for package in PACKAGES:
        monkeypatch.setitem(sys.modules, package, MagicMock())
    path = CLIENTS / "ruedo_nav2.launch.py"
    spec = importlib.util.spec_from_file_location("ruedo_nav2", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_names_files_that_are_there():
    page = (SOURCE / "docs/ros2.md").read_text(encoding="utf-8")
    named = set(re.findall(r"clients/ros2/[\w.]+", page))
    assert {CLIENTS / Path(name).name for name in named} <= set(CLIENTS.iterdir())
    assert len(named) >= 4


def test_everything_is_launched(launch):
    launch.generate_launch_description()
    launch.LaunchConfiguration.return_value.perform.return_value = "p3at"
    assert len(launch.bring_up(MagicMock())) == 2
    assert launch.RewrittenYaml.call_args.kwargs["param_rewrites"]["robot_radius"] == "0.38"


@pytest.mark.parametrize("robot", ["p3at", "turtle"])
def test_parameters_are_the_robots(launch, robot):
    told = {name: float(value) for name, value in launch.rewrites(robot).items()}
    model = SOURCE / f"worlds/robots/{robot}/model.sdf"
    info = subprocess.run(
        [RUEDO, "info", model], stdout=subprocess.PIPE, text=True, timeout=120, check=True
    ).stdout
    speed, turn = re.search(r"drive, ([\d.]+) m/s, ([\d.]+) rad/s", info).groups()
    assert told["controller_server.ros__parameters.FollowPath.vx_max"] == float(speed)
    assert told["controller_server.ros__parameters.FollowPath.wz_max"] == float(turn)
    assert told["behavior_server.ros__parameters.max_rotational_vel"] == float(turn)
    assert 0.1 < told["robot_radius"] < 0.5


def test_slam_toolbox_reads_ruedos_frames():
    told = yaml.safe_load((CLIENTS / "slam_toolbox.yaml").read_text(encoding="utf-8"))
    parameters = told["slam_toolbox"]["ros__parameters"]
    frames = [parameters[f"{each}_frame"] for each in ("map", "odom", "base")]
    assert frames == ["map", "odom", "base_link"]
    assert parameters["use_sim_time"] is True and parameters["scan_topic"] == "/scan"
