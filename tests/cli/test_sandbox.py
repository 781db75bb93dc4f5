"""--sandbox: a stranger's world or log reaches what it may, and nothing else; the results are the
same.
"""

import os
import shutil
import socket
import subprocess
import time
from pathlib import Path

import pytest

RUEDO = os.environ["RUEDO"]
ROOT = Path(os.environ["RUEDO_SOURCE_DIR"])
CUBE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
WORLD = """<sdf version='1.9'><world name='w'>
<include><uri>model://p3at</uri></include>
<model name='m'><static>true</static><pose>3 0 0 0 0 0</pose><link name='l'><collision name='c'><geometry><mesh><uri>{mesh}</uri></mesh></geometry></collision></link></model>
</world></sdf>"""


@pytest.fixture
def place(tmp_path):
    """A folder of a world and its model, with an empty cache; a mesh elsewhere."""
    for folder in ("world/models/cube", "elsewhere", "out", "cache"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "world/models/cube/cube.obj").write_text(CUBE)
    (tmp_path / "elsewhere/cube.obj").write_text(CUBE)
    (tmp_path / "world/good.sdf").write_text(WORLD.format(mesh="model://cube/cube.obj"))
    (tmp_path / "world/far.sdf").write_text(
        WORLD.format(mesh=f"file://{tmp_path}/elsewhere/cube.obj")
    )
    return tmp_path


def ruedo(place, *arguments):
    environment = {**os.environ, "XDG_CACHE_HOME": str(place / "cache")}
    return subprocess.run(
        [RUEDO, *map(str, arguments)], capture_output=True, text=True, env=environment, timeout=300
    )


def run(place, log, *arguments, world="good.sdf"):
    address = f"unix://{place}/out/{log}.socket"
    return ruedo(
        place,
        "run",
        place / "world" / world,
        "--quiet",
        "--rate",
        "max",
        "--duration",
        "1",
        "--lcm",
        address,
        "--record",
        place / "out" / log,
        *arguments,
    )


def messages(log):
    """All bytes but those of the header, which names the run."""
    return log.read_bytes()[-200_000:]


def test_a_run_is_the_same_within(place):
    free = run(place, "free.log")
    assert free.returncode == 0 and "mesh" not in free.stderr, free
    shutil.rmtree(place / "cache")
    (place / "cache").mkdir()
    walled = run(place, "walled.log", "--sandbox")
    assert walled.returncode == 0 and "mesh" not in walled.stderr, (
        walled
    )  # imported by a child within
    assert messages(place / "out/free.log") == messages(place / "out/walled.log")
    for command in (["verify"], ["export"]):
        done = ruedo(
            place,
            *command,
            place / "out/walled.log",
            *([place / "out/a.mcap"] if command == ["export"] else []),
        )
        assert done.returncode == 0, done


def test_files_elsewhere_are_out_of_reach(place):
    free = run(place, "free.log", "--allow-absolute", world="far.sdf")
    assert free.returncode == 0 and "cube.obj" not in free.stderr, free
    walled = run(place, "walled.log", "--allow-absolute", "--sandbox", world="far.sdf")
    assert walled.returncode == 0 and "Permission denied" in walled.stderr, walled
    checked = ruedo(place, "check", place / "world/far.sdf", "--allow-absolute", "--sandbox")
    assert checked.returncode == 1 and "Permission denied" in checked.stdout, checked


def test_it_draws_and_views(place):
    """Cameras need a renderer's libraries, the console a socket."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    done = ruedo(
        place,
        "run",
        ROOT / "worlds/arena.sdf",
        "--sandbox",
        "--rate",
        "max",
        "--duration",
        "0.3",
        "--lcm",
        f"unix://{place}/out/a.socket",
        "--view",
        f"127.0.0.1:{port}",
    )
    assert done.returncode == 0 and "renderer" not in done.stderr, done


def test_a_xacro_file_is_expanded_within(place):
    """The interpreter may lie in the home."""
    robot = place / "world/r.urdf.xacro"
    robot.write_text("<robot name='r' xmlns:xacro='x'><link name='l${1 + 1}'/></robot>")
    checked = ruedo(place, "check", robot, "--sandbox")
    assert checked.returncode == 0, checked


def statuses(process):
    """Of all its threads."""
    return [task.read_text() for task in Path(f"/proc/{process}/task").glob("*/status")]


def is_confined(status):
    return "NoNewPrivs:\t1\n" in status and "Seccomp:\t2\n" in status


def until(condition):
    deadline = time.monotonic() + 400
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def threads_of_the_importer(process, mesh):
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    for child in children:
        try:
            words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
            if words[0].endswith(b"ruedo-import-mesh") and os.fsencode(mesh) in words:
                return statuses(child)
        except OSError:  # it has ended
            pass
    return []


@pytest.mark.parametrize("options", [[], ["--sandbox"]])
def test_all_threads_are_within(place, options):
    """Of the program, which shows on a terminal how far it is from the very start, and of the
    importer: always. The mesh is large, so that they can be looked at meanwhile.
    """
    mesh = place / "world/models/cube/cube.obj"
    with mesh.open("w") as file:
        file.writelines(f"v {i % 700} {i // 700} {i % 13}\n" for i in range(490_000))
        file.writelines(f"f {i} {i + 1} {i + 700}\n" for i in range(1, 489_000))
    command = [RUEDO, "check", place / "world/good.sdf", *options]
    environment = {**os.environ, "XDG_CACHE_HOME": str(place / "cache")}
    terminal, end = os.openpty()
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=end, env=environment
    ) as process:
        try:
            until(
                lambda: (
                    (threads := threads_of_the_importer(process.pid, mesh))
                    and all(map(is_confined, threads))
                )
            )
            own = statuses(process.pid)
            assert len(own) > 1 and all(is_confined(one) == bool(options) for one in own), own
        finally:
            process.kill()
            os.close(terminal)
            os.close(end)


def test_the_doctor_reports_it(place):
    assert "sandbox" in ruedo(place, "doctor").stdout
