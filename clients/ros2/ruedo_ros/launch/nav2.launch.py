"""Nav2 (or slam_toolbox with it) and rviz2 beside `ruedo run WORLD --ros2`, for Jazzy and Kilted.

    ruedo map worlds/arena.sdf -o arena.yaml
    ros2 launch ruedo_ros nav2.launch.py map:=arena.yaml
    ros2 launch ruedo_ros nav2.launch.py slam:=True robot:=turtle rviz:=False

The parameters are Nav2's own, with those of slam_toolbox (config/slam_toolbox.yaml) and of the
robot merged into them. robot: p3at, turtle, or a file that `ruedo nav2-params ROBOT` wrote.
Of several robots each has its own Nav2: namespace:=alice robot:=alice.yaml.
"""

import os
import tempfile
from pathlib import Path

import yaml
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    GroupAction,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, PushRosNamespace, SetParametersFromFile, SetRemap
from launch_ros.substitutions import FindPackageShare

CONFIG = Path(__file__).resolve().parents[1] / "config"


def read(file: Path) -> dict:
    return yaml.safe_load(file.read_text(encoding="utf-8"))


def merged(base: dict, over: dict) -> dict:
    """base, with the values of over; a list or value of it replaces that of base."""
    both = {**base, **over}
    for name in base.keys() & over.keys():
        if isinstance(base[name], dict) and isinstance(over[name], dict):
            both[name] = merged(base[name], over[name])
    return both


def parameters(nav2: Path, robot: str) -> dict:
    """nav2: its nav2_params.yaml; robot: a name in config/, or a file."""
    of_robot = Path(robot) if robot.endswith((".yaml", ".yml")) else CONFIG / f"{robot}.yaml"
    both = merged(read(nav2), read(CONFIG / "slam_toolbox.yaml"))
    both = merged(both, read(of_robot))
    for costmap in ("local_costmap", "global_costmap"):
        values = both[costmap][costmap]["ros__parameters"]
        if "footprint" in values:
            values.pop("robot_radius", None)
    return both


def written(nodes: dict) -> str:
    """The file, which outlives the launch as those of nav2_common do."""
    handle, file = tempfile.mkstemp(prefix="nav2-", suffix=".yaml")
    with os.fdopen(handle, "w", encoding="utf-8") as out:
        yaml.safe_dump(nodes, out)
    return file


def bring_up(context: LaunchContext) -> list:
    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    bringup = Path(FindPackageShare("nav2_bringup").perform(context))
    all_nodes = parameters(bringup / "params/nav2_params.yaml", value("robot"))
    namespace = value("namespace")
    spaced = {"namespace": namespace, "use_namespace": str(bool(namespace)), "use_sim_time": "True"}

    def include(name: str, arguments: dict, **options: object) -> IncludeLaunchDescription:
        source = PythonLaunchDescriptionSource(str(bringup / "launch" / name))
        return IncludeLaunchDescription(source, launch_arguments=arguments.items(), **options)

    # Ruedo's base_link is on the ground, where some of Nav2's parameters have base_footprint.
    ground = Node(
        package="tf2_ros",
        executable="static_transform_publisher",
        parameters=[{"use_sim_time": True}],
        arguments=["--frame-id", "base_link", "--child-frame-id", "base_footprint"],
    )
    in_namespace, for_slam = [], []
    if namespace:
        in_namespace = [PushRosNamespace(namespace), SetRemap("/tf_static", "tf_static")]
        # Nav2's launch file gives slam_toolbox the file as it is, in which the name without a
        # namespace is another node's.
        of_slam = {"/**/slam_toolbox": all_nodes["slam_toolbox"]}
        for_slam = [SetParametersFromFile(written(of_slam))]
    navigation = include(
        "bringup_launch.py",
        {
            **spaced,
            "map": value("map"),
            "slam": value("slam"),
            "params_file": written(all_nodes),
            "autostart": "True",
        },
    )
    return [
        GroupAction([*in_namespace, ground]),
        GroupAction([*for_slam, navigation]),
        include("rviz_launch.py", spaced, condition=IfCondition(LaunchConfiguration("rviz"))),
    ]


def generate_launch_description() -> LaunchDescription:
    def argument(name: str, default: str, text: str) -> DeclareLaunchArgument:
        return DeclareLaunchArgument(name, default_value=default, description=text)

    return LaunchDescription(
        [
            argument("map", "", "made by `ruedo map WORLD -o map.yaml`"),
            argument("slam", "False", "make the map by slam_toolbox instead"),
            argument("robot", "p3at", "p3at, turtle, or a file made by `ruedo nav2-params ROBOT`"),
            argument("namespace", "", "of the robot, where there are several"),
            argument("rviz", "True", "start rviz2"),
            OpaqueFunction(function=bring_up),
        ]
    )
