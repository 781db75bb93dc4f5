"""gz-sim on the benchmark's map, at its best: no window, no limit of the rate, DART with Bullet's
rays for its lidar without a GPU, which came in 2026. Boxes on a plane whose velocity is imposed. A
lidar without a listener is not simulated; so the scans are recorded.
"""

from __future__ import annotations

import contextlib
import math
import sqlite3
from pathlib import Path

import programs
import rooms as bench

STEP_S = 0.005
NEVER_S = 1e6  # between two records of the state, which nobody wants


def box(size: tuple[float, float, float]) -> str:
    return f"<geometry><box><size>{size[0]} {size[1]} {size[2]}</size></box></geometry>"


def robot(number: int, start: bench.Start) -> str:
    slippery = "<surface><friction><ode><mu>0</mu><mu2>0</mu2></ode></friction></surface>"
    inertia = "<ixx>0.55</ixx><iyy>0.55</iyy><izz>0.83</izz>"
    half = math.radians((bench.LRF_RAYS - 1) / 2)
    return (
        f'<model name="r{number}"><pose>{start.x} {start.y} 0.141 0 0 {start.yaw}</pose><link name="base">'
        f"<inertial><mass>20</mass><inertia>{inertia}</inertia></inertial>"
        f'<collision name="box">{box((0.5, 0.5, 0.28))}{slippery}</collision>'
        f'<sensor name="lrf" type="lidar"><pose>0 0 {bench.LRF_HEIGHT_M - 0.141} 0 0 0</pose>'
        f"<topic>lrf/r{number}</topic><update_rate>{bench.LRF_RATE_HZ}</update_rate><always_on>1</always_on>"
        f"<lidar><scan><horizontal><samples>{bench.LRF_RAYS}</samples>"
        f"<min_angle>{-half}</min_angle><max_angle>{half}</max_angle></horizontal></scan>"
        f"<range><min>0.1</min><max>{bench.LRF_RANGE_M}</max></range></lidar></sensor></link>"
        '<plugin filename="gz-sim-velocity-control-system" name="gz::sim::systems::VelocityControl">'
        f"<initial_linear>{bench.SPEED_M_S} 0 0</initial_linear>"
        f"<initial_angular>0 0 {bench.TURN_RATE_RAD_S}</initial_angular></plugin></model>"
    )


def make_sdf(rooms: bench.Rooms) -> str:
    walls = "".join(
        f'<collision name="w{i}"><pose>{b.center[0]} {b.center[1]} {b.center[2]} 0 0 0</pose>{box(b.size)}</collision>'
        for i, b in enumerate(rooms.walls)
    )
    ground = (
        '<model name="ground"><static>true</static><link name="l"><collision name="c"><geometry><plane>'
        "<normal>0 0 1</normal></plane></geometry></collision></link></model>"
    )
    return (
        '<?xml version="1.0"?><sdf version="1.9"><world name="rooms">'
        f'<physics name="p" type="dart"><max_step_size>{STEP_S}</max_step_size><real_time_factor>0</real_time_factor>'
        "<dart><collision_detector>bullet</collision_detector></dart></physics>"
        '<plugin filename="gz-sim-physics-system" name="gz::sim::systems::Physics"/>'
        '<plugin filename="gz-sim-cpu-lidar-system" name="gz::sim::systems::CpuLidar"/>'
        f'{ground}<model name="walls"><static>true</static><link name="l">{walls}</link></model>'
        + "".join(robot(i, start) for i, start in enumerate(rooms.starts))
        + "</world></sdf>"
    )


def run(program: str, rooms: bench.Rooms, folder: str, seconds: float) -> programs.Run:
    world = Path(folder, "rooms.sdf")
    world.write_text(make_sdf(rooms))
    steps = max(1, round(seconds / STEP_S))
    log = Path(folder, f"log{steps}")
    record = ["--record-path", str(log), "--log-overwrite", "--record-period", str(NEVER_S)]
    record += ["--record-topic", "/?lrf/.*"]
    command = [program, "sim", "-s", "-r", "-v", "1", "--iterations", str(steps)]
    wall_s, cpu_s = programs.timed([*command, *record, str(world)], folder)
    wanted = len(rooms.starts) * math.floor(seconds * bench.LRF_RATE_HZ)
    if (taken := scans(log / "state.tlog")) < 0.9 * wanted:
        raise ValueError(f"{taken} of {wanted} scans were taken: is there a lidar without a GPU?")
    return programs.Run(steps * STEP_S, wall_s, cpu_s)


def scans(log: Path) -> int:
    """Those that gz-transport's log has."""
    if not log.exists():
        return 0
    query = (
        "SELECT count(*) FROM messages JOIN topics ON messages.topic_id = topics.id "
        "WHERE topics.name LIKE '%lrf/%'"
    )
    with contextlib.closing(sqlite3.connect(log)) as base:
        return int(base.execute(query).fetchone()[0])


def version(program: str) -> str:
    return programs.version_of(program, ["sim", "--version"], r"(\d+\.\d+\.\d+)")


if __name__ == "__main__":
    programs.main("gz-sim", STEP_S, run, version)
