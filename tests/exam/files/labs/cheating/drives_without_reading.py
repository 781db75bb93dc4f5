def square(robot):
    while True:
        robot._say("drive", [0.0, 0.0])
