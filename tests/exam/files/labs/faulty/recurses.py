def square(robot):
    square(robot)
