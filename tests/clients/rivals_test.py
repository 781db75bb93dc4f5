"""Two servers on one bus, and a stranger that says what a server would: no client takes the one for
the other, waits without end, or is of no use afterwards.

Of one machine the second server is refused (networks_test.py): here a relay carries each one's
messages to the other's port, as a network does between two machines.
"""

from __future__ import annotations

import contextlib
import os
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from typing import IO
from urllib.parse import urlsplit

import pytest
import ruedo
from conftest import HALL, HERE, PATIENCE, PROBES, Server, probe, ruedo_run
from lying_datagrams import Datagrams
from ruedo import lcmtypes

QUICK = ("--disable", "p3at/camera")
BESIDE = "another server is at "
BEGUN = "another run has begun"


class OneBus:
    """What one of them hears and says, the other one does, too; again and again."""

    def __init__(self, first: Server, second: Server):
        self._ports = [str(urlsplit(one.url).port) for one in (first, second)]

    def __enter__(self) -> None:
        self._relay = subprocess.Popen(
            [sys.executable, str(HERE / "peers/lossy_relay.py"), *self._ports, "0", "0", "0", "1"],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._relay.stdout.readline() == "ready\n"

    def __exit__(self, *_: object) -> None:
        self._relay.kill()
        self._relay.wait()


def started(
    language: str, url: str, *command: str, errors: int | IO[str] = subprocess.PIPE
) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*PROBES[language], url, *command], stdout=subprocess.PIPE, stderr=errors, text=True
    )


def ended(client: subprocess.Popen[str]) -> tuple[list[str], str]:
    said, errors = client.communicate(timeout=PATIENCE)
    assert client.returncode == 0, said + errors
    return said.splitlines(), errors


def primitives_of(language: str, url: str, beside: OneBus | None = None) -> tuple[list[str], str]:
    """beside: what begins once the client has found its run."""
    client = started(language, url, "primitives", "p3at")
    said = client.stdout.readline()
    with beside or contextlib.nullcontext():
        rest, errors = client.communicate(timeout=PATIENCE)
    said += rest
    assert "failed " not in said, said + errors
    return said.splitlines(), errors


def test_each_answers_its_own_clients_alone(language):
    """The other one's "this is another run" is not an answer."""
    with (
        ruedo_run(*QUICK, world=HALL) as first,
        ruedo_run(*QUICK, world=HALL) as second,
        OneBus(first, second),
    ):
        said = probe(language, first.url, "control", "p3at")
        output = first.end()
    assert said.words("paused")[1:] == said.words("paused")[:1] and said.one("step") == "7"
    assert said.one("unknown").startswith("RequestError: ") and "nobody" in said.one("unknown")
    assert "another server is on this channel" in output


def test_motions_continue_beside_another_server(language):
    """Before, each of its signs was the beginning of a new run, which ended them."""
    with (
        ruedo_run(*QUICK, world=HALL) as first,
        # Its robot says nothing, as long as no client takes it for its own and lets it go on.
        ruedo_run("--paused", *QUICK, world=HALL) as second,
    ):
        said, errors = primitives_of(language, first.url, OneBus(first, second))
    for what in ("advance", "rotate", "turn_to", "arc"):
        [line] = [line.split() for line in said if line.split()[0] == what]
        assert line[1:5] == ["False", "True", "done", "-"], said
    assert errors.count(BESIDE) == 1 and BEGUN not in errors


def test_motions_end_beside_a_status_of_a_false_time(language):
    """Before, the true ones were from then on those of the past."""
    false = lcmtypes.motion_status_t()
    false.utime, false.id, false.state = 1 << 60, 1 << 62, false.STATE_REFUSED
    with (
        ruedo_run(*QUICK, world=HALL) as server,
        ruedo.connect(server.url, timeout=PATIENCE) as sim,
        Datagrams(server.url) as stranger,
        sim._connection.bus.subscribe(
            "p3at/move", lambda data: stranger.send("p3at/motion", false.encode())
        ),
    ):
        said, _ = primitives_of(language, server.url)
    for what in ("advance", "rotate", "turn_to", "arc"):
        [line] = [line.split() for line in said if line.split()[0] == what]
        assert line[1:5] == ["False", "True", "done", "-"], said


Beside = Callable[[Server, ruedo.Simulation, Callable[[], str]], contextlib.AbstractContextManager]


