"""Monte Carlo localisation (Thrun, Burgard, Fox, Probabilistic Robotics, table 8.2) in an
occupancy map: where the robot is, from its odometry and its scans, with an unknown start."""

import math

import numpy as np
import ruedo

CELL, SIGMA = 0.1, 0.3  # m: of the map, and of a beam, far above its noise
BEAMS = slice(5, 181, 17)
WALLS = (
    ((-4, -3), (4, -3)), ((4, -3), (4, 3)), ((4, 3), (-4, 3)), ((-4, 3), (-4, -3)),
    ((-1, -3), (-1, -0.5)), ((1.5, 3), (1.5, 1)), ((2, -1.5), (4, -1.5)),
)  # fmt: skip


def room():
    """The world, and its map."""
    world = ruedo.World().robot("p3at", -2.5, 1.0, 0.4)
    cells = np.zeros((64, 84), np.int8)
    for (x1, y1), (x2, y2) in WALLS:
        world.wall(x1, y1, x2, y2, thickness=CELL)
        for share in np.linspace(0.0, 1.0, 400):
            x, y = x1 + share * (x2 - x1), y1 + share * (y2 - y1)
            cells[int((y + 3.2) / CELL), int((x + 4.2) / CELL)] = 100
    return world, ruedo.Map(cells, CELL, (-4.25, -3.25, 0.0))


def moved(particles, way, turn, draw):
    """(n, 3) m, m, rad: particles moved by the odometry's way (m) and turn (rad), with noise."""
    n = len(particles)
    ways = way + draw.normal(0.0, 0.01 + 0.1 * abs(way), n)
    headings = particles[:, 2] + turn / 2.0
    step = np.column_stack([ways * np.cos(headings), ways * np.sin(headings), np.full(n, turn)])
    step[:, 2] += draw.normal(0.0, 0.01 + 0.1 * abs(turn), n)
    return particles + step


def resampled(particles, chart, ranges, angles, ahead, draw):
    """By the scan; ahead: m, of the device from the robot's middle."""
    x, y, heading = particles.T
    bearing = heading[:, None] + angles
    expected = chart.ray(
        (x + ahead * np.cos(heading))[:, None], (y + ahead * np.sin(heading))[:, None], bearing, 8.0
    )
    off = np.minimum(abs(np.minimum(expected, 8.0) - ranges) / SIGMA, 3.0)
    likelihood = -0.5 * (off**2).sum(axis=1)
    weights = np.exp(likelihood - likelihood.max())
    count = 500 if particles[:, :2].std(axis=0).max() < 0.5 else len(particles)
    places = (np.arange(count) + draw.random()) / count * weights.sum()
    return particles[np.searchsorted(np.cumsum(weights), places).clip(max=len(particles) - 1)]


def localise(seconds=20.0, count=4000, seed=1):
    """The error of the estimate (m), twice a second."""
    draw, errors, (world, chart) = np.random.default_rng(seed), [], room()
    low, high = (-3.9, -2.9, -math.pi), (3.9, 2.9, math.pi)
    particles = draw.uniform(low, high, (count, 3))
    with ruedo.launch(world, lockstep=1, seed=seed, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        seen = sim.step(20)
        last, ahead = seen.latest(robot.odometry), robot.lrf.transform.x
        while seen.time < seconds:
            scan, now, pose = (seen.latest(one) for one in (robot.lrf, robot.odometry, robot.pose))
            way = math.hypot(now.x - last.x, now.y - last.y)
            particles = moved(particles, way, now.theta - last.theta, draw)
            ranges = np.clip(scan.ranges[BEAMS], 0.0, 8.0)
            particles = resampled(particles, chart, ranges, scan.angles[BEAMS], ahead, draw)
            errors.append(math.dist(particles[:, :2].mean(axis=0), (pose.x, pose.y)))
            last = now
            command = (0.0, 0.8) if scan.nearest(-0.7, 0.7) < 0.8 else (0.3, 0.1)
            seen = sim.step(100, [robot.velocity_command(*command)])
    return errors


if __name__ == "__main__":
    errors = localise()
    print(f"from {errors[0]:.2f} m to {errors[-1]:.2f} m off")
