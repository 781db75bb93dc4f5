def square(robot):
    robot._say("mark", 1.0)
