"""Nav2 (or slam_toolbox with it) and rviz2 beside `ruedo run WORLD --ros2`, for Jazzy and Kilted,
with Nav2's own parameters.

    # Ruedo map worlds/arena.sdf -o arena.yaml
    ros2 launch clients/ros2/ruedo_nav2.launch.py map:=arena.yaml
    ros2 launch clients/ros2/ruedo_nav2.launch.py slam:=True

Written from Nav2's documentation; nobody has run it with a real ROS 2 yet.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare
from nav2_common.launch import RewrittenYaml


def generate_launch_description() -> LaunchDescription:
    bringup = FindPackageShare("nav2_bringup")
    defaults = PathJoinSubstitution([bringup, "params", "nav2_params.yaml"])
    # A P3-AT is larger than the TurtleBot that Nav2's parameters are for; 0.22 is right for a
    # TurtleBot.
    parameters = RewrittenYaml(
        source_file=defaults,
        param_rewrites={"robot_radius": LaunchConfiguration("robot_radius")},
        convert_types=True,
    )

    def include(name: str, arguments: dict) -> IncludeLaunchDescription:
        source = PythonLaunchDescriptionSource(PathJoinSubstitution([bringup, "launch", name]))
        return IncludeLaunchDescription(source, launch_arguments=arguments.items())

    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "map", default_value="", description="made by `ruedo map WORLD -o map.yaml`"
            ),
            DeclareLaunchArgument(
                "slam", default_value="False", description="make the map by slam_toolbox instead"
            ),
            DeclareLaunchArgument("robot_radius", default_value="0.38", description="m"),
            # Ruedo's base_link is on the ground, where Nav2's parameters have base_footprint.
            Node(
                package="tf2_ros",
                executable="static_transform_publisher",
                parameters=[{"use_sim_time": True}],
                arguments=["--frame-id", "base_link", "--child-frame-id", "base_footprint"],
            ),
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
            include("rviz_launch.py", {"use_sim_time": "True"}),
        ]
    )
