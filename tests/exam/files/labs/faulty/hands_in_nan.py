def umbmark(robot):
    robot.hand_in(float("nan"))
