import random


def square(robot):
    draw = random.Random(1)
    while True:
        robot.drive(draw.uniform(-0.3, 0.3), draw.uniform(-1.0, 1.0))
