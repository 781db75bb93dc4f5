"""ruedo echo, hz, teleop and play, on a bus of their own (isolated.py): what they say is what was
published.
"""

import fcntl
import os
import pty
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import termios
import threading
import time
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
sys.path.insert(0, str(SOURCE / "tests"))
from witness import attempts

HELLO = struct.pack(">II", 0x287617FA, 0x0100)  # a server's


def frame(channel, data):
    return struct.pack(f">II{len(channel)}sI", 1, len(channel), channel.encode(), len(data)) + data


@contextmanager
def listening(kind, folder, url=""):
    """A server's socket and its URL, at that URL's place if one is given."""
    if kind == "tcpq":
        port = int(url.rpartition(":")[2] or 0)
        with socket.create_server(("127.0.0.1", port)) as server:
            yield server, f"tcpq://127.0.0.1:{server.getsockname()[1]}"
        return
    path = folder / "bus"
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))
        server.listen()
        yield server, f"unix://{path}"
    path.unlink()


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
    with listening("tcpq", None) as (server, url):
        echo = subprocess.Popen([RUEDO, "echo", "large", "--lcm", url], stdout=subprocess.PIPE)
        with server.accept()[0] as client:
            client.sendall(HELLO)
            for _ in range(40):
                client.sendall(frame("large", data))
    echo.kill()
    _, _, used = os.wait4(echo.pid, 0)
    assert used.ru_maxrss < 300_000  # KiB, of 640 MB


@pytest.mark.parametrize("kind", ["tcpq", "unix"])
def test_echo_continues_with_the_next_server(kind, tmp_path):
    url = ""
    for number in range(3):
        with listening(kind, tmp_path, url) as (server, url):
            if number == 0:
                echo = subprocess.Popen(
                    [RUEDO, "echo", "a", "-n", "3", "--lcm", url],
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    text=True,
                )
            with server.accept()[0] as client:
                client.sendall(HELLO + frame("a", bytes(8 + number)))
                assert echo.stdout.readline().startswith(f"a: {8 + number} bytes")
    out, said = echo.communicate(timeout=PATIENCE)
    assert echo.returncode == 0 and out == ""
    assert said.count("the server has closed the connection; it is looked for again") >= 2


def test_echo_of_a_silent_channel_ends_at_its_timeout():
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
        for witness in attempts():
            done = ruedo("hz", "beat", "silent", "-n", "3")
            if "ms apart" in done.stdout or not witness.excuses():
                break
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


def test_hz_counts_a_repeated_channel_once():
    with published("beat", b"\0" * 1000, period_s=0.05):
        for witness in attempts():
            done = ruedo("hz", "beat", "beat", "-n", "2")
            if "nothing" not in done.stdout or not witness.excuses():
                break
    assert done.returncode == 0 and "nothing" not in done.stdout
    assert len(done.stdout.splitlines()) == 2, done


def test_play_reports_messages_without_a_receiver(tmp_path):
    log = lcm.EventLog(str(tmp_path / "log"), "w")
    for time_us in (0, 1_000_000):
        log.write_event(time_us, "a", b"word")
    log.close()
    with listening("unix", tmp_path) as (server, url):
        play = subprocess.Popen(
            [RUEDO, "play", tmp_path / "log", "--lcm", url], stdout=subprocess.PIPE, text=True
        )
        with server.accept()[0] as client:
            came = b""
            while not came.endswith(frame("a", b"word")):
                came += client.recv(4096)
    said = play.communicate(timeout=PATIENCE)[0]
    assert play.returncode == 0 and said.endswith(f"2 messages, 1 s, on {url}; 1 not sent\n")


