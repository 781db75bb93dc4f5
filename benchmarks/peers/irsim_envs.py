"""IR-SIM's environments: its differential robot with its 2-D lidar, in steps of 0.1 s; one process
per core.
"""

import tempfile

import environments as common
import irsim
import numpy as np
import rooms as bench
import yaml


def make(rooms: bench.Rooms, envs: int, beams: int):
    start = rooms.starts[0]
    walls = [
        {
            "shape": {"name": "rectangle", "length": wall.size[0], "width": wall.size[1]},
            "state": [wall.center[0], wall.center[1], 0],
        }
        for wall in rooms.walls
    ]
    lidar = {
        "name": "lidar2d",
        "range_min": 0,
        "range_max": bench.LRF_RANGE_M,
        "angle_range": np.pi,
        "number": beams,
    }
    robot = {
        "kinematics": {"name": "diff"},
        "shape": {"name": "circle", "radius": 0.25},
        "state": [start.x, start.y, start.yaw],
        "vel_max": [2, 2],
        "sensors": [lidar],
    }
    description = {
        "world": {
            "height": 200,
            "width": 200,
            "offset": [-100, -100],
            "step_time": common.DECISION_S,
        },
        "robot": [robot],
        "obstacle": walls,
    }
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        yaml.safe_dump(description, file)
        file.flush()
        worlds = [irsim.make(file.name, display=False, disable_all_plot=True) for _ in range(envs)]
    action = np.array([bench.SPEED_M_S, bench.TURN_RATE_RAD_S])

    def step() -> int:
        for world in worlds:
            world.step(action)
            world.get_lidar_scan()
        return envs

    return step


if __name__ == "__main__":
    given = common.options("IR-SIM")
    rate = common.in_processes(make, given)
    common.show("IR-SIM " + irsim.__version__, given.envs, given.beams, rate)
