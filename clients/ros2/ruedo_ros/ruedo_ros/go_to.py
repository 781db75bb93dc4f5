"""Sends Nav2 to a place, from where the robot stands at the start of the world.

    ros2 run ruedo_ros go_to X Y    (m, in map)

Ends with 0 when Nav2 says that it is there.
"""

from __future__ import annotations

import sys


def main() -> int:
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from nav2_simple_commander.robot_navigator import BasicNavigator, TaskResult
    from rclpy.parameter import Parameter

    x, y = map(float, sys.argv[1:3])
    rclpy.init()
    navigator = BasicNavigator()
    navigator.set_parameters([Parameter("use_sim_time", value=True)])

    def place(x: float, y: float) -> PoseStamped:
        pose = PoseStamped()
        pose.header.frame_id = "map"
        pose.header.stamp = navigator.get_clock().now().to_msg()
        pose.pose.position.x, pose.pose.position.y = x, y
        pose.pose.orientation.w = 1.0
        return pose

    navigator.setInitialPose(place(0.0, 0.0))
    navigator.waitUntilNav2Active()
    navigator.goToPose(place(x, y))
    while not navigator.isTaskComplete():
        pass
    arrived = navigator.getResult() == TaskResult.SUCCEEDED
    rclpy.shutdown()
    return 0 if arrived else 1


if __name__ == "__main__":
    sys.exit(main())
