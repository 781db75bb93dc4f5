"""A run ends soon after it is told to, however much work its modules have before them."""

import os
import pty
import signal
import subprocess
import time
from pathlib import Path

import lcm
import pytest

RUEDO = os.environ["RUEDO"]

# As fast as they go, batches of 160 ms are on their way, four at a time: with 200 cameras at 30 Hz
# thousands of pictures, which take minutes.
WORLD = """<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include>
<ruedo:fleet name='r'><include><uri>model://p3at</uri></include><ruedo:count>200</ruedo:count></ruedo:fleet></world></sdf>"""


PATIENCE = 400  # s


def processor_seconds(process):
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def has_died(process):
    """It is a zombie at most. Who was killed dies when it gets a processor."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def until(condition, process, ended=False):
    """ended: the process may have."""
    deadline = time.monotonic() + PATIENCE
    while True:
        has_ended = process.poll() is not None  # before the look: its last words count
        if condition():
            return
        assert (ended or not has_ended) and time.monotonic() < deadline
        time.sleep(0.05)


@pytest.mark.parametrize("told", [signal.SIGTERM, signal.SIGINT])
def test_it_does_not_wait_for_pictures(told, tmp_path):
    world, said = tmp_path / "w.sdf", tmp_path / "said"
    world.write_text(WORLD)
    # LCM over memory: nothing leaves the process.
    with (
        said.open("w") as out,
        subprocess.Popen(
            [RUEDO, "run", world, "--rate", "max", "--lcm", "memq://"], stdout=out
        ) as server,
    ):
        try:
            until(
                lambda: said.read_text().count("\n") > 3, server
            )  # the list of channels, which is printed when all is loaded
            loaded = processor_seconds(server)
            until(lambda: processor_seconds(server) > loaded + 4.0, server)  # in the midst of it
            server.send_signal(told)
            before = processor_seconds(server)
            _, status, used = os.wait4(server.pid, 0)
            server.returncode = os.waitstatus_to_exitcode(status)
            # Of the processors' time, whatever else they do.
            assert server.returncode == 0 and used.ru_utime + used.ru_stime - before < 15.0
        finally:
            if server.returncode is None:
                server.kill()


EMPTY = """<sdf version='1.9'><world name='w'><include><uri>model://ground_plane</uri></include><include><uri>model://p3at</uri></include></world></sdf>"""


def verified(log, world):
    """A log that has its end repeats as a whole."""
    repeated = subprocess.run(
        [RUEDO, "verify", log], capture_output=True, text=True, cwd=world.parent
    )
    assert repeated.returncode == 0, repeated.stdout + repeated.stderr
    assert "the end of the run is not in it" not in repeated.stdout + repeated.stderr


def test_a_closed_terminal_leaves_a_whole_log(tmp_path):
    world, said, log = tmp_path / "w.sdf", tmp_path / "said", tmp_path / "run.lcm"
    world.write_text(EMPTY)
    with (
        said.open("w") as out,
        subprocess.Popen(
            [RUEDO, "run", world, "--lcm", "memq://", "--disable", "p3at/camera", "--record", log],
            stdout=out,
        ) as server,
    ):
        until(lambda: said.read_text().count("\n") > 3, server)
        server.send_signal(signal.SIGHUP)
        assert server.wait(PATIENCE) == 0
    verified(log, world)


@pytest.mark.parametrize("told", ["INT", "TERM", "HUP"])
def test_a_regression_that_is_ended_leaves_a_whole_log_and_no_process(told, tmp_path):
    """What the client's shell has started is ended, too."""
    log, child, said = (tmp_path / name for name in ("run.lcm", "child", "said"))
    client = f"sleep 1000 & echo $! > {child}; wait"
    with (
        said.open("w") as errors,
        subprocess.Popen(
            [RUEDO, "regress", "arena", "--disable", "p3at/camera", "--client", client]
            + ["--duration", "100000", "--rate", "1", "--record", log],
            stderr=errors,
        ) as regress,
    ):
        until(lambda: child.exists() and child.read_text().endswith("\n"), regress)
        until(lambda: log.exists() and log.stat().st_size > 0, regress)
        regress.send_signal(getattr(signal, f"SIG{told}"))
        regress.wait(PATIENCE)
    number = getattr(signal, f"SIG{told}")
    assert regress.returncode == 128 + number and "ended by a signal" in said.read_text()
    process = child.read_text().strip()
    until(lambda: has_died(process), regress, ended=True)
    verified = subprocess.run([RUEDO, "verify", log], capture_output=True, text=True)
    assert verified.returncode == 0 and "the end of the run is not in it" not in verified.stdout


