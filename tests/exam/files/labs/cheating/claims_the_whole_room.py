import numpy as np


def mapping(robot):
    axis = np.linspace(-4.2, 4.2, 60)
    for _ in range(380):
        robot.drive(0.2, 0.6)
    robot.hand_in(np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2))
