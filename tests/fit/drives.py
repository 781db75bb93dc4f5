"""Logs of known truth, made by Ruedo itself: a robot drives a random course and is recorded."""

from __future__ import annotations

from pathlib import Path as File

import numpy as np
from ruedo.engine import Engine
from ruedo.fit.recording import Commands, Path, Recording

SQUARE = ((1.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.0, -1.0))
LEGS = (*SQUARE, (0.8, 0.7), (0.8, -0.7))
_HEAVY = ("camera", "sonar")
_STEP_S = 1e-4  # a limit or a lag ends within a step: 1 ms was seen in accelerations


def leaves(engine, place):
    """Whether the first robot looks away from its start, X,Y."""
    w, x, y, z = engine["pose.orientation"][0, 0]
    ahead = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z)])
    start = [float(one) for one in place.split(",")[:2]]
    return float(ahead @ (engine["pose.pos"][0, 0][:2] - start)) > 0


def drive(
    file, robot, settings, seed, *,
    world="empty", place="0,0", legs=48, speeds=(0.4, 0.6), name="", course=LEGS, off=_HEAVY,
    near=False, quarters=(12, 32), factors=None, dead=(0.0, 0.0), sent=None,
    pause=0,
):  # fmt: skip
    """Writes a log. settings: of devices, without the robot's name. speeds: m/s, rad/s. name: of
    the robot, where `robot` is a file. off: kinds of devices that are left out. near: the robot
    drives backwards where it would leave its start. quarters: of a second, that a leg takes.
    pause: quarters at rest after each. factors: of the speeds of each leg, drawn between these.
    dead: speeds that the robot takes for 0. sent: a list that gets (s, m/s, rad/s) of each command
    as it was before. Returns in how many states the robot touched something.
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
            if factors:
                command *= rng.uniform(*factors)
            if sent is not None:
                sent.append((float(engine.time), *command))
            command[np.abs(command) <= dead] = 0.0
            for _ in range(int(rng.uniform(*quarters))):
                engine.step(command, quarter)
                touched += int(engine.touching().sum())
            for _ in range(pause):
                engine.step(np.zeros(2), quarter)
        engine.end_run()
    return touched


def integrated(
    seed: int, delay: float, rise: float, fall: float, lag: float, *, seconds=40.0, rate=50.0,
    dead=0.0, limit=np.inf, only=0.0,
) -> Recording:  # fmt: skip
    """A drive on a plane by commands at chance times, integrated in steps of _STEP_S. only: the
    size of all commands.
    """
    draw = np.random.default_rng(seed)
    when = np.cumsum(np.concatenate([[0.5], draw.uniform(0.4, 2.0, 2 * int(seconds))]))
    when = when[when < seconds - 2]
    value = np.zeros((len(when), 3))
    value[:, 0], value[:, 2] = draw.uniform(-0.6, 0.7, len(when)), draw.uniform(-1, 1, len(when))
    if only:
        value = only * np.sign(value)
    time = np.arange(0, seconds, _STEP_S)
    last = np.searchsorted(when, time - delay, side="right") - 1
    wanted = np.where(last[:, None] >= 0, value[np.maximum(last, 0)], 0.0)
    wanted = np.where(np.abs(wanted) > dead, wanted, 0.0).clip(-limit, limit)
    share = -float(np.expm1(-_STEP_S / lag))
    speed = np.zeros((len(time), 3))
    for k in (0, 2):
        now = 0.0
        for i, target in enumerate(wanted[:, k].tolist()):
            change = (target - now) * share
            faster = change * now >= 0
            most = (rise if faster else fall) * _STEP_S
            now += min(max(change, -most), most)
            speed[i, k] = now
    heading = np.cumsum(speed[:, 2]) * _STEP_S
    x = np.cumsum(speed[:, 0] * np.cos(heading)) * _STEP_S
    y = np.cumsum(speed[:, 0] * np.sin(heading)) * _STEP_S
    every = round(1 / rate / _STEP_S)
    pose = np.stack([x, y, heading], axis=1)[::every]
    pose = pose + draw.normal(0, [2e-4, 2e-4, 2e-4], pose.shape)
    return Recording(
        File("drive.csv"),
        "CSV",
        truth=Path(time[::every] + _STEP_S, pose, "motion capture"),
        commands=Commands(when, value),
    )