def in_lockstep(language: str, beside: Beside) -> tuple[list[str], str]:
    """What a client in lockstep says at its end, and its errors. From its first steps on `beside`
    goes on.
    """
    with (
        ruedo_run("--lockstep", "2", "--lease", str(PATIENCE), *QUICK, world=HALL) as server,
        ruedo.connect(server.url, name="pace", timeout=PATIENCE) as pace,
        tempfile.TemporaryFile("w+") as file,
    ):

        def errors() -> str:
            return os.pread(file.fileno(), 1 << 20, 0).decode()  # the client writes at the offset

        command = ("lockstep", "client", "p3at", "100", "10", "0.2")
        client = started(language, server.url, *command, errors=file)
        pace.step(0, timeout=PATIENCE)
        assert client.stdout.readline().startswith("begin")
        with beside(server, pace, errors):
            for _ in range(10):
                pace.step(10, timeout=PATIENCE)
            return ended(client)[0], errors()


@contextlib.contextmanager
def nothing(server: Server, pace: ruedo.Simulation, errors: Callable[[], str]) -> Iterator[None]:
    yield


@contextlib.contextmanager
def another_server(
    server: Server, pace: ruedo.Simulation, errors: Callable[[], str]
) -> Iterator[None]:
    with ruedo_run(*QUICK, world=HALL) as second, OneBus(server, second):
        deadline = time.monotonic() + PATIENCE
        while BESIDE not in errors():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        yield


def false_tick(run_id: int, step: int, nparts: int = 1) -> bytes:
    """It names a message that never was, and says that all grants were executed."""
    tick = lcmtypes.tick_t()
    tick.utime, tick.run_id, tick.step, tick.nparts = 5000 * (step % 1000), run_id, step, nparts
    applied, message = lcmtypes.tick_applied_t(), lcmtypes.tick_message_t()
    applied.client, applied.sequence = "client", 1 << 40
    message.channel_index, message.sequence, message.size, message.crc = 1, 1 << 40, 1000, 99
    tick.applied, tick.napplied = [applied], 1
    tick.manifest, tick.nmanifest = [message], 1
    return tick.encode()


@contextlib.contextmanager
def false_ticks(
    server: Server, pace: ruedo.Simulation, errors: Callable[[], str]
) -> Iterator[None]:
    """Of all steps to come, before the true ones."""
    with Datagrams(server.url) as stranger:
        for step in [*range(1, 101), 2**63 - 1, -(2**63)]:
            stranger.send("ruedo/tick", false_tick(pace._info.run_id, step))
            stranger.send("ruedo/tick", false_tick(pace._info.run_id, step, 32767))
        yield


@pytest.mark.parametrize("beside", [another_server, false_ticks])
def test_lockstep_sees_its_own_run_alone(language, beside):
    said, errors = in_lockstep(language, beside)
    assert (said, BEGUN in errors) == (in_lockstep(language, nothing)[0], False), errors
    assert errors.count(BESIDE) == (beside is another_server)


def flood_of_samples(sim: ruedo.Simulation) -> Iterator[tuple[str, bytes]]:
    channels = [one.name for one in sim._info.channel_list if one.robot and not one.input]
    for i in range(9000):
        yield (
            channels[i % len(channels)],
            struct.pack(">8sqq", b"no type", 1 << 50, i) + bytes(59000),
        )


def flood_of_ticks(sim: ruedo.Simulation) -> Iterator[tuple[str, bytes]]:
    """Each a part of a step to come, which names 2 900 messages that never were."""
    manifest = b"".join(struct.pack(">iqiI", 1, i, 1000, 7) for i in range(2900))
    for i in range(9000):
        tick = lcmtypes.tick_t()
        tick.run_id, tick.step, tick.part, tick.nparts = sim._info.run_id, 1 + i % 900, i // 900, 20
        yield "ruedo/tick", tick.encode()[:-4] + struct.pack(">i", 2900) + manifest


@pytest.mark.parametrize("flood", [flood_of_samples, flood_of_ticks])
def test_an_oversized_message_takes_no_memory(language, flood):
    """In lockstep, where messages wait for their ticks, and ticks for their messages."""
    command = PROBES[language]
    if language == "java":
        command = [command[0], "-Xmx160m", *command[1:]]
    with ruedo_run("--lockstep", "2", *QUICK, world=HALL) as server:
        with ruedo.connect(server.url, timeout=PATIENCE) as sim:
            client = subprocess.Popen(
                [*command, server.url, "lockstep", "client", "p3at", "10", "10", "0.2"],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
            )
            requests = threading.Semaphore(0)
            with sim._connection.bus.subscribe("ruedo/request", lambda data: requests.release()):
                for _ in range(10):  # it takes part, and waits for the second one
                    assert requests.acquire(timeout=PATIENCE)
            with Datagrams(server.url) as stranger:
                for number, message in enumerate(flood(sim)):
                    stranger.send(*message)
                    if number % 5 == 0:
                        time.sleep(0.002)  # as fast as they are read
        assert client.poll() is None, client.stderr.read()
    client.kill()
    errors = client.stderr.read().decode()
    _, _, used = os.wait4(client.pid, 0)
    assert used.ru_maxrss < 400_000, errors  # KiB
    assert "OutOfMemory" not in errors
