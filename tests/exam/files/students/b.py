from parts.speed import SPEED


def drive(view):
    return SPEED, 0.0
