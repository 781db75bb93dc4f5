"""Frontier-based exploration (Yamauchi 1997): the robot maps by its scans and true poses, and
drives to the nearest border between what it knows to be free and what it does not know."""

import heapq

import numpy as np
import ruedo

CELL, HALF, RADIUS = 0.1, 5.0, 0.4  # m: of a cell, half the map's side, of the robot


def mark(cells, chart, scan, robot, pose):
    """Draws a scan into the cells: rays and where the robot is are free, the rays' ends taken."""
    middles = chart.place(*np.indices(cells.shape))
    cells[np.hypot(*(middles - (pose.x, pose.y)).transpose(2, 0, 1)) < RADIUS] = 0
    sensor = pose.transform @ robot.lrf.transform
    ranges = np.where(np.isfinite(scan.ranges), scan.ranges, 8.0)
    for share in np.arange(0.0, 1.0, 0.01):
        along = share * np.maximum(ranges - CELL, 0.0)
        on_rays = np.stack([along * np.cos(scan.angles), along * np.sin(scan.angles)], axis=1)
        column, row = np.floor((sensor.apply(on_rays)[:, :2].T + HALF) / CELL).astype(int)
        inside = (row >= 0) & (row < len(cells)) & (column >= 0) & (column < len(cells))
        cells[row[inside], column[inside]] = 0
    for x, y, _ in scan.points(robot.lrf, pose):
        if max(abs(x), abs(y)) < HALF:
            cells[chart.cell(x, y)] = 100


def way_to_frontier(cells, safe, start):
    """Cells from start to the nearest frontier (Dijkstra); empty: there is none."""
    before, queue, n = {start: None}, [(0.0, start)], len(cells)
    while queue:
        cost, here = heapq.heappop(queue)
        near = [(here[0] + i, here[1] + j) for i, j in ((0, 1), (1, 0), (0, -1), (-1, 0))]
        near = [one for one in near if 0 <= one[0] < n and 0 <= one[1] < n]
        if safe[here] and any(cells[one] == -1 for one in near):
            way = [here]
            while before[way[-1]] is not None:
                way.append(before[way[-1]])
            return way[::-1]
        for one in near:
            if one not in before and cells[one] == 0 and (safe[one] or not safe[here]):
                before[one] = here
                heapq.heappush(queue, (cost + 1.0, one))
    return []


def explore(seconds=150.0):
    """The map, and whether nothing was left to explore."""
    world = ruedo.World().wall(0.5, -3, 0.5, 0.5).robot("p3at", -2, -1)
    for a, b in (((-3, -3), (3, -3)), ((3, -3), (3, 3)), ((3, 3), (-3, 3)), ((-3, 3), (-3, -3))):
        world.wall(*a, *b)
    cells = np.full((int(2 * HALF / CELL),) * 2, -1, np.int8)
    chart = ruedo.Map(cells, CELL, (-HALF, -HALF, 0.0))
    with ruedo.launch(world, lockstep=1, noise=False, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        seen, turn = sim.step(20), 0
        while seen.time < seconds:
            pose, scan = seen.latest(robot.pose), seen.latest(robot.lrf)
            if turn % 10 == 0:  # once a second
                mark(cells, chart, scan, robot, pose)
                safe = (cells == 0) & (chart.distance_field() > RADIUS)
                way = way_to_frontier(cells, safe, chart.cell(pose.x, pose.y))
                if not way:
                    return chart, True
            turn += 1
            while len(way) > 2 and np.hypot(*(chart.place(*way[0]) - (pose.x, pose.y))) < 0.5:
                way.pop(0)
            ahead = pose.transform.inverse().apply(chart.place(*way[0]))
            bearing = np.arctan2(ahead[1], ahead[0])
            speed = 0.3 * max(0.0, np.cos(bearing)) if abs(bearing) < 0.8 else 0.0
            command = robot.velocity_command(speed, float(np.clip(1.5 * bearing, -1.0, 1.0)))
            seen = sim.step(20, [command])
    return chart, False


if __name__ == "__main__":
    chart, complete = explore()
    print(chart, "complete" if complete else "not complete")
