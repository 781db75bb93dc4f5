"""Faults of machines and networks: lost, duplicated and late datagrams, a stopped process, clocks
that jump, an interface that goes down.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path

import lcm
import pytest
import ruedo
from conftest import HALL, PATIENCE, ruedo_run
from lockstep_test import bad_network
from ruedo.lcmtypes import applied_t, request_t

BOX = (
    "<sdf version='1.9'><model name='box'><static>true</static><link name='l'><collision name='c'>"
    "<geometry><box><size>0.1 0.1 0.1</size></box></geometry></collision></link></model></sdf>"
)
STOP = float(os.environ.get("RUEDO_STOP_SECONDS", "4"))  # s; a minute in the nightly run
NO_CAMERA = ("--disable", "p3at/camera")


def wait_until(condition, what: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.02)


@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_each_request_acts_exactly_once(loss: float, tmp_path: Path) -> None:
    """A live run behind a network that loses, doubles and delays: each request acts once, in the
    order of the calls.
    """
    log = str(tmp_path / "run.lcm")
    with ruedo_run("--record", log, *NO_CAMERA, world=HALL) as server:
        with bad_network(server.url, 1, loss) as [url]:
            with ruedo.connect(url, timeout=PATIENCE) as sim:
                for i in range(12):
                    name = sim.spawn(text=BOX, name=f"box_{i}", x=2 + 0.2 * i, y=2)
                    assert name == f"box_{i}"
                for i in range(0, 12, 2):
                    sim.remove(f"box_{i}")
        server.end()
    requests = [
        applied_t.decode(event.data)
        for event in lcm.EventLog(log)
        if event.channel == "ruedo/applied"
    ]
    kinds = [one.kind for one in requests if one.kind in (request_t.SPAWN, request_t.REMOVE)]
    assert kinds == [request_t.SPAWN] * 12 + [request_t.REMOVE] * 6


def test_a_stopped_server_continues_from_its_state() -> None:
    """It does not race to catch up, says what happened, and blames no client: the lease is shorter
    than the stop.
    """
    with ruedo_run(*NO_CAMERA, world=HALL) as server:
        with ruedo.connect(server.url, timeout=PATIENCE) as sim:
            sim.sleep(0.2)
            server.process.send_signal(signal.SIGSTOP)
            time.sleep(STOP)  # the fault itself
            before, continued_at = sim.time, time.monotonic()  # what was on its way has come
            server.process.send_signal(signal.SIGCONT)
            wait_until(lambda: sim.time > before + 0.6, "the run went on")
            gained = sim.time - before
            running = time.monotonic() - continued_at
            assert (
                gained <= running + 0.5
            )  # a quarter of a second is caught up, and what was on its way
        said = server.end()
    assert "this process did not run for" in said


def test_a_stopped_server_ends_no_lease() -> None:
    """Where the client is held up for as long, it rightly does: then with a longer one."""
    for stop in (STOP, 4 * STOP):
        code = code_of_stopped(stop, lease=0.9 * stop)
        if code == 0:
            break
    assert code == 0


def code_of_stopped(stop: float, lease: float) -> int:
    """A run's exit code that a lost lease makes 1."""
    policy = ("--lease", str(lease), "--lease-policy", "fail")
    with ruedo_run("--lockstep", "1", *policy, *NO_CAMERA, world=HALL) as server:
        try:
            with ruedo.connect(server.url, timeout=PATIENCE) as sim:
                sim.step(10)
                for _ in range(3):
                    server.process.send_signal(signal.SIGSTOP)
                    time.sleep(stop)  # the fault itself
                    server.process.send_signal(signal.SIGCONT)
                    sim.step(10)
        except (ruedo.LeaseLost, ruedo.NoServer):
            server.end()
            if server.process.returncode == 0:
                raise
        server.end()
    return server.process.returncode


LAST_US = 200 * 5000  # sim time of the steps below


def jumping_clock(tmp_path: Path, offset: str) -> dict[str, str]:
    found = subprocess.run(
        ["find", "/usr/lib", "-name", "libfaketimeMT.so.1"], capture_output=True, text=True
    ).stdout.split()
    assert found, "scripts/test installs the package libfaketime"
    (tmp_path / "clock").write_text(offset)
    return {
        "LD_PRELOAD": found[0],
        "FAKETIME_TIMESTAMP_FILE": str(tmp_path / "clock"),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",  # no setting of a clock moves that one
    }


def test_a_clock_that_jumps_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The time of day goes ahead by a year and back by two, while the run is paced and while it is
    in lockstep.
    """
    for name, value in jumping_clock(tmp_path, "+0").items():
        monkeypatch.setenv(name, value)
    logs = []
    for offsets in ([], ["+365d", "-730d", "+0"]):
        (tmp_path / "clock").write_text("+0")
        logs.append(tmp_path / f"{len(offsets)}.lcm")
        with ruedo_run(
            "--lockstep", "1", "--record", str(logs[-1]), *NO_CAMERA, world=HALL
        ) as server:
            with ruedo.connect(server.url, timeout=PATIENCE) as sim:
                sim.step(50)
                for offset in offsets or ["+0"] * 3:
                    (tmp_path / "clock").write_text(offset)
                    sim.step(50)
            server.end()
        assert server.process.returncode == 0
    # Without the last step: whether the client's LEAVE or the signal comes first is open.
    quiet, jumped = (
        [(e.channel, e.timestamp, e.data) for e in lcm.EventLog(str(log)) if e.timestamp < LAST_US]
        for log in logs
    )
    assert quiet == jumped and quiet[-1][1] > 0.9 * LAST_US
    (tmp_path / "clock").write_text("+0")
    with ruedo_run(*NO_CAMERA, world=HALL) as server:
        with ruedo.connect(server.url, timeout=PATIENCE) as sim:
            for offset in ("+365d", "-730d"):
                (tmp_path / "clock").write_text(offset)
                begin, before = time.monotonic(), sim.state().time
                sim.sleep(0.5)
                assert sim.state().time - before <= time.monotonic() - begin + 0.5


def test_an_interface_that_goes_down_and_comes_back(tmp_path: Path) -> None:
    """The run goes on meanwhile, and its clients hear it again."""

    def ip(*words: str) -> None:
        subprocess.run(["ip", *words], check=True)

    log = str(tmp_path / "run.lcm")
    with ruedo_run("--record", log, *NO_CAMERA, world=HALL) as server:
        with ruedo.connect(server.url, timeout=PATIENCE) as sim:
            sim.sleep(0.2)
            ip("link", "set", "lo", "down")
            try:
                before = sim.time
                time.sleep(1)  # the fault itself
            finally:
                ip("link", "set", "lo", "up")
                ip("route", "replace", "224.0.0.0/4", "dev", "lo")
            wait_until(lambda: sim.time > before + 1, "the client hears the run again")
            assert sim.spawn(text=BOX, name="after", x=2, y=2) == "after"
        server.end()
    assert server.process.returncode == 0
    steps = [e.timestamp for e in lcm.EventLog(log) if e.channel == "p3at/odometry"]
    assert steps == list(range(0, len(steps) * 20_000, 20_000))  # none is missing
