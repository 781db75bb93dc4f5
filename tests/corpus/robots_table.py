"""Drives every robot of a folder of public files, and writes what came of it as a table.

    tests/corpus/robots_table.py build/release/bin/ruedo ../shared/corpus [-o docs/corpus.md]

Each is told to drive 0.3 m/s for 2 s and to turn 0.5 rad/s for 2 s, in lockstep and without noise.
A sensor publishes when at least one message of it came. What `ruedo check` names is grouped by what
it says.
"""

import argparse
import collections
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import ruedo
from sections import put

TITLE = "Robots, driven"
HEAD = """Written by `tests/corpus/robots_table.py RUEDO FOLDER -o docs/corpus.md`, and checked by a test. Each robot is commanded 0.3 m/s for 2 s, comes to rest, and
is then commanded 0.5 rad/s for 2 s, without noise. "Way" and "turn" are measured by the true pose of the link `base_link`, within the acceleration limits that its files give. "Sensors" counts those
that published. "Named" is what Ruedo reported, including files that the folder lacks (meshes, included xacro).
"""

# Files with a robot that Gazebo drives, as a xacro file and as it expands: NAME ~ FILE.
ROBOTS = dict(
    line.split(" ~ ")
    for line in (Path(__file__).parent / "robots.txt").read_text(encoding="utf-8").splitlines()
)

# Their wheels' joints are fixed, or no plugin drives them: in Gazebo they stand still,
# too.
STAND_THERE_TOO = {
    "Pioneer 3-DX (MobileRobots, URDF)",
    "Pioneer 3-DX (MobileRobots, xacro)",
    "PowerBot (MobileRobots)",
}


def check(program, path, args=()):
    """What is named, in words, each once."""
    done = subprocess.run(
        [program, "check", path, "--json", *args], capture_output=True, text=True, timeout=120
    )
    if not done.stdout.startswith("["):
        return [done.stderr.strip().splitlines()[-1]]
    texts = collections.Counter()
    for each in json.loads(done.stdout):
        text = re.sub(r"\S*/corpus/", "", each["text"])
        text = re.sub(r"the mesh '[^']*'", "a mesh", text)
        text = re.sub(r"the include '[^']*'", "an include", text)
        texts[text.replace("|", "\\|").replace("<", "&lt;")] += 1
    return [text + (f" ({count} places)" if count > 1 else "") for text, count in texts.items()]


def base_of(sim, robot):
    """base_link, where the model has it; else its first link that moves."""
    links = [body.name for body in sim.bodies if body.name.startswith(f"{robot.name}/")]
    base = f"{robot.name}/base_link"
    return base if base in links else links[0]


def yaw_of(state):
    w, x, y, z = state.orientation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


class Driven(NamedTuple):
    """What came of the commands: 0.3 m/s ahead for 2 s, 0.5 rad/s for 2 s, and 0.3 m/s to the left
    for 2 s where the robot can. By base_link; NaN where it was not commanded."""

    steering: str
    way: float = math.nan  # m, in the plane
    aside: float = math.nan  # m, of the way ahead, to the left
    turn: float = math.nan  # rad
    strafe: float = math.nan  # m, to the left
    alive: int = 0  # sensors that published
    sensors: int = 0


def drive(path, args=()):
    """Raises what the server says."""
    with launched(path, args) as sim:
        if not sim.robots or not sim.robots[0].drive:
            return Driven("stands still")
        robot = sim.robots[0]
        seen = [sim.step(0), sim.step(round(1.2 / sim.step_size))]
        published = {message.channel for part in seen for message in part.messages}
        sensors = [f"{robot.name}/{device.name}" for device in sensors_of(robot)]
    alive = sum(publishes(sensor, published) for sensor in sensors)
    # Pictures take longer than the drive, which no sensor concerns.
    without = [word for sensor in sensors for word in ("--disable", sensor)]
    with launched(path, [*args, *without]) as sim:
        steering = sim.robots[0].drive.partition(" ")[2] or "differential"
        return Driven(steering, *ways(sim, sim.robots[0]), alive, len(sensors))


def launched(path, args):
    return ruedo.launch(path, args=["--lockstep", "1", "--no-noise", *args], timeout=120)


def ways(sim, robot):
    """Way, aside, turn, strafe."""
    steered = robot.drive.endswith(("ackermann", "tricycle"))
    second = round(1.0 / sim.step_size)
    base = base_of(sim, robot)

    def go(seconds, *velocity):
        for _ in range(round(seconds * 10)):  # watchdogs of controllers are as short as 0.2 s
            sim.step(second // 10, [robot.velocity_command(*velocity)])
        return sim.state(base)

    def measured(*velocity):
        before = sim.state(base)
        go(2.0, *velocity)
        return before, go(2.0, 0.0, 0.0)

    go(0.75, 0.0, 0.0)
    ahead, aside = moved(*measured(0.3, 0.0))
    for v in (0.5, 3.0) if steered else (0.0,):  # a car may not drive so narrow a curve
        before, after = measured(v, 0.5)
        turn = math.remainder(yaw_of(after) - yaw_of(before), 2 * math.pi)
        if turn > 0.99:
            break
    strafe = math.nan
    if robot.drive.endswith(("mecanum", "omni", "holonomic")):
        strafe = moved(*measured(0.0, 0.0, 0.3))[1]
    return math.hypot(ahead, aside), aside, turn, strafe


def moved(before, after):
    """m ahead and m to the left, as seen before."""
    x, y = (float(b - a) for a, b in zip(before.position[:2], after.position[:2]))
    yaw = yaw_of(before)
    return x * math.cos(yaw) + y * math.sin(yaw), y * math.cos(yaw) - x * math.sin(yaw)


def sensors_of(robot):
    others = ("odometry", "pose", "motion", "collisions", "joints")
    return [device for device in robot.devices if device.kind not in others]


def publishes(device, channels):
    return any(each == device or each.startswith(f"{device}/") for each in channels)


def row(program, name, path):
    named = check(program, path)
    try:
        driven = drive(path)
    except ruedo.RuedoError as error:
        return f"| {name} | does not load | | | | {str(error).splitlines()[0]} |"
    stands = math.isnan(driven.way)
    way = "- | -" if stands else f"{driven.way:.3f} m | {driven.turn:.3f} rad"
    sensors = f"{driven.alive} of {driven.sensors}"
    return f"| {name} | {driven.steering} | {way} | {sensors} | {'<br>'.join(named) or 'nothing'} |"


def table(program, folder, names=None):
    os.environ["RUEDO"] = str(program)
    # ROS packages and models that the files name by their package.
    os.environ["GAZEBO_MODEL_PATH"] = f"{folder}/gazebo_models:{folder}/turtlebot3/models"
    rows = []
    for name, path in ROBOTS.items():
        if names is None or name in names:
            rows.append(row(program, name, folder / path))
            print(rows[-1], file=sys.stderr, flush=True)
    return (
        "\n".join(
            [
                "| Robot | Steering | Way for 0.6 m | Turn for 1 rad | Sensors | Named |",
                "|---|---|---|---|---|---|",
                *rows,
            ]
        )
        + "\n"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ruedo", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--only", action="append", help="a robot's name")
    arguments = parser.parse_args()
    text = (
        HEAD + "\n" + table(arguments.ruedo.resolve(), arguments.folder.resolve(), arguments.only)
    )
    if arguments.out:
        put(arguments.out, TITLE, text)
    else:
        sys.stdout.write(text)


if __name__ == "__main__":
    main()
