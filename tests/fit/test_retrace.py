"""ruedo retrace and ruedo diff --statistics: by hand-computed values, and against Ruedo's own
drives of known truth.
"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from conftest import ruedo
from drives import drive
from ruedo import World
from ruedo.fit import FitError, Recording, read
from ruedo.fit.fitting import read_robot
from ruedo.fit.recording import Path, Scans, body_steps
from ruedo.fit.retrace import robot_path
from ruedo.fit.robot_file import Setting, write_fitted
from ruedo.fit.statistics import compare, drift, spectrum
from scipy.stats import norm

COURSE = ((1.0, 0.0), (0.7, 1.0), (1.0, 0.0), (0.0, 1.0))
TRUE = {
    "lrf.lidar.noise.stddev": 0.02,
    "lrf.bearing_noise": 0.003,
    "odometry.track_error": 0.03,
    "odometry.slip_noise": 0.004,
}


def room():
    world = World()
    for ends in ((-4, -4, 4, -4), (4, -4, 4, 4), (4, 4, -4, 4), (-4, 4, -4, -4), (1, 4, 1, 2)):
        world.wall(*ends)
    return world


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A "real" drive with known errors, and the world without its robot."""
    folder = tmp_path_factory.mktemp("retrace")
    (folder / "room.sdf").write_text(str(room()))
    with_robot = folder / "with.sdf"
    with_robot.write_text(str(room().robot("p3at", -1.5, -2.0)))
    touched = drive(
        folder / "real.lcm", "p3at", TRUE, 2,
        world=str(with_robot), place="", legs=16, speeds=(0.3, 0.6), course=COURSE,
    )  # fmt: skip
    assert not touched
    return folder


def retrace(folder, out, robot, *more):
    return ruedo(
        "retrace", "real.lcm", "--world", "room.sdf", "--robot", robot, "-o", out, *more, cwd=folder
    )


def differences(folder, out, robot):
    said, _ = ruedo("diff", "--statistics", "real.lcm", out, "--robot", robot, "--json", cwd=folder)
    answer = json.loads(said)
    return {one["name"]: one for part in answer["distributions"].values() for one in part}, answer


def test_on_the_path_with_the_fitted_errors(folder):
    ruedo("fit", "real.lcm", "--robot", "p3at", "-o", "fitted.sdf", cwd=folder)
    said, _ = retrace(folder, "sim.lcm", "fitted.sdf")
    assert "on its path; its time 0 is 0 s of real.lcm" in said
    real, made = read(folder / "real.lcm"), read(folder / "sim.lcm")
    inside = made.truth.time < real.truth.time[-1]
    apart = made.truth.pose[inside] - real.truth.at(made.truth.time[inside])
    assert np.abs(apart).max() < 0.02
    assert np.median(np.abs(apart)) < 1e-3
    assert len(made.scans.time) == pytest.approx(len(real.scans.time), abs=2)
    found, answer = differences(folder, "sim.lcm", "fitted.sdf")
    assert found["all"]["kolmogorov_smirnov"] < 0.04
    for name in ("0 to 20 deg", "20 to 45 deg", "45 to 75 deg", "2 to 4 m", "4 to 8 m"):
        assert found[name]["kolmogorov_smirnov"] < 0.1, name
    # the track error of 3 % makes both odometries turn too little by as much
    real_deg, made_deg = (q[1] for q in found["heading after 10 m"]["quantiles"])
    assert made_deg == pytest.approx(real_deg, rel=0.25)
    for one in answer["spectra"]:
        for band in one["bands"]:
            a, b = band["rms"]
            assert b == pytest.approx(a, rel=0.15, abs=2e-3), (one["name"], band["hertz"])
    assert "repeated byte for byte" in ruedo("verify", "sim.lcm", cwd=folder)[0]


def test_a_wrong_robot_differs_as_much_as_its_noise(folder):
    """Ranges of 8 mm and odometry without errors, in place of 20 mm and TRUE."""
    wrong = folder / "wrong.sdf"
    sensor = "sensor[lrf]/lidar/noise"
    write_fitted(
        read_robot("p3at").file,
        [
            Setting(f"{sensor}/stddev", "0.008", "test"),
            Setting(f"{sensor}/type", "gaussian", "test"),
        ],
        wrong,
        "test",
    )
    retrace(folder, "wrong.lcm", "wrong.sdf")
    found, _ = differences(folder, "wrong.lcm", "p3at")
    x = np.linspace(0, 0.1, 10_000)
    expected = np.max(
        norm.cdf(x / 0.008) - norm.cdf(x / 0.02)
    )  # at right angles: range noise alone
    assert found["0 to 20 deg"]["kolmogorov_smirnov"] == pytest.approx(expected, abs=0.04)
    assert found["place after 1 m"]["quantiles"][1][2] < 1e-6  # ideal odometry


def test_by_its_commands_the_same_robot_drives_the_same_way(folder):
    said, _ = retrace(folder, "commanded.lcm", "p3at", "--commands")
    assert "by its commands" in said
    real, made = read(folder / "real.lcm"), read(folder / "commanded.lcm")
    count = min(len(real.truth.time), len(made.truth.time))
    assert made.truth.time[:count] == pytest.approx(real.truth.time[:count])
    assert made.truth.pose[:count] == pytest.approx(real.truth.pose[:count], abs=1e-6)
    retrace(folder, "late.lcm", "p3at", "--commands", "--delay", "0.2")
    late = read(folder / "late.lcm").truth
    then = real.truth.at(late.time[200:] - 0.2)
    assert late.pose[200:] == pytest.approx(then, abs=1e-3)


