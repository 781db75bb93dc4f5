def square(robot):
    robot.drive(1 / 0, 0.0)
