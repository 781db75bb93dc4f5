"""What the tests of campaigns share: a small campaign in a folder, and the program as its users
start it.
"""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest

SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ.get("RUEDO_BUILD_DIR", SOURCE / "build/release"))
RUEDO = os.environ.setdefault("RUEDO", str(BUILD / "bin/ruedo"))
PATIENCE = 400.0  # s, for what comes sooner or later, on a machine that does much else too
os.environ["RUEDO_PYTHON"] = sys.executable
os.environ["PATH"] = f"{BUILD / 'bin'}{os.pathsep}{os.environ['PATH']}"
os.environ["PYTHONPATH"] = f"{BUILD / 'python'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
sys.path.insert(0, str(BUILD / "python"))

WORLD = '''
from ruedo import World


def walls(distance):
    return World("walls").wall(distance, -2, distance, 2).robot("p3at")
'''

# HOLD is a file: while it exists, bold cases wait, so that a test meets the campaign half
# done. Those are the cases 2, 3, 6 and 7.
CONTROLLER = '''
import os
import time


def ahead(view):
    while os.path.exists(os.environ.get("HOLD", "")) and view.parameters["bold"]:
        time.sleep(0.01)
    near = view["lrf.ranges"].min() < 0.6
    return (0.0, 0.0) if near and not view.parameters["bold"] else (0.5, 0.0)
'''

# Of 8 cases those fail that are bold and have the wall near: 1.2 m ahead of the robot's centre.
CAMPAIGN = '''
name: walls
worlds:
  - {name: walls, generator: "world.py:walls", parameters: {distance: "{distance}"}}
controllers:
  - {name: ahead, python: "controller.py:ahead"}
parameters:
  distance: [1.2, 3.0]
  bold: [false, true]
seeds: 2
disable: [p3at/camera, p3at/sonar_front, p3at/sonar_rear]
expect: {no_contact: true}
limits: {duration: 3}
'''


@pytest.fixture
def folder(tmp_path):
    """With the files of the small campaign."""
    for name, text in (("world.py", WORLD), ("controller.py", CONTROLLER), ("c.yaml", CAMPAIGN)):
        (tmp_path / name).write_text(text)
    return tmp_path


def ruedo(*words, folder, code=0, **options):
    """The program's standard output and error; it must end with that exit code."""
    done = subprocess.run(
        [RUEDO, *map(str, words)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        **options,
    )
    assert done.returncode == code, (done.returncode, done.stdout, done.stderr)
    return done


def table(folder, *options, file="c.yaml"):
    """The results of the campaign as CSV."""
    ruedo("campaign", "export", file, *options, "-o", "table.csv", folder=folder)
    return (folder / "table.csv").read_text()


def wait_for(condition):
    until = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


def results_in(folder):
    try:
        with sqlite3.connect(f"file:{folder}/results.sqlite?mode=ro", uri=True) as db:
            return db.execute("SELECT count(*) FROM results").fetchone()[0]
    except sqlite3.Error:
        return 0
