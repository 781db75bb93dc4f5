"""Sends Nav2 to places of the map, and says where the robot really is at the end of each.

navigate.py [--slam] NAMESPACE '[[X, Y], ...]'    (m, in map; prints one JSON line)

Nav2's initial guess is the robot's true pose at the start. With --slam there is none, and the robot
drives ahead for 0.6 m: the first map leaves out what is not ahead, as the robot's own place, and
slam_toolbox waits for 0.5 m. When Nav2 is active this prints a line, and waits for one on its
standard input, or its end.
"""

import argparse
import json
import math
import sys
import time

import rclpy
from geometry_msgs.msg import Pose, PoseStamped, Twist, Vector3
from nav2_simple_commander.robot_navigator import BasicNavigator, TaskResult
from nav_msgs.msg import Odometry
from rclpy.parameter import Parameter


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--slam", action="store_true")
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

    def true_pose() -> tuple[Pose, float]:
        """Where it is, and the sim time."""
        truth.clear()
        while not truth:
            rclpy.spin_once(witness)
        stamp = truth[-1].header.stamp
        return truth[-1].pose.pose, stamp.sec + 1e-9 * stamp.nanosec

    def stamped(pose: Pose) -> PoseStamped:
        place = PoseStamped()
        place.header.frame_id = "map"
        place.header.stamp = navigator.get_clock().now().to_msg()
        place.pose = pose
        return place

    def place(x: float, y: float) -> PoseStamped:
        goal = stamped(Pose())
        goal.pose.position.x, goal.pose.position.y = float(x), float(y)
        goal.pose.orientation.w = 1.0
        return goal

    if options.slam:
        navigator.waitUntilNav2Active(localizer="robot_localization")  # none to wait for
        drive = witness.create_publisher(Twist, "cmd_vel", 1)
        start = true_pose()[0].position.x
        while true_pose()[0].position.x < start + 0.6:
            drive.publish(Twist(linear=Vector3(x=0.3)))
        drive.publish(Twist())
        while navigator.getPath(PoseStamped(), place(*options.goals[0])) is None:
            true_pose()
    else:
        navigator.setInitialPose(stamped(true_pose()[0]))
        navigator.waitUntilNav2Active()
    print("active", flush=True)
    sys.stdin.readline()
    done = []
    for x, y in options.goals:
        goal = place(x, y)
        true_pose()  # what waited is older
        began, sim_began = time.monotonic(), true_pose()[1]
        navigator.goToPose(goal)
        while not navigator.isTaskComplete():
            pass
        true_pose()
        pose, ended = true_pose()
        done.append(
            {
                "reached": navigator.getResult() == TaskResult.SUCCEEDED,
                "off_m": round(math.hypot(pose.position.x - x, pose.position.y - y), 3),
                "sim_s": round(ended - sim_began, 1),
                "real_s": round(time.monotonic() - began, 1),
            }
        )
    print(json.dumps(done), flush=True)


if __name__ == "__main__":
    main()
