"""A callback that looks at the robot: callbacks.py looks|exits|awaited."""

import sys

import ruedo


def looks(pose):
    assert pose.x < 9


def exits(pose):
    if pose.x > 0.2:
        sys.exit(0)


async def awaited(pose):
    assert pose.x < 0


with ruedo.connect() as sim:
    robot = sim.robot("p3at")
    with robot.pose.on_sample(globals()[sys.argv[1]]):
        robot.advance(0.5).wait()
