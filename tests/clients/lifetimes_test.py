"""The Java client's callbacks, readers, and ends (unit/Lifetimes.java), and what no real server
shows (unit/Internals.java); those of C++ are unit/lifetimes_test.cpp, of Python python_test.py.
"""

import contextlib
import os
import re
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path

import pytest
from conftest import BUILD, CLIENT, HALL, PATIENCE, free_url, ruedo_run, tcp_server

CLASSES = os.environ.get("RUEDO_PROBE_JAVA")
JAVA = ["java", "-cp", f"{BUILD}/java/ruedo.jar:{CLASSES}"]
COMMAND = [*JAVA, "Lifetimes"]
CLOSED = "this simulation was closed"
ANOTHER_RUN = "ruedo: another run has begun at URL: commands are not repeated into it\n"
pytestmark = pytest.mark.skipif(
    not CLASSES or CLIENT not in ("", "java"), reason="the Java client is not there, or not chosen"
)


def run(command, **options):
    return subprocess.run(
        command, capture_output=True, text=True, timeout=PATIENCE, check=False, **options
    )


def lifetimes(what):
    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        return run([*COMMAND, server.url, what])


def internals(*words):
    done = run([*JAVA, "ruedo.Internals", *words])
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_callbacks_and_closing():
    done = lifetimes("all")
    assert done.stdout.splitlines() == [
        "thrown a callback on p3at/odometry failed: java.lang.AssertionError: a fault of the user's",
        "open true true",
        "newer true",
        "stolen false",
        "heard true true",
        "closed 16 of 16 hall",
    ], done.stderr
    assert (done.returncode, done.stderr) == (0, "")


def test_misuse_is_reported_at_once():
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


@pytest.mark.parametrize("server", [ruedo_run, tcp_server])
def test_an_exception_without_a_text_ends_nothing(server):
    """The thread that receives lives, over each of LCM's networks."""
    with server("--disable", "p3at/camera", world=HALL) as running:
        done = run([*COMMAND, running.url, "unspeakable"])
    assert done.stdout.splitlines() == [
        "thrown a callback on p3at/odometry failed: Lifetimes$Unspeakable",
        "goes on",
    ], done.stderr
    assert done.stderr == ""


LONG = r"ruedo: a callback has not returned for 5 s, at Lifetimes\.java:\d+: "


def test_close_waits_for_a_callback():
    done = lifetimes("closed_beside_a_callback")
    assert done.stdout == "returned true\n", done.stderr
    assert re.fullmatch(LONG + r"close\(\) waits for it\n", done.stderr)


def test_a_callback_may_end_the_program():
    """Which waits for close(), which waits for the callback."""
    done = lifetimes("ended_in_a_callback")
    assert done.returncode == 5
    assert re.fullmatch(LONG + "the program ends without it\n", done.stderr)


def test_a_program_ends_beside_a_callback_that_closes_and_stays():
    done = lifetimes("stays")
    assert (done.returncode, done.stdout, done.stderr) == (0, "ends\n", "")


@pytest.fixture
def runtime():
    """A folder for a server's socket, whose path is short, and for temporary files; and the
    environment that says so.
    """
    folder = tempfile.mkdtemp(prefix="java-")
    options = f"-Djava.io.tmpdir={folder}"
    yield Path(folder), {**os.environ, "XDG_RUNTIME_DIR": folder, "JAVA_TOOL_OPTIONS": options}
    deadline = time.monotonic() + PATIENCE
    while os.path.exists(folder):  # a server may still be removing what is its own
        shutil.rmtree(folder, ignore_errors=True)
        assert time.monotonic() < deadline


def test_an_interrupted_launch_reports_it_and_leaves_nothing(runtime):
    folder, environment = runtime
    text = Path(HALL).read_text()
    done = run([*COMMAND, HALL, "interrupted_launch", text], env=environment)
    assert done.stdout.splitlines() == 2 * ["Interrupted true"], done.stderr
    assert list(folder.iterdir()) == []


def test_an_interrupted_thread_closes_as_any_other(runtime):
    folder, environment = runtime
    done = run([*COMMAND, HALL, "interrupted_close"], env=environment)
    assert done.stdout == "closed true\n", done.stderr
    assert list(folder.iterdir()) == []