def test_both_are_plotted(folder):
    if not (folder / "commanded.lcm").exists():
        retrace(folder, "commanded.lcm", "p3at", "--commands")
    said, _ = ruedo(
        "diff", "--statistics", "real.lcm", "commanded.lcm", "--robot", "p3at", "--html", "both.html",
        cwd=folder,
    )  # fmt: skip
    page = (folder / "both.html").read_text()
    assert page.count("<svg") == 7  # ranges: all, by range, by incidence; drift; spectra
    assert "<figcaption>Range residuals: by incidence" in page and "20 to 45 deg, B" in page
    assert "KS" in said and "place after 10 m" in said


def test_path_of_the_range_finder_is_not_that_of_the_robot(tmp_path):
    """p3at has it 0.16 m ahead."""
    robot = read_robot("p3at")
    pose = np.array([[1.0, 2.0, 0.0], [1.0, 3.0, math.pi / 2]])
    scans = Scans(np.array([5.0, 6.0]), np.ones((2, 181)), -1.0, 0.01, 80.0, pose)
    path = robot_path(Recording(tmp_path / "a.log", "CARMEN log", scans=scans), robot)
    assert path.pose == pytest.approx(np.array([[0.84, 2, 0], [1, 2.84, math.pi / 2]]))


def recording(time, pose, odometry, name="a"):
    return Recording(
        name, "log", truth=Path(time, pose, "made"), odometry=Path(time, odometry, "made")
    )


def test_drift_by_hand():
    """Straight on, while the odometry believes in a circle of 50 m."""
    way = np.arange(0, 130.2, 0.05)
    straight = np.stack([way, 0 * way, 0 * way], axis=1)
    turned = way / 50
    circle = np.stack([50 * np.sin(turned), 50 * (1 - np.cos(turned)), turned], axis=1)
    found = drift(recording(way, straight, circle))  # at 1 m/s
    for name, length in (("1 m", 1), ("10 m", 10), ("100 m", 100), ("1 min", 60)):
        place, heading = found[name]
        angle = length / 50
        wrong = math.hypot(50 * math.sin(angle) - length, 50 * (1 - math.cos(angle)))
        assert place == pytest.approx(wrong, rel=1e-3), name
        assert heading == pytest.approx(math.degrees(angle), rel=1e-3), name
        assert len(place) == (130 - length) // (length / 4) + 1
    assert len(found["10 min"][0]) == 0


def test_spectrum_of_a_sine():
    time = np.arange(0, 400, 0.02)
    x = np.cumsum(0.4 + 0.1 * np.sin(2 * np.pi * time)) * 0.02
    pose = np.stack([x, 0 * x, 0 * x], axis=1)
    one = compare(recording(time, pose, pose), recording(time, pose, pose, "b"))
    bands = {(low, high): a for low, high, a, _ in one.spectra[0].bands()}
    assert bands[(0.5, 2)] == pytest.approx(0.1 / math.sqrt(2), rel=0.01)
    assert bands[(2, 10)] < 1e-3
    assert bands[(0.1, 0.5)] < 1e-3
    hertz, power = spectrum(time[1:], body_steps(pose)[:, 0] / 0.02)
    assert hertz[np.argmax(power)] == pytest.approx(1.0, abs=0.02)


def test_made_times_have_no_spectrum():
    time = np.arange(0, 40, 0.1)
    pose = np.stack([time, 0 * time, 0 * time], axis=1)
    one, other = recording(time, pose, pose), recording(time, pose, pose, "b")
    assert compare(one, other).spectra
    other.timed = False
    assert not compare(one, other).spectra
    assert any("no spectra" in remark for remark in compare(one, other).remarks)


def test_missing_data_is_reported(folder, tmp_path):
    table = tmp_path / "path.csv"
    table.write_text("time,x,y,theta\n" + "".join(f"{t},{t / 9},0,0\n" for t in range(99)))
    world = folder / "room.sdf"

    def fails(code, *words):
        return ruedo("retrace", *words, code=code, cwd=folder)[1]

    given = ("--world", world, "--robot", "p3at", "-o", tmp_path / "x.lcm")
    assert "--commands needs velocity commands; this CSV" in fails(3, table, *given, "--commands")
    assert "--delay is for --commands" in fails(2, table, *given, "--delay", "1")
    assert "its folder does not exist" in fails(2, table, *given[:-1], tmp_path / "no/x.lcm")
    said = fails(3, "real.lcm", "--world", "with.sdf", *given[2:])
    assert "the name 'p3at' is taken" in said
    assert said.count("\n") == 1
    with pytest.raises(FitError, match="a path is needed"):
        robot_path(Recording(table, "CSV"), read_robot("p3at"))
    _, said = ruedo("diff", "--statistics", table, folder / "real.lcm", cwd=folder)
    assert "scans are needed to compare ranges" in said
    _, said = ruedo("diff", "--json", table, table, code=2)
    assert "--statistics" in said
