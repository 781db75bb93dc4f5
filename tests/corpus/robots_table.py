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

# Their wheels' joints are fixed, or there is no plugin that drives them: in Gazebo they stand
# still, too.
STAND_THERE_TOO = {
    "Pioneer 3-DX (MobileRobots, URDF)",
    "Pioneer 3-DX (MobileRobots, xacro)",
    "PowerBot (MobileRobots)",
}


def check(program, path):
    """What is named, in words, each once."""
    done = subprocess.run(
        [program, "check", path, "--json"], capture_output=True, text=True, timeout=120
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


def state_of_base(sim, robot):
    """Of base_link, where the model has it; else of its first link that moves."""
    links = [body.name for body in sim.bodies if body.name.startswith(f"{robot.name}/")]
    base = f"{robot.name}/base_link"
    return sim.state(base if base in links else links[0])


def yaw_of(state):
    w, x, y, z = state.orientation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def drive(path):
    """Steering, way, turn, sensors that publish, all sensors. Raises what the server says."""
    with ruedo.launch(path, args=["--lockstep", "1", "--no-noise"], timeout=120) as sim:
        if not sim.robots:
            return "stands still", math.nan, math.nan, 0, 0
        robot = sim.robots[0]
        seen = sim.step(0)
        published = collections.Counter(message.channel for message in seen.messages)
        if not robot.drive:
            return "stands still", math.nan, math.nan, 0, 0
        steered = robot.drive.endswith(("ackermann", "tricycle"))
        second = round(1.0 / sim.step_size)

        def go(seconds, v, omega):
            for _ in range(round(seconds * 4)):
                part = sim.step(second // 4, [robot.velocity_command(v, omega)])
                published.update(message.channel for message in part.messages)
            return state_of_base(sim, robot)

        go(0.5, 0.0, 0.0)
        before = go(0.25, 0.0, 0.0)
        go(2.0, 0.3, 0.0)
        straight = go(2.0, 0.0, 0.0)
        way = math.dist(straight.position[:2], before.position[:2])
        go(2.0, 0.5 if steered else 0.0, 0.5)
        turned = go(2.0, 0.0, 0.0)
        turn = math.remainder(yaw_of(turned) - yaw_of(straight), 2 * math.pi)
        sensors = [
            device
            for device in robot.devices
            if device.kind not in ("odometry", "pose", "motion", "collisions", "joints")
        ]
        alive = sum(
            any(
                channel == f"{robot.name}/{each.name}"
                or channel.startswith(f"{robot.name}/{each.name}/")
                for channel in published
            )
            for each in sensors
        )
        return robot.drive.partition(" ")[2] or "differential", way, turn, alive, len(sensors)


def row(program, name, path):
    named = check(program, path)
    try:
        steering, way, turn, alive, sensors = drive(path)
    except ruedo.RuedoError as error:
        return f"| {name} | does not load | | | | {str(error).splitlines()[0]} |"
    driven = f"{way:.3f} m | {turn:.3f} rad" if not math.isnan(way) else "- | -"
    return f"| {name} | {steering} | {driven} | {alive} of {sensors} | {'<br>'.join(named) or 'nothing'} |"


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
