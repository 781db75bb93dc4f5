"""A node that drives straight ahead until it is 1 m from where it began, by ground truth."""

import rclpy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node


class Driver(Node):
    def __init__(self):
        super().__init__("driver")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(Odometry, "/ground_truth", self.hear, 10)
        self.x = 0.0
        self.create_timer(0.05, self.drive)

    def hear(self, odometry):
        self.x = odometry.pose.pose.position.x

    def drive(self):
        message = Twist()
        message.linear.x = 0.4 if self.x < 1.0 else 0.0
        self.publisher.publish(message)


rclpy.init()
try:
    rclpy.spin(Driver())
except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
    pass
