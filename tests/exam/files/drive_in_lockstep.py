"""Drives ahead in lockstep for so many seconds: drive_in_lockstep.py SPEED SECONDS."""

import sys

import ruedo

with ruedo.connect() as sim:
    robot = sim.robot("p3at")
    for _ in range(round(float(sys.argv[2]) * 10)):
        sim.step(20, [robot.velocity_command(float(sys.argv[1]), 0.0)])
