"""Nav2 and slam_toolbox beside a run, by the launch files and parameters of ruedo_ros.

At real time or less, on two cores: each robot has a Nav2 of its own. The referee is the true pose.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from ament_index_python.packages import get_package_share_directory
from ros import MIDDLEWARES, Ros, needs
from server import PATIENCE, RUEDO, SOURCE, Run, new_domain

HERE = Path(__file__).parent
CONFIG = SOURCE / "clients/ros2/ruedo_ros/config"
RPP = {"plugin": "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"}
NAVFN = {"plugin": "nav2_navfn_planner::NavfnPlanner"}
THETA_STAR = {"plugin": "nav2_theta_star_planner::ThetaStarPlanner"}
DWB = {  # with the critics and scales of Nav2's guide
    "plugin": "dwb_core::DWBLocalPlanner",
    "critics": [
        *("RotateToGoal", "Oscillation", "BaseObstacle"),
        *("GoalAlign", "PathAlign", "PathDist", "GoalDist"),
    ],
    **{f"{name}.scale": 32.0 for name in ("RotateToGoal", "PathAlign", "PathDist")},
    **{f"{name}.scale": 24.0 for name in ("GoalAlign", "GoalDist")},
    **{f"{name}.forward_point_distance": 0.1 for name in ("PathAlign", "GoalAlign")},
    "BaseObstacle.scale": 0.02,
}
PROCESSES = ["use_composition:=False"]  # a process for each of Nav2's servers
TOLERANCE_M = 0.25 + 0.15  # Nav2's own, and AMCL's error
OF_NAV2 = ("ruedo_ros", "nav2_bringup", "nav2_simple_commander")


def of_ruedo(*words):
    return subprocess.run(
        [RUEDO, *map(str, words)], check=True, capture_output=True, text=True, timeout=PATIENCE
    ).stdout


def map_of(world, folder, height=0.2):
    of_ruedo("map", world, "--height", height, "-o", folder / "map.yaml")
    return folder / "map.yaml"


def parameters(folder, *robot, controller=RPP, planner=NAVFN):
    """A file for nav2.launch.py's robot:=, as `ruedo nav2-params` writes it, for that plugins."""
    nodes = yaml.safe_load(of_ruedo("nav2-params", *robot))
    nodes["controller_server"]["ros__parameters"]["FollowPath"].update(controller)
    nodes["planner_server"] = {"ros__parameters": {"GridBased": planner}}
    patience = {"default_server_timeout": 20000, "wait_for_service_timeout": 60000}  # ms, real time
    nodes["bt_navigator"] = {"ros__parameters": patience}
    file = folder / f"{robot[-1]}.yaml"
    file.write_text(yaml.safe_dump(nodes))
    return file


