"""ruedo course: copies the course's notebooks, the labs and the examples to a folder. Exit codes:
0 good, 1 the folder is there, 2 wrong usage, 4 environment.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from .launching import find_ruedo
from .terminal import tell

GOOD, THERE, ENVIRONMENT = 0, 1, 4


def examples() -> Path | None:
    """Their folder, of an installation or a build; None where it has none."""
    prefix = Path(find_ruedo()).resolve().parents[1]
    for folder in (prefix / "share/doc/ruedo/examples", prefix / "examples"):
        if (folder / "course").is_dir():
            return folder
    return None


def main(words: list[str]) -> int:
    text = "copy the course of eight evenings: notebooks, labs and their marking"
    parser = argparse.ArgumentParser(prog="ruedo course", description=text)
    parser.add_argument(
        "folder", nargs="?", type=Path, default=Path("ruedo-course"), help="a new one"
    )
    folder = parser.parse_args(words[1:]).folder
    source = examples()
    if source is None:
        tell("ruedo: this installation has no course")
        return ENVIRONMENT
    try:
        shutil.copytree(source, folder, ignore=shutil.ignore_patterns("__pycache__", ".*"))
    except FileExistsError:
        tell(f"ruedo: {folder} is there already: give the name of a new folder")
        return THERE
    except OSError as error:
        tell(f"ruedo: {folder}: {error.strerror or error}")
        return ENVIRONMENT
    print(f"{folder / 'course'}: begin there with README.md, or with jupyter lab")
    return GOOD
