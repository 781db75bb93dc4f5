import os


def square(robot):
    os.environ["RUEDO_SEED"] = "5" + os.environ["RUEDO_SEED"]
