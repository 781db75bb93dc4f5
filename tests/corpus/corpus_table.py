"""Runs every world, model and robot of a folder for some simulated seconds and writes what came of
it as a table.

    tests/corpus/corpus_table.py build/release/bin/ruedo ../shared/corpus -o docs/corpus.md
    [--pictures FOLDER]

The table says for each file whether it ran, and everything that `ruedo check` named.
"""

import argparse
import collections
import json
import re
import subprocess
import sys
from pathlib import Path

from sections import put

KINDS = {".world", ".sdf", ".urdf", ".xacro"}
TITLE = "Every file"
HEAD = """Written by `tests/corpus/corpus_table.py RUEDO FOLDER -o docs/corpus.md` from public files: TurtleBot3's simulations, AWS RoboMaker's small warehouse,
Gazebo's models, Husky, linorobot2, neobotix, and MobileRobots' descriptions of their robots. They are not part of Ruedo. Every file is run for two simulated seconds
(`ruedo run FILE --rate max --duration 2`). "Runs" says whether it ran, or gives the exit code; the error in the last column then says why the file cannot run. A xacro file that contains only macros has no robot.
"""


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.suffix in KINDS and path.is_file())


def call(*arguments, timeout=60):
    try:
        return subprocess.run(
            [str(each) for each in arguments], capture_output=True, text=True, timeout=timeout
        )
    except subprocess.TimeoutExpired:
        return None


def what(ruedo, path):
    """What there is in the file, in words."""
    done = call(ruedo, "info", path, "--json")
    if done is None or done.returncode:
        return "-"
    info = json.loads(done.stdout)
    kinds = collections.Counter(device["kind"] for device in info["devices"])
    sensors = [
        f"{count} {kind}" if count > 1 else kind
        for kind, count in sorted(kinds.items())
        if kind not in ("odometry", "pose", "motion", "collisions", "joints")
    ]
    drives = [robot["drive"] for robot in info["robots"] if robot["drive"]]
    robots = (
        f"{len(info['robots'])} robot{'s' if len(info['robots']) > 1 else ''}"
        if info["robots"]
        else "no robot"
    )
    return ", ".join([robots] + ([f"{drives[0]} drive"] if drives else []) + sensors)


def findings(ruedo, path):
    """Texts of ruedo check, each once, with the number of places."""
    done = call(ruedo, "check", path, "--json")
    if done is None:
        return ["ruedo check took more than a minute"]
    counts = collections.Counter(
        (each["kind"], short(each["text"], path)) for each in json.loads(done.stdout)
    )
    return [
        f"{kind}: {text}" + (f" ({count} places)" if count > 1 else "")
        for (kind, text), count in counts.items()
    ]


def short(text, path):
    text = re.sub(r"\S*/corpus/", "", text.replace(str(path.parent) + "/", ""))
    return text.replace("|", "\\|").replace("<", "&lt;")


def run(ruedo, path, seconds, timeout):
    done = call(
        ruedo,
        "run",
        path,
        "--rate",
        "max",
        "--duration",
        seconds,
        "--lcm",
        "memq://",
        "--quiet",
        timeout=timeout,
    )
    if done is None:
        return f"not within {timeout} s"
    if done.returncode == 0:
        return "yes"
    return f"exit code {done.returncode}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("ruedo", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("-o", "--out", type=Path)
    parser.add_argument("--pictures", type=Path, help="a folder for a picture of each file")
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--timeout", type=float, default=900)
    arguments = parser.parse_args()
    lines = [HEAD, "| File | What | Runs | Not supported, repaired, wrong |", "|---|---|---|---|"]
    for path in files(arguments.folder):
        name = path.relative_to(arguments.folder)
        ran = run(arguments.ruedo, path, arguments.seconds, arguments.timeout)
        said = findings(arguments.ruedo, path)
        lines.append(
            f"| {name} | {what(arguments.ruedo, path)} | {ran} | {'<br>'.join(said) if said else 'nothing'} |"
        )
        print(lines[-1], file=sys.stderr, flush=True)
        if arguments.pictures:
            arguments.pictures.mkdir(parents=True, exist_ok=True)
            call(
                arguments.ruedo,
                "render",
                path,
                "-o",
                arguments.pictures / (str(name).replace("/", "_") + ".png"),
                "--size",
                "640x480",
            )
    text = "\n".join(lines) + "\n"
    if arguments.out:
        put(arguments.out, TITLE, text)
    else:
        print(text)


if __name__ == "__main__":
    main()