def test_nohup_outlives_its_terminal(tmp_path):
    world, said = tmp_path / "w.sdf", tmp_path / "said"
    world.write_text(EMPTY)
    with (
        said.open("w") as out,
        subprocess.Popen(
            ["nohup", RUEDO, "run", world, "--lcm", "memq://", "--duration", "2"], stdout=out
        ) as server,
    ):
        until(lambda: said.read_text().count("\n") > 3, server)
        server.send_signal(signal.SIGHUP)
        assert server.wait(PATIENCE) == 0
    assert "Hangup" not in said.read_text()


def test_a_pipe_without_a_reader_leaves_a_complete_log(tmp_path):
    world, log = tmp_path / "w.sdf", tmp_path / "run.lcm"
    world.write_text(EMPTY)
    read, write = os.pipe()
    os.close(read)
    server = subprocess.Popen(
        [RUEDO, "run", world, "--lcm", "memq://", "--disable", "p3at/camera", "--record", log],
        stdout=write,
    )
    os.close(write)
    assert server.wait(PATIENCE) == 0
    verified(log, world)


def test_a_run_may_be_ended_after_its_first_line(tmp_path):
    world, log = tmp_path / "w.sdf", tmp_path / "run.lcm"
    world.write_text(EMPTY)
    # The page is opened between the first line and the first step.
    command = [RUEDO, "run", world, "--lcm", "memq://", "--disable", "p3at/camera", "--view"]
    for _ in range(5):
        with subprocess.Popen([*command, "--record", log], stdout=subprocess.PIPE) as server:
            assert server.stdout.readline()
            server.send_signal(signal.SIGINT)
            server.stdout.read()
            assert server.wait(PATIENCE) == 0
        verified(log, world)
        log.unlink()


def heeds_interrupts(process):
    """Whether it came so far that SIGINT is its own to handle."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    caught = next(line for line in status.splitlines() if line.startswith("SigCgt:"))
    return int(caught.split()[1], 16) >> (signal.SIGINT - 1) & 1


def test_a_message_due_in_centuries_is_waited_for(tmp_path):
    """A time that no clock can say is not the past: nothing is played at once instead."""
    log = tmp_path / "two.lcm"
    events = lcm.EventLog(str(log), "w")
    for time_us in (0, 9 * 10**15):
        events.write_event(time_us, "a/pose", b"")
    events.close()
    process = subprocess.Popen(
        [RUEDO, "play", log, "--lcm", "memq://", "--speed", "1e-4"],
        stdout=subprocess.PIPE,
        text=True,
    )
    until(lambda: heeds_interrupts(process), process)
    time.sleep(1)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=PATIENCE)[0]
    assert "interrupted" in said and "2 messages" not in said


def test_an_empty_log_is_called_empty(tmp_path):
    log = tmp_path / "run.lcm"
    log.write_bytes(b"")
    told = subprocess.run([RUEDO, "verify", log], capture_output=True, text=True)
    assert told.returncode != 0 and "is empty: nothing was recorded" in told.stderr


def processes_that_name(path):
    found = []
    for each in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if str(path).encode() in each.read_bytes():
                found.append(each.parent.name)
        except OSError:
            pass
    return found


@pytest.mark.parametrize("shown", ["nothing", "progress"])
@pytest.mark.parametrize("told", [signal.SIGTERM, signal.SIGINT])
def test_an_interrupted_mesh_import_leaves_nothing(told, shown, tmp_path):
    """Neither the importer's process nor a file, nor the socket's name."""
    mesh = tmp_path / "large.obj"
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    with mesh.open("w") as file:
        file.writelines(f"v {i % 700} {i // 700} {i % 13}\n" for i in range(490_000))
        file.writelines(f"f {i} {i + 1} {i + 700}\n" for i in range(1, 489_000))
    world = tmp_path / "w.sdf"
    world.write_text("""<sdf version='1.9'><world name='w'><model name='m'><static>true</static><link name='l'>
