"""Nav2 (or slam_toolbox with it) and rviz2 beside `ruedo run WORLD --ros2`, for Jazzy and Kilted,
with Nav2's own parameters, and what config/ROBOT.yaml says of the robot.

    ruedo map worlds/arena.sdf -o arena.yaml
    ros2 launch ruedo_ros nav2.launch.py map:=arena.yaml
    ros2 launch ruedo_ros nav2.launch.py slam:=True robot:=turtle rviz:=False
"""

from pathlib import Path

import yaml
from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.conditions import IfCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from nav2_common.launch import RewrittenYaml

CONFIG = Path(__file__).resolve().parents[1] / "config"


def rewrites(robot: str) -> dict[str, str]:
    """What of Nav2's parameters is another for the robot."""
    told = yaml.safe_load((CONFIG / f"{robot}.yaml").read_text(encoding="utf-8"))
    return {name: str(value) for name, value in told.items()}


def bring_up(context: LaunchContext) -> list:
    bringup = FindPackageShare("nav2_bringup")
    parameters = RewrittenYaml(
        source_file=PathJoinSubstitution([bringup, "params", "nav2_params.yaml"]),
        param_rewrites=rewrites(LaunchConfiguration("robot").perform(context)),
        convert_types=True,
    )

    def include(name: str, arguments: dict, **options: object) -> IncludeLaunchDescription:
        source = PythonLaunchDescriptionSource(PathJoinSubstitution([bringup, "launch", name]))
        return IncludeLaunchDescription(source, launch_arguments=arguments.items(), **options)

    return [
        include(
            "bringup_launch.py",
            {
                "map": LaunchConfiguration("map"),
                "slam": LaunchConfiguration("slam"),
                "use_sim_time": "True",
                "params_file": parameters,
                "autostart": "True",
            },
        ),
        include(
            "rviz_launch.py",
            {"use_sim_time": "True"},
            condition=IfCondition(LaunchConfiguration("rviz")),
        ),
    ]


def generate_launch_description() -> LaunchDescription:
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "map", default_value="", description="made by `ruedo map WORLD -o map.yaml`"
            ),
            DeclareLaunchArgument(
                "slam", default_value="False", description="make the map by slam_toolbox instead"
            ),
            DeclareLaunchArgument("robot", default_value="p3at", description="p3at or turtle"),
            DeclareLaunchArgument("rviz", default_value="True", description="start rviz2"),
            # Ruedo's base_link is on the ground, where Nav2's parameters have base_footprint.
            Node(
                package="tf2_ros",
                executable="static_transform_publisher",
                parameters=[{"use_sim_time": True}],
                arguments=["--frame-id", "base_link", "--child-frame-id", "base_footprint"],
            ),
            OpaqueFunction(function=bring_up),
        ]
    )
