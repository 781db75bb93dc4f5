"""python -m ruedo.gym.bench: how many environment steps a second this machine makes, beside
MuJoCo's where it is installed (pip install mujoco).

An environment step is 0.1 s of sim time, in 20 steps of 5 ms, with one scan over 180 degrees in a
room with eight pillars. Ruedo's robot is a Pioneer 3-AT with its noise; MuJoCo's is a planar body
whose velocity is imposed, without noise, in as many threads as there are cores.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from ..engine import Engine
from ..world import World
from .navigate import NavigateVectorEnv

STEPS, STEP_S = 20, 0.005
SPEED_M_S, TURN_RAD_S = 0.3, 0.5  # around a circle of 0.6 m
HALF_M, RANGE_M, SCANNER_M = 4.0, 8.0, 0.32
PILLARS = [(2.5 * math.cos(i * math.pi / 4), 2.5 * math.sin(i * math.pi / 4)) for i in range(8)]
CORES = len(os.sched_getaffinity(0))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog="python -m ruedo.gym.bench",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--envs", type=int, default=256, help="how many (default 256)")
    parser.add_argument("--beams", type=int, default=181, help="of a scan (default 181)")
    parser.add_argument("--seconds", type=float, default=5.0, help="for each row (default 5)")
    parser.add_argument("--json", action="store_true", help="a JSON object for each row")
    given = parser.parse_args(arguments)
    if not 1 <= given.envs <= 100_000 or not 2 <= given.beams <= 1024 or not given.seconds > 0.0:
        parser.error("--envs is 1 to 100000, --beams 2 to 1024, and --seconds more than 0")
    if not given.json:
        print(f"{given.envs} environments, {given.beams} beams, {CORES} cores")
    rows: dict[str, Callable[[int, int], Callable[[], Any]]] = {
        "Ruedo, engine": _engine,
        "Ruedo, Navigate-v0 with rewards and resets": _task,
        "MuJoCo": _mujoco,
    }
    for name, make in rows.items():
        try:
            rate = _rate(make(given.envs, given.beams), given.envs, given.seconds)
        except ImportError:
            if not given.json:
                print(f"{name} - not installed (pip install mujoco)")
            continue
        if given.json:
            row = {"simulator": name, "envs": given.envs, "beams": given.beams}
            print(json.dumps({**row, "steps_per_s": rate}))
        else:
            print(name, "-", f"{rate:,.0f} steps/s".replace(",", " "))


def _rate(step: Callable[[], Any], envs: int, seconds: float) -> float:
    step()
    done, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds:
        step()
        done += envs
    return done / (time.perf_counter() - begin)


def _engine(envs: int, beams: int) -> Callable[[], Any]:
    world = World().robot("p3at", 0.0, -0.6, name="robot")
    for x1, y1, x2, y2 in ((-1, -1, 1, -1), (1, -1, 1, 1), (1, 1, -1, 1), (-1, 1, -1, -1)):
        world.wall(*(HALF_M * end for end in (x1, y1, x2, y2)))
    for x, y in PILLARS:
        world.cylinder(x, y, radius=0.2, height=1.0)
    engine = Engine(
        world,
        worlds=envs,
        settings={"robot/lrf.lidar.scan.horizontal.samples": beams},
        disable=["robot/camera", "robot/sonar_front", "robot/sonar_rear"],
    )
    engine.observe("lrf.ranges")
    commands = np.full((envs, 1, 2), [SPEED_M_S, TURN_RAD_S])
    return lambda: engine.step(commands, STEPS)


def _task(envs: int, beams: int) -> Callable[[], Any]:
    task = NavigateVectorEnv(envs, beams=beams)
    task.reset(seed=1)
    actions = np.tile([1.0, 0.3], (envs, 1))
    return lambda: task.step(actions)


def _mujoco(envs: int, beams: int) -> Callable[[], Any]:
    import mujoco  # type: ignore[import-not-found, unused-ignore]

    model = mujoco.MjModel.from_xml_string(_mjcf())
    body = model.body("robot").id
    angles = np.radians(np.linspace(-90.0, 90.0, beams))
    datas = [mujoco.MjData(model) for _ in range(envs)]
    scans = np.zeros((envs, beams))
    pool = ThreadPoolExecutor(CORES)

    def advance(first: int) -> None:
        rays, ids, origin = np.zeros((beams, 3)), np.zeros(beams, np.int32), np.zeros(3)
        for i in range(first, envs, CORES):
            data = datas[i]
            heading = data.qpos[2]
            data.qvel[:] = SPEED_M_S * np.cos(heading), SPEED_M_S * np.sin(heading), TURN_RAD_S
            mujoco.mj_step(model, data, STEPS)
            rays[:, 0], rays[:, 1] = np.cos(data.qpos[2] + angles), np.sin(data.qpos[2] + angles)
            origin[:2], origin[2] = data.xpos[body, :2], SCANNER_M
            mujoco.mj_multiRay(
                *(model, data, origin, rays.ravel(), None, 1, body, ids, scans[i], None, beams),
                RANGE_M,
            )

    return lambda: list(pool.map(advance, range(min(CORES, envs))))


def _mjcf() -> str:
    walls = "".join(
        f'<geom type="box" pos="{HALF_M * x} {HALF_M * y} 0.5" contype="1" conaffinity="2"'
        f' size="{0.05 + HALF_M * abs(y)} {0.05 + HALF_M * abs(x)} 0.5"/>'
        for x, y in ((0, -1), (1, 0), (0, 1), (-1, 0))
    )
    pillars = "".join(
        f'<geom type="cylinder" pos="{x} {y} 0.5" size="0.2 0.5" contype="1" conaffinity="2"/>'
        for x, y in PILLARS
    )
    return (
        f'<mujoco><option timestep="{STEP_S}"/><worldbody>{walls}{pillars}'
        '<body name="robot" pos="0 -0.6 0.14"><joint type="slide" axis="1 0 0"/>'
        '<joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/><geom type="box"'
        ' size="0.25 0.25 0.14" mass="20" friction="0 0 0" contype="2" conaffinity="3"/></body>'
        "</worldbody></mujoco>"
    )


if __name__ == "__main__":
    main()
