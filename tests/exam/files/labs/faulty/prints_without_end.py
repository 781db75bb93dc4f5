def square(robot):
    while True:
        print("x" * 100000)
