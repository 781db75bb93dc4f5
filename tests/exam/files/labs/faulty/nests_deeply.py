def square(robot):
    robot._says.write("[" * 100000 + "\n")
    robot._says.flush()
