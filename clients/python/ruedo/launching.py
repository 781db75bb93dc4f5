"""launch(): a private server on a free port, which ends when its client does, however that ends.

The server watches its standard input (--follow-stdin) and ends when the pipe closes: the kernel
closes it for a client that was killed, too, and it works from any thread of a notebook, as
PR_SET_PDEATHSIG does not.
"""

from __future__ import annotations

import contextlib
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal

from . import arguments
from .errors import LaunchError, NoServer, for_terminal
from .transport.address import has_multicast_route, read_address
from .transport.stream import is_served
from .world import World

if TYPE_CHECKING:
    from .simulation import Simulation

_MOST_HEARD = 1 << 16  # bytes of warnings that are read at once
_MOST_WARNED = 1000  # warnings, each of which is printed once


def find_ruedo() -> str:
    """The ruedo program: RUEDO, else that of the installation which this package belongs to, else
    PATH, else one built in a folder above this package."""
    named = os.environ.get("RUEDO")
    if named:
        if not os.access(named, os.X_OK) or os.path.isdir(named):
            raise LaunchError(f"the environment's RUEDO is {named!r}, which is not a program")
        return os.path.abspath(named)  # it may be started from another folder
    above = Path(__file__).resolve().parents
    for candidate in (folder / "bin/ruedo" for folder in above):
        if _is_program(candidate):
            return str(candidate)
    found = shutil.which("ruedo")
    if found:
        return found
    for folder in above:
        for candidate in [*sorted(folder.glob("build/*/bin/ruedo")), folder / "build/bin/ruedo"]:
            if _is_program(candidate):
                return str(candidate)
    raise LaunchError(
        "the program `ruedo` was not found: not in RUEDO, not beside this package, not on the PATH "
        "(`pip install` of Ruedo's wheel brings it, `scripts/run` builds it)"
    )


def _is_program(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)


@arguments.options(set="settings")
def launch(
    world: str | os.PathLike[str] | World | None = None,
    *,
    seed: int | None = None,
    rate: float | Literal["max"] | None = None,
    args: Sequence[str] = (),
    url: str | None = None,
    name: str = "client",
    timeout: float = 30.0,
    verbose: bool = False,
    text: str | None = None,
    lockstep: int | bool = 0,
    spawn: Sequence[str] = (),
    disable: Sequence[str] = (),
    settings: Mapping[str, object] | None = None,
    noise: bool = True,
    view: bool = False,
    duration: float | None = None,
    paused: bool = False,
    record: str | os.PathLike[str] | None = None,
    snapshots: str | os.PathLike[str] | None = None,
    drive: Sequence[str] = (),
    fault: Sequence[str] = (),
    plugin: Sequence[str | os.PathLike[str]] = (),
    wait_for: Sequence[str] = (),
) -> Simulation:
    """Starts `ruedo run WORLD` and joins it.

    world: a file, the name of one that comes with Ruedo or lies in a folder of RUEDO_PATH
    ("arena"), or a World; text: the world's SDF or URDF itself instead. rate: sim time per real
    time, "max" or math.inf: as fast as it goes; None: real time. lockstep: how many clients the run
    waits for (True: for this one). spawn: models as "p3at@0,0" or "p3at:NAME@X,Y,YAW". disable:
    devices that are left out, "p3at/camera". settings: {"p3at/lrf.rate": 20}. noise: False gives
    ideal values. duration: s of sim time after which the run ends. paused: it starts so, at step 0.
    record: the file of a log. snapshots: the folder for snapshot() and restore(). drive: drives by
    wheel joints, "rover=left_joint,right_joint". fault: what goes wrong, "p3at/lrf:freeze@3".
    plugin: shared libraries with sensors or drives. wait_for: inputs that the run waits for where a
    command is due, "p3at/velocity@10". args: further options of `ruedo run`. url: None takes a
    local socket, which no other user of the machine reads, and plain LCM programs do not know;
    "auto" a free port for LCM. name: of this client. timeout: s of real time until the world is
    loaded. verbose: show what the server prints (else it is shown in the errors alone). view: the
    web console, which show() of the simulation opens. Raises LaunchError with what the server said.
    """
    timeout = arguments.number("timeout", timeout)
    name = arguments.client_name(name)
    options = _options(seed, rate, args, lockstep, spawn, disable, settings, noise)
    options += _more_options(duration, paused, record, snapshots)
    options += _repeated(drive=drive, fault=fault, plugin=plugin, wait_for=wait_for)
    options += ["--allow-absolute"] * isinstance(world, World)  # this program chose its files
    port = _free_port() if view else 0
    options += ["--view", str(port)] if port else []
    program = find_ruedo()
    file, folder = _world_file(world, text)
    url, token = _address(url)
    options += _temporary(folder, token)
    server = _Server(
        [program, "run", file, "--lcm", url, "--follow-stdin", *options], token, verbose, folder
    )
    page = f"http://127.0.0.1:{port}/" if port else None
    return _joined(server, url, name, timeout, page)


