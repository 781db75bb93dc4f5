"""What of Nav2 a goal needs, and no more: a process with one executor thread for each server.

params_file: of nav2.launch.py's own; map. namespace: of one of several robots. localize:=False: the
map's frame is odometry's, the controller's commands go to cmd_vel_nav (lockstep.py), and time is
the wall's.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from nav2_common.launch import RewrittenYaml

SERVERS = {
    "map_server": ("nav2_map_server", "map_server"),
    "amcl": ("nav2_amcl", "amcl"),
    "planner_server": ("nav2_planner", "planner_server"),
    "controller_server": ("nav2_controller", "controller_server"),
    "bt_navigator": ("nav2_bt_navigator", "bt_navigator"),
}


def servers(context: LaunchContext) -> list[Node]:
    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    namespace, localize = value("namespace"), value("localize") == "True"
    file = RewrittenYaml(value("params_file"), param_rewrites={}, root_key=namespace)
    remappings = [("/tf", "tf"), ("/tf_static", "tf_static")] if namespace else []
    if not localize:
        remappings.append(("cmd_vel", "cmd_vel_nav"))
    names = [name for name in SERVERS if localize or name != "amcl"]
    nodes = [
        Node(
            package=SERVERS[name][0],
            executable=SERVERS[name][1],
            name=name,
            namespace=namespace,
            output="screen",
            parameters=[file, {"use_sim_time": localize}],
            remappings=remappings,
        )
        for name in names
    ]
    if not localize:
        frames = ["--frame-id", "map", "--child-frame-id", "odom"]
        nodes.append(
            Node(package="tf2_ros", executable="static_transform_publisher", arguments=frames)
        )
    manager = Node(
        package="nav2_lifecycle_manager",
        executable="lifecycle_manager",
        name="lifecycle_manager_navigation",
        namespace=namespace,
        output="screen",
        parameters=[{"autostart": True, "node_names": names, "bond_timeout": 0.0}],
    )
    return [*nodes, manager]


def generate_launch_description() -> LaunchDescription:
    defaults = {"params_file": None, "namespace": "", "localize": "True"}
    arguments = [
        DeclareLaunchArgument(name, default_value=value) for name, value in defaults.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=servers)])
