"""Nav2's own system tests, unchanged, with Ruedo in Gazebo's place.

nav2_system.py NAV2_SYSTEM_TESTS NAV2_MINIMAL_TB3_SIM [OPTION...] [TEST...]

The first two are folders of Nav2's sources. The programs that these tests start instead of a
simulator's (`gz`, ros_gz_sim's `create`, robot_state_publisher, whose frames Ruedo has) come from
an overlay that is made here. Prints a JSON line for each run of a test; ends with 1 if one failed.
For a busy machine: --rate (sim time per real time), --server-timeout (ms instead of their 20, and
no server is given up that is not heard for 4 s), --startup (s instead of the 10 that testers give
Nav2), --limit (s instead of 180 for a test).
Where MPPI is not built, regulated pure pursuit takes its place.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ament_index_python.packages import (
    get_package_share_directory,
    get_packages_with_prefixes,
)

RUEDO = os.environ.get("RUEDO", "ruedo")
RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
DWB = "dwb_core::DWBLocalPlanner"
OF_SYSTEM = {"PLANNER": "nav2_navfn_planner::NavfnPlanner", "TESTER": "nav_to_pose_tester_node.py"}
# As their CMakeLists.txt start them: the file, and the variables beside TEST_DIR.
TESTS = {
    "bt_navigator": (
        "src/system/test_system_launch.py",
        {**OF_SYSTEM, "ASTAR": "True", "CONTROLLER": RPP},
    ),
    "dynamic_obstacle": (
        "src/system/test_system_with_obstacle_launch.py",
        {**OF_SYSTEM, "ASTAR": "False", "CONTROLLER": DWB, "ADD_OBSTACLE": "True"},
    ),
    "waypoint_follower": ("src/waypoint_follower/test_case_py.launch", {}),
    "keepout_filter": (
        "src/costmap_filters/test_keepout_launch.py",
        {"ASTAR": "False", "TEST_MASK": "maps/keepout_mask.yaml"},
    ),
    "spin_recovery": ("src/behaviors/spin/test_spin_behavior.launch.py", {}),
    "backup_recovery": ("src/behaviors/backup/test_backup_behavior.launch.py", {}),
}
NOTHING = "from launch import LaunchDescription\n\n\ndef generate_launch_description():\n    return LaunchDescription()\n"
GZ = """#!/bin/sh
# gz sim -r -s WORLD
unset LD_LIBRARY_PATH LD_PRELOAD AMENT_PREFIX_PATH
for world; do :; done
exec {ruedo} run "$world" --ros2 --lcm memq:// --quiet --remap /initialpose=/set_pose \\
  --spawn {robot}@-2,-0.5 --rate {rate}
"""
CREATE = """#!/bin/sh
# create -entity cardboard_box -file ... -x X -y Y ...; its model is on a server of Gazebo's
exec ros2 service call /spawn_entity simulation_interfaces/srv/SpawnEntity "{name: cardboard_box,
  initial_pose: {header: {frame_id: world}, pose: {position: {x: $6, y: $8, z: 0.15}}},
  resource_string: '<sdf version=\\"1.7\\"><model name=\\"box\\"><link name=\\"l\\">
  <collision name=\\"c\\"><geometry><box><size>0.5 0.4 0.3</size></box></geometry></collision>
  </link></model></sdf>'}"
"""


def program(file: Path, text: str) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    file.chmod(0o755)


def overlay(prefix: Path, options: argparse.Namespace) -> None:
    share = prefix / "share"
    index = share / "ament_index/resource_index/packages"
    index.mkdir(parents=True)
    packages = {
        "nav2_minimal_tb3_sim": options.simulation,
        "nav2_system_tests": options.tests,
        "nav2_bringup": get_package_share_directory("nav2_bringup"),
    }
    for name, folder in packages.items():
        shutil.copytree(folder, share / name)
    for package in (*packages, "ros_gz_sim", "robot_state_publisher"):
        (index / package).touch()
    for file in (share / "nav2_system_tests").rglob("*.py"):
        file.write_text(
            file.read_text().replace("time.sleep(10)", f"time.sleep({options.startup})")
        )
    if options.server_timeout:
        for file in (share / "nav2_bringup/launch").glob("*.py"):
            manager = "parameters=[{'autostart': autostart"
            file.write_text(file.read_text().replace(manager, f"{manager}, 'bond_timeout': 0.0"))
    for file in share.rglob("*params.yaml"):
        text = file.read_text()
        if options.server_timeout:
            text = re.sub(r"\n +default_server_timeout: .*", "", text)
            head = "\nbt_navigator:\n  ros__parameters:\n"
            own = f"{head}    default_server_timeout: {options.server_timeout}\n"
            text = text.replace(head, f"{own}    wait_for_service_timeout: 60000\n")
        if "nav2_mppi_controller" not in get_packages_with_prefixes():
            text = text.replace("nav2_mppi_controller::MPPIController", RPP)
        file.write_text(text)
    simulation = share / "nav2_minimal_tb3_sim"
    (simulation / "launch/spawn_tb3.launch.py").write_text(NOTHING)
    robot = simulation / "urdf/gz_waffle.sdf.xacro"
    program(prefix / "bin/gz", GZ.format(ruedo=RUEDO, robot=robot, rate=options.rate))
    program(prefix / "lib/ros_gz_sim/create", CREATE)
    waits = "#!/bin/sh\nexec sleep 1000\n"
    program(prefix / "lib/robot_state_publisher/robot_state_publisher", waits)


def run(name: str, prefix: Path, log: Path, limit_s: float) -> dict:
    file, variables = TESTS[name]
    tests = prefix / "share/nav2_system_tests"
    file = tests / file
    environment = {
        **os.environ,
        "TEST_DIR": str(file.parent),
        "BT_NAVIGATOR_XML": "navigate_to_pose_w_replanning_and_recovery.xml",
        **variables,
        "AMENT_PREFIX_PATH": f"{prefix}:{os.environ['AMENT_PREFIX_PATH']}",
        "PATH": f"{prefix}/bin:{os.environ['PATH']}",
    }
    if mask := variables.get("TEST_MASK"):
        environment["TEST_MASK"] = str(tests / mask)
    began = time.monotonic()
    with log.open("w") as out:
        process = subprocess.Popen(
            [sys.executable, file],
            env=environment,
            stdout=out,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        try:
            code = process.wait(limit_s)
        except subprocess.TimeoutExpired:
            code = "timeout"
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    seconds = round(time.monotonic() - began)
    return {"test": name, "passed": code == 0, "code": code, "real_s": seconds, "log": str(log)}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tests", type=Path)
    parser.add_argument("simulation", type=Path)
    parser.add_argument("names", nargs="*", choices=[[], *TESTS], metavar="TEST")
    parser.add_argument("--times", type=int, default=1)
    parser.add_argument("--rate", type=float, default=1.0)
    parser.add_argument("--server-timeout", type=int)
    parser.add_argument("--startup", type=float, default=10)
    parser.add_argument("--limit", type=float, default=180)
    options = parser.parse_intermixed_args()
    folder = Path(tempfile.mkdtemp(prefix="nav2-system-"))
    overlay(folder / "overlay", options)
    failed = 0
    for time_ in range(options.times):
        for name in options.names or TESTS:
            log = folder / f"{name}.{time_}.log"
            answer = run(name, folder / "overlay", log, options.limit)
            failed += not answer["passed"]
            print(json.dumps(answer), flush=True)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