class Teleop:
    """Started in a terminal of its own, by a shell's script where one is given."""

    def __init__(self, url=URL, script=None, stdout=None):
        self.terminal, self.child = pty.openpty()
        self.before = termios.tcgetattr(self.child)
        shell = ["setsid", "--ctty", "--wait", "bash", "-c", script] if script else []
        self.process = subprocess.Popen(
            [*shell, RUEDO, "teleop", "p3at", "--lcm", url],
            stdin=self.child,
            stdout=stdout or self.child,
            stderr=self.child,
            process_group=0,  # with a parent outside it, as under a shell: it can be suspended
        )
        self.said = ""
        self.deadline = time.monotonic() + PATIENCE

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        os.close(self.terminal)
        os.close(self.child)

    def press(self, keys):
        while not self.is_raw():
            self.read()
        os.write(self.terminal, keys)

    def press_in_vain(self, keys, said):
        """Keys that are answered with these words, as the silence between keys is, too."""
        self.press(keys)
        while struct.unpack("i", fcntl.ioctl(self.child, termios.FIONREAD, bytes(4)))[0]:
            self.read()
        while self.read():
            pass
        for _ in range(2):  # the first may have been sent before the last key was read
            self.said = ""
            self.until(said)

    def read(self):
        """What is said within a moment; fails when this terminal has been open for too long."""
        assert time.monotonic() < self.deadline, self.said
        said = ""
        if select.select([self.terminal], [], [], 0.05)[0]:
            said = os.read(self.terminal, 4096).decode()
            self.said += said
        return said

    def until(self, words):
        while words not in self.said:
            self.read()

    def until_job(self, process, state):
        """state: as /proc names it."""
        now = ""
        while now != state:
            self.read()
            try:
                now = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
            except OSError:
                now = "ended"

    def is_raw(self):
        return not termios.tcgetattr(self.child)[3] & (termios.ICANON | termios.ECHO)

    def is_as_before(self):
        return termios.tcgetattr(self.child) == self.before


class Commands:
    """What is published on p3at/velocity, or another channel."""

    def __init__(self, channel="p3at/velocity"):
        from ruedo.lcmtypes import velocity_command_t

        self.bus, self.found = lcm.LCM(URL), []
        self.bus.subscribe(
            channel,
            lambda channel, data: self.found.append(
                (c := velocity_command_t.decode(data), round(c.vx, 6), round(c.omega, 6))[1:]
            ),
        ).set_queue_capacity(0)  # without an end: the last of many is the one that counts

    def until(self, teleop, command):
        while not self.found or self.found[-1] != command:
            teleop.read()
            assert self.bus.handle_timeout(1000 * PATIENCE) > 0


def test_teleop_drives_as_keys_are_pressed():
    """w and a twice each, an arrow, the space that stops, q; what is published then, and that it
    stands at the end."""
    commands = Commands()
    with Teleop() as teleop:
        commands.until(teleop, (0, 0))
        for key, command in (
            (b"w", (0.1, 0)),
            (b"w", (0.2, 0)),
            (b"a", (0.2, 0.2)),
            (b"\033[C", (0.2, 0)),
            (b"\033[B", (0.1, 0)),
            (b" ", (0, 0)),
            (b"s", (-0.1, 0)),
        ):
            teleop.press(key)
            commands.until(teleop, command)
        repeated = len(commands.found)
        while len(commands.found) < repeated + 5:  # without a key, too: the watchdog is content
            assert commands.bus.handle_timeout(1000 * PATIENCE) > 0
        assert commands.found[-1] == (-0.1, 0)
        teleop.press(b"q")
        commands.until(teleop, (0, 0))
        assert teleop.process.wait(PATIENCE) == 0 and teleop.is_as_before()


def publish_info(*parts, channels=()):
    """ruedo/info, each part of it with the robots of these names; in the last one these channels
    for velocities, as (robot, name)."""
    from ruedo.lcmtypes import channel_info_t, robot_info_t, world_info_t

    bus = lcm.LCM(URL)
    for number, names in enumerate(parts):
        info = world_info_t()
        info.part, info.nparts, info.nrobots = number, len(parts), len(names)
        for name in names:
            info.robots.append(robot_info_t())
            info.robots[-1].name = name
        for robot, name in channels if number == len(parts) - 1 else ():
            channel = channel_info_t()
            channel.robot, channel.name, channel.input = robot, name, True
            channel.type = "velocity_command_t"
            info.channels.append(channel)
        info.nchannels = len(info.channels)
        bus.publish("ruedo/info", info.encode())


