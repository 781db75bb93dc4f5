"""The Java client's callbacks, readers, and ends (unit/Lifetimes.java); those of C++ are
unit/lifetimes_test.cpp, of Python python_test.py.
"""

import os
import subprocess

import pytest
from conftest import BUILD, HALL, PATIENCE, free_url, ruedo_run

CLASSES = os.environ.get("RUEDO_PROBE_JAVA")
COMMAND = ["java", "-cp", f"{BUILD}/java/ruedo.jar:{CLASSES}", "Lifetimes"]
pytestmark = pytest.mark.skipif(not CLASSES, reason="there is no JDK")


def test_callbacks_and_closing():
    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        done = subprocess.run(
            [*COMMAND, server.url, "all"], capture_output=True, text=True, timeout=PATIENCE
        )
    assert done.stdout.splitlines() == [
        "open true true",
        "newer true",
        "stolen false",
        "heard true true",
        "closed 16 of 16 hall",
    ], done.stderr
    assert done.stderr == (
        "ruedo: a callback on p3at/odometry failed: java.lang.AssertionError: a fault of the user's; it is called on, "
        "and this is said once\n"
    )
    assert done.returncode == 0


def test_a_server_that_was_started_anew_is_noticed():
    url = free_url()
    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url) as first:
        client = subprocess.Popen(
            [*COMMAND, url, "new_run"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert client.stdout.readline() == "ready\n"
        first.end()
    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url):
        said, errors = client.communicate(timeout=PATIENCE)
    assert said.splitlines() == ["ended ended new run", "turned true"], errors
    assert errors == f"ruedo: another run has begun at {url}: commands are not repeated into it\n"
