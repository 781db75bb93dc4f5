"""What callbacks throw, runs that end, and sim time that stands still: none of it goes unseen."""

import os
import re
import signal
import subprocess

import pytest
import ruedo
from conftest import HALL, PATIENCE, PROBES, Said, ruedo_run, tcp_server

FAULT = {
    "python": "ValueError: a fault of the user's",
    "cpp": "a fault of the user's",
    "java": "CallbackException: a callback on p3at/odometry failed: java.lang.AssertionError: "
    "a fault of the user's",
}
QUIET = ("--no-noise", "--disable", "p3at/camera")


def ended(language, url, *command, regress=False):
    """The probe's exit code, what it said, and its errors."""
    environment = dict(os.environ, RUEDO_REGRESS="1") if regress else None
    done = subprocess.run(
        [*PROBES[language], url, *command],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        env=environment,
    )
    return done.returncode, Said(done.stdout, done.stderr), done.stderr


@pytest.fixture(scope="module")
def server():
    with ruedo_run(*QUIET, world=HALL) as server:
        yield server


@pytest.mark.parametrize("call", ["latest", "sleep", "command", "request"])
def test_the_next_call_throws_what_a_callback_threw(language, server, call):
    code, said, errors = ended(language, server.url, "fails", call)
    assert said.one("raised").endswith(FAULT[language]), errors
    assert said.one("once") == "none" and said.one("others") == "True"
    assert code == 0, errors


def test_close_throws_what_a_callback_threw(language, server):
    code, said, errors = ended(language, server.url, "fails", "close")
    assert said.one("raised").endswith(FAULT[language]), errors
    assert said.one("once") == "none"
    assert code == 0, errors


@pytest.mark.parametrize("how", ["leave", "forget"])
def test_a_program_that_does_not_see_a_callbacks_fault_fails(language, server, how):
    code, _, errors = ended(language, server.url, "fails", how)
    assert code == 1 and "a fault of the user's" in errors
    if language == "python":
        assert 'raise ValueError("a fault of the user\'s")' in errors


def test_another_fault_on_its_way_wins(language, server):
    code, said, errors = ended(language, server.url, "fails", "other")
    assert said.one("won").startswith("another fault")
    if language == "java":  # it is among the other's suppressed ones
        assert said.one("suppressed") == FAULT["java"]
    else:
        assert "a fault of the user's" in errors and code == 1


def over_unix(folder, *options):
    return ruedo_run(*QUIET, *options, world=HALL, url=f"unix://{folder}/bus")


@pytest.mark.parametrize("transport", ["unix", "tcpq", "udpm"])
@pytest.mark.parametrize("call", ["next", "sleep", "wait"])
def test_a_call_that_waits_says_that_the_run_has_ended(language, tmp_path, transport, call):
    options = ("--paused", "--duration", "4")  # the probe resumes it
    start = {
        "unix": lambda: over_unix(tmp_path, *options),
        "tcpq": lambda: tcp_server(*QUIET, *options),
        "udpm": lambda: ruedo_run(*QUIET, *options, world=HALL),
    }
    with start[transport]() as server:
        _, said, errors = ended(language, server.url, "ends", call)
    assert said.one("ended") == f"RunEnded: the run has ended at step 800, at {server.url}", errors
    assert said.one("request").startswith("RunEnded: ")


def test_step_says_that_the_run_has_ended(language, tmp_path):
    with over_unix(tmp_path, "--lockstep", "1", "--duration", "1") as server:
        _, said, errors = ended(language, server.url, "ends", "step")
    assert said.one("ended").startswith("RunEnded: "), errors
    assert "the run has ended at step 200" in said.one("ended")


def while_it_sleeps(language, server, end):
    """What the probe says that waits for a server which end() ends."""
    command = [*PROBES[language], server.url, "ends", "sleep"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout.readline() == "joined\n"
        end()
        return Said(program.communicate(timeout=PATIENCE)[0]).one("ended")


def quit_run(url):
    with ruedo.connect(url, timeout=PATIENCE) as sim:
        sim.quit()


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT, "quit"])
def test_a_run_that_is_stopped_has_ended(language, tmp_path, how):
    with over_unix(tmp_path) as server:
        said = while_it_sleeps(
            language,
            server,
            lambda: quit_run(server.url) if how == "quit" else server.process.send_signal(how),
        )
    assert said.startswith("RunEnded: the run has ended at step "), said


def test_a_killed_server_is_reported_as_silent(language, tmp_path):
    with over_unix(tmp_path) as server:
        said = while_it_sleeps(language, server, server.process.kill)
    assert said.startswith("NoServer: nothing was heard"), said


@pytest.mark.parametrize("regress", [True, False])
def test_a_regression_run_that_ends_ends_its_program_well(language, tmp_path, regress):
    with over_unix(tmp_path, "--paused", "--duration", "2") as server:
        code, _, errors = ended(language, server.url, "ends", "uncaught", regress=regress)
    assert (code == 0) == regress, errors
    assert ("RunEnded" in errors or "has ended at step" in errors) != regress, errors


def test_a_callbacks_fault_counts_in_a_regression_run_that_ends(language, tmp_path):
    with over_unix(tmp_path, "--paused", "--duration", "2") as server:
        code, _, errors = ended(language, server.url, "ends", "uncaught_failed", regress=True)
    assert code == 1 and "a fault of the user's" in errors


@pytest.mark.parametrize("call", ["wait", "sleep"])
def test_a_call_reports_why_sim_time_stands_still(language, tmp_path, call):
    with over_unix(tmp_path, "--paused") as server:
        _, said, errors = ended(language, server.url, "stands", call)
    why = "the simulation is paused"
    assert said.one("timeout").startswith("Timeout: p3at: advance was not done within 1.2 s ("), (
        errors
    )
    assert said.one("timeout").endswith(f" remain; {why})"), errors
    assert said.one("ended") == "NoServer: this simulation was closed"
    told = re.findall("(.*) waits, and sim time has stood still for 5 s at 0.00 s: (.*)", errors)
    assert len(told) == 1 and told[0][1] == why, errors
    assert ("advance" in told[0][0]) == (call == "wait") and ("sleep()" in told[0][0]) != (
        call == "wait"
    )


@pytest.mark.parametrize(
    ("call", "time", "why"),
    [
        (
            "idle",
            "0.00",
            "in lockstep the clients that take part grant each step, and this one, 'waits', does "
            "not: step() takes part",
        ),
        ("stepped", "0.01", "in lockstep it waits for the next step() of this client, 'waits'"),
    ],
)
def test_a_call_names_the_client_whose_step_is_waited_for(language, tmp_path, call, time, why):
    with over_unix(tmp_path, "--lockstep", "1") as server:
        _, said, errors = ended(language, server.url, "stands", call)
    assert said.one("ended") == "NoServer: this simulation was closed"
    assert errors.count(f"sim time has stood still for 5 s at {time} s: {why}") == 1, errors
