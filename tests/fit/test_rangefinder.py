"""Noise of range and bearing against known truth: made readings, and Ruedo's own."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from conftest import ruedo
from drives import drive
from ruedo.fit import FitError, read
from ruedo.fit.rangefinder import Residuals, fit_beams, fit_rangefinder
from ruedo.fit.recording import Path, Recording, Scans, composed
from test_import import room_scan
from test_readers import flaser


def test_beam_model_of_drawn_residuals():
    """Both sigmas, the bias and the outliers' share, of readings drawn from the model itself."""
    rng = np.random.default_rng(4)
    reach, incidence = rng.uniform(1, 8, 20_000), rng.uniform(0, 1.2, 20_000)
    sigma = np.hypot(0.01, 0.002 * reach * np.tan(incidence))
    residual = 0.004 + sigma * rng.normal(size=20_000)
    others = rng.random(20_000) < 0.05
    residual[others] = rng.uniform(-0.3, 0.3, others.sum())
    model, std = fit_beams(Residuals(residual, reach, incidence, 1.0))
    assert model.range_sigma == pytest.approx(0.01, rel=0.05)
    assert model.bearing_sigma == pytest.approx(0.002, rel=0.05)
    assert model.bias == pytest.approx(0.004, abs=5e-4)
    assert model.outliers == pytest.approx(0.05, abs=0.01)
    assert (std < 0.03).all()


def test_room_of_exact_walls(tmp_path):
    """Made scans of a square room: 20 mm on the range alone."""
    rng = np.random.default_rng(6)
    log = tmp_path / "room.log"
    lines = []
    for i in range(80):
        pose = (-1 + i / 40, 0.3 * math.sin(i), i * 0.2)
        ranges = np.array(room_scan(pose)) + 0.02 * rng.normal(size=181)
        lines.append(flaser([f"{one:.4f}" for one in ranges], pose, float(i)))
    log.write_text("".join(lines))
    _, found = fit_rangefinder([read(log)], np.zeros(3))
    noise = next(one for one in found if one.name == "range noise")
    assert noise.value == pytest.approx(0.02, rel=0.05)
    said = {one.name: one for one in found}
    assert said["bias of the range"].value is None  # surfaces are made of the same readings


def ranges_beside_pillar(x, y, angles):
    """Exact ranges (m) in a room of 6 x 6 m around a pillar of 0.3 m radius, both at the origin."""
    cosine, sine = np.cos(angles), np.sin(angles)
    with np.errstate(divide="ignore"):  # along a wall
        ways = [(3 - x * np.sign(cosine)) / abs(cosine), (3 - y * np.sign(sine)) / abs(sine)]
    walls = np.minimum(*ways)
    ahead, miss = -(x * cosine + y * sine), x * sine - y * cosine
    meets = (ahead > 0) & (abs(miss) < 0.3)
    return np.where(meets, ahead - np.sqrt(np.maximum(0.09 - miss**2, 0)), walls)


def test_round_things_and_corners_are_no_noise(tmp_path):
    """A good range finder, 3 mm and 0.5 mrad, drives around a pillar."""
    rng = np.random.default_rng(8)
    lines = []
    for i in range(240):
        x, y, heading = 1.2 * math.cos(i / 38), 1.2 * math.sin(i / 38), i * 0.21
        bearings = heading + np.radians(np.arange(-90, 91)) + 5e-4 * rng.normal(size=181)
        ranges = ranges_beside_pillar(x, y, bearings) + 0.003 * rng.normal(size=181)
        lines.append(flaser([f"{one:.4f}" for one in ranges], (x, y, heading), float(i)))
    log = tmp_path / "pillar.log"
    log.write_text("".join(lines))
    _, found = fit_rangefinder([read(log)], np.zeros(3))
    said = {one.name: one for one in found}
    assert said["range noise"].value == pytest.approx(0.003, rel=0.05)
    assert said["bearing noise"].value == pytest.approx(5e-4, rel=0.2)


