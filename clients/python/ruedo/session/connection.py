"""The connection behind a Simulation: the bus, the session, what the server says of itself, and sim
time."""

from __future__ import annotations

import atexit
import contextlib
import itertools
import logging
import os
import struct
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from .. import lcmtypes
from ..arguments import shown
from ..callbacks import Callbacks, Subscription
from ..errors import NoServer, RuedoError, RunEnded, UnknownName
from ..lockstep import Stepper
from ..motion import Drivers
from ..stream import Streams
from ..transport.bus import Bus
from ..transport.transport import Transport, is_claimed, open_transport
from ..world_info import WorldInfo, WorldInfoAssembler, run_id_of
from .callback_queue import CallbackQueue
from .clock import Clock
from .control import REQUEST_CHANNEL, Session
from .program_end import CallbackFaults
from .progress import Progress, regression_at
from .run_watch import RunWatch
from .stack import is_in_another_call
from .standstill import Standstill

_SILENCE_SECONDS = 5.0
_ASK_AGAIN_SECONDS = 0.5
_LOOK_SECONDS = 1.0  # a stopped server keeps the connection of each look
_END_SECONDS = 10.0  # for another thread that closes
_CALLBACK_SECONDS = 5.0  # for a callback, at the program's end
_FAULT_SECONDS = 1.0
_LISTEN_SECONDS = 0.2
_CLOSED = "this simulation was closed"
_FORKED = "this simulation is the parent process's: connect() again after a fork"
_TICK = struct.Struct(">8sqqi")  # fingerprint, utime, run_id, epoch
_TICK_FINGERPRINT = lcmtypes.tick_t._get_packed_fingerprint()
log = logging.getLogger("ruedo")


class PrivateServer(Protocol):
    """A server that ends with its client."""

    def ended(self) -> str | None:
        """The reason why the server is gone; None while it runs."""

    def is_done(self) -> bool:
        """Whether it has ended in good order."""

    def end(self) -> None: ...

    def tell(self, line: str) -> None:
        """How far this client has come, which may be lost."""

    def warnings(self) -> list[str]:
        """The server's warnings since the last call."""

    def forked(self) -> None:
        """For a fork's child: leaves the server to the parent."""


