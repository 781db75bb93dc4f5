"""The local socket: its owner, and that all three libraries see the same as over multicast."""

import os
import shutil
import signal
import socket
import stat
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from conftest import HERE, PATIENCE, PROBES, RUEDO, probe, ruedo_run

# isort: split
from fake_server import info
from lying_stream import HELLO, frame

HALL = str(HERE / "hall.sdf")
STEPS = 300


def lockstep(language, url=None):
    with ruedo_run(
        "--lockstep", "1", "--lease", str(PATIENCE), "--disable", "p3at/camera", world=HALL, url=url
    ) as server:
        return probe(
            language, server.url, "lockstep", "client0", "p3at", str(STEPS), "1", "0.2"
        ).words("end")


def test_lockstep_is_the_same_as_over_multicast(language, tmp_path):
    end = lockstep(language, f"unix://{tmp_path}/bus")
    assert end[0] == str(STEPS) and end == lockstep(language)


def test_a_socket_without_a_server_is_reported(language, tmp_path):
    said = probe(language, f"unix://{tmp_path}/nobody", "connect").one("failed")
    assert said.startswith(f"NoServer: no Ruedo server at unix://{tmp_path}/nobody")


@pytest.fixture
def anothers_socket():
    """At which another user listens, in a folder where all may write."""
    if os.geteuid() != 0:
        pytest.skip("only root can be somebody else")
    folder = tempfile.mkdtemp()
    os.chmod(folder, 0o777)
    path, (ready, tell) = f"{folder}/bus", os.pipe()
    stranger = os.fork()
    if stranger == 0:
        try:
            os.setgid(65534)
            os.setuid(65534)
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
                listener.bind(path)
                os.chmod(path, 0o777)
                listener.listen()
                os.write(tell, b"ready")
                signal.pause()
        finally:
            os._exit(1)
    os.close(tell)
    try:
        if os.read(ready, 5) != b"ready":
            pytest.skip("this namespace has no other user")
        yield path
    finally:
        os.close(ready)
        os.kill(stranger, signal.SIGKILL)
        os.waitpid(stranger, 0)
        shutil.rmtree(folder)


def test_another_users_server_is_refused(language, anothers_socket):
    said = probe(language, f"unix://{anothers_socket}", "connect").one("failed")
    assert said.startswith("NoServer") and "served by another user" in said


@pytest.fixture(params=["then stops", "begins late"])
def stopped_server(tmp_path, request):
    """Where: it greets one client, then stops, with room for one connection that waits. One that
    begins late has that place taken.
    """
    greeted = []

    def greet(listener):
        if request.param == "begins late":
            waiting = socket.socket(socket.AF_UNIX)
            waiting.connect(listener.getsockname())
            time.sleep(2.0)
            waiting.close()
        while not greeted:
            client = listener.accept()[0]
            if client.recv(1):  # a silent connection only checked for a server
                client.sendall(HELLO + frame("ruedo/info", info([]).encode()))
                greeted.append(client)

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(f"{tmp_path}/bus")
        listener.listen(0)
        threading.Thread(target=greet, args=(listener,), daemon=True).start()
        yield f"unix://{tmp_path}/bus"


def test_a_stopped_server_is_waited_for(language, stopped_server):
    """However many looks at whether it is there its queue keeps."""
    said = probe(language, stopped_server, "streams", "p3at", "7", "7")
    assert said.one("lrf").startswith("Timeout: "), said.text
    assert said.one("odometry").startswith("Timeout: "), said.text


def test_launch_takes_a_socket_of_its_own():
    import ruedo

    with ruedo.launch(HALL, args=["--disable", "p3at/camera"], rate="max") as sim:
        address = urlsplit(sim.url)
        assert address.scheme == "unix"
        path = Path(address.path)
        assert (
            stat.S_IMODE(path.stat().st_mode) == 0o600
            and stat.S_IMODE(path.parent.stat().st_mode) == 0o700
        )
        sim.robot("p3at").pose.next()
        hz = [RUEDO, "hz", "p3at/pose", "--lcm", sim.url, "-n", "1"]
        heard = ""
        while "Hz" not in heard:  # a busy machine may spend that second elsewhere
            heard = subprocess.run(hz, stdout=subprocess.PIPE, text=True, timeout=PATIENCE).stdout
        told = subprocess.run(
            [RUEDO, "run", HALL, "--lcm", sim.url], capture_output=True, text=True, timeout=PATIENCE
        )
        assert told.returncode == 4 and "is taken by another server" in told.stderr
    assert not path.parent.exists()


def test_a_server_that_comes_back_is_heard_again(language, tmp_path):
    """At the same path, where the one before, killed, has left its socket; by the same client."""
    quick = {"world": HALL, "url": f"unix://{tmp_path}/bus"}
    with ruedo_run("--disable", "p3at/camera", **quick) as server:
        client = subprocess.Popen(
            [*PROBES[language], server.url, "heard_again", "p3at"],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert client.stdout.readline() == "heard first\n"
        server.process.kill()
        server.process.wait()
        assert os.path.exists(f"{tmp_path}/bus")
        with ruedo_run("--disable", "p3at/camera", **quick):
            assert client.communicate(timeout=PATIENCE)[0] == "heard again\n"