def test_known_truth_of_ruedo(tmp_path):
    log, out = tmp_path / "drive.lcm", tmp_path / "fitted.sdf"
    true = {"lrf.lidar.noise.stddev": 0.012, "lrf.bearing_noise": 0.003}
    drive(log, "p3at", true, seed=2, world="rooms", place="", legs=24, speeds=(0.1, 0.6))
    said, _ = ruedo("fit", log, "--robot", "p3at", "-o", out, "--json")
    answer = json.loads(said)
    found = {one["name"]: one for one in answer["parts"]["Range finder"]}
    assert found["range noise"]["value"] == pytest.approx(0.012, rel=0.05)
    assert found["bearing noise"]["value"] == pytest.approx(0.003, rel=0.15)
    assert found["resolution"]["value"] == 0.001
    text = out.read_text()
    assert f"<stddev>{found['range noise']['value']:.5g}</stddev>  <!-- fitted to drive.lcm" in text
    assert "good" in ruedo("check", out)[0]


def test_place_and_clock_of_the_range_finder(tmp_path):
    """Made scans from a range finder at (0.2, -0.1) m, 0.05 rad on the robot, stamped 0.04 s late;
    believed 6 cm and 0.03 rad from there.
    """
    rng = np.random.default_rng(3)
    time = np.arange(0, 64, 0.4)

    def robot(t):
        return np.stack([1.5 * np.cos(t / 5), np.sin(t / 3), np.sin(t / 4) * 3 + t / 9], axis=-1)

    mount, late = np.array([0.2, -0.1, 0.05]), 0.04
    poses = composed(robot(time - late), np.tile(mount, (len(time), 1)))
    ranges = np.array([room_scan(pose) for pose in poses]) + 0.01 * rng.normal(
        size=(len(time), 181)
    )
    fine = np.arange(-1, 91, 0.02)
    recording = Recording(
        tmp_path / "made.csv",
        "CSV",
        truth=Path(fine, robot(fine), "exact"),
        scans=Scans(time, ranges, -math.pi / 2, math.pi / 180, np.inf),
    )
    believed = np.array([0.16, -0.05, 0.02])
    found = {one.name: one for one in fit_rangefinder([recording], believed)[1]}
    names = ("mounting ahead", "mounting left", "mounting angle", "time offset")
    for name, true, close in zip(names, (*mount, late), (2e-3, 2e-3, 1e-3, 1e-3)):
        one = found[name]
        assert one.value == pytest.approx(true, abs=close), name
        assert abs(one.value - true) < (one.high - one.low) / 2 * 1.7, name  # beyond in 1 of 1000
    assert found["range noise"].value == pytest.approx(0.01, rel=0.05)
    recording.truth = Path(fine, np.zeros((len(fine), 3)), "exact")  # a robot at rest: one place
    with pytest.raises(FitError, match="scans from 1 places; a drive is needed"):
        fit_rangefinder([recording], np.zeros(3))


def test_a_straight_drive_does_not_determine_the_mount(tmp_path):
    """Straight ahead, the place of the range finder on the robot changes nothing."""
    rng = np.random.default_rng(4)
    time = np.arange(0, 60, 0.25)
    poses = np.stack([time / 16 - 2, 0 * time, 0 * time], axis=1)
    ranges = np.array([room_scan(pose) for pose in poses]) + 0.01 * rng.normal(
        size=(len(time), 181)
    )
    scans = Scans(time, ranges, -math.pi / 2, math.pi / 180, np.inf)
    recording = Recording(tmp_path / "a.csv", "CSV", truth=Path(time, poses, "exact"), scans=scans)
    found = {one.name: one for one in fit_rangefinder([recording], np.zeros(3))[1]}
    for name in ("mounting ahead", "mounting left", "time offset"):
        assert found[name].value is None, name
    assert found["mounting left"].why == "the drive has too few turns"
    assert found["mounting angle"].value == pytest.approx(0, abs=2e-3)
    assert "farther away" in next(one.why for name, one in found.items() if "beyond" in name)


def test_scans_without_any_return(tmp_path):
    log = tmp_path / "nothing.log"
    poses = [(0.2 * k, 0, 0) for k in range(9)]
    log.write_text("".join(flaser([80.0] * 181, pose, k) for k, pose in enumerate(poses)))
    with pytest.raises(FitError, match="0 ranges; at least 500 are needed"):
        fit_rangefinder([read(log)], np.zeros(3))


def test_one_place_is_too_little(tmp_path):
    log = tmp_path / "room.log"
    log.write_text("".join(flaser(room_scan((0, 0, 0)), (0, 0, 0), t) for t in range(9)))
    with pytest.raises(FitError, match="scans from 1 places; a drive is needed"):
        fit_rangefinder([read(log)], np.zeros(3))
