"""connect(), and the simulation: its robots, its time, and its control."""

from __future__ import annotations

import atexit
import logging
import math
import os
import struct
import sys
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Sequence
from types import TracebackType
from typing import Any, Literal

import numpy as np

from . import arguments, control, lcmtypes
from .address import is_claimed, resolve_url
from .bus import Bus, Subscription
from .control import Session, State
from .errors import NoServer, NotSupported, RuedoError, UnknownName
from .lockstep import Command, Observations, Stepper, observed
from .markers import message as made_markers
from .motion import Driver
from .robot import Robot
from .stream import Stream
from .transport import Transport, open_transport
from .world_info import Body, WorldInfo, WorldInfoAssembler

_SILENCE_SECONDS = 5.0
_CLOSED = "this simulation was closed"
_TICK = struct.Struct(">8sqq")  # fingerprint, utime, run_id
_TICK_FINGERPRINT = lcmtypes.tick_t._get_packed_fingerprint()
log = logging.getLogger("ruedo")


def connect(url: str | None = None, *, name: str | None = None, timeout: float = 2.0) -> Simulation:
    """Joins the simulation at an LCM URL.

    url: default LCM_DEFAULT_URL, else LCM's own default group and port with ttl 0.
    name: of this client, default "client-PID"; numbers of motion primitives derive from it.
    timeout: s of real time to wait for a server. Raises NoServer.
    """
    return Simulation(resolve_url(url), name or f"client-{os.getpid()}", timeout)


_all: weakref.WeakSet[Simulation] = weakref.WeakSet()


def _after_fork() -> None:
    """Connections are the parent's: its threads do not run here, and its server is not this
    process's to end.
    """
    for sim in list(_all):
        sim._closed = "this simulation is the parent process's: connect() again after a fork"
        sim._forked()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)