@contextlib.contextmanager
def launched(ros, log, *words):
    """`ros2 launch`, which ends with the block."""
    with log.open("w") as out:
        process = subprocess.Popen(
            ["ros2", "launch", *map(str, words)],
            env=ros.environment,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(30)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def script(ros, name, *words):
    """A process of one of the programs beside this file."""
    return subprocess.Popen(
        [sys.executable, HERE / name, *map(str, words)],
        env=ros.environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def answer(process):
    """The JSON of its last line."""
    try:
        lines = process.communicate(timeout=4 * PATIENCE)[0].splitlines()
    except subprocess.TimeoutExpired:
        process.kill()
        raise
    assert process.returncode == 0 and lines
    print(lines[-1])
    return json.loads(lines[-1])


def arrived(goals, tolerance_m=TOLERANCE_M):
    return all(goal["reached"] and goal["off_m"] <= tolerance_m for goal in goals)


@needs(*OF_NAV2)
def test_goals_are_reached(tmp_path):
    robot = parameters(tmp_path, "p3at")
    words = ["ruedo_ros", "nav2.launch.py", f"map:={map_of('arena', tmp_path)}", *PROCESSES]
    with Run("--rate", "0.5", "--remap", "/initialpose=/set_pose", lcm="memq://") as run:
        ros = Ros(run, MIDDLEWARES[0])
        with launched(ros, tmp_path / "nav2.log", *words, f"robot:={robot}", "rviz:=False"):
            assert arrived(answer(script(ros, "navigate.py", "", [[-3.5, 0.0], [-1.0, -3.8]])))


def merged(base, over):
    both = {**base, **over}
    for name in base.keys() & over.keys():
        if isinstance(base[name], dict) and isinstance(over[name], dict):
            both[name] = merged(base[name], over[name])
    return both


def of_servers(folder, world, *robot, **plugins):
    """Parameters for servers.launch.py, in which the tree plans once."""
    share = {
        name: Path(get_package_share_directory(f"nav2_{name}"))
        for name in ("bringup", "bt_navigator")
    }
    nodes = yaml.safe_load((share["bringup"] / "params/nav2_params.yaml").read_text())
    nodes = merged(nodes, yaml.safe_load(parameters(folder, *robot, **plugins).read_text()))
    nodes["map_server"] = {"ros__parameters": {"yaml_filename": str(map_of(world, folder))}}
    tree = (
        share["bt_navigator"] / "behavior_trees/navigate_w_replanning_only_if_goal_is_updated.xml"
    )
    navigator = nodes["bt_navigator"]["ros__parameters"]
    navigator |= {"navigators": ["navigate_to_pose"], "default_nav_to_pose_bt_xml": str(tree)}
    for costmap in ("local_costmap", "global_costmap"):
        nodes[costmap][costmap]["ros__parameters"].pop("robot_radius", None)
    return nodes


def written(nodes, file):
    file.write_text(yaml.safe_dump(nodes))
    return file


@needs("nav2_theta_star_planner", "dwb_critics", "dwb_plugins", *OF_NAV2)
def test_goals_are_reached_by_another_planner_and_controller(tmp_path):
    nodes = of_servers(tmp_path, "arena", "p3at", planner=THETA_STAR, controller=DWB)
    file = written(nodes, tmp_path / "servers.yaml")
    with Run("--rate", "0.3", "--remap", "/initialpose=/set_pose", lcm="memq://") as run:
        ros = Ros(run, MIDDLEWARES[0])
        words = [HERE / "servers.launch.py", f"params_file:={file}"]
        with launched(ros, tmp_path / "nav2.log", *words):
            assert arrived(answer(script(ros, "navigate.py", "", [[-3.5, 0.0], [-1.0, -3.8]])))


FLEET = SOURCE / "worlds/fleet.sdf"
ACROSS = {"alice": [[-6.0, 4.0]], "bob": [[-6.0, -4.5]], "carol": [[6.0, 4.5]]}


@needs(*OF_NAV2)
def test_three_robots_navigate_at_once(tmp_path):
    remaps = [
        word for name in ACROSS for word in ("--remap", f"/{name}/initialpose=/{name}/set_pose")
    ]
    words = ["--rate", "0.2", "--ros2-tf", "namespaced", *remaps]
    with Run(*words, world=FLEET, lcm="memq://") as run:
        ros = Ros(run, MIDDLEWARES[0])
        with contextlib.ExitStack() as stack:
            ready = []
            for name in ACROSS:
                nodes = of_servers(tmp_path, FLEET, FLEET, "--robot", name)
                controller = nodes["controller_server"]["ros__parameters"]
                controller["controller_frequency"] = 5.0  # of real time
                file = written(nodes, tmp_path / f"{name}.servers.yaml")
                words = [HERE / "servers.launch.py", f"namespace:={name}", f"params_file:={file}"]
                stack.enter_context(launched(ros, tmp_path / f"{name}.log", *words))
                ready.append(script(ros, "navigate.py", name, ACROSS[name]))
                stack.callback(ready[-1].kill)
                assert ready[-1].stdout.readline() == "active\n"
            for process in ready:
                process.stdin.write("go\n")
                process.stdin.flush()
            # Each AMCL also sees the other robots, which are in no map.
            goals = [answer(process) for process in ready]
            assert all(arrived(each, TOLERANCE_M + 0.1) for each in goals)


ROUTES = {
    "arena": [
        *([0, 3.7], [3.8, 3.7], [4.3, 0.4], [4.2, -3.8], [-3.9, -3.8], [-3.9, 1.5], [-2, 2.9]),
        *([-2, 4], [0, 3.7], [0, 0]),
    ],
    "rooms": [
        *([2, 0], [2, 3], [2, 0], [2, -3], [2, 0], [6, 0], [6, 3], [6, 0], [6, -2.2], [6, 0]),
        *([10, 0], [10, 2.2], [10, 0], [10, -3], [10, 0], [2, 0]),
    ],
}


@needs("slam_toolbox", "ruedo_ros")
@pytest.mark.parametrize("world", ROUTES)
def test_slam_gives_the_true_map(tmp_path, world):
    settings = f"slam_params_file:={CONFIG / 'slam_toolbox.yaml'}"
    words = ["slam_toolbox", "online_sync_launch.py", settings]
    file = map_of(world, tmp_path, height=0.39)  # as the scanner sees it
    with Run("--rate", "0.5", world=SOURCE / f"worlds/{world}.sdf", lcm="memq://") as run:
        ros = Ros(run, MIDDLEWARES[0])
        with launched(ros, tmp_path / "slam.log", *words):
            found = answer(script(ros, "survey.py", file, ROUTES[world]))
    assert min(found["right"], found["walls"], found["found"]) >= 0.95
    assert found["off_m"] <= 0.1


@needs("slam_toolbox", *OF_NAV2)
def test_goals_are_reached_while_slam_maps(tmp_path):
    robot = parameters(tmp_path, "p3at")
    words = ["ruedo_ros", "nav2.launch.py", "slam:=True", f"robot:={robot}", "rviz:=False"]
    words += PROCESSES
    with Run("--rate", "0.5", lcm="memq://") as run:
        ros = Ros(run, MIDDLEWARES[0])
        with launched(ros, tmp_path / "nav2.log", *words):
            goals = [[1.0, 3.7], [-2.0, 4.0]]  # each in the map that there is by then
            assert arrived(answer(script(ros, "navigate.py", "--slam", "", goals)))


def of_lockstep(folder, wall_hz=100, run_hz=20):
    """Parameters for servers.launch.py: the controller looks wall_hz times a second of real time
    whether the run has gone on by 1 / run_hz."""
    nodes = of_servers(folder, "arena", "p3at")
    controller = nodes["controller_server"]["ros__parameters"]
    controller |= {"controller_frequency": float(wall_hz), "enable_stamped_cmd_vel": True}
    # RPP takes the wall's period for that between two of its commands.
    controller["FollowPath"]["max_angular_accel"] *= wall_hz / run_hz
    # The costmap is updated by the wall's clock: no speed may depend on it.
    controller["FollowPath"]["use_cost_regulated_linear_velocity_scaling"] = False
    return written(nodes, folder / "lockstep.yaml")


def lockstep(folder, load):
    """The path and the verdict of one goal."""
    folder.mkdir()
    verdict = folder / "verdict.json"
    ros = Ros(SimpleNamespace(domain=new_domain()), MIDDLEWARES[0])
    words = [RUEDO, "regress", "arena", "--ros2", "--shared-network", "--duration", "45"]
    words += ["--goal", "-3.5,0,0.5,45", "--no-contact", "--wait-for", "/cmd_vel@20"]
    hidden = ("AMENT_PREFIX_PATH", "LD_LIBRARY_PATH")  # Ruedo needs no ROS
    environment = {name: text for name, text in ros.environment.items() if name not in hidden}
    settings = f"params_file:={of_lockstep(folder)}"
    with contextlib.ExitStack() as stack:
        for _ in range(load):
            busy = stack.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            stack.callback(busy.kill)
        stack.enter_context(
            launched(
                ros, folder / "nav2.log", HERE / "servers.launch.py", settings, "localize:=False"
            )
        )
        going = script(ros, "lockstep.py", -3.5, 0.0)
        stack.callback(going.kill)
        with (folder / "ruedo.log").open("w") as log:
            began = time.monotonic()
            subprocess.run(
                [*words, "--json", verdict], env=environment, stdout=log, timeout=4 * PATIENCE
            )
        found = json.loads(going.stdout.readline())
    told = json.loads(verdict.read_text())
    taken = time.monotonic() - began
    print(f"{told['outcome']}, {taken:.0f} s, load {os.getloadavg()[0]:.0f}", *found["path"][-1])
    return found["reached"], told["outcome"], np.array(found["path"])


def apart(one, other):
    """The largest distance of a point of one path from the other path, in m."""
    begin, step = other[:-1], np.diff(other, axis=0)
    along = ((one[:, None] - begin) * step).sum(2) / np.maximum((step**2).sum(1), 1e-12)
    nearest = begin + step * np.clip(along, 0, 1)[..., None]
    return np.hypot(*(one[:, None] - nearest).T).min(0).max()


@needs(*OF_NAV2)
def test_a_goal_is_repeatable(tmp_path):
    """RUEDO_NAV2_RUNS runs, every second of them beside RUEDO_NAV2_LOAD busy processes."""
    count, busy = (
        int(os.environ.get(f"RUEDO_NAV2_{name}", default))
        for name, default in (("RUNS", 2), ("LOAD", 8))
    )
    runs = [lockstep(tmp_path / str(number), busy * (number % 2)) for number in range(count)]
    assert all(reached and outcome == "passed" for reached, outcome, _ in runs)
    worst = max(apart(path, runs[0][2]) for _, _, path in runs)
    print(f"{count} runs: at most {1000 * worst:.1f} mm apart")
    assert worst <= 0.01
