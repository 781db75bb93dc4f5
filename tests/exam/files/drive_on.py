"""Drives ahead until the run is over: drive_on.py SPEED."""

import sys

import ruedo

with ruedo.connect() as sim:
    robot = sim.robot("p3at")
    while True:
        robot.set_velocity(float(sys.argv[1]), 0.0)
        robot.pose.next()
