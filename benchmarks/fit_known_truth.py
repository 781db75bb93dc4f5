"""How well `ruedo fit` finds known errors: drawn sets of three robots in three worlds.

Run as PYTHONPATH=build/release/python .venv/bin/python benchmarks/fit_known_truth.py [SETS].
Prints a Markdown table for docs/reality.md.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/fit"))

from drives import SQUARE, drive
from ruedo.fit import read
from ruedo.fit.fitting import fit, read_robot

ROBOTS = ("p3at", "p3dx", "crawler")
PLACES = {"empty": "0,0", "arena": "-3,-3", "warehouse": "0,0"}


def truth_of(robot, left, right, track, slip):
    """The values that a fit should find, by name."""
    lever = robot.geometry.track_m
    return {
        "left radius": robot.geometry.radius_m,
        "right radius": robot.geometry.radius_m,
        "track": lever,
        "left radius error": left,
        "right radius error": right,
        "track error": track,
        "slip noise": slip,
        "alpha 1: heading per root rad": slip / np.sqrt(lever),
        "alpha 2: heading per root m": np.sqrt(2) * slip / lever,
        "alpha 3: distance per root m": slip / np.sqrt(2),
        "alpha 4: distance per root rad": slip * np.sqrt(lever) / 2,
    }


def one_set(number, folder):
    """[(name, truth, estimate)] of one drive; a course that touches something is drawn anew."""
    rng = np.random.default_rng(number)
    robot, world = ROBOTS[number % 3], list(PLACES)[number // 3 % 3]
    left, right, track = rng.uniform(-0.03, 0.03, 3)
    slip = float(np.exp(rng.uniform(np.log(0.001), np.log(0.01))))
    settings = {
        "odometry.radius_error": f"{left} {right}",
        "odometry.track_error": track,
        "odometry.slip_noise": slip,
    }
    log = folder / f"{number}.lcm"
    off = ("camera", "sonar", "lrf", "lidar")
    where = PLACES[world]
    for attempt in range(20):
        try:
            touched = drive(
                log, robot, settings, number + 1000 * attempt, world=world, place=where,
                legs=64, speeds=(0.3, 0.6), course=SQUARE, off=off,
            )  # fmt: skip
        except ValueError:  # no room there
            touched, world = 1, "empty"
        if not touched:
            break
        if attempt == 3:
            world, where = "empty", "0,0"
    nominal = read_robot(robot)
    found = {one.name: one for one in fit([read(log)], nominal).parts["Odometry"]}
    log.unlink()
    true = truth_of(nominal, left, right, track, slip)
    return world, [(name, value, found[name]) for name, value in true.items()]


def main(sets):
    rows = {}
    worlds = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(sets):
            world, values = one_set(number, Path(folder))
            worlds.append(world)
            for name, true, one in values:
                rows.setdefault(name, []).append((true, one))
            print(number, world, file=sys.stderr, flush=True)
    print(
        f"{sets} sets; worlds: {', '.join(f'{w} {worlds.count(w)}' for w in sorted(set(worlds)))}\n"
    )
    print(
        "| Value | determined | truth within the 95 % interval | median error | 90 % of errors below |"
    )
    print("|---|---|---|---|---|")
    for name, every in rows.items():
        known = [(true, one) for true, one in every if one.value is not None]
        inside = sum(one.low <= true <= one.high for true, one in known)
        relative = not name.endswith("error")
        errors = [abs(one.value - true) / (abs(true) if relative else 1) for true, one in known]
        middle, most = np.quantile(errors, [0.5, 0.9]) * 100 if errors else (np.nan, np.nan)
        print(
            f"| {name} | {len(known)} of {len(every)} | {inside} of {len(known)} "
            f"| {middle:.2g} % | {most:.2g} % |"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
