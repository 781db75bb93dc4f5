"""Radii, track and slip against known truth, and the fitted robot's file."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest
from conftest import ruedo
from drives import drive
from ruedo.fit import FitError, fitting, read
from ruedo.fit.drives import Drive, integrate
from ruedo.fit.odometry import fit_odometry
from ruedo.fit.recording import Geometry, Path, Recording, Wheels
from ruedo.fit.resume import Kept

FORWARD = {  # ways of the wheels (m) for 1 m ahead, 1 m left, 1 rad, by hand; lever 0.2 m
    "omni3": [[-0.8660254, 0.8660254, 0], [-0.5, -0.5, 1], [-0.2, -0.2, -0.2]],
    "omni4": [[1, -1, 1, -1], [-1, -1, 1, 1], [-0.2, -0.2, -0.2, -0.2]],
    "differential": [[1, 1], None, [-0.1, 0.1]],
}


@pytest.mark.parametrize("kind", FORWARD)
def test_kinematics_by_hand(kind):
    drive_ = Drive(Geometry(kind, 0.05, 0.2))
    for axis, ways in enumerate(FORWARD[kind]):
        if ways is None:
            continue
        moved = np.eye(3)[axis : axis + 1]
        turned = np.array([ways]) / 0.05
        assert drive_.moved(drive_.nominal(), turned, None) == pytest.approx(moved)
        assert drive_.residuals(drive_.nominal(), moved, turned, None) == pytest.approx(0, abs=1e-7)


def noiseless(kind, parameters, place=(0.0, 0.0, 0.0)):
    """A recording of exact readings: arcs, with these true measures and this tracked point."""
    rng = np.random.default_rng(5)
    true = Drive(Geometry(kind, 0.05, 0.2))
    steering = np.repeat(rng.uniform(-1, 1, 40), 50)[:-1] if kind == "tricycle" else None
    wheels = true.wheels
    steps = np.repeat(rng.uniform(-0.3, 0.3, (40, wheels)), 50, axis=0)[:-1]
    if kind == "omni4":  # four wheels without slip: of motions that a base can make
        moved = true.moved(np.array(parameters), steps, None)
        none = np.zeros_like(steps)
        steps = -true.residuals(np.array(parameters), moved, none, None) / 0.05
    base = integrate(true.moved(np.array(parameters), steps, steering))
    x, y, heading = place
    sine, cosine = np.sin(base[:, 2]), np.cos(base[:, 2])
    pose = base + np.stack([cosine * x - sine * y, sine * x + cosine * y, 0 * sine + heading], 1)
    time = 0.05 * np.arange(len(base))
    if steering is not None:  # the reading at each row; constant within a leg
        steering = np.append(steering, steering[-1])
    turned = np.concatenate([np.zeros((1, wheels)), np.cumsum(steps, axis=0)])
    return Recording(
        "made", "test", truth=Path(time, pose, "exact"), wheels=Wheels(time, turned, steering)
    )


@pytest.mark.parametrize(
    ("kind", "parameters", "close"),
    [
        ("differential", (0.0512, 0.0493, 0.208), 1e-5),
        ("omni3", (0.0512, 0.0493, 0.0505, 0.208), 1e-5),
        ("omni4", (0.0512, 0.0493, 0.0505, 0.0497, 0.208), 1e-5),
        ("tricycle", (0.0512, 0.208, 0.02), 2e-2),  # the steering of a step is a mean of readings
    ],
)
def test_exact_readings_give_exact_measures(kind, parameters, close):
    place = (0.03, -0.02, 0.05)
    found = fit_odometry([noiseless(kind, parameters, place)], Geometry(kind, 0.05, 0.2))
    assert found.parameters == pytest.approx(parameters, rel=close, abs=1e-4)
    assert found.place == pytest.approx(place, abs=2e-3)


def test_straight_drive_does_not_determine_the_track():
    recording = noiseless("differential", (0.05, 0.05, 0.2))
    time = recording.wheels.time
    turned = np.stack([time * 4, time * 4], axis=1)
    pose = np.stack([time * 4 * 0.051, 0 * time, 0 * time], axis=1)
    recording.wheels, recording.truth = Wheels(time, turned), Path(time, pose, "exact")
    found = fit_odometry([recording], Geometry("differential", 0.05, 0.2))
    said = {one.name: one for one in found.estimates}
    assert said["track"].value is None
    assert said["track"].text() == "track: not determined: the drive has too few turns"


def test_standing_robot():
    recording = noiseless("differential", (0.05, 0.05, 0.2))
    recording.wheels.turned[:] = 0
    with pytest.raises(FitError, match="the wheels went 0 m; at least 2 m"):
        fit_odometry([recording], Geometry("differential", 0.05, 0.2))


@pytest.mark.parametrize(
    ("column", "factor", "said"),
    [
        (slice(0, 2), 1000, "the path moves [4-9][0-9][0-9] times as far"),  # mm
        (2, 180 / np.pi, "allowed are m and rad"),  # degrees
        (slice(0, 3), 0.0, "e-[0-9]+ times as far"),  # a path that stands
    ],
)
def test_other_units(column, factor, said):
    recording = noiseless("differential", (0.05, 0.05, 0.2))
    recording.truth.pose[:, column] *= factor
    with pytest.raises(FitError, match=said):
        fit_odometry([recording], Geometry("differential", 0.05, 0.2))


def test_other_clock():
    recording = noiseless("differential", (0.05, 0.05, 0.2))
    recording.wheels.time += 1e9
    with pytest.raises(FitError, match="the clocks or the units may differ"):
        fit_odometry([recording], Geometry("differential", 0.05, 0.2))


# Three robots; errors that were drawn once, and a seed each.
TRUTHS = [
    ("p3at", 0.012, -0.007, 0.031, 0.004),
    ("p3dx", -0.02, 0.004, -0.05, 0.008),
    ("crawler", 0.005, 0.015, 0.02, 0.002),
]


@pytest.mark.parametrize(("robot", "left", "right", "track", "slip"), TRUTHS)
def test_known_truth(tmp_path, robot, left, right, track, slip):
    log, out = tmp_path / "drive.lcm", tmp_path / "fitted.sdf"
    errors = {
        "odometry.radius_error": f"{left} {right}",
        "odometry.track_error": track,
        "odometry.slip_noise": slip,
    }
    drive(log, robot, errors, seed=7)
    page = tmp_path / "fit.html"
    said, _ = ruedo("fit", log, "--robot", robot, "-o", out, "--report", page, "--json")
    found = {one["name"]: one for one in json.loads(said)["parts"]["Odometry"]}
    for name, true in (
        ("left radius error", left),
        ("right radius error", right),
        ("track error", track),
        ("slip noise", slip),
    ):
        one = found[name]
        std = (one["high"] - one["low"]) / 2 / 1.96
        assert abs(one["value"] - true) < 3.3 * std, name  # beyond in 1 of 1000
    assert (found["left radius error"]["high"] - found["left radius error"]["low"]) / 2 < 3e-3
    assert abs(found["slip noise"]["value"] / slip - 1) < 0.1
    assert "not allowed" not in ruedo("check", out)[0]
    assert "<svg" in page.read_text()
    # The fitted file drives like the robot: a log of it is fitted to the same errors.
    again = tmp_path / "again.lcm"
    drive(again, str(out), {}, seed=8, name=robot)
    said, _ = ruedo("fit", again, "--robot", out, "--json")
    second = {one["name"]: one for one in json.loads(said)["parts"]["Odometry"]}
    for name in ("left radius error", "right radius error", "track error"):
        spread = np.hypot(*(one[name]["high"] - one[name]["low"] for one in (found, second))) / 2
        assert abs(second[name]["value"] - found[name]["value"]) < 1.7 * spread


def test_odometry_alone_gives_the_ratio(tmp_path):
    log = tmp_path / "drive.lcm"
    drive(log, "p3at", {"odometry.track_error": 0.031, "odometry.slip_noise": 0.001}, seed=3)
    recording = read(log)
    recording.wheels = None
    found = fit_odometry([recording], Geometry("differential", 0.111, 0.394))
    assert 0.394 / found.parameters[2] - 1 == pytest.approx(0.031, abs=2e-3)


def test_an_interrupted_fit_goes_on(tmp_path, monkeypatch):
    """Stages that were done are not repeated, and the values are those of a fit in one go."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    log = tmp_path / "drive.log"
    log.write_text("of these bytes\n")
    recording = noiseless("differential", (0.0512, 0.0493, 0.208))
    recording.geometry = Geometry("differential", 0.05, 0.2)
    recording.streams = {"encoders": recording.wheels.time}
    once = fitting.fit([recording]).as_dict()

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as broken:
        broken.setattr(fitting, "fit_timing", interrupted)
        with pytest.raises(KeyboardInterrupt):
            fitting.fit([recording], kept=Kept([log], "options"))
    monkeypatch.setattr(fitting, "fit_odometry", interrupted)  # is not called again
    assert fitting.fit([recording], kept=Kept([log], "options")).as_dict() == once
    assert not list((tmp_path / "ruedo/fit").iterdir())
    for other in (Kept([log], "other options"), Kept([__file__], "options")):
        with pytest.raises(KeyboardInterrupt):
            fitting.fit([recording], kept=other)


def test_stages_of_another_user_are_not_read(tmp_path, monkeypatch):
    """They are a pickle, which runs code."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kept = Kept([__file__], "options")
    kept.save([1, 2])
    assert kept.load() == [1, 2]
    with monkeypatch.context() as other:
        other.setattr(os, "getuid", lambda: 12345)
        assert kept.load() is None
