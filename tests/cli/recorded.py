"""What the tests of recorded runs share: servers, logs, and commands to them."""

import os
import subprocess
import time
from pathlib import Path

import lcm
import pytest
import ruedo
from ruedo.lcmtypes import velocity_command_t

RUEDO = os.environ["RUEDO"]
SOURCE = Path(os.environ["RUEDO_SOURCE_DIR"])
ARENA = str(SOURCE / "worlds" / "arena.sdf")
QUICK = ["--disable", "p3at/camera", "--quiet"]
PATIENCE = 400  # s, for what comes sooner or later, on a machine that does much else too


def url(port):
    return f"udpm://239.255.76.67:{port}?ttl=0&recv_buf_size=2097152"


def program(*arguments, **options):
    return subprocess.run(
        [RUEDO, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE, **options
    )


def until(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def events(path):
    log = lcm.EventLog(str(path), "r")
    found = [(event.timestamp, event.channel, event.data) for event in log]
    log.close()
    return found


def write(path, found):
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for timestamp, channel, data in found:
        log.write_event(timestamp, channel, data)
    log.close()


def record(path, *arguments, world=ARENA, seconds=3, port=7821):
    result = program(
        "run",
        world,
        *QUICK,
        "--rate",
        "max",
        "--duration",
        seconds,
        "--record",
        path,
        "--lcm",
        url(port),
        *arguments,
    )
    assert result.returncode == 0, result.stderr
    return events(path)


class Server:
    """ruedo run in the background."""

    def __init__(self, port, *arguments, world=ARENA):
        self.url = url(port)
        options = QUICK if world == ARENA else ["--quiet"]  # the camera is the arena's
        self.process = subprocess.Popen(
            [RUEDO, "run", world, *options, "--lcm", self.url, *map(str, arguments)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        STARTED.append(self.process)

    def connect(self):
        return ruedo.connect(self.url, timeout=PATIENCE)

    def end(self, how=None):
        """Its exit code, and what it said that was not read yet."""
        if how:
            self.process.send_signal(how)
        _, errors = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, errors


STARTED = []


@pytest.fixture(autouse=True)
def no_process_outlives_its_test():
    yield
    for process in STARTED:
        process.kill()
        process.wait()
    STARTED.clear()


def command(simulation, vx, omega):
    """One command to a paused server, which has it when it answers a request that was sent behind
    it.
    """
    message = velocity_command_t()
    message.vx, message.omega = vx, omega
    lcm.LCM(simulation.url).publish("p3at/velocity", message.encode())
    simulation.state()


BOX = (
    "<sdf version='1.9'><model name='crate'><link name='link'><inertial><mass>3</mass></inertial><collision name='c'><geometry>"
    "<box><size>0.3 0.3 0.3</size></box></geometry></collision></link></model></sdf>"
)
