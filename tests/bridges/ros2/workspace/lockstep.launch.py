"""What of Nav2 a goal needs, on a map whose frame is odometry's; the controller's commands go to
lockstep.py. params_file: of nav2.launch.py's own; map."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

SERVERS = {
    "map_server": ("nav2_map_server", "map_server"),
    "planner_server": ("nav2_planner", "planner_server"),
    "controller_server": ("nav2_controller", "controller_server"),
    "bt_navigator": ("nav2_bt_navigator", "bt_navigator"),
}


def generate_launch_description():
    file = LaunchConfiguration("params_file")
    nodes = [
        Node(
            package=package,
            executable=executable,
            name=name,
            output="screen",
            parameters=[file],
            remappings=[("cmd_vel", "cmd_vel_nav")] if name == "controller_server" else [],
        )
        for name, (package, executable) in SERVERS.items()
    ]
    manager = Node(
        package="nav2_lifecycle_manager",
        executable="lifecycle_manager",
        name="lifecycle_manager_navigation",
        output="screen",
        parameters=[{"autostart": True, "node_names": list(SERVERS), "bond_timeout": 0.0}],
    )
    frames = Node(
        package="tf2_ros",
        executable="static_transform_publisher",
        arguments=["--frame-id", "map", "--child-frame-id", "odom"],
    )
    return LaunchDescription([DeclareLaunchArgument("params_file"), frames, *nodes, manager])
