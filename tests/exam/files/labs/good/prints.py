"""Around the solution: prints what it reads."""


def around(program):
    def printing(robot):
        drive = robot.drive

        def print_and_drive(speed, turn):
            print(robot.time, robot.odometry, robot.ranges.min())
            drive(speed, turn)

        robot.drive = print_and_drive
        program(robot)

    return printing