class Connection:
    """A client's connection to a server, which streams, robots, motions and the façade Simulation
    share. Safe to use from any thread.

    server: a private one, which close() ends. transport: instead of the one that the URL names.
    Begins to receive with join().
    """

    def __init__(
        self,
        url: str,
        name: str,
        server: PrivateServer | None = None,
        transport: Transport | None = None,
    ):
        self.url = url
        self.closed = ""  # why: what every call says
        self.progress = Progress()
        self.clock = Clock(self.progress.use)
        self.callbacks = CallbackQueue()
        self.faults = CallbackFaults()
        self.session = Session(self, name)
        self.stepper = Stepper(self)
        self.streams = Streams()
        self.drivers = Drivers(self)
        self._server = server
        self._regression = None if server else regression_at(url)
        self._news = threading.Condition()
        self._assembler = WorldInfoAssembler()
        self._known: WorldInfo | None = None
        self._watch = RunWatch(self._tell_another_server)
        self._fault: RuedoError | None = None
        self._fault_at = 0.0  # s of time.monotonic(), of the first
        self._asked = 0.0  # for info, s of time.monotonic()
        self._looking = threading.Lock()
        self._look_at = 0.0  # for the server, again, s of time.monotonic()
        self._there = False  # as it was then
        self._ids = 0  # of the newest primitive
        self._over = ""  # the server's last word on the run
        self._new_run = Callbacks("a new run", keep=self.faults.note)
        self._closing = threading.Lock()  # its holder closes
        self._ended = threading.Event()  # all that close() ends
        self.bus = Bus(transport or open_transport(url))
        self.bus.before_turn = self._before_turn
        self._ends = threading.local()  # .utime: of the last motion that the thread awaited
        self._listen_at = 0.0  # to the server's warnings, s of time.monotonic()
        atexit.register(self._close_at_end)
        _all.add(self)

    def join(self, timeout: float) -> None:
        """Begins to receive, and waits for the server's info. Raises NoServer."""
        self.bus.subscribe("ruedo/info", self._on_info)
        self.bus.subscribe("ruedo/tick", self._on_tick)
        self.bus.subscribe("ruedo/reply", self.session.receive)
        self.bus.start()
        self._await_info(timeout)
        is_waited_for = self._server or self._regression
        self.callbacks.may_drop = not (is_waited_for or self.in_lockstep)
        if is_waited_for and not self.in_lockstep:
            self.progress.begin(is_waited_for.tell, self.info.epoch, self.clock.utime)
        self._ids = _ids_from(self.session.name, self.info)

    def close(self, during: BaseException | None = None) -> None:
        """Repeated commands end, and so does a private server. A second call waits for that, and so
        does the program's end. Raises what a callback raised, unless that was raised before.

        In a callback, a signal handler or a finalizer, what waits is left to a thread: this one may
        hold what the receiving thread waits for. during: an exception that is on its way.
        """
        if not self._close(None):
            return
        if during is None:
            self.faults.raise_kept()
        else:
            self.faults.print_kept()

    def _close_at_end(self) -> None:
        """Closes at the program's end, even while a callback does not return."""
        self._close(_CALLBACK_SECONDS)

    def _close(self, patience: float | None) -> bool:
        """Whether it has waited for the end. patience: s of real time for the callback that runs;
        None for ever."""
        if self.closed == _FORKED:
            return False
        may_wait = not (self.is_called_back or is_in_another_call())
        if not self._closing.acquire(blocking=False):
            if may_wait:
                self._ended.wait(_END_SECONDS)
            return may_wait
        self.closed = _CLOSED
        self.callbacks.stop()
        if may_wait:
            self._end_all(patience)
            return True
        closing = threading.Thread(target=self._end_all, name="ruedo-close", args=(0.0,))
        closing.daemon = False  # whatever this one is: the program's end waits for it
        try:
            closing.start()
        except RuntimeError:  # there are too many threads, or the program is at its end
            self._end_all(0.0)
        return False

    def __reduce__(self) -> Any:
        raise TypeError(
            "a simulation belongs to its process, and can be neither copied nor pickled: hand on its "
            f"url, {shown(self.url)}, and connect() there"
        )

    def server_has_ended(self) -> bool:
        """Whether that is certain. One that is looked for in vain just now has ended, too."""
        return bool(self._server and self._server.ended()) or not self.bus.is_connected

    def _end_all(self, patience: float | None) -> None:
        with contextlib.ExitStack() as ends:  # all of it, whatever interrupts one
            ends.callback(self._ended.set)
            ends.callback(atexit.unregister, self._close_at_end)
            if self._server:
                ends.callback(self._server.end)
            if self._regression:
                ends.callback(self._regression.close)
            ends.callback(self.callbacks.close, patience)
            ends.callback(self.bus.close, patience != 0.0)
            self.drivers.wake()
            if self._known:
                self.session.leave()

    def check_open(self) -> None:
        """At the beginning of a call, and while it waits. Raises NoServer, and what a callback
        raised."""
        self.check_callbacks()
        if self.closed:
            raise NoServer(self.closed)

    def check_callbacks(self) -> None:
        """Raises what one of them raised."""
        if not self.is_called_back:
            self.faults.raise_kept()

    def check_may_wait(self) -> None:
        """Before waiting for what the server sends. Raises NoServer; RuedoError in a callback:
        the server may wait for that.
        """
        self.check_open()
        if self.is_called_back:
            raise RuedoError(
                "a callback cannot wait for the server, which may wait for it to return: make this "
                "call in another thread"
            )

    @property
    def is_called_back(self) -> bool:
        """Whether this thread is in a callback."""
        return self.callbacks.runs_here or self.bus.handling

    def check_server(self) -> None:
        """Raises RunEnded when the run has, NoServer when the private server broke off, or nothing
        was heard for long; a server gives a sign of life each second. One of this machine that is
        stopped, or in a debugger, is waited for."""
        self.check_open()
        if self._over:
            raise RunEnded(self._over)
        self._check_private_server()
        if self.clock.silence() > _SILENCE_SECONDS and not self._is_there():
            raise NoServer(
                f"nothing was heard from the server at {self.url} for {_SILENCE_SECONDS:g} s"
            )

    def _is_there(self) -> bool:
        """Whether a server on this machine is, as of about a second ago."""
        with self._looking:
            if time.monotonic() >= self._look_at:
                self._there = is_claimed(self.url)
                self._look_at = time.monotonic() + _LOOK_SECONDS
            return self._there

    def sleep(self, duration: int) -> None:
        """duration: us of sim time."""
        self.check_may_wait()
        if duration > 0:
            self.progress.wait()
        standstill = self.standstill("sleep()")

        def check() -> None:
            self.check_server()
            standstill.look()

        self.clock.sleep(duration, check)

    def standstill(self, call: str) -> Standstill:
        """A watch for a call that waits for sim time, which says why it stands."""
        return Standstill(self.clock, call, lambda: self._why_it_stands(self.stepper.whose_turn()))

    def _why_it_stands(self, in_lockstep: str) -> str:
        silence = self.clock.silence()
        if silence > 3.0:
            return f"nothing at all was heard from the server for {silence:.1f} s"
        if self.info.paused:
            return "the simulation is paused"
        return in_lockstep if self.in_lockstep else ""

    def what_is_known(self, rate: float) -> str:
        """Why a stream of that rate (Hz) may be silent."""
        why = self._why_it_stands("")
        if why:
            return why
        if self.in_lockstep:
            return "in lockstep, sim time advances only in step(), whose observations have the samples, as in sim.step(20).latest(robot.lrf); it is at {self.clock.utime * 1e-6:.2f} s"
        return (
            f"its rate is {rate:g} Hz of sim time, which is now {self.clock.utime * 1e-6:.2f} s"
            if rate
            else "it sends when something happens"
        )

    @property
    def another_run(self) -> bool:
        """Whether the last sign of a run was of another one than this client's."""
        return self._watch.another

    @property
    def in_doubt(self) -> bool:
        """Whether messages may be of the next run, whose info has not arrived yet."""
        return self._watch.in_doubt

    # The server's own description.

    @property
    def info(self) -> WorldInfo:
        assert self._known is not None
        return self._known

    @property
    def version(self) -> str:
        """The version of the server."""
        return self.info.version

    @property
    def in_lockstep(self) -> bool:
        """Whether the clients say how far the run goes."""
        return bool(self.info.features >> lcmtypes.request_t.GRANT & 1)

    def robot_info(self, name: str) -> Any:
        """Raises UnknownName."""
        robots = self.info.robots
        if name not in robots:
            raise UnknownName(
                f"there is no robot {shown(name)}; there is {', '.join(robots) or 'none'}"
            )
        return robots[name]

    def refresh_info(self, before: WorldInfo | None = None) -> None:
        """Waits for another info than `before`, by default than the one that is known. The new one
        may be there already.
        """
        before, deadline = before or self._known, time.monotonic() + 10.0
        with self._news:
            while self._known is before and time.monotonic() < deadline:
                self._ask_info()
                self._news.wait(0.1)

    def on_new_run(self, callback: Callable[[], None]) -> Subscription:
        self.check_open()
        return self._new_run.add(callback)

    def next_id(self) -> int:
        """A number for a motion primitive."""
        with self._news:
            self._ids += 1
            return self._ids

    def _check_private_server(self) -> None:
        if self._server and (ended := self._server.ended()):
            raise (RunEnded if self._server.is_done() else NoServer)(ended)

    def _await_info(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        with self._news:
            while self._known is None:
                now = time.monotonic()
                # Beside what cannot be read there may be what can.
                if self._fault and now >= min(deadline, self._fault_at + _FAULT_SECONDS):
                    raise self._fault
                self._check_private_server()
                if now >= deadline:
                    raise NoServer(
                        f"no Ruedo server answered at {self.url} within {timeout:g} s. Is `ruedo run` started, "
                        "with the same --lcm or LCM_DEFAULT_URL? `ruedo doctor` looks for what is wrong"
                    )
                self._ask_info()
                self._news.wait(0.1)

    def _ask_info(self) -> None:
        self._asked = time.monotonic()
        request = lcmtypes.request_t()
        request.epoch, request.kind = -1, lcmtypes.request_t.INFO
        self.bus.publish(REQUEST_CHANNEL, request.encode())

    # The receiving thread.

    def _on_info(self, data: bytes) -> None:
        run_id = run_id_of(data)
        if (
            run_id is not None
            and self._known
            and not self.is_of_our_run(run_id, may_take_over=True)
        ):
            return
        try:
            info = self._assembler.add(data)
        except RuedoError as error:
            with self._news:
                self._fault_at = self._fault_at if self._fault else time.monotonic()
                self._fault = error
                self._news.notify_all()
            return
        self.clock.note_sign()
        with self._news:
            before = self._known
            new_epoch = bool(before and info and info.epoch != before.epoch)
            if info:
                self._known = info
                if new_epoch or not before:
                    self.clock.reset(info.utime)
            self._news.notify_all()
        if not info:
            return
        self.stepper.on_info(info)
        if new_epoch:
            self.drivers.begin_epoch()
        # No command is repeated to a robot that is gone, nor to the next one of its name.
        self.drivers.end_removed(info)
        self.streams.end_removed(info)
        if before and info.run_id != before.run_id:
            self._begin_run()

    def note_end(self, text: str) -> None:
        """The server's last word."""
        self._over = f"{text}, at {self.url}"

    def is_of_our_run(self, run_id: int, may_take_over: bool = False) -> bool:
        """Whether a message is of this client's run. may_take_over: or of its replacement."""
        known = self._known
        if known is None:
            return False
        if run_id == known.run_id:
            self._watch.hear_own()
            return True
        is_over = self._watch.hear_another(run_id) or bool(self._over)
        if time.monotonic() - self._asked > _ASK_AGAIN_SECONDS:  # which of the two is there
            self._ask_info()
        return is_over and may_take_over

    def _tell_another_server(self, run_id: int) -> None:
        log.warning(
            "another server is at %s, too, with run %d; this client is in run %d, world %s. Their samples mix, and commands reach both: start one of them with another --lcm port (shown once)",
            self.url,
            run_id,
            self.info.run_id,
            self.info.world,
        )

    def _begin_run(self) -> None:
        """The server was restarted, or another has taken its place."""
        self._over = ""
        self._watch.begin()
        self.clock.reset(self.info.utime)
        self.drivers.end_all("new run")
        self.streams.forget()
        log.warning("another run has begun at %s: commands are not repeated into it", self.url)
        if not self.closed:
            self.callbacks.put(self._new_run.call)

    def _on_tick(self, data: bytes) -> None:
        if len(data) < _TICK.size:
            return
        fingerprint, utime, run_id, epoch = _TICK.unpack_from(data)
        known = self._known
        if fingerprint != _TICK_FINGERPRINT or known is None:
            return
        if not self.is_of_our_run(run_id):
            return
        self.clock.note_tick(utime)
        self.stepper.on_tick(data)
        # Sim time may run a hundred times faster than real time: the watchdog is fed by its beat,
        # too.
        if self.drivers.repeating:  # else a call for each tick
            self.drivers.repeat_at(utime)
        if self.progress.is_told:
            self._note_progress(epoch, utime)

    def note_use(self) -> None:
        """This thread works with what is known now. A callback is waited for anyway."""
        if not self.is_called_back:
            self.progress.use(self.clock.utime)

    def begin_after(self, utime: int) -> None:
        """A motion ended then, and this thread knows: next() of any stream gives nothing older."""
        self._ends.utime = utime

    def not_before(self) -> int | None:
        """us of sim time, which may have been reset since."""
        utime: int | None = getattr(self._ends, "utime", None)
        return None if utime is None else min(utime, self.clock.utime)

    def _note_progress(self, epoch: int, utime: int) -> None:
        """Reports that everything up to that sim time has arrived and its callbacks have run."""
        if self.callbacks.is_idle:
            self.progress.received(epoch, utime)
        else:
            self.callbacks.put(lambda: self.progress.received(epoch, utime))

    def _before_turn(self) -> float:
        """Returns for how long the receiving thread may wait, s."""
        if self._server and time.monotonic() >= self._listen_at:
            self._listen_at = time.monotonic() + _LISTEN_SECONDS
            for warning in self._server.warnings():
                log.warning("the server: %s", warning)
        if not self.progress.in_use:
            return 0.1
        self.progress.say()
        return 0.01

    def _forked(self) -> None:
        self.closed = _FORKED
        self.faults = CallbackFaults()
        if self._server:
            self._server.forked()


_all: weakref.WeakSet[Connection] = weakref.WeakSet()


def _after_fork() -> None:
    """Connections are the parent's: its threads do not run here, and its server is not this
    process's to end.
    """
    for connection in list(_all):
        connection._forked()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


_joined: dict[int, Iterator[int]] = {}  # by run: counts the clients of this process that join it


def _ids_from(name: bytes, info: WorldInfo) -> int:
    """The first number of the primitives of a client that joins at that time: apart from others',
    and from those that an earlier start of the program left under way. Equal runs in lockstep
    have equal numbers, since their logs are compared.
    """
    value = 2166136261  # FNV-1a
    for byte in name:
        value = (value ^ byte) * 16777619 & 0xFFFFFFFF
    before = next(_joined.setdefault(info.run_id, itertools.count()))
    return (value + info.utime + before * 0x9E3779B1 & 0x7FFFFFFF) << 20  # far apart
