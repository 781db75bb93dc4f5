"""Timing and IMU of made streams with known values."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import BUILD

assert BUILD

from ruedo.fit.recording import Imu, Path, Recording
from ruedo.fit.streams import allan_variance, fit_imu, fit_timing


def test_rate_jitter_and_missing_messages():
    rng = np.random.default_rng(1)
    time = 0.02 * np.arange(5000) + 0.0005 * rng.normal(size=5000)
    kept = rng.random(5000) > 0.03
    kept[[0, -1]] = True
    found = {
        one.name: one
        for one in fit_timing([Recording("a", "log", streams={"odometry": time[kept]})])
    }
    assert found["odometry: rate"].value == pytest.approx(50, rel=0.002)
    # an interval has the jitter of both its ends
    assert found["odometry: jitter"].value == pytest.approx(0.0005 * np.sqrt(2), rel=0.05)
    missing = found["odometry: missing messages"]
    assert missing.low < 1 - kept.mean() < missing.high


def test_allan_variance_by_hand():
    # averages of 1: (1-0)^2, (3-1)^2, (6-3)^2 -> 14 / 3 / 2; of 2: 0.5, 4.5 -> 16 / 2
    assert allan_variance(np.array([0.0, 1, 3, 6]), np.array([1, 2])) == pytest.approx([14 / 6, 8])


def imu(walk, rng, seconds=600, rate=100):
    count = seconds * rate
    bias = 0.02 + np.cumsum(walk / np.sqrt(rate) * rng.normal(size=(count, 3)), axis=0)
    turn = bias + 0.005 * rng.normal(size=(count, 3))
    return Imu(np.arange(count) / rate, turn, 0.1 * rng.normal(size=(count, 3)))


def test_imu_at_rest():
    found = {
        one.name: one
        for one in fit_imu(Recording("a", "log", imu=imu(0.0, np.random.default_rng(2))))
    }
    assert found["turn rate x: noise"].value == pytest.approx(0.005, rel=0.02)
    mean = found["turn rate x: mean at rest"]
    assert mean.value == pytest.approx(0.02, abs=4 * 0.005 / np.sqrt(60_000))
    assert found["acceleration z: noise"].value == pytest.approx(0.1, rel=0.02)
    assert found["turn rate x: random walk of the bias"].value is None


def test_imu_with_random_walk():
    found = {
        one.name: one
        for one in fit_imu(Recording("a", "log", imu=imu(0.002, np.random.default_rng(3))))
    }
    walks = [found[f"turn rate {axis}: random walk of the bias"].value for axis in "xyz"]
    assert np.mean(walks) == pytest.approx(0.002, rel=0.25)
    assert found["turn rate y: noise"].value == pytest.approx(0.005, rel=0.05)


def test_imu_of_a_robot_that_never_rests():
    time = np.arange(600) / 10
    pose = np.stack([time, 0 * time, 0 * time], axis=1)
    recording = Recording(
        "a", "log", odometry=Path(time, pose, ""), imu=imu(0, np.random.default_rng(1))
    )
    (one,) = fit_imu(recording)
    assert one.text().endswith("the robot does not stand still for 10 s")
