import ruedo


def square(robot):
    with ruedo.launch("empty") as sim:
        sim.spawn("p3at", name="second", x=2.0, y=2.0)
