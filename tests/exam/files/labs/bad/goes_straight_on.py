def square(robot):
    while True:
        robot.drive(0.4, 0.0)