def test_teleop_drives_a_new_robot_of_the_name_only_after_a_key():
    commands = Commands()
    with Teleop() as teleop:
        teleop.press(b"w")
        commands.until(teleop, (0.1, 0))
        publish_info(["alice"], ["p3at"])
        teleop.press(b"w")
        commands.until(teleop, (0.2, 0))
        publish_info(["alice"], [])
        teleop.until("p3at: not there")
        teleop.press_in_vain(b"w", "p3at: not there")
        before = len(commands.found)
        publish_info(["alice"], ["p3at"])
        commands.until(teleop, (0, 0))
        teleop.press(b"w")
        commands.until(teleop, (0.1, 0))
        late = commands.found[before:]
        assert set(late[late.index((0, 0)) :]) == {(0, 0), (0.1, 0)}


def test_teleop_drives_on_the_channel_that_the_robot_listens_to():
    """Another one with --remap."""
    usual, commands = Commands(), Commands("cart/cmd_vel")
    with Teleop() as teleop:
        usual.until(teleop, (0, 0))
        publish_info(
            ["alice"],
            ["p3at"],
            channels=[("alice", "alice/velocity"), ("p3at", "cart/cmd_vel"), ("bob", "bob/v")],
        )
        commands.until(teleop, (0, 0))
        teleop.press(b"w")
        commands.until(teleop, (0.1, 0))


def test_teleop_takes_keys_in_whatever_pieces_they_come():
    commands = Commands()
    with Teleop() as teleop:
        commands.until(teleop, (0, 0))
        for keys, command in (
            (b"wwa", (0.2, 0.2)),
            (b"w\033[A\033OD", (0.4, 0.4)),  # both kinds of arrows
            (b"ww ", (0, 0)),
            (b"s\033[1;5A\033[3~w", (0.1, 0)),  # up with Ctrl, and delete
            (b"\033", None),
            (b"[", None),
            (b"B", (0, 0)),
            (b"w\033", (0.1, 0)),
            (b" ", (0, 0)),
            (b"w\033[", (0.1, 0)),
            (b" ", (0, 0)),
        ):
            teleop.press(keys)
            if command is not None:
                commands.until(teleop, command)
            else:
                teleop.read()


def test_teleop_takes_no_byte_for_an_end_and_no_text_for_any_speed():
    """0xFF, 0xFE and 0xFD are in no text of UTF-8, but may come; a text that is pasted has many
    letters."""
    commands = Commands()
    with Teleop() as teleop:
        commands.until(teleop, (0, 0))
        teleop.press(b"w\xff\xfe\xfdw")
        commands.until(teleop, (0.2, 0))
        for letters, command in ((b"w" * 1000, (20, 0)), (b" " + b"a" * 1000, (0, 10))):
            teleop.press(letters)
            commands.until(teleop, command)
        assert "+20.1 m/s" not in teleop.said


@pytest.mark.parametrize("told", ["TERM", "HUP", "INT", "QUIT"])
def test_teleop_stops_the_robot_and_restores_the_terminal(told):
    commands = Commands()
    with Teleop() as teleop:
        teleop.press(b"w")
        commands.until(teleop, (0.1, 0))
        teleop.process.send_signal(getattr(signal, f"SIG{told}"))
        commands.until(teleop, (0, 0))
        assert teleop.process.wait(PATIENCE) == 0 and teleop.is_as_before()


