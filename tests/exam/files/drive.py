"""Drives ahead by so many metres: drive.py METRES [SPEED]."""

import sys

import ruedo

with ruedo.connect() as sim:
    robot = sim.robot("p3at")
    robot.advance(float(sys.argv[1]), speed=float((sys.argv[2:] or ["0.5"])[0])).wait()
