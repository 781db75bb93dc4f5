"""Drives until the run is over, and then checks where it is: checks_at_end.py LEAST_X."""

import sys

import ruedo

with ruedo.connect() as sim:
    robot = sim.robot("p3at")
    robot.set_velocity(0.2, 0.0)
    x = 0.0
    try:
        while True:
            robot.set_velocity(0.2, 0.0)
            x = robot.pose.next().x
    except ruedo.RuedoError:
        pass
sys.exit(0 if x > float(sys.argv[1]) else 1)
