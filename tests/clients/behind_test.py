"""Clients that are slower than the run, and networks that lose what they send."""

import logging
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
import ruedo
from conftest import ARENA, PATIENCE, PROBES, RUEDO, probe, ruedo_run
from lockstep_test import bad_network

CATCH_UP_SECONDS = 0.25  # Pacer::kMostCatchUp


@pytest.mark.parametrize("load", [0, 4])
@pytest.mark.parametrize("rate", ["1", "max"])
def test_a_run_does_not_leave_its_launcher_behind(language, rate, load):
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(load)]
    try:
        said = probe(language, "-", "keeps_up", rate)
    finally:
        for program in busy:
            program.kill()
            program.wait()
    most = 0.0501
    if rate == "1":  # a delayed run advances faster than real time until it has caught up
        most += CATCH_UP_SECONDS
    assert max(float(age) for age in said.all("age")) < most
    count, gap, dropped = said.numbers("seen")
    assert count >= 19 and gap < 0.1051 and dropped == 0
    assert all(float(turned) < 1e-9 for turned in said.all("after"))
    # 0.17 m until the next scan and to brake, and 0.4 m for each second without a processor: beside
    # a load, at most the half second that a run at the highest rate advances.
    assert (0.42 if load else 0.55) < said.numbers("stands")[0] < 0.72


@pytest.mark.parametrize("first_call", ["latest", "sleep", "on_sample"])
def test_the_highest_rate_begins_with_the_launchers_first_call(language, first_call):
    said = probe(language, "-", "begins_late", first_call)
    sim_time, real_time = said.numbers("before")
    assert sim_time < real_time + 0.0501
    if first_call == "latest":  # the first sample comes up to 20 ms later
        sim_time, real_time = said.numbers("latest")
        assert sim_time < real_time + 0.0501 + 0.03 + 0.02
    assert said.numbers("after")[0] < 98.0 / 2  # s for 98 s of sim time


def test_no_primitive_is_lost_on_a_bad_network(language):
    with (
        ruedo_run("--rate", "20", "--disable", "p3at/camera") as server,
        bad_network(server.url, 1, 0.2) as [url],
    ):
        assert probe(language, url, "many_primitives", "p3at", "200").numbers("done") == [200]


@pytest.fixture
def unwaited():
    """The address of a server at the highest rate that this process did not launch."""
    with tempfile.TemporaryDirectory() as folder:
        url = f"unix://{folder}/bus"
        command = [RUEDO, "run", ARENA, "--lcm", url, "--rate", "max", "--disable", "p3at/camera"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as server:
            while not Path(folder, "bus").exists():
                time.sleep(0.01)
            yield url, server
            server.terminate()


def test_a_client_without_pacing_gets_the_newest_sample(unwaited, caplog):
    url, server = unwaited
    with ruedo.connect(url, timeout=PATIENCE) as sim:
        robot, seen = sim.robot("p3at"), []

        def work(pose):
            seen.append(pose.time)
            time.sleep(0.001)

        with robot.pose.on_sample(work):
            time.sleep(3.0)
            begin = time.monotonic()
            sim.pause()  # its reply does not wait for samples
            assert time.monotonic() - begin < 3.0
            stands = sim.state().time
            deadline = time.monotonic() + PATIENCE
            while seen[-1] < stands - 0.021 and time.monotonic() < deadline:
                time.sleep(0.01)
        assert seen[-1] >= stands - 0.021
        assert robot.pose.dropped > 0
    warnings = [record.message for record in caplog.records if "slower" in record.message]
    assert len(warnings) <= 1
    server.terminate()
    told = server.stderr.read().decode()
    assert told.count("reads more slowly") + len(warnings) >= 1


WARNS = Path(ARENA).read_text().replace("</static>", "</static><nonsense/>", 1)


def test_a_servers_warnings_reach_the_terminal_once(language, tmp_path):
    """In Python by logging, which prints what nobody handles."""
    world, errors = tmp_path / "world.sdf", tmp_path / "errors"
    world.write_text(WARNS)
    command = [*PROBES[language], "-", "launch", str(world), "--disable", "p3at/camera"]
    with (
        errors.open("w") as stderr,
        subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=stderr) as client,
    ):
        deadline = time.monotonic() + 60.0
        while "<nonsense>" not in errors.read_text() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(1.0)  # the server's words are read five times a second
        client.kill()
    told = [line for line in errors.read_text().splitlines() if "<nonsense>" in line]
    assert len(told) == 1 and "the server: " in told[0]


def test_a_servers_warnings_reach_the_program_once(caplog):
    with ruedo.launch(text=WARNS, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        for _ in range(3):
            sim._connection.bus.publish("p3at/velocity", b"nonsense")
            time.sleep(1.2)
        assert robot.pose.latest(PATIENCE)
    told = [record.message for record in caplog.records if record.levelno == logging.WARNING]
    ignored = [line for line in told if re.search("p3at/velocity: a message was ignored", line)]
    assert ignored and len(ignored) == len(set(ignored))
