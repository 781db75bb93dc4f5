def square(robot):
    while True:
        robot.drive(0.3, 0.5)
