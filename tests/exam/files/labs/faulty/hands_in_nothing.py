def particle_filter(robot):
    for _ in range(380):
        robot.drive(0.2, 0.6)
