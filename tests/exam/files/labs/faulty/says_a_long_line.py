def square(robot):
    while True:
        robot._says.write("x" * 100000)
