"""Ticks per turn, of angles that are multiples of a known step, and of Ruedo's own encoders."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from conftest import ruedo
from drives import drive
from ruedo.fit.encoders import fit_ticks
from ruedo.fit.recording import Recording, Wheels


def recording_of(turned, tmp_path, tick=0.0):
    time = np.arange(len(turned)) / 50
    return Recording(tmp_path / "a.csv", "CSV", wheels=Wheels(time, turned, tick_rad=tick))


def drawn(seed):
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(-0.05, 0.2, (2000, 2)), axis=0)


@pytest.mark.parametrize("ticks", [64, 500, 2048, 20_000, 33_777])
@pytest.mark.parametrize("decimals", [7, 12])
def test_step_of_angles(tmp_path, ticks, decimals):
    tick = 2 * math.pi / ticks
    turned = np.round(np.floor(drawn(ticks) / tick) * tick, decimals)
    found = fit_ticks(recording_of(turned, tmp_path))
    assert found.value == pytest.approx(ticks, rel=1e-5)


def test_other_angles_have_no_step(tmp_path):
    assert "finer than the log shows" in fit_ticks(recording_of(drawn(1), tmp_path)).why
    assert "hardly turn" in fit_ticks(recording_of(np.zeros((500, 2)), tmp_path)).why
    assert "no encoders" in fit_ticks(Recording(tmp_path / "a.csv", "CSV")).why
    known = fit_ticks(recording_of(drawn(2), tmp_path, tick=math.pi / 32))
    assert known.value == pytest.approx(64)


def test_known_truth_of_ruedo(tmp_path):
    log, out = tmp_path / "drive.lcm", tmp_path / "fitted.sdf"
    drive(log, "p3dx", {"odometry.ticks_per_turn": 1234}, seed=3, legs=12)
    said, _ = ruedo("fit", log, "--robot", "p3dx", "-o", out, "--json")
    found = {one["name"]: one for one in json.loads(said)["parts"]["Odometry"]}
    assert found["encoder ticks per turn"]["value"] == pytest.approx(1234, rel=1e-4)
    assert "<ruedo:ticks_per_turn>1234<" in out.read_text()
