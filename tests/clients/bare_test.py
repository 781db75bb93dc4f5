"""LCM programs that know nothing of the client libraries: the bare clients of docs/protocol.md, in
Python and C, the latter on LCM 1.5.3 and on Debian's 1.3.1; and what the protocol promises them."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import lcm
import pytest
from conftest import HERE, PATIENCE, SOURCE, ruedo_run
from docs_code import blocks
from witness import attempts

HALL = str(HERE / "hall.sdf")
LCM_GEN = shutil.which("lcm-gen", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")
WHEEL = Path(lcm.__file__).resolve().parent.parent  # headers and liblcm.so of LCM 1.5.3


def run_in(folder, script):
    """A shell block of the docs, in a folder with proto/ in it."""
    if not (folder / "proto").exists():
        (folder / "proto").symlink_to(SOURCE / "proto")
    environment = {**os.environ, "PATH": f"{Path(LCM_GEN).parent}:{os.environ['PATH']}"}
    subprocess.run(["sh", "-e", "-c", script], cwd=folder, check=True, env=environment)


def check_scans(text):
    lines = [line.split() for line in text.splitlines()]
    assert len(lines) == 20
    return lines


def scans_of(command, environment, column, folder=None):
    """The lines of a bare client, whose robot drove towards the wall: that column is the range
    ahead. One that is held up has twenty scans at once, from before its commands.
    """
    for witness in attempts():
        done = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        assert done.returncode == 0, done.stderr
        said = [line for line in done.stdout.splitlines() if not line.startswith("LCM")]
        lines = check_scans("\n".join(said))
        if float(lines[0][column]) > float(lines[-1][column]) + 0.1:
            return lines
        if not witness.excuses():
            break
    raise AssertionError(done.stdout)


def bare(server, **more):
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    return {**environment, "LCM_DEFAULT_URL": server.url, **more}


def test_python(tmp_path):
    page = blocks("protocol.md")
    run_in(tmp_path, page["bare_python_types"].replace("pip install lcm==1.5.3", "true"))
    (tmp_path / "client.py").write_text(page["bare_python"])
    with ruedo_run("--no-noise", "--disable", "p3at/camera", world=HALL) as server:
        lines = scans_of([sys.executable, "client.py"], bare(server), 2, tmp_path)
    assert all(line[1] == "181" for line in lines)


def c_client(folder, headers, library):
    page = blocks("protocol.md")
    (folder / "client.c").write_text(page["bare_c"])
    flags = f"-Wall -Wextra -Werror -Wno-unused-parameter -I{headers} -I. {library} -Wl,-rpath,{Path(library).parent}"
    run_in(folder, page["bare_c_build"].replace("$(pkg-config --cflags --libs lcm)", flags))


def library_of(version):
    """Headers and library of an LCM; skips where there is none."""
    if version == "1.5.3":
        headers, library = WHEEL / "include", WHEEL / "lib/liblcm.so"
        if not library.exists():
            library = next(WHEEL.glob("**/liblcm.so"))
            headers = next(WHEEL.glob("**/lcm/lcm.h")).parent.parent
    else:
        root = Path(os.environ.get("RUEDO_LCM_131", "/nonexistent"))
        libraries = [
            *root.glob("usr/lib/*/liblcm.so.1.3*"),
            *Path("/usr/lib").glob("*/liblcm.so.1.3*"),
        ]
        if not libraries:
            pytest.skip(
                "no LCM 1.3.1 here: neither liblcm-dev is installed nor could fetch_lcm131.sh get it"
            )
        library = libraries[0]
        headers = root / "usr/include" if root.exists() else Path("/usr/include")
    return headers, library


@pytest.mark.parametrize("version", ["1.5.3", "1.3.1"])
def test_c(tmp_path, version):
    headers, library = library_of(version)
    c_client(tmp_path, headers, library)
    linked = subprocess.run(
        ["ldd", str(tmp_path / "client")], capture_output=True, text=True
    ).stdout
    assert str(library.parent) in linked
    with ruedo_run("--no-noise", "--disable", "p3at/camera", world=HALL) as server:
        lines = scans_of([str(tmp_path / "client")], bare(server), 3)
    assert lines[0][0] == "p3at/lrf" and lines[0][2] == "181"


def test_cpp(tmp_path):
    page = blocks("protocol.md")
    (tmp_path / "client.cpp").write_text(page["bare_cpp"])
    headers, library = library_of("1.5.3")
    flags = f"-Wall -Wextra -Werror -I{headers} {library} -Wl,-rpath,{library.parent}"
    run_in(tmp_path, page["bare_cpp_build"].replace("$(pkg-config --cflags --libs lcm)", flags))
    with ruedo_run("--no-noise", "--disable", "p3at/camera", world=HALL) as server:
        lines = scans_of([str(tmp_path / "client")], bare(server), 3)
    assert lines[0][0] == "p3at/lrf" and lines[0][2] == "181"


def test_java(tmp_path):
    page = blocks("protocol.md")
    (tmp_path / "lcm.jar").symlink_to(WHEEL / "share/java/lcm.jar")
    (tmp_path / "Client.java").write_text(page["bare_java"])
    run_in(tmp_path, page["bare_java_build"])
    with ruedo_run("--no-noise", "--disable", "p3at/camera", world=HALL) as server:
        lines = scans_of(["sh", "-c", page["bare_java_run"]], bare(server), 3, tmp_path)
    assert lines[0][0] == "p3at/lrf" and lines[0][2] == "181"


class Bare:
    """A bus, and the newest message of each kind that was asked for."""

    def __init__(self, url):
        self.bus = lcm.LCM(url)
        self.heard = []

    def listen(self, channel, message):
        subscription = self.bus.subscribe(
            channel, lambda _, data: self.heard.append(message.decode(data))
        )
        subscription.set_queue_capacity(0)  # without an end: one that is late misses none

    def until(self, ready):
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            self.bus.handle_timeout(100)
            if any(ready(message) for message in self.heard):
                return
        pytest.fail(
            f"it did not happen; the last message was {self.heard and vars_of(self.heard[-1])}"
        )

    def command(self, channel, command, taken):
        """Again after some seconds without an effect: a datagram may be lost."""
        deadline = time.monotonic() + PATIENCE
        while not any(taken(message) for message in self.heard):
            assert time.monotonic() < deadline, "it was not taken"
            self.bus.publish(channel, command.encode())
            again = time.monotonic() + 5
            while time.monotonic() < again and not any(taken(message) for message in self.heard):
                self.bus.handle_timeout(100)


def vars_of(message):
    return {name: getattr(message, name) for name in message.__slots__}


def test_the_watchdog_stops_a_command_that_is_not_repeated():
    from ruedo.lcmtypes import motion_status_t, velocity_command_t

    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        bare = Bare(server.url)
        bare.listen("p3at/motion", motion_status_t)
        command = velocity_command_t()
        command.vx = 0.2
        bare.command(
            "p3at/velocity",
            command,
            lambda m: m.kind == m.KIND_VELOCITY and m.state == m.STATE_RUNNING,
        )
        bare.until(lambda m: m.state == m.STATE_ENDED and m.reason == m.REASON_WATCHDOG)
        end = bare.heard[-1].utime
        bare.until(
            lambda m: m.utime > end + 300000
        )  # the terminal hears of it with the next tick, and not again
        output = server.end()
    assert output.count("watchdog") == 1, output  # said once on the terminal


def test_a_primitive_needs_no_repeating():
    from ruedo.lcmtypes import motion_status_t, move_command_t

    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        bare = Bare(server.url)
        bare.listen("p3at/motion", motion_status_t)
        command = move_command_t()
        command.id, command.kind, command.value = 77, move_command_t.ROTATE, 1.0
        bare.command("p3at/move", command, lambda m: m.id == 77)
        bare.until(lambda m: m.id == 77 and m.state == m.STATE_DONE and abs(m.done - 1.0) < 1e-6)


def test_a_refused_primitive_has_a_reason():
    from ruedo.lcmtypes import motion_status_t, move_command_t

    with ruedo_run("--disable", "p3at/camera", world=HALL) as server:
        bare = Bare(server.url)
        bare.listen("p3at/motion", motion_status_t)
        for id, kind, value, reason in (
            (5, move_command_t.ADVANCE, float("nan"), motion_status_t.REASON_NOT_FINITE),
            (6, 99, 1.0, motion_status_t.REASON_BAD_KIND),
        ):
            command = move_command_t()
            command.id, command.kind, command.value = id, kind, value
            refused = (id, motion_status_t.STATE_REFUSED, reason)
            bare.command(
                "p3at/move",
                command,
                lambda m, refused=refused: (m.id, m.state, m.reason) == refused,
            )