class Simulation:
    """A running simulation. Made by connect() or launch(); safe to use from any thread.

    Works as a context manager; close() (or leaving it) ends a server that launch() started.
    """

    def __init__(
        self,
        url: str,
        name: str,
        timeout: float,
        server_ended: Callable[[], str | None] = lambda: None,
        end_server: Callable[[], None] = lambda: None,
        transport: Transport | None = None,
        forked: Callable[[], None] = lambda: None,
        view: str | None = None,
    ):
        self.url = url
        self._view = view  # the address of its console
        self._server_ended = server_ended  # why a private server is gone, None while it runs
        self._end_server = end_server
        self._forked = forked
        self._news = threading.Condition()
        self._assembler = WorldInfoAssembler()
        self._known: WorldInfo | None = None
        self._fault: RuedoError | None = None
        self._utime = 0
        self._sleepers = 0  # who wait for sim time
        self._last_sign = time.monotonic()
        self._robots: dict[str, Robot] = {}
        self._session = Session(self, name)
        self._stepper = Stepper(self)
        self._ids = _name_hash(name) << 20  # two clients number their primitives apart
        self._streams: dict[tuple[str, Any], Stream[Any]] = {}  # by channel and form
        self._drivers: dict[str, Driver] = {}  # by robot
        self._repeating: set[Driver] = set()
        self._another_run = False  # is what the last tick was of
        self._asked = 0.0  # for info, s of time.monotonic()
        self._on_new_run: tuple[Subscription, ...] = ()
        self._wake = threading.Condition()
        self._repeater: threading.Thread | None = None
        self._closed = ""  # why: what every call says
        self._bus = Bus(transport or open_transport(url))
        atexit.register(self.close)
        _all.add(self)
        try:
            self._bus.subscribe("ruedo/info", self._on_info)
            self._bus.subscribe("ruedo/tick", self._on_tick)
            self._bus.subscribe("ruedo/reply", self._session.receive)
            self._bus.start()
            self._await_info(timeout)
        except BaseException:
            self.close()
            raise

    # What there is.

    @property
    def version(self) -> str:
        """Of the server."""
        return self._info.version

    @property
    def world(self) -> str:
        return self._info.world

    @property
    def seed(self) -> int:
        return self._info.seed

    @property
    def step_size(self) -> float:
        """Length of a step, s."""
        return self._info.step_us * 1e-6

    @property
    def time(self) -> float:
        """Sim time of the newest message that came, s."""
        return self._utime * 1e-6

    @property
    def paused(self) -> bool:
        """As ruedo/info last said it."""
        return self._info.paused

    @property
    def robots(self) -> list[Robot]:
        """All robots, in the order of the world file."""
        return [self.robot(name) for name in self._info.robots]

    @property
    def bodies(self) -> list[Body]:
        """All bodies that there are."""
        return list(self._info.bodies)

    def robot(self, name: str) -> Robot:
        """The robot of that name; UnknownName lists those that exist."""
        self._robot_info(name)
        with self._news:
            return self._robots.setdefault(name, Robot(self, name))

    def on_new_run(self, callback: Callable[[Simulation], None]) -> Subscription:
        """Calls callback(simulation) in the receiving thread when another server, or the same one
        started anew, answers at this address. Commands are not repeated into the new run, and
        primitives under way have ended."""
        subscription = Subscription(callback, "a new run", self._leave_new_run)
        self._check_open()
        with self._news:
            self._on_new_run += (subscription,)
        return subscription

    def _leave_new_run(self, subscription: Subscription) -> None:
        with self._news:
            self._on_new_run = tuple(one for one in self._on_new_run if one is not subscription)

    def sleep(self, seconds: float) -> None:
        """Waits until so much sim time has passed."""
        self._check_open()
        until = self._utime + round(seconds * 1e6)
        with self._news:
            self._sleepers += 1
            try:
                while self._utime < until:
                    self._news.wait(0.5)
                    self._check_server()
            finally:
                self._sleepers -= 1

    # Control. Every call raises NotSupported where the server has no such request, RequestError
    # when it refuses.

    def pause(self) -> None:
        """Stops sim time after the current step."""
        self._session.request(lcmtypes.request_t.PAUSE)

    def resume(self) -> None:
        self._session.request(lcmtypes.request_t.RESUME)

    def step(
        self, n: int = 1, commands: Sequence[Command] = (), timeout: float = 60.0
    ) -> Observations:
        """Takes n steps, at most timeout seconds of real time each time that nothing goes on, and
        returns what was seen.

        In lockstep (`ruedo run --lockstep N`): takes part from the first call on, grants n steps
        with their commands, and has every message of every step; the first call's observations
        begin with those of the state it found. n = 0 takes no step. Raises LeaseLost. Else: steps a
        paused simulation; there are no commands, and the messages are in the streams."""
        if self.lockstep:
            observations = self._stepper.step(n, commands, timeout)
            self._note_time(observations.utime)
            return observations
        if commands:
            raise NotSupported(
                "commands go with steps where the server runs in lockstep: start it with `ruedo run --lockstep N`"
            )
        if isinstance(n, bool) or not isinstance(n, (int, np.integer)):
            raise TypeError(
                f"n is {n!r}: it must be a whole number of steps; {self.step_size:g} s is one"
            )
        body = lcmtypes.step_request_t()
        body.steps = int(n)
        return observed(
            control.state_of(self._session.request(lcmtypes.request_t.STEP, body, timeout)), []
        )

    @property
    def lockstep(self) -> bool:
        """Whether the server runs in lockstep."""
        return bool(self._info.features >> lcmtypes.request_t.GRANT & 1)

    def set_rate(self, rate: float) -> None:
        """Sim time per real time, > 0; math.inf: as fast as it goes."""
        body = lcmtypes.rate_request_t()
        body.rate = rate
        self._session.request(lcmtypes.request_t.RATE, body)

    def show(self, width: int | str = "100%", height: int = 500) -> Any:
        """The console of a server that was launched with ``view=True``: in a notebook below the
        cell, elsewhere in the browser. Returns the notebook's frame, or the address."""
        if self._view is None:
            raise NotSupported("show() needs a console: launch(..., view=True)")
        if "IPython" in sys.modules and sys.modules["IPython"].get_ipython() is not None:
            from IPython.display import IFrame  # type: ignore[import-not-found, unused-ignore]

            return IFrame(self._view, width, height)
        import webbrowser

        webbrowser.open(self._view)
        return self._view

    def reset(self, what: Literal["all", "time", "poses"] = "all", seed: int | None = None) -> None:
        """Starts anew. what: "all" (equals a fresh run), "time" (sim time alone) or "poses"
        (everything back to where it started). seed: of what follows, None: the same again."""
        body = lcmtypes.reset_request_t()
        kinds = {"all": body.ALL, "time": body.TIME, "poses": body.POSES}
        if what not in kinds:
            raise ValueError(f"what is {what!r}: it must be one of {', '.join(map(repr, kinds))}")
        body.what, body.seed = kinds[what], -1 if seed is None else seed
        self._session.request(lcmtypes.request_t.RESET, body, 60.0)
        if what != "poses":
            self._utime = 0
        self._stepper.forget()

    def spawn(
        self,
        model: str = "",
        x: float = 0.0,
        y: float = 0.0,
        heading: float = 0.0,
        *,
        name: str = "",
        text: str = "",
        z: float | None = None,
    ) -> str:
        """Adds a model: one of Ruedo's ("p3at"), a file in the server's search folders, or SDF or
        URDF sent along as text. It stands on the ground below x, y (m), or at z (m) where that is
        given; heading in rad. The server refuses to put it into something. Returns the model's
        name: the server numbers one that is taken, unless it was asked for."""
        body = lcmtypes.spawn_request_t()
        body.name, body.on_ground = arguments.text("name", name), z is None
        body.model, body.text = arguments.text("model", model), arguments.text("text", text)
        body.position = [arguments.number(*one) for one in (("x", x), ("y", y), ("z", z or 0.0))]
        body.orientation = _about_z(arguments.number("heading", heading))
        before = self._known
        reply = self._session.request(lcmtypes.request_t.SPAWN, body, 60.0)
        self._refresh_info(before)
        return control.state_of(reply).name

    def remove(self, name: str) -> None:
        """Takes a model away."""
        before = self._known
        self._session.request(lcmtypes.request_t.REMOVE, _name_body(name))
        self._refresh_info(before)

    def set_pose(
        self,
        name: str,
        x: float,
        y: float,
        heading: float = 0.0,
        z: float = 0.0,
        orientation: Sequence[float] | None = None,
    ) -> None:
        """Puts a model at x, y, z (m), at rest. orientation: w, x, y, z instead of the heading
        (rad).
        """
        body = lcmtypes.set_pose_request_t()
        body.name = arguments.text("name", name)
        body.position = [arguments.number(*one) for one in (("x", x), ("y", y), ("z", z))]
        body.orientation = (
            _about_z(arguments.number("heading", heading))
            if orientation is None
            else arguments.numbers("orientation", orientation, 4)
        )
        self._session.request(lcmtypes.request_t.SET_POSE, body)

    def set_twist(
        self, name: str, linear: Sequence[float], angular: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> None:
        """Gives a model a velocity (m/s) and a turn rate (rad/s), in the world."""
        body = lcmtypes.set_twist_request_t()
        body.name = arguments.text("name", name)
        body.linear = arguments.numbers("linear", linear, 3)
        body.angular = arguments.numbers("angular", angular, 3)
        self._session.request(lcmtypes.request_t.SET_TWIST, body)

    def state(self, name: str = "") -> State:
        """Time, step and state hash, and pose and twist of a model or MODEL/LINK when one is
        named.
        """
        return control.state_of(
            self._session.request(lcmtypes.request_t.GET_STATE, _name_body(name))
        )

    def reset_odometry(self, robot: str) -> None:
        """Sets a robot's odometry to zero where it stands."""
        self._session.request(lcmtypes.request_t.RESET_ODOMETRY, _name_body(robot))

    def markers(
        self, layer: str, markers: Iterable[lcmtypes.marker_t] = (), frame: str = ""
    ) -> None:
        """Draws for people to see, in the web console and in the log: what `ruedo.markers` makes.

        layer: a name of your own; what is drawn takes the place of all that was in it, and nothing
        empties it. frame: a robot, with whose base_link it moves; "": the world.
        """
        message = made_markers(layer, markers, frame, self._utime)
        channel = next((c for c in self._info.channel_list if c.type == "markers_t"), None)
        if channel is None:
            raise NotSupported("this server takes no markers")
        self._bus.publish(channel.name, message.encode())

    def snapshot(self, name: str) -> State:
        """Saves the state under a name, in the folder that the server was started with
        (`--snapshots FOLDER`), and returns it. A snapshot is what acted on the world so far."""
        return control.state_of(
            self._session.request(lcmtypes.request_t.SNAPSHOT, _name_body(name), 60.0)
        )

    def restore(self, name: str) -> State:
        """Puts the world back to a snapshot; what follows equals what followed it. The server runs
        there from the beginning of the snapshot's run, in silence: this takes as long as that part
        takes at rate max. A new epoch."""
        state = control.state_of(
            self._session.request(lcmtypes.request_t.RESTORE, _name_body(name), 3600.0)
        )
        self._utime = state.utime
        self._stepper.forget()
        return state

    def quit(self) -> None:
        """Ends the server."""
        self._session.request(lcmtypes.request_t.QUIT)

    def close(self) -> None:
        """Leaves the simulation: repeated commands end, and so does a server that launch()
        started.
        """
        if self._closed:  # in a fork's child the lock may be held for ever
            return
        with self._wake:
            if self._closed:
                return
            self._closed = _CLOSED
            self._wake.notify_all()
        if self._known:
            self._session.leave()
        self._bus.close()
        self._end_server()
        atexit.unregister(self.close)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Simulation {self.world} at {self.url}: {self._closed or ', '.join(self._info.robots) or 'no robots'}>"

    # For the package's other files.

    @property
    def _info(self) -> WorldInfo:
        assert self._known is not None
        return self._known

    def _robot_info(self, name: str) -> Any:
        robots = self._info.robots
        if name not in robots:
            raise UnknownName(f"there is no robot {name!r}; there is {', '.join(robots) or 'none'}")
        return robots[name]

    def _next_id(self) -> int:
        with self._news:
            self._ids += 1
            return self._ids

    def _check_open(self) -> None:
        if self._closed:
            raise NoServer(self._closed)

    def _check_server(self) -> None:
        """Raises NoServer when the private server ended, or nothing was heard for long; a server
        gives a sign of life each second. One of this machine that is stopped, or in a debugger, is
        waited for."""
        self._check_open()
        ended = self._server_ended()
        if ended:
            raise NoServer(ended)
        if time.monotonic() - self._last_sign > _SILENCE_SECONDS and not is_claimed(self.url):
            raise NoServer(
                f"nothing was heard from the server at {self.url} for {_SILENCE_SECONDS:g} s"
            )

    def _what_is_known(self, rate: float) -> str:
        silence = time.monotonic() - self._last_sign
        if silence > 3.0:
            return f"nothing at all was heard from the server for {silence:.1f} s"
        if self._info.paused:
            return "the simulation is paused"
        return (
            f"its rate is {rate:g} Hz of sim time, which is now {self.time:.2f} s"
            if rate
            else "it sends when something happens"
        )

    def _note_time(self, utime: int) -> None:
        if utime > self._utime:
            self._utime = utime
        self._last_sign = time.monotonic()
        if self._sleepers:  # else a lock for each tick, of which a step() may bring hundreds
            with self._news:
                self._news.notify_all()

    def _stream(
        self, channel: Any, make: Callable[[], Stream[Any]], form: Any = None
    ) -> Stream[Any]:
        """The stream of a channel, made on first use. form: the key of its Form."""
        with self._news:
            known = self._streams.get((channel.name, form))
            if known is None or known.type != channel.type:  # the next run's may be another
                known = self._streams[channel.name, form] = make()
            return known

    def _driver(self, robot: str) -> Driver:
        self._check_open()
        with self._news:
            return self._drivers.setdefault(robot, Driver(self, robot))

    def _keep_repeating(self, driver: Driver) -> None:
        with self._wake:
            self._repeating.add(driver)
            if self._repeater is None:
                self._repeater = threading.Thread(
                    target=self._repeat, name="ruedo-repeat", daemon=True
                )
                self._repeater.start()
            self._wake.notify_all()

    def _repeat(self) -> None:
        """Feeds the watchdogs in real time."""
        period = 0.1
        while True:
            with self._wake:
                if not self._closed:
                    self._wake.wait(period)
                if self._closed:
                    return
                drivers = tuple(self._repeating)
            for driver in drivers if not self._another_run else ():
                driver.repeat()
            period = min((driver.period() for driver in drivers), default=0.1)

    def _end_drivers(self, names: list[str], reason: str) -> None:
        with self._news:
            drivers = [self._drivers.pop(name) for name in names]
        with self._wake:
            self._repeating.difference_update(drivers)
        for driver in drivers:
            driver.end(reason)

    def _forget_removed(self, info: WorldInfo) -> None:
        """No command is repeated to a robot that is gone, nor to the next one of its name."""
        with self._news:
            channels = {channel.name for channel in info.channel_list}
            gone = [name for name in self._drivers if name not in info.robots]
            streams = [
                self._streams.pop(key) for key in list(self._streams) if key[0] not in channels
            ]
            for name in [name for name in self._robots if name not in info.robots]:
                del self._robots[name]
        self._end_drivers(gone, "removed")
        for stream in streams:
            stream._end()

    def _begin_run(self) -> None:
        """The server was started anew, or another has taken its place."""
        with self._news:
            self._utime = 0
            drivers, streams, callbacks = (
                list(self._drivers),
                list(self._streams.values()),
                self._on_new_run,
            )
        self._end_drivers(drivers, "new run")
        for stream in streams:
            stream._forget()
        log.warning("another run has begun at %s: commands are not repeated into it", self.url)
        for callback in callbacks:
            callback._call(self)

    # The receiving thread.

    def _on_info(self, data: bytes) -> None:
        try:
            info = self._assembler.add(data)
        except RuedoError as error:
            with self._news:
                self._fault = error
                self._news.notify_all()
            return
        with self._news:
            before = self._known
            self._last_sign = time.monotonic()
            if info:
                self._known = info
                self._another_run = False
                if before and info.epoch != before.epoch:
                    self._utime = 0
            self._news.notify_all()
        if info:
            if before and info.epoch != before.epoch:
                for driver in list(self._drivers.values()):
                    driver.begin_epoch()
            self._forget_removed(info)
            if before and info.run_id != before.run_id:
                self._begin_run()

    def _on_tick(self, data: bytes) -> None:
        if len(data) < _TICK.size:
            return
        fingerprint, utime, run_id = _TICK.unpack_from(data)
        known = self._known
        if fingerprint != _TICK_FINGERPRINT or known is None:
            return
        self._another_run = run_id != known.run_id
        if self._another_run:  # it may be the server's next one
            if time.monotonic() - self._asked > 0.1:
                self._ask_info()
            return
        self._note_time(utime)
        self._stepper.on_tick(data)
        # Sim time may run a hundred times faster than real time: the watchdog is fed by its beat,
        # too.
        for driver in tuple(self._repeating):
            driver.repeat()

    def _await_info(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        with self._news:
            while self._known is None:
                if self._fault:
                    raise self._fault
                ended = self._server_ended()
                if ended:
                    raise NoServer(ended)
                if time.monotonic() >= deadline:
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
        self._bus.publish("ruedo/request", request.encode())

    def _refresh_info(self, before: WorldInfo | None = None) -> None:
        """Waits for another info than `before`, by default than the one that is known. The new one
        may be there already.
        """
        before, deadline = before or self._known, time.monotonic() + 10.0
        with self._news:
            while self._known is before and time.monotonic() < deadline:
                self._ask_info()
                self._news.wait(0.1)


def _name_hash(name: str) -> int:
    """31 bits of FNV-1a."""
    value = 2166136261
    for byte in name.encode():
        value = (value ^ byte) * 16777619 & 0xFFFFFFFF
    return value & 0x7FFFFFFF


def _name_body(name: str) -> Any:
    body = lcmtypes.name_request_t()
    body.name = arguments.text("name", name)
    return body


def _about_z(heading: float) -> list[float]:
    return [math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0)]
