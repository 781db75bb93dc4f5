def square(robot):
    robot._say("drive", ["second", 0.5, 0.0])
