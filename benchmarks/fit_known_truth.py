"""How well `ruedo fit` finds known errors: drawn sets of three robots in three worlds.

Run as PYTHONPATH=build/release/python .venv/bin/python benchmarks/fit_known_truth.py [SETS [PART]].
PART: odometry (a second of CPU a set), ranges (ten) or motion (twenty). Prints a Markdown table for
docs/reality.md; Ctrl-C ends it with the sets done so far.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/fit"))

from drives import SQUARE, drive
from ruedo import World
from ruedo.fit import read
from ruedo.fit.fitting import fit, read_robot

ROBOTS = ("p3at", "p3dx", "crawler")
PARTS = ("odometry", "ranges", "motion")
WORLDS = ("empty", "room", "hall")


def build(name):
    """SDF with space around the origin, for a robot that is put there."""
    world = World(name)
    if name == "room":
        for ends in ((-4, -4, 4, -4), (4, -4, 4, 4), (4, 4, -4, 4), (-4, 4, -4, -4), (2, 4, 2, 3)):
            world.wall(*ends)
    if name == "hall":
        for ends in ((-9, -4, 9, -4), (9, -4, 9, 4), (9, 4, -9, 4), (-9, 4, -9, -4)):
            world.wall(*ends)
        for x in (-6, 5):
            world.box(x, 1.5, size=(1.0, 0.6, 1.0), heading=0.4)
    return str(world)


def draw(rng):
    """The settings of a robot's drive and odometry, the delay of its commands (s), and the settings
    of its range finder.
    """
    left, right, track = rng.uniform(-0.03, 0.03, 3)
    drive_ = {
        "odometry.radius_error": f"{left} {right}",
        "odometry.track_error": track,
        "odometry.slip_noise": float(np.exp(rng.uniform(np.log(0.001), np.log(0.01)))),
        "velocity.acceleration": rng.uniform(0.2, 1.0),
        "velocity.deceleration": rng.uniform(0.2, 1.0),
        "velocity.turn_acceleration": rng.uniform(0.5, 3.0),
    }
    beams = {
        "lrf.lidar.noise.stddev": float(np.exp(rng.uniform(np.log(0.005), np.log(0.03)))),
        "lrf.bearing_noise": float(np.exp(rng.uniform(np.log(0.001), np.log(0.006)))),
        "lrf.update_rate": 2,
    }
    return drive_, rng.uniform(0.0, 0.3), beams


def truth_of(part, robot, drive_, delay, beams):
    """The values that a fit should find, by name."""
    if part == "motion":
        return {
            "speed: delay": delay,
            "turn rate: delay": delay,
            "speed: acceleration": drive_["velocity.acceleration"],
            "speed: deceleration": drive_["velocity.deceleration"],
            "turn rate: acceleration": drive_["velocity.turn_acceleration"],
        }
    if part == "ranges":
        return {
            "range noise": beams["lrf.lidar.noise.stddev"],
            "bearing noise": beams["lrf.bearing_noise"],
        }
    lever, slip = robot.geometry.track_m, drive_["odometry.slip_noise"]
    left, right = map(float, drive_["odometry.radius_error"].split())
    return {
        "left radius": robot.geometry.radius_m,
        "right radius": robot.geometry.radius_m,
        "track": lever,
        "left radius error": left,
        "right radius error": right,
        "track error": drive_["odometry.track_error"],
        "slip noise": slip,
        "alpha 1: heading per root rad": slip / np.sqrt(lever),
        "alpha 2: heading per root m": np.sqrt(2) * slip / lever,
        "alpha 3: distance per root m": slip / np.sqrt(2),
        "alpha 4: distance per root rad": slip * np.sqrt(lever) / 2,
    }


def one_set(number, part, folder):
    """The world, and [(name, truth, estimate)] of one drive; a course that touches something is
    drawn anew. An empty world shows the range finder nothing.
    """
    rng = np.random.default_rng(number)
    worlds = WORLDS[1:] if part == "ranges" else WORLDS
    robot, world = ROBOTS[number % 3], worlds[number // 3 % len(worlds)]
    place = folder / f"{world}.sdf"
    place.write_text(build(world))
    drive_, delay, beams = draw(rng)
    log = folder / f"{number}.lcm"
    nominal = read_robot(robot)
    sees = part == "ranges"
    off = ("camera", "sonar", "lidar") if sees else ("camera", "sonar", "lrf", "lidar")
    for attempt in range(20):
        if not drive(
            log, robot, {**drive_, **(beams if sees else {})}, number + 1000 * attempt,
            world=str(place), legs=64, speeds=(0.3, 0.6), course=SQUARE, off=off,
            near=world != "empty",
        ):  # fmt: skip
            break
    recording = read(log)
    recording.commands.time -= delay
    if part != "motion":
        recording.commands = None
    answer = fit([recording], nominal)
    found = {one.name: one for part in answer.parts.values() for one in part}
    log.unlink()
    true = truth_of(part, nominal, drive_, delay, beams)
    return world, [(name, value, found[name]) for name, value in true.items() if name in found]


def main(sets, part):
    rows = {}
    worlds = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            for number in range(sets):
                world, values = one_set(number, part, Path(folder))
                worlds.append(world)
                for name, true, one in values:
                    rows.setdefault(name, []).append((true, one))
                seconds = time.process_time()
                print(number, world, f"{seconds:.0f} s of CPU", file=sys.stderr, flush=True)
        except KeyboardInterrupt:
            pass
    where = ", ".join(f"{world} {worlds.count(world)}" for world in sorted(set(worlds)))
    print(f"{part.capitalize()}: {len(worlds)} sets; worlds: {where}\n")
    print(
        "| Value | determined | truth within the 95 % interval | median error | 90 % of errors below |"
    )
    print("|---|---|---|---|---|")
    total, held = 0, 0
    for name, every in rows.items():
        known = [(true, one) for true, one in every if one.value is not None]
        inside = sum(one.low <= true <= one.high for true, one in known)
        total, held = total + len(known), held + inside
        scale, unit = (1000, "ms") if name.endswith("delay") else (100, "%")
        relative = unit == "%" and not name.endswith("error")
        errors = [abs(one.value - true) / (abs(true) if relative else 1) for true, one in known]
        middle, most = np.quantile(errors, [0.5, 0.9]) * scale if errors else (np.nan, np.nan)
        print(
            f"| {name} | {len(known)} of {len(every)} | {inside} of {len(known)} "
            f"| {middle:.2g} {unit} | {most:.2g} {unit} |"
        )
    print(f"\nOf all intervals, {held} of {total} ({held / max(total, 1):.0%}) hold the truth.")


if __name__ == "__main__":
    chosen = sys.argv[2] if len(sys.argv) > 2 else PARTS[0]
    if chosen not in PARTS:
        sys.exit(f"{chosen}: allowed are {', '.join(PARTS)}")
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 30, chosen)
