"""The exam of what judges: broken things that must be red, each with an innocent twin that must be
green. What is examined is the installed package, or the program that RUEDO names.

A row, in rows/FRONT.txt: NAME ~ COMMAND with {} ~ what is broken ~ its innocent twin ~ CODE TEXT
The first takes the place of {} and gives that exit code and that text; the second gives 0. In the
gate a tenth of the rows is tried, with --all a third (RUEDO_EXAM=PART/OF, chosen by the commit).
"""

import atexit
import functools
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import lcm
import pytest
from campaigns import campaign, hunt

HERE = Path(__file__).resolve().parent
SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", HERE.parents[1]))
PATIENCE = 400  # s


@functools.cache
def installed():
    """The folder of an installation."""
    folder = Path(tempfile.mkdtemp(prefix="ruedo-exam-"))
    atexit.register(shutil.rmtree, folder)
    build = os.environ["RUEDO_BINARY_DIR"]
    subprocess.run(
        ["cmake", "--install", build, "--prefix", folder], check=True, capture_output=True
    )
    return folder


if "RUEDO" not in os.environ:  # programs, too, take it from there
    os.environ["RUEDO"] = str(installed() / "bin/ruedo")
    os.environ["PYTHONPATH"] = str(installed() / "lib/ruedo/python")
RUEDO = os.environ["RUEDO"]


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
    """Of one front, where RUEDO_EXAM_FRONT names it."""
    front = os.environ.get("RUEDO_EXAM_FRONT")
    all_rows = [row for row in rows() if front in (None, row.front)]
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


def logs(line, folder):
    """In a folder with logs: a.lcm and its equal b.lcm, other.lcm of another seed, and what is cut,
    has its header alone, no message, or no byte.
    """
    for log in recorded().iterdir():
        shutil.copy(log, folder)
    return run([RUEDO, *words(line)], folder)


def cmake(line, folder):
    """The arguments of ruedo_add_regression() in a project, which is configured and tested;
    programs are in its folder.
    """
    line = re.sub(r"\b(\w+\.py)\b", r"${CMAKE_CURRENT_SOURCE_DIR}/\1", line)
    (folder / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(exam NONE)\nfind_package(ruedo REQUIRED)\n"
        "enable_testing()\nruedo_add_regression(NAME exam WORLD box.sdf DURATION 5 "
        f"OPTIONS --disable p3at/camera {line})\n"
    )
    code, said = run(["cmake", "-B", "build", f"-DCMAKE_PREFIX_PATH={installed()}"], folder)
    said = " ".join(said.split())
    if code == 0:
        code, more = run(["ctest", "--test-dir", "build", "--output-on-failure"], folder)
        said += more
    return min(code, 1), said


def pytest_(line, folder):
    """The arguments of the fixture ruedo_regression in a test, or the test, in which run() is it;
    -- its environment.
    """
    line, _, environment = line.partition(" -- ")
    test = line if "run(" in line else f"run({line})"
    (folder / "test_it.py").write_text(
        "from contextlib import suppress\nfrom functools import partial\n"
        f"from threading import Thread\n\nimport pytest\n\nPYTHON = {sys.executable!r}\n\n\n"
        "def test_it(ruedo_regression):\n"
        '    run = partial(ruedo_regression, "box.sdf", options=["--disable", "p3at/camera"])\n'
        f"    {test}\n"
    )
    return run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_it.py"],
        folder,
        **dict(one.split("=") for one in environment.split()),
    )


def labs(line, folder):
    """A student's program and a lab of clients/python/examples/labs, marked as those of a class."""
    program, lab = words(line)
    return solved(lab) if program == "solution" else marked(program, lab, folder)


@functools.cache
def solved(lab):
    """One run for all rows that have this twin."""
    with tempfile.TemporaryDirectory() as folder:
        return marked("solution", lab, Path(folder))


def marked(program, lab, folder):
    shutil.copytree(SOURCE / "clients/python/examples/labs", folder / "marked")
    marking = folder / "marked/marking"
    if program != "solution":
        (source,) = (HERE / "files/labs").glob(f"*/{program}.py")
        shutil.copy(source, marking / "students")
    file = (marking / "labs.yaml").read_text()
    for before, after in (
        ("students/*.py", f"students/{program}.py"),
        ("lab: [square,", f"lab: [{lab}] #"),
    ):
        assert before in file
        file = file.replace(before, after)
    (marking / "labs.yaml").write_text(file)
    python = Path(sys.executable)
    return run(
        [RUEDO, "campaign", "run", "labs.yaml", "--quiet", "--workers", "1"],
        marking,
        RUEDO_PYTHON=str(python),
        PATH=f"{python.parent}{os.pathsep}{os.environ['PATH']}",
    )


FRONTS = {
    "regress": regress,
    "logs": logs,
    "cmake": cmake,
    "pytest": pytest_,
    "campaign": campaign,
    "hunt": hunt,
    "labs": labs,
}


def words(line):
    return shlex.split(line)


@functools.cache
def recorded():
    """A folder of logs."""
    folder = Path(tempfile.mkdtemp(prefix="ruedo-exam-"))
    atexit.register(shutil.rmtree, folder)
    for name, seed in (("a", 1), ("other", 2)):
        command = [
            RUEDO,
            "run",
            HERE / "files/box.sdf",
            "--rate",
            "max",
            "--duration",
            "1",
            "--quiet",
        ]
        command += ["--disable", "p3at/camera", "--seed", str(seed), "--record", f"{name}.lcm"]
        subprocess.run(command, check=True, cwd=folder, capture_output=True)
    whole = (folder / "a.lcm").read_bytes()
    (folder / "b.lcm").write_bytes(whole)
    (folder / "cut.lcm").write_bytes(whole[: len(whole) // 2])
    (folder / "no_byte.lcm").write_bytes(b"")
    write(folder / "header.lcm", lambda event: event.channel == "ruedo/header", folder / "a.lcm")
    write(folder / "no_message.lcm", lambda event: False, folder / "a.lcm")
    write(folder / "poses.lcm", lambda event: event.channel == "p3at/pose", folder / "a.lcm")
    return folder


def write(path, keeps, log):
    """The events of a log that are kept."""
    new = lcm.EventLog(str(path), "w", overwrite=True)
    for event in lcm.EventLog(str(log), "r"):
        if keeps(event):
            new.write_event(event.timestamp, event.channel, event.data)
    new.close()


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
