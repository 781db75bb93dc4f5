"""Each world that ships with Ruedo, by its name: nothing in it is wrong, and its robots drive as
told.
"""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

BINARY_DIR = Path(
    os.environ.get("RUEDO_BINARY_DIR", Path(__file__).resolve().parents[2] / "build/release")
)
sys.path.insert(0, str(BINARY_DIR / "python"))
import ruedo

WORLDS = Path(__file__).resolve().parents[2] / "worlds"
NAMES = sorted(path.stem for path in WORLDS.glob("*.sdf"))
CAMERAS = {"arena": "p3at", "rooms": "p3at", "maze": "p3at", "office": "p3at"}


def engine(name):
    return ruedo.Engine(
        name, noise=False, disable=[f"{CAMERAS[name]}/camera"] if name in CAMERAS else []
    )


def test_the_page_shows_each():
    page = (WORLDS.parent / "docs/worlds.md").read_text()
    robots = [
        folder.name for folder in (WORLDS / "robots").iterdir() if (folder / "model.sdf").exists()
    ]
    for name in NAMES + robots:
        assert (
            f"**{name}**" in page and (WORLDS.parent / f"docs/images/worlds/{name}.jpg").exists()
        ), name


@pytest.mark.parametrize("name", NAMES)
def test_nothing_in_it_is_wrong(name, tmp_path):
    checked = subprocess.run(
        [BINARY_DIR / "bin/ruedo", "check", name, "--json"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert checked.returncode == 0 and json.loads(checked.stdout) == [], checked


@pytest.mark.parametrize("name", ["rooms", "maze", "warehouse", "field", "crossing"])
def test_a_robot_drives_as_commanded(name):
    """0.2 m/s for 1 s, where it starts: 0.2 m, but for what starting and stopping take (below 0.1
    m).
    """
    with engine(name) as world:
        before = world["pose.pos"][0, 0].copy()
        for _ in range(10):
            world.step([0.2, 0.0], 20)
        way = math.dist(world["pose.pos"][0, 0], before)
    assert 0.1 < way <= 0.2 + 1e-6
