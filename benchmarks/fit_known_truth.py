"""How well `ruedo fit` finds known errors: drawn sets of three robots in three worlds.

Run as PYTHONPATH=build/release/python .venv/bin/python benchmarks/fit_known_truth.py [SETS [PART]].
PART: odometry (two seconds of CPU a set), ranges (eight), motion or lag (two). Prints a Markdown
table for docs/reality.md; Ctrl-C ends it with the sets done so far.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests/fit"))

from drives import SQUARE, drive, integrated
from ruedo import World
from ruedo.fit import read
from ruedo.fit.fitting import fit, mount_on, read_robot
from ruedo.fit.motion import fit_motion
from ruedo.fit.rangefinder import fit_rangefinder
from ruedo.fit.recording import Commands

ROBOTS = ("p3at", "p3dx", "crawler")
PARTS = ("odometry", "ranges", "motion", "lag")
WORLDS = ("empty", "room", "hall")
TO_SEE = ("room", "hall", "pillars")  # an empty one shows a range finder nothing
MISPLACED = (0.05, 0.05, 0.02)  # m, m, rad: at most, of a range finder
UNITS = {  # factor and unit of errors that are not relative
    "delay": (1000, "ms"),
    "time offset": (1000, "ms"),
    "mounting ahead": (1000, "mm"),
    "mounting left": (1000, "mm"),
    "mounting angle": (1000, "mrad"),
}
LATE = 0.05  # s, at most, of its clock
MOCAP = 5e-4  # m and rad, of a pose of the path that motion is fitted to


def build(name):
    """SDF with space around the origin, for a robot that is put there."""
    world = World(name)
    if name == "room":
        for ends in ((-4, -4, 4, -4), (4, -4, 4, 4), (4, 4, -4, 4), (-4, 4, -4, -4), (2, 4, 2, 3)):
            world.wall(*ends)
    if name == "pillars":
        for ends in ((-6, -5, 6, -5), (6, -5, 6, 5), (6, 5, -6, 5), (-6, 5, -6, -5)):
            world.wall(*ends)
        for x, y in ((-3.5, 2.5), (3, 3), (-3, -3), (3.5, -2.5), (4.5, 0.5)):
            world.cylinder(x, y, radius=0.2 + abs(x) / 20, height=1.0)
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


def draw_motion(rng):
    """Speeds (m/s, rad/s): what settings are added for motion, and the dead zone."""
    limits = {
        "velocity.max_speed": rng.uniform(0.35, 0.45),
        "velocity.max_turn_rate": rng.uniform(0.5, 0.7),
    }
    return limits, (rng.uniform(0.03, 0.06), rng.uniform(0.04, 0.1))


def truth_of_motion(drive_, delay, dead):
    return {
        "speed: delay": delay,
        "turn rate: delay": delay,
        "speed: acceleration": drive_["velocity.acceleration"],
        "speed: deceleration": drive_["velocity.deceleration"],
        "turn rate: acceleration": drive_["velocity.turn_acceleration"],
        "turn rate: deceleration": drive_["velocity.turn_acceleration"],
        "speed: limit": drive_["velocity.max_speed"],
        "turn rate: limit": drive_["velocity.max_turn_rate"],
        "speed: gain": 1.0,
        "turn rate: gain": 1.0,
        "speed: dead zone": dead[0],
        "turn rate: dead zone": dead[1],
    }


def fit_ranges(recording, robot, beams, rng):
    """Estimates and truth of a range finder whose mount is believed elsewhere, and whose clock is
    off.
    """
    late, mount = rng.uniform(-LATE, LATE), mount_on(recording, robot)
    recording.scans.time += late
    found = fit_rangefinder([recording], mount + rng.uniform(-1, 1, 3) * MISPLACED)[1]
    return found, {
        "range noise": beams["lrf.lidar.noise.stddev"],
        "bearing noise": beams["lrf.bearing_noise"],
        "mounting ahead": mount[0],
        "mounting left": mount[1],
        "mounting angle": mount[2],
        "time offset": late,
    }


def truth_of_odometry(robot, drive_):
    """The values that a fit should find, by name."""
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
    drawn anew.
    """
    rng = np.random.default_rng(number)
    worlds = TO_SEE if part == "ranges" else WORLDS
    robot, world = ROBOTS[number % 3], worlds[number // 3 % len(worlds)]
    place = folder / f"{world}.sdf"
    place.write_text(build(world))
    drive_, delay, beams = draw(rng)
    log = folder / f"{number}.lcm"
    nominal = read_robot(robot)
    sees, moves = part == "ranges", part == "motion"
    off = ("camera", "sonar", "lidar") if sees else ("camera", "sonar", "lrf", "lidar")
    limits, dead = draw_motion(rng)
    course = {"legs": 64, "speeds": (0.3, 0.6), "course": SQUARE}
    if part == "odometry":  # at rest between legs: Thrun's alphas are those of pure motions
        course |= {"legs": 96, "pause": 6}
    if moves:
        drive_ |= limits
        course |= {"speeds": (0.4, 0.6), "quarters": (4, 14), "factors": (0.05, 1.3), "dead": dead}
    for attempt in range(20):
        sent = []
        if not drive(
            log, robot, {**drive_, **(beams if sees else {})}, number + 1000 * attempt,
            world=str(place), off=off, near=world != "empty", sent=sent, **course,
        ):  # fmt: skip
            break
    recording = read(log)
    log.unlink()
    recording.commands = None
    if moves:
        time, ahead, turn = np.array(sent).T
        recording.commands = Commands(time - delay, np.stack([ahead, 0 * ahead, turn], axis=1))
        recording.truth.pose += rng.normal(0, MOCAP, recording.truth.pose.shape)
        found = fit_motion(recording)
        true = truth_of_motion(drive_, delay, dead)
    elif sees:
        found, true = fit_ranges(recording, nominal, beams, rng)
    else:
        found = [one for part in fit([recording], nominal).parts.values() for one in part]
        true = truth_of_odometry(nominal, drive_)
    found = {one.name: one for one in found}
    return world, [(name, value, found[name]) for name, value in true.items() if name in found]


def lag_set(number):
    """As one_set(), of a drive with a lag, which Ruedo's robots do not have."""
    rng = np.random.default_rng(number)
    delay, lag = rng.uniform(0.01, 0.3), rng.uniform(0.02, 0.3)
    rise, fall = rng.uniform(0.3, 1.5, 2)
    found = {one.name: one for one in fit_motion(integrated(number, delay, rise, fall, lag))}
    true = {"delay": delay, "acceleration": rise, "deceleration": fall, "lag": lag}
    rows = [(f"{axis}: {k}", v) for axis in ("speed", "turn rate") for k, v in true.items()]
    return "made", [(name, value, found[name]) for name, value in rows]


def main(sets, part):
    rows = {}
    worlds = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            for number in range(sets):
                if part == "lag":
                    world, values = lag_set(number)
                else:
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
        scale, unit = UNITS.get(name.split(": ")[-1], (100, "%"))
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
