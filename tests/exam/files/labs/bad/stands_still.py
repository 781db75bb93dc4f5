def square(robot):
    while True:
        robot.drive(0.0, 0.0)
