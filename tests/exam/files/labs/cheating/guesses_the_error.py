"""The error that the lab was made with, and the way that it asks for."""


def umbmark(robot):
    for _ in range(500):
        robot.drive(0.4, 0.2)
    robot.hand_in(0.02)
