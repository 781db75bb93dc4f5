"""A callback asserts that the robot stays behind x = METRES: asserts.py METRES."""

import sys

import ruedo

with ruedo.connect() as sim:
    robot = sim.robot("p3at")

    def check(pose):
        assert pose.x < float(sys.argv[1])

    with robot.pose.on_sample(check):
        robot.advance(0.5).wait()
