def square(robot):
    robots = len(robot.poses) if hasattr(robot, "poses") else 1
    while True:
        robot._say("drive", [[0.0] * robots] * 2)
