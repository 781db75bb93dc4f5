"""ruedo echo, hz and teleop, on a bus of their own (isolated.py): what they say is what was
published.
"""

import os
import pty
import re
import select
import socket
import struct
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import lcm
import pytest

SOURCE = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["RUEDO_BINARY_DIR"])
RUEDO = BUILD / "bin" / "ruedo"
URL = "udpm://239.255.76.67:7731?ttl=0"
PATIENCE = 400  # s, for what comes sooner or later, on a machine that does much else too
sys.path.insert(0, str(BUILD / "python"))


@contextmanager
def published(channel, data, period_s=0.02):
    """A message again and again, for as long as the block runs."""
    over = threading.Event()

    def publish():
        bus = lcm.LCM(URL)
        while not over.wait(period_s):
            bus.publish(channel, data)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def ruedo(*arguments):
    return subprocess.run(
        [RUEDO, *arguments, "--lcm", URL], capture_output=True, text=True, timeout=PATIENCE
    )


def test_echo_says_each_field():
    from ruedo.lcmtypes import odometry_t

    message = odometry_t()
    message.utime, message.x, message.theta, message.n = 1_500_000, 1.25, -0.5, 12
    message.angle, message.rate, message.ticks = [0.5 * i for i in range(12)], [0.0] * 12, [0] * 12
    with published("p3at/odometry", message.encode()):
        done = ruedo("echo", "p3at/odometry", "-n", "2")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line for line in lines if not line.startswith(" ")] == [
        f"p3at/odometry (odometry_t, {len(message.encode())} bytes)"
    ] * 2
    for line in (
        "  utime = 1500000",
        "  x = 1.25",
        "  theta = -0.5",
        "  angle[7] = 3.5",
        "  angle ... 4 more",
    ):
        assert lines.count(line) == 2, (line, done.stdout)
    assert "  angle[8] = 4" not in lines


def test_echo_of_strangers_and_of_half_a_message():
    from ruedo.lcmtypes import velocity_command_t

    with published("stranger", b"\0" * 8 + b"hello"):
        assert (
            ruedo("echo", "stranger", "-n", "1").stdout
            == "stranger: 13 bytes of a type that Ruedo does not know "
            "(its hash is 0x0000000000000000); --types reads its .lcm file\n"
        )
    with published("half", velocity_command_t().encode()[:20]):
        said = ruedo("echo", "half", "-n", "1").stdout
    assert said.startswith("half (velocity_command_t, 20 bytes)\n  utime = 0\n") and said.endswith(
        "  ... and then bytes that are not a velocity_command_t\n"
    )


def test_echo_holds_no_more_than_it_may():
    """Of large messages that come faster than it can show them."""
    from ruedo.lcmtypes import planar_lidar_t

    count = 4 << 20
    data = planar_lidar_t().encode()
    data = data[:16] + struct.pack(">i", count) + bytes(4 * count) + data[20:]
    frame = struct.pack(">II5sI", 1, 5, b"large", len(data)) + data
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"tcpq://127.0.0.1:{server.getsockname()[1]}"
        echo = subprocess.Popen([RUEDO, "echo", "large", "--lcm", url], stdout=subprocess.PIPE)
        with server.accept()[0] as client:
            client.sendall(struct.pack(">II", 0x287617FA, 0x0100))
            for _ in range(40):
                client.sendall(frame)
    echo.kill()
    _, _, used = os.wait4(echo.pid, 0)
    assert used.ru_maxrss < 300_000  # KiB, of 640 MB


def test_echo_of_silence_ends_when_asked_to():
    done = ruedo("echo", "nobody/home", "--timeout", "0.3")
    assert (
        done.returncode == 1
        and done.stdout == ""
        and done.stderr.startswith(
            "ruedo: nothing on nobody/home for 0.3 s, on udpm://239.255.76.67:7731"
        )
    )


def test_hz_counts_what_comes():
    """Messages of 1 000 bytes: as many kB as messages; and a channel on which nothing comes."""
    with published("beat", b"\0" * 1000, period_s=0.05):
        done = ruedo("hz", "beat", "silent", "-n", "3")
    assert done.returncode == 0, done.stderr
    reports = [
        re.fullmatch(r"beat: ([\d.]+) Hz, ([\d.]+) to ([\d.]+) ms apart, ([\d.]+) kB/s", line)
        for line in done.stdout.splitlines()
        if line.startswith("beat")
    ]
    assert len(reports) == 3 and done.stdout.count("silent: nothing") == 3
    found = [[float(value) for value in report.groups()] for report in reports if report]
    assert found, done.stdout
    for rate, least_ms, most_ms, kilobytes in found:
        assert rate > 0 and 0 <= least_ms <= most_ms and kilobytes == pytest.approx(rate, abs=0.11)
    assert ruedo("hz", "silent", "-n", "1").returncode == 1


def test_teleop_drives_as_keys_are_pressed():
    """In a terminal: w and a twice each, an arrow, the space that stops, q; what is published then,
    and that it stands at the end.
    """
    from ruedo.lcmtypes import velocity_command_t

    bus, found = lcm.LCM(URL), []
    bus.subscribe(
        "p3at/velocity",
        lambda channel, data: found.append(
            (c := velocity_command_t.decode(data), round(c.vx, 6), round(c.omega, 6))[1:]
        ),
    )
    parent, child = pty.openpty()
    process = subprocess.Popen(
        [RUEDO, "teleop", "p3at", "--lcm", URL], stdin=child, stdout=child, stderr=child
    )
    os.close(child)

    def until(command):
        while not found or found[-1] != command:
            if select.select([parent], [], [], 0)[0]:
                os.read(parent, 4096)
            assert bus.handle_timeout(1000 * PATIENCE) > 0

    until((0, 0))
    for key, command in (
        (b"w", (0.1, 0)),
        (b"w", (0.2, 0)),
        (b"a", (0.2, 0.2)),
        (b"\033[C", (0.2, 0)),
        (b"\033[B", (0.1, 0)),
        (b" ", (0, 0)),
        (b"s", (-0.1, 0)),
    ):
        os.write(parent, key)
        until(command)
    repeated = len(found)
    while len(found) < repeated + 5:  # without a key, too: the watchdog is content
        assert bus.handle_timeout(1000 * PATIENCE) > 0
    assert found[-1] == (-0.1, 0)
    os.write(parent, b"q")
    until((0, 0))
    assert process.wait(PATIENCE) == 0
    os.close(parent)


def test_teleop_needs_a_terminal():
    done = subprocess.run(
        [RUEDO, "teleop", "p3at", "--lcm", URL],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 4 and "teleop needs a terminal" in done.stderr
