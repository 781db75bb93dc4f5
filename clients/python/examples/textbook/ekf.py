"""An extended Kalman filter (Thrun, Burgard, Fox, Probabilistic Robotics, table 7.2): where the
robot is, by its odometry and by ranges and bearings of pillars that a map has."""

import math

import numpy as np
import ruedo

PILLARS = np.array([(3.0, 2.0), (3.0, -2.0), (-2.0, 2.5), (-2.5, -2.0), (0.5, 3.2)])
RADIUS = 0.1  # m


def predict(mean, covariance, way, turn):
    """Moves the estimate by the odometry's way (m) and turn (rad)."""
    heading = mean[2] + turn / 2.0
    mean = mean + [way * math.cos(heading), way * math.sin(heading), turn]
    by_state = np.array(
        [[1, 0, -way * math.sin(heading)], [0, 1, way * math.cos(heading)], [0, 0, 1]]
    )
    by_motion = np.array([[math.cos(heading), 0], [math.sin(heading), 0], [0, 1]])
    noise = np.diag([(0.05 * way) ** 2 + 1e-6, (0.1 * turn) ** 2 + (0.02 * way) ** 2 + 1e-6])
    return mean, by_state @ covariance @ by_state.T + by_motion @ noise @ by_motion.T


def correct(mean, covariance, seen):
    """seen: x, y of a pillar's middle in base_link (m); that of the map which is the nearest."""
    cosine, sine = math.cos(mean[2]), math.sin(mean[2])
    there = mean[:2] + [cosine * seen[0] - sine * seen[1], sine * seen[0] + cosine * seen[1]]
    pillar = PILLARS[np.hypot(*(PILLARS - there).T).argmin()]
    x, y = pillar - mean[:2]
    squared, r = x * x + y * y, math.hypot(x, y)
    expected = np.array([r, math.atan2(y, x) - mean[2]])
    jacobian = np.array([[-x / r, -y / r, 0], [y / squared, -x / squared, -1]])
    off = np.array([math.hypot(*seen), math.atan2(seen[1], seen[0])]) - expected
    off[1] = ruedo.normalize_angle(off[1])
    spread = jacobian @ covariance @ jacobian.T + np.diag([0.05**2, 0.02**2])
    if off @ np.linalg.solve(spread, off) > 9.0:  # it is something else
        return mean, covariance
    gain = covariance @ jacobian.T @ np.linalg.inv(spread)
    return mean + gain @ off, (np.eye(3) - gain @ jacobian) @ covariance


def pillars_in(points):
    """Middles of what is as thin as a pillar: clusters of neighbouring points (k, 2) m."""
    if not len(points):
        return []
    cuts = np.flatnonzero(np.hypot(*np.diff(points, axis=0).T) > 0.3) + 1
    groups = [g for g in np.split(points, cuts) if len(g) > 2 and np.ptp(g, axis=0).max() < 0.3]
    return [g.mean(axis=0) * (1.0 + 0.7 * RADIUS / np.hypot(*g.mean(axis=0))) for g in groups]


def localise(seconds=40.0, seed=1):
    """(n, 2) m: errors of the filter and of the odometry alone, ten times a second."""
    world = ruedo.World().robot("p3at")
    for x, y in PILLARS:
        world.cylinder(float(x), float(y), radius=RADIUS)
    errors, mean, covariance = [], np.zeros(3), np.diag([1e-4, 1e-4, 1e-4])
    settings = {"p3at/odometry.track_error": 0.05, "p3at/odometry.slip_noise": 0.01}
    with ruedo.launch(
        world, lockstep=1, seed=seed, disable=["p3at/camera"], settings=settings
    ) as sim:
        robot = sim.robot("p3at")
        seen = sim.step(20)
        last = seen.latest(robot.odometry)
        while seen.time < seconds:
            now, pose, scan = (seen.latest(one) for one in (robot.odometry, robot.pose, robot.lrf))
            way = math.hypot(now.x - last.x, now.y - last.y)
            mean, covariance = predict(mean, covariance, way, now.theta - last.theta)
            last = now
            for middle in pillars_in(scan.points(robot.lrf)[:, :2]):
                mean, covariance = correct(mean, covariance, middle)
            errors.append(
                [math.dist(mean[:2], (pose.x, pose.y)), math.dist((now.x, now.y), (pose.x, pose.y))]
            )
            seen = sim.step(20, [robot.velocity_command(0.35, 0.3)])
    return np.array(errors)


if __name__ == "__main__":
    print("at the end %.2f m off, by odometry alone %.2f m" % tuple(localise()[-1]))
