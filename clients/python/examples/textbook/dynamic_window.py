"""The dynamic window approach (Fox, Burgard, Thrun 1997): of the velocities that the robot can
reach in a moment, the best one whose arc stops before what the scan shows."""

import math

import numpy as np
import ruedo

PERIOD, HORIZON, RADIUS = 0.1, 3.0, 0.45  # s, s, m: of control, of a look ahead, of the robot


def arcs(v, omega, times):
    """(n, t, 2) m: where the robot is on arcs of (n,) velocities, in its own frame."""
    turn = omega[:, None] * times
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = (v / omega)[:, None]
        x = np.where(abs(turn) < 1e-6, v[:, None] * times, radius * np.sin(turn))
        y = np.where(abs(turn) < 1e-6, 0.0, radius * (1.0 - np.cos(turn)))
    return np.stack([x, y], axis=-1)


def choose(robot, points, goal, now):
    """(v, omega) for the next moment. points: (k, 2) m and goal: (2,) m, in the robot's frame."""
    v = np.clip(now[0] + np.linspace(-0.03, 0.03, 5), 0.0, 0.5)
    omega = np.clip(now[1] + np.linspace(-0.3, 0.3, 15), -1.0, 1.0)
    v, omega = (one.ravel() for one in np.meshgrid(v, omega))
    times = np.arange(PERIOD, HORIZON, PERIOD)
    ways = arcs(v, omega, times)
    clear = np.full(ways.shape[:2], 3.0)
    if len(points):
        clear = np.linalg.norm(ways[:, :, None] - points, axis=-1).min(axis=2)
    hit = clear < RADIUS
    free = np.where(hit.any(axis=1), hit.argmax(axis=1) * PERIOD * v, np.inf)
    admissible = v <= np.sqrt(2.0 * 0.3 * np.maximum(free - 0.05, 0.0))  # it can still stop
    if not admissible.any():
        return 0.0, math.copysign(0.6, goal[1])
    ends, headings = ways[:, -1], omega * times[-1]
    away = np.arctan2(goal[1] - ends[:, 1], goal[0] - ends[:, 0]) - headings
    score = 0.3 * (1.0 - abs(ruedo.normalize_angle(away)) / math.pi)
    score += 0.4 * np.minimum(clear.min(axis=1), 1.0) + 2.0 * v
    best = np.where(admissible, score, -np.inf).argmax()
    return float(v[best]), float(omega[best])


def drive(goal=(6.0, 0.0), seconds=60.0):
    """Distance from the goal at the end (m), and what the robot touched."""
    world = ruedo.World().robot("p3at")
    for x, y in ((2.0, 0.2), (3.5, -0.9), (3.6, 0.9), (5.0, 0.1)):
        world.cylinder(x, y, radius=0.2)
    touched, now = set(), (0.0, 0.0)
    with ruedo.launch(world, lockstep=1, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        seen = sim.step(20)
        while seen.time < seconds:
            pose, scan = seen.latest(robot.pose), seen.latest(robot.lrf)
            for sample in seen.all(robot.collisions):
                touched.update(sample.bodies)
            to_goal = pose.transform.inverse().apply(goal)[:2]
            if np.hypot(*to_goal) < 0.3:
                break
            near = scan.points(robot.lrf)[:, :2]
            now = choose(robot, near[np.hypot(*near.T) < 3.0], to_goal, now)
            seen = sim.step(20, [robot.velocity_command(*now)])
        return float(np.hypot(*to_goal)), touched


if __name__ == "__main__":
    print("%.2f m from the goal, touched: %s" % drive())