def _joined(server: _Server, url: str, name: str, timeout: float, page: str | None) -> Simulation:
    """Joins the server; ends it if that fails. Raises LaunchError with the server's output."""
    until = time.monotonic() + timeout
    try:
        from .simulation import Simulation  # NumPy is loaded while the server loads the world

        server.await_port(url, until)
        return Simulation(url, name, max(until - time.monotonic(), 1.0), server, view=page)
    except NoServer as error:
        server.end()
        raise LaunchError(str(error)) from None
    except BaseException:
        server.end()
        raise


def _repeated(**lists: Sequence[str | os.PathLike[str]]) -> list[str]:
    """An option for each element of these lists."""
    options: list[str] = []
    for option, several in lists.items():
        _check_list(option, several)
        for one in several:
            options += [f"--{option.replace('_', '-')}", os.fspath(one)]
    return options


def _world_file(
    world: str | os.PathLike[str] | World | None, text: str | None
) -> tuple[str, tempfile.TemporaryDirectory[str] | None]:
    """The file to run, and the folder that is made for it where the world is a text."""
    if (world is None) == (text is None):
        raise TypeError("launch() needs either a world or its text")
    if isinstance(world, World):
        text = str(world)
    elif world is not None:
        if not isinstance(world, (str, os.PathLike)):
            raise TypeError(
                f"world is a file, the name of a world or a World, not {arguments.shown(world)}"
            )
        return os.fspath(world), None
    text = arguments.text("text", text)
    with _room_for_files():
        folder = tempfile.TemporaryDirectory(prefix="ruedo-")
    kind = "urdf" if "<robot" in text and "<sdf" not in text else "sdf"
    file = Path(folder.name, f"world.{kind}")
    file.write_text(text, encoding="utf-8")
    return str(file), folder


def _address(url: str | None) -> tuple[str, socket.socket | _Folder | None]:
    """The server's address, and the socket that reserves it until the server listens."""
    if url == "auto":
        token, url = _free_url()
        return url, token
    if url is not None:
        return url, None
    with _room_for_files():
        folder = _Folder()
    return f"unix://{folder.path}/bus", folder


@contextlib.contextmanager
def _room_for_files() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise LaunchError(
            f"no temporary file can be made: {error.strerror}; let TMPDIR name a folder that is writable"
        ) from None


def _temporary(
    folder: tempfile.TemporaryDirectory[str] | None, token: socket.socket | _Folder | None
) -> list[str]:
    """Options: what goes with the server, even where this process is killed."""
    folders = [folder.name] if folder else []
    folders += [token.path] if isinstance(token, _Folder) else []
    return [word for path in folders for word in ("--temporary", path)]


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


def _check_list(name: str, several: Any) -> None:
    if isinstance(several, (str, bytes)):
        raise TypeError(
            f"{name} is {arguments.shown(several)}: it must be a list, {name}={str(several).split()!r}"
        )
    if not isinstance(several, Iterable):
        raise TypeError(f"{name} is a list of texts, not {arguments.shown(several)}")
    for one in several:
        if not isinstance(one, (str, os.PathLike)):
            raise TypeError(f"{name} is a list of texts; {arguments.shown(one)} is not a text")


def _more_options(
    duration: float | None,
    paused: bool,
    record: str | os.PathLike[str] | None,
    snapshots: str | os.PathLike[str] | None,
) -> list[str]:
    """Options of `ruedo run`."""
    options = ["--paused"] * arguments.switch("paused", paused)
    if duration is not None:
        options += ["--duration", str(arguments.finite("duration", duration, 0.0))]
    for name, place in (("record", record), ("snapshots", snapshots)):
        if place is not None:
            options += [f"--{name}", arguments.path(name, place)]
    return options


def _options(
    seed: int | None,
    rate: float | str | None,
    args: Sequence[str],
    lockstep: int | bool,
    spawn: Sequence[str],
    disable: Sequence[str],
    settings: Mapping[str, object] | None,
    noise: bool,
) -> list[str]:
    """Options of `ruedo run`."""
    for name, several in (("args", args), ("spawn", spawn), ("disable", disable)):
        _check_list(name, several)
    if settings is not None and not isinstance(settings, Mapping):
        raise TypeError(
            f"settings is {arguments.shown(settings)}: it must be a dict, such as {{'p3at/lrf.rate': 20}}"
        )
    options = []
    if seed is not None:
        options += ["--seed", str(arguments.whole("seed", seed, 0, arguments.MOST_SEED))]
    if rate is not None:
        options += ["--rate", "max" if rate == "max" or rate == math.inf else str(rate)]
    if lockstep:
        options += ["--lockstep", str(arguments.whole("lockstep", lockstep))]
    for model in spawn:
        options += ["--spawn", model]
    for device in disable:
        options += ["--disable", device]
    for key, value in (settings or {}).items():
        options += ["--set", f"{key}={str(value).lower() if isinstance(value, bool) else value}"]
    if not arguments.switch("noise", noise):
        options.append("--no-noise")
    return options + list(args)


