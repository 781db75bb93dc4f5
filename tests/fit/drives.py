"""Logs of known truth, made by Ruedo itself: a robot drives a random course and is recorded."""

from __future__ import annotations

import numpy as np
from ruedo.engine import Engine

SQUARE = ((1.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.0, -1.0))
LEGS = (*SQUARE, (0.8, 0.7), (0.8, -0.7))
_HEAVY = ("camera", "sonar")


def leaves(engine, place):
    """Whether the first robot looks away from its start, X,Y."""
    w, x, y, z = engine["pose.orientation"][0, 0]
    ahead = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z)])
    start = [float(one) for one in place.split(",")[:2]]
    return float(ahead @ (engine["pose.pos"][0, 0][:2] - start)) > 0


def drive(
    file, robot, settings, seed, *,
    world="empty", place="0,0", legs=48, speeds=(0.4, 0.6), name="", course=LEGS, off=_HEAVY,
    near=False,
):  # fmt: skip
    """Writes a log. settings: of devices, without the robot's name. speeds: m/s, rad/s. name: of
    the robot, where `robot` is a file. off: kinds of devices that are left out. near: the robot
    drives backwards where it would leave its start. Returns in how many states the robot touched
    something.
    """
    rng = np.random.default_rng(seed)
    every = {f"{name or robot}/{key}": value for key, value in settings.items()}
    spawn = [f"{robot}@{place}"] if place else []  # or the world has the robot
    with Engine(world, spawn=spawn, seed=seed, set=every) as first:
        less = [f"{a}/{b}" for a, b, kind in first.devices if kind in off]
    touched = 0
    with Engine(world, spawn=spawn, seed=seed, set=every, disable=less) as engine:
        engine.begin_run(seed, log=str(file), everything=True)
        quarter = round(0.25 / engine.dt)
        for leg in range(legs):
            command = np.array(course[leg % len(course)]) * speeds
            if near and leaves(engine, place):
                command[0] *= -1
            for _ in range(int(rng.uniform(12, 32))):
                engine.step(command, quarter)
                touched += int(engine.touching().sum())
        engine.end_run()
    return touched