<collision name='c'><geometry><mesh><uri>large.obj</uri></mesh></geometry></collision></link></model></world></sdf>""")
    terminal, shell = pty.openpty()
    server = subprocess.Popen(
        [RUEDO, "run", world, "--lcm", f"unix://{tmp_path}/bus"],
        env={**os.environ, "TMPDIR": str(temporary), "XDG_CACHE_HOME": str(tmp_path / "cache")},
        stdout=subprocess.DEVNULL,
        stderr=shell if shown == "progress" else subprocess.DEVNULL,
    )
    try:
        until(lambda: len(processes_that_name(mesh)) > 0, server)
        server.send_signal(told)
        assert server.wait(PATIENCE) == 128 + told
    finally:
        server.kill()
        server.wait()
        os.close(terminal)
        os.close(shell)
    deadline = time.monotonic() + PATIENCE
    while processes_that_name(mesh):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    assert not list(temporary.iterdir()) and not (tmp_path / "bus").exists()


@pytest.fixture(scope="module")
def long_log(tmp_path_factory):
    """The arena for 20 s, and then its messages again and again: 100 MB, which take a command a
    second of the processor's time."""
    folder = tmp_path_factory.mktemp("long")
    short, path = folder / "short.lcm", folder / "run.lcm"
    options = ["--disable", "p3at/camera", "--rate", "max", "--duration", "20", "--lcm", "memq://"]
    subprocess.run(
        [RUEDO, "run", "arena", "--quiet", *options, "--record", short],
        check=True,
        timeout=PATIENCE,
    )
    log = lcm.EventLog(str(short), "r")
    found = [(event.timestamp, event.channel, event.data) for event in log]
    log.close()
    written = lcm.EventLog(str(path), "w", overwrite=True)
    for again in range(100_000_000 // short.stat().st_size):
        for timestamp, channel, data in found:
            if again == 0 or not channel.startswith("ruedo/"):
                written.write_event(timestamp + again * 20_000_000, channel, data)
    written.close()
    return path


@pytest.mark.parametrize("told", ["INT", "TERM"])
@pytest.mark.parametrize(
    "words",
    [
        ("export", "LOG", "out.mcap"),
        ("export", "LOG", "--ros2", "bag"),
        ("play", "LOG", "--html", "out.html", "--html-size", "100"),
        ("diff", "LOG", "LOG", "--html", "out.html"),
        ("info", "LOG"),
    ],
)
def test_a_long_command_ends_at_once_and_leaves_nothing(words, told, long_log, tmp_path):
    """Wherever a signal meets it, and what was there before stays."""
    number = getattr(signal, f"SIG{told}")
    for name in ("out.mcap", "out.html"):
        (tmp_path / name).write_text("as before")
    before = sorted(tmp_path.iterdir())
    for share in (0.1, 0.3):  # s of its work
        process = subprocess.Popen(
            [RUEDO, *(str(long_log) if word == "LOG" else word for word in words)],
            cwd=tmp_path,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        begin, deadline = processor_seconds(process), time.monotonic() + PATIENCE
        while process.poll() is None and processor_seconds(process) < begin + share:
            assert time.monotonic() < deadline
            time.sleep(0.005)
        short = words[0] in ("info", "diff")  # these may be done when the signal comes
        if process.poll() is not None:
            assert short
            continue
        process.send_signal(number)
        worked = processor_seconds(process)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode in (-number, 128 + number)
        assert used.ru_utime + used.ru_stime - worked < 0.2
        assert sorted(tmp_path.iterdir()) == before
        for path in before:
            text = path.read_text()
            assert text == "as before" or (short and text.endswith("</html>\n"))
