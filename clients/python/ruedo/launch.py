"""launch(): a private server on a free port, which ends when its client does, however that ends.

The server watches its standard input (--watch-stdin) and ends when the pipe closes: the kernel closes it
for a client that was killed, too, and it works from any thread of a notebook, as PR_SET_PDEATHSIG does not.
"""

from __future__ import annotations

import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from urllib.parse import urlsplit
from typing import IO, Sequence

from .address import has_multicast_route
from .errors import LaunchError, NoServer
from .simulation import Simulation


def find_ruedo() -> str:
    """The ruedo program: RUEDO, else PATH, else the bin/ or build/*/bin/ of a folder above this package."""
    named = os.environ.get("RUEDO")
    if named:
        if not os.access(named, os.X_OK) or os.path.isdir(named):
            raise LaunchError(f"the environment's RUEDO is {named!r}, which is no program")
        return named
    found = shutil.which("ruedo")
    if found:
        return found
    for folder in Path(__file__).resolve().parents:
        for candidate in [folder / "bin/ruedo", *sorted(folder.glob("build/*/bin/ruedo")), folder / "build/bin/ruedo"]:
            if candidate.is_file() and os.access(candidate, os.X_OK):
                return str(candidate)
    raise LaunchError("the program `ruedo` was not found: not in RUEDO, not on the PATH, not built beside this package "
                      "(`scripts/run` builds it)")


def launch(world: str | os.PathLike[str], *, seed: int | None = None, rate: float | str | None = None,
           args: Sequence[str] = (), url: str | None = None, name: str = "client", timeout: float = 30.0,
           verbose: bool = False) -> Simulation:
    """Starts `ruedo run WORLD` and joins it.

    rate: sim time per real time, "max" or math.inf: as fast as it goes; None: real time. args: further options
    of `ruedo run`, such as ["--spawn", "p3at@0,0"]. url: None takes a free port of this machine. name: of this
    client. timeout: s of real time until the world is loaded. verbose: show what the server prints (else it
    is shown in the errors alone). Raises LaunchError with what the server said.
    """
    program = find_ruedo()
    token = None
    if url is None:
        token, url = _free_url()
    command = [program, "run", os.fspath(world), "--lcm", url, "--watch-stdin"]
    if seed is not None:
        command += ["--seed", str(seed)]
    if rate is not None:
        command += ["--rate", "max" if rate == "max" or rate == math.inf else str(rate)]
    server = _Server(command + list(args), token, verbose)
    try:
        until = time.monotonic() + timeout
        server.await_port(url, until)
        return Simulation(url, name, max(until - time.monotonic(), 1.0), server.ended, server.end)
    except NoServer as error:    # with what the server said, when it ended
        server.end()
        raise LaunchError(str(error)) from None
    except BaseException:
        server.end()
        raise


def _free_url() -> tuple[socket.socket, str]:
    """A URL that nothing else uses. The TCP socket on the same port, kept open, is the token by which launches of
    any process, in any language, stay apart from each other."""
    for _ in range(100):
        token = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        token.bind(("127.0.0.1", 0))
        port = token.getsockname()[1]
        if not has_multicast_route():
            token.close()    # the server itself will listen on it
            _say_once(f"ruedo: no multicast route here: launch() speaks LCM over TCP, LCM_DEFAULT_URL=tcpq://127.0.0.1:{port}")
            return token, f"tcpq://127.0.0.1:{port}"
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("0.0.0.0", port))    # exclusive: fails when any LCM program uses the port
            except OSError:
                token.close()
                continue
        return token, f"udpm://239.255.76.67:{port}?ttl=0"
    raise LaunchError("no free UDP port was found in 100 tries")


_said = False


def _say_once(line: str) -> None:
    global _said
    if not _said:
        print(line, file=sys.stderr)
    _said = True


class _Server:
    """The server process."""

    def __init__(self, command: list[str], token: socket.socket | None, verbose: bool):
        self._command = command
        self._token = token
        self._output: IO[bytes] | None = None if verbose else tempfile.TemporaryFile()
        try:
            # A session of its own: Ctrl-C in a terminal reaches the client alone, which may still use the server.
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=self._output,
                                             stderr=subprocess.STDOUT if self._output else None, start_new_session=True)
        except OSError as error:
            raise LaunchError(f"{command[0]} cannot be started: {error.strerror}") from None

    def ended(self) -> str | None:
        """How the server ended, with the last lines it printed; None while it runs."""
        code = self._process.poll()
        if code is None:
            return None
        how = f"exit code {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"
        return f"the server ended ({how}): {self._last_lines() or 'it said nothing'}\n(`{' '.join(self._command)}`)"

    def await_port(self, url: str, until: float) -> None:
        """Waits for a tcpq server to listen; one that does not until then is the connection's affair."""
        parts = urlsplit(url)
        if parts.scheme != "tcpq":
            return
        while time.monotonic() < until and self._process.poll() is None:
            try:
                socket.create_connection((parts.hostname or "127.0.0.1", parts.port or 7700), 1.0).close()
                return
            except OSError:
                time.sleep(0.02)
        ended = self.ended()
        if ended:
            raise NoServer(ended)

    def end(self) -> None:
        """Closes the pipe, which ends the server; kills it when it has not ended after 5 s."""
        if self._process.stdin and not self._process.stdin.closed:
            self._process.stdin.close()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._token:
            self._token.close()

    def _last_lines(self) -> str:
        if self._output is None:
            return ""
        end = self._output.seek(0, os.SEEK_END)
        self._output.seek(max(0, end - 4000))
        return "\n".join(self._output.read().decode(errors="replace").strip().splitlines()[-12:])
