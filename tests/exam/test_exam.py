"""The exam of what judges: broken things that must be red, each with an innocent twin that must be
green.

A row, in rows/FRONT.txt: NAME ~ COMMAND with {} ~ what is broken ~ its innocent twin ~ CODE TEXT
The first takes the place of {} and gives that exit code and that text; the second gives 0. In the
gate a tenth of the rows is tried (RUEDO_EXAM=PART/OF, chosen by the commit).
"""

import os
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

RUEDO = os.environ["RUEDO"]
HERE = Path(__file__).parent
PATIENCE = 400  # s


@dataclass
class Row:
    front: str
    name: str
    command: str
    broken: str
    innocent: str
    code: int
    text: str


def rows():
    for file in sorted(HERE.glob("rows/*.txt")):
        for line in file.read_text(encoding="utf-8").splitlines():
            if line.strip() and not line.startswith("#"):
                name, command, broken, innocent, verdict = (
                    one.strip() for one in line.split(" ~ ")
                )
                code, _, text = verdict.partition(" ")
                yield Row(file.stem, name, command, broken, innocent, int(code), text)


def chosen():
    all_rows = list(rows())
    part, _, of = os.environ.get("RUEDO_EXAM", "0/1").partition("/")
    return [row for i, row in enumerate(all_rows) if i % int(of) == int(part)]


def run(command, folder, **variables):
    done = subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        errors="replace",
        timeout=PATIENCE,
        env={**os.environ, **variables},
    )
    return done.returncode, done.stdout + done.stderr


# ---- The fronts: each makes a command of a line, and returns its exit code and what it said.


def regress(line, folder):
    return run(
        [
            RUEDO,
            "regress",
            "--disable",
            "p3at/camera",
            "--no-page",
            "--record",
            "run.lcm",
            *words(line),
        ],
        folder,
    )


def ruedo(line, folder):
    return run([RUEDO, *words(line)], folder)


def shell(line, folder):
    """As it is; $RUEDO is the program."""
    return run(["bash", "-c", line], folder)


FRONTS = {"regress": regress, "ruedo": ruedo, "shell": shell}


def words(line):
    return shlex.split(line)


@pytest.mark.parametrize("row", chosen(), ids=lambda row: f"{row.front}-{row.name}")
def test_row(row, tmp_path):
    for what in ("innocent", "broken"):
        folder = tmp_path / what
        shutil.copytree(HERE / "files", folder)
        line = row.command.replace("{}", getattr(row, what)).replace(
            "python ", f"{sys.executable} "
        )
        code, said = FRONTS[row.front](line, folder)
        if what == "innocent":
            assert code == 0, f"{line}\n{said}"
        else:
            assert code == row.code and row.text in said, f"{line}\nexit code {code}\n{said}"