def test_teleop_is_suspended():
    commands = Commands()
    with Teleop() as teleop:
        teleop.press(b"w")
        commands.until(teleop, (0.1, 0))
        teleop.process.send_signal(signal.SIGTSTP)
        commands.until(teleop, (0, 0))
        os.waitid(os.P_PID, teleop.process.pid, os.WSTOPPED)
        assert teleop.is_as_before()
        for suspended in (signal.SIGTSTP, signal.SIGSTOP):
            teleop.process.send_signal(signal.SIGCONT)
            teleop.press(b"w")
            commands.until(teleop, (0.1, 0))
            teleop.press(b" ")
            commands.until(teleop, (0, 0))
            teleop.process.send_signal(suspended)
            os.waitid(os.P_PID, teleop.process.pid, os.WSTOPPED)
            termios.tcsetattr(teleop.child, termios.TCSANOW, teleop.before)  # as a shell does


def test_teleop_resumes_in_a_window_of_another_size():
    script = 'set -m; "$0" "$@"; echo suspended; read; fg; echo "ended $?"'
    commands = Commands()
    with Teleop(script=script) as teleop:
        teleop.press(b"w")
        commands.until(teleop, (0.1, 0))
        teleop.press(b"\x1a")
        teleop.until("suspended")
        commands.until(teleop, (0, 0))
        assert teleop.is_as_before()
        os.write(teleop.terminal, b"\n")
        teleop.press(b"w")
        commands.until(teleop, (0.1, 0))
        fcntl.ioctl(teleop.terminal, termios.TIOCSWINSZ, struct.pack("4H", 40, 100, 0, 0))
        teleop.press(b"w")
        commands.until(teleop, (0.2, 0))
        teleop.press(b"q")
        teleop.until("ended 0")
        assert teleop.process.wait(PATIENCE) == 0 and teleop.is_as_before()


@pytest.mark.parametrize("begin", ['"$0" "$@" &', '"$0" "$@";', '"$0" "$@"; bg;'])
def test_teleop_in_the_background_leaves_the_terminal_alone_and_ends_at_sigterm(begin):
    """As `kill %1` tells it: TERM and then CONT."""
    script = f"set -m; {begin} job=$(jobs -p); echo job $job.; read; wait $job; echo ended $?"
    with Teleop(script=script) as teleop:
        if not begin.endswith("&"):
            teleop.press(b"w\x1a")
        teleop.until(".\r\n")
        job = int(re.search(r"job (\d+)", teleop.said)[1])
        teleop.until_job(job, "T")
        assert teleop.is_as_before()
        for told in (signal.SIGTERM, signal.SIGCONT):
            os.kill(job, told)
        teleop.until_job(job, "ended")
        os.write(teleop.terminal, b"\n")
        teleop.until("ended 0")
        assert teleop.process.wait(PATIENCE) == 0 and teleop.is_as_before()


def test_teleop_ends_when_its_output_is_closed():
    reads, writes = os.pipe()
    os.close(reads)
    with Teleop(stdout=writes) as teleop:
        assert teleop.process.wait(PATIENCE) == 0 and teleop.is_as_before()
    os.close(writes)


@pytest.mark.parametrize("kind", ["tcpq", "unix"])
def test_teleop_continues_with_the_next_server(kind, tmp_path):
    from ruedo.lcmtypes import velocity_command_t

    with listening(kind, tmp_path) as (server, url):
        teleop = Teleop(url)
        server.accept()[0].close()
    with teleop:
        for words in ("(not sent)", f"{url}: the server has closed the connection"):
            while words not in teleop.said:
                teleop.read()
        with listening(kind, tmp_path, url) as (server, _), server.accept()[0] as client:
            client.sendall(HELLO)
            teleop.press(b"w")
            command, came = velocity_command_t(), b""
            command.vx = 0.1
            while frame("p3at/velocity", command.encode()) not in came:
                teleop.read()
                came += client.recv(4096)


def test_teleop_needs_a_terminal():
    done = subprocess.run(
        [RUEDO, "teleop", "p3at", "--lcm", URL],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 4 and "teleop needs a terminal" in done.stderr
