"""Sends Nav2 to places of the map, and says where the robot really is at the end of each.

navigate.py NAMESPACE '[[X, Y], ...]'    (m, in map; prints one JSON line)

Nav2's initial guess is the robot's true pose at the start.
"""

import argparse
import json
import math
import time

import rclpy
from geometry_msgs.msg import Pose, PoseStamped
from nav2_simple_commander.robot_navigator import BasicNavigator, TaskResult
from nav_msgs.msg import Odometry
from rclpy.parameter import Parameter


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("namespace")
    parser.add_argument("goals", type=json.loads)
    options = parser.parse_args()
    rclpy.init()
    navigator = BasicNavigator(namespace=options.namespace)
    navigator.set_parameters([Parameter("use_sim_time", value=True)])
    # A node of its own: whenever that of the navigator wakes up, it repeats the initial guess.
    witness = rclpy.create_node("witness", namespace=options.namespace)
    truth: list[Odometry] = []
    witness.create_subscription(Odometry, "ground_truth", truth.append, 1)

    def true_pose() -> Pose:
        truth.clear()
        while not truth:
            rclpy.spin_once(witness)
        return truth[-1].pose.pose

    def stamped(pose: Pose) -> PoseStamped:
        place = PoseStamped()
        place.header.frame_id = "map"
        place.header.stamp = navigator.get_clock().now().to_msg()
        place.pose = pose
        return place

    navigator.setInitialPose(stamped(true_pose()))
    navigator.waitUntilNav2Active()
    done = []
    for x, y in options.goals:
        goal = stamped(Pose())
        goal.pose.position.x, goal.pose.position.y = float(x), float(y)
        goal.pose.orientation.w = 1.0
        began, sim_began = time.monotonic(), navigator.get_clock().now()
        navigator.goToPose(goal)
        while not navigator.isTaskComplete():
            pass
        sim_s = (navigator.get_clock().now() - sim_began).nanoseconds * 1e-9
        true_pose()  # what waited is older
        at = true_pose().position
        done.append(
            {
                "reached": navigator.getResult() == TaskResult.SUCCEEDED,
                "off_m": round(math.hypot(at.x - x, at.y - y), 3),
                "sim_s": round(sim_s, 1),
                "real_s": round(time.monotonic() - began, 1),
            }
        )
    print(json.dumps(done), flush=True)


if __name__ == "__main__":
    main()
