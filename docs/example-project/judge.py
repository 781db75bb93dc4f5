"""A custom judge: the robot must not have reversed. The log is a standard LCM log."""

import os
import sys

import lcm
from ruedo.lcmtypes import odometry_t

for event in lcm.EventLog(os.environ["RUEDO_LOG"]):
    if event.channel == "p3at/odometry" and odometry_t.decode(event.data).v < -0.01:
        sys.exit(f"it reversed at {event.timestamp * 1e-6:.2f} s")
