"""The Java client's callbacks, readers, and ends (unit/Lifetimes.java); those of C++ are
unit/lifetimes_test.cpp, of Python python_test.py.
"""

import os
import subprocess

import pytest
from conftest import BUILD, HALL, PATIENCE, free_url, ruedo_run

CLASSES = os.environ.get("RUEDO_PROBE_JAVA")
COMMAND = ["java", "-cp", f"{BUILD}/java/ruedo.jar:{CLASSES}", "Lifetimes"]
CLOSED = "this simulation was closed"
ANOTHER_RUN = "ruedo: another run has begun at URL: commands are not repeated into it\n"
pytestmark = pytest.mark.skipif(not CLASSES, reason="there is no JDK")


def lifetimes(what):
    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        return subprocess.run(
            [*COMMAND, server.url, what], capture_output=True, text=True, timeout=PATIENCE
        )


def test_callbacks_and_closing():
    done = lifetimes("all")
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


def test_misuse_is_told_at_once():
    done = lifetimes("misused")
    assert done.stdout.splitlines() == [
        "waits 7 of 7",
        "a message of 5243017 bytes on ruedo/request: a server takes 4194304 bytes at most",
        "SET_POSE: an argument is null, or an array has too few numbers",
        "REMOVE: an argument is null, or an array has too few numbers",
        "p3at/odometry: the callback is null",
        "a new run: the callback is null",
        "a\0b: no such file",
    ], done.stderr
    assert (done.returncode, done.stderr) == (0, "")


def test_two_simulations_in_a_process_end_in_either_order():
    with (
        ruedo_run("--disable", "p3at/camera", world=HALL) as first,
        ruedo_run("--disable", "p3at/camera", world=HALL) as second,
    ):
        done = subprocess.run(
            [*COMMAND, first.url, "two", second.url],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
    assert done.stdout.splitlines() == 2 * [
        f"other {CLOSED}, true",
        "goes on true",
        f"ended {CLOSED}, {CLOSED}",
    ], done.stderr
    assert (done.returncode, done.stderr) == (0, "")


def with_a_restarted_server(mode: str) -> tuple[str, str]:
    """What the client in that mode prints, and its errors."""
    url = free_url()
    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url) as first:
        client = subprocess.Popen(
            [*COMMAND, url, mode], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert client.stdout.readline() == "ready\n"
        first.end()
    with ruedo_run("--disable", "p3at/camera", world=HALL, url=url):
        said, errors = client.communicate(timeout=PATIENCE)
    assert client.returncode == 0, errors
    return said, errors.replace(url, "URL")


def test_a_restarted_server_is_noticed():
    said, errors = with_a_restarted_server("new_run")
    assert said.splitlines() == ["ended ended new run", "turned true"], errors
    assert errors == ANOTHER_RUN


def test_a_callback_of_a_new_run_may_close_the_simulation():
    said, errors = with_a_restarted_server("closed_by_new_run")
    assert said == f"{CLOSED}, {CLOSED}\n", errors
    assert errors == ANOTHER_RUN
