"""Around the solution: everything at nine tenths of its speed."""

import numpy as np


def around(program):
    def slower(robot):
        drive = robot.drive
        robot.drive = lambda speed, turn: drive(0.9 * np.asarray(speed), turn)
        program(robot)

    return slower