class _Folder:
    """A folder for the socket, which no other user may enter."""

    def __init__(self) -> None:
        runtime = os.environ.get("XDG_RUNTIME_DIR", "")
        for folder in (runtime, "/tmp", tempfile.gettempdir()):
            # A socket's path has 99 bytes at most.
            if 0 < len(folder) < 60 and os.access(folder, os.W_OK | os.X_OK):
                break
        self.path = tempfile.mkdtemp(prefix="ruedo-", dir=folder)

    def close(self) -> None:
        shutil.rmtree(self.path, ignore_errors=True)


def _free_url() -> tuple[socket.socket, str]:
    """A URL that nothing else uses. The TCP socket on the same port, kept open, is the token by
    which launches of any process, in any language, stay apart from each other."""
    for _ in range(100):
        token = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        token.bind(("127.0.0.1", 0))
        port = token.getsockname()[1]
        if not has_multicast_route():
            token.close()  # the server itself will listen on it
            _say_once(
                f"ruedo: no multicast route here: launch() speaks LCM over TCP, LCM_DEFAULT_URL=tcpq://127.0.0.1:{port}"
            )
            return token, f"tcpq://127.0.0.1:{port}"
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(("0.0.0.0", port))  # exclusive: fails when any LCM program uses the port
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

    def __init__(
        self,
        command: list[str],
        token: socket.socket | _Folder | None,
        verbose: bool,
        folder: Any = None,
    ):
        self._command = command
        self._folder = folder  # of the world's file, when it is ours
        self._token = token
        self._said = ""  # by the end, its last lines
        try:
            with _room_for_files():
                self._output: IO[bytes] | None = None if verbose else tempfile.TemporaryFile()
        except LaunchError:
            if token:
                token.close()
            raise
        self._heard = 0  # bytes of it that warnings() has read
        self._warned: set[str] = set()
        try:
            # A session of its own: Ctrl-C in a terminal reaches the client alone, which may still
            # use the server.
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL if self._output else None,
                stderr=self._output,
                start_new_session=True,
            )
        except OSError as error:
            if token:
                token.close()
            raise LaunchError(f"{command[0]} cannot be started: {error.strerror}") from None
        assert self._process.stdin
        os.set_blocking(self._process.stdin.fileno(), False)

    def tell(self, line: str) -> None:
        """How far this client has come (progress.py). Where the pipe is full, a later line says it
        all."""
        pipe = self._process.stdin
        if pipe and not pipe.closed:
            with contextlib.suppress(OSError, ValueError):
                os.write(pipe.fileno(), line.encode())

    def warnings(self) -> list[str]:
        """The server's warnings since the last call, each once."""
        output = self._output
        if output is None:
            return []
        try:
            said = os.pread(output.fileno(), _MOST_HEARD, self._heard)
        except (OSError, ValueError):  # end() has closed it
            return []
        lines, newline, _ = said.rpartition(b"\n")
        self._heard += len(lines) + len(newline)
        news = [
            for_terminal(line)
            for line in lines.decode(errors="replace").splitlines()
            if line and not line.startswith("ruedo: info:")
        ]
        new = [line for line in dict.fromkeys(news) if line not in self._warned]
        if len(self._warned) < _MOST_WARNED:
            self._warned.update(new)
        return new

    def ended(self) -> str | None:
        """How the server ended, with the last lines it printed; None while it runs."""
        code = self._process.poll()
        if code is None:
            return None
        how = f"exit code {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"
        return f"the server ended ({how}): {self._last_lines() or 'it said nothing'}\n(`{' '.join(self._command)}`)"

    def is_done(self) -> bool:
        return self._process.poll() == 0

    def await_port(self, url: str, until: float) -> None:
        """Waits for a tcpq or unix server to listen. If it does not in time, connecting reports
        that.
        """
        address = read_address(url)
        if address.scheme == "udpm":
            return
        while time.monotonic() < until and self._process.poll() is None:
            if is_served(address):
                return
            time.sleep(0.005)
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
        if self._folder:
            self._folder.cleanup()
        if self._output:
            self._said = self._last_lines()
            self._output.close()
            self._output = None

    def forked(self) -> None:
        """For a fork's child: closes its end of the pipe, lest that keeps the server alive."""
        if self._process.stdin:
            self._process.stdin.close()

    def _last_lines(self) -> str:
        if self._output is None:
            return self._said
        end = os.fstat(self._output.fileno()).st_size
        last = os.pread(self._output.fileno(), 4000, max(0, end - 4000))
        return "\n".join(last.decode(errors="replace").strip().splitlines()[-12:])
