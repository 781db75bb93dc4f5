"""launch(): a private server that ends with its client, however that ends."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from conftest import HERE, PATIENCE, PROBES, heed_ctrl_c, probe

HALL = str(HERE / "hall.sdf")


def servers_of(url):
    """Process ids of the programs that have the URL in their command line; another network's ports
    are others.
    """
    found, network = [], os.readlink("/proc/self/ns/net")
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().decode(errors="replace").split("\0")
            if url in words and os.readlink(folder / "ns/net") != network:
                continue
            state = (folder / "stat").read_text().rsplit(")", 1)[1].split()[0]
        except OSError:
            continue
        if url in words and state != "Z":
            found.append(int(folder.name))
    return found


def gone(url, seconds=PATIENCE):
    deadline = time.monotonic() + seconds
    while servers_of(url) and time.monotonic() < deadline:
        time.sleep(0.02)
    return not servers_of(url)


def start(language):
    """A probe that has launched a server, and the server's URL."""
    client = subprocess.Popen(
        [*PROBES[language], "-", "launch", HALL, "--disable", "p3at/camera"],
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=heed_ctrl_c,
    )
    url = client.stdout.readline().split()[1]
    assert client.stdout.readline().split() == ["ready", "True"]
    return client, url


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_the_server_ends_with_its_client(language, end):
    client, url = start(language)
    try:
        assert len(servers_of(url)) == 1
        client.send_signal(end)
        client.wait(PATIENCE)
        assert gone(url)
        assert not Path(url.removeprefix("unix://")).parent.exists()
    finally:
        client.kill()
        client.wait()


def test_the_terminals_signals_are_not_the_servers(language):
    """A client may still need it when Ctrl-C ends the client."""
    client, url = start(language)
    try:
        [server] = servers_of(url)
        assert os.getsid(server) == server != os.getsid(client.pid)
    finally:
        client.kill()
        client.wait()


@pytest.mark.parametrize("end", ["", "os.kill(os.getpid(), 9)"])
def test_a_worlds_text_goes_with_its_server(end):
    program = (
        f"import os, ruedo; print(ruedo.launch(text=open({HALL!r}).read()).url, flush=True); {end}"
    )
    with tempfile.TemporaryDirectory() as folder:  # of a short path, as sockets need it
        done = subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "XDG_RUNTIME_DIR": folder, "TMPDIR": folder},
            stdout=subprocess.PIPE,
            text=True,
            timeout=PATIENCE,
        )
        assert done.stdout.startswith(f"unix://{folder}/ruedo-")
        assert gone(done.stdout.strip()) and not os.listdir(folder)


def test_two_launches_do_not_meet(language):
    first, url = start(language)
    second, other = start(language)
    try:
        assert url != other and url.startswith("unix:///") and other.startswith("unix:///")
    finally:
        for client in (first, second):
            client.kill()
            client.wait()
    assert gone(url) and gone(other)


def test_the_error_has_the_servers_message(language, tmp_path):
    wrong = tmp_path / "wrong.sdf"
    wrong.write_text("<sdf version='1.9'>\n<world name='w'>\n")
    said = probe(language, "-", "launch", str(wrong)).one("failed")
    assert said.startswith("LaunchError: the server ended (exit code 3)") and "wrong.sdf:" in said


def test_the_program_is_looked_for(language, monkeypatch):
    monkeypatch.setenv("RUEDO", "/no/such/program")
    assert (
        probe(language, "-", "launch", HALL)
        .one("failed")
        .startswith("LaunchError: the environment's RUEDO is '/no/such/program'")
    )


def test_python_closes_it_at_the_end_of_the_block():
    import ruedo

    with ruedo.launch(HALL, seed=5, rate="max", args=["--disable", "p3at/camera"]) as sim:
        assert sim.seed == 5 and len(servers_of(sim.url)) == 1
        url = sim.url
    assert gone(url, 0.0)


def test_python_in_a_thread_that_ends():
    """PR_SET_PDEATHSIG would end the server with the thread."""
    import threading

    import ruedo

    made = []
    thread = threading.Thread(
        target=lambda: made.append(ruedo.launch(HALL, args=["--disable", "p3at/camera"]))
    )
    thread.start()
    thread.join()
    with made[0] as sim:
        times = [sim.robots[0].odometry.next().time for _ in range(30)]
        assert times == sorted(set(times))


def test_a_server_that_dies_is_reported():
    import ruedo

    with ruedo.launch(HALL, args=["--disable", "p3at/camera"]) as sim:
        os.kill(servers_of(sim.url)[0], signal.SIGKILL)
        with pytest.raises(ruedo.NoServer, match="the server ended \\(signal SIGKILL\\)"):
            for _ in range(1000):
                sim.robots[0].lrf.next(PATIENCE)


@pytest.mark.parametrize("as_text", [False, True])
def test_arguments_are_the_same_words_in_every_language(language, as_text):
    world = [HALL] if not as_text else ["", Path(HALL).read_text()]
    said = probe(language, "-", "launch_with", *world)
    assert said.words("robots") == ["p3at", "guest"] and said.one("seed") == "5"
    assert "lrf" in said.words("devices") and "camera" not in said.words("devices")
    assert said.numbers("rate") == [20.0]
    count, ahead = said.numbers("scans")
    assert count == 3  # at 0, 0.05 and 0.1 s
    python = probe("python", "-", "launch_with", *world)
    assert ahead == pytest.approx(python.numbers("scans")[1], abs=1e-5)


@pytest.mark.parametrize(
    "words, suggestion",
    [
        (["--set", "p3at/lrf.update_rat=20"], "did you mean 'update_rate'?"),
        (["--disable", "p3at/camra"], "did you mean 'camera'?"),
        (["--lockstpe", "1"], "did you mean '--lockstep'?"),
    ],
)
def test_an_unknown_option_is_an_error_with_a_suggestion(language, words, suggestion):
    failed = probe(language, "-", "launch", HALL, *words).one("failed")
    assert failed.startswith("LaunchError: ") and suggestion in failed


def test_a_world_or_its_text_is_needed(language):
    if language == "python":  # there it is a TypeError
        return
    failed = probe(language, "-", "launch_with", "").one("failed")
    assert failed == "LaunchError: launch() needs either a world or its text"
