def square(robot):
    while True:
        robot.hand_in([0.0, 0.0, 0.0])
        robot.drive(0.2, 0.4)
