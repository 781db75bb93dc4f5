"""connect(), and the simulation: its robots, its time, and its control."""

from __future__ import annotations

import contextlib
import math
import os
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from types import TracebackType
from typing import Any, Literal, TypeVar, overload

import numpy as np

from . import arguments, lcmtypes
from .bodies import Body, found
from .callbacks import Subscription
from .errors import NotSupported, RunEnded
from .in_step import Every
from .lockstep import Command, Observations, observed
from .markers import message as made_markers
from .requests import Requests
from .robot import Robot
from .samples import State
from .session import control
from .session.connection import Connection, PrivateServer
from .stream import Stream, synchronised
from .transport.address import resolve_url
from .transport.transport import Transport
from .world_info import WorldInfo

A = TypeVar("A")
B = TypeVar("B")
C = TypeVar("C")


def connect(url: str | None = None, *, name: str | None = None, timeout: float = 2.0) -> Simulation:
    """Joins the simulation at an LCM URL.

    url: default LCM_DEFAULT_URL, else LCM's own default group and port with ttl 0.
    name: of this client, default "client-PID"; numbers of motion primitives derive from it, and
    from the time in the simulation.
    timeout: s of real time to wait for a server. Raises NoServer.
    """
    at = resolve_url(None if url is None else arguments.text("url", url))
    own = "" if name is None else arguments.text("name", name)
    own = arguments.client_name(own or f"client-{os.getpid()}")
    return Simulation(at, own, arguments.number("timeout", timeout))


