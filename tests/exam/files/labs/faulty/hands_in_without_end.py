def square(robot):
    while True:
        robot.hand_in(0.0)
