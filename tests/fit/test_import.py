"""ruedo import of recorded drives: walls where they were, nothing where something moved."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from conftest import ruedo
from drives import drive
from ruedo.engine import Engine
from ruedo.fit import FitError, Recording
from ruedo.fit.align import find_path
from ruedo.fit.drives import integrate
from ruedo.fit.mapping import occupancy
from ruedo.fit.recording import Path, Scans, body_steps, composed
from ruedo.maps import FREE, OCCUPIED, load_map
from test_readers import flaser

SIDE = 6.0  # m, of a square room around the origin


def room_scan(pose, block=None):
    """181 exact ranges (m) to the room's walls; block: x, y, radius of a disc in the room."""
    ranges = []
    for k in range(181):
        angle = pose[2] + math.radians(k - 90)
        dx, dy = math.cos(angle), math.sin(angle)
        along = [
            (math.copysign(SIDE / 2, d) - p) / d
            for d, p in ((dx, pose[0]), (dy, pose[1]))
            if abs(d) > 1e-9
        ]
        reach = min(along)
        if block is not None:
            x, y = block[0] - pose[0], block[1] - pose[1]
            middle, miss = x * dx + y * dy, abs(x * dy - y * dx)
            if miss < block[2] and middle > 0:
                reach = min(reach, middle - math.sqrt(block[2] ** 2 - miss**2))
        ranges.append(round(reach, 3))
    return ranges


def course():
    """Two rounds on the spot, moving slowly ahead."""
    for i in range(60):
        yield (-1 + i / 60, 0.0, i * 0.25), float(i)


def test_room(tmp_path):
    log = tmp_path / "room.log"
    log.write_text(
        "".join(flaser(room_scan(p, (1.5, 1.5, 0.3) if t < 8 else None), p, t) for p, t in course())
    )
    said, findings = ruedo("import", log, "-o", tmp_path / "room.sdf")
    assert "room.sdf: " in said and "1 places where something moved" in said
    place = re.search(
        r"moved at \((.*), (.*)\) m, (.*) m wide, seen from (.*) to (.*) s in", findings
    )
    x, y, size, first, last = map(float, place.groups())
    assert math.hypot(x - 1.5, y - 1.5) < 0.3 and size <= 0.6  # the side that the robot saw
    assert 0 <= first < last < 8
    chart = load_map(tmp_path / "room.yaml")
    for angle in np.radians(np.arange(0, 360, 5)):  # walls within two cells of the truth
        way = np.array([math.cos(angle), math.sin(angle)])
        reach = SIDE / 2 / max(abs(way))
        near = [chart.at(*(way * (reach + d))) for d in np.arange(-0.1, 0.11, 0.02)]
        assert OCCUPIED in near, angle
        assert chart.at(*(way * (reach - 0.3))) == FREE
    assert chart.at(1.5, 1.2) == FREE  # where the disc was
    assert "good" in ruedo("check", tmp_path / "room.sdf")[0]


def test_drive_of_ruedo(tmp_path):
    """The walls of a made world give the ranges that the robot saw in the true one."""
    log, made = tmp_path / "drive.lcm", tmp_path / "made.sdf"
    drive(log, "p3at", {}, seed=2, world="rooms", place="", legs=10, speeds=(0.1, 0.6))
    ruedo("import", log, "-o", made, "--mount", "0.16,0,0", "--resolution", "0.02", "--height", "2")
    ranges, spawn = [], []
    for world in ("rooms", str(made)):
        with Engine(world, spawn=spawn, noise=False, disable=["p3at/camera"]) as engine:
            engine.step(n=40)
            ranges.append(engine["lrf.ranges"].ravel().copy())
            x, y, _ = engine["pose.pos"].ravel()
            w, _, _, z = engine["pose.orientation"].ravel()
            spawn = [f"p3at@{x},{y},{2 * math.atan2(z, w)}"]
    near = np.abs(ranges[0] - ranges[1])[np.isfinite(ranges[0])]
    assert np.median(near) < 0.03


def test_other_units_and_another_clock(tmp_path):
    time, pose = np.arange(5.0), np.stack([np.arange(5.0), np.zeros(5), np.zeros(5)], axis=1)
    path, bearings = Path(time, pose, "made"), (-math.pi / 2, math.pi / 180, np.inf)
    ranges = np.array([room_scan((0, 0, 0))] * 5)
    millimetres = Recording("a", "made", truth=path, scans=Scans(time, ranges * 1000, *bearings))
    with pytest.raises(FitError, match="ranges and poses may be in other units than m"):
        occupancy(millimetres, np.zeros(3))
    late = Recording("a", "made", truth=path, scans=Scans(time + 1e6, ranges, *bearings))
    with pytest.raises(
        FitError, match="no scan lies within the path's times .* clocks or the units"
    ):
        occupancy(late, np.zeros(3))


def test_a_drive_without_a_path_is_aligned(tmp_path):
    """Exact scans of a room with a corner of its own; the odometry turns 4 % too much, and is off
    by more than 0.5 m and 0.4 rad in the end.
    """
    time = np.arange(0, 60, 0.25)
    true = np.stack([1.5 * np.sin(time / 6), 0.8 * np.sin(time / 4), time / 6], axis=1)
    mount = np.array([0.2, 0.1, 0.3])
    block = (-1.0, 1.8, 0.4)
    ranges = np.array([room_scan(one, block) for one in composed(true, np.tile(mount, (240, 1)))])
    believed = integrate(body_steps(true) * [1, 1, 1.04], true[0])
    drift = believed[-1] - true[-1]
    assert np.hypot(*drift[:2]) > 0.3 and drift[2] > 0.35
    scans = Scans(time, ranges, -math.pi / 2, math.pi / 180, np.inf)
    log = Recording(tmp_path / "a", "made", odometry=Path(time, believed, "drifts"), scans=scans)
    find_path(log, mount)
    apart = log.truth.pose - true
    assert np.hypot(*apart[:, :2].T).max() < 0.05
    assert np.abs(apart[:, 2]).max() < 0.02
    assert "loops are not closed" in log.findings[0]
    scans.ranges = np.full_like(ranges, np.nan)  # nothing to align: the odometry stays
    blind = Recording(tmp_path / "b", "made", odometry=log.odometry, scans=scans)
    find_path(blind, mount)
    assert blind.truth.pose == pytest.approx(believed)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["a.log"], 2, "-o/--out"),
        (["a.log", "-o", "x.world"], 2, "ends with .sdf"),
        (["a.log", "-o", "x.sdf", "--width", "3"], 2, "--width is not for a recorded drive"),
        (["a.log", "-o", "x.sdf", "--mount", "1,2"], 2, "three numbers, X,Y,YAW"),
        (["a.csv", "-o", "x.sdf"], 3, "scans are needed; this CSV file has truth"),
        (["one.log", "-o", "x.sdf"], 3, "1 scans at different places"),
    ],
)
def test_refused(tmp_path, words, code, said):
    (tmp_path / "a.log").write_text("".join(flaser([1, 2, 3], (x, 0, 0), x) for x in range(4)))
    (tmp_path / "one.log").write_text("".join(flaser([1, 2, 3], (0, 0, 0), x) for x in range(4)))
    (tmp_path / "a.csv").write_text("time,x,y,theta\n0,1,2,3\n1,1,2,3\n")
    _, error = ruedo("import", *words, code=code, cwd=tmp_path)
    assert said in error
