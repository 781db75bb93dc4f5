def many_robots(robot):
    robot.drive([0.1], [0.0])
