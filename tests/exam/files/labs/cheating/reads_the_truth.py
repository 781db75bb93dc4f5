import ruedo


def square(robot):
    with ruedo.connect() as sim:
        print(sim.robot("p3at").pose.next())
