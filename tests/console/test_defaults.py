"""A run and the programs that go with it, as users start them: without --lcm and without
LCM_DEFAULT_URL (in isolated.py's network).
"""

import os
import pty
import re
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
RUEDO = BUILD / "bin" / "ruedo"
ARENA = SOURCE / "worlds" / "arena.sdf"
PATIENCE = 400  # s, for what comes sooner or later, on a machine that does much else too
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "LCM_DEFAULT_URL"} | {
    "PYTHONPATH": str(BUILD / "python")
}
EXAMPLES = {
    "python": [sys.executable, SOURCE / "clients/python/examples/wander.py"],
    "cpp": [BUILD / "bin/ruedo-wander-cpp"],
    "java": ["java", "-cp", f"{BUILD}/java/ruedo.jar:{BUILD}/java/ruedo-examples.jar", "Wander"],
}


@contextmanager
def arena(*arguments):
    """`ruedo run worlds/arena.sdf`, from when it says what runs."""
    process = subprocess.Popen(
        [RUEDO, "run", ARENA, *arguments], env=ENVIRONMENT, stdout=subprocess.PIPE, text=True
    )
    try:
        assert any("ruedo/request" in line for line in process.stdout)  # the last that it lists
        yield process
    finally:
        process.terminate()
        process.wait(60)


def said(*command, **more):
    done = subprocess.run(
        command, env=ENVIRONMENT, capture_output=True, text=True, timeout=PATIENCE, **more
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def rate_of(channel):
    """What hz says of the first second in which there was something: a busy machine skips some."""
    while True:
        hz = subprocess.run(
            [RUEDO, "hz", channel, "-n", "1"], env=ENVIRONMENT, capture_output=True, text=True
        )
        if hz.returncode != 1:
            assert hz.returncode == 0, hz.stderr
            return hz.stdout


def test_hz_and_echo_hear_the_run_and_teleop_drives_it(tmp_path):
    log = tmp_path / "run.lcm"
    with arena("--record", log):
        assert re.search(r"^p3at/pose: +\d", rate_of("p3at/pose"))
        parent, child = pty.openpty()
        teleop = subprocess.Popen(
            [RUEDO, "teleop", "p3at"], env=ENVIRONMENT, stdin=child, stdout=subprocess.DEVNULL
        )
        os.close(child)
        while not re.search(
            r"vel\[0\] = 0\.[1-6]", said(RUEDO, "echo", "p3at/pose", "-n", "1")
        ):  # m/s
            os.write(parent, b"w")  # lost before it has the terminal
        os.write(parent, b"q")
        assert teleop.wait(PATIENCE) == 0
        os.close(parent)
    listener = subprocess.Popen(
        [RUEDO, "echo", "p3at/odometry", "-n", "1"],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        text=True,
    )
    while listener.poll() is None:  # it may begin to listen late
        said(RUEDO, "play", log, "--speed", "max")
    assert listener.stdout.read().startswith("p3at/odometry (odometry_t, ")


@pytest.mark.parametrize("language", EXAMPLES)
def test_the_examples_find_the_run(tmp_path, language):
    with arena():
        heard = said(*EXAMPLES[language], "--duration", "1", cwd=tmp_path)
    assert "true pose" in heard and (tmp_path / "wander.jpg").read_bytes()[:2] == b"\xff\xd8"
