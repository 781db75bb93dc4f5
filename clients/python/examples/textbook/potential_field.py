"""Artificial potential fields (Khatib 1986): the goal attracts the robot, and what its scans show
repels it."""

import math

import numpy as np
import ruedo

RADIUS, REACH, REPEL = 0.3, 0.6, 0.02  # m, of the robot; m, beyond that; m^3
SPEED, TURN = 0.4, 1.2  # m/s, rad/s
PILLARS = [(1.2, 0.25), (2.2, -0.5), (3.2, 0.6), (2.4, 1.5), (1.4, -1.4)]  # m
GOAL = (4.5, 0.0)  # m


def force(goal, points):
    """(2,): the descent of the potential. goal (2,), points (n, 2): m, in base_link."""
    pull = goal / max(1.0, np.linalg.norm(goal))  # a cone, and within 1 m a paraboloid
    far = np.linalg.norm(points, axis=1, keepdims=True)
    away = np.clip(far - RADIUS, 0.02, REACH)
    push = REPEL * (1.0 / away - 1.0 / REACH) / away**2 * -points / far
    return pull + push.sum(axis=0) * math.radians(1.0)  # of each degree


def follow(direction):
    """v (m/s) and omega (rad/s) along a force in base_link."""
    bearing = math.atan2(direction[1], direction[0])
    v = SPEED * min(1.0, float(np.hypot(*direction))) * max(0.0, math.cos(bearing))
    return v, float(np.clip(1.5 * bearing, -TURN, TURN))


def drive(seconds=60.0):
    """The robot's way (n, 2) m, and the bodies that it touched."""
    world = ruedo.World().robot("p3at")
    for x, y in PILLARS:
        world.cylinder(x, y, radius=0.1, height=0.8)
    way, touched = [], set()
    with ruedo.launch(world, rate="max", noise=False, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        robot.on_collision(lambda collisions: touched.update(collisions.bodies))
        for scan, pose in sim.synchronised(robot.lrf, robot.pose):
            way.append((pose.x, pose.y))
            if scan.time > seconds or math.dist(way[-1], GOAL) < 0.2:
                break
            goal = pose.transform.inverse().apply(GOAL)
            robot.set_velocity(*follow(force(goal[:2], scan.points(robot.lrf)[:, :2])))
        robot.stop().wait()
    return np.array(way), touched


if __name__ == "__main__":
    way, touched = drive()
    print(f"{len(way)} scans, to {way[-1].round(2)}; touched {touched or 'nothing'}")
