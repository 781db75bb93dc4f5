"""A controller over plain DDS that knows nothing of Ruedo: one command for each scan, away from
what is near.
"""

import sys
import time

from conftest import Peer
from ros_types import LaserScan, Twist, Vector3

peer = Peer(int(sys.argv[1]))
cmd_vel = peer.writer("/cmd_vel", Twist)
scans = peer.reader("/scan", LaserScan)
answered = 0
while answered < int(sys.argv[2]):
    for scan in scans.take(N=10):
        ahead = min(scan.ranges[60:121])
        left, right = sum(scan.ranges[121:]), sum(scan.ranges[:60])
        speed = max(0.0, min(0.5, ahead - 0.6))
        cmd_vel.write(Twist(Vector3(x=speed), Vector3(z=0.5 if left > right else -0.5)))
        answered += 1
        if answered == 1:
            print("driving", flush=True)
    time.sleep(0.0005)