class Simulation(Requests):
    """A running simulation. Made by connect() or launch(); safe to use from any thread.

    Works as a context manager; close() (or leaving it) ends a server that launch() started.
    """

    def __init__(
        self,
        url: str,
        name: str,
        timeout: float,
        server: PrivateServer | None = None,
        transport: Transport | None = None,
        view: str | None = None,
    ):
        self.url = url
        self._view = view  # the address of its console
        self._connection = Connection(url, name, server, transport)
        self._session = self._connection.session
        self._lock = threading.Lock()  # of the robots
        self._robots: dict[str, Robot] = {}
        self._robots_of: WorldInfo | None = None  # the info that they are of
        try:
            self._connection.join(timeout)
        except BaseException:
            self.close()
            raise

    # Description.

    @property
    def version(self) -> str:
        """The version of the server."""
        return self._info.version

    @property
    def world(self) -> str:
        """Its name."""
        return self._info.world

    @property
    def seed(self) -> int:
        """The run's."""
        return self._info.seed

    @property
    def step_size(self) -> float:
        """Length of a step, s."""
        return self._info.step_us * 1e-6

    @property
    def time(self) -> float:
        """Sim time of the newest message that came, s."""
        return self._connection.clock.utime * 1e-6

    @property
    def paused(self) -> bool:
        """Whether the run is paused, by the latest ruedo/info."""
        return self._info.paused

    @property
    def robots(self) -> list[Robot]:
        """All robots, in the order of the world file."""
        return [self.robot(name) for name in self._info.robots]

    @property
    def bodies(self) -> list[Body]:
        """All bodies that there are."""
        return [replace(body, _simulation=self) for body in self._info.bodies]

    def body(self, name: str) -> Body:
        """A model ("crate"), or a part of it ("crate/lid"): its pose, its twist, and putting it
        elsewhere. UnknownName lists the models.
        """
        return found(self._info.bodies, arguments.text("name", name), self)

    def robot(self, name: str) -> Robot:
        """The robot of that name; UnknownName lists those that exist."""
        info = self._info
        self._connection.robot_info(arguments.text("name", name))
        with self._lock:
            if self._robots_of is not info:  # some may be gone
                self._robots = {n: r for n, r in self._robots.items() if n in info.robots}
                self._robots_of = info
            return self._robots.setdefault(name, Robot(self._connection, name))

    def on_new_run(self, callback: Callable[[Simulation], None]) -> Subscription:
        """Calls callback(simulation), in the thread of the callbacks, when another server, or the
        same one restarted, answers at this address. Commands are not repeated into the new run, and
        primitives under way have ended."""
        arguments.check_callback(callback)
        return self._connection.on_new_run(lambda: callback(self))

    def sleep(self, seconds: float) -> None:
        """Waits until so much sim time has passed. Warns where that stands still for 5 s of real
        time, and says why. Raises RunEnded."""
        self._connection.check_open()
        self._connection.sleep(round(arguments.finite("seconds", seconds) * 1e6))

    def every(self, period: float) -> Every:
        """A loop at a period of sim time (s): ``for t in sim.every(0.1)`` runs its body at each
        multiple of it, with the time (s) of that moment, and leaves out those that have passed
        while the loop's body ran. Ends with the run. ``async for`` takes it, too.
        """
        microseconds = round(arguments.finite("period", period) * 1e6)
        if microseconds < 1:
            raise ValueError(f"period is {period}: it must be a number of seconds above 0")
        return Every(self._connection, microseconds)

    @overload
    def synchronised(self, first: Stream[A], second: Stream[B], /) -> Iterator[tuple[A, B]]: ...

    @overload
    def synchronised(
        self, first: Stream[A], second: Stream[B], third: Stream[C], /
    ) -> Iterator[tuple[A, B, C]]: ...

    @overload
    def synchronised(
        self, first: Stream[Any], /, *others: Stream[Any]
    ) -> Iterator[tuple[Any, ...]]: ...

    def synchronised(
        self, first: Stream[Any], /, *others: Stream[Any]
    ) -> Iterator[tuple[Any, ...]]:
        """Streams joined by stamp: ``for scan, pose in sim.synchronised(robot.lrf, robot.pose)``
        has, with each sample of the first stream, what Stream.at() of the others gives for its
        time. A loop slower than the stream gets the newest sample each time. Ends with the run.
        """
        return synchronised(first, others)

    # Control. Every call raises NotSupported where the server has no such request, RequestError
    # when it refuses.

    def step(
        self, n: int = 1, commands: Sequence[Command] = (), timeout: float = 60.0
    ) -> Observations:
        """Takes n steps and returns what was observed in them. timeout: s of real time without
        progress, after which Timeout is raised.

        In lockstep (`ruedo run --lockstep N`): takes part from the first call on, grants n steps
        with their commands, and has every message of every step; the first call's observations
        begin with those of the state it found. n = 0 takes no step. Raises LeaseLost. Else: steps a
        paused simulation; there are no commands, and the messages are in the streams."""
        if self.lockstep:
            observations = self._connection.stepper.step(n, commands, timeout)
            self._connection.clock.note(observations.utime)
            return observations
        if commands:
            raise NotSupported(
                "commands go with steps where the server runs in lockstep: start it with `ruedo run --lockstep N`"
            )
        if isinstance(n, bool) or not isinstance(n, (int, np.integer)):
            raise TypeError(
                f"n is {arguments.shown(n)}: it must be a whole number of steps; {self.step_size:g} s is one"
            )
        body = lcmtypes.step_request_t()
        body.steps = int(n)
        self._connection.progress.wait()
        return observed(
            control.state_of(self._session.request(lcmtypes.request_t.STEP, body, timeout)), []
        )

    @property
    def lockstep(self) -> bool:
        """Whether the server runs in lockstep."""
        return self._connection.in_lockstep

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
        """Resets the world. what: "all" (equals a fresh run), "time" (sim time alone) or "poses"
        (everything back to where it started). seed: of what follows, None: the same again."""
        body = lcmtypes.reset_request_t()
        kinds = {"all": body.ALL, "time": body.TIME, "poses": body.POSES}
        if what not in kinds:
            raise ValueError(
                f"what is {arguments.shown(what)}: it must be one of {', '.join(map(repr, kinds))}"
            )
        body.what = kinds[what]
        body.seed = -1 if seed is None else arguments.whole("seed", seed)
        self._session.request(lcmtypes.request_t.RESET, body, 60.0)
        if what != "poses":
            self._connection.clock.reset()
        self._connection.stepper.forget()

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
        name: the server numbers a name that exists, unless the call gave it."""
        body = lcmtypes.spawn_request_t()
        body.name, body.on_ground = arguments.text("name", name), z is None
        body.model, body.text = arguments.text("model", model), arguments.text("text", text)
        body.position = [arguments.number(*one) for one in (("x", x), ("y", y), ("z", z or 0.0))]
        body.orientation = _about_z(arguments.number("heading", heading))
        before = self._info
        reply = self._session.request(lcmtypes.request_t.SPAWN, body, 60.0)
        self._connection.refresh_info(before)
        return control.state_of(reply).name

    def remove(self, name: str) -> None:
        before = self._info
        super().remove(name)
        self._connection.refresh_info(before)

    remove.__doc__ = Requests.remove.__doc__

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

    def markers(
        self, layer: str, markers: Iterable[lcmtypes.marker_t] = (), frame: str = ""
    ) -> None:
        """Draws for people to see, in the web console and in the log: what `ruedo.markers` makes.

        layer: a name of your own; what is drawn takes the place of all that was in it, and nothing
        empties it. frame: a robot, with whose base_link it moves; "": the world.
        """
        self._connection.check_open()
        message = made_markers(layer, markers, frame, self._connection.clock.utime)
        channel = next((c for c in self._info.channel_list if c.type == "markers_t"), None)
        if channel is None:
            raise NotSupported("this server does not accept markers")
        self._connection.bus.publish(channel.name, message.encode())

    def publish(self, channel: str, message: Any) -> None:
        """Sends a message to the server and to whoever listens at `url`: an object of a class that
        lcm-gen made, or its bytes. A command of the server's goes to the channel that its
        documentation names ("p3at/velocity"); in lockstep it belongs to step().
        """
        self._connection.check_open()
        data = message.encode() if hasattr(message, "encode") else message
        if isinstance(message, str) or not isinstance(data, bytes):
            raise TypeError(
                f"message is {arguments.shown(message)}: it must be of lcm-gen's, or its bytes"
            )
        self._connection.bus.publish(arguments.text("channel", channel), data)

    def save(self, name: str = "saved") -> State:
        """Keeps the state under a name, in the folder that the server was started with
        (``launch(..., snapshots=folder)``); restore() takes what it returns, as an Engine's does.
        """
        return replace(self.snapshot(name), name=name)

    def restore(self, name: str | State) -> State:
        state = super().restore(name.name if isinstance(name, State) else name)
        self._connection.clock.reset(state.utime)
        self._connection.stepper.forget()
        return state

    restore.__doc__ = f"{Requests.restore.__doc__}\n        It takes what save() returned, too."

    def quit(self) -> None:
        with contextlib.suppress(RunEnded):  # its last word may come before the reply, or without
            super().quit()

    quit.__doc__ = Requests.quit.__doc__

    def close(self) -> None:
        """Leaves the simulation: repeated commands end, and so does a server that launch()
        started. Returns when no callback runs any more; at once in a callback, a signal handler or
        a finalizer (__del__), where the end follows by itself. Raises what a callback raised and no
        call has raised since; while another exception is handled, it is printed instead.
        """
        self._connection.close(sys.exc_info()[1])

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._connection.close(error)

    def __repr__(self) -> str:
        return f"<Simulation {self.world} at {self.url}: {self._connection.closed or ', '.join(self._info.robots) or 'no robots'}>"

    @property
    def _info(self) -> WorldInfo:
        return self._connection.info


def _about_z(heading: float) -> list[float]:
    return [math.cos(heading / 2.0), 0.0, 0.0, math.sin(heading / 2.0)]
