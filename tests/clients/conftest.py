"""What the wire tests share: the programs under test, a port for each server, servers that end with
their test.

Each server has a URL of its own, so that the tests of one file may run beside each other.
"""

from __future__ import annotations

import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

PATIENCE = 400.0  # s, for what comes sooner or later, on a machine that does much else too
HERE = Path(__file__).resolve().parent
SOURCE = Path(os.environ.get("RUEDO_SOURCE_DIR", HERE.parent.parent))
BUILD = Path(os.environ.get("RUEDO_BUILD_DIR", SOURCE / "build/release"))
RUEDO = os.environ.setdefault("RUEDO", str(BUILD / "bin/ruedo"))
os.environ["PYTHONPATH"] = f"{BUILD / 'python'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
sys.path.insert(0, str(BUILD / "python"))
sys.path.insert(0, str(HERE.parent))  # witness.py
sys.path.insert(0, str(HERE / "peers"))
ARENA = str(SOURCE / "worlds/arena.sdf")
HALL = str(HERE / "hall.sdf")

PROBES = {"python": [sys.executable, str(HERE / "probe/probe.py")]}
if "RUEDO_PROBE_CPP" in os.environ:
    PROBES["cpp"] = [os.environ["RUEDO_PROBE_CPP"]]
if "RUEDO_PROBE_JAVA" in os.environ:
    PROBES["java"] = [
        "java",
        "-Xshare:auto",
        "-XX:TieredStopAtLevel=1",
        "-cp",
        f"{BUILD}/java/ruedo.jar:{os.environ['RUEDO_PROBE_JAVA']}",
        "Probe",
    ]

# The probes of tests/clients/api_test.py.
APIS = {"python": [sys.executable, str(HERE / "probe/api.py")]}
if "RUEDO_API_CPP" in os.environ:
    APIS["cpp"] = [os.environ["RUEDO_API_CPP"]]
if "java" in PROBES:
    APIS["java"] = [*PROBES["java"][:-1], "Api"]

CLIENT = os.environ.get("RUEDO_CLIENT", "")  # the language that is tested; "": each
# In these the one alone that this says, where it says one.
LONG = ("behind_test", "endings_test", "hostile_test", "rivals_test")
CLIENT_OF_LONG = os.environ.get("RUEDO_CLIENT_OF_LONG_TESTS", "")


def chosen(programs: dict[str, list[str]]) -> dict[str, list[str]]:
    """Of programs by language those that are tested."""
    return {key: words for key, words in programs.items() if CLIENT in ("", key)}


_taken: list[socket.socket] = []
_ports = itertools.count(20_000 + os.getpid() % 10_000)


def heed_ctrl_c() -> None:
    """For a child process: a shell that starts tests in the background makes it ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def free_url() -> str:
    """A multicast URL on a port of its own, kept from others for the life of the test program. It
    lies below those that sockets without a port of their own get (32768 on): one that sends from it
    would keep receivers out.
    """
    while True:
        port = next(_ports)
        token = socket.socket()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                token.bind(("127.0.0.1", port))
                probe.bind(("", port))
            except OSError:
                token.close()
                continue
        _taken.append(token)
        return f"udpm://239.255.76.67:{port}?ttl=0"


class Server:
    """`ruedo run`, or another program that serves a URL; ends with the with-block."""

    def __init__(self, command: list[str], url: str):
        self.url = url
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self) -> str:
        """Its output."""
        if self.process.poll() is None:
            self.process.terminate()
        try:
            return self.process.communicate(timeout=PATIENCE)[0]
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.communicate()[0]


def ruedo_run(*args: str, world: str = ARENA, url: str | None = None) -> Server:
    url = url or free_url()
    server = Server([RUEDO, "run", world, "--lcm", url, *args], url)
    import ruedo

    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            ruedo.connect(url).close()
            return server
        except ruedo.NoServer:
            if server.process.poll() is not None or time.monotonic() > deadline:
                pytest.fail(f"the server did not come up: {server.end()}")


def tcp_server(*args: str, world: str = HALL) -> Server:
    """`ruedo run` over TCP."""
    url = free_url().replace("udpm://239.255.76.67", "tcpq://127.0.0.1").replace("?ttl=0", "")
    _taken.pop().close()  # the token: the server itself listens there
    return ruedo_run(*args, world=world, url=url)


class Said:
    """What a probe printed: the words behind each first word."""

    def __init__(self, text: str, errors: str = ""):
        self.text = text
        self.errors = errors
        self.lines = [line.split(" ", 1) for line in text.splitlines() if line]

    def all(self, key: str) -> list[str]:
        return [line[1] for line in self.lines if line[0] == key and len(line) == 2]

    def one(self, key: str) -> str:
        found = self.all(key)
        assert len(found) == 1, (
            f"{len(found)} lines begin with {key!r} in:\n{self.text}\n{self.errors}"
        )
        return found[0]

    def words(self, key: str) -> list[str]:
        return self.one(key).split()

    def numbers(self, key: str) -> list[float]:
        return [float(word) for word in self.words(key)]


def probe(language: str, url: str, *command: str, timeout: float = PATIENCE) -> Said:
    done = subprocess.run(
        [*PROBES[language], url, *command], capture_output=True, text=True, timeout=timeout
    )
    said = Said(done.stdout, done.stderr)
    if (
        "Traceback" in done.stderr
        or "Exception in thread" in done.stderr
        or (done.returncode and not said.all("failed"))
    ):
        pytest.fail(f"the {language} probe broke: {done.stdout}\n{done.stderr}")
    return said


@pytest.fixture(params=list(chosen(PROBES)))
def language(request: pytest.FixtureRequest) -> str:
    if request.module.__name__ in LONG and CLIENT_OF_LONG not in ("", request.param):
        pytest.skip(f"of {CLIENT_OF_LONG} alone; of each language in nightly runs")
    return request.param


@pytest.fixture(scope="session", autouse=True)
def needs_ruedo() -> None:
    if not shutil.which(RUEDO):
        pytest.fail(f"{RUEDO} is not built")
