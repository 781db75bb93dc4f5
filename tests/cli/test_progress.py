"""What takes long says on a terminal how far it is; pipes and --quiet are told nothing.
RUEDO_PROGRESS_AFTER_MS=0 stands for a long run: the line comes with the first of what is done, not
after a second.
"""

import os
import pty
import re
import shutil
import signal
import struct
import subprocess

import pytest
from recorded import ARENA, RUEDO, program, record

QUICK = ("--disable", "p3at/camera")
PLAIN = {k: v for k, v in os.environ.items() if not k.startswith("RUEDO_PROGRESS")}


def on_terminal(*words, after="0", until=None):
    """(exit code, what a terminal was sent) of the program. It is asked to end when it said
    `until`.
    """
    here, there = pty.openpty()
    environment = {**PLAIN, "TERM": "xterm", "NO_COLOR": "1"}
    if after is not None:
        environment["RUEDO_PROGRESS_AFTER_MS"] = after
    child = subprocess.Popen(
        [str(word) for word in (RUEDO, *words)],
        stdin=subprocess.DEVNULL,
        stdout=there,
        stderr=there,
        env=environment,
    )
    os.close(there)
    said = b""
    while True:
        try:
            chunk = os.read(here, 65536)
        except OSError:  # the other end is closed
            break
        if not chunk:
            break
        said += chunk
        if until and re.search(until, said.decode(errors="ignore")):
            child.send_signal(signal.SIGTERM)
            until = None
    os.close(here)
    return child.wait(60), said.decode()


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "run.lcm"
    record(path, seconds=2)
    return path


def drawn(said):
    """The lines of progress, in the order in which they were drawn."""
    return re.findall(r"\r\x1b\[K([^\r\n\x1b]+)", said)


@pytest.fixture
def commands(log, tmp_path):
    """{command: (words, what it says it does)}"""
    bitmap = tmp_path / "rooms.pgm"
    bitmap.write_bytes(b"P5 40 40 255\n" + bytes([0] * 40 + [255] * 1520 + [0] * 40))
    return {
        "verify": (("verify", log), "repeating .*run.lcm"),
        "export": (("export", log, tmp_path / "a.mcap"), "(indexing|exporting) .*run.lcm"),
        "bag": (("export", log, "--ros2", tmp_path / "bag"), "(indexing|exporting) .*run.lcm"),
        "diff": (("diff", log, log), "reading .*run.lcm"),
        "map": (("map", ARENA, "-o", tmp_path / "a.yaml"), "drawing the map"),
        "import": (
            ("import", bitmap, "--resolution", "0.1", "-o", tmp_path / "a.sdf"),
            "finding walls",
        ),
        "check": (("check", ARENA), "loading .*arena.sdf"),
        "render": (("render", ARENA, "-o", tmp_path / "a.png"), "drawing arena"),
        "regress": (
            ("regress", ARENA, "--record", tmp_path / "r.lcm", "--duration", "1", *QUICK)
            + ("--rate", "max", "--shared-network"),
            "running arena",
        ),
    }


NAMES = ("verify", "export", "bag", "diff", "map", "import", "check", "render", "regress")


@pytest.mark.parametrize("name", NAMES)
def test_it_reports_its_progress(name, commands):
    words, what = commands[name]
    code, said = on_terminal(*words)
    assert code == 0, said
    assert any(re.match(what + r"(: \d+ %|, 0 s)", line) for line in drawn(said)), said
    # Each line is removed before the command's own output.
    last = said[said.rfind("\r\x1b[K") + 4 :]
    assert not re.match(what, last), said


@pytest.mark.parametrize("name", NAMES)
def test_quiet_and_pipes_show_no_progress(name, commands):
    words, _ = commands[name]
    done = subprocess.run(
        [str(word) for word in (RUEDO, *words)],
        capture_output=True,
        text=True,
        env={**PLAIN, "RUEDO_PROGRESS_AFTER_MS": "0"},
        timeout=120,
    )
    assert done.returncode == 0 and "\r" not in done.stdout + done.stderr
    if name == "bag":
        shutil.rmtree(words[-1])
    code, said = on_terminal(*words, "--quiet")
    assert code == 0 and "\x1b" not in said, said


def test_the_part_that_is_done_grows(log):
    """The line comes by itself, where it takes more than a second."""
    two = r"(?s)run.lcm: (\d+) %.*run.lcm: (?!\1 )\d+ %"
    code, said = on_terminal(
        *("play", log, "--speed", "0.1", "--lcm", "memq://"), after=None, until=two
    )
    parts = [int(part) for part in re.findall(r"run.lcm: (\d+) %", said)]
    assert code == 0 and parts and parts == sorted(parts) and parts[-1] > parts[0], said


def test_a_short_command_shows_no_progress(log):
    code, said = on_terminal("diff", log, log, after="60000")
    assert code == 0 and "\x1b" not in said


def test_a_run_has_its_own_line():
    """The status line of a run is not mixed with the line about its loading, and --quiet silences
    both.
    """
    words = ("run", ARENA, "--rate", "max", "--duration", "1", "--lcm", "memq://", *QUICK)
    code, said = on_terminal(*words)
    lines = drawn(said)
    assert code == 0 and any(line.startswith("loading ") for line in lines), said
    code, said = on_terminal(*words, "--quiet")
    assert code == 0 and "\x1b" not in said, said
    assert program(*words, "--quiet").stderr == ""


def test_a_resimulation_reports_its_progress(log, tmp_path):
    """A stranger's may be hours away: what is left is told, and a signal ends it."""
    data = bytearray(log.read_bytes())
    end = data.rindex(b"ruedo/state_hash") + len("ruedo/state_hash")
    # A state_hash_t: fingerprint, utime and step.
    data[end + 16 : end + 24] = struct.pack(">q", 10**11)
    far = tmp_path / "far.snapshot"
    far.write_bytes(data)
    code, said = on_terminal(
        *("run", ARENA, *QUICK, "--restore", far, "--lcm", "memq://"),
        until=r"far.snapshot: 0 %, \d+:\d\d h left",
    )
    assert code == 0, said
    assert "re-simulating 100000000000 steps" in said
