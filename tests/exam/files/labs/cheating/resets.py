import ruedo


def square(robot):
    with ruedo.connect("tcpq://127.0.0.1:7700") as sim:
        sim.reset()
