def particle_filter(robot):
    for _ in range(380):
        robot.drive(0.2, 0.6)
    robot.hand_in((-2.5, 1.0, 0.4) + robot.odometry)
