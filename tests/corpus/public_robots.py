"""Drives robots of public repositories, and writes docs/robots: what came of each, with a picture.

    tests/corpus/public_robots.py clone FOLDER
    tests/corpus/public_robots.py drive FOLDER --ruedo build/release/bin/ruedo

The first gets the repositories of repositories.txt, each at its commit, into one folder. The second
drives the robots of public_robots.txt, NAME ~ REPOSITORY ~ FILE ~ XACRO ARGUMENTS ~ WHY IT IS
NOT GOOD, of those repositories that the folder has; the rows of the others stay as they are.
"""

import argparse
import math
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import ruedo
from robots_table import check, drive

HERE = Path(__file__).parent
OUT = HERE.parents[1] / "docs" / "robots"
EXPECTED = {"way": (0.6, 0.006), "aside": (0.0, 0.006), "turn": (1.0, 0.01), "strafe": (0.6, 0.006)}
MOST_NAMED = 6
HEAD = """# Public robots, driven

Written by `tests/corpus/public_robots.py drive FOLDER --ruedo RUEDO` from public files, which are not part of Ruedo; `tests/corpus/public_robots.py clone FOLDER` gets them,
each repository at the commit below. Every robot that was tried is here, also those that failed. Files of 4 MiB and more were not at hand (some meshes: "a mesh is not found").

Each robot stands on a level plane and is commanded, without noise, 0.3 m/s for 2 s; 0.5 rad/s for 2 s (cars at 0.5 m/s, or at 3 m/s if they cannot drive so narrow a curve); and, if it can, 0.3 m/s to the left for 2 s.
It comes to rest after each. "Way", "aside" (to the left, on that way), "turn" and "strafe" are measured by the true pose of the link `base_link`, or of the first link that moves. They should be 0.6 m, 0 m,
1 rad and 0.6 m. "Good" is within 1 % (6 mm aside). "Sensors" counts those that published. The last column is what `ruedo check` reports, or why the robot does not load, or is not good.
"""
COLUMNS = "Robot | Picture | Good | Steering | Way, m | Aside, m | Turn, rad | Strafe, m | Sensors | Reported"


def read(name):
    lines = (HERE / name).read_text(encoding="utf-8").splitlines()
    return [line.split(" ~ ") for line in lines]


ROBOTS = read("public_robots.txt")
REPOSITORIES = {full.partition("/")[2]: (full, commit) for full, commit in read("repositories.txt")}


def clone(folder, only):
    """Gets the repositories that the folder lacks; returns those that could not be got."""
    failed = []
    for name, (repository, commit) in REPOSITORIES.items():
        into = folder / name
        if into.exists() or (only and name not in only):
            continue
        part = folder / f"{name}.part"  # what is interrupted is not taken for whole
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
        commands = (
            ["init", "-q"],
            ["fetch", "-q", "--depth", "1", f"https://github.com/{repository}", commit],
            ["checkout", "-q", "FETCH_HEAD"],
        )
        if any(subprocess.run(["git", "-C", part, *command]).returncode for command in commands):
            shutil.rmtree(part)
            failed.append(repository)
            continue
        part.rename(into)
        print(f"{repository} is in {into}", file=sys.stderr, flush=True)
    return failed


def set_paths(folder, repository):
    """Where files name packages, also of other repositories, and models."""
    packages = {str(each.parent.parent) for each in folder.glob("**/package.xml")}
    models = {str(each.parent.parent) for each in (folder / repository).glob("**/model.sdf")}
    os.environ["ROS_PACKAGE_PATH"] = ":".join(sorted(packages))
    os.environ["GAZEBO_MODEL_PATH"] = ":".join(sorted(models))


def picture(path, args, image):
    """A link to it; nothing where none can be drawn."""
    command = [os.environ["RUEDO"], "render", path, "--size", "160x120", "-o", image, "--quiet"]
    done = subprocess.run([*command, *args], capture_output=True, timeout=120)
    return "" if done.returncode else f"![{image.stem}]({image.name})"


