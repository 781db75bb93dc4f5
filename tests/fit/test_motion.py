"""How a drive follows its commands, from drives with known delay, limits and lag."""

from __future__ import annotations

from pathlib import Path as File

import numpy as np
import pytest
import ruedo
from drives import integrated
from ruedo.fit.motion import fit_motion
from ruedo.fit.recording import Commands, Path, Recording


def by_name(recording: Recording) -> dict:
    return {one.name: one for one in fit_motion(recording)}


def test_delay_limits_and_lag_are_found():
    draw = np.random.default_rng(5)
    inside = []
    for seed in range(3):
        delay, lag = draw.uniform(0.01, 0.3), draw.uniform(0.02, 0.15)
        rise, fall = draw.uniform(0.3, 1.5, 2)
        found = by_name(integrated(seed, delay, rise, fall, lag))
        for axis in ("speed", "turn rate"):
            assert found[f"{axis}: delay"].value == pytest.approx(delay, abs=0.001)
            assert found[f"{axis}: acceleration"].value == pytest.approx(rise, rel=0.01)
            assert found[f"{axis}: deceleration"].value == pytest.approx(fall, rel=0.05)
            assert found[f"{axis}: lag"].value == pytest.approx(lag, rel=0.1, abs=0.005)
            for what, true in (("delay", delay), ("acceleration", rise), ("deceleration", fall)):
                one = found[f"{axis}: {what}"]
                inside.append(one.low <= true <= one.high)
    assert np.mean(inside) > 0.85, f"{np.mean(inside):.0%} of 95 % intervals hold the true value"


def test_limits_beyond_the_commands_are_not_estimated():
    found = by_name(integrated(3, 0.05, 1e3, 1e3, 0.2))
    assert found["speed: acceleration"].value is None
    assert found["speed: lag"].value == pytest.approx(0.2, rel=0.05)
    few = integrated(3, 0.05, 0.5, 0.5, 0.1, seconds=6)
    assert "at least" in fit_motion(few)[0].why


def test_dead_zone_and_speed_limit():
    found = by_name(integrated(11, 0.1, 1.2, 1.2, 0.05, dead=0.15, limit=0.45, seconds=60))
    for axis in ("speed", "turn rate"):
        zone = found[f"{axis}: dead zone"]
        assert zone.low <= 0.15 <= zone.high
        assert found[f"{axis}: limit"].value == pytest.approx(0.45, rel=0.01)
        assert found[f"{axis}: gain"].value == pytest.approx(1.0, rel=0.01)
    found = by_name(integrated(11, 0.1, 1.2, 1.2, 0.05))
    assert "moves it" in found["speed: dead zone"].why
    assert "no command of up to 0.6" in found["speed: limit"].why


def test_one_speed_shows_no_limit():
    """What is always commanded 0.3 and drives 0.3 may drive faster."""
    found = by_name(integrated(4, 0.1, 1.0, 1.0, 0.05, only=0.3))
    for axis in ("speed", "turn rate"):
        assert found[f"{axis}: limit"].value is None
        assert found[f"{axis}: gain"].value == pytest.approx(1.0, rel=0.01)
        assert found[f"{axis}: delay"].value == pytest.approx(0.1, abs=0.001)


def test_path_in_other_units_or_at_rest():
    recording = integrated(3, 0.05, 0.5, 0.5, 0.1)
    recording.truth.pose[:, :2] *= 1000
    said = by_name(recording)
    assert "times as far as the commands say" in said["speed: delay, acceleration and lag"].why
    assert said["turn rate: delay"].value == pytest.approx(0.05, abs=0.005)
    recording.truth.pose[:] = 0
    said = by_name(recording)
    assert said["speed: delay, acceleration and lag"].why == "the robot does not move"


def test_a_simulated_robot_has_the_limits_of_its_file():
    """p3at in the engine; its commands are logged 85 ms before they act."""
    delay, draw = 0.085, np.random.default_rng(1)
    time, poses, when, value = [], [], [], []
    with ruedo.Engine(ruedo.World().robot("p3at")) as engine:
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
        assert found[f"{axis}: delay"].value == pytest.approx(delay, abs=0.001)
        assert found[f"{axis}: acceleration"].value == pytest.approx(rise, rel=0.05)
        assert found[f"{axis}: deceleration"].value == pytest.approx(fall, rel=0.05)
