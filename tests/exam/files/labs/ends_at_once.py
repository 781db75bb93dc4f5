def square(robot):
    pass
