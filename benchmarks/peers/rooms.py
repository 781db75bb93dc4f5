"""The benchmark's map, read from the world that `ruedo bench --write-world FILE --robots N` writes.

Every peer runs on the walls and the starting poses of that one file.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import time
import xml.etree.ElementTree as ET
from dataclasses import dataclass

SPEED_M_S = 0.4
TURN_RATE_RAD_S = 0.4
LRF_RAYS = 181
LRF_RANGE_M = 8.0
LRF_RATE_HZ = 10.0
LRF_HEIGHT_M = 0.4
PICTURE = (640, 480)
HORIZONTAL_VIEW_RAD = 1.047


@dataclass(frozen=True)
class Box:
    """A wall: its centre and its full lengths, in metres."""

    center: tuple[float, float, float]
    size: tuple[float, float, float]


@dataclass(frozen=True)
class Start:
    """Where a robot starts: metres and radians."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Rooms:
    walls: list[Box]
    starts: list[Start]


def load(path: str) -> Rooms:
    world = ET.parse(path).getroot().find("world")
    walls = []
    for collision in world.iterfind("model[@name='walls']/link/collision"):
        pose = [float(v) for v in collision.findtext("pose").split()]
        size = [float(v) for v in collision.findtext("geometry/box/size").split()]
        walls.append(Box(tuple(pose[:3]), tuple(size)))
    starts = []
    for include in world.iterfind("include"):
        if include.findtext("uri") == "model://p3at":
            pose = [float(v) for v in include.findtext("pose").split()]
            starts.append(Start(pose[0], pose[1], pose[5]))
    return Rooms(walls, starts)


def ray_angles() -> list[float]:
    """Angles of the LRF's rays from the robot's x axis, in radians."""
    return [math.radians(degree - 90) for degree in range(LRF_RAYS)]


def main(simulator: str, step_s: float, run) -> None:
    """Times the function that `run(rooms, sim_seconds)` returns, which advances by that long, and
    prints a JSON row.
    """
    parser = argparse.ArgumentParser(description=f"{simulator} on Ruedo's benchmark map")
    parser.add_argument("world", help="file written by ruedo bench --write-world")
    parser.add_argument(
        "--duration", type=float, default=5.0, help="simulated seconds to time (default 5)"
    )
    arguments = parser.parse_args()
    rooms = load(arguments.world)
    advance = run(rooms)
    advance(0.5)
    began, cpu_began = time.perf_counter(), time.process_time()
    advance(arguments.duration)
    wall_s, cpu_s = time.perf_counter() - began, time.process_time() - cpu_began
    print(
        json.dumps(
            {
                "simulator": simulator,
                "robots": len(rooms.starts),
                "step_ms": step_s * 1e3,
                "real_time_factor": arguments.duration / wall_s,
                "cpu_s_per_sim_s": cpu_s / arguments.duration,
                "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
            }
        )
    )


def vertical_view_rad() -> float:
    """The vertical angle of view of square pixels, in radians."""
    return 2.0 * math.atan(math.tan(HORIZONTAL_VIEW_RAD / 2) * PICTURE[1] / PICTURE[0])


def camera_main(simulator: str, prepare) -> None:
    """Times pictures of the walls from the first robot's start, 10 degrees further each, and prints
    a JSON row.

    `prepare(walls, eye)` returns a function that draws the picture at a yaw in radians.
    """
    parser = argparse.ArgumentParser(description=f"{simulator}'s camera on Ruedo's benchmark map")
    parser.add_argument("world", help="file written by ruedo bench --write-world")
    parser.add_argument("--frames", type=int, default=36, help="pictures to time (default 36)")
    arguments = parser.parse_args()
    rooms = load(arguments.world)
    draw = prepare(rooms.walls, (rooms.starts[0].x, rooms.starts[0].y, LRF_HEIGHT_M))
    draw(0.0)
    began, cpu_began = time.perf_counter(), time.process_time()
    for frame in range(arguments.frames):
        draw(math.radians(10 * frame))
    wall_s, cpu_s = time.perf_counter() - began, time.process_time() - cpu_began
    print(
        json.dumps(
            {
                "simulator": simulator,
                "frames_per_s": arguments.frames / wall_s,
                "frames_per_cpu_s": arguments.frames / cpu_s,
            }
        )
    )
