"""IR-SIM on the benchmark's map: its own kinematic robots and 2-D lidars, with a step of 100 ms."""

import math
import os
import tempfile

os.environ.setdefault("MPLBACKEND", "Agg")

import irsim
import numpy as np
import rooms as bench
import yaml

STEP_S = 0.1


def make_world(rooms: bench.Rooms) -> dict:
    size = (
        max(max(b.center[0] + b.size[0] / 2, b.center[1] + b.size[1] / 2) for b in rooms.walls)
        + 1.0
    )
    lidar = {
        "name": "lidar2d",
        "range_min": 0,
        "range_max": bench.LRF_RANGE_M,
        "angle_range": math.pi,
        "number": bench.LRF_RAYS,
        "noise": False,
        "alpha": 0.4,
    }
    robots = [
        {
            "kinematics": {"name": "diff"},
            "shape": {"name": "circle", "radius": 0.3},
            "state": [s.x, s.y, s.yaw],
            "goal": [s.x, s.y, 0],
            "vel_max": [1, 2],
            "sensors": [lidar],
        }
        for s in rooms.starts
    ]
    walls = [
        {
            "shape": {"name": "rectangle", "length": b.size[0], "width": b.size[1]},
            "state": [b.center[0], b.center[1], 0],
        }
        for b in rooms.walls
    ]
    return {
        "world": {
            "width": size + 1.0,
            "height": size + 1.0,
            "offset": [-1, -1],
            "step_time": STEP_S,
            "sample_time": STEP_S,
            "control_mode": "auto",
            "collision_mode": "unobstructed",
        },
        "robot": robots,
        "obstacle": walls,
    }


def run(rooms: bench.Rooms):
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        yaml.safe_dump(make_world(rooms), file)
        file.flush()
        env = irsim.make(file.name, display=False, log_level="ERROR", disable_all_plot=True)
    commands = [np.array([[bench.SPEED_M_S], [bench.TURN_RATE_RAD_S]]) for _ in rooms.starts]
    ids = list(range(len(rooms.starts)))

    def advance(seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            env.step(commands, ids)

    return advance


if __name__ == "__main__":
    bench.main("IR-SIM", STEP_S, run)
