def wall_following(robot):
    while True:
        robot.drive(0.2, 0.6)