def test_a_client_that_is_killed_leaves_no_output_of_its_server(runtime):
    folder, environment = runtime
    client = subprocess.Popen(
        [*COMMAND, HALL, "killed"], env=environment, stdout=subprocess.PIPE, text=True
    )
    assert client.stdout.readline() == "ready\n"
    client.kill()
    client.wait()
    assert list(folder.glob("*.log")) == []


def test_interrupts_leave_the_socket_open():
    """Those of threads that send, over multicast, and one that a callback leaves behind."""
    assert internals("interrupts", free_url()) == 3 * ["heard true"]


def test_a_program_that_ends_right_after_close_in_a_callback_leaves():
    done = run([*JAVA, "ruedo.Internals", "exits"])
    assert (done.returncode, done.stdout, done.stderr) == (5, "left\n", "")


def test_a_thread_outlives_a_time_without_memory():
    lines = run([*JAVA, "-Xmx24m", "ruedo.Internals", "memory"]).stdout.splitlines()
    assert lines[-1] == "lives true"


def test_the_newest_info_holds():
    """Of a device's numbers, of the devices that there are, and of a channel's type."""
    assert internals("infos") == [
        "lrf 10.0 20.0 3.0",
        "device true",
        "other TypeMismatch",
        "none yet Timeout",
        "pose 4.0",
        "once Timeout",
    ]


def test_monitors_held_by_a_user_block_nothing():
    assert internals("monitors") == ["received true true true"]


def test_an_info_has_no_more_parts_than_memory():
    assert internals("parts") == [
        "null",
        "TypeMismatch",
        "64: ruedo/info has 1024 parts of 68157440 bytes so far: a client takes 1024 parts of "
        "67108864 bytes together at most",
        "null",
    ]


def test_a_silent_server_is_looked_for_seldom(tmp_path):
    """Each time takes a place in the queue of connections of one that is stopped."""
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(f"{tmp_path}/bus")
        listening.listen(1000)
        listening.setblocking(False)
        [seconds] = internals("silence", f"unix://{tmp_path}/bus")
        came = 0
        with contextlib.suppress(BlockingIOError):
            while True:
                listening.accept()[0].close()
                came += 1
    assert 1 <= came <= 2 + int(seconds)


def test_a_server_whose_queue_is_full_is_there(tmp_path):
    """One that is stopped accepts no connection, not even those that look for it."""
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(f"{tmp_path}/bus")
        listening.listen(0)
        waiting = []
        while True:
            client = socket.socket(socket.AF_UNIX)
            client.setblocking(False)
            waiting.append(client)
            try:
                client.connect(f"{tmp_path}/bus")
            except BlockingIOError:
                break
        assert internals("served", f"unix://{tmp_path}/bus") == ["served true"]
        for client in waiting:
            client.close()
    assert internals("served", f"unix://{tmp_path}/bus") == ["served false"]
    assert internals("served", f"unix://{tmp_path}/nobody") == ["served false"]


NEVER = 2**63 - 1


def test_callbacks_without_pacing_get_the_newest():
    done = run([*JAVA, "ruedo.Internals", "callbacks"])
    assert done.stdout.splitlines() == [
        "newest 100000",
        "newest 400000, skipped 2",
        "newest 800000, lost 5",
        "heard [1, 2, 3, 4, 8]",
        "all true",
    ]
    assert done.returncode == 0 and done.stderr.count("\n") == 1


def test_latest_is_never_older_than_what_waits():
    assert internals("latest") == [
        "newest 100000",
        "newest 300000",
        "next 500000",
        "at 600000",
        "newest 600000",
    ]


def test_a_primitive_is_sent_until_a_status_shows_it():
    assert internals("resends") == ["again true"] * 4 + ["shown true"]


def test_a_client_reports_its_progress_to_its_server():
    assert internals("progress") == [
        "began true",
        "waited for true true",
        f"listens 0 0 {NEVER}",
        f"first 0 0 {NEVER}",
        f"received 0 25000 {NEVER}",
        "used true",
        "goes on true true",
        f"waits 0 25000 {NEVER}",
        "said again false",
        f"forgotten 0 25000 {NEVER}",
        f"reset 1 0 {NEVER}",
        "stopped true",
        f"heard 1 999 {NEVER}",
    ]
