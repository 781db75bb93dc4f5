def square(robot):
    while True:
        pass