def is_good(driven):
    values = {name: getattr(driven, name) for name in EXPECTED}
    return not math.isnan(driven.way) and all(
        math.isnan(value) or abs(value - EXPECTED[name][0]) <= EXPECTED[name][1]
        for name, value in values.items()
    )


def cells(folder, path, args, image):
    shown = picture(path, args, image)
    try:
        driven = drive(path, args)
    except ruedo.RuedoError as error:
        reason = str(error).splitlines()[0].replace(f"{folder}/", "").replace("|", "/")
        return ["", "no", "does not load", "", "", "", "", "", reason]
    named = [text.replace(f"{folder}/", "") for text in check(os.environ["RUEDO"], path, args)]
    if math.isnan(driven.way):
        named = ["no plugin or controller in its files drives it", *named]
    if len(named) > MOST_NAMED:
        named = [*named[:MOST_NAMED], f"and {len(named) - MOST_NAMED} more"]
    numbers = [getattr(driven, name) for name in EXPECTED]
    return [
        shown,
        "yes" if is_good(driven) else "no",
        driven.steering,
        *(
            "" if math.isnan(value) else f"{value + 0.0:.3f}".replace("-0.000", "0.000")
            for value in numbers
        ),
        f"{driven.alive} of {driven.sensors}",
        "<br>".join(named),
    ]


def row(folder, name, repository, file, arguments="", why=""):
    args = [word for each in arguments.split() for word in ("--xacro-arg", each)]
    image = OUT / (re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") + ".jpg")
    place = f"`{file}`" + (f" `{arguments}`" if arguments else "")
    made = cells(folder, folder / repository / file, args, image)
    made[-1] = "<br>".join(filter(None, [why, made[-1]]))
    return f"| {name}<br>{place} | {' | '.join(made)} |"


def written(page):
    """The rows of a page, by robot."""
    return dict(re.findall(r"(?m)^(?=\| ([^|<]+)<br>)(.*)$", page))


def page(rows):
    """All of it, from the rows of each robot."""

    def having(words):
        return sum(f" | {words} | " in line for line in rows.values())

    stand, missing = having("stands still"), having("does not load")
    count = (
        f"{len(rows)} robots were tried. {stand} stand still, since nothing in their files drives them; "
        f"{missing} do not load from the files that were at hand. Of the "
        f"{len(rows) - stand - missing} others {having('yes')} are good.\n"
    )
    parts = [HEAD, count]
    for repository, (full, commit) in REPOSITORIES.items():
        mine = [rows[name] for name, its, *_ in ROBOTS if its == repository and name in rows]
        title = f"## [{full}](https://github.com/{full}/tree/{commit})\n\nCommit `{commit}`.\n"
        head = f"| {COLUMNS} |\n|{'---|' * (COLUMNS.count('|') + 1)}"
        parts.append(
            title + ("\n" + "\n".join([head, *mine]) + "\n" if mine else "\nOthers here need it.\n")
        )
    return "\n".join(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["clone", "drive"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--ruedo", type=Path, help="the program")
    parser.add_argument("--only", action="append", help="a robot's (drive), repository's name")
    arguments = parser.parse_args()
    folder = arguments.folder.resolve()
    if arguments.what == "clone":
        failed = clone(folder, arguments.only)
        sys.exit(f"could not get {', '.join(failed)}" if failed else 0)
    os.environ["RUEDO"] = str(arguments.ruedo.resolve())
    OUT.mkdir(exist_ok=True)
    readme = OUT / "README.md"
    rows = written(readme.read_text(encoding="utf-8")) if readme.exists() else {}
    for name, repository, file, *options in ROBOTS:
        if (arguments.only and name not in arguments.only) or not (folder / repository).exists():
            continue
        set_paths(folder, repository)
        rows[name] = row(folder, name, repository, file, *options)
        print(rows[name], file=sys.stderr, flush=True)
        readme.write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
