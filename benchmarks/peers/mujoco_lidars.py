"""Lidars' rays in MuJoCo on the benchmark's map: one mj_multiRay a scan, from robots that stand."""

import argparse
import json
import math
import time

import mujoco
import mujoco_rooms
import numpy as np
import rooms as bench

HALF_HEIGHT_RAD = math.pi / 8


def directions(layers: int, columns: int) -> np.ndarray:
    """Unit vectors, layer by layer, as one row of numbers."""
    around = -math.pi + 2 * math.pi * np.arange(columns) / columns
    up = np.linspace(-HALF_HEIGHT_RAD, HALF_HEIGHT_RAD, layers)
    parts = [np.outer(np.cos(up), np.cos(around)), np.outer(np.cos(up), np.sin(around))]
    parts.append(np.outer(np.sin(up), np.ones(columns)))
    return np.stack(parts, axis=2).ravel()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("world", help="file written by ruedo bench --write-world")
    parser.add_argument("--layers", type=int, required=True)
    parser.add_argument("--columns", type=int, required=True)
    parser.add_argument("--scans", type=int, default=10, help="of each robot (default 10)")
    given = parser.parse_args()
    rooms = bench.load(given.world)
    model = mujoco.MjModel.from_xml_string(mujoco_rooms.make_xml(rooms))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    bodies = [model.body(f"r{i}").id for i in range(len(rooms.starts))]
    rays = directions(given.layers, given.columns)
    count = len(rays) // 3
    distances, geoms = np.zeros(count), np.zeros(count, np.int32)

    def scan() -> None:
        for body, start in zip(bodies, rooms.starts):
            origin = np.array([start.x, start.y, bench.LRF_HEIGHT_M])
            few = (rays, None, 1, body, geoms, distances, None, count, bench.LRF_RANGE_M)
            mujoco.mj_multiRay(model, data, origin, *few)

    scan()
    began, cpu_began = time.perf_counter(), time.process_time()
    for _ in range(given.scans):
        scan()
    sim_s = given.scans / bench.LRF_RATE_HZ
    row = {
        "real_time_factor": sim_s / (time.perf_counter() - began),
        "cpu_s_per_sim_s": (time.process_time() - cpu_began) / sim_s,
    }
    print(json.dumps(row))


if __name__ == "__main__":
    main()
