"""A patrol with a battery: the robot visits its posts in turn, and drives home to recharge while
what is left still takes it to the next post and home from there."""

import math

import ruedo

HOME, POSTS = (0.0, 0.0), [(4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]  # m
CAPACITY, PER_METRE, PER_SECOND = 20.0, 1.0, 2.0  # kJ; used in driving, and gained at home


class Battery:
    """Empties with the way that the robot's odometry measures."""

    def __init__(self, odometry):
        self.charge = self.least = CAPACITY
        self._last = odometry.latest()
        self._reading = odometry.on_sample(self._drive)

    def _drive(self, now):
        way = math.hypot(now.x - self._last.x, now.y - self._last.y)
        self._last = now
        self.charge -= PER_METRE * way
        self.least = min(self.least, self.charge)

    def recharge(self, sim):
        """Fills it, in sim time."""
        period = 0.5
        for _ in sim.every(period):
            self.charge = min(self.charge + PER_SECOND * period, CAPACITY)
            if self.charge == CAPACITY:
                return


def go(robot, place):
    """Turns to a place (m), and drives there."""
    ahead, left, _ = robot.pose.next().transform.inverse().apply(place)
    robot.rotate(math.atan2(left, ahead)).wait()
    robot.advance(math.hypot(ahead, left)).wait()


def patrol(rounds=2):
    """The places where the robot was, with the charge there (kJ), and the least of all."""
    visits, post = [], 0
    world = ruedo.World().robot("p3at", *HOME)
    with ruedo.launch(world, rate="max", noise=False, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        battery = Battery(robot.odometry)
        place = HOME
        while post < rounds * len(POSTS):
            goal = POSTS[post % len(POSTS)]
            needed = PER_METRE * (math.dist(place, goal) + math.dist(goal, HOME))
            if battery.charge < needed:
                goal = HOME
            go(robot, goal)
            place = goal
            visits.append((goal, battery.charge))
            if goal == HOME:
                battery.recharge(sim)
            else:
                post += 1
    return visits, battery.least


if __name__ == "__main__":
    visits, least = patrol()
    for (x, y), charge in visits:
        print(f"({x:g}, {y:g}) with {charge:.1f} kJ")
    print(f"{least:.1f} kJ at least")
