"""Pure pursuit: the robot steers at a point of the path that is a look-ahead distance away
(Coulter, CMU-RI-TR-92-01), by its true pose."""

import math

import numpy as np
import ruedo

SPEED, LOOK_AHEAD = 0.4, 0.6  # m/s, m


def eight(size=2.0, points=400):
    """(n, 2) m: Gerono's figure of eight, beginning in the middle."""
    t = np.linspace(0.0, 2.0 * math.pi, points)
    return np.column_stack([size * np.sin(t), size * np.sin(t) * np.cos(t)])


def pursue(path, pose, progress):
    """Turn rate (rad/s) towards the path, and how far along it the robot is (index)."""
    off = np.hypot(path[:, 0] - pose.x, path[:, 1] - pose.y)
    window = off[progress : progress + 40]
    progress += int(window.argmin())
    beyond = np.flatnonzero(off[progress:] > LOOK_AHEAD)
    goal = path[progress + beyond[0]] if beyond.size else path[-1]
    _, side, _ = pose.transform.inverse().apply(goal)
    return 2.0 * SPEED * side / LOOK_AHEAD**2, progress  # the circle through the goal


def follow(path=None):
    """The distances of the robot from the path (m), ten a second, until its end."""
    path = eight() if path is None else np.asarray(path, dtype=float)
    heading = math.atan2(*(path[1] - path[0])[::-1])
    world = ruedo.World().robot("p3at", *path[0], heading)
    errors, progress = [], 0
    with ruedo.launch(world, lockstep=1, noise=False, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        seen = sim.step(20)
        while progress < len(path) - 5 and seen.time < 120.0:
            pose = seen.latest(robot.pose)
            omega, progress = pursue(path, pose, progress)
            errors.append(float(np.hypot(path[:, 0] - pose.x, path[:, 1] - pose.y).min()))
            seen = sim.step(20, [robot.velocity_command(SPEED, omega)])
    return errors


if __name__ == "__main__":
    errors = follow()
    print(f"{max(errors):.3f} m off at most, {np.mean(errors):.3f} m on average")
