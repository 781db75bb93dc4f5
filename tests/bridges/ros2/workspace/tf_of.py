"""Where SOURCE is in TARGET for a node of NAMESPACE as nav2_bringup starts it: /tf is its own tf.

tf_of.py NAMESPACE TARGET SOURCE    (prints x, y, z in m)
"""

import sys

import rclpy
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros import Buffer, TransformListener

namespace, target, source = sys.argv[1:]
rclpy.init()
remaps = ["--ros-args", "-r", "/tf:=tf", "-r", "/tf_static:=tf_static"]
node = Node("listener", namespace=namespace, cli_args=remaps)
buffer = Buffer()
listener = TransformListener(buffer, node, spin_thread=False)
while not buffer.can_transform(target, source, Time()):
    rclpy.spin_once(node)
place = buffer.lookup_transform(target, source, Time()).transform.translation
print(place.x, place.y, place.z)
