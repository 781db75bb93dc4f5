"""Stands between Nav2's controller and a run with `--wait-for /cmd_vel@20`, and sends one goal.

lockstep.py X Y    (m, in map; prints one JSON line with the robot's true path)

The run stands still at each k/20 s until a command comes. The controller works by the wall's clock
and may see the robot where it was: a command passes only if the pose that it is for (its stamp) is
the newest of that moment. Without a goal the robot stands; the run goes on in real time then.
"""

import json
import sys

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from nav2_msgs.action import NavigateToPose
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock

RATE_HZ, POSES_HZ = 20, 50  # of commands, of odometry


class Lockstep(Node):
    def __init__(self, x: float, y: float):
        super().__init__("lockstep", parameter_overrides=[Parameter("use_sim_time", value=True)])
        self.goal = (x, y)
        self.sent, self.now_us = 0, 0
        self.asked = self.navigating = False
        self.reached = None
        self.path: list[tuple[float, float]] = []
        self.command = self.create_publisher(Twist, "cmd_vel", 10)
        self.create_subscription(TwistStamped, "cmd_vel_nav", self.decided, 10)
        self.create_subscription(Clock, "/clock", self.ticked, qos_profile_sensor_data)
        self.create_subscription(Odometry, "ground_truth", self.moved, 1000)
        self.action = ActionClient(self, NavigateToPose, "navigate_to_pose")
        self.create_timer(1 / RATE_HZ, self.wait, clock=rclpy.clock.Clock())

    def due(self) -> bool:
        """Whether the run waits for the next command."""
        return self.now_us >= self.sent * 1_000_000 // RATE_HZ

    def send(self, twist: Twist) -> None:
        self.sent += 1
        self.command.publish(twist)

    def ticked(self, clock: Clock) -> None:
        self.now_us = clock.clock.sec * 1_000_000 + clock.clock.nanosec // 1000
        if self.reached is not None and self.due():
            self.send(Twist())

    def wait(self) -> None:
        if self.navigating or not self.command.get_subscription_count():
            return
        if self.due():
            self.send(Twist())
        if not self.asked and self.action.server_is_ready():
            self.asked = True
            goal = NavigateToPose.Goal()
            goal.pose.header.frame_id = "map"
            goal.pose.pose.position.x, goal.pose.pose.position.y = self.goal
            goal.pose.pose.orientation.w = 1.0
            self.action.send_goal_async(goal).add_done_callback(self.accepted)

    def accepted(self, future) -> None:
        handle = future.result()
        self.asked = self.navigating = handle.accepted  # while it is not active: ask again
        if handle.accepted:
            handle.get_result_async().add_done_callback(self.ended)

    def ended(self, future) -> None:
        self.navigating = False
        self.reached = future.result().status == 4  # SUCCEEDED
        if self.due():
            self.send(Twist())

    def decided(self, command: TwistStamped) -> None:
        stamp_us = command.header.stamp.sec * 1_000_000 + command.header.stamp.nanosec // 1000
        boundary_us = self.sent * 1_000_000 // RATE_HZ
        newest_us = boundary_us - boundary_us % (1_000_000 // POSES_HZ)
        if self.navigating and self.due() and stamp_us >= newest_us:
            self.send(command.twist)

    def moved(self, truth: Odometry) -> None:
        if self.navigating:
            self.path.append((truth.pose.pose.position.x, truth.pose.pose.position.y))


rclpy.init()
node = Lockstep(*map(float, sys.argv[1:3]))
while node.reached is None:
    rclpy.spin_once(node)
print(json.dumps({"reached": node.reached, "path": node.path}), flush=True)
rclpy.spin(node)  # until the run ends
