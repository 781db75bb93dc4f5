"""How a drive follows its commands, from drives with known delay, limits and lag."""

from __future__ import annotations

from pathlib import Path as File

import numpy as np
import pytest
from conftest import BUILD

assert BUILD

import ruedo
from ruedo.fit.motion import fit_motion
from ruedo.fit.recording import Commands, Path, Recording

STEP_S = 0.001


def recorded(
    seed: int, delay: float, rise: float, fall: float, lag: float, *, seconds=40.0, rate=50.0
) -> Recording:
    """A drive on a plane by commands at chance times, integrated by Euler's method at 1 ms."""
    draw = np.random.default_rng(seed)
    when = np.cumsum(np.concatenate([[0.5], draw.uniform(0.4, 2.0, 2 * int(seconds))]))
    when = when[when < seconds - 2]
    value = np.zeros((len(when), 3))
    value[:, 0], value[:, 2] = draw.uniform(-0.6, 0.7, len(when)), draw.uniform(-1, 1, len(when))
    time = np.arange(0, seconds, STEP_S)
    last = np.searchsorted(when, time - delay, side="right") - 1
    wanted = np.where(last[:, None] >= 0, value[np.maximum(last, 0)], 0.0)
    speed = np.zeros((len(time), 3))
    for k in (0, 2):
        now = 0.0
        for i, target in enumerate(wanted[:, k].tolist()):
            change = (target - now) * min(STEP_S / lag, 1.0)
            faster = change * now >= 0
            limit = (rise if faster else fall) * STEP_S
            now += min(max(change, -limit), limit)
            speed[i, k] = now
    heading = np.cumsum(speed[:, 2]) * STEP_S
    x = np.cumsum(speed[:, 0] * np.cos(heading)) * STEP_S
    y = np.cumsum(speed[:, 0] * np.sin(heading)) * STEP_S
    every = round(1 / rate / STEP_S)
    pose = np.stack([x, y, heading], axis=1)[::every]
    pose = pose + draw.normal(0, [2e-4, 2e-4, 2e-4], pose.shape)
    return Recording(
        File("drive.csv"),
        "CSV",
        truth=Path(time[::every] + STEP_S, pose, "motion capture"),
        commands=Commands(when, value),
    )


def by_name(recording: Recording) -> dict:
    return {one.name: one for one in fit_motion(recording)}


def test_delay_limits_and_lag_are_found():
    draw = np.random.default_rng(5)
    inside = []
    for seed in range(3):
        delay, lag = draw.uniform(0.01, 0.3), draw.uniform(0.02, 0.15)
        rise, fall = draw.uniform(0.3, 1.5, 2)
        found = by_name(recorded(seed, delay, rise, fall, lag))
        for axis in ("speed", "turn rate"):
            assert found[f"{axis}: delay"].value == pytest.approx(delay, abs=0.005)
            assert found[f"{axis}: acceleration"].value == pytest.approx(rise, rel=0.05)
            assert found[f"{axis}: deceleration"].value == pytest.approx(fall, rel=0.05)
            assert found[f"{axis}: lag"].value == pytest.approx(lag, rel=0.1, abs=0.005)
            for what, true in (("delay", delay), ("acceleration", rise), ("deceleration", fall)):
                one = found[f"{axis}: {what}"]
                inside.append(one.low <= true <= one.high)
    assert np.mean(inside) > 0.85, f"{np.mean(inside):.0%} of 95 % intervals hold the true value"


def test_limits_beyond_the_commands_are_not_estimated():
    found = by_name(recorded(3, 0.05, 1e3, 1e3, 0.2))
    assert found["speed: acceleration"].value is None
    assert found["speed: lag"].value == pytest.approx(0.2, rel=0.05)
    few = recorded(3, 0.05, 0.5, 0.5, 0.1, seconds=6)
    assert "at least" in fit_motion(few)[0].why


def test_a_simulated_robot_has_the_limits_of_its_file():
    """p3at in the engine; its commands are logged 85 ms before they act."""
    delay, draw = 0.085, np.random.default_rng(1)
    time, poses, when, value = [], [], [], []
    with ruedo.Engine(ruedo.World().robot("p3at")) as engine:
        h = engine.step_size  # a step has the speed of its end throughout
        for turn in range(45):
            ahead, about = draw.uniform(-0.5, 0.5), draw.uniform(-0.7, 0.7)
            when.append(engine.time - delay)
            value.append([ahead, 0.0, about])
            for _ in range(45 + turn % 7 * 12):
                engine.step([[[ahead, about]]], 4)
                time.append(float(engine.time))
                x, y, _ = engine["pose.pos"][0, 0]
                w, _, _, z = engine["pose.orientation"][0, 0]
                poses.append([x, y, 2 * np.arctan2(z, w)])
    path = Path(np.array(time), np.array(poses), "simulation")
    commands = Commands(np.array(when), np.array(value))
    found = by_name(Recording(File("run.lcm"), "LCM log", truth=path, commands=commands))
    limits = (("speed", 0.3, 0.6), ("turn rate", 1.74, 1.74))  # those of its file
    for axis, rise, fall in limits:
        assert found[f"{axis}: delay"].value == pytest.approx(delay - h / 2, abs=0.005)
        assert found[f"{axis}: acceleration"].value == pytest.approx(rise, rel=0.05)
        assert found[f"{axis}: deceleration"].value == pytest.approx(fall, rel=0.05)
