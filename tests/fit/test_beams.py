"""Shares of beams that come back short, far off or not at all, against drawn ones in a room whose
ranges are known in closed form.
"""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from conftest import ruedo
from ruedo.fit.beams import cast, fit_beams_in
from ruedo.fit.recording import Path, Recording, Scans
from test_rangefinder import ranges_beside_pillar
from test_readers import flaser

ANGLES = np.radians(np.arange(-90, 91))


def wall(name, x, y, length_x, length_y, reflectance):
    return f"""<model name="{name}"><static>true</static><pose>{x} {y} 0.5 0 0 0</pose><link name="l">
<collision name="c"><geometry><box><size>{length_x} {length_y} 1</size></box></geometry>
<surface><ruedo:laser_reflectance>{reflectance}</ruedo:laser_reflectance></surface></collision>
</link></model>"""


@pytest.fixture
def room(tmp_path):
    """6 x 6 m inside; the wall at x = 3 is dark. A pillar of 0.3 m radius stands in the middle."""
    world = tmp_path / "room.sdf"
    world.write_text(f"""<sdf version="1.9" xmlns:ruedo="urn:ruedo"><world name="room">
{wall("east", 3.1, 0, 0.2, 6.4, 0.1)}{wall("west", -3.1, 0, 0.2, 6.4, 1)}
{wall("north", 0, 3.1, 6.4, 0.2, 1)}{wall("south", 0, -3.1, 6.4, 0.2, 1)}
<model name="pillar"><static>true</static><pose>0 0 0.5 0 0 0</pose><link name="l"><collision name="c">
<geometry><cylinder><radius>0.3</radius><length>1</length></cylinder></geometry></collision></link></model>
</world></sdf>""")
    return world


def drive():
    """(N, 3) poses around the pillar, and the exact ranges (N, 181) there."""
    turn = np.arange(400) * 0.21
    poses = np.stack([1.5 * np.cos(turn / 8), 1.5 * np.sin(turn / 8), turn], axis=1)
    exact = np.array([ranges_beside_pillar(x, y, heading + ANGLES) for x, y, heading in poses])
    return poses, exact


def test_beams_meet_what_geometry_says(room):
    poses, exact = drive()
    met = cast(room, poses, ANGLES, 0.2)
    assert met.reach == pytest.approx(exact, abs=2e-5)
    bearing = poses[:, 2:] + ANGLES
    ends = poses[:, :1] + exact * np.cos(bearing), poses[:, 1:2] + exact * np.sin(bearing)
    east = np.isfinite(met.incidence) & (ends[0] > 3 - 1e-4) & (np.abs(ends[1]) < 2.9)
    right = np.abs(met.incidence[east] - np.arccos(np.cos(bearing[east]))) < 1e-3
    assert right.mean() > 0.995  # beside the pillar three ends may lie nearly on a line
    assert met.reflectance[east][right] == pytest.approx(np.full(right.sum(), 0.1), abs=1e-3)
    assert np.isfinite(met.incidence).mean() > 0.9


def test_drawn_shares_are_found(room, tmp_path):
    """The dark wall swallows half of the beams, other surfaces more of those that come from afar;
    of the rest one in 25 is short.
    """
    rng = np.random.default_rng(3)
    poses, exact = drive()
    bearing = poses[:, 2:] + ANGLES
    dark = poses[:, :1] + exact * np.cos(bearing) > 3 - 1e-4
    lost = np.where(dark, 0.5, np.where(exact < 2, 0.05, 0.25))
    short = (1 - lost) * 0.04 * (exact > 1.0)  # others are not 0.3 m short
    chance = rng.random(exact.shape)
    ranges = exact + 0.01 * rng.normal(size=exact.shape)
    ranges[chance < lost + short] = 0.5 * exact[chance < lost + short]
    ranges[chance < lost] = math.inf
    time = np.arange(len(poses)) / 10
    scans = Scans(time, ranges, ANGLES[0], math.radians(1), 30.0)
    recording = Recording(tmp_path / "a.csv", "CSV", truth=Path(time, poses, "exact"), scans=scans)
    found = {one.name: one for one in fit_beams_in(room, recording, np.zeros(3))}

    def is_right(name, expected, among):
        one = found[name]
        assert one.low - 0.005 <= expected[among].mean() <= one.high + 0.005, (name, one)
        assert one.high - one.low < 0.06, one

    near, far = exact < 2, (exact >= 2) & (exact < 4)
    is_right("share without return, 0 to 2 m", lost, near)
    is_right("share without return, 2 to 4 m", lost, far)
    is_right("share short, 2 to 4 m", short, far)
    is_right("share without return, reflectance 0.05 to 0.2", lost, dark)
    is_right("share without return, reflectance 0.5 to 1", lost, ~dark)
    assert found["share far off, 2 to 4 m"].value == 0.0
    assert "share without return, incidence 0 to 30 deg" in found
    assert "share without return, 32 to 64 m" not in found  # nothing is there


def test_a_fit_takes_a_world(room, tmp_path):
    """The program, with a log whose beams all come back but for those to the dark wall."""
    poses, exact = drive()
    bearing = poses[:, 2:] + ANGLES
    ranges = np.where(poses[:, :1] + exact * np.cos(bearing) > 3 - 1e-4, 81.83, exact)
    log = tmp_path / "drive.log"
    log.write_text(
        "".join(
            flaser([f"{one:.4f}" for one in row], pose, i / 10)
            for i, (row, pose) in enumerate(zip(ranges, poses))
        )
    )
    said, _ = ruedo("fit", log, "--world", room, "--json")
    beams = {one["name"]: one["value"] for one in json.loads(said)["parts"][f"Beams in {room}"]}
    assert beams["share without return, reflectance 0.05 to 0.2"] == 1.0
    assert beams["share without return, reflectance 0.5 to 1"] == 0.0
    assert "nowhere" in ruedo("fit", log, "--world", "nowhere", code=3)[1]
